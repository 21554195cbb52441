#include "controller_session.hpp"
#include "estimate_row.hpp"

#include "app/app.h"
#include "platform_file/estimator_code.hpp"

#include <fmt/format.h>

namespace hexload::sim {

namespace {

constexpr std::chrono::seconds send_deadline{1}; // a full queue empties itself long before

class LockstepLink final : public EstimatorLink {
  public:
    LockstepLink(std::unique_ptr<ControllerWire> wire, const LinkSettings& settings)
        : session_(std::move(wire), settings), book_(settings.tick_s) {}

    std::span<const std::string_view> parameter_names() const override {
        return load_parameter_names(session_.settings().estimator);
    }

    std::span<const std::string_view> own_sigma_names() const override {
        return session_.own_sigma_names();
    }

    void start() override {
        const LinkSettings& settings = session_.settings();
        const auto filter = static_cast<float>(kind_of(settings.estimator));
        session_.command(HEXLOAD_COMMAND_RESET, 0.0F, settings.answer_timeout);
        session_.command(HEXLOAD_COMMAND_SELECT_FILTER, filter, settings.answer_timeout);
        session_.command(HEXLOAD_COMMAND_START, HEXLOAD_PACING_LOCKSTEP, settings.answer_timeout);
    }

    std::span<const EstimateRow> step(const LegSample& sample) override {
        row_.reset();
        if (!session_.send(sample, send_deadline)) {
            session_.fail(LinkFailure::bus_down,
                          fmt::format("tick {} cannot be sent: {}", sample.tick,
                                      session_.is_up() ? "the queue stays full" : "the bus is down"));
        }
        ++samples_;
        if (session_.answers(sample.tick)) {
            await_answer(sample.tick);
            ++answers_;
        }
        return row_ ? std::span<const EstimateRow>(&*row_, 1) : std::span<const EstimateRow>();
    }

    std::span<const EstimateRow> finish() override {
        session_.command(HEXLOAD_COMMAND_STOP, 0.0F, session_.settings().answer_timeout);
        if (session_.has_unproven_answers()) {
            session_.fail(LinkFailure::second_controller,
                          "the last answers have no code of the controller's key: somebody else answers in "
                          "its place, or it was lost");
        }
        return {};
    }

    std::uint32_t refused() const override {
        return book_.refused();
    }
    std::string last_refusal() const override {
        return book_.last_refusal();
    }
    std::vector<HealthCount> health_counts() const override {
        return book_.health_counts();
    }

    std::vector<InputFault> input_faults() const override {
        return book_.input_faults().all();
    }
    std::string input_fault() const override {
        return book_.input_faults().words();
    }

    std::vector<double> load_changes_s() const override {
        return session_.load_changes_s();
    }

    std::optional<BusCounts> bus_counts() const override {
        BusCounts counts = session_.counts();
        counts.samples = samples_;
        counts.expected = answers_;
        counts.answers = answers_;
        return counts;
    }

  private:
    void await_answer(std::uint32_t tick);
    bool is_answered_by(const BusNews& news, std::uint32_t tick);
    void check_state(std::uint8_t state, std::uint8_t fault, std::uint32_t tick) const;
    [[noreturn]] void fail_silent(std::uint32_t tick) const;

    ControllerSession session_;
    AnswerBook book_;
    std::optional<EstimateRow> row_;
    std::uint64_t samples_ = 0;
    std::uint64_t answers_ = 0;
};

void LockstepLink::await_answer(std::uint32_t tick) {
    const auto end = session_.now() + session_.settings().answer_timeout;
    auto left = session_.settings().answer_timeout;
    while (left.count() > 0) {
        if (const auto news = session_.read(left); news && is_answered_by(*news, tick)) {
            return;
        }
        if (!session_.is_up()) {
            session_.fail(LinkFailure::bus_down, fmt::format("the bus went down at tick {}", tick));
        }
        left = std::chrono::ceil<std::chrono::milliseconds>(end - session_.now());
    }
    fail_silent(tick);
}

bool LockstepLink::is_answered_by(const BusNews& news, std::uint32_t tick) {
    if (const auto* status = std::get_if<hexload_bus_controller_status_t>(&news)) {
        check_state(status->state, status->fault, tick);
        book_.take(*status);
    }
    const auto* part = std::get_if<AnswerPart>(&news);
    if (part == nullptr) {
        return false;
    }
    if (part->answered_tick != tick) {
        session_.fail(LinkFailure::controller_fault,
                      fmt::format("answer out of order: found one to tick {}, expected tick {}",
                                  part->answered_tick, tick));
    }
    if (part->whole) {
        check_state(part->whole->state, part->whole->fault, tick);
        if (!session_.is_of_estimator(*part->whole)) {
            session_.fail(LinkFailure::controller_fault,
                          fmt::format("the answer to tick {} is another estimator's than the one selected",
                                      part->whole->tick));
        }
        row_ = book_.take(*part->whole);
    }
    return part->ends_tick;
}

void LockstepLink::check_state(std::uint8_t state, std::uint8_t fault, std::uint32_t tick) const {
    session_.refuse_fault(fault, true);
    if (state == HEXLOAD_APP_IDLE) {
        const std::string& other = session_.other_commander();
        const std::string reason = other.empty() ? "it was restarted, or another program commands it"
                                                 : other + " commands it: end one of the two";
        session_.fail(LinkFailure::controller_fault,
                      fmt::format("the controller has stopped at tick {}: {}", tick, reason));
    }
}

void LockstepLink::fail_silent(std::uint32_t tick) const {
    const auto answered = session_.last_answered();
    const std::string last = answered ? fmt::format("last answer to tick {}", *answered) : "no answer so far";
    const char* parts = session_.incomplete_answers() > 0 ? "; an answer has lost frames on the bus" : "";
    session_.fail(LinkFailure::silent_controller,
                  fmt::format("the controller is silent since tick {} ({}){}", tick, last, parts));
}

} // namespace

std::unique_ptr<EstimatorLink> make_lockstep_link(std::unique_ptr<ControllerWire> wire,
                                                  const LinkSettings& settings) {
    return std::make_unique<LockstepLink>(std::move(wire), settings);
}

} // namespace hexload::sim
