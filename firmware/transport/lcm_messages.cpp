#include "lcm_messages.hpp"

#include "input_fault_words.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <iterator>
#include <limits>
#include <span>
#include <string>

namespace hexload::transport {
namespace {

static_assert(command_t::START == HEXLOAD_COMMAND_START && command_t::STOP == HEXLOAD_COMMAND_STOP &&
                  command_t::RESET == HEXLOAD_COMMAND_RESET &&
                  command_t::SELECT_FILTER == HEXLOAD_COMMAND_SELECT_FILTER &&
                  command_t::SET_KNOWN_MASS == HEXLOAD_COMMAND_SET_KNOWN_MASS,
              "commands of LCM and CAN have the same codes");

std::span<const char* const> parameter_names(hexload_bus_filter_t filter) {
    static constexpr std::array<const char*, HEXLOAD_PAPER_DIM> paper = {"dz", "Ixx", "Iyy", "Izz"};
    static constexpr std::array<const char*, HEXLOAD_LOAD_DIM> load = {"m",   "hx",  "hy",  "hz",  "Ixx",
                                                                       "Iyy", "Izz", "Ixy", "Ixz", "Iyz"};
    if (filter == HEXLOAD_FILTER_PAPER) {
        return paper;
    }
    return load;
}

float to_float(hexload_real_t value) {
    return static_cast<float>(value);
}

hexload_real_t to_real(float value) {
    return static_cast<hexload_real_t>(value);
}

// The code of `first` .. `last` with this name.
template <typename Code>
std::optional<Code> code_of(const std::string& name, Code first, Code last, const char* (*name_of)(Code)) {
    for (int code = first; code <= last; ++code) {
        if (name == name_of(static_cast<Code>(code))) {
            return static_cast<Code>(code);
        }
    }
    return std::nullopt;
}

std::optional<hexload_verdict_t> verdict_of(const std::string& name) {
    return code_of(name, HEXLOAD_VERDICT_CONVERGED, HEXLOAD_VERDICT_INCONSISTENT, hexload_verdict_name);
}

std::optional<hexload_app_state_t> state_of(const std::string& name) {
    return code_of(name, HEXLOAD_APP_IDLE, HEXLOAD_APP_FAULT, hexload_app_state_name);
}

std::optional<hexload_app_fault_t> fault_of(const std::string& name) {
    return code_of(name, HEXLOAD_FAULT_NONE, HEXLOAD_FAULT_NOT_AUTHENTICATED, hexload_app_fault_name);
}

std::optional<hexload_bus_filter_t> filter_of(const std::string& name) {
    return code_of(name, HEXLOAD_FILTER_PAPER, HEXLOAD_FILTER_MOMENTUM, hexload_bus_filter_name);
}

std::string health_names(std::uint32_t bits) {
    std::string names;
    for (int bit = 0; bit < HEXLOAD_HEALTH_BITS; ++bit) {
        if ((bits >> bit & 1U) != 0) {
            names += names.empty() ? "" : ", ";
            names += hexload_health_name(static_cast<hexload_health_bit_t>(bit));
        }
    }
    return names;
}

// A cause that is not known yet is one that has no words.
hexload_input_fault_t input_fault_of(const health_t& health) {
    const bool has_cause = health.input_cause >= 0 && health.input_cause < HEXLOAD_INPUT_CAUSES;
    const bool has_leg = health.input_leg > 0 && health.input_leg <= HEXLOAD_LEGS;
    return {has_cause ? static_cast<hexload_input_cause_t>(health.input_cause) : HEXLOAD_INPUT_CAUSES,
            has_leg ? static_cast<std::uint32_t>(health.input_leg) - 1U
                    : static_cast<std::uint32_t>(HEXLOAD_LEGS),
            to_real(health.excess_force_n)};
}

bool fits_tick(std::int64_t tick) {
    return tick >= 0 && tick <= std::numeric_limits<std::uint32_t>::max();
}

bool fits_byte(std::int64_t value) {
    return value >= 0 && value <= std::numeric_limits<std::uint8_t>::max();
}

bool is_session(std::int64_t source, std::int64_t session) {
    return source >= 0 && session >= 0 && session < HEXLOAD_BUS_SESSIONS;
}

// False: other parameters than the filter's, or an unknown verdict.
bool read_estimate(const estimate_t& message, hexload_bus_filter_t filter, hexload_estimate_t& estimate) {
    const auto worst = verdict_of(message.verdict);
    const auto names = parameter_names(filter);
    if (message.count != static_cast<std::int32_t>(names.size()) || !worst) {
        return false;
    }
    for (std::size_t k = 0; k < names.size(); ++k) {
        const auto verdict = verdict_of(message.parameter_verdict[k]);
        if (message.name[k] != names[k] || !verdict) {
            return false;
        }
        estimate.parameter_verdict[k] = *verdict;
    }
    std::transform(message.value.begin(), message.value.end(), estimate.value, to_real);
    std::transform(message.sigma.begin(), message.sigma.end(), estimate.sigma, to_real);
    std::transform(message.own_sigma.begin(), message.own_sigma.end(), estimate.own_sigma, to_real);
    estimate.verdict = *worst;
    estimate.nis = to_real(message.nis);
    estimate.nis_mean = to_real(message.nis_mean);
    return true;
}

} // namespace

leg_sample_t leg_sample_message(const hexload_leg_sample_t& sample) {
    leg_sample_t message{};
    message.tick = sample.tick;
    std::transform(std::begin(sample.displacement_m), std::end(sample.displacement_m), message.displacement_m,
                   to_float);
    std::transform(std::begin(sample.velocity_m_s), std::end(sample.velocity_m_s), message.velocity_m_s,
                   to_float);
    std::transform(std::begin(sample.force_n), std::end(sample.force_n), message.force_n, to_float);
    return message;
}

std::optional<hexload_leg_sample_t> leg_sample_of(const leg_sample_t& message) {
    if (!fits_tick(message.tick)) {
        return std::nullopt;
    }
    hexload_leg_sample_t sample{};
    sample.tick = static_cast<std::uint32_t>(message.tick);
    std::transform(std::begin(message.displacement_m), std::end(message.displacement_m),
                   sample.displacement_m, to_real);
    std::transform(std::begin(message.velocity_m_s), std::end(message.velocity_m_s), sample.velocity_m_s,
                   to_real);
    std::transform(std::begin(message.force_n), std::end(message.force_n), sample.force_n, to_real);
    return sample;
}

estimate_t estimate_message(const hexload_bus_answer_t& answer) {
    const hexload_estimate_t& estimate = answer.estimate;
    estimate_t message{};
    message.tick = answer.tick;
    const auto filter = static_cast<hexload_bus_filter_t>(answer.filter);
    const auto names = parameter_names(filter);
    message.filter = hexload_bus_filter_name(filter);
    message.count = static_cast<std::int32_t>(names.size());
    message.name.assign(names.begin(), names.end());
    for (std::size_t k = 0; k < names.size(); ++k) {
        message.value.push_back(to_float(estimate.value[k]));
        message.sigma.push_back(to_float(estimate.sigma[k]));
        message.own_sigma.push_back(to_float(estimate.own_sigma[k]));
        message.parameter_verdict.emplace_back(hexload_verdict_name(estimate.parameter_verdict[k]));
    }
    message.verdict = hexload_verdict_name(estimate.verdict);
    message.nis = to_float(estimate.nis);
    message.nis_mean = to_float(estimate.nis_mean);
    return message;
}

health_t health_message(const hexload_bus_answer_t& answer, std::uint32_t samples_missing) {
    health_t message{};
    message.tick = answer.tick;
    message.state = hexload_app_state_name(static_cast<hexload_app_state_t>(answer.state));
    message.fault = hexload_app_fault_name(static_cast<hexload_app_fault_t>(answer.fault));
    message.status = hexload_status_name(static_cast<hexload_status_t>(answer.status));
    message.health_bits = answer.health;
    message.health = health_names(answer.health);
    message.input_cause = static_cast<std::int8_t>(answer.input.cause);
    message.input_leg = static_cast<std::int8_t>(answer.input.leg < HEXLOAD_LEGS ? answer.input.leg + 1 : 0);
    message.excess_force_n = to_float(answer.input.excess_n);
    message.input_fault = input_fault_words(answer.input);
    message.samples_refused = answer.refused;
    message.samples_missing = samples_missing;
    message.missing_legs = static_cast<std::int8_t>(answer.missing_legs);
    return message;
}

std::optional<hexload_bus_answer_t> answer_of(const estimate_t& estimate, const health_t& health) {
    const auto state = state_of(health.state);
    const auto fault = fault_of(health.fault);
    const auto status = code_of(health.status, HEXLOAD_ERR_SINGULAR, HEXLOAD_OK, hexload_status_name);
    const auto filter = filter_of(estimate.filter);
    hexload_bus_answer_t answer{};
    if (!state || !fault || !status || !filter || !fits_tick(health.tick) ||
        !read_estimate(estimate, *filter, answer.estimate)) {
        return std::nullopt;
    }
    answer.filter = static_cast<std::uint8_t>(*filter);
    answer.tick = static_cast<std::uint32_t>(health.tick);
    answer.status = static_cast<std::int8_t>(*status);
    answer.state = static_cast<std::uint8_t>(*state);
    answer.fault = static_cast<std::uint8_t>(*fault);
    answer.health = static_cast<std::uint16_t>(health.health_bits);
    answer.input = input_fault_of(health);
    answer.refused = static_cast<std::uint32_t>(health.samples_refused);
    answer.missing_legs = static_cast<std::uint8_t>(health.missing_legs);
    return answer;
}

load_change_t load_change_message(const hexload_bus_load_change_t& change) {
    load_change_t message{};
    message.tick = change.tick;
    message.load_changes = change.load_changes;
    return message;
}

std::optional<hexload_bus_load_change_t> load_change_of(const load_change_t& message) {
    if (!fits_tick(message.tick) || message.load_changes < 0 ||
        message.load_changes > std::numeric_limits<std::uint16_t>::max()) {
        return std::nullopt;
    }
    return hexload_bus_load_change_t{static_cast<std::uint32_t>(message.tick),
                                     static_cast<std::uint16_t>(message.load_changes)};
}

acknowledge_t acknowledge_message(const hexload_bus_acknowledge_t& acknowledge, std::uint32_t tick) {
    acknowledge_t message{};
    message.tick = tick;
    message.kind = static_cast<std::int8_t>(acknowledge.kind);
    message.id = acknowledge.sequence;
    message.source = static_cast<std::int8_t>(acknowledge.source);
    message.session = static_cast<std::int16_t>(acknowledge.session);
    message.done = acknowledge.result == HEXLOAD_RESULT_DONE ? 1 : 0;
    message.result = hexload_bus_result_name(static_cast<hexload_bus_result_t>(acknowledge.result));
    message.state = hexload_app_state_name(static_cast<hexload_app_state_t>(acknowledge.state));
    message.fault = hexload_app_fault_name(static_cast<hexload_app_fault_t>(acknowledge.fault));
    return message;
}

std::optional<hexload_bus_acknowledge_t> acknowledge_of(const acknowledge_t& message) {
    const auto result = code_of(message.result, HEXLOAD_RESULT_DONE, HEXLOAD_RESULT_OTHER_CONFIGURATION,
                                hexload_bus_result_name);
    const auto state = state_of(message.state);
    const auto fault = fault_of(message.fault);
    if (!result || !state || !fault || !fits_byte(message.kind) || !fits_byte(message.id) ||
        !is_session(message.source, message.session)) {
        return std::nullopt;
    }
    hexload_bus_acknowledge_t acknowledge{};
    acknowledge.kind = static_cast<std::uint8_t>(message.kind);
    acknowledge.sequence = static_cast<std::uint8_t>(message.id);
    acknowledge.source = static_cast<std::uint8_t>(message.source);
    acknowledge.session = static_cast<std::uint16_t>(message.session);
    acknowledge.result = static_cast<std::uint8_t>(*result);
    acknowledge.state = static_cast<std::uint8_t>(*state);
    acknowledge.fault = static_cast<std::uint8_t>(*fault);
    return acknowledge;
}

command_t command_message(const hexload_bus_command_t& command, std::uint32_t tick) {
    command_t message{};
    message.tick = tick;
    message.kind = static_cast<std::int8_t>(command.kind);
    message.id = command.sequence;
    message.source = static_cast<std::int8_t>(command.source);
    message.session = static_cast<std::int16_t>(command.session);
    message.configuration = command.configuration & HEXLOAD_BUS_CONFIGURATION_MASK;
    message.argument = command.argument;
    return message;
}

std::optional<hexload_bus_command_t> command_of(const command_t& message) {
    if (!fits_byte(message.kind) || !fits_byte(message.id) || !is_session(message.source, message.session) ||
        message.configuration < 0 || message.configuration > HEXLOAD_BUS_CONFIGURATION_MASK) {
        return std::nullopt;
    }
    return hexload_bus_command_t{.kind = static_cast<std::uint8_t>(message.kind),
                                 .source = static_cast<std::uint8_t>(message.source),
                                 .session = static_cast<std::uint16_t>(message.session),
                                 .sequence = static_cast<std::uint8_t>(message.id),
                                 .argument = message.argument,
                                 .configuration = static_cast<std::uint32_t>(message.configuration)};
}

} // namespace hexload::transport
