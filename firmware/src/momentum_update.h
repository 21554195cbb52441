/// @file momentum_update.h
/// The momentum filter's step with what its measurement update leaves behind, for states that are carried
/// along with the filter's. Internal.
#ifndef HEXLOAD_MOMENTUM_UPDATE_H
#define HEXLOAD_MOMENTUM_UPDATE_H

#include "hexload/momentum_filter.h"

/// By how much a variance grows in a tick to cover two roundings of single precision; in double precision
/// too, which thereby is the same filter.
#define COVARIANCE_INFLATION HEXLOAD_REAL(1.000000238)

/// A matrix of six rows over the filter's states, by blocks.
typedef struct momentum_projection {
    hexload_real_t load[6][HEXLOAD_LOAD_DIM];
    hexload_real_t momentum[6][6];
} momentum_projection_t;

/// What was measured, whitened: with e the innovation, H = [Y, -E], S = H P H^T + R = L L^T.
typedef struct momentum_update {
    hexload_real_t Y[6][HEXLOAD_LOAD_DIM];
    hexload_real_t innovation[6]; ///< L^-1 e
    hexload_real_t L[6][6];       ///< lower triangle, diagonal inverted
    momentum_projection_t U;      ///< -L^-1 H P
} momentum_update_t;

/// hexload_momentum_filter_step().
/// @param[out] left what the update leaves; not written for a sample with gap_ticks 0. NULL: not wanted.
void hexload_momentum_filter_update(hexload_momentum_filter_t* self, const hexload_config_t* config,
                                    const hexload_sensors_t* sensors,
                                    const hexload_smoother_constants_t* smoother,
                                    const hexload_smooth_sample_t* sample, const hexload_motion_t* motion,
                                    const hexload_leg_blocks_t* jacobian, momentum_update_t* left);

#endif
