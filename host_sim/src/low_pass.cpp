#include <hexload_sim/low_pass.hpp>

#include <cmath>

namespace hexload::sim {

// The roots are a (-1 +- i), a = w / sqrt(2).
LowPass::LowPass(double bandwidth_hz, double step_s)
    : w_rad_s_(2.0 * std::numbers::pi * bandwidth_hz), step_s_(step_s) {
    const double a = w_rad_s_ / std::numbers::sqrt2;
    const double decay = std::exp(-a * step_s);
    const double cosine = decay * std::cos(a * step_s);
    const double sine = decay * std::sin(a * step_s);
    value_value_ = cosine + sine;
    value_rate_ = sine / a;
    rate_value_ = -2.0 * a * sine;
    rate_rate_ = cosine - sine;
}

// Of the input u0 + u1 t + u2 t^2 the parabola p0 + p1 t + p2 t^2 is a solution; what the state differs from
// it by decays.
LowPassState LowPass::after(const LowPassState& state, const LowPassInput& input) const {
    const double h = step_s_;
    const Legs u1 = (4.0 * input.middle - 3.0 * input.begin - input.end) / h;
    const Legs p2 = 2.0 / (h * h) * (input.begin - 2.0 * input.middle + input.end);
    const double lag_s = std::numbers::sqrt2 / w_rad_s_;
    const Legs p1 = u1 - 2.0 * lag_s * p2;
    const Legs p0 = input.begin - lag_s * p1 - lag_s * lag_s * p2;
    const Legs off = state.value - p0;
    const Legs off_rate = state.rate_1_s - p1;
    return {p0 + h * (p1 + h * p2) + value_value_ * off + value_rate_ * off_rate,
            p1 + 2.0 * h * p2 + rate_value_ * off + rate_rate_ * off_rate};
}

} // namespace hexload::sim
