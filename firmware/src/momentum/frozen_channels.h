/// @file frozen_channels.h
/// Whether a sensor has stopped following its leg at this very tick: it then looks like another load, until
/// plausibility.h has a name for it half a second later. Internal.
///
/// A displacement that repeats its last value has stopped when by the velocity the leg has gone on, by more
/// than noise: encoders repeat theirs, too; or when it has jumped. A velocity or a force has when those of
/// other legs change, or when it jumps to nothing.
#ifndef HEXLOAD_FROZEN_CHANNELS_H
#define HEXLOAD_FROZEN_CHANNELS_H

#include "hexload/state.h"

/// Takes a sample. Some 100 instructions. Reentrant.
/// @param sample as the sensors gave it.
void hexload_frozen_channels_step(hexload_frozen_channels_t* self, const hexload_config_t* config,
                                  const hexload_leg_sample_t* sample);

/// Of the sample taken last, and for 0.2 s more where a sensor goes on that had certainly stopped, or jumps
/// to nothing.
HEXLOAD_MUST_USE bool hexload_frozen_channels_are_there(const hexload_frozen_channels_t* self);

/// Whether velocities come at a lower rate than samples, and are held: all six stand still, then all change,
/// for a while. Steps of a converter, where some change and some do not, are not that, nor is a machine at
/// rest. Call it once after each step; some 40 instructions.
HEXLOAD_MUST_USE bool hexload_frozen_channels_are_held(hexload_frozen_channels_t* self);

#endif
