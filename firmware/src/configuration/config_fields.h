/// @file config_fields.h
/// What the configuration is checked for, in the order of hexload_config_find_bad(). Internal; lists, so that
/// the check and the fields' names, which no tick needs, stand in files of their own.
#ifndef HEXLOAD_CONFIG_FIELDS_H
#define HEXLOAD_CONFIG_FIELDS_H

#include "hexload/config.h"

/// Bounds of the ranges. Named, so that the table of the ranges has a byte for each and not a number.
#define CONFIG_BOUNDS(IS)                                                                                    \
    IS(MINUS_LARGEST, HEXLOAD_REAL(-3.4e38))                                                                 \
    IS(MINUS_MILLION, HEXLOAD_REAL(-1e6))                                                                    \
    IS(MINUS_HALF, HEXLOAD_REAL(-0.5))                                                                       \
    IS(ZERO, HEXLOAD_REAL(0.0))                                                                              \
    IS(LEAST_POSITIVE, HEXLOAD_REAL(1.2e-38))                                                                \
    IS(ONE_E_MINUS_10, HEXLOAD_REAL(1e-10))                                                                  \
    IS(ONE_E_MINUS_8, HEXLOAD_REAL(1e-8))                                                                    \
    IS(ONE_E_MINUS_6, HEXLOAD_REAL(1e-6))                                                                    \
    IS(SHORTEST_TICK, HEXLOAD_REAL(0.9999e-4))                                                               \
    IS(LONGEST_TICK, HEXLOAD_REAL(5.0001e-3))                                                                \
    IS(HUNDREDTH, HEXLOAD_REAL(0.01))                                                                        \
    IS(TENTH, HEXLOAD_REAL(0.1))                                                                             \
    IS(HALF, HEXLOAD_REAL(0.5))                                                                              \
    IS(ONE, HEXLOAD_REAL(1.0))                                                                               \
    IS(THREE, HEXLOAD_REAL(3.0))                                                                             \
    IS(SIX, HEXLOAD_REAL(6.0))                                                                               \
    IS(TEN, HEXLOAD_REAL(10.0))                                                                              \
    IS(THIRTY, HEXLOAD_REAL(30.0))                                                                           \
    IS(FIFTY, HEXLOAD_REAL(50.0))                                                                            \
    IS(THOUSAND, HEXLOAD_REAL(1e3))                                                                          \
    IS(ONE_E_5, HEXLOAD_REAL(1e5))                                                                           \
    IS(MILLION, HEXLOAD_REAL(1e6))                                                                           \
    IS(ONE_E_8, HEXLOAD_REAL(1e8))                                                                           \
    IS(LARGEST, HEXLOAD_REAL(3.4e38))

/// Numbers that lie next to each other, the least and the most that they may be.
#define CONFIG_RANGES(IN)                                                                                    \
    IN(tick_s, SHORTEST_TICK, LONGEST_TICK)                                                                  \
    IN(geometry.base_hinge_m, MINUS_LARGEST, LARGEST)                                                        \
    IN(geometry.platform_hinge_m, MINUS_LARGEST, LARGEST)                                                    \
    IN(geometry.home_leg_length_m, LEAST_POSITIVE, MILLION)                                                  \
    IN(geometry.stroke_min_m, MINUS_LARGEST, LARGEST)                                                        \
    IN(geometry.stroke_max_m, MINUS_MILLION, MILLION)                                                        \
    IN(platform.mass_kg, LEAST_POSITIVE, MILLION)                                                            \
    IN(platform.com_m, MINUS_LARGEST, LARGEST)                                                               \
    IN(platform.inertia_kg_m2, MINUS_LARGEST, LARGEST)                                                       \
    IN(gravity_m_s2, ZERO, THIRTY)                                                                           \
    IN(sensors.displacement_sigma_m, ONE_E_MINUS_10, TENTH)                                                  \
    IN(sensors.velocity_sigma_m_s, ONE_E_MINUS_8, ONE)                                                       \
    IN(sensors.force_sigma_n, ONE_E_MINUS_6, ONE_E_5)                                                        \
    IN(sensors.velocity_range_m_s, LEAST_POSITIVE, FIFTY)                                                    \
    IN(sensors.force_range_n, LEAST_POSITIVE, ONE_E_8)                                                       \
    IN(tolerances, ZERO, ONE)                                                                                \
    IN(paper.load_mass_kg, LEAST_POSITIVE, MILLION)                                                          \
    IN(paper.prior_dz_sigma_m, LEAST_POSITIVE, THOUSAND)                                                     \
    IN(paper.prior_inertia_sigma_kg_m2, LEAST_POSITIVE, MILLION)                                             \
    IN(paper.gate_nis, THREE, MILLION)                                                                       \
    IN(paper.inconsistent_nis, THREE, MILLION)                                                               \
    IN(paper.nis_time_constant_s, ZERO, THOUSAND)                                                            \
    IN(paper.converged_relative_sigma, ZERO, ONE)                                                            \
    IN(momentum.prior_mass_kg, ZERO, MILLION)                                                                \
    IN(momentum.prior_mass_sigma_kg, LEAST_POSITIVE, MILLION)                                                \
    IN(momentum.prior_moment_sigma_kg_m, LEAST_POSITIVE, MILLION)                                            \
    IN(momentum.prior_inertia_sigma_kg_m2, LEAST_POSITIVE, ONE_E_8)                                          \
    IN(momentum.inconsistent_nis, SIX, MILLION)                                                              \
    IN(momentum.nis_time_constant_s, ZERO, THOUSAND)                                                         \
    IN(momentum.converged_relative_sigma, ZERO, ONE)                                                         \
    IN(momentum.excitation_time_constant_s, ZERO, THOUSAND)                                                  \
    IN(momentum.timing_s, ZERO, ONE)                                                                         \
    IN(actuator_effects.prior_bias_sigma_n, ZERO, MILLION)                                                   \
    IN(actuator_effects.prior_coulomb_sigma_n, ZERO, MILLION)                                                \
    IN(actuator_effects.prior_viscous_sigma_n_s_m, ZERO, ONE_E_8)                                            \
    IN(actuator_effects.prior_tilt_sigma_m_s2, ZERO, THIRTY)                                                 \
    IN(actuator_effects.friction_speed_m_s, ONE_E_MINUS_6, TEN)                                              \
    IN(actuator_effects.friction_shape, ZERO, TEN)                                                           \
    IN(actuator_effects.leg_share, ZERO, ONE)                                                                \
    IN(rig.force_offset_n, MINUS_MILLION, MILLION)                                                           \
    IN(rig.force_gain, MINUS_HALF, HALF)                                                                     \
    IN(rig.coulomb_n, ZERO, MILLION)                                                                         \
    IN(rig.stribeck_n, MINUS_MILLION, MILLION)                                                               \
    IN(rig.growth_n_n, ZERO, HALF)                                                                           \
    IN(rig.viscous_n_s_m, ZERO, ONE_E_8)                                                                     \
    IN(rig.stribeck_speed_m_s, ONE_E_MINUS_6, TEN)                                                           \
    IN(rig.reversal_speed_m_s, ONE_E_MINUS_6, TEN)                                                           \
    IN(rig.presliding_m, ZERO, HUNDREDTH)                                                                    \
    IN(rig.force_delay_s, ZERO, MILLION)                                                                     \
    IN(rig.velocity_delay_s, ZERO, MILLION)                                                                  \
    IN(rig.leg_inertia_kg_m2, MINUS_MILLION, MILLION)                                                        \
    IN(rig.leg_slide_kg_m, MINUS_MILLION, MILLION)                                                           \
    IN(rig.leg_tilt_kg_m, MINUS_MILLION, MILLION)

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
    GOOD(rig.direction, rig->direction_count > HEXLOAD_RIG_DIRECTIONS_MAX ||                                 \
                            are_in(config, offsetof(hexload_config_t, rig.direction), directions,            \
                                   BOUNDS[MINUS_LARGEST], BOUNDS[LARGEST]))

/// @return the number in these lists of the first field that is not as it must be; negative: all are.
/// Reentrant.
int hexload_config_find_bad(const hexload_config_t* config);

#endif
