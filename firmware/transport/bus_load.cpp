#include "bus_load.hpp"

#include "bit_time.hpp"

#include <fmt/format.h>

#include <span>

namespace hexload::transport {
namespace {

constexpr double status_period_s = 0.05;

// Time on the bus, of each tick and of each second.
struct Cost {
    double tick_s = 0.0;
    double second_s = 0.0;
};

double time_s(std::span<const hexload_bus_frame_t> frames) {
    double sum_us = 0.0;
    for (const hexload_bus_frame_t& frame : frames) {
        sum_us += longest_time_us(frame);
    }
    return 1e-6 * sum_us;
}

Cost cost_of(hexload_bus_profile_t profile) {
    hexload_bus_frame_t frames[HEXLOAD_BUS_SAMPLE_FRAMES];
    std::uint32_t saturated = 0;
    hexload_leg_sample_t sample{};
    const auto sample_time_s = [&](std::uint32_t tick) {
        sample.tick = tick;
        return time_s({frames, static_cast<std::size_t>(
                                   hexload_bus_encode_sample(profile, &sample, frames, &saturated))});
    };
    const double usual_s = sample_time_s(1);
    const double with_tick_s = sample_time_s(HEXLOAD_BUS_TICK_PERIOD); // classic: its frame too
    hexload_bus_answer_t answer{};
    answer.filter = HEXLOAD_FILTER_MOMENTUM;
    const double answer_s =
        time_s({frames, static_cast<std::size_t>(hexload_bus_encode_answer(profile, &answer, 0, frames))});
    hexload_bus_controller_status_t status{};
    hexload_bus_encode_status(&status, 0, frames);
    const int tick_period = HEXLOAD_BUS_TICK_PERIOD;
    const int answer_period =
        profile == HEXLOAD_BUS_CLASSIC ? static_cast<int>(HEXLOAD_BUS_ANSWER_PERIOD) : 1;
    return {usual_s + (with_tick_s - usual_s) / tick_period + answer_s / answer_period,
            time_s({frames, 1}) / status_period_s};
}

bool has_bit_rate(const std::string& bus) {
    return !bus.starts_with("udp_multicast:") && !bus.starts_with("socketcan:vcan");
}

} // namespace

double bus_load(hexload_bus_profile_t profile, double tick_s) {
    const Cost cost = cost_of(profile);
    return cost.tick_s / tick_s + cost.second_s;
}

double shortest_tick_of(hexload_bus_profile_t profile) {
    const Cost cost = cost_of(profile);
    return cost.tick_s / (fullest - cost.second_s);
}

std::optional<std::string> find_overload(const std::string& bus, hexload_bus_profile_t profile,
                                         double tick_s) {
    const double load = bus_load(profile, tick_s);
    if (load <= fullest || (profile == HEXLOAD_BUS_FD && !has_bit_rate(bus))) {
        return std::nullopt;
    }
    return fmt::format(
        "{}: found the profile {} at a tick of {:g} ms (sensors.tick_s), which would keep the bus "
        "busy for {:.0f} % of the time, expected {:.0f} % at most: classic (1 Mbit/s) carries ticks "
        "from {:.2f} ms on, fd (data at 5 Mbit/s) from {:.2f} ms on",
        bus, hexload_bus_profile_name(profile), 1e3 * tick_s, 100.0 * load, 100.0 * fullest,
        1e3 * shortest_tick_of(HEXLOAD_BUS_CLASSIC), 1e3 * shortest_tick_of(HEXLOAD_BUS_FD));
}

} // namespace hexload::transport
