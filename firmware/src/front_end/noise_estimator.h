/// @file noise_estimator.h
/// White noise of the legs' sensors, measured beside the motion.
///
/// The third difference x(k) - 3 x(k-1) + 3 x(k-2) - x(k-3) of a sampled motion is next to nothing: at 1 kHz
/// and 10 Hz it passes 2.5e-4 of the amplitude, and of white noise sqrt(20) sigma. Its leaky mean square over
/// the six legs measures the sensors' sigma within a few per cent, whatever the load. Where that is far from
/// the stated sigma, the filters use what was measured. Third differences in a row of white noise have -15
/// variances in common, and of filtered noise less: so forces in another unit are told from filtered ones. At
/// 5 ms a tick a motion of 4 Hz and 50 mm passes for displacement noise of 20 um.
#ifndef HEXLOAD_NOISE_ESTIMATOR_H
#define HEXLOAD_NOISE_ESTIMATOR_H

#include "hexload/state.h"

/// Mean square of a third difference of white noise, 1 + 9 + 9 + 1, in variances.
#define HEXLOAD_THIRD_DIFFERENCE_SQUARE HEXLOAD_REAL(20.0)

/// Of four values in a row, the newest first.
static inline hexload_real_t hexload_third_difference(hexload_real_t now, hexload_real_t first,
                                                      hexload_real_t second, hexload_real_t third) {
    return now - third + HEXLOAD_REAL(3.0) * (second - first);
}

void hexload_noise_estimator_init(hexload_noise_estimator_t* self);

/// One sample. @param gap_ticks periods since the last. Reentrant, constant time.
void hexload_noise_estimator_step(hexload_noise_estimator_t* self, const hexload_config_t* config,
                                  const hexload_leg_sample_t* sample, uint32_t gap_ticks);

/// The sensors as the filters should take them; of a channel that config->rig has late no better than stated.
/// @param[in,out] health sets NOISE_MISSTATED where a measured sigma is used.
void hexload_noise_estimator_read(const hexload_noise_estimator_t* self, const hexload_config_t* config,
                                  hexload_sensors_t* sensors, uint32_t* health);

/// Whether all forces have so small a share of their stated noise (0.03 to 0.28), and it is white, as if kgf,
/// daN or lbf were read as N: another load explains those as well, and only their noise tells. Never where
/// config->rig has forces late, which a filter makes quiet.
bool hexload_noise_estimator_are_forces_quiet(const hexload_noise_estimator_t* self,
                                              const hexload_config_t* config);

#endif
