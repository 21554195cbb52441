// What is between a transducer and its sample: a second-order low-pass, integrated with the plant.
//
//     y'' = w^2 (u - y) - sqrt(2) w y'        w = 2 pi bandwidth: Butterworth, -3 dB at the bandwidth
//
// A slow signal comes out late by sqrt(2) / w.
#pragma once

#include <hexload_sim/types.hpp>

#include <numbers>

namespace hexload::sim {

// 0: none, the sample is the signal itself.
struct LowPasses {
    double force_hz = 0.0;
    double velocity_hz = 0.0;
};

// The Runge-Kutta step follows a low-pass up to w x step = 1: this many Hz per substep of a
// millisecond.
inline constexpr double low_pass_max_hz_per_substep = 150.0;

struct LowPassState {
    Legs value = Legs::Zero();
    Legs rate_1_s = Legs::Zero();
};

inline void differentiate(const LowPassState& state, double bandwidth_hz, const Legs& input,
                          LowPassState& rate) {
    const double w = 2.0 * std::numbers::pi * bandwidth_hz;
    rate.value = state.rate_1_s;
    rate.rate_1_s = w * (w * (input - state.value) - std::numbers::sqrt2 * state.rate_1_s);
}

} // namespace hexload::sim
