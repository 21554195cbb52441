/// @file lost_channels.h
/// A sample of which one force or one displacement, or one of each, is missing: NaN. Five of six legs go on.
/// Internal.
///
/// A displacement goes on with its leg's velocity, for 10 s at most. A force is taken for the mean of the
/// other five, and known no better than to the largest of them, so that the filter learns next to nothing
/// from the push along that leg, until the last guess has left the smoother.
#ifndef HEXLOAD_LOST_CHANNELS_H
#define HEXLOAD_LOST_CHANNELS_H

#include "hexload/state.h"

void hexload_lost_channels_init(hexload_lost_channels_t* self);

/// @param[in] gate the last accepted sample, from which a displacement goes on.
/// @param[out] mended the sample without gaps, where there are any that can be closed.
/// @param[out] next what *self is once the sample has been accepted.
/// @param[in,out] health sets CHANNEL_LOST.
/// @return mended, or the sample itself: whole, or with more gaps than can be closed, which
/// hexload_leg_sample_check() refuses. Constant time, reentrant.
const hexload_leg_sample_t*
hexload_lost_channels_mend(const hexload_lost_channels_t* self, const hexload_config_t* config,
                           const hexload_leg_gate_t* gate, const hexload_leg_sample_t* sample,
                           hexload_leg_sample_t* mended, hexload_lost_channels_t* next, uint32_t* health);

/// Whether a force of the sample that *self has come to is a guess, or, without velocity sensors, one of the
/// window that its forces are means of.
bool hexload_lost_channels_lack_force(const hexload_lost_channels_t* self);

/// Adds the variance of a force that is, or lately was, a guess.
/// @param[in] force_n of the legs on the platform.
/// @param[in,out] variance_n2 of what is not known of them.
void hexload_lost_channels_doubt(const hexload_lost_channels_t* self,
                                 const hexload_real_t force_n[HEXLOAD_LEGS],
                                 hexload_real_t variance_n2[HEXLOAD_LEGS]);

#endif
