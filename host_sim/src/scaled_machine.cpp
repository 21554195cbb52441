#include <hexload_sim/scaled_machine.hpp>

#include <algorithm>
#include <cmath>

namespace hexload::sim {
namespace {

// Of the machine that the default settings are made for.
constexpr double default_stroke_m = 0.6;
constexpr double default_empty_kg = 100.0;
constexpr double default_loaded_kg = 600.0;

} // namespace

Scenario scaled_machine(const PlatformFile& platform, const ActuatorLimits& limits, double heaviest_load_kg) {
    Scenario scenario;
    scenario.trajectory = StandstillMotion{};
    HydraulicSettings& oil = scenario.hydraulics;
    const Geometry& geometry = platform.geometry;
    const double speed_m_s = Hydraulics(oil, geometry.stroke_min_m, geometry.stroke_max_m).speed_gain_m_s();
    const double stall_n = (oil.supply_pressure_pa - oil.tank_pressure_pa) * oil.piston_area_m2;
    const double stroke_ratio = (geometry.stroke_max_m - geometry.stroke_min_m) / default_stroke_m;
    const double speed_ratio = limits.leg_speed_m_s / speed_m_s;
    const double force_ratio = limits.leg_force_n / stall_n;
    const double stiffness_ratio = force_ratio / stroke_ratio; // bulk modulus x area / length
    const double empty_kg = platform.platform.mass_kg;
    const double empty_ratio = std::sqrt(stiffness_ratio * default_empty_kg / empty_kg); // of resonances
    const double loaded_ratio =
        std::sqrt(stiffness_ratio * default_loaded_kg / (empty_kg + heaviest_load_kg));
    const double fastest_ratio = std::max({1.0, empty_ratio, loaded_ratio});

    oil.piston_area_m2 *= force_ratio; // the pressures stay, so the area goes with the force
    oil.rod_side_area_m2 *= force_ratio;
    oil.dead_volume_m3 *= force_ratio * stroke_ratio;
    oil.leakage_m3_s_pa *= force_ratio;
    oil.rated_flow_m3_s *= force_ratio * speed_ratio;
    oil.stop_stiffness_n_m *= force_ratio;
    oil.valve_bandwidth_hz *= fastest_ratio;
    const double loop_gain_ratio = std::min(1.0, loaded_ratio);
    scenario.controller.proportional_1_m *= loop_gain_ratio / speed_ratio;
    scenario.controller.integral_1_m_s *= loop_gain_ratio / speed_ratio;
    // Damping: feedback x speed gain x stiffness / resonance.
    scenario.controller.pressure_feedback_1_n *= loaded_ratio / (speed_ratio * stiffness_ratio);
    scenario.limits.pump_flow_m3_s = limits.speed_sum_m_s * oil.piston_area_m2;
    const double substeps = std::ceil(static_cast<double>(scenario.substeps) * fastest_ratio);
    scenario.substeps = static_cast<std::int64_t>(std::min(substeps, static_cast<double>(substeps_max)));
    return scenario;
}

} // namespace hexload::sim
