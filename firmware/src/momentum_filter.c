#include "hexload/momentum_filter.h"

#include "chi_square.h"
#include "leg_blocks.h"
#include "linalg.h"
#include "momentum_model.h"
#include "momentum_prior.h"
#include "momentum_update.h"

#include <stddef.h>
#include <string.h>

enum { DIM = HEXLOAD_LOAD_DIM };

HEXLOAD_RARE static void read_prior(const hexload_config_t* config, hexload_real_t value[DIM],
                                    hexload_real_t sigma[DIM]) {
    const hexload_momentum_config_t* momentum = &config->momentum;
    for (int k = 0; k < DIM; k++) {
        value[k] = HEXLOAD_REAL(0.0);
        sigma[k] =
            k < HEXLOAD_LOAD_IXX ? momentum->prior_moment_sigma_kg_m : momentum->prior_inertia_sigma_kg_m2;
    }
    value[HEXLOAD_LOAD_M] = momentum->prior_mass_kg;
    sigma[HEXLOAD_LOAD_M] = momentum->prior_mass_sigma_kg;
}

HEXLOAD_RARE void hexload_momentum_filter_init(hexload_momentum_filter_t* self,
                                               const hexload_config_t* config) {
    const hexload_platform_t* platform = &config->platform;
    hexload_real_t sigma[DIM];
    *self = (hexload_momentum_filter_t){.nis = CHI_SQUARE_6_MEAN};
    self->platform[HEXLOAD_LOAD_M] = platform->mass_kg;
    for (int k = 0; k < 3; k++) {
        self->platform[HEXLOAD_LOAD_HX + k] = platform->mass_kg * platform->com_m[k];
    }
    for (int k = 0; k < HEXLOAD_I_DIM; k++) {
        self->platform[HEXLOAD_LOAD_IXX + k] = platform->inertia_kg_m2[k];
    }
    read_prior(config, self->theta, sigma);
    for (int k = 0; k < DIM; k++) {
        self->load_cov[k][k] = sigma[k] * sigma[k];
    }
}

/// The body that moves: platform and load.
static void add_platform(const hexload_momentum_filter_t* self, hexload_real_t body[DIM]) {
    for (int k = 0; k < DIM; k++) {
        body[k] = self->platform[k] + self->theta[k];
    }
}

/// The body of the gains: bounded to what is possible, and one sigma heavier than it seems, so that an early
/// gain does not claim information that its wrong linearisation point does not have.
static void make_cautious(const hexload_momentum_filter_t* self, hexload_real_t body[DIM]) {
    add_platform(self, body);
    body[HEXLOAD_LOAD_M] = self->platform[HEXLOAD_LOAD_M] +
                           hexload_max(self->theta[HEXLOAD_LOAD_M], HEXLOAD_REAL(0.0)) +
                           hexload_sqrt(self->load_cov[HEXLOAD_LOAD_M][HEXLOAD_LOAD_M]);
    for (int k = HEXLOAD_LOAD_IXX; k <= HEXLOAD_LOAD_IZZ; k++) {
        body[k] = self->platform[k] + hexload_max(self->theta[k], HEXLOAD_REAL(0.0)) +
                  hexload_sqrt(self->load_cov[k][k]);
    }
}

/// P_mt and P_mm for mu+ = mu + Gbar theta. With C the mean of P_mt before and after,
/// P_mm grows by Gbar C^T + C Gbar^T.
static void move_covariance(hexload_momentum_filter_t* self, hexload_real_t G[PULLED][LIFTED]) {
    hexload_real_t mean[6][LIFTED];
    for (int b = 0; b < 6; b++) {
        memcpy(mean[b], self->cross_cov[b], sizeof mean[b]);
    }
    for (int a = 0; a < PULLED; a++) {
        hexload_real_t* row = self->cross_cov[FIRST_PULLED + a];
        for (int k = 0; k < LIFTED; k++) {
            for (int j = 0; j < DIM; j++) {
                row[j] = hexload_fma(G[a][k], self->load_cov[k][j], row[j]);
            }
        }
        for (int k = 0; k < LIFTED; k++) {
            mean[FIRST_PULLED + a][k] = HEXLOAD_REAL(0.5) * (mean[FIRST_PULLED + a][k] + row[k]);
        }
    }
    for (int a = 0; a < PULLED; a++) {
        const int row = FIRST_PULLED + a;
        for (int b = 0; b < 6; b++) {
            hexload_real_t sum = HEXLOAD_REAL(0.0);
            HEXLOAD_UNROLL
            for (int k = 0; k < LIFTED; k++) {
                sum = hexload_fma(G[a][k], mean[b][k], sum);
            }
            self->momentum_cov[b <= row ? row : b][b <= row ? b : row] +=
                b == row ? HEXLOAD_REAL(2.0) * sum : sum;
        }
    }
}

/// mu+ = mu + dt/2 (u + u_last) + Gbar (theta + theta_platform).
static void predict(hexload_momentum_filter_t* self, const hexload_config_t* config,
                    const hexload_sensors_t* sensors, const hexload_smooth_sample_t* sample,
                    const hexload_motion_t* motion, const hexload_momentum_input_t* input) {
    const hexload_real_t dt_s = config->tick_s * (hexload_real_t)sample->gap_ticks;
    const hexload_real_t impulse_sigma_n_s = dt_s * sensors->force_sigma_n;
    hexload_real_t variance[HEXLOAD_LEGS];
    hexload_real_t columns[HEXLOAD_LEGS][6];
    hexload_real_t body[DIM];
    hexload_real_t G[PULLED][LIFTED];
    momentum_pull(&self->last_input, input, dt_s * config->gravity_m_s2, G);
    add_platform(self, body);
    momentum_move(self->momentum, &self->last_input, input, dt_s, G, body);
    move_covariance(self, G);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        momentum_of_push(motion, leg, columns[leg]);
        variance[leg] = impulse_sigma_n_s * impulse_sigma_n_s + dt_s * dt_s * sample->force_variance_n2[leg];
    }
    momentum_add_noise(columns, variance, self->momentum_cov);
}

/// What the smoother leaves of the measured speeds.
typedef struct residue {
    hexload_real_t smooth_twist[6];
    hexload_real_t twist[6];                   ///< measured minus smooth
    hexload_real_t velocity_m_s[HEXLOAD_LEGS]; ///< likewise
} residue_t;

static void find_residue(const hexload_smooth_sample_t* sample, const hexload_motion_t* motion,
                         const hexload_leg_blocks_t* jacobian, residue_t* residue) {
    leg_blocks_solve(jacobian, sample->smooth_velocity_m_s, residue->smooth_twist);
    for (int k = 0; k < 6; k++) {
        residue->twist[k] = motion->twist[k] - residue->smooth_twist[k];
        residue->velocity_m_s[k] = sample->sample.velocity_m_s[k] - sample->smooth_velocity_m_s[k];
    }
}

/// mu from the smooth twist: P_mt = Y P_tt, P_mm = Y P_tt Y^T + the noise of the twist.
HEXLOAD_RARE static void seed_momentum(hexload_momentum_filter_t* self, const hexload_sensors_t* sensors,
                                       const hexload_motion_t* motion, const hexload_leg_blocks_t* jacobian,
                                       const residue_t* residue) {
    hexload_real_t body[DIM];
    hexload_real_t Y[6][DIM];
    hexload_real_t variance[HEXLOAD_LEGS];
    hexload_real_t columns[HEXLOAD_LEGS][6];
    add_platform(self, body);
    momentum_of_body(body, motion, residue->smooth_twist, self->momentum);
    momentum_regressor(motion, residue->smooth_twist, Y);
    for (int a = 0; a < 6; a++) {
        for (int j = 0; j < DIM; j++) {
            self->cross_cov[a][j] = momentum_times_row(Y[a], self->load_cov[j], a < 3);
        }
        for (int b = 0; b <= a; b++) {
            self->momentum_cov[a][b] = momentum_times_row(Y[b], self->cross_cov[a], b < 3);
        }
    }
    make_cautious(self, body);
    const hexload_real_t sigma_m_s = sensors->velocity_sigma_m_s;
    momentum_of_leg_speeds(body, motion, jacobian, columns);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        const hexload_real_t left_m_s = residue->velocity_m_s[leg];
        variance[leg] = sigma_m_s * sigma_m_s + HEXLOAD_REAL(4.0) * left_m_s * left_m_s;
    }
    momentum_add_noise(columns, variance, self->momentum_cov);
}

/// How many ticks a residue beyond the noise stays the same: a shock is smeared over half the lag.
static hexload_real_t correlated_ticks(const hexload_smoother_constants_t* smoother,
                                       const hexload_sensors_t* sensors, const residue_t* residue) {
    hexload_real_t q = HEXLOAD_REAL(0.0);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        const hexload_real_t in_sigmas = residue->velocity_m_s[leg] / sensors->velocity_sigma_m_s;
        q += in_sigmas * in_sigmas;
    }
    const hexload_real_t share = hexload_max(HEXLOAD_REAL(0.0), HEXLOAD_REAL(1.0) - CHI_SQUARE_6_95 / q);
    return HEXLOAD_REAL(1.0) + HEXLOAD_REAL(0.5) * (hexload_real_t)smoother->lag_ticks * share;
}

/// The six leg speeds as a measurement of momentum: e = Y(V) (theta + theta_platform) - mu, H = [Y, -E] with
/// the smooth twist, so that H's noise is not the innovation's.
typedef struct measurement {
    hexload_real_t Y[6][DIM];
    hexload_real_t innovation[6];
    hexload_real_t S[6][6]; ///< R first; lower triangle
} measurement_t;

/// Noise of e: that of the leg speeds by the cautious body, and the parameters' errors on the part of the
/// twist that the smoother leaves out.
static void measurement_noise(const hexload_momentum_filter_t* self, const hexload_sensors_t* sensors,
                              const hexload_motion_t* motion, const hexload_leg_blocks_t* jacobian,
                              const residue_t* residue, hexload_real_t noise_ticks, hexload_real_t R[6][6]) {
    const hexload_real_t sigma_m_s = sensors->velocity_sigma_m_s;
    hexload_real_t body[DIM];
    hexload_real_t columns[HEXLOAD_LEGS][6];
    hexload_real_t Y[6][DIM];
    hexload_real_t spread[6][6];
    make_cautious(self, body);
    momentum_of_leg_speeds(body, motion, jacobian, columns);
    momentum_regressor(motion, residue->twist, Y);
    momentum_spread(self, Y, spread);
    for (int a = 0; a < 6; a++) {
        for (int b = 0; b <= a; b++) {
            hexload_real_t sum = HEXLOAD_REAL(0.0);
            HEXLOAD_UNROLL
            for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
                sum = hexload_fma(columns[leg][a], columns[leg][b], sum);
            }
            R[a][b] = hexload_fma(sigma_m_s * sigma_m_s, sum, noise_ticks * spread[a][b]);
        }
    }
}

static void measure(const hexload_momentum_filter_t* self, const hexload_motion_t* motion,
                    const residue_t* residue, measurement_t* measured) {
    hexload_real_t body[DIM];
    momentum_regressor(motion, residue->smooth_twist, measured->Y);
    add_platform(self, body);
    momentum_of_body(body, motion, motion->twist, measured->innovation);
    for (int k = 0; k < 6; k++) {
        measured->innovation[k] -= self->momentum[k];
    }
}

/// -H P = [E, -Y] P, and S = H P H^T + R.
static void project_covariance(const hexload_momentum_filter_t* self, measurement_t* measured,
                               momentum_projection_t* U) {
    for (int a = 0; a < 6; a++) {
        const hexload_real_t* Y = measured->Y[a];
        for (int j = 0; j < DIM; j++) {
            U->load[a][j] = self->cross_cov[a][j] - momentum_times_row(Y, self->load_cov[j], a < 3);
        }
        for (int b = 0; b < 6; b++) {
            U->momentum[a][b] = self->momentum_cov[b <= a ? a : b][b <= a ? b : a] -
                                momentum_times_row(Y, self->cross_cov[b], a < 3);
        }
        for (int b = 0; b <= a; b++) {
            measured->S[a][b] += U->momentum[a][b] - momentum_times_row(measured->Y[b], U->load[a], b < 3);
        }
    }
}

/// Column i of a matrix of six rows.
static void read_column(const hexload_real_t* matrix, int columns, int i, hexload_real_t column[6]) {
    HEXLOAD_UNROLL
    for (int a = 0; a < 6; a++) {
        column[a] = matrix[a * columns + i];
    }
}

/// In single precision an update errs by some roundings of each variance. Where a sum is soon known a
/// thousand times better than its parts that would leave no covariance, so as much is added before.
static void cover_rounding(hexload_momentum_filter_t* self) {
    for (int k = 0; k < DIM; k++) {
        self->load_cov[k][k] *= MOMENTUM_COVER;
    }
}

/// Compensated, as a correction may be less than the rounding of a large parameter.
static void correct_theta(hexload_momentum_filter_t* self, int i, hexload_real_t correction) {
    const hexload_real_t due = correction - self->theta_excess[i];
    const hexload_real_t corrected = self->theta[i] + due;
    self->theta_excess[i] = (corrected - self->theta[i]) - due;
    self->theta[i] = corrected;
}

/// x += (H P)^T S^-1 e, P -= (H P)^T S^-1 H P, both by their whitened halves.
static void correct(hexload_momentum_filter_t* self, measurement_t* measured, momentum_update_t* left) {
    momentum_projection_t U;
    hexload_real_t u[2][6];
    const hexload_real_t* e = measured->innovation;
    cover_rounding(self);
    project_covariance(self, measured, &U);
    cholesky6(measured->S);
    whiten6(measured->S, &U.load[0][0], DIM);
    whiten6(measured->S, &U.momentum[0][0], 6);
    whiten6(measured->S, measured->innovation, 1);
    self->nis = dot6(e, e);
    for (int i = 0; i < DIM; i += 2) {
        read_column(&U.load[0][0], DIM, i, u[0]);
        read_column(&U.load[0][0], DIM, i + 1, u[1]);
        correct_theta(self, i, dot6(u[0], e));
        correct_theta(self, i + 1, dot6(u[1], e));
        take_off6_twice(self->load_cov[i], self->load_cov[i + 1], u[0], u[1], &U.load[0][0], DIM, i + 1);
        take_off6(&self->load_cov[i + 1][i + 1], u[1], &U.load[0][i + 1], DIM, 1);
    }
    for (int i = 0; i < DIM; i++) {
        for (int j = 0; j < i; j++) {
            self->load_cov[j][i] = self->load_cov[i][j];
        }
    }
    for (int i = 0; i < 6; i += 2) {
        read_column(&U.momentum[0][0], 6, i, u[0]);
        read_column(&U.momentum[0][0], 6, i + 1, u[1]);
        self->momentum[i] += dot6(u[0], e);
        self->momentum[i + 1] += dot6(u[1], e);
        take_off6_twice(self->cross_cov[i], self->cross_cov[i + 1], u[0], u[1], &U.load[0][0], DIM, DIM);
        take_off6_twice(self->momentum_cov[i], self->momentum_cov[i + 1], u[0], u[1], &U.momentum[0][0], 6,
                        i + 1);
        take_off6(&self->momentum_cov[i + 1][i + 1], u[1], &U.momentum[0][i + 1], 6, 1);
    }
    if (left != NULL) {
        memcpy(left->Y, measured->Y, sizeof left->Y);
        memcpy(left->innovation, measured->innovation, sizeof left->innovation);
        memcpy(left->L, measured->S, sizeof left->L);
        left->U = U;
    }
}

void momentum_filter_update(hexload_momentum_filter_t* self, const hexload_config_t* config,
                            const hexload_sensors_t* sensors, const hexload_smoother_constants_t* smoother,
                            const hexload_smooth_sample_t* sample, const hexload_motion_t* motion,
                            const hexload_leg_blocks_t* jacobian, momentum_update_t* left) {
    residue_t residue;
    measurement_t measured;
    hexload_momentum_input_t input;
    find_residue(sample, motion, jacobian, &residue);
    momentum_read_input(motion, sample->sample.force_n, &input);
    momentum_take_off(motion, sample->leg_wrench, &input);
    if (sample->gap_ticks == 0) {
        seed_momentum(self, sensors, motion, jacobian, &residue);
        self->nis = CHI_SQUARE_6_MEAN;
    } else {
        predict(self, config, sensors, sample, motion, &input);
        measure(self, motion, &residue, &measured);
        measurement_noise(self, sensors, motion, jacobian, &residue,
                          correlated_ticks(smoother, sensors, &residue), measured.S);
        correct(self, &measured, left);
    }
    self->last_input = input;
    memcpy(self->smooth_twist, residue.smooth_twist, sizeof self->smooth_twist);
}

void hexload_momentum_filter_step(hexload_momentum_filter_t* self, const hexload_config_t* config,
                                  const hexload_sensors_t* sensors,
                                  const hexload_smoother_constants_t* smoother,
                                  const hexload_smooth_sample_t* sample, const hexload_motion_t* motion,
                                  const hexload_leg_blocks_t* jacobian) {
    momentum_filter_update(self, config, sensors, smoother, sample, motion, jacobian, NULL);
}

HEXLOAD_RARE void hexload_momentum_filter_forget(hexload_momentum_filter_t* self,
                                                 const hexload_config_t* config) {
    hexload_real_t value[DIM];
    hexload_real_t sigma[DIM];
    read_prior(config, value, sigma);
    sigma[HEXLOAD_LOAD_M] = hexload_max(sigma[HEXLOAD_LOAD_M], momentum_open_mass_sigma_kg(config));
    memset(self->load_cov, 0, sizeof self->load_cov);
    for (int k = 0; k < DIM; k++) {
        self->load_cov[k][k] = sigma[k] * sigma[k];
    }
}

bool hexload_momentum_filter_is_finite(const hexload_momentum_filter_t* self) {
    hexload_real_t sum = HEXLOAD_REAL(0.0); // a variance below zero becomes NaN here
    for (int k = 0; k < DIM; k++) {
        sum += self->theta[k] + hexload_sqrt(self->load_cov[k][k]);
    }
    for (int k = 0; k < 6; k++) {
        sum += self->momentum[k] + hexload_sqrt(self->momentum_cov[k][k]);
    }
    return isfinite(sum);
}

void hexload_momentum_filter_read(const hexload_momentum_filter_t* self, hexload_real_t value[DIM],
                                  hexload_real_t sigma[DIM]) {
    for (int k = 0; k < DIM; k++) {
        value[k] = self->theta[k];
        sigma[k] = hexload_sqrt(self->load_cov[k][k]);
    }
}
