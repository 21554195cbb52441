#include <hexload_sim/electric.hpp>

#include "platform_file/input_error.hpp"

#include <fmt/format.h>

#include <cmath>
#include <numbers>

namespace hexload::sim {

void Electric::differentiate(const ElectricState& state, const Legs& command, const Legs& velocity_m_s,
                             ElectricState& rate) const {
    const ElectricSettings& s = settings_;
    const Legs slow_m_s = s.speed_limit_m_s * command.max(-1.0).min(1.0) - velocity_m_s;
    const Legs wanted_a =
        (s.speed_gain_n_s_m * slow_m_s + s.speed_integral_n_m * state.lag_m) / s.force_gain_n_a;
    const Legs given_a = wanted_a.max(-s.current_limit_a).min(s.current_limit_a);
    rate.current_a = 2.0 * std::numbers::pi * s.current_bandwidth_hz * (given_a - state.current_a);
    rate.lag_m = (wanted_a == given_a).select(slow_m_s, 0.0);
}

ElectricState Electric::equilibrium(const Legs& force_n) const {
    for (int leg = 0; leg < 6; ++leg) {
        if (!(std::abs(force_n(leg)) < settings_.stall_force_n())) {
            throw InputError(
                fmt::format("leg {}: found a static force of {:.0f} N, expected one that the current "
                            "limit can hold, {:.0f} N",
                            leg + 1, force_n(leg), settings_.stall_force_n()));
        }
    }
    ElectricState state;
    state.current_a = force_n / settings_.force_gain_n_a;
    if (settings_.speed_integral_n_m > 0.0) {
        state.lag_m = force_n / settings_.speed_integral_n_m;
    }
    return state;
}

} // namespace hexload::sim
