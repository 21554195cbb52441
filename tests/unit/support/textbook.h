/// @file textbook.h
/// The momentum filters' arithmetic as textbooks print it: full matrices in double precision, inverses
/// instead of factors. Only the pose, its Jacobian and the state come from the firmware.
#ifndef HEXLOAD_TEST_TEXTBOOK_H
#define HEXLOAD_TEST_TEXTBOOK_H

#include "machine.h"

#include "front_end/kinematics.h"

/// The crooked machine in mid-motion; lives as long as its Jacobian is used.
typedef struct scene {
    hexload_config_t config;
    hexload_kinematics_t kinematics;
    hexload_leg_sample_t sample;
    hexload_motion_t motion;
} scene_t;

void scene_at(scene_t* scene, uint32_t tick);

void cross(const double a[3], const double b[3], double out[3]);

/// out = A B^T of rows x inner and columns x inner numbers; out may be none of them.
void times_transposed(const double* A, const double* B, int rows, int columns, int inner, double* out);

/// By elimination with pivoting. Fails when A is singular.
void invert(const double* A, int n, double* inverse);

/// Weights of the ticks 1..n before and after in the middle value of the polynomial of even degree up to six
/// that fits these 2 n best; odd parts are zero there. @return the variance of the value, in those of a tick.
double weigh_polynomial(int degree, int n, double* weight);

/// Random covariance of n numbers with sigmas around these: about as well conditioned as n.
void random_covariance(uint64_t* seed, int n, const double* sigma, double* covariance);

/// [v; omega] of leg speeds.
void twist_of(const hexload_motion_t* motion, const double speed_m_s[6], double twist[6]);

/// Momentum about the home point of a body of these ten parameters.
void momentum_of(const hexload_motion_t* motion, const double twist[6], const double theta[10],
                 double momentum[6]);

/// Columns: momentum of each parameter alone.
void regressor_of(const hexload_motion_t* motion, const double twist[6], double Y[6][10]);

/// Column: wrench about the home point of one newton in each leg.
void pushes_of(const hexload_motion_t* motion, double Jw[6][6]);

/// Column: momentum of a body of which one leg moves at one metre per second.
void momenta_of_legs(const hexload_motion_t* motion, const double theta[10], double columns[6][6]);

/// Wrench about the home point of the weight of each parameter alone.
void weights_of(const hexload_motion_t* motion, double gravity_m_s2, double G[6][10]);

/// covariance += columns diag(variance) columns^T.
void add_noise_of(double columns[6][6], const double variance[6], double covariance[6][6]);

#endif
