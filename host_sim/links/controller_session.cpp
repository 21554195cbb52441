#include "controller_session.hpp"

#include "estimate_row.hpp"

#include "app/node.h"
#include "platform_file/estimator_code.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <random>

namespace hexload::sim {

namespace {

const char* name_of(hexload_bus_command_kind_t kind) {
    switch (kind) {
    case HEXLOAD_COMMAND_START:
        return "START";
    case HEXLOAD_COMMAND_STOP:
        return "STOP";
    case HEXLOAD_COMMAND_RESET:
        return "RESET";
    case HEXLOAD_COMMAND_SELECT_FILTER:
        return "SELECT_FILTER";
    default:
        return "command";
    }
}

LinkFailure failure_of(hexload_app_fault_t fault) {
    switch (fault) {
    case HEXLOAD_FAULT_SECOND_CONTROLLER:
        return LinkFailure::second_controller;
    case HEXLOAD_FAULT_WRONG_PROFILE:
        return LinkFailure::wrong_profile;
    case HEXLOAD_FAULT_BUS_DOWN:
        return LinkFailure::bus_down;
    default:
        return LinkFailure::controller_fault;
    }
}

const char* name_of(hexload_bus_source_t source) {
    switch (source) {
    case HEXLOAD_SOURCE_SIMULATOR:
        return "another simulator";
    case HEXLOAD_SOURCE_MONITOR:
        return "a live page";
    default:
        return "another program";
    }
}

bool ends_with_new_start(hexload_app_fault_t fault) {
    return fault == HEXLOAD_FAULT_NONE || fault == HEXLOAD_FAULT_SAMPLE_TIMEOUT ||
           fault == HEXLOAD_FAULT_BUS_DOWN;
}

constexpr int sequences = 16;  // of commands, on a CAN bus
constexpr int most_stale = 12; // in the balance with what is new

bool has_input_implausible(std::uint32_t health_bits) {
    return (health_bits >> HEXLOAD_HEALTH_INPUT_IMPLAUSIBLE & 1U) != 0;
}

} // namespace

std::uint16_t draw_session() {
    std::random_device source;
    return static_cast<std::uint16_t>(
        std::uniform_int_distribution<unsigned>(0, HEXLOAD_BUS_SESSIONS - 1)(source));
}

ControllerSession::ControllerSession(std::unique_ptr<ControllerWire> wire, const LinkSettings& settings)
    : wire_(std::move(wire)), settings_(settings) {}

void ControllerSession::fail(LinkFailure failure, const std::string& message) const {
    throw LinkError(failure, wire_->name() + ": " + message);
}

void ControllerSession::report(const std::string& message) const {
    settings_.report(wire_->name() + ": " + message);
}

void ControllerSession::send_command(hexload_bus_command_kind_t kind, float argument) {
    sequence_ = static_cast<std::uint8_t>((sequence_ + 1) % sequences);
    acknowledged_.reset(sequence_);
    wire_->send(hexload_bus_command_t{.kind = static_cast<std::uint8_t>(kind),
                                      .source = HEXLOAD_SOURCE_SIMULATOR,
                                      .session = settings_.session,
                                      .sequence = sequence_,
                                      .argument = argument,
                                      .configuration = settings_.configuration});
}

void ControllerSession::command(hexload_bus_command_kind_t kind, float argument,
                                std::chrono::milliseconds timeout) {
    const auto end = now() + timeout;
    auto next = now();
    is_unauthenticated_ = false;
    for (auto time = next; time < end; time = now()) {
        if (time >= next) {
            send_command(kind, argument);
            next += command_repeat;
        }
        const auto wait = std::chrono::ceil<std::chrono::microseconds>(std::min(next, end) - time);
        const auto news = read(std::max(wait, std::chrono::microseconds{1}));
        const auto* acknowledge = news ? std::get_if<hexload_bus_acknowledge_t>(&*news) : nullptr;
        if (acknowledge != nullptr && acknowledge->kind == HEXLOAD_COMMAND_CHALLENGE) {
            fail(LinkFailure::controller_fault, "the controller has no key: start it with --key too, or this "
                                                "simulator without");
        }
        if (acknowledge == nullptr || acknowledge->kind != kind) {
            continue;
        }
        if (acknowledge->result == HEXLOAD_RESULT_NOT_AUTHENTICATED && wire_->has_key()) {
            is_unauthenticated_ = true; // another's frames came in between, or it has another key
            continue;
        }
        if (acknowledge->result != HEXLOAD_RESULT_DONE) {
            fail_refused(*acknowledge);
        }
        return;
    }
    fail_unacknowledged(kind, timeout);
}

void ControllerSession::fail_unacknowledged(hexload_bus_command_kind_t kind,
                                            std::chrono::milliseconds timeout) const {
    if (!is_up()) {
        fail(LinkFailure::bus_down, "the bus is down");
    }
    if (is_unauthenticated_) {
        fail(LinkFailure::controller_fault,
             fmt::format("the controller refuses {} as not authenticated: give "
                         "both the same key file (--key)",
                         name_of(kind)));
    }
    fail(LinkFailure::silent_controller,
         fmt::format(
             "no controller acknowledges {} within {} ms: is hexload_ecu, or the controller, running there?",
             name_of(kind), timeout.count()));
}

void ControllerSession::fail_refused(const hexload_bus_acknowledge_t& acknowledge) const {
    refuse_fault(acknowledge.fault, true);
    const auto result = static_cast<hexload_bus_result_t>(acknowledge.result);
    const char* remedy = "";
    if (result == HEXLOAD_RESULT_OTHER_CONFIGURATION) {
        remedy = ": its machine, tuning or known mass is not this simulator's; give both the same "
                 "platform and rig files and options, or this one --any-configuration";
    } else if (result == HEXLOAD_RESULT_NOT_AUTHENTICATED) {
        remedy = ": it has a key; give this simulator the same key file (--key)";
    }
    fail(LinkFailure::controller_fault,
         fmt::format("the controller refuses {}: {}{}",
                     name_of(static_cast<hexload_bus_command_kind_t>(acknowledge.kind)),
                     hexload_bus_result_name(result), remedy));
}

bool ControllerSession::send(const LegSample& sample, std::chrono::microseconds deadline) {
    newest_tick_ = sample.tick;
    return wire_->send(sample, deadline);
}

std::optional<BusNews> ControllerSession::read(std::chrono::microseconds timeout) {
    auto news = wire_->read(timeout);
    if (news) {
        if (std::holds_alternative<StaleFrame>(*news)) {
            note_stale();
        } else if (const auto* part = std::get_if<AnswerPart>(&*news)) {
            stale_ = std::max(0, stale_ - 1);
            note_answered(*part);
            note_refusals(*part);
        } else if (const auto* acknowledge = std::get_if<hexload_bus_acknowledge_t>(&*news)) {
            if (!is_own(*acknowledge)) {
                note_other(*acknowledge);
                return UnrelatedFrame{};
            }
            check_acknowledge(*acknowledge);
        } else if (const auto* change = std::get_if<hexload_bus_load_change_t>(&*news)) {
            note_load_change(*change);
        }
    }
    return news;
}

// The count goes up by one with each event, and from 0 again after a start of the controller.
void ControllerSession::note_load_change(const hexload_bus_load_change_t& change) {
    const std::uint32_t before = change.load_changes > changes_counted_ ? changes_counted_ : 0;
    events_missing_ += change.load_changes > before ? change.load_changes - before - 1U : 0U;
    changes_counted_ = change.load_changes;
    load_changes_s_.push_back(time_of_tick_s(change.tick, settings_.tick_s));
}

bool ControllerSession::is_of_estimator(const hexload_bus_answer_t& answer) const {
    return answer.filter == hexload_bus_filter_of(kind_of(settings_.estimator));
}

BusCounts ControllerSession::counts() const {
    BusCounts counts = wire_->counts();
    counts.events_missing = events_missing_;
    return counts;
}

// A second controller that does as the first is told by it: all frames come twice. A network that delivers
// some twice, or late, does it to less than half of them.
void ControllerSession::note_stale() {
    stale_ += 2;
    if (stale_ >= most_stale) {
        fail(LinkFailure::second_controller,
             fmt::format("all that the controller sends comes twice, or late, near tick {}: a second "
                         "controller is on the bus",
                         newest_tick_));
    }
}

void ControllerSession::note_answered(const AnswerPart& part) {
    if (last_answered_ == part.answered_tick) {
        fail(LinkFailure::second_controller,
             fmt::format("two answers to tick {}: a second controller is on the bus", part.answered_tick));
    }
    if (part.ends_tick) {
        last_answered_ = part.answered_tick;
    }
}

// Samples that lack their code are in the estimate already, and its verdict does not tell.
void ControllerSession::note_refusals(const AnswerPart& part) {
    if (!part.whole) {
        return;
    }
    const bool refuses = (part.whole->health >> HEXLOAD_HEALTH_FRAMES_REFUSED & 1U) != 0;
    if (refuses && !refuses_) {
        report(fmt::format("the controller refuses frames near tick {}: damaged, another's, or samples lack "
                           "the code of its key",
                           part.answered_tick));
    }
    refuses_ = refuses;
}

bool ControllerSession::is_own(const hexload_bus_acknowledge_t& acknowledge) const {
    return acknowledge.source == HEXLOAD_SOURCE_SIMULATOR && acknowledge.session == settings_.session;
}

void ControllerSession::note_other(const hexload_bus_acknowledge_t& acknowledge) {
    const std::string other =
        fmt::format("{} (session {})", name_of(static_cast<hexload_bus_source_t>(acknowledge.source)),
                    acknowledge.session);
    if (other != other_) {
        other_ = other;
        report(fmt::format("{} commands the controller too, since tick {}", other_, newest_tick_));
    }
}

void ControllerSession::check_acknowledge(const hexload_bus_acknowledge_t& acknowledge) {
    if (acknowledge.result == HEXLOAD_RESULT_NOT_AUTHENTICATED) {
        return; // of whoever sends this one's Command again
    }
    if (acknowledged_.test(acknowledge.sequence)) {
        fail(LinkFailure::second_controller,
             "two acknowledges of one command: a second controller is on the bus");
    }
    acknowledged_.set(acknowledge.sequence);
    if (acknowledge.profile != wire_->profile()) {
        const char* spoken =
            hexload_bus_profile_name(static_cast<hexload_bus_profile_t>(acknowledge.profile));
        fail(LinkFailure::wrong_profile,
             fmt::format(
                 "the controller speaks the profile {0}, this simulator {1}: give both --profile {0} or {1}",
                 spoken, hexload_bus_profile_name(wire_->profile())));
    }
    const bool has_started =
        acknowledge.kind == HEXLOAD_COMMAND_START && acknowledge.result == HEXLOAD_RESULT_DONE;
    if (has_started && settings_.known_mass_crc && acknowledge.known_mass_crc != 0 &&
        acknowledge.known_mass_crc != *settings_.known_mass_crc) {
        fail(LinkFailure::controller_fault,
             "the controller was told another mass of the load than this simulator's platform file has "
             "(load.known_mass_kg): give both the same file, and stop whoever else commands it");
    }
}

void ControllerSession::refuse_fault(std::uint8_t fault, bool any) const {
    const auto known = static_cast<hexload_app_fault_t>(fault);
    if (known != HEXLOAD_FAULT_NONE && (any || !ends_with_new_start(known))) {
        fail(failure_of(known), fmt::format("the controller is in fault since tick {} or before: {}",
                                            newest_tick_, hexload_app_fault_name(known)));
    }
}

std::optional<EstimateRow> AnswerBook::take(const hexload_bus_answer_t& answer) {
    refused_ = answer.refused;
    const bool estimates = answer.state == HEXLOAD_APP_ESTIMATING || answer.state == HEXLOAD_APP_CONVERGED;
    if (answer.status != HEXLOAD_OK) {
        last_status_ = static_cast<hexload_status_t>(answer.status);
        return std::nullopt;
    }
    if (!estimates) {
        return std::nullopt;
    }
    for (int bit = 0; bit < HEXLOAD_HEALTH_BITS; bit++) {
        health_count_[bit] += (answer.health >> bit) & 1U;
    }
    const double t_s = time_of_tick_s(answer.tick, tick_s_);
    if (answer.input.cause != HEXLOAD_INPUT_PLAUSIBLE || !has_input_implausible(answer.health)) {
        input_faults_.note(t_s, answer.input);
    }
    return estimate_row(answer.estimate, t_s, answer.health);
}

void AnswerBook::take(const hexload_bus_controller_status_t& status) {
    if (status.input.cause != HEXLOAD_INPUT_PLAUSIBLE) {
        input_faults_.note(time_of_tick_s(status.tick, tick_s_), status.input);
    }
}

std::string AnswerBook::last_refusal() const {
    return hexload_status_name(last_status_);
}

std::vector<HealthCount> AnswerBook::health_counts() const {
    return named_health_counts(health_count_);
}

std::span<const std::string_view> ControllerSession::own_sigma_names() const {
    const bool has_any = wire_->has_own_sigma() && settings_.estimator != EstimatorKind::paper;
    return has_any ? load_parameter_names(settings_.estimator) : std::span<const std::string_view>();
}

} // namespace hexload::sim
