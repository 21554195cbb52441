// The keys of a scenario file and their ranges, each named once; defaults are those of the structs. A Visitor
// is TomlReader or TomlWriter.
#pragma once

#include "platform_file/toml_fields.hpp"

#include <hexload_sim/scenario.hpp>

namespace hexload::sim {

inline constexpr Range share{1e-3, 1.0, "a number from 0.001 to 1"};
inline constexpr Range probability{0.0, 0.999, "a number from 0 to 0.999"};
inline constexpr Range tilt{-0.5, 0.5, "a number from -0.5 to 0.5"};
inline constexpr Range delay{0.0, 1.0, "a number from 0 to 1"};
inline constexpr Range bandwidth{0.0, unbounded, "a number >= 0, 0 for no low-pass"};

inline constexpr Range electric_gain{0.0, unbounded, "a number >= 0, 0 for hydraulic legs"};

inline constexpr std::array<Choice<ForceSignal>, 2> force_signals{
    {{"load_cell", ForceSignal::load_cell}, {"current", ForceSignal::current}}};
inline constexpr std::array<Choice<FrictionLaw>, 3> friction_laws{
    {{"coulomb", FrictionLaw::coulomb}, {"stribeck", FrictionLaw::stribeck}, {"lugre", FrictionLaw::lugre}}};

template <typename Visitor, typename S> void visit_simulation(Visitor& visitor, S& scenario) {
    visitor.number("duration_s", scenario.duration_s, {duration_min_s, duration_max_s, "0.001 to 4e6 s"});
    visitor.integer("seed", scenario.seed, 0, std::numeric_limits<std::int64_t>::max());
    visitor.integer("substeps", scenario.substeps, 1, substeps_max);
}

template <typename Visitor, typename S> void visit_load_change(Visitor& visitor, S& change) {
    visitor.number("at_s", change.at_s, non_negative);
    visitor.number("mass_kg", change.load.mass_kg, non_negative);
    visitor.vector3("com_m", change.load.com_m);
    visitor.tensor("inertia_com_kg_m2", change.load.inertia_com_kg_m2);
}

template <typename Visitor, typename S> void visit_limits(Visitor& visitor, S& limits) {
    visitor.number("stroke_share", limits.stroke_share, share);
    visitor.number("valve_share", limits.valve_share, share);
    visitor.number("pump_flow_m3_s", limits.pump_flow_m3_s, positive);
}

// How the machine differs from its platform file.
template <typename Visitor, typename S> void visit_machine(Visitor& visitor, S& s) {
    visitor.numbers("tilt_rad", s.tilt_rad, tilt);
    visitor.points("base_hinge_errors_m", s.base_hinge_errors_m);
    visitor.points("platform_hinge_errors_m", s.platform_hinge_errors_m);
    visitor.number("hinge_error_sigma_m", s.hinge_error_sigma_m, non_negative);
    visitor.integer("hinge_error_seed", s.hinge_error_seed, 0, std::numeric_limits<std::int64_t>::max());
    visitor.number("platform_scale", s.platform_scale, positive);
}

template <typename Visitor, typename S> void visit_leg_bars(Visitor& visitor, S& s) {
    visitor.legs("rod_mass_kg", s.rod_mass_kg, non_negative);
    visitor.legs("rod_length_m", s.rod_length_m, positive);
    visitor.legs("cylinder_mass_kg", s.cylinder_mass_kg, non_negative);
    visitor.legs("cylinder_length_m", s.cylinder_length_m, positive);
}

template <typename Visitor, typename S> void visit_friction(Visitor& visitor, S& s) {
    visitor.choice("friction_law", s.law, friction_laws);
    visitor.legs("coulomb_friction_n", s.coulomb_n, non_negative);
    visitor.legs("static_friction_n", s.static_n, non_negative);
    visitor.legs("viscous_friction_n_s_m", s.viscous_n_s_m, non_negative);
    visitor.number("friction_speed_m_s", s.speed_m_s, positive);
    visitor.number("stribeck_speed_m_s", s.stribeck_speed_m_s, positive);
    visitor.number("friction_force_share", s.force_share, fraction);
    visitor.number("bristle_stiffness_n_m", s.bristle_stiffness_n_m, positive);
    visitor.number("bristle_damping_n_s_m", s.bristle_damping_n_s_m, non_negative);
    visitor.number("cold_friction_factor", s.cold_factor, non_negative);
    visitor.number("friction_warm_up_s", s.warm_up_s, positive);
}

template <typename Visitor, typename S> void visit_hydraulics(Visitor& visitor, S& s) {
    visitor.number("supply_pressure_pa", s.supply_pressure_pa, positive);
    visitor.number("tank_pressure_pa", s.tank_pressure_pa, non_negative);
    visitor.number("piston_area_m2", s.piston_area_m2, positive);
    visitor.number("rod_side_area_m2", s.rod_side_area_m2, positive);
    visitor.number("dead_volume_m3", s.dead_volume_m3, positive);
    visitor.number("bulk_modulus_pa", s.bulk_modulus_pa, positive);
    visitor.number("leakage_m3_s_pa", s.leakage_m3_s_pa, non_negative);
    visitor.number("rated_flow_m3_s", s.rated_flow_m3_s, positive);
    visitor.number("laminar_pressure_pa", s.laminar_pressure_pa, positive);
    visitor.number("valve_bandwidth_hz", s.valve_bandwidth_hz, positive);
    visitor.number("valve_damping", s.valve_damping, positive);
    visit_friction(visitor, s.friction);
    visitor.number("stop_stiffness_n_m", s.stop_stiffness_n_m, non_negative);
    visitor.number("stop_damping_s_m", s.stop_damping_s_m, non_negative);
}

template <typename Visitor, typename S> void visit_electric(Visitor& visitor, S& s) {
    visitor.number("force_gain_n_a", s.force_gain_n_a, electric_gain);
    visitor.number("current_limit_a", s.current_limit_a, positive);
    visitor.number("current_bandwidth_hz", s.current_bandwidth_hz, positive);
    visitor.number("reflected_mass_kg", s.reflected_mass_kg, non_negative);
    visitor.number("speed_limit_m_s", s.speed_limit_m_s, positive);
    visitor.number("speed_gain_n_s_m", s.speed_gain_n_s_m, positive);
    visitor.number("speed_integral_n_m", s.speed_integral_n_m, non_negative);
    visitor.choice("force_signal", s.force_signal, force_signals);
    visit_friction(visitor, s.friction);
}

template <typename Visitor, typename S> void visit_controller(Visitor& visitor, S& s) {
    visitor.number("proportional_1_m", s.proportional_1_m, non_negative);
    visitor.number("integral_1_m_s", s.integral_1_m_s, non_negative);
    visitor.number("derivative_s_m", s.derivative_s_m, non_negative);
    visitor.number("velocity_feedforward", s.velocity_feedforward, non_negative);
    visitor.number("pressure_feedback_1_n", s.pressure_feedback_1_n, non_negative);
    visitor.boolean("gravity_offset", s.gravity_offset);
    visitor.number("integral_limit", s.integral_limit, fraction);
    visitor.boolean("reads_sensors", s.reads_sensors);
}

template <typename Visitor, typename S> void visit_sensors(Visitor& visitor, S& s) {
    visitor.number("noise_scale", s.noise_scale, non_negative);
    visitor.vector6("displacement_bias_m", s.displacement_bias_m);
    visitor.vector6("velocity_bias_m_s", s.velocity_bias_m_s);
    visitor.vector6("force_bias_n", s.force_bias_n);
    visitor.legs("force_gain", s.force_gain, positive);
    visitor.number("force_bandwidth_hz", s.low_passes.force_hz, bandwidth);
    visitor.number("velocity_bandwidth_hz", s.low_passes.velocity_hz, bandwidth);
    visitor.boolean("velocity_sensor", s.velocity_sensor);
    visitor.number("displacement_step_m", s.displacement_step_m, non_negative);
    visitor.number("velocity_step_m_s", s.velocity_step_m_s, non_negative);
    visitor.number("force_step_n", s.force_step_n, non_negative);
    visitor.integer("delay_ticks", s.delay_ticks, 0, 1000);
    visitor.number("force_delay_s", s.force_delay_s, delay);
    visitor.number("velocity_delay_s", s.velocity_delay_s, delay);
    visitor.number("dropout_probability", s.dropout_probability, probability);
}

// One overload per kind of motion; the writer picks by variant, the reader by the key `kind`.
template <typename Visitor> void visit_motion(Visitor& visitor, auto& motion) {
    using M = std::remove_cvref_t<decltype(motion)>;
    if constexpr (std::is_same_v<M, PaperMotion>) {
        visitor.number("amplitude_x_m", motion.amplitude_x_m);
        visitor.number("amplitude_y_m", motion.amplitude_y_m);
        visitor.number("amplitude_yaw_deg", motion.amplitude_yaw_deg);
        visitor.number("frequency_hz", motion.frequency_hz, positive);
        visitor.number("run_in_s", motion.run_in_s, non_negative);
    } else if constexpr (std::is_same_v<M, MultisineMotion>) {
        visitor.number("translation_m", motion.translation_m, non_negative);
        visitor.number("rotation_deg", motion.rotation_deg, non_negative);
        visitor.number("frequency_min_hz", motion.frequency_min_hz, positive);
        visitor.number("frequency_max_hz", motion.frequency_max_hz, positive);
        visitor.integer("sines", motion.sines, 1, 1000);
        visitor.number("run_in_s", motion.run_in_s, non_negative);
    } else if constexpr (std::is_same_v<M, WorkMotion>) {
        visitor.number("reach_m", motion.reach_m, non_negative);
        visitor.number("rotation_deg", motion.rotation_deg, non_negative);
        visitor.number("move_s", motion.move_s, positive);
        visitor.number("dwell_s", motion.dwell_s, non_negative);
    } else if constexpr (std::is_same_v<M, StandstillMotion>) {
        visitor.vector6("pose", motion.pose);
    }
}

} // namespace hexload::sim
