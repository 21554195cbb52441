/// @file momentum_model.h
/// The momentum of a body on the platform and what the leg speeds say about it. Internal. All vectors in base
/// axes, momentum about the fixed home point of O_A; bodies as in enum hexload_load_parameter.
#ifndef HEXLOAD_MOMENTUM_MODEL_H
#define HEXLOAD_MOMENTUM_MODEL_H

#include "momentum/momentum_filter.h"

#include "algebra/linalg.h"

/// About O_A, base axes, of a momentum or wrench about the home point.
static inline void hexload_momentum_move_point(const hexload_motion_t* motion, const hexload_real_t home[6],
                                               hexload_real_t moved[6]) {
    hexload_real_t moment[3];
    cross3(motion->p_m, home, moment);
    for (int k = 0; k < 3; k++) {
        moved[k] = home[k];
        moved[3 + k] = home[3 + k] - moment[k];
    }
}

/// [P; H] of a body that moves with a twist: Y(p, R, V) theta.
void hexload_momentum_of_body(const hexload_real_t theta[HEXLOAD_LOAD_DIM], const hexload_motion_t* motion,
                              const hexload_real_t twist[6], hexload_real_t momentum[6]);

/// Y(p, R, V). The linear rows are zero beyond h, and not written there: nothing reads it.
void hexload_momentum_regressor(const hexload_motion_t* motion, const hexload_real_t twist[6],
                                hexload_real_t Y[6][HEXLOAD_LOAD_DIM]);

#ifdef HEXLOAD_INLINE_KERNELS
#include "momentum/momentum_kernels.h"
#else
/// Y's rows `from` to `to` - 1 times ten numbers x and ten numbers y, which share what is read of Y; of the
/// linear momentum's, the first three, only m and h count.
void hexload_momentum_rows(hexload_real_t Y[6][HEXLOAD_LOAD_DIM], const hexload_real_t x[HEXLOAD_LOAD_DIM],
                           const hexload_real_t y[HEXLOAD_LOAD_DIM], int from, int to,
                           hexload_real_t product[2][6]);
#endif

/// Y P_tt Y^T, lower triangle: how uncertain the parameters leave what Y makes of them.
void hexload_momentum_spread(const hexload_momentum_filter_t* filter, hexload_real_t Y[6][HEXLOAD_LOAD_DIM],
                             hexload_real_t spread[6][6]);

/// Wrench about the fixed home point, and what gravity's moment needs.
void hexload_momentum_read_input(const hexload_motion_t* motion, const hexload_real_t force_n[HEXLOAD_LEGS],
                                 hexload_momentum_input_t* input);

/// Of the input what gravity's moment needs alone.
void hexload_momentum_read_arms(const hexload_motion_t* motion, hexload_momentum_input_t* input);

/// Takes a wrench about O_A off the input.
void hexload_momentum_take_off(const hexload_motion_t* motion, const hexload_real_t wrench[6],
                               hexload_momentum_input_t* input);

/// Rows of G that are not zero, and its columns: gravity acts on P_z, H_x and H_y, through m, hx, hy and hz.
enum { FIRST_PULLED = 2, PULLED = 3, LIFTED = 4 };

/// Gbar: G over an interval, trapezoidal. @param impulse_m_s gravity times the interval.
void hexload_momentum_pull(const hexload_momentum_input_t* last, const hexload_momentum_input_t* input,
                           hexload_real_t impulse_m_s, hexload_real_t G[PULLED][LIFTED]);

/// mu+ = mu + dt/2 (u + u_last) + Gbar theta.
void hexload_momentum_move(hexload_real_t momentum[6], const hexload_momentum_input_t* last,
                           const hexload_momentum_input_t* input, hexload_real_t dt_s,
                           hexload_real_t G[PULLED][LIFTED], const hexload_real_t body[HEXLOAD_LOAD_DIM]);

/// Momentum that one newton second on a leg gives: a column of Jw.
void hexload_momentum_of_push(const hexload_motion_t* motion, int leg, hexload_real_t momentum[6]);

/// Momentum of a body whose legs move at unit speed, one after the other: columns of M J^-1.
void hexload_momentum_of_leg_speeds(const hexload_real_t theta[HEXLOAD_LOAD_DIM],
                                    const hexload_motion_t* motion, hexload_real_t columns[HEXLOAD_LEGS][6]);

/// Adds the sum of variance x x^T over the columns x to a covariance of mu, lower triangle.
void hexload_momentum_add_noise(hexload_real_t columns[HEXLOAD_LEGS][6],
                                const hexload_real_t variance[HEXLOAD_LEGS], hexload_real_t covariance[6][6]);

#endif
