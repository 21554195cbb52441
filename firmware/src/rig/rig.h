/// @file rig.h
/// What commissioning knows of the machine (config->rig), taken off: between the leg sample and all that
/// follows. EQUATIONS.md derives it. With the default configuration every function gives back what it was
/// given, to the bit.
///
///     align       force and velocity channels at the time of the displacements; offsets and gains
///     compensate  friction of the legs, by their speeds; forces count less where a leg is slow
///     leg wrench  what the mass of the legs takes beside the part that moves with the platform
#ifndef HEXLOAD_RIG_H
#define HEXLOAD_RIG_H

#include "front_end/kinematics.h"

void hexload_rig_history_init(hexload_rig_history_t* self);

/// The sample of as many ticks ago as the latest channel is late, rounded up: its displacements, and forces
/// and velocities of that instant, by lines between those that came later. Forces without offset and gain.
/// Does not change self.
/// @param sample of the present, not stored yet.
/// @param gap_ticks periods since the last stored; 0 for the first.
/// @param[out] aligned_gap_ticks periods since the last sample that came out; 0 for the first.
/// @return false when a tick that it needs is missing. Reentrant, constant time.
HEXLOAD_MUST_USE bool hexload_rig_align(const hexload_rig_history_t* self, const hexload_config_t* config,
                                        const hexload_leg_sample_t* sample, uint32_t gap_ticks,
                                        hexload_leg_sample_t* aligned, uint32_t* aligned_gap_ticks);

/// Remembers the sample. @param has_aligned what hexload_rig_align() has returned for it.
void hexload_rig_history_store(hexload_rig_history_t* self, const hexload_leg_sample_t* sample,
                               uint32_t gap_ticks, bool has_aligned);

/// As before a first motion.
void hexload_rig_slide_init(hexload_rig_slide_t* self);

/// Takes the legs' friction off.
/// @param speed_m_s of the legs, as smooth as there is.
/// @param gap_ticks periods since the last call.
/// @param[in,out] force_n of the legs' sensors in, of the legs on the platform out.
/// @param[out] variance_n2 what is not known of it, as white noise at the tick rate.
void hexload_rig_compensate(hexload_rig_slide_t* self, const hexload_config_t* config,
                            const hexload_real_t speed_m_s[HEXLOAD_LEGS], uint32_t gap_ticks,
                            hexload_real_t force_n[HEXLOAD_LEGS], hexload_real_t variance_n2[HEXLOAD_LEGS]);

/// Whether the legs have a mass of their own: without, no acceleration is needed.
bool hexload_rig_has_leg_mass(const hexload_config_t* config);

void hexload_rig_twists_init(hexload_rig_twists_t* self);

/// The mean acceleration since HEXLOAD_RIG_TWISTS ticks ago, or since the first of fewer; zero for the first.
/// @param gap_ticks periods since the last twist; but for 1 everything begins anew.
void hexload_rig_accelerate(hexload_rig_twists_t* self, const hexload_config_t* config,
                            const hexload_real_t twist[6], uint32_t gap_ticks,
                            hexload_real_t acceleration[6]);

/// Wrench that the legs' mass takes, moment about O_A, base axes.
/// @param twist,acceleration [v; omega] of O_A and their rates, base axes.
void hexload_rig_leg_wrench(const hexload_config_t* config, const hexload_leg_sample_t* sample,
                            const hexload_motion_t* motion, const hexload_real_t twist[6],
                            const hexload_real_t acceleration[6], hexload_real_t wrench[6]);

#endif
