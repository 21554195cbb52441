// Which ticks a bus has the time for: its bits are as fast as firmware/bus/README.md states.
#pragma once

#include "bus/bus.h"

#include <optional>
#include <string>

namespace hexload::transport {

inline constexpr double fullest = 0.9; // share of the time that cyclic frames may keep a bus busy

// Share of the time that the cyclic frames of a profile keep a bus busy at most, samples tick_s apart and the
// momentum filter's answers, which are the longer. Above 1: they do not fit.
double bus_load(hexload_bus_profile_t profile, double tick_s);

// The shortest period at which that is `fullest`.
double shortest_tick_of(hexload_bus_profile_t profile);

// Why the bus of this name cannot carry the profile at this tick; nothing: it can. Classic frames have their
// bit rate in the contract. A bus without one (udp_multicast, a virtual CAN of Linux) carries fd at any tick.
std::optional<std::string> find_overload(const std::string& bus, hexload_bus_profile_t profile,
                                         double tick_s);

} // namespace hexload::transport
