/// @file differentiator.h
/// Legs without velocity sensors: speeds from displacements, and displacements and forces that belong to
/// them.
///
/// The speed of a tick is the slope of the line through the half_window_ticks displacements before it, its
/// own and as many after it: the speed seen through a low-pass filter without phase. Displacement and force
/// go through the same filter, so that the balance of momentum holds between what comes out.
#ifndef HEXLOAD_DIFFERENTIATOR_H
#define HEXLOAD_DIFFERENTIATOR_H

#include "hexload/state.h"

void hexload_differentiator_init(hexload_differentiator_t* self);

/// Takes a checked sample. Up to four missing ones are bridged by lines, more begin anew.
/// @param sample its velocities mean nothing.
/// @param gap_ticks periods since the last one; 0 for the first.
/// @param[out] middle all channels of half_window_ticks ago.
/// @return false while there is none: in the first 2 half_window_ticks, and again after a longer gap.
///         Reentrant, constant time but for a gap.
HEXLOAD_MUST_USE bool hexload_differentiator_step(hexload_differentiator_t* self,
                                                  const hexload_config_t* config,
                                                  const hexload_leg_sample_t* sample, uint32_t gap_ticks,
                                                  hexload_leg_sample_t* middle);

#endif
