#include "hexload/paper_filter.h"

#include "linalg.h"
#include "paper_model.h"

#include <stdbool.h>
#include <string.h>

/// Mean NIS of a consistent filter: the number of measured rates.
#define IDEAL_NIS HEXLOAD_REAL(3.0)

/// Floor of a variance: 1e-7 of the prior sigma, which days of motion do not reach.
#define SMALLEST_VARIANCE_SHARE HEXLOAD_REAL(1e-14)

void hexload_paper_filter_init(hexload_paper_filter_t* self, const hexload_config_t* config) {
    const hexload_paper_config_t* paper = &config->paper;
    const hexload_platform_t* platform = &config->platform;
    const hexload_real_t mass_kg = platform->mass_kg + paper->load_mass_kg;
    const hexload_real_t* c = platform->com_m;
    const hexload_real_t c_square = dot3(c, c);
    *self = (hexload_paper_filter_t){0};
    hexload_paper_constants_t* constants = &self->constants;
    constants->mass_share = paper->load_mass_kg / mass_kg;
    constants->reduced_mass_kg = platform->mass_kg * constants->mass_share;
    for (int k = 0; k < 3; k++) {
        constants->com_offset_m[k] = platform->mass_kg * c[k] / mass_kg;
        // Parallel axes: from O_A to the platform's own centre of mass, and from there to the common one as
        // far as x and y go; z follows with the estimate of dz.
        const hexload_real_t in_plane = c_square - c[2] * c[2] - (k < 2 ? c[k] * c[k] : HEXLOAD_REAL(0.0));
        constants->inertia_kg_m2[k] = platform->inertia_kg_m2[k] -
                                      platform->mass_kg * (c_square - c[k] * c[k]) +
                                      constants->reduced_mass_kg * in_plane;
    }
    const hexload_real_t prior[HEXLOAD_PAPER_DIM] = {
        paper->prior_dz_sigma_m, paper->prior_inertia_sigma_kg_m2[0], paper->prior_inertia_sigma_kg_m2[1],
        paper->prior_inertia_sigma_kg_m2[2]};
    for (int k = 0; k < HEXLOAD_PAPER_DIM; k++) {
        self->param_cov[k][k] = prior[k] * prior[k];
        constants->prior_variance[k] = self->param_cov[k][k];
    }
}

/// Product of row i of N with row j of a matrix of three rows and a column for each parameter.
static hexload_real_t times_row(const hexload_paper_model_t* model, int i,
                                const hexload_real_t row[HEXLOAD_PAPER_DIM]) {
    return model->by_dz[i] * row[HEXLOAD_PAPER_DZ] + model->by_inertia[i] * row[HEXLOAD_PAPER_IXX + i];
}

static void add_jacobian_noise(hexload_jacobian_noise_t* sum, const hexload_jacobian_noise_t* part) {
    for (int i = 0; i < 3; i++) {
        sum->inertia[i] += part->inertia[i];
    }
    for (int i = 0; i < 2; i++) {
        sum->dz[i] += part->dz[i];
        sum->mixed[i] += part->mixed[i];
    }
}

/// (32): x = f(x), P = J P J^T + Q with J = [E, N; 0, E] and five non-zero entries in N.
static void predict(hexload_paper_filter_t* self, const hexload_paper_model_t* model) {
    for (int i = 0; i < 3; i++) {
        self->rate_rad_s[i] += model->rate_step_rad_s[i];
        for (int j = 0; j <= i; j++) {
            self->rate_cov[i][j] +=
                model->noise[i][j] + times_row(model, i, self->cross_cov[j]); // Q + N P_tw
        }
    }
    add_jacobian_noise(&self->jacobian_noise, &model->jacobian_noise);
    for (int i = 0; i < 3; i++) {
        const hexload_real_t cautious_D = model->cautious_inertia_kg_m2[i];
        self->noise_lever_kg_m2[i] = cautious_D * cautious_D / model->inertia_kg_m2[i];
    }
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < HEXLOAD_PAPER_DIM; k++) {
            self->cross_cov[i][k] += times_row(model, i, self->param_cov[k]); // P_wt += N P_tt
        }
        for (int j = 0; j <= i; j++) {
            self->rate_cov[i][j] += times_row(model, j, self->cross_cov[i]); // + P_wt(new) N^T
            self->rate_cov[j][i] = self->rate_cov[i][j];
        }
    }
}

/// Omega (29), platform axes, from the leg velocities, and its noise.
static void measure_rate(const hexload_config_t* config, const hexload_motion_t* motion,
                         hexload_real_t rate_rad_s[3], hexload_real_t noise[3][3]) {
    const hexload_real_t variance = config->sensors.velocity_sigma_m_s * config->sensors.velocity_sigma_m_s;
    hexload_motion_to_platform(motion, &motion->twist[3], rate_rad_s);
    memset(noise, 0, 3 * sizeof noise[0]);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        const hexload_real_t base_axes[3] = {motion->rate_gain[0][leg], motion->rate_gain[1][leg],
                                             motion->rate_gain[2][leg]};
        hexload_real_t gain[3];
        hexload_motion_to_platform(motion, base_axes, gain);
        for (int i = 0; i < 3; i++) {
            for (int j = 0; j <= i; j++) {
                noise[i][j] += gain[i] * gain[j];
            }
        }
    }
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j <= i; j++) {
            noise[i][j] *= variance;
            noise[j][i] = noise[i][j];
        }
    }
}

/// Value held within -most..most; sets the health bit when that changes it.
static hexload_real_t bound_noise(hexload_real_t value, hexload_real_t most, uint32_t* health) {
    if (value <= most && value >= -most) {
        return value;
    }
    hexload_health_set(health, HEXLOAD_HEALTH_NOISE_BOUNDED);
    return hexload_min(hexload_max(value, -most), most);
}

/// Takes out what force noise alone has done in this update. It stands in the Jacobian as it does in the
/// innovation: its variance there looks like motion and shrinks P, its product with itself moves the inertias
/// (D15). A spike counts as noise of its size; it can at most double a variance
/// and move dz by one sigma.
static void remove_noise_effects(hexload_paper_filter_t* self, hexload_real_t S[3][3],
                                 const hexload_real_t prior_variance[3], uint32_t* health) {
    const hexload_real_t one = HEXLOAD_REAL(1.0);
    hexload_jacobian_noise_t* noise = &self->jacobian_noise;
    hexload_real_t* dz_variance = &self->param_cov[HEXLOAD_PAPER_DZ][HEXLOAD_PAPER_DZ];
    for (int i = 0; i < 3; i++) {
        const int own = HEXLOAD_PAPER_IXX + i;
        hexload_real_t* variance = &self->param_cov[own][own];
        const hexload_real_t kept = self->rate_cov[i][i] / prior_variance[i]; // 1 - K
        const hexload_real_t false_share = bound_noise(*variance * noise->inertia[i] / S[i][i], one, health);
        self->param[own] -= self->noise_lever_kg_m2[i] * false_share;
        *variance += *variance * false_share;
        noise->inertia[i] *= kept * kept;
        if (i < 2) {
            const hexload_real_t dz_move =
                *dz_variance * self->noise_lever_kg_m2[i] * noise->mixed[i] / S[i][i];
            self->param[HEXLOAD_PAPER_DZ] -= bound_noise(dz_move, hexload_sqrt(*dz_variance), health);
            *dz_variance += *dz_variance * bound_noise(*dz_variance * noise->dz[i] / S[i][i], one, health);
            noise->dz[i] *= kept * kept;
            noise->mixed[i] *= kept * kept;
        }
    }
}

/// P -= U^T U with U = S^-1/2 H P, and x += U^T S^-1/2 y (36): symmetric by construction.
static void correct(hexload_paper_filter_t* self, hexload_real_t L[3][3], const hexload_real_t whitened[3]) {
    hexload_real_t U[3][3 + HEXLOAD_PAPER_DIM]; // column k belongs to state k
    for (int k = 0; k < 3 + HEXLOAD_PAPER_DIM; k++) {
        hexload_real_t column[3];
        hexload_real_t solved[3];
        for (int i = 0; i < 3; i++) {
            column[i] = k < 3 ? self->rate_cov[i][k] : self->cross_cov[i][k - 3];
        }
        forward_substitute3(L, column, solved);
        for (int i = 0; i < 3; i++) {
            U[i][k] = solved[i];
        }
    }
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j <= i; j++) {
            self->rate_cov[i][j] -= U[0][i] * U[0][j] + U[1][i] * U[1][j] + U[2][i] * U[2][j];
            self->rate_cov[j][i] = self->rate_cov[i][j];
        }
        for (int k = 0; k < HEXLOAD_PAPER_DIM; k++) {
            self->cross_cov[i][k] -= U[0][i] * U[0][3 + k] + U[1][i] * U[1][3 + k] + U[2][i] * U[2][3 + k];
        }
        self->rate_rad_s[i] += U[0][i] * whitened[0] + U[1][i] * whitened[1] + U[2][i] * whitened[2];
    }
    for (int i = 0; i < HEXLOAD_PAPER_DIM; i++) {
        const int s = 3 + i;
        for (int j = 0; j <= i; j++) {
            self->param_cov[i][j] -= U[0][s] * U[0][3 + j] + U[1][s] * U[1][3 + j] + U[2][s] * U[2][3 + j];
            self->param_cov[j][i] = self->param_cov[i][j];
        }
        self->param[i] += U[0][s] * whitened[0] + U[1][s] * whitened[1] + U[2][s] * whitened[2];
    }
}

/// Keeps each parameter's variance between its floor and its prior.
static void bound_covariance(hexload_paper_filter_t* self, uint32_t* health) {
    for (int k = 0; k < HEXLOAD_PAPER_DIM; k++) {
        const hexload_real_t most = self->constants.prior_variance[k];
        const hexload_real_t least = SMALLEST_VARIANCE_SHARE * most;
        hexload_real_t* variance = &self->param_cov[k][k];
        if (*variance > most) {
            const hexload_real_t scale = hexload_sqrt(most / *variance);
            for (int j = 0; j < HEXLOAD_PAPER_DIM; j++) {
                self->param_cov[k][j] *= scale;
                self->param_cov[j][k] = self->param_cov[k][j];
            }
            for (int i = 0; i < 3; i++) {
                self->cross_cov[i][k] *= scale;
            }
            *variance = most;
            hexload_health_set(health, HEXLOAD_HEALTH_COVARIANCE_BOUNDED);
        } else if (*variance < least) {
            *variance = least;
            hexload_health_set(health, HEXLOAD_HEALTH_COVARIANCE_BOUNDED);
        }
    }
}

/// No load has a negative inertia.
static void bound_inertia(hexload_paper_filter_t* self, uint32_t* health) {
    for (int k = HEXLOAD_PAPER_IXX; k < HEXLOAD_PAPER_DIM; k++) {
        if (self->param[k] < HEXLOAD_REAL(0.0)) {
            self->param[k] = HEXLOAD_REAL(0.0);
            hexload_health_set(health, HEXLOAD_HEALTH_INERTIA_BOUNDED);
        }
    }
}

/// Takes the rates from the sensors and keeps the parameters: at the start, after a gap too long to integrate
/// over, and when the predicted rate no longer fits.
static void seed_rate(hexload_paper_filter_t* self, const hexload_real_t rate_rad_s[3],
                      hexload_real_t noise[3][3]) {
    memcpy(self->rate_rad_s, rate_rad_s, sizeof self->rate_rad_s);
    memcpy(self->rate_cov, noise, sizeof self->rate_cov);
    memset(self->cross_cov, 0, sizeof self->cross_cov);
    self->jacobian_noise = (hexload_jacobian_noise_t){0};
    self->gated = 0;
    self->nis = IDEAL_NIS; // no innovation: a mean of NIS stands still
}

/// (29)-(31), (36).
static void update(hexload_paper_filter_t* self, const hexload_config_t* config,
                   const hexload_real_t rate_rad_s[3], hexload_real_t noise[3][3], uint32_t* health) {
    hexload_real_t S[3][3];
    hexload_real_t L[3][3];
    hexload_real_t innovation[3];
    hexload_real_t whitened[3];
    for (int i = 0; i < 3; i++) {
        innovation[i] = rate_rad_s[i] - self->rate_rad_s[i];
        for (int j = 0; j < 3; j++) {
            S[i][j] = self->rate_cov[i][j] + noise[i][j];
        }
    }
    if (!cholesky3(S, L)) { // rounding has cost P its definiteness
        seed_rate(self, rate_rad_s, noise);
        hexload_health_set(health, HEXLOAD_HEALTH_RATE_RESEEDED);
        return;
    }
    forward_substitute3(L, innovation, whitened);
    self->nis = dot3(whitened, whitened);
    if (!(self->nis <= config->paper.gate_nis)) { // also NaN
        hexload_health_set(health, HEXLOAD_HEALTH_MEASUREMENT_GATED);
        self->gated++;
        if (self->gated > config->paper.longest_gate_ticks) {
            seed_rate(self, rate_rad_s, noise);
            hexload_health_set(health, HEXLOAD_HEALTH_RATE_RESEEDED);
        }
        return;
    }
    const hexload_real_t prior_variance[3] = {self->rate_cov[0][0], self->rate_cov[1][1],
                                              self->rate_cov[2][2]};
    self->gated = 0;
    correct(self, L, whitened);
    remove_noise_effects(self, S, prior_variance, health);
    bound_covariance(self, health);
    bound_inertia(self, health);
}

/// One NaN or infinity in P or in the state reaches each of these sums.
static bool is_finite(const hexload_paper_filter_t* self) {
    hexload_real_t sum = HEXLOAD_REAL(0.0);
    for (int k = 0; k < HEXLOAD_PAPER_DIM; k++) {
        sum += self->param[k] + self->param_cov[k][k];
    }
    for (int k = 0; k < 3; k++) {
        sum += self->rate_rad_s[k] + self->rate_cov[k][k] + self->jacobian_noise.inertia[k];
    }
    return isfinite(sum);
}

static void remember(hexload_paper_filter_t* self, const hexload_leg_sample_t* sample,
                     const hexload_wrench_t* wrench) {
    self->last_wrench = *wrench;
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        for (int age = HEXLOAD_FORCE_HISTORY - 1; age > 0; age--) {
            self->last_force_n[age][leg] = self->last_force_n[age - 1][leg];
        }
        self->last_force_n[0][leg] = sample->force_n[leg];
    }
    if (self->history < HEXLOAD_FORCE_HISTORY) {
        self->history++;
    }
}

void hexload_paper_filter_step(hexload_paper_filter_t* self, const hexload_config_t* config,
                               const hexload_leg_sample_t* sample, const hexload_motion_t* motion,
                               const hexload_wrench_t* wrench, uint32_t gap_ticks, uint32_t* health) {
    hexload_real_t rate_rad_s[3];
    hexload_real_t noise[3][3];
    measure_rate(config, motion, rate_rad_s, noise);
    if (gap_ticks != 1) {
        self->history = 0; // differences over a gap are motion
    }
    if (gap_ticks == 0) {
        seed_rate(self, rate_rad_s, noise);
    } else if (gap_ticks > config->paper.longest_gap_ticks) {
        seed_rate(self, rate_rad_s, noise);
        hexload_health_set(health, HEXLOAD_HEALTH_RATE_RESEEDED);
    } else {
        hexload_paper_model_t model;
        hexload_paper_model_linearise(self, config, sample, motion, wrench,
                                      config->tick_s * (hexload_real_t)gap_ticks, &model);
        predict(self, &model);
        update(self, config, rate_rad_s, noise, health);
    }
    if (!is_finite(self)) {
        hexload_paper_filter_init(self, config);
        seed_rate(self, rate_rad_s, noise);
        hexload_health_set(health, HEXLOAD_HEALTH_FILTER_RESTARTED);
    }
    remember(self, sample, wrench);
}

void hexload_paper_filter_read(const hexload_paper_filter_t* self, hexload_real_t value[HEXLOAD_PAPER_DIM],
                               hexload_real_t sigma[HEXLOAD_PAPER_DIM]) {
    for (int k = 0; k < HEXLOAD_PAPER_DIM; k++) {
        value[k] = self->param[k];
        sigma[k] = hexload_sqrt(self->param_cov[k][k]);
    }
}
