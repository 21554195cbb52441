/// @file rate_noise.h
/// How noise of leg speeds shows in the angular velocity. Internal.
#ifndef HEXLOAD_RATE_NOISE_H
#define HEXLOAD_RATE_NOISE_H

#include "algebra/leg_blocks.h"

/// Covariance of T omega for leg speeds with independent errors of variance 1; lower triangle.
void hexload_rate_noise(const hexload_leg_blocks_t* blocks, hexload_real_t T[3][3],
                        hexload_real_t noise[3][3]);

#endif
