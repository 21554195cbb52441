#include "momentum/momentum_filter.h"

#include "algebra/chi_square.h"
#include "algebra/leg_blocks.h"
#include "algebra/linalg.h"
#include "momentum/momentum_model.h"
#include "configuration/momentum_prior.h"
#include "rig/rig.h"

#include <string.h>

enum { DIM = HEXLOAD_LOAD_DIM };

/// For how long the square of an angular velocity is averaged, how many times the square of its noise that
/// must be, and how many times more one of them, to count at once.
#define RATE_S HEXLOAD_REAL(1.0)
#define RATE_NOISE HEXLOAD_REAL(4.0)
#define RATE_AT_ONCE HEXLOAD_REAL(3.0)

/// Share of all mass that, moving as the legs do, is as much as a sigma of an inertia counts for at most.
#define MOST_CAUTION HEXLOAD_REAL(0.5)

/// 34 roundings in single precision.
#define ROUNDING HEXLOAD_REAL(4e-6)

HEXLOAD_RARE void hexload_momentum_prior_sigma(const hexload_momentum_config_t* momentum,
                                               hexload_real_t sigma[HEXLOAD_LOAD_DIM]) {
    for (int k = 0; k < HEXLOAD_LOAD_DIM; k++) {
        sigma[k] =
            k < HEXLOAD_LOAD_IXX ? momentum->prior_moment_sigma_kg_m : momentum->prior_inertia_sigma_kg_m2;
    }
    sigma[HEXLOAD_LOAD_M] = momentum->prior_mass_sigma_kg;
}

HEXLOAD_RARE void hexload_momentum_filter_forget(hexload_momentum_filter_t* self,
                                                 const hexload_config_t* config) {
    hexload_real_t sigma[DIM];
    hexload_momentum_prior_sigma(&config->momentum, sigma);
    sigma[HEXLOAD_LOAD_M] = hexload_max(sigma[HEXLOAD_LOAD_M], hexload_momentum_open_mass_sigma_kg(config));
    (void)memset(&self->attenuation, 0, sizeof self->attenuation);
    memset(self->load_cov, 0, sizeof self->load_cov);
    for (int k = 0; k < DIM; k++) {
        self->load_cov[k][k] = sigma[k] * sigma[k];
    }
}

HEXLOAD_RARE void hexload_momentum_filter_init(hexload_momentum_filter_t* self,
                                               const hexload_config_t* config) {
    const hexload_platform_t* platform = &config->platform;
    *self = (hexload_momentum_filter_t){.nis = CHI_SQUARE_6_MEAN};
    self->tolerances = config->tolerances;
    self->platform[HEXLOAD_LOAD_M] = platform->mass_kg;
    for (int k = 0; k < 3; k++) {
        self->platform[HEXLOAD_LOAD_HX + k] = platform->mass_kg * platform->com_m[k];
    }
    for (int k = 0; k < HEXLOAD_I_DIM; k++) {
        self->platform[HEXLOAD_LOAD_IXX + k] = platform->inertia_kg_m2[k];
    }
    self->theta[HEXLOAD_LOAD_M] = config->momentum.prior_mass_kg;
    hexload_momentum_filter_forget(self, config);
    const hexload_real_t sigma_kg = config->momentum.prior_mass_sigma_kg; // of one that may be known
    self->load_cov[HEXLOAD_LOAD_M][HEXLOAD_LOAD_M] = sigma_kg * sigma_kg;
}

void hexload_momentum_filter_body(const hexload_momentum_filter_t* self, hexload_real_t body[DIM]) {
    for (int k = 0; k < DIM; k++) {
        body[k] = self->platform[k] + self->theta[k];
    }
}

/// The body of the gains: held within what a body can have, and one sigma heavier than it seems about every
/// axis, so that an early gain does not claim information that its wrong linearisation point does not have.
/// Sigmas that say that nothing is known do not count in full: they would throw away the start of a motion.
/// @param[in,out] body platform and load, and then what gains take for it.
static void make_cautious(const hexload_momentum_filter_t* self,
                          const hexload_smoother_constants_t* constants, hexload_real_t body[DIM]) {
    const hexload_real_t* gain = constants->rate_gain;
    body[HEXLOAD_LOAD_M] = hexload_max(body[HEXLOAD_LOAD_M], self->platform[HEXLOAD_LOAD_M]) +
                           hexload_sqrt(self->load_cov[HEXLOAD_LOAD_M][HEXLOAD_LOAD_M]);
    const hexload_real_t most = MOST_CAUTION * body[HEXLOAD_LOAD_M] / (gain[0] + gain[1] + gain[2]);
    for (int k = HEXLOAD_LOAD_IXX; k <= HEXLOAD_LOAD_IZZ; k++) {
        const int product = k + 3;
        body[k] = hexload_max(body[k], self->platform[k]) +
                  hexload_min(hexload_sqrt(self->load_cov[k][k]), most);
        const hexload_real_t sigma = hexload_min(hexload_sqrt(self->load_cov[product][product]), most);
        body[product] -= hexload_max(hexload_min(body[product], sigma), -sigma);
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
                    const hexload_delayed_tick_t* past, const hexload_momentum_input_t* input,
                    const hexload_real_t body[DIM]) {
    const hexload_real_t dt_s = config->tick_s * (hexload_real_t)past->smooth.gap_ticks;
    const hexload_real_t impulse_sigma_n_s = dt_s * past->sensors->force_sigma_n;
    hexload_real_t variance[HEXLOAD_LEGS];
    hexload_real_t columns[HEXLOAD_LEGS][6];
    hexload_real_t G[PULLED][LIFTED];
    hexload_momentum_pull(&self->last_input, input, dt_s * config->gravity_m_s2, G);
    hexload_momentum_move(self->momentum, &self->last_input, input, dt_s, G, body);
    move_covariance(self, G);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        hexload_momentum_of_push(&past->motion, leg, columns[leg]);
        variance[leg] =
            impulse_sigma_n_s * impulse_sigma_n_s + dt_s * dt_s * past->smooth.force_variance_n2[leg];
    }
    hexload_momentum_add_noise(columns, variance, self->momentum_cov);
}

/// What the smoother leaves of the measured speeds.
typedef struct residual {
    hexload_real_t twist[6];                   ///< measured minus smooth
    hexload_real_t velocity_m_s[HEXLOAD_LEGS]; ///< likewise
    hexload_real_t left_out_m2_s2;             ///< of rotation, that may be a motion as well as noise
} residual_t;

/// Leaves out what of the smooth angular velocity is no more than its noise, by the platform's axes: a
/// platform that does not turn tells nothing of inertias, and that noise would in time count as if it did.
/// Directions of legs (motion_directions.h) do not show it, as they turn with the pose.
/// @return mean square over the axes of what is left out, as speeds of legs.
static hexload_real_t leave_out_noise(hexload_momentum_filter_t* self, const hexload_config_t* config,
                                      const hexload_delayed_tick_t* past, hexload_real_t rate_rad_s[3]) {
    const hexload_motion_t* motion = &past->motion;
    const hexload_smoother_constants_t* constants = past->smoother;
    const hexload_real_t sigma_m = past->sensors->displacement_sigma_m;
    const hexload_real_t variance = RATE_NOISE * sigma_m * sigma_m * constants->slope_gain;
    const hexload_real_t share = config->tick_s / RATE_S;
    hexload_real_t square_m2_s2 = HEXLOAD_REAL(0.0);
    hexload_real_t rate[3];
    hexload_real_t out[3];
    hexload_to_platform(motion, rate_rad_s, rate);
    for (int k = 0; k < 3; k++) {
        const hexload_real_t square = self->rate_square[k];
        self->rate_square[k] = hexload_fma(share, (rate[k] * rate[k]) - square, square);
        const hexload_real_t known = hexload_max(self->rate_square[k], rate[k] * rate[k] / RATE_AT_ONCE);
        out[k] = hexload_min(variance * constants->rate_gain[k] / known, HEXLOAD_REAL(1.0)) * rate[k];
        square_m2_s2 += out[k] * out[k] / (HEXLOAD_REAL(3.0) * constants->rate_gain[k]);
    }
    for (int k = 0; k < 3; k++) { // what remains is not turned there and back
        rate_rad_s[k] -= hexload_dot3(motion->R[k], out);
    }
    return square_m2_s2;
}

/// Finds the smooth twist, too.
static void find_residual(hexload_momentum_filter_t* self, const hexload_config_t* config,
                          const hexload_delayed_tick_t* past, residual_t* residual) {
    const hexload_smooth_sample_t* smooth = &past->smooth;
    hexload_leg_blocks_solve(past->motion.jacobian, smooth->smooth_velocity_m_s, self->smooth_twist);
    residual->left_out_m2_s2 = leave_out_noise(self, config, past, &self->smooth_twist[3]);
    for (int k = 0; k < 6; k++) {
        residual->twist[k] = past->motion.twist[k] - self->smooth_twist[k];
        residual->velocity_m_s[k] = smooth->sample.velocity_m_s[k] - smooth->smooth_velocity_m_s[k];
    }
}

/// mu from the smooth twist: P_mt = Y P_tt, P_mm = Y P_tt Y^T + the noise of the twist.
HEXLOAD_RARE static void seed_momentum(hexload_momentum_filter_t* self, const hexload_delayed_tick_t* past,
                                       const residual_t* residual, hexload_real_t body[DIM]) {
    const hexload_motion_t* motion = &past->motion;
    hexload_real_t Y[6][DIM];
    hexload_real_t variance[HEXLOAD_LEGS];
    hexload_real_t columns[HEXLOAD_LEGS][6];
    hexload_momentum_of_body(body, motion, self->smooth_twist, self->momentum);
    hexload_momentum_regressor(motion, self->smooth_twist, Y);
    for (int j = 0; j < DIM; j += 2) {
        hexload_real_t product[2][6];
        hexload_momentum_rows(Y, self->load_cov[j], self->load_cov[j + 1], 0, 6, product);
        for (int a = 0; a < 6; a++) {
            self->cross_cov[a][j] = product[0][a];
            self->cross_cov[a][j + 1] = product[1][a];
        }
    }
    for (int a = 0; a < 6; a += 2) {
        hexload_momentum_rows(Y, self->cross_cov[a], self->cross_cov[a + 1], 0, a + 2,
                              &self->momentum_cov[a]);
    }
    make_cautious(self, past->smoother, body);
    const hexload_real_t sigma_m_s = past->sensors->velocity_sigma_m_s;
    hexload_momentum_of_leg_speeds(body, motion, columns);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        const hexload_real_t left_m_s = residual->velocity_m_s[leg];
        variance[leg] = sigma_m_s * sigma_m_s + HEXLOAD_REAL(4.0) * left_m_s * left_m_s;
    }
    hexload_momentum_add_noise(columns, variance, self->momentum_cov);
}

/// How many ticks a residual beyond the noise stays the same: what polynomials through the ticks around leave
/// of a shock is smeared over as many as lie on one side; what is left out of a rotation may last.
static hexload_real_t correlated_ticks(const hexload_config_t* config, const hexload_delayed_tick_t* past,
                                       const residual_t* residual) {
    const hexload_real_t variance = past->sensors->velocity_sigma_m_s * past->sensors->velocity_sigma_m_s;
    const hexload_real_t q = dot6(residual->velocity_m_s, residual->velocity_m_s) / variance;
    const hexload_real_t of_shock = (hexload_real_t)HEXLOAD_TRANSIENT_TICKS * hexload_beyond_noise(q);
    const hexload_real_t of_rotation = (RATE_S / config->tick_s) * (residual->left_out_m2_s2 / variance);
    return HEXLOAD_REAL(1.0) + of_shock + of_rotation;
}

/// Noise of e: that of the leg speeds by the cautious body, the parameters' errors on the part of the twist
/// that the smoother leaves out, and what rounding leaves in H P H^T, which where mu has just begun is the
/// small difference of terms as large as P_mm.
static void measurement_noise(const hexload_momentum_filter_t* self, const hexload_config_t* config,
                              const hexload_delayed_tick_t* past, const residual_t* residual,
                              hexload_real_t body[DIM], hexload_real_t R[6][6]) {
    const hexload_real_t sigma_m_s = past->sensors->velocity_sigma_m_s;
    const hexload_real_t noise_ticks = correlated_ticks(config, past, residual);
    // Speeds from displacements are noisier than white where they are faster than the smoother.
    const hexload_real_t speed_ticks = past->sensors->half_window_ticks > 0 ? noise_ticks : HEXLOAD_REAL(1.0);
    const hexload_real_t variance = speed_ticks * sigma_m_s * sigma_m_s;
    hexload_real_t columns[HEXLOAD_LEGS][6];
    hexload_real_t Y[6][DIM];
    make_cautious(self, past->smoother, body);
    hexload_momentum_of_leg_speeds(body, &past->motion, columns);
    hexload_momentum_regressor(&past->motion, residual->twist, Y);
    hexload_momentum_spread(self, Y, R);
    for (int a = 0; a < 6; a++) {
        for (int b = 0; b <= a; b++) {
            hexload_real_t sum = HEXLOAD_REAL(0.0);
            HEXLOAD_UNROLL
            for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
                sum = hexload_fma(columns[leg][a], columns[leg][b], sum);
            }
            R[a][b] = hexload_fma(variance, sum, noise_ticks * R[a][b]);
        }
        R[a][a] = hexload_fma(ROUNDING, self->momentum_cov[a][a], R[a][a]);
    }
}

/// The six leg speeds as a measurement of momentum: e = Y(V) (theta + theta_platform) - mu, H = [Y, -E] with
/// the smooth twist, so that H's noise is not the innovation's.
static void measure(const hexload_momentum_filter_t* self, const hexload_motion_t* motion,
                    const hexload_real_t body[DIM], hexload_momentum_update_t* measured) {
    hexload_momentum_regressor(motion, self->smooth_twist, measured->Y);
    hexload_momentum_of_body(body, motion, motion->twist, measured->innovation);
    for (int k = 0; k < 6; k++) {
        measured->innovation[k] -= self->momentum[k];
    }
}

/// U = -H P = [E, -Y] P, and L, which is R, becomes S = H P H^T + R; lower triangle.
static void project_covariance(const hexload_momentum_filter_t* self, hexload_momentum_update_t* measured) {
    hexload_momentum_projection_t* U = &measured->U;
    hexload_real_t product[2][6];
    for (int j = 0; j < DIM; j += 2) {
        hexload_momentum_rows(measured->Y, self->load_cov[j], self->load_cov[j + 1], 0, 6, product);
        HEXLOAD_UNROLL
        for (int a = 0; a < 6; a++) {
            U->load[a][j] = self->cross_cov[a][j] - product[0][a];
            U->load[a][j + 1] = self->cross_cov[a][j + 1] - product[1][a];
        }
    }
    for (int b = 0; b < 6; b += 2) {
        hexload_momentum_rows(measured->Y, self->cross_cov[b], self->cross_cov[b + 1], 0, 6, product);
        for (int a = 0; a < 6; a++) {
            const bool is_lower = a > b; // and for b + 1 then too, or on the diagonal
            const hexload_real_t first = is_lower ? self->momentum_cov[a][b] : self->momentum_cov[b][a];
            const hexload_real_t second =
                is_lower ? self->momentum_cov[a][b + 1] : self->momentum_cov[b + 1][a];
            U->momentum[a][b] = first - product[0][a];
            U->momentum[a][b + 1] = second - product[1][a];
        }
    }
    for (int a = 0; a < 6; a += 2) {
        hexload_momentum_rows(measured->Y, U->load[a], U->load[a + 1], 0, a + 2, product);
        for (int b = 0; b < a + 2; b++) { // lower triangle, and one beside it
            measured->L[a][b] += U->momentum[a][b] - product[0][b];
            measured->L[a + 1][b] += U->momentum[a + 1][b] - product[1][b];
        }
    }
}

/// In single precision an update errs by some roundings of each variance. Where a sum is soon known a
/// thousand times better than its parts that would leave no covariance, so as much is added before.
static void inflate_covariance(hexload_momentum_filter_t* self) {
    for (int k = 0; k < DIM; k++) {
        self->load_cov[k][k] *= HEXLOAD_COVARIANCE_INFLATION;
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
static void correct(hexload_momentum_filter_t* self, hexload_momentum_update_t* measured) {
    hexload_momentum_projection_t* U = &measured->U;
    hexload_real_t u[2][6];
    const hexload_real_t* e = measured->innovation;
    inflate_covariance(self);
    project_covariance(self, measured);
    hexload_cholesky6(measured->L);
    hexload_whiten6(measured->L, &U->load[0][0], DIM);
    hexload_whiten6(measured->L, &U->momentum[0][0], 6);
    hexload_whiten6(measured->L, measured->innovation, 1);
    self->nis = dot6(e, e);
    for (int i = 0; i < DIM; i += 2) {
        hexload_read_columns6(&U->load[0][0], DIM, i, u);
        correct_theta(self, i, dot6(u[0], e));
        correct_theta(self, i + 1, dot6(u[1], e));
        downdate6_twice(self->load_cov[i], u, &U->load[0][0], DIM,
                        i + 2); // lower triangle, and one beside it
    }
    for (int i = 0; i < DIM; i++) {
        for (int j = 0; j < i; j++) {
            self->load_cov[j][i] = self->load_cov[i][j];
        }
    }
    for (int i = 0; i < 6; i += 2) {
        hexload_read_columns6(&U->momentum[0][0], 6, i, u);
        self->momentum[i] += dot6(u[0], e);
        self->momentum[i + 1] += dot6(u[1], e);
        downdate6_twice(self->cross_cov[i], u, &U->load[0][0], DIM, DIM);
        downdate6_twice(self->momentum_cov[i], u, &U->momentum[0][0], 6, i + 2);
    }
}

void hexload_momentum_filter_step(hexload_momentum_filter_t* self, const hexload_config_t* config,
                                  const hexload_delayed_tick_t* past, hexload_momentum_update_t* update) {
    residual_t residual;
    hexload_momentum_input_t input;
    hexload_real_t body[DIM];
    find_residual(self, config, past, &residual);
    hexload_momentum_read_input(&past->motion, past->smooth.sample.force_n, &input);
    if (hexload_rig_has_leg_mass(config)) {
        hexload_momentum_take_off(&past->motion, past->smooth.leg_wrench, &input);
    }
    hexload_momentum_filter_body(self, body);
    if (past->smooth.gap_ticks == 0) {
        seed_momentum(self, past, &residual, body);
        self->nis = CHI_SQUARE_6_MEAN;
    } else {
        predict(self, config, past, &input, body);
        measure(self, &past->motion, body, update);
        measurement_noise(self, config, past, &residual, body, update->L); // after it `body` is cautious
        correct(self, update);
    }
    self->last_input = input;
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
