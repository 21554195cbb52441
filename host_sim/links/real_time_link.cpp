#include "controller_session.hpp"
#include "estimate_row.hpp"

#include "app/app.h"
#include "platform_file/estimator_code.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <deque>

namespace hexload::sim {

namespace {

constexpr std::chrono::milliseconds start_timeout{2000}; // a controller listens before it speaks
constexpr std::chrono::milliseconds finish_timeout{100};
constexpr int messages_per_tick = 8192; // of a flood; more than the answers to two seconds that come at once
constexpr std::uint32_t latest_answer_ticks = 1000; // an answer that is later is missing

// Answers that are due, oldest first: each one comes, or is counted as missing.
class AnswerAccount {
  public:
    void expect(std::uint32_t tick) {
        due_.push_back(tick);
        ++expected_;
        give_up_before(tick - latest_answer_ticks);
    }
    // Whether it counts as an answer: false when it was given up before.
    bool answered(std::uint32_t tick, std::uint32_t newest_tick) {
        give_up_before(tick);
        if (due_.empty() || due_.front() != tick) {
            return false;
        }
        due_.pop_front();
        ++answers_;
        late_ += newest_tick - tick > 1 ? 1U : 0U;
        return true;
    }
    void give_up_all() {
        missing_ += due_.size();
        due_.clear();
    }
    bool is_settled() const {
        return due_.empty();
    }
    void write_to(BusCounts& counts) const {
        counts.expected = expected_;
        counts.answers = answers_;
        counts.missing = missing_;
        counts.late = late_;
    }

  private:
    void give_up_before(std::uint32_t tick) {
        while (!due_.empty() && static_cast<std::int32_t>(tick - due_.front()) > 0) {
            due_.pop_front();
            ++missing_;
        }
    }

    std::deque<std::uint32_t> due_;
    std::uint64_t expected_ = 0;
    std::uint64_t answers_ = 0;
    std::uint64_t missing_ = 0;
    std::uint64_t late_ = 0;
};

class RealTimeLink final : public EstimatorLink {
  public:
    RealTimeLink(std::unique_ptr<ControllerWire> wire, const LinkSettings& settings)
        : session_(std::move(wire), settings), book_(settings.tick_s),
          // A sample that has not gone by then is given up.
          half_a_tick_(std::chrono::round<std::chrono::microseconds>(
              std::chrono::duration<double>(0.5 * settings.tick_s))) {}

    std::span<const std::string_view> parameter_names() const override {
        return load_parameter_names(session_.settings().estimator);
    }

    std::span<const std::string_view> own_sigma_names() const override {
        return session_.own_sigma_names();
    }

    void start() override {
        const auto timeout = std::max(start_timeout, session_.settings().answer_timeout);
        for (const auto kind :
             {HEXLOAD_COMMAND_RESET, HEXLOAD_COMMAND_SELECT_FILTER, HEXLOAD_COMMAND_START}) {
            session_.command(kind, argument_of(kind), timeout);
        }
        last_heard_ = session_.now();
    }

    std::span<const EstimateRow> step(const LegSample& sample) override;
    std::span<const EstimateRow> finish() override;

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
    std::optional<BusCounts> bus_counts() const override;

  private:
    float argument_of(hexload_bus_command_kind_t kind) const;
    void await_last_code();
    void take_what_is_there();
    void take(const BusNews& news);
    void take(const AnswerPart& part);
    void take(const hexload_bus_acknowledge_t& acknowledge);
    void take_state(std::uint8_t state, std::uint8_t fault);
    void command_if_stopped();
    void watch_bus();
    void watch_controller();

    ControllerSession session_;
    AnswerBook book_;
    std::chrono::microseconds half_a_tick_;
    AnswerAccount account_;
    std::vector<EstimateRow> rows_;
    std::optional<hexload_bus_command_kind_t>
        wanted_; // the command that gets a stopped controller going again
    std::optional<ControllerSession::Clock::time_point>
        last_command_; // nothing: none, or the next is due at once
    ControllerSession::Clock::time_point last_heard_{};
    std::uint32_t newest_tick_ = 0;
    bool was_up_ = true;
    bool is_silent_ = false;
    std::uint64_t samples_ = 0;
    std::uint64_t unsent_ = 0;
    std::uint64_t rejoins_ = 0;
    std::uint64_t outages_ = 0;
};

std::span<const EstimateRow> RealTimeLink::step(const LegSample& sample) {
    rows_.clear();
    newest_tick_ = sample.tick;
    ++samples_;
    if (!session_.send(sample, half_a_tick_)) {
        ++unsent_;
    } else if (session_.answers(sample.tick)) {
        account_.expect(sample.tick);
    }
    take_what_is_there();
    watch_bus();
    watch_controller();
    command_if_stopped();
    return rows_;
}

std::span<const EstimateRow> RealTimeLink::finish() {
    rows_.clear();
    const auto end = session_.now() + finish_timeout;
    for (auto time = session_.now(); !account_.is_settled() && time < end; time = session_.now()) {
        const auto left = std::chrono::ceil<std::chrono::microseconds>(end - time);
        if (const auto news = session_.read(left)) {
            take(*news);
        }
    }
    account_.give_up_all();
    session_.send_command(HEXLOAD_COMMAND_STOP, 0.0F);
    await_last_code();
    return rows_;
}

// It comes before the acknowledge of STOP.
void RealTimeLink::await_last_code() {
    const auto end = session_.now() + finish_timeout;
    for (auto time = session_.now(); session_.has_unproven_answers() && time < end; time = session_.now()) {
        session_.read(std::chrono::ceil<std::chrono::microseconds>(end - time));
    }
    if (session_.has_unproven_answers()) {
        session_.report("the last answers have no code of the controller's key");
    }
}

void RealTimeLink::take_what_is_there() {
    for (int n = 0; n < messages_per_tick; ++n) {
        const auto news = session_.read(std::chrono::microseconds{0});
        if (!news) {
            return;
        }
        take(*news);
    }
}

void RealTimeLink::take(const BusNews& news) {
    if (const auto* part = std::get_if<AnswerPart>(&news)) {
        take(*part);
    } else if (const auto* acknowledge = std::get_if<hexload_bus_acknowledge_t>(&news)) {
        take(*acknowledge);
    } else if (const auto* status = std::get_if<hexload_bus_controller_status_t>(&news)) {
        take_state(status->state, status->fault);
        book_.take(*status);
    } else if (const auto* change = std::get_if<hexload_bus_load_change_t>(&news)) {
        session_.report(fmt::format("another load is detected at tick {}", change->tick));
    }
}

void RealTimeLink::take(const AnswerPart& part) {
    if (is_silent_) {
        session_.report(fmt::format("the controller answers again at tick {}", newest_tick_));
        is_silent_ = false;
    }
    last_heard_ = session_.now();
    const bool counts = !part.ends_tick || account_.answered(part.answered_tick, newest_tick_);
    if (part.whole) {
        take_state(part.whole->state, part.whole->fault);
        if (!session_.is_of_estimator(*part.whole)) { // it was started anew, and not by this simulator
            wanted_ = wanted_.value_or(HEXLOAD_COMMAND_RESET);
        } else if (const auto row = book_.take(*part.whole);
                   row && counts) { // what counts as missing has no row
            rows_.push_back(*row);
        }
    }
}

void RealTimeLink::take(const hexload_bus_acknowledge_t& acknowledge) {
    if (acknowledge.result != HEXLOAD_RESULT_DONE) {
        return; // overtaken by an earlier one; the state that it reports counts
    }
    if (acknowledge.kind == HEXLOAD_COMMAND_START && wanted_ == HEXLOAD_COMMAND_START) {
        ++rejoins_;
        wanted_.reset();
        session_.report(fmt::format("the controller has been started again at tick {}", newest_tick_));
    } else if (acknowledge.kind == HEXLOAD_COMMAND_RESET && wanted_ == HEXLOAD_COMMAND_RESET) {
        wanted_ = HEXLOAD_COMMAND_SELECT_FILTER;
        last_command_.reset();
    } else if (acknowledge.kind == HEXLOAD_COMMAND_SELECT_FILTER &&
               wanted_ == HEXLOAD_COMMAND_SELECT_FILTER) {
        wanted_ = HEXLOAD_COMMAND_START;
        last_command_.reset();
    }
}

void RealTimeLink::take_state(std::uint8_t state, std::uint8_t fault) {
    session_.refuse_fault(fault, false);
    if (state == HEXLOAD_APP_FAULT) {
        wanted_ = HEXLOAD_COMMAND_RESET;
    } else if (state == HEXLOAD_APP_IDLE && wanted_ != HEXLOAD_COMMAND_START) {
        wanted_ = HEXLOAD_COMMAND_SELECT_FILTER;
    }
}

float RealTimeLink::argument_of(hexload_bus_command_kind_t kind) const {
    switch (kind) {
    case HEXLOAD_COMMAND_SELECT_FILTER:
        return static_cast<float>(kind_of(session_.settings().estimator));
    case HEXLOAD_COMMAND_START:
        return static_cast<float>(HEXLOAD_PACING_REAL_TIME);
    default:
        return 0.0F;
    }
}

void RealTimeLink::command_if_stopped() {
    const auto time = session_.now();
    if (!wanted_ || (last_command_ && time - *last_command_ < ControllerSession::command_repeat)) {
        return;
    }
    last_command_ = time;
    session_.send_command(*wanted_, argument_of(*wanted_));
}

void RealTimeLink::watch_bus() {
    const bool is_up = session_.is_up();
    if (was_up_ && !is_up) {
        ++outages_;
        session_.report(fmt::format("the bus is down since tick {}", newest_tick_));
    } else if (!was_up_ && is_up) {
        session_.report(fmt::format("the bus is up again at tick {}", newest_tick_));
    }
    was_up_ = is_up;
}

void RealTimeLink::watch_controller() {
    if (!is_silent_ && session_.now() - last_heard_ > session_.settings().answer_timeout) {
        is_silent_ = true;
        const auto answered = session_.last_answered();
        session_.report(fmt::format("the controller is silent since tick {}", answered ? *answered + 1 : 0U));
    }
}

std::optional<BusCounts> RealTimeLink::bus_counts() const {
    BusCounts counts = session_.counts();
    account_.write_to(counts);
    counts.samples = samples_;
    counts.unsent = unsent_;
    counts.rejoins = rejoins_;
    counts.outages = outages_;
    counts.ends_silent = is_silent_;
    return counts;
}

} // namespace

std::unique_ptr<EstimatorLink> make_real_time_link(std::unique_ptr<ControllerWire> wire,
                                                   const LinkSettings& settings) {
    return std::make_unique<RealTimeLink>(std::move(wire), settings);
}

} // namespace hexload::sim
