// What both ways of running over a bus share: commands and their acknowledges, samples out, answers in, and
// the signs of a controller that is not the one expected.
#pragma once

#include "bus_link.hpp"
#include "estimate_row.hpp"

#include <bitset>
#include <optional>

namespace hexload::sim {

class ControllerSession {
  public:
    using Clock = std::chrono::steady_clock;
    static constexpr std::chrono::milliseconds command_repeat{100};

    ControllerSession(std::unique_ptr<ControllerWire> wire, const LinkSettings& settings);

    // Sends a command again and again until it is acknowledged. Throws LinkError: no acknowledge until the
    // time-out, refused, wrong profile.
    void command(hexload_bus_command_kind_t kind, float argument, std::chrono::milliseconds timeout);

    // Sends it once; the acknowledge comes as news.
    void send_command(hexload_bus_command_kind_t kind, float argument);

    // False: the bus did not take all of it. Waits for room in its queue, `deadline` at most.
    bool send(const LegSample& sample, std::chrono::microseconds deadline);

    // What comes next; nothing when nothing came in time. Throws LinkError for what the one controller of
    // this profile would not send.
    std::optional<BusNews> read(std::chrono::microseconds timeout);

    // Whether an answer is of the estimator that the controller is to run.
    bool is_of_estimator(const hexload_bus_answer_t& answer) const;

    // Throws LinkError for faults that a new start does not mend, and for all when `any` is set.
    void refuse_fault(std::uint8_t fault, bool any) const;

    bool is_up() const {
        return wire_->is_up();
    }
    // Whether the controller is to answer the sample of this tick.
    bool answers(std::uint32_t tick) const {
        return wire_->answers(tick);
    }
    // Newest tick whose answer has come: all of it (FD), or its page (classic).
    std::optional<std::uint32_t> last_answered() const {
        return last_answered_;
    }
    std::uint64_t incomplete_answers() const {
        return wire_->incomplete_answers();
    }
    bool has_unproven_answers() const {
        return wire_->has_unproven_answers();
    }
    Clock::time_point now() const {
        return settings_.now();
    }
    // Names of the parameters of which answers have the filter's part of sigma.
    std::span<const std::string_view> own_sigma_names() const;

    const LinkSettings& settings() const {
        return settings_;
    }

    // The message begins with the name of the bus.
    [[noreturn]] void fail(LinkFailure failure, const std::string& message) const;
    void report(const std::string& message) const;

    // When the controller detected a load change, by its events.
    const std::vector<double>& load_changes_s() const {
        return load_changes_s_;
    }

    // Who else commands the controller, in words; empty: nobody was heard.
    const std::string& other_commander() const {
        return other_;
    }

    // The bus's own counters and those of the events, the others zero.
    BusCounts counts() const;

  private:
    bool is_own(const hexload_bus_acknowledge_t& acknowledge) const;
    void note_other(const hexload_bus_acknowledge_t& acknowledge);
    void check_acknowledge(const hexload_bus_acknowledge_t& acknowledge);
    [[noreturn]] void fail_refused(const hexload_bus_acknowledge_t& acknowledge) const;
    [[noreturn]] void fail_unacknowledged(hexload_bus_command_kind_t kind,
                                          std::chrono::milliseconds timeout) const;
    void note_stale();
    void note_answered(const AnswerPart& part);
    void note_refusals(const AnswerPart& part);
    void note_load_change(const hexload_bus_load_change_t& change);

    std::unique_ptr<ControllerWire> wire_;
    LinkSettings settings_;
    std::uint32_t newest_tick_ = 0;
    std::optional<std::uint32_t> last_answered_;
    std::uint8_t sequence_ = 0;
    bool is_unauthenticated_ = false; // since the last command, and not by another's
    std::bitset<256> acknowledged_;   // by sequence number of the command
    int stale_ = 0;                   // frames: two up for each, one down for one that says something new
    bool refuses_ = false;            // frames, by the last answer
    std::string other_;               // who else commands the controller; empty: nobody so far
    std::vector<double> load_changes_s_;
    std::uint32_t changes_counted_ = 0; // by the controller since its start
    std::uint64_t events_missing_ = 0;
};

// The part of an EstimatorLink that is the same in lockstep and in real time.
class AnswerBook {
  public:
    explicit AnswerBook(double tick_s) : tick_s_(tick_s) {}

    // The row of an answer, unless its sample was refused or nothing is being estimated.
    std::optional<EstimateRow> take(const hexload_bus_answer_t& answer);

    std::uint32_t refused() const {
        return refused_;
    }
    std::string last_refusal() const;
    std::vector<HealthCount> health_counts() const;

    // Classic answers have no input fault: the controller's status has.
    void take(const hexload_bus_controller_status_t& status);
    const InputFaultBook& input_faults() const {
        return input_faults_;
    }

  private:
    double tick_s_;
    InputFaultBook input_faults_;
    std::uint32_t refused_ = 0;
    std::uint32_t health_count_[HEXLOAD_HEALTH_BITS]{};
    hexload_status_t last_status_ = HEXLOAD_OK;
};

} // namespace hexload::sim
