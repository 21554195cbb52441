/// @file speed_noise.h
/// Noise of the leg speeds around a stored tick. Internal.
///
/// The noise estimator's is of the last second: held against that, a burst of noise of some ten ticks passes
/// for a transient (transient.h), and its noise for motion that tells inertias.
#ifndef HEXLOAD_SPEED_NOISE_H
#define HEXLOAD_SPEED_NOISE_H

#include "momentum/smoother.h"

/// To be called once for each tick that is taken out of `smoother`: a leaky mean of the squares of third
/// differences, over the legs and HEXLOAD_TRANSIENT_TICKS, until the last of those around the tick. A true
/// transient hardly raises it: a step of speed by 1/40 of its square, and what oscillates at 120 Hz by 1/250
/// of that of its amplitude.
/// @param place of the tick in the rings of `smoother`, which hold HEXLOAD_TRANSIENT_TICKS after it.
/// @return variance in m^2/s^2, the square of sigma_m_s at least. Reentrant, constant time.
hexload_real_t hexload_speed_noise(hexload_smoother_t* smoother, uint32_t place, hexload_real_t sigma_m_s);

#endif
