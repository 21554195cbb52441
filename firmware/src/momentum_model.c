#include "momentum_model.h"

#include "leg_blocks.h"
#include "linalg.h"

#include <string.h>

/// Components in base axes of a vector in platform axes: R x.
static void to_base(const hexload_motion_t* motion, const hexload_real_t x[3], hexload_real_t out[3]) {
    for (int k = 0; k < 3; k++) {
        out[k] = dot3(motion->R[k], x);
    }
}

/// Product of a body's inertia tensor with a vector, platform axes.
static void times_inertia(const hexload_real_t theta[HEXLOAD_LOAD_DIM], const hexload_real_t x[3],
                          hexload_real_t out[3]) {
    out[0] = theta[HEXLOAD_LOAD_IXX] * x[0] + theta[HEXLOAD_LOAD_IXY] * x[1] + theta[HEXLOAD_LOAD_IXZ] * x[2];
    out[1] = theta[HEXLOAD_LOAD_IXY] * x[0] + theta[HEXLOAD_LOAD_IYY] * x[1] + theta[HEXLOAD_LOAD_IYZ] * x[2];
    out[2] = theta[HEXLOAD_LOAD_IXZ] * x[0] + theta[HEXLOAD_LOAD_IYZ] * x[1] + theta[HEXLOAD_LOAD_IZZ] * x[2];
}

void momentum_of_body(const hexload_real_t theta[HEXLOAD_LOAD_DIM], const hexload_motion_t* motion,
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
    for (int k = 0; k < 3; k++) {
        momentum[k] = theta[HEXLOAD_LOAD_M] * v[k] + turned[k];
    }
    cross3(h, v, lifted);
    cross3(motion->p_m, momentum, moved);
    for (int k = 0; k < 3; k++) {
        momentum[3 + k] = moved[k] + lifted[k] + spin[k];
    }
}

void momentum_regressor(const hexload_motion_t* motion, const hexload_real_t twist[6],
                        hexload_real_t Y[6][HEXLOAD_LOAD_DIM]) {
    const hexload_real_t* v = &twist[0];
    const hexload_real_t* omega = &twist[3];
    hexload_real_t moved[3];
    hexload_real_t w[3];
    cross3(motion->p_m, v, moved);
    hexload_motion_to_platform(motion, omega, w);
    for (int k = 0; k < 3; k++) {
        const hexload_real_t* r = motion->R[k]; // k-th components of the platform's axes
        memset(&Y[k][HEXLOAD_LOAD_IXX], 0, HEXLOAD_I_DIM * sizeof Y[k][0]);
        Y[k][HEXLOAD_LOAD_M] = v[k];
        Y[3 + k][HEXLOAD_LOAD_M] = moved[k];
        Y[3 + k][HEXLOAD_LOAD_IXX] = r[0] * w[0];
        Y[3 + k][HEXLOAD_LOAD_IYY] = r[1] * w[1];
        Y[3 + k][HEXLOAD_LOAD_IZZ] = r[2] * w[2];
        Y[3 + k][HEXLOAD_LOAD_IXY] = r[0] * w[1] + r[1] * w[0];
        Y[3 + k][HEXLOAD_LOAD_IXZ] = r[0] * w[2] + r[2] * w[0];
        Y[3 + k][HEXLOAD_LOAD_IYZ] = r[1] * w[2] + r[2] * w[1];
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

void momentum_spread(const hexload_momentum_filter_t* filter, hexload_real_t Y[6][HEXLOAD_LOAD_DIM],
                     hexload_real_t spread[6][6]) {
    const hexload_real_t* P = filter->covariance;
    hexload_real_t YP[6][HEXLOAD_LOAD_DIM];
    for (int k = 0; k < HEXLOAD_LOAD_DIM; k++) {
        hexload_real_t column[HEXLOAD_LOAD_DIM];
        for (int j = 0; j < HEXLOAD_LOAD_DIM; j++) {
            column[j] = P[j <= k ? ROW(k) + j : ROW(j) + k];
        }
        for (int a = 0; a < 6; a++) {
            YP[a][k] = momentum_times_row(Y[a], column, a < 3);
        }
    }
    for (int a = 0; a < 6; a++) {
        for (int b = 0; b <= a; b++) {
            spread[a][b] = momentum_times_row(Y[b], YP[a], b < 3);
        }
    }
}

/// Inertia tensor about the centre of mass, platform axes.
static void central_inertia(const hexload_real_t theta[HEXLOAD_LOAD_DIM], const hexload_real_t com_m[3],
                            hexload_real_t tensor[3][3]) {
    const hexload_real_t* h = &theta[HEXLOAD_LOAD_HX];
    const hexload_real_t hc = dot3(h, com_m);
    for (int k = 0; k < 3; k++) {
        tensor[k][k] = theta[HEXLOAD_LOAD_IXX + k] - (hc - h[k] * com_m[k]);
    }
    tensor[0][1] = theta[HEXLOAD_LOAD_IXY] + h[0] * com_m[1];
    tensor[0][2] = theta[HEXLOAD_LOAD_IXZ] + h[0] * com_m[2];
    tensor[1][2] = theta[HEXLOAD_LOAD_IYZ] + h[1] * com_m[2];
    tensor[1][0] = tensor[0][1];
    tensor[2][0] = tensor[0][2];
    tensor[2][1] = tensor[1][2];
}

bool momentum_rows(const hexload_real_t theta[HEXLOAD_LOAD_DIM], const hexload_motion_t* motion,
                   momentum_row_t rows[HEXLOAD_LEGS]) {
    const hexload_real_t inverse_mass = HEXLOAD_REAL(1.0) / theta[HEXLOAD_LOAD_M];
    hexload_real_t com_platform_m[3];
    hexload_real_t com_m[3];
    hexload_real_t tensor[3][3];
    hexload_real_t L[3][3];
    hexload_real_t inverse[3][3];
    for (int k = 0; k < 3; k++) {
        com_platform_m[k] = inverse_mass * theta[HEXLOAD_LOAD_HX + k];
    }
    central_inertia(theta, com_platform_m, tensor);
    if (!cholesky3(tensor, L) || !invert3(tensor, inverse)) {
        return false;
    }
    to_base(motion, com_platform_m, com_m);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) { // |e . v + (R a x e) . omega of the momentum| = 1 unit
        const hexload_real_t* direction = &motion->J[leg][0];
        momentum_row_t* row = &rows[leg];
        hexload_real_t arm[3]; // of the leg's line about the centre of mass
        hexload_real_t arm_platform[3];
        hexload_real_t angular[3];
        hexload_real_t shift[3];
        cross3(com_m, direction, arm);
        for (int k = 0; k < 3; k++) {
            arm[k] = motion->J[leg][3 + k] - arm[k];
        }
        hexload_motion_to_platform(motion, arm, arm_platform);
        for (int k = 0; k < 3; k++) {
            angular[k] = dot3(inverse[k], arm_platform);
        }
        to_base(motion, angular, row->angular);
        cross3(row->angular, com_m, shift);
        for (int k = 0; k < 3; k++) {
            row->at_origin[k] = inverse_mass * direction[k] - shift[k];
        }
        cross3(row->angular, motion->p_m, shift);
        for (int k = 0; k < 3; k++) {
            row->linear[k] = row->at_origin[k] - shift[k];
        }
    }
    return true;
}

void momentum_read_input(const hexload_motion_t* motion, const hexload_real_t force_n[HEXLOAD_LEGS],
                         hexload_momentum_input_t* input) {
    hexload_real_t moved[3];
    *input = (hexload_momentum_input_t){0};
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        for (int k = 0; k < 6; k++) {
            input->wrench[k] += force_n[leg] * motion->J[leg][k];
        }
    }
    cross3(motion->p_m, &input->wrench[0], moved);
    for (int k = 0; k < 3; k++) {
        input->wrench[3 + k] += moved[k];
    }
    for (int axis = 0; axis < 2; axis++) {
        input->arm[axis][0] = motion->p_m[axis];
        memcpy(&input->arm[axis][1], motion->R[axis], 3 * sizeof input->arm[axis][0]);
    }
}

void momentum_pull(const hexload_momentum_input_t* last, const hexload_momentum_input_t* input,
                   hexload_real_t impulse_m_s, hexload_real_t G[PULLED][LIFTED]) {
    const hexload_real_t half = HEXLOAD_REAL(0.5) * impulse_m_s;
    for (int k = 0; k < LIFTED; k++) {
        G[0][k] = HEXLOAD_REAL(0.0);
        G[1][k] = -half * (last->arm[1][k] + input->arm[1][k]);
        G[2][k] = half * (last->arm[0][k] + input->arm[0][k]);
    }
    G[0][0] = -impulse_m_s;
}

void momentum_move(hexload_real_t momentum[6], const hexload_momentum_input_t* last,
                   const hexload_momentum_input_t* input, hexload_real_t dt_s,
                   hexload_real_t G[PULLED][LIFTED], const hexload_real_t body[HEXLOAD_LOAD_DIM]) {
    for (int k = 0; k < 6; k++) {
        momentum[k] += HEXLOAD_REAL(0.5) * dt_s * (input->wrench[k] + last->wrench[k]);
    }
    for (int a = 0; a < PULLED; a++) {
        for (int k = 0; k < LIFTED; k++) {
            momentum[FIRST_PULLED + a] += G[a][k] * body[k];
        }
    }
}

void momentum_of_push(const hexload_motion_t* motion, int leg, hexload_real_t momentum[6]) {
    hexload_real_t moved[3];
    cross3(motion->p_m, &motion->J[leg][0], moved);
    for (int k = 0; k < 3; k++) {
        momentum[k] = motion->J[leg][k];
        momentum[3 + k] = motion->J[leg][3 + k] + moved[k];
    }
}

void momentum_of_leg_speeds(const hexload_real_t theta[HEXLOAD_LOAD_DIM], const hexload_motion_t* motion,
                            const hexload_leg_blocks_t* jacobian, hexload_real_t columns[HEXLOAD_LEGS][6]) {
    for (uint32_t leg = 0; leg < HEXLOAD_LEGS; leg++) {
        hexload_real_t twist[6] = {0};
        for (int k = 0; k < 3; k++) {
            twist[3 + k] = motion->rate_gain[k][leg];
        }
        leg_blocks_velocity_of_leg(jacobian, leg, &twist[3], &twist[0]);
        momentum_of_body(theta, motion, twist, columns[leg]);
    }
}

void momentum_add_noise(hexload_real_t columns[HEXLOAD_LEGS][6], const hexload_real_t variance[HEXLOAD_LEGS],
                        hexload_real_t* covariance, int skipped) {
    int row = 0;
    for (int a = 0; a < 6; a++) {
        hexload_real_t scaled[HEXLOAD_LEGS];
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            scaled[leg] = variance[leg] * columns[leg][a];
        }
        row += skipped;
        for (int b = 0; b <= a; b++) {
            covariance[row + b] += scaled[0] * columns[0][b] + scaled[1] * columns[1][b] +
                                   scaled[2] * columns[2][b] + scaled[3] * columns[3][b] +
                                   scaled[4] * columns[4][b] + scaled[5] * columns[5][b];
        }
        row += a + 1;
    }
}
