/// @file transient.h
/// What is too fast for the smoother of displacements, from the speed sensors around a tick. Internal.
#ifndef HEXLOAD_TRANSIENT_H
#define HEXLOAD_TRANSIENT_H

#include "momentum/smoother.h"

/// Adds to the smooth speeds of a stored tick what stands out in the measured ones of the ticks around it: a
/// polynomial of degree two through 12 ticks on each side, what degree four adds to it, and what degree six
/// does. The tick itself is left out, as its noise is the innovation's. Noise of the three parts, 0.31, 0.26
/// and 0.28 sigma, would count as motion; each is kept times max(0, 1 - 22.46 / q), q the sum over the legs
/// of (part / its sigma)^2, 22.46 the 99.9 % point of chi-square with 6 degrees of freedom. Sigma is that of
/// hexload_speed_noise() (speed_noise.h), which a burst of noise raises. Where a tick among the 24 is missing
/// or an outlier nothing is added; nor where there are transients for more than four lags, as when a servo
/// rings on.
/// @param place of the tick in the rings of `smoother`, which hold 12 ticks before and after it.
/// @param sigma_m_s of the speeds' sensors, of the last second.
/// @param[in,out] velocity_m_s of the legs. Reentrant, constant time.
void hexload_transient_follow(hexload_smoother_t* smoother, uint32_t place, hexload_real_t sigma_m_s,
                              hexload_real_t velocity_m_s[HEXLOAD_LEGS]);

#endif
