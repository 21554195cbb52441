#include "hexload/momentum_filter.h"

#include "leg_blocks.h"
#include "linalg.h"
#include "momentum_model.h"

#include <string.h>

#define IDEAL_NIS HEXLOAD_REAL(6.0)
#define CHI_SQUARE_6_95 HEXLOAD_REAL(12.59)

enum { STATES = HEXLOAD_MOMENTUM_STATES, DIM = HEXLOAD_LOAD_DIM };

static void read_prior(const hexload_config_t* config, hexload_real_t value[DIM], hexload_real_t sigma[DIM]) {
    const hexload_momentum_config_t* momentum = &config->momentum;
    for (int k = 0; k < DIM; k++) {
        value[k] = HEXLOAD_REAL(0.0);
        sigma[k] =
            k < HEXLOAD_LOAD_IXX ? momentum->prior_moment_sigma_kg_m : momentum->prior_inertia_sigma_kg_m2;
    }
    value[HEXLOAD_LOAD_M] = momentum->prior_mass_kg;
    sigma[HEXLOAD_LOAD_M] = momentum->prior_mass_sigma_kg;
}

void hexload_momentum_filter_init(hexload_momentum_filter_t* self, const hexload_config_t* config) {
    const hexload_platform_t* platform = &config->platform;
    hexload_real_t sigma[DIM];
    *self = (hexload_momentum_filter_t){.nis = IDEAL_NIS};
    self->platform[HEXLOAD_LOAD_M] = platform->mass_kg;
    for (int k = 0; k < 3; k++) {
        self->platform[HEXLOAD_LOAD_HX + k] = platform->mass_kg * platform->com_m[k];
    }
    for (int k = 0; k < HEXLOAD_I_DIM; k++) {
        self->platform[HEXLOAD_LOAD_IXX + k] = platform->inertia_kg_m2[k];
    }
    read_prior(config, self->theta, sigma);
    for (int k = 0; k < DIM; k++) {
        self->covariance[ROW(k) + k] = sigma[k] * sigma[k];
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
                           hexload_sqrt(self->covariance[0]);
    for (int k = HEXLOAD_LOAD_IXX; k <= HEXLOAD_LOAD_IZZ; k++) {
        body[k] = self->platform[k] + hexload_max(self->theta[k], HEXLOAD_REAL(0.0)) +
                  hexload_sqrt(self->covariance[ROW(k) + k]);
    }
}

/// P_mt and P_mm for mu+ = mu + Gbar theta. With C the mean of P_mt before and after,
/// P_mm grows by Gbar C^T + C Gbar^T.
static void move_covariance(hexload_real_t* P, hexload_real_t G[PULLED][LIFTED]) {
    hexload_real_t mean[6][LIFTED];
    for (int b = 0; b < 6; b++) {
        memcpy(mean[b], &P[ROW(DIM + b)], sizeof mean[b]);
    }
    for (int a = 0; a < PULLED; a++) {
        hexload_real_t* P_mt = &P[ROW(DIM + FIRST_PULLED + a)];
        for (int k = 0; k < LIFTED; k++) {
            for (int j = 0; j < DIM; j++) {
                P_mt[j] += G[a][k] * (j <= k ? P[ROW(k) + j] : P[ROW(j) + k]);
            }
        }
        for (int k = 0; k < LIFTED; k++) {
            mean[FIRST_PULLED + a][k] = HEXLOAD_REAL(0.5) * (mean[FIRST_PULLED + a][k] + P_mt[k]);
        }
    }
    for (int a = 0; a < PULLED; a++) {
        const int row = FIRST_PULLED + a;
        for (int b = 0; b < 6; b++) {
            hexload_real_t sum = HEXLOAD_REAL(0.0);
            for (int k = 0; k < LIFTED; k++) {
                sum += G[a][k] * mean[b][k];
            }
            P[b <= row ? ROW(DIM + row) + DIM + b : ROW(DIM + b) + DIM + row] +=
                b == row ? HEXLOAD_REAL(2.0) * sum : sum;
        }
    }
}

/// mu+ = mu + dt/2 (u + u_last) + Gbar (theta + theta_platform).
static void predict(hexload_momentum_filter_t* self, const hexload_config_t* config,
                    const hexload_sensors_t* sensors, const hexload_motion_t* motion,
                    const hexload_momentum_input_t* input, uint32_t gap_ticks) {
    const hexload_real_t dt_s = config->tick_s * (hexload_real_t)gap_ticks;
    const hexload_real_t impulse_sigma_n_s = dt_s * sensors->force_sigma_n;
    hexload_real_t variance[HEXLOAD_LEGS];
    hexload_real_t columns[HEXLOAD_LEGS][6];
    hexload_real_t body[DIM];
    hexload_real_t G[PULLED][LIFTED];
    momentum_pull(&self->last_input, input, dt_s * config->gravity_m_s2, G);
    add_platform(self, body);
    momentum_move(self->momentum, &self->last_input, input, dt_s, G, body);
    move_covariance(self->covariance, G);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        momentum_of_push(motion, leg, columns[leg]);
        variance[leg] = impulse_sigma_n_s * impulse_sigma_n_s;
    }
    momentum_add_noise(columns, variance, &self->covariance[ROW(DIM)], DIM);
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
static void seed_momentum(hexload_momentum_filter_t* self, const hexload_sensors_t* sensors,
                          const hexload_motion_t* motion, const hexload_leg_blocks_t* jacobian,
                          const residue_t* residue) {
    hexload_real_t* P = self->covariance;
    hexload_real_t body[DIM];
    hexload_real_t Y[DIM][6];
    hexload_real_t variance[HEXLOAD_LEGS];
    hexload_real_t columns[HEXLOAD_LEGS][6];
    add_platform(self, body);
    momentum_of_body(body, motion, residue->smooth_twist, self->momentum);
    for (int k = 0; k < DIM; k++) {
        hexload_real_t unit[DIM] = {0};
        unit[k] = HEXLOAD_REAL(1.0);
        momentum_of_body(unit, motion, residue->smooth_twist, Y[k]);
    }
    for (int a = 0; a < 6; a++) {
        hexload_real_t* P_mt = &P[ROW(DIM + a)];
        for (int j = 0; j < DIM; j++) {
            P_mt[j] = HEXLOAD_REAL(0.0);
            for (int k = 0; k < DIM; k++) {
                P_mt[j] += Y[k][a] * (j <= k ? P[ROW(k) + j] : P[ROW(j) + k]);
            }
        }
        for (int b = 0; b <= a; b++) {
            P_mt[DIM + b] = HEXLOAD_REAL(0.0);
            for (int k = 0; k < DIM; k++) {
                P_mt[DIM + b] += P_mt[k] * Y[k][b];
            }
        }
    }
    make_cautious(self, body);
    const hexload_real_t sigma_m_s = sensors->velocity_sigma_m_s;
    momentum_of_leg_speeds(body, motion, jacobian, columns);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        const hexload_real_t left_m_s = residue->velocity_m_s[leg];
        variance[leg] = sigma_m_s * sigma_m_s + HEXLOAD_REAL(4.0) * left_m_s * left_m_s;
    }
    momentum_add_noise(columns, variance, &P[ROW(DIM)], DIM);
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
            for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
                sum += columns[leg][a] * columns[leg][b];
            }
            R[a][b] = sigma_m_s * sigma_m_s * sum + noise_ticks * spread[a][b];
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
static void project_covariance(const hexload_real_t* P, measurement_t* measured,
                               hexload_real_t HP[6][STATES]) {
    for (int state = 0; state < STATES; state++) {
        hexload_real_t column[STATES];
        for (int j = 0; j < STATES; j++) {
            column[j] = P[j <= state ? ROW(state) + j : ROW(j) + state];
        }
        for (int a = 0; a < 6; a++) {
            HP[a][state] = column[DIM + a] - momentum_times_row(measured->Y[a], column, a < 3);
        }
    }
    for (int a = 0; a < 6; a++) {
        for (int b = 0; b <= a; b++) {
            measured->S[a][b] += HP[a][DIM + b] - momentum_times_row(measured->Y[b], HP[a], b < 3);
        }
    }
}

/// S = L L^T in place, diagonal inverted. S is R and more, so it is positive definite.
static void factor(hexload_real_t S[6][6]) {
    for (int i = 0; i < 6; i++) {
        for (int j = 0; j <= i; j++) {
            hexload_real_t sum = S[i][j];
            for (int k = 0; k < j; k++) {
                sum -= S[i][k] * S[j][k];
            }
            S[i][j] = i == j ? HEXLOAD_REAL(1.0) / hexload_sqrt(sum) : sum * S[j][j];
        }
    }
}

/// Rows of x become those of L^-1 x.
static void whiten(hexload_real_t L[6][6], hexload_real_t HP[6][STATES], hexload_real_t innovation[6]) {
    for (int i = 0; i < 6; i++) {
        for (int k = 0; k < i; k++) {
            for (int state = 0; state < STATES; state++) {
                HP[i][state] -= L[i][k] * HP[k][state];
            }
            innovation[i] -= L[i][k] * innovation[k];
        }
        for (int state = 0; state < STATES; state++) {
            HP[i][state] *= L[i][i];
        }
        innovation[i] *= L[i][i];
    }
}

/// x += (H P)^T S^-1 e, P -= (H P)^T S^-1 H P, both by their whitened halves.
static void correct(hexload_momentum_filter_t* self, measurement_t* measured) {
    hexload_real_t* P = self->covariance;
    hexload_real_t U[6][STATES];
    project_covariance(P, measured, U);
    factor(measured->S);
    whiten(measured->S, U, measured->innovation);
    const hexload_real_t* e = measured->innovation;
    self->nis = e[0] * e[0] + e[1] * e[1] + e[2] * e[2] + e[3] * e[3] + e[4] * e[4] + e[5] * e[5];
    for (int i = 0; i < STATES; i++) {
        const hexload_real_t u[6] = {U[0][i], U[1][i], U[2][i], U[3][i], U[4][i], U[5][i]};
        const hexload_real_t correction =
            u[0] * e[0] + u[1] * e[1] + u[2] * e[2] + u[3] * e[3] + u[4] * e[4] + u[5] * e[5];
        hexload_real_t* row = &P[ROW(i)];
        for (int j = 0; j <= i; j++) {
            row[j] -= u[0] * U[0][j] + u[1] * U[1][j] + u[2] * U[2][j] + u[3] * U[3][j] + u[4] * U[4][j] +
                      u[5] * U[5][j];
        }
        if (i < DIM) {
            self->theta[i] += correction;
        } else {
            self->momentum[i - DIM] += correction;
        }
    }
}

void hexload_momentum_filter_step(hexload_momentum_filter_t* self, const hexload_config_t* config,
                                  const hexload_sensors_t* sensors,
                                  const hexload_smoother_constants_t* smoother,
                                  const hexload_smooth_sample_t* sample, const hexload_motion_t* motion,
                                  const hexload_leg_blocks_t* jacobian) {
    residue_t residue;
    measurement_t measured;
    hexload_momentum_input_t input;
    find_residue(sample, motion, jacobian, &residue);
    momentum_read_input(motion, sample->sample.force_n, &input);
    if (sample->gap_ticks == 0) {
        seed_momentum(self, sensors, motion, jacobian, &residue);
        self->nis = IDEAL_NIS;
    } else {
        predict(self, config, sensors, motion, &input, sample->gap_ticks);
        measure(self, motion, &residue, &measured);
        measurement_noise(self, sensors, motion, jacobian, &residue,
                          correlated_ticks(smoother, sensors, &residue), measured.S);
        correct(self, &measured);
    }
    self->last_input = input;
    memcpy(self->smooth_twist, residue.smooth_twist, sizeof self->smooth_twist);
}

void hexload_momentum_filter_forget(hexload_momentum_filter_t* self, const hexload_config_t* config) {
    hexload_real_t value[DIM];
    hexload_real_t sigma[DIM];
    read_prior(config, value, sigma);
    memset(self->covariance, 0, sizeof self->covariance);
    for (int k = 0; k < DIM; k++) {
        self->covariance[ROW(k) + k] = sigma[k] * sigma[k];
    }
}

bool hexload_momentum_filter_is_finite(const hexload_momentum_filter_t* self) {
    hexload_real_t sum = HEXLOAD_REAL(0.0); // a variance below zero becomes NaN here
    for (int k = 0; k < DIM; k++) {
        sum += self->theta[k] + hexload_sqrt(self->covariance[ROW(k) + k]);
    }
    for (int k = 0; k < 6; k++) {
        sum += self->momentum[k] + hexload_sqrt(self->covariance[ROW(DIM + k) + DIM + k]);
    }
    return isfinite(sum);
}

void hexload_momentum_filter_read(const hexload_momentum_filter_t* self, hexload_real_t value[DIM],
                                  hexload_real_t sigma[DIM]) {
    for (int k = 0; k < DIM; k++) {
        value[k] = self->theta[k];
        sigma[k] = hexload_sqrt(self->covariance[ROW(k) + k]);
    }
}
