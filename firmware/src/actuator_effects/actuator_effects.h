/// @file actuator_effects.h
/// What is left of the machine's own effects when config->rig has been taken off, as more states beside the
/// momentum filter's: a bias, Coulomb friction and viscous friction of each leg, and the base's tilt.
/// EQUATIONS.md derives it.
///
///     f = force on the platform + bias + coulomb s(v) + viscous v,   s(v) = v / sqrt(v^2 + v0^2)
///
/// so mu' loses Jw^T times the last three, and gains what gravity's x and y do to platform and load. v is the
/// smoother's leg speed, whose noise is not that tick's velocity sensor's. What config->rig.direction leaves
/// open beside the states is considered.
#ifndef HEXLOAD_ACTUATOR_EFFECTS_H
#define HEXLOAD_ACTUATOR_EFFECTS_H

#include "momentum/consider.h"

/// No effects, with the configured sigmas; an effect of sigma zero stays zero.
void hexload_actuator_effects_init(hexload_actuator_effects_t* self, const hexload_config_t* config);

/// hexload_consider_step() of all states together.
/// @param load theta and mu. @param consider what the rig's open constants do to them. @param[out] update
/// that of the load, not written when mu began anew.
/// @return false when the platform has been at rest for seconds: there is nothing more to be learnt, and the
/// sensors' noise would be taken for motion. Nothing has been done then, and mu must begin anew. Reentrant;
/// time as there.
HEXLOAD_MUST_USE bool
hexload_actuator_effects_step(hexload_actuator_effects_t* self, hexload_momentum_filter_t* load,
                              hexload_consider_t* consider, const hexload_config_t* config,
                              const hexload_delayed_tick_t* past, hexload_momentum_update_t* update);

/// The load has changed, the actuators have not: what is known of the effects stays, what they have in common
/// with the old load goes. With hexload_momentum_filter_forget(load).
void hexload_actuator_effects_forget(hexload_actuator_effects_t* self);

/// The load has changed, as the present sample shows: until the filter, which runs behind, has passed the
/// ticks that may be another load's than it takes them for, no sample changes the effects. Their errors count
/// in all else as before (Schmidt's filter).
void hexload_actuator_effects_hold(hexload_actuator_effects_t* self, const hexload_config_t* config);

/// Whether a leg's friction drives its leg, at its last speed and beyond DRIVEN_SIGMAS of what is known of it:
/// no friction does, so something else than the load and the legs acts on the platform. Not with a rig file,
/// beside which the states are what has changed since. Reentrant.
bool hexload_actuator_effects_drive(const hexload_actuator_effects_t* self, const hexload_config_t* config);

/// False when a number is not finite: then only hexload_actuator_effects_init() helps.
bool hexload_actuator_effects_is_finite(const hexload_actuator_effects_t* self);

/// Estimates and their standard deviations.
void hexload_actuator_effects_read(const hexload_actuator_effects_t* self,
                                   hexload_real_t value[HEXLOAD_EFFECTS_DIM],
                                   hexload_real_t sigma[HEXLOAD_EFFECTS_DIM]);

/// A sample of the present without the known effects, as on a level base, and sensors whose force sigma
/// covers the unknown ones.
/// @param load whose monitor is to look at it: the errors of the effects add up over that one's memory.
/// @param motion of the sample.
void hexload_actuator_effects_clean(const hexload_actuator_effects_t* self,
                                    const hexload_momentum_filter_t* load, const hexload_config_t* config,
                                    const hexload_motion_t* motion, hexload_leg_sample_t* sample,
                                    hexload_sensors_t* sensors);

#endif
