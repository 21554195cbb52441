/// @file paper_filter.h
/// Fourth stage: the paper's seven-state extended Kalman filter, (24)-(36), corrected as EQUATIONS.md
/// derives.
///
/// Euler's equation about the centre of mass of platform + load, in platform axes. With r its position seen
/// from O_A and F, N the legs' wrench, it holds for every tilt and every motion, gravity included (which has
/// no moment there):
///
///     D omega' + omega x D omega = N - r x F
///     D = Ip + I + (m_a m_l / m) diag(s^2, s^2, 0),  s = dz - com_z of the platform
///
/// Unknown are dz and the load's central inertias Ixx, Iyy, Izz; the load's centre of mass is taken on the z
/// axis and its products of inertia as zero, as in the paper.
#ifndef HEXLOAD_PAPER_FILTER_H
#define HEXLOAD_PAPER_FILTER_H

#include "hexload/wrench.h"

HEXLOAD_DECLS_BEGIN

/// Parameters of the paper's filter, in the order of every array of four.
enum hexload_paper_parameter {
    HEXLOAD_PAPER_DZ,  ///< height of the load's centre of mass over O_A, m
    HEXLOAD_PAPER_IXX, ///< about the load's own centre of mass, kg m^2
    HEXLOAD_PAPER_IYY,
    HEXLOAD_PAPER_IZZ,
    HEXLOAD_PAPER_DIM
};

/// Ticks of leg forces that the noise estimator looks at.
enum { HEXLOAD_FORCE_HISTORY = 3 };

/// What the filter needs of the machine, from the configuration.
typedef struct hexload_paper_constants {
    hexload_real_t mass_share;       ///< m_l / m
    hexload_real_t reduced_mass_kg;  ///< m_a m_l / m
    hexload_real_t com_offset_m[3];  ///< m_a c_a / m: centre of mass of all when dz = 0
    hexload_real_t inertia_kg_m2[3]; ///< share of D that is known: the platform's
    hexload_real_t prior_variance[HEXLOAD_PAPER_DIM];
} hexload_paper_constants_t;

/// Variances of the noise in the Jacobian N that comes from the force sensors: of the derivatives by dz (rows
/// 0, 1), by the row's own inertia, and their covariance.
typedef struct hexload_jacobian_noise {
    hexload_real_t dz[2];
    hexload_real_t mixed[2];
    hexload_real_t inertia[3];
} hexload_jacobian_noise_t;

/// State and covariance P = [rate_cov, cross_cov; cross_cov^T, param_cov]; of both squares the lower triangle
/// counts.
typedef struct hexload_paper_filter {
    hexload_paper_constants_t constants;
    hexload_real_t rate_rad_s[3];            ///< omega, platform axes
    hexload_real_t param[HEXLOAD_PAPER_DIM]; ///< dz, Ixx, Iyy, Izz
    hexload_real_t rate_cov[3][3];
    hexload_real_t cross_cov[3][HEXLOAD_PAPER_DIM];
    hexload_real_t param_cov[HEXLOAD_PAPER_DIM][HEXLOAD_PAPER_DIM];
    hexload_jacobian_noise_t jacobian_noise; ///< summed over the filter's memory, in cross_cov / param_cov
    hexload_wrench_t last_wrench;
    hexload_real_t last_force_n[HEXLOAD_FORCE_HISTORY][HEXLOAD_LEGS]; ///< newest first
    uint32_t history;                                                 ///< consecutive ticks in last_force_n
    uint32_t gated;     ///< innovations gated one after the other
    hexload_real_t nis; ///< of the last innovation, 3 degrees of freedom; 3 when there was none
} hexload_paper_filter_t;

/// Zero parameters and the configured prior (paper, section 4). The rates come from the first sample.
void hexload_paper_filter_init(hexload_paper_filter_t* self, const hexload_config_t* config);

/// One time update (32) and one measurement update (36).
/// @param jacobian that of motion.
/// @param gap_ticks 0 for the first sample, which sets the rates; more than longest_gap_ticks: rates restart.
/// @param[in,out] health sets RATE_RESEEDED, MEASUREMENT_GATED, INERTIA_BOUNDED, COVARIANCE_BOUNDED,
/// FILTER_RESTARTED, NOISE_BOUNDED.
/// Reentrant, constant time but for these cases, which are shorter.
void hexload_paper_filter_step(hexload_paper_filter_t* self, const hexload_config_t* config,
                               const hexload_leg_sample_t* sample, const hexload_motion_t* motion,
                               const hexload_leg_blocks_t* jacobian, const hexload_wrench_t* wrench,
                               uint32_t gap_ticks, uint32_t* health);

/// Estimates and their standard deviations.
void hexload_paper_filter_read(const hexload_paper_filter_t* self, hexload_real_t value[HEXLOAD_PAPER_DIM],
                               hexload_real_t sigma[HEXLOAD_PAPER_DIM]);

HEXLOAD_DECLS_END

#endif
