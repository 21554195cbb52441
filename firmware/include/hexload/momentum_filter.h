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

#include "hexload/kinematics.h"
#include "hexload/smoother.h"

HEXLOAD_DECLS_BEGIN

/// theta, in the order of every array of ten: the load alone, platform axes, about O_A.
enum hexload_load_parameter {
    HEXLOAD_LOAD_M,  ///< mass, kg
    HEXLOAD_LOAD_HX, ///< mass times centre of mass, kg m
    HEXLOAD_LOAD_HY,
    HEXLOAD_LOAD_HZ,
    HEXLOAD_LOAD_IXX, ///< entries of the inertia tensor, kg m^2; IXY = -integral of x y dm
    HEXLOAD_LOAD_IYY,
    HEXLOAD_LOAD_IZZ,
    HEXLOAD_LOAD_IXY,
    HEXLOAD_LOAD_IXZ,
    HEXLOAD_LOAD_IYZ,
    HEXLOAD_LOAD_DIM
};

/// Longest time that mu is moved on over in one step: at 3 Hz the trapezoid's error is then 3e-4. Over a
/// longer gap mu begins anew, which also makes up for what the gap costs in the other stages.
enum { HEXLOAD_LONGEST_STEP_TICKS = 3 };

enum {
    HEXLOAD_MOMENTUM_STATES = HEXLOAD_LOAD_DIM + 6, ///< theta, mu
    /// Numbers of a symmetric matrix of theta, the lower triangle by rows.
    HEXLOAD_LOAD_COVARIANCES = HEXLOAD_LOAD_DIM * (HEXLOAD_LOAD_DIM + 1) / 2,
};

/// What moves mu at one tick.
typedef struct hexload_momentum_input {
    hexload_real_t wrench[6]; ///< [F N; N + p x F N m], base axes
    hexload_real_t arm[2][4]; ///< p_x, R's first row; p_y, R's second row: G without gravity
} hexload_momentum_input_t;

typedef struct hexload_momentum_filter {
    hexload_real_t platform[HEXLOAD_LOAD_DIM]; ///< theta_platform
    hexload_real_t theta[HEXLOAD_LOAD_DIM];
    hexload_real_t theta_excess[HEXLOAD_LOAD_DIM];               ///< what rounding has added to theta so far
    hexload_real_t momentum[6];                                  ///< mu
    hexload_real_t load_cov[HEXLOAD_LOAD_DIM][HEXLOAD_LOAD_DIM]; ///< of theta
    hexload_real_t cross_cov[6][HEXLOAD_LOAD_DIM];               ///< of mu with theta
    hexload_real_t momentum_cov[6][6];                           ///< of mu; the lower triangle counts
    hexload_momentum_input_t last_input;
    hexload_real_t smooth_twist[6]; ///< of the last sample, base axes
    hexload_real_t nis;             ///< of the last sample, 6 degrees of freedom; 6 when there was none
} hexload_momentum_filter_t;

/// Theta of the configuration's prior. mu comes with the first sample.
void hexload_momentum_filter_init(hexload_momentum_filter_t* self, const hexload_config_t* config);

/// One time update and one measurement update.
/// @param jacobian that of motion, taken apart.
/// @param sensors sigmas to use: the configured or the measured ones.
/// @param smoother constants of the smoother that gave the sample.
/// Reentrant; constant time but for a sample with gap_ticks 0, for which mu begins anew: that is shorter.
void hexload_momentum_filter_step(hexload_momentum_filter_t* self, const hexload_config_t* config,
                                  const hexload_sensors_t* sensors,
                                  const hexload_smoother_constants_t* smoother,
                                  const hexload_smooth_sample_t* sample, const hexload_motion_t* motion,
                                  const hexload_leg_blocks_t* jacobian);

/// Whether a sample has been filtered since the start: before, nothing is known of a load.
static inline bool hexload_momentum_filter_has_begun(const hexload_momentum_filter_t* self) {
    return self->momentum_cov[0][0] > HEXLOAD_REAL(0.0);
}

/// The load has changed: keeps theta as a guess with the prior's sigmas, and no mass is known beforehand any
/// more. mu must begin anew.
void hexload_momentum_filter_forget(hexload_momentum_filter_t* self, const hexload_config_t* config);

/// False when a number is not finite: then only hexload_momentum_filter_init() helps.
bool hexload_momentum_filter_is_finite(const hexload_momentum_filter_t* self);

/// Estimates and their standard deviations.
void hexload_momentum_filter_read(const hexload_momentum_filter_t* self,
                                  hexload_real_t value[HEXLOAD_LOAD_DIM],
                                  hexload_real_t sigma[HEXLOAD_LOAD_DIM]);

/// Covariance of the estimates.
void hexload_momentum_filter_covariance(const hexload_momentum_filter_t* self,
                                        hexload_real_t covariance[HEXLOAD_LOAD_COVARIANCES]);

HEXLOAD_DECLS_END

#endif
