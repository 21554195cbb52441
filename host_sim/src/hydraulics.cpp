#include <hexload_sim/hydraulics.hpp>

#include "platform_file/input_error.hpp"

#include <fmt/format.h>

#include <cmath>

namespace hexload::sim {

Hydraulics::Hydraulics(const HydraulicSettings& settings, double stroke_min_m, double stroke_max_m)
    : settings_(settings), stroke_min_m_(stroke_min_m), stroke_max_m_(stroke_max_m),
      flow_gain_a_(settings.rated_flow_m3_s / std::sqrt(rated_pressure_drop_pa)),
      flow_gain_b_(flow_gain_a_ * settings.rod_side_area_m2 / settings.piston_area_m2),
      natural_frequency_rad_s_(2.0 * std::numbers::pi * settings.valve_bandwidth_hz) {}

Legs Hydraulics::orifice(const Legs& pressure_drop_pa) const {
    return pressure_drop_pa / (pressure_drop_pa.abs() + settings_.laminar_pressure_pa).sqrt();
}

Legs Hydraulics::force_n(const HydraulicState& state) const {
    return state.pressure_a_pa * settings_.piston_area_m2 - state.pressure_b_pa * settings_.rod_side_area_m2;
}

void Hydraulics::differentiate(const HydraulicState& state, const Legs& command, const Legs& displacement_m,
                               const Legs& velocity_m_s, HydraulicState& rate) const {
    const HydraulicSettings& s = settings_;
    const Legs opening = state.spool.max(-1.0).min(1.0);
    Legs direction;
    for (int leg = 0; leg < 6; ++leg) {
        direction(leg) = std::copysign(1.0, opening(leg));
    }
    // Extending: port A on supply, port B on tank; else the other way round.
    const double mean_pa = 0.5 * (s.supply_pressure_pa + s.tank_pressure_pa);
    const double half_pa = 0.5 * (s.supply_pressure_pa - s.tank_pressure_pa);
    const Legs drop_a_pa = half_pa + direction * (mean_pa - state.pressure_a_pa);
    const Legs drop_b_pa = half_pa - direction * (mean_pa - state.pressure_b_pa);
    const Legs leakage_m3_s = s.leakage_m3_s_pa * (state.pressure_a_pa - state.pressure_b_pa);
    const Legs inflow_a_m3_s =
        flow_gain_a_ * opening * orifice(drop_a_pa) - s.piston_area_m2 * velocity_m_s - leakage_m3_s;
    const Legs inflow_b_m3_s =
        s.rod_side_area_m2 * velocity_m_s + leakage_m3_s - flow_gain_b_ * opening * orifice(drop_b_pa);
    const Legs volume_a_m3 = s.dead_volume_m3 + s.piston_area_m2 * (displacement_m - stroke_min_m_);
    const Legs volume_b_m3 = s.dead_volume_m3 + s.rod_side_area_m2 * (stroke_max_m_ - displacement_m);

    rate.spool = state.spool_rate_1_s;
    rate.spool_rate_1_s = natural_frequency_rad_s_ * (natural_frequency_rad_s_ * (command - state.spool) -
                                                      2.0 * s.valve_damping * state.spool_rate_1_s);
    rate.pressure_a_pa = s.bulk_modulus_pa * inflow_a_m3_s / volume_a_m3;
    rate.pressure_b_pa = s.bulk_modulus_pa * inflow_b_m3_s / volume_b_m3;
}

Legs Hydraulics::stop_force_n(const Legs& displacement_m, const Legs& velocity_m_s) const {
    if (displacement_m.minCoeff() >= stroke_min_m_ && displacement_m.maxCoeff() <= stroke_max_m_) {
        return Legs::Zero();
    }
    const Legs depth_low_m = (stroke_min_m_ - displacement_m).max(0.0);
    const Legs depth_high_m = (displacement_m - stroke_max_m_).max(0.0);
    const Legs damping = settings_.stop_damping_s_m * velocity_m_s;
    // A stop pushes only: the factor is not allowed below zero.
    return settings_.stop_stiffness_n_m *
           (depth_low_m * (1.0 - damping).max(0.0) - depth_high_m * (1.0 + damping).max(0.0));
}

double Hydraulics::orifice(double pressure_drop_pa) const {
    return pressure_drop_pa / std::sqrt(std::abs(pressure_drop_pa) + settings_.laminar_pressure_pa);
}

// Side A's pressure at which both ports pass the same flow, the leg force being f. The ports' flows are
// monotonic in it, so bisection between the pressures at which one of the two drops vanishes finds the only
// solution.
double Hydraulics::balanced_pressure_a_pa(double f_n, bool extending) const {
    const double supply_pa = settings_.supply_pressure_pa;
    const double tank_pa = settings_.tank_pressure_pa;
    const double area_ratio = settings_.rod_side_area_m2 / settings_.piston_area_m2;
    const auto surplus_a_m3_s = [&](double pressure_a_pa) {
        const double pressure_b_pa = (pressure_a_pa - f_n / settings_.piston_area_m2) / area_ratio;
        const double drop_a_pa = extending ? supply_pa - pressure_a_pa : pressure_a_pa - tank_pa;
        const double drop_b_pa = extending ? pressure_b_pa - tank_pa : supply_pa - pressure_b_pa;
        return (flow_gain_a_ * orifice(drop_a_pa) - flow_gain_b_ * orifice(drop_b_pa)) *
               (extending ? 1.0 : -1.0);
    };
    double low_pa = tank_pa; // surplus > 0
    double high_pa = supply_pa;
    for (double middle_pa = 0.5 * (low_pa + high_pa); low_pa < middle_pa && middle_pa < high_pa;
         middle_pa = 0.5 * (low_pa + high_pa)) {
        (surplus_a_m3_s(middle_pa) > 0.0 ? low_pa : high_pa) = middle_pa;
    }
    return high_pa;
}

HydraulicState Hydraulics::equilibrium(const Legs& force_n) const {
    const HydraulicSettings& s = settings_;
    HydraulicState state;
    for (int leg = 0; leg < 6; ++leg) {
        const double f_n = force_n(leg);
        const auto pressure_b_pa = [&](double a_pa) {
            return (a_pa * s.piston_area_m2 - f_n) / s.rod_side_area_m2;
        };
        // The spool opens so far that it replaces the oil that leaks from the side of higher pressure.
        const double extending_pa = balanced_pressure_a_pa(f_n, true);
        const double retracting_pa = balanced_pressure_a_pa(f_n, false);
        double a_pa = extending_pa;
        if (extending_pa < pressure_b_pa(extending_pa)) {
            a_pa = retracting_pa;
            if (retracting_pa > pressure_b_pa(retracting_pa)) {
                a_pa =
                    f_n / (s.piston_area_m2 - s.rod_side_area_m2); // equal pressures: no leakage, spool shut
            }
        }
        const double b_pa = pressure_b_pa(a_pa);
        const double leakage_m3_s = s.leakage_m3_s_pa * (a_pa - b_pa);
        const double drop_pa = leakage_m3_s > 0.0 ? s.supply_pressure_pa - a_pa : a_pa - s.tank_pressure_pa;
        if (!(drop_pa > s.laminar_pressure_pa && b_pa > s.tank_pressure_pa && b_pa < s.supply_pressure_pa)) {
            throw InputError(
                fmt::format("leg {}: found a static force of {:.0f} N, expected one that {:.3g} Pa of "
                            "supply pressure can hold",
                            leg + 1, f_n, s.supply_pressure_pa));
        }
        state.pressure_a_pa(leg) = a_pa;
        state.pressure_b_pa(leg) = b_pa;
        state.spool(leg) = leakage_m3_s / (flow_gain_a_ * orifice(drop_pa));
    }
    return state;
}

double Hydraulics::speed_gain_m_s() const {
    const double drop_pa = 0.5 * (settings_.supply_pressure_pa - settings_.tank_pressure_pa);
    return flow_gain_a_ * std::sqrt(drop_pa) / settings_.piston_area_m2;
}

} // namespace hexload::sim
