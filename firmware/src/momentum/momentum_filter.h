/// @file momentum_filter.h
/// Kalman filter on the inertial momentum of platform + load: mass, centre of mass and inertia of the load,
/// from any motion. EQUATIONS.md derives it.
///
///     mu = [P; H] = Y(p, R, V) (theta + theta_platform)          linear in the parameters
///     mu' = [F; N + p x F] + G(p, R) (theta + theta_platform)    no accelerations, no Coriolis terms
///
/// P and H are linear and angular momentum about the fixed home point of O_A, in base axes. Measured are the
/// six leg speeds. Y is linearised at the twist that the smoother finds, whose noise is independent of that
/// tick's velocity sensors'; the filter therefore runs lag_ticks behind, and as theta is constant, its
/// estimate is one for the present.
#ifndef HEXLOAD_MOMENTUM_FILTER_H
#define HEXLOAD_MOMENTUM_FILTER_H

#include "momentum/delayed_tick.h"

/// Longest time that mu is moved on over in one step: at 3 Hz the trapezoid's error is then 3e-4. Over a
/// longer gap mu begins anew, which also makes up for what the gap costs in the other stages.
enum { HEXLOAD_LONGEST_STEP_TICKS = 3 };

/// By how much a variance grows in a tick to cover two roundings of single precision; in double precision
/// too, which thereby is the same filter.
#define HEXLOAD_COVARIANCE_INFLATION HEXLOAD_REAL(1.000000238)

/// A matrix of six rows over the filter's states, by blocks.
typedef struct hexload_momentum_projection {
    hexload_real_t load[6][HEXLOAD_LOAD_DIM];
    hexload_real_t momentum[6][6];
} hexload_momentum_projection_t;

/// What was measured, whitened: with e the innovation, H = [Y, -E], S = H P H^T + R = L L^T.
typedef struct hexload_momentum_update {
    hexload_real_t Y[6][HEXLOAD_LOAD_DIM];
    hexload_real_t innovation[6];    ///< L^-1 e
    hexload_real_t L[6][6];          ///< lower triangle, diagonal inverted
    hexload_momentum_projection_t U; ///< -L^-1 H P
} hexload_momentum_update_t;

/// The configured prior sigma of each parameter.
void hexload_momentum_prior_sigma(const hexload_momentum_config_t* momentum,
                                  hexload_real_t sigma[HEXLOAD_LOAD_DIM]);

/// Theta of the configuration's prior. mu comes with the first sample.
void hexload_momentum_filter_init(hexload_momentum_filter_t* self, const hexload_config_t* config);

/// One time update and one measurement update. A sample with gap_ticks 0 is none: mu begins anew.
/// @param[out] update its working memory, and what the measurement update leaves behind, for states that are
///             carried along and for a trace; not written when mu began anew.
/// Reentrant; constant time but for a sample with gap_ticks 0, which is shorter.
void hexload_momentum_filter_step(hexload_momentum_filter_t* self, const hexload_config_t* config,
                                  const hexload_delayed_tick_t* past, hexload_momentum_update_t* update);

/// Whether a sample has been filtered since the start: before, nothing is known of a load.
static inline bool hexload_momentum_filter_has_begun(const hexload_momentum_filter_t* self) {
    return self->momentum_cov[0][0] > HEXLOAD_REAL(0.0);
}

/// The load has changed: keeps theta as a guess with the prior's sigmas, and no mass is known beforehand any
/// more. mu must begin anew.
void hexload_momentum_filter_forget(hexload_momentum_filter_t* self, const hexload_config_t* config);

/// False when a number is not finite: then only hexload_momentum_filter_init() helps.
bool hexload_momentum_filter_is_finite(const hexload_momentum_filter_t* self);

/// The body that moves: platform and load.
void hexload_momentum_filter_body(const hexload_momentum_filter_t* self,
                                  hexload_real_t body[HEXLOAD_LOAD_DIM]);

/// Estimates and their standard deviations.
void hexload_momentum_filter_read(const hexload_momentum_filter_t* self,
                                  hexload_real_t value[HEXLOAD_LOAD_DIM],
                                  hexload_real_t sigma[HEXLOAD_LOAD_DIM]);

#endif
