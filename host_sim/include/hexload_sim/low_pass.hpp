// What is between a transducer and its sample: a second-order low-pass.
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

struct LowPassState {
    Legs value = Legs::Zero();
    Legs rate_1_s = Legs::Zero();
};

// An input over a step: at its begin, in its middle, at its end, and a parabola between.
struct LowPassInput {
    Legs begin, middle, end;
};

// Exact for such inputs, at any bandwidth.
class LowPass {
  public:
    // bandwidth_hz: above 0.
    LowPass(double bandwidth_hz, double step_s);

    // The state a step later.
    LowPassState after(const LowPassState& state, const LowPassInput& input) const;

  private:
    double w_rad_s_;
    double step_s_;
    // Of y'' = -w^2 y - sqrt(2) w y' over a step: value and rate by value and rate.
    double value_value_, value_rate_, rate_value_, rate_rate_;
};

} // namespace hexload::sim
