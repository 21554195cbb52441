// The application's structs as LCM messages and back.
#pragma once

#include "app/app.h"

#include <hexload_lcm/acknowledge_t.hpp>
#include <hexload_lcm/command_t.hpp>
#include <hexload_lcm/estimate_t.hpp>
#include <hexload_lcm/health_t.hpp>
#include <hexload_lcm/leg_sample_t.hpp>
#include <hexload_lcm/load_change_t.hpp>
#include <hexload_lcm/namespace.hpp>

#include <optional>

namespace hexload::transport {

leg_sample_t leg_sample_message(const hexload_leg_sample_t& sample);

// An answer travels as two messages: estimate, then health.
estimate_t estimate_message(const hexload_bus_answer_t& answer);
health_t health_message(const hexload_bus_answer_t& answer, std::uint32_t samples_missing);
load_change_t load_change_message(const hexload_bus_load_change_t& change);
acknowledge_t acknowledge_message(const hexload_bus_acknowledge_t& acknowledge, std::uint32_t tick);
command_t command_message(const hexload_bus_command_t& command, std::uint32_t tick);

// Nothing: a number is outside its range, or a word is none that the firmware knows.
std::optional<hexload_leg_sample_t> leg_sample_of(const leg_sample_t& message);
std::optional<hexload_bus_answer_t> answer_of(const estimate_t& estimate, const health_t& health);
std::optional<hexload_bus_load_change_t> load_change_of(const load_change_t& message);
std::optional<hexload_bus_acknowledge_t> acknowledge_of(const acknowledge_t& message);
std::optional<hexload_bus_command_t> command_of(const command_t& message);

} // namespace hexload::transport
