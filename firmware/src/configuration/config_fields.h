/// @file config_fields.h
/// What the configuration is checked for, in the order of hexload_config_find_bad(). Internal; lists, so that
/// the check and the fields' names, which no tick needs, stand in files of their own.
#ifndef HEXLOAD_CONFIG_FIELDS_H
#define HEXLOAD_CONFIG_FIELDS_H

#include "hexload/config.h"

#define MILLION HEXLOAD_REAL(1e6)
#define LARGEST HEXLOAD_REAL(3.4e38)
#define LEAST_POSITIVE HEXLOAD_REAL(1.2e-38)

/// Numbers that lie next to each other, the least and the most that they may be.
#define CONFIG_RANGES(IN)                                                                                    \
    IN(tick_s, HEXLOAD_REAL(0.9999e-4), HEXLOAD_REAL(5.0001e-3))                                             \
    IN(geometry.base_hinge_m, -LARGEST, LARGEST)                                                             \
    IN(geometry.platform_hinge_m, -LARGEST, LARGEST)                                                         \
    IN(geometry.home_leg_length_m, LEAST_POSITIVE, MILLION)                                                  \
    IN(geometry.stroke_min_m, -LARGEST, LARGEST)                                                             \
    IN(geometry.stroke_max_m, -MILLION, MILLION)                                                             \
    IN(platform.mass_kg, LEAST_POSITIVE, MILLION)                                                            \
    IN(platform.com_m, -LARGEST, LARGEST)                                                                    \
    IN(platform.inertia_kg_m2, -LARGEST, LARGEST)                                                            \
    IN(gravity_m_s2, HEXLOAD_REAL(0.0), HEXLOAD_REAL(30.0))                                                  \
    IN(sensors.displacement_sigma_m, HEXLOAD_REAL(1e-10), HEXLOAD_REAL(0.1))                                 \
    IN(sensors.velocity_sigma_m_s, HEXLOAD_REAL(1e-8), HEXLOAD_REAL(1.0))                                    \
    IN(sensors.force_sigma_n, HEXLOAD_REAL(1e-6), HEXLOAD_REAL(1e5))                                         \
    IN(sensors.velocity_range_m_s, LEAST_POSITIVE, HEXLOAD_REAL(50.0))                                       \
    IN(sensors.force_range_n, LEAST_POSITIVE, HEXLOAD_REAL(1e8))                                             \
    IN(tolerances, HEXLOAD_REAL(0.0), HEXLOAD_REAL(1.0))                                                     \
    IN(paper.load_mass_kg, LEAST_POSITIVE, MILLION)                                                          \
    IN(paper.prior_dz_sigma_m, LEAST_POSITIVE, HEXLOAD_REAL(1e3))                                            \
    IN(paper.prior_inertia_sigma_kg_m2, LEAST_POSITIVE, MILLION)                                             \
    IN(paper.gate_nis, HEXLOAD_REAL(3.0), MILLION)                                                           \
    IN(paper.inconsistent_nis, HEXLOAD_REAL(3.0), MILLION)                                                   \
    IN(paper.nis_time_constant_s, HEXLOAD_REAL(0.0), HEXLOAD_REAL(1e3))                                      \
    IN(paper.converged_relative_sigma, HEXLOAD_REAL(0.0), HEXLOAD_REAL(1.0))                                 \
    IN(momentum.prior_mass_kg, HEXLOAD_REAL(0.0), MILLION)                                                   \
    IN(momentum.prior_mass_sigma_kg, LEAST_POSITIVE, MILLION)                                                \
    IN(momentum.prior_moment_sigma_kg_m, LEAST_POSITIVE, MILLION)                                            \
    IN(momentum.prior_inertia_sigma_kg_m2, LEAST_POSITIVE, MILLION)                                          \
    IN(momentum.inconsistent_nis, HEXLOAD_REAL(6.0), MILLION)                                                \
    IN(momentum.nis_time_constant_s, HEXLOAD_REAL(0.0), HEXLOAD_REAL(1e3))                                   \
    IN(momentum.converged_relative_sigma, HEXLOAD_REAL(0.0), HEXLOAD_REAL(1.0))                              \
    IN(momentum.excitation_time_constant_s, HEXLOAD_REAL(0.0), HEXLOAD_REAL(1e3))                            \
    IN(actuator_effects.prior_bias_sigma_n, HEXLOAD_REAL(0.0), MILLION)                                      \
    IN(actuator_effects.prior_coulomb_sigma_n, HEXLOAD_REAL(0.0), MILLION)                                   \
    IN(actuator_effects.prior_viscous_sigma_n_s_m, HEXLOAD_REAL(0.0), HEXLOAD_REAL(1e8))                     \
    IN(actuator_effects.prior_tilt_sigma_m_s2, HEXLOAD_REAL(0.0), HEXLOAD_REAL(30.0))                        \
    IN(actuator_effects.friction_speed_m_s, HEXLOAD_REAL(1e-6), HEXLOAD_REAL(10.0))                          \
    IN(rig.force_offset_n, -MILLION, MILLION)                                                                \
    IN(rig.force_gain, HEXLOAD_REAL(-0.5), HEXLOAD_REAL(0.5))                                                \
    IN(rig.coulomb_n, HEXLOAD_REAL(0.0), MILLION)                                                            \
    IN(rig.stribeck_n, -MILLION, MILLION)                                                                    \
    IN(rig.growth_n_n, HEXLOAD_REAL(0.0), HEXLOAD_REAL(0.5))                                                 \
    IN(rig.viscous_n_s_m, HEXLOAD_REAL(0.0), HEXLOAD_REAL(1e8))                                              \
    IN(rig.stribeck_speed_m_s, HEXLOAD_REAL(1e-6), HEXLOAD_REAL(10.0))                                       \
    IN(rig.reversal_speed_m_s, HEXLOAD_REAL(1e-6), HEXLOAD_REAL(10.0))                                       \
    IN(rig.presliding_m, HEXLOAD_REAL(0.0), HEXLOAD_REAL(0.01))                                              \
    IN(rig.force_delay_s, HEXLOAD_REAL(0.0), MILLION)                                                        \
    IN(rig.velocity_delay_s, HEXLOAD_REAL(0.0), MILLION)                                                     \
    IN(rig.leg_inertia_kg_m2, -MILLION, MILLION)                                                             \
    IN(rig.leg_slide_kg_m, -MILLION, MILLION)                                                                \
    IN(rig.leg_tilt_kg_m, -MILLION, MILLION)

/// Beyond the ranges: counts, and what depends on another field; with the names of first_contradiction().
#define CONFIG_CONTRADICTIONS(GOOD)                                                                          \
    GOOD(kind, (unsigned)config->kind < (unsigned)HEXLOAD_KINDS)                                             \
    GOOD(sensors.half_window_ticks, config->sensors.half_window_ticks <= HEXLOAD_HALF_WINDOW_TICKS_MAX &&    \
                                        config->sensors.half_window_ticks != 1)                              \
    GOOD(geometry.stroke_min_m, leaves_legs(&config->geometry))                                              \
    GOOD(geometry.stroke_max_m, config->geometry.stroke_max_m > config->geometry.stroke_min_m)               \
    GOOD(platform.inertia_kg_m2, is_inertia_of_body(&config->platform))                                      \
    GOOD(paper.nis_time_constant_s, config->paper.nis_time_constant_s >= config->tick_s)                     \
    GOOD(paper.longest_gap_ticks, config->paper.longest_gap_ticks >= 1)                                      \
    GOOD(paper.longest_gate_ticks, config->paper.longest_gate_ticks >= 1)                                    \
    GOOD(momentum.lag_ticks,                                                                                 \
         momentum->lag_ticks >= HEXLOAD_TRANSIENT_TICKS && momentum->lag_ticks <= HEXLOAD_LAG_TICKS_MAX)     \
    GOOD(momentum.longest_gap_ticks,                                                                         \
         momentum->longest_gap_ticks >= 1 && momentum->longest_gap_ticks <= HEXLOAD_MISSING_TICKS_MAX)       \
    GOOD(momentum.nis_time_constant_s, momentum->nis_time_constant_s >= config->tick_s)                      \
    GOOD(momentum.excitation_time_constant_s, momentum->excitation_time_constant_s >= config->tick_s)        \
    GOOD(rig.stribeck_n, is_dry_friction(rig))                                                               \
    GOOD(rig.force_delay_s, rig->force_delay_s <= latest_s)                                                  \
    GOOD(rig.velocity_delay_s, rig->velocity_delay_s <= latest_s)                                            \
    GOOD(rig.direction_count, rig->direction_count <= HEXLOAD_RIG_DIRECTIONS_MAX)                            \
    GOOD(rig.direction,                                                                                      \
         rig->direction_count > HEXLOAD_RIG_DIRECTIONS_MAX ||                                                \
             are_in(config, offsetof(hexload_config_t, rig.direction), directions, -LARGEST, LARGEST))

/// @return the number in these lists of the first field that is not as it must be; negative: all are.
/// Reentrant.
int hexload_config_find_bad(const hexload_config_t* config);

#endif
