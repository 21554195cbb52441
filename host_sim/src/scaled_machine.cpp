#include <hexload_sim/scaled_machine.hpp>

#include <hexload_sim/dynamics.hpp>
#include <hexload_sim/linear_solve.hpp>

#include <Eigen/SVD>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>

namespace hexload::sim {
namespace {

constexpr double default_stroke_m = 0.6; // of the machine that the default settings are made for
constexpr double stroke_share = 0.9;     // at which oil columns are shortest, and stiffest
// Of the loaded machine's resonance across its legs, sqrt(stiffness / 2 mass), 1/s per rad/s: what the
// default servo has of its 73 rad/s with 500 kg, which is then damped by 0.4, its peak a third of what makes
// the position loop unstable.
constexpr double loop_gain_share = 0.25;
constexpr double damping_share = 0.75;
// Of the fastest resonance: with a damping ratio of 0.8 the valve turns the feedback by 47 degrees there,
// which leaves 43 for the servo's sampling before it feeds the resonance.
constexpr double valve_share = 2.0;
constexpr double kept_leakage = 0.5;    // of what leakage damps: no resonance loses more to the servo
constexpr double least_step_rad = 0.15; // of the fastest resonance per RK4 step

double default_speed_m_s() {
    return Hydraulics(HydraulicSettings{}, -default_stroke_m / 2.0, default_stroke_m / 2.0).speed_gain_m_s();
}

// N per m of one leg with both ports shut.
double oil_stiffness_n_m(const HydraulicSettings& oil, const Geometry& geometry, double displacement_m) {
    const double area_a_m2 = oil.piston_area_m2;
    const double area_b_m2 = oil.rod_side_area_m2;
    const double volume_a_m3 = oil.dead_volume_m3 + area_a_m2 * (displacement_m - geometry.stroke_min_m);
    const double volume_b_m3 = oil.dead_volume_m3 + area_b_m2 * (geometry.stroke_max_m - displacement_m);
    return oil.bulk_modulus_pa * (area_a_m2 * area_a_m2 / volume_a_m3 + area_b_m2 * area_b_m2 / volume_b_m3);
}

double end_stiffness_n_m(const HydraulicSettings& oil, const Geometry& geometry) {
    return std::max(oil_stiffness_n_m(oil, geometry, stroke_share * geometry.stroke_min_m),
                    oil_stiffness_n_m(oil, geometry, stroke_share * geometry.stroke_max_m));
}

// Of the six ways in which alike legs swing with the body at home: l'' = J M^-1 J^T f, in 1/kg, decreasing.
Vector6 inverse_masses_1_kg(const Geometry& geometry, const MassProperties& body) {
    const Matrix6 J = jacobian(geometry, Pose{});
    const Matrix6 inverse = J * solve_columns(mass_matrix(body, Matrix3::Identity()), J.transpose());
    return inverse.jacobiSvd().singularValues(); // which eigenvalues of such a matrix are
}

// Share of the servo's command that is in phase with a pressure that swings at this frequency: valve, and the
// mean age of a held command.
double in_phase(const HydraulicSettings& oil, double frequency_rad_s) {
    const double ratio = frequency_rad_s / (2.0 * std::numbers::pi * oil.valve_bandwidth_hz);
    const std::complex<double> valve(1.0 - ratio * ratio, 2.0 * oil.valve_damping * ratio);
    return (std::polar(1.0, -0.5 * servo_s * frequency_rad_s) / valve).real();
}

double leakage_1_s(const HydraulicSettings& oil, double stiffness_n_m) {
    return oil.leakage_m3_s_pa / (oil.piston_area_m2 * oil.piston_area_m2) * stiffness_n_m;
}

// The largest share of loop gain and pressure feedback with which every resonance decays. With a pressure
// feedback that damps by d and a loop gain K, both in 1/s, one at w decays by (leakage + (d - K) in_phase) /
// 2 to first order in d / w and K / w.
double stable_share(const HydraulicSettings& oil, double leakage, double difference_1_s, double from_rad_s,
                    double to_rad_s) {
    double least = 0.0;
    for (double w = from_rad_s; w < to_rad_s; w *= 1.05) {
        least = std::min(least, in_phase(oil, w));
    }
    least = std::min(least, in_phase(oil, to_rad_s));
    const double taken_1_s = -least * difference_1_s;
    return taken_1_s > kept_leakage * leakage ? kept_leakage * leakage / taken_1_s : 1.0;
}

void scale_oil(HydraulicSettings& oil, double force_ratio, double stroke_ratio, double speed_ratio) {
    oil.piston_area_m2 *= force_ratio; // the pressures stay, so the area goes with the force
    oil.rod_side_area_m2 *= force_ratio;
    oil.dead_volume_m3 *= force_ratio * stroke_ratio;
    oil.leakage_m3_s_pa *= force_ratio;
    oil.rated_flow_m3_s *= force_ratio * speed_ratio;
    oil.stop_stiffness_n_m *= force_ratio;
}

void suit_servo(Scenario& scenario, const PlatformFile& platform, double heaviest_load_kg, double speed_m_s) {
    HydraulicSettings& oil = scenario.hydraulics;
    const Geometry& geometry = platform.geometry;
    const MassProperties empty = mass_properties(platform.platform);
    const double stiffness_n_m = oil_stiffness_n_m(oil, geometry, 0.0);
    const double end_n_m = end_stiffness_n_m(oil, geometry);
    const Vector6 unloaded_1_kg = inverse_masses_1_kg(geometry, empty);
    const double loaded_rad_s = std::sqrt(0.5 * stiffness_n_m / (empty.mass_kg + heaviest_load_kg));
    const double fastest_rad_s = std::sqrt(stiffness_n_m * unloaded_1_kg.maxCoeff());
    const double at_end_rad_s = std::sqrt(end_n_m * unloaded_1_kg.maxCoeff());

    oil.valve_bandwidth_hz =
        std::max(oil.valve_bandwidth_hz, valve_share * fastest_rad_s / (2.0 * std::numbers::pi));
    ControllerSettings& servo = scenario.controller;
    const double integral_1_s = servo.integral_1_m_s / servo.proportional_1_m;
    const double default_gain_1_s = servo.proportional_1_m * default_speed_m_s();
    const double loop_gain_1_s = std::min(default_gain_1_s, loop_gain_share * loaded_rad_s);
    const double damping_1_s = damping_share * loaded_rad_s;
    const double share = stable_share(oil, leakage_1_s(oil, stiffness_n_m), damping_1_s - loop_gain_1_s,
                                      loaded_rad_s, at_end_rad_s);
    servo.proportional_1_m = share * loop_gain_1_s / speed_m_s;
    servo.integral_1_m_s = integral_1_s * servo.proportional_1_m;
    servo.pressure_feedback_1_n = share * damping_1_s / (speed_m_s * stiffness_n_m);
    const double substeps = std::ceil(at_end_rad_s * servo_s / least_step_rad);
    scenario.substeps = std::clamp(static_cast<std::int64_t>(substeps), scenario.substeps, substeps_max);
}

} // namespace

Scenario scaled_machine(const PlatformFile& platform, const ActuatorLimits& limits, double heaviest_load_kg) {
    Scenario scenario;
    scenario.trajectory = StandstillMotion{};
    HydraulicSettings& oil = scenario.hydraulics;
    const Geometry& geometry = platform.geometry;
    const double stroke_m = geometry.stroke_max_m - geometry.stroke_min_m;
    const double stall_n = (oil.supply_pressure_pa - oil.tank_pressure_pa) * oil.piston_area_m2;
    scale_oil(oil, limits.leg_force_n / stall_n, stroke_m / default_stroke_m,
              limits.leg_speed_m_s / default_speed_m_s());
    scenario.limits.pump_flow_m3_s = limits.speed_sum_m_s * oil.piston_area_m2;
    suit_servo(scenario, platform, heaviest_load_kg, limits.leg_speed_m_s);
    return scenario;
}

void suit_default_servo(Scenario& scenario, const PlatformFile& platform) {
    if (scenario.states_servo || scenario.electric.exists()) {
        return;
    }
    const HydraulicSettings& oil = scenario.hydraulics;
    const Geometry& geometry = platform.geometry;
    const auto heaviest = std::max_element(
        scenario.loads.begin(), scenario.loads.end(),
        [](const LoadChange& a, const LoadChange& b) { return a.load.mass_kg < b.load.mass_kg; });
    const MassProperties body = mass_properties(platform.platform) + mass_properties(heaviest->load);
    const Vector6 inverse_1_kg = inverse_masses_1_kg(geometry, body);
    const double stiffness_n_m = oil_stiffness_n_m(oil, geometry, 0.0);
    const Vector6 resonances_rad_s = (stiffness_n_m * inverse_1_kg).cwiseSqrt();

    const double leakage = leakage_1_s(oil, stiffness_n_m);
    const double speed_m_s = actuator_limits(geometry, scenario).leg_speed_m_s;
    const double loop_gain_1_s = scenario.controller.proportional_1_m * speed_m_s;
    double& feedback_1_n = scenario.controller.pressure_feedback_1_n;
    const double difference_1_s = feedback_1_n * speed_m_s * stiffness_n_m - loop_gain_1_s;
    const auto grows = [&](double w) { return leakage + difference_1_s * in_phase(oil, w) < 0.0; };
    if (difference_1_s <= 0.0 ||
        std::none_of(resonances_rad_s.data(), resonances_rad_s.data() + resonances_rad_s.size(), grows)) {
        return;
    }
    const double at_end_rad_s = std::sqrt(end_stiffness_n_m(oil, geometry) * inverse_1_kg.maxCoeff());
    const double kept = stable_share(oil, leakage, difference_1_s, resonances_rad_s.minCoeff(), at_end_rad_s);
    feedback_1_n = (loop_gain_1_s + kept * difference_1_s) / (speed_m_s * stiffness_n_m);
}

} // namespace hexload::sim
