#include "momentum/momentum_model.h"

#include "algebra/leg_blocks.h"
#include "algebra/linalg.h"

#ifndef HEXLOAD_INLINE_KERNELS
#include "momentum/momentum_kernels.h"
#endif

#include <string.h>

/// Components in base axes of a vector in platform axes: R x.
static void to_base(const hexload_motion_t* motion, const hexload_real_t x[3], hexload_real_t out[3]) {
    HEXLOAD_UNROLL
    for (int k = 0; k < 3; k++) {
        out[k] = dot3(motion->R[k], x);
    }
}

/// Product of a body's inertia tensor with a vector, platform axes.
static void times_inertia(const hexload_real_t theta[HEXLOAD_LOAD_DIM], const hexload_real_t x[3],
                          hexload_real_t out[3]) {
    const hexload_real_t rows[3][3] = {
        {theta[HEXLOAD_LOAD_IXX], theta[HEXLOAD_LOAD_IXY], theta[HEXLOAD_LOAD_IXZ]},
        {theta[HEXLOAD_LOAD_IXY], theta[HEXLOAD_LOAD_IYY], theta[HEXLOAD_LOAD_IYZ]},
        {theta[HEXLOAD_LOAD_IXZ], theta[HEXLOAD_LOAD_IYZ], theta[HEXLOAD_LOAD_IZZ]}};
    HEXLOAD_UNROLL
    for (int k = 0; k < 3; k++) {
        out[k] = dot3(rows[k], x);
    }
}

void hexload_momentum_of_body(const hexload_real_t theta[HEXLOAD_LOAD_DIM], const hexload_motion_t* motion,
                              const hexload_real_t twist[6], hexload_real_t momentum[6]) {
    const hexload_real_t* v = &twist[0];
    const hexload_real_t* omega = &twist[3];
    hexload_real_t h[3];
    hexload_real_t omega_platform[3];
    hexload_real_t spin_platform[3];
    hexload_real_t spin[3];
    hexload_real_t turned[3];
    hexload_real_t lifted[3];
    hexload_real_t moved[3];
    to_base(motion, &theta[HEXLOAD_LOAD_HX], h);
    hexload_motion_to_platform(motion, omega, omega_platform);
    times_inertia(theta, omega_platform, spin_platform);
    to_base(motion, spin_platform, spin);
    cross3(omega, h, turned);
    HEXLOAD_UNROLL
    for (int k = 0; k < 3; k++) {
        momentum[k] = hexload_fma(theta[HEXLOAD_LOAD_M], v[k], turned[k]);
    }
    cross3(h, v, lifted);
    cross3(motion->p_m, momentum, moved);
    HEXLOAD_UNROLL
    for (int k = 0; k < 3; k++) {
        momentum[3 + k] = moved[k] + lifted[k] + spin[k];
    }
}

void hexload_momentum_regressor(const hexload_motion_t* motion, const hexload_real_t twist[6],
                                hexload_real_t Y[6][HEXLOAD_LOAD_DIM]) {
    const hexload_real_t* v = &twist[0];
    const hexload_real_t* omega = &twist[3];
    hexload_real_t moved[3];
    hexload_real_t w[3];
    cross3(motion->p_m, v, moved);
    hexload_motion_to_platform(motion, omega, w);
    for (int k = 0; k < 3; k++) {
        const hexload_real_t* r = motion->R[k]; // k-th components of the platform's axes
        Y[k][HEXLOAD_LOAD_M] = v[k];
        Y[3 + k][HEXLOAD_LOAD_M] = moved[k];
        Y[3 + k][HEXLOAD_LOAD_IXX] = r[0] * w[0];
        Y[3 + k][HEXLOAD_LOAD_IYY] = r[1] * w[1];
        Y[3 + k][HEXLOAD_LOAD_IZZ] = r[2] * w[2];
        Y[3 + k][HEXLOAD_LOAD_IXY] = hexload_fma(r[0], w[1], r[1] * w[0]);
        Y[3 + k][HEXLOAD_LOAD_IXZ] = hexload_fma(r[0], w[2], r[2] * w[0]);
        Y[3 + k][HEXLOAD_LOAD_IYZ] = hexload_fma(r[1], w[2], r[2] * w[1]);
    }
    for (int axis = 0; axis < 3; axis++) {
        const hexload_real_t r[3] = {motion->R[0][axis], motion->R[1][axis], motion->R[2][axis]};
        hexload_real_t turned[3];
        hexload_real_t lifted[3];
        cross3(omega, r, turned);
        cross3(motion->p_m, turned, moved);
        cross3(r, v, lifted);
        for (int k = 0; k < 3; k++) {
            Y[k][HEXLOAD_LOAD_HX + axis] = turned[k];
            Y[3 + k][HEXLOAD_LOAD_HX + axis] = moved[k] + lifted[k];
        }
    }
}

void hexload_momentum_spread(const hexload_momentum_filter_t* filter, hexload_real_t Y[6][HEXLOAD_LOAD_DIM],
                             hexload_real_t spread[6][6]) {
    for (int first = 0; first < 6; first += 3) { // linear rows meet linear ones, which ask for m and h alone
        const int columns = first == 0 ? (int)LIFTED : (int)HEXLOAD_LOAD_DIM;
        hexload_real_t YP[3][HEXLOAD_LOAD_DIM];
        for (int k = 0; k < columns; k += 2) {
            hexload_real_t product[2][6];
            hexload_momentum_rows(Y, filter->load_cov[k], filter->load_cov[k + 1], first, first + 3, product);
            HEXLOAD_UNROLL
            for (int a = 0; a < 3; a++) {
                YP[a][k] = product[0][first + a];
                YP[a][k + 1] = product[1][first + a];
            }
        }
        hexload_momentum_rows(Y, YP[0], YP[1], 0, first + 2, &spread[first]);
        hexload_momentum_rows(Y, YP[1], YP[2], 0, first + 3, &spread[first + 1]);
    }
}

void hexload_momentum_read_arms(const hexload_motion_t* motion, hexload_momentum_input_t* input) {
    for (int axis = 0; axis < 2; axis++) {
        input->arm[axis][0] = motion->p_m[axis];
        memcpy(&input->arm[axis][1], motion->R[axis], 3 * sizeof input->arm[axis][0]);
    }
}

void hexload_momentum_read_input(const hexload_motion_t* motion, const hexload_real_t force_n[HEXLOAD_LEGS],
                                 hexload_momentum_input_t* input) {
    hexload_real_t moved[3];
    for (int k = 0; k < 6; k++) {
        hexload_real_t sum = force_n[0] * motion->J[0][k];
        for (int leg = 1; leg < HEXLOAD_LEGS; leg++) {
            sum = hexload_fma(force_n[leg], motion->J[leg][k], sum);
        }
        input->wrench[k] = sum;
    }
    cross3(motion->p_m, &input->wrench[0], moved);
    for (int k = 0; k < 3; k++) {
        input->wrench[3 + k] += moved[k];
    }
    hexload_momentum_read_arms(motion, input);
}

void hexload_momentum_take_off(const hexload_motion_t* motion, const hexload_real_t wrench[6],
                               hexload_momentum_input_t* input) {
    hexload_real_t moved[3];
    cross3(motion->p_m, &wrench[0], moved);
    for (int k = 0; k < 3; k++) {
        input->wrench[k] -= wrench[k];
        input->wrench[3 + k] -= wrench[3 + k] + moved[k];
    }
}

void hexload_momentum_pull(const hexload_momentum_input_t* last, const hexload_momentum_input_t* input,
                           hexload_real_t impulse_m_s, hexload_real_t G[PULLED][LIFTED]) {
    const hexload_real_t half = HEXLOAD_REAL(0.5) * impulse_m_s;
    for (int k = 0; k < LIFTED; k++) {
        G[0][k] = HEXLOAD_REAL(0.0);
        G[1][k] = -half * (last->arm[1][k] + input->arm[1][k]);
        G[2][k] = half * (last->arm[0][k] + input->arm[0][k]);
    }
    G[0][0] = -impulse_m_s;
}

void hexload_momentum_move(hexload_real_t momentum[6], const hexload_momentum_input_t* last,
                           const hexload_momentum_input_t* input, hexload_real_t dt_s,
                           hexload_real_t G[PULLED][LIFTED], const hexload_real_t body[HEXLOAD_LOAD_DIM]) {
    for (int k = 0; k < 6; k++) {
        momentum[k] = hexload_fma(HEXLOAD_REAL(0.5) * dt_s, input->wrench[k] + last->wrench[k], momentum[k]);
    }
    for (int a = 0; a < PULLED; a++) {
        for (int k = 0; k < LIFTED; k++) {
            momentum[FIRST_PULLED + a] = hexload_fma(G[a][k], body[k], momentum[FIRST_PULLED + a]);
        }
    }
}

void hexload_momentum_of_push(const hexload_motion_t* motion, int leg, hexload_real_t momentum[6]) {
    hexload_real_t moved[3];
    cross3(motion->p_m, &motion->J[leg][0], moved);
    HEXLOAD_UNROLL
    for (int k = 0; k < 3; k++) {
        momentum[k] = motion->J[leg][k];
        momentum[3 + k] = motion->J[leg][3 + k] + moved[k];
    }
}

/// Inertia tensor in base axes: R I R^T.
static void turn_inertia(const hexload_real_t theta[HEXLOAD_LOAD_DIM], const hexload_motion_t* motion,
                         hexload_real_t tensor[3][3]) {
    for (int i = 0; i < 3; i++) {
        hexload_real_t row[3]; // of R I, as I is symmetric
        times_inertia(theta, motion->R[i], row);
        HEXLOAD_UNROLL
        for (int k = 0; k < 3; k++) {
            tensor[i][k] = dot3(row, motion->R[k]);
        }
    }
}

void hexload_momentum_of_leg_speeds(const hexload_real_t theta[HEXLOAD_LOAD_DIM],
                                    const hexload_motion_t* motion, hexload_real_t columns[HEXLOAD_LEGS][6]) {
    hexload_real_t h[3];
    hexload_real_t tensor[3][3];
    hexload_leg_blocks_invert(motion->jacobian, columns); // twists, which their momenta take the place of
    to_base(motion, &theta[HEXLOAD_LOAD_HX], h);
    turn_inertia(theta, motion, tensor);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        hexload_real_t* momentum = columns[leg];
        const hexload_real_t v[3] = {momentum[0], momentum[1], momentum[2]};
        const hexload_real_t omega[3] = {momentum[3], momentum[4], momentum[5]};
        hexload_real_t turned[3];
        hexload_real_t lifted[3];
        hexload_real_t moved[3];
        cross3(omega, h, turned);
        cross3(h, v, lifted);
        HEXLOAD_UNROLL
        for (int k = 0; k < 3; k++) {
            momentum[k] = hexload_fma(theta[HEXLOAD_LOAD_M], v[k], turned[k]);
        }
        cross3(motion->p_m, momentum, moved);
        HEXLOAD_UNROLL
        for (int k = 0; k < 3; k++) {
            momentum[3 + k] = moved[k] + lifted[k] + dot3(tensor[k], omega);
        }
    }
}

void hexload_momentum_add_noise(hexload_real_t columns[HEXLOAD_LEGS][6],
                                const hexload_real_t variance[HEXLOAD_LEGS],
                                hexload_real_t covariance[6][6]) {
    hexload_real_t sum[6][6]; // in registers, which have room for the triangle and a column
    HEXLOAD_UNROLL
    for (int a = 0; a < 6; a++) {
        HEXLOAD_UNROLL
        for (int b = 0; b <= a; b++) {
            sum[a][b] = covariance[a][b];
        }
    }
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        const hexload_real_t* x = columns[leg];
        HEXLOAD_UNROLL
        for (int a = 0; a < 6; a++) {
            const hexload_real_t scaled = variance[leg] * x[a];
            HEXLOAD_UNROLL
            for (int b = 0; b <= a; b++) {
                sum[a][b] = hexload_fma(scaled, x[b], sum[a][b]);
            }
        }
    }
    HEXLOAD_UNROLL
    for (int a = 0; a < 6; a++) {
        HEXLOAD_UNROLL
        for (int b = 0; b <= a; b++) {
            covariance[a][b] = sum[a][b];
        }
    }
}
