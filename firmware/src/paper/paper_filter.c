#include "paper/paper_filter.h"

#include "algebra/linalg.h"
#include "configuration/health.h"
#include "paper/paper_model.h"
#include "paper/rate_noise.h"

#include <stdbool.h>
#include <stddef.h>
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
    constants->tolerances = config->tolerances;
    constants->mass_share = paper->load_mass_kg / mass_kg;
    constants->reduced_mass_kg = platform->mass_kg * constants->mass_share;
    for (int k = 0; k < 3; k++) {
        constants->com_offset_m[k] = platform->mass_kg * c[k] / mass_kg;
        // Parallel axes: from O_A to the platform's own centre of mass, and from there to the common one as
        // far as x and y go; z follows with the estimate of dz.
        const hexload_real_t in_plane = c_square - c[2] * c[2] - (k < 2 ? c[k] * c[k] : HEXLOAD_REAL(0.0));
        constants->platform_inertia_kg_m2[k] = platform->inertia_kg_m2[k];
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

/// Row i of N times two entries of a vector of the parameters, the only ones that count, added to sum.
static inline hexload_real_t add_row(const hexload_paper_model_t* model, int i, hexload_real_t dz,
                                     hexload_real_t own_inertia, hexload_real_t sum) {
    const hexload_real_t by_inertia = hexload_fma(model->by_inertia[i], own_inertia, sum);
    return i < 2 ? hexload_fma(model->by_dz[i], dz, by_inertia) : by_inertia;
}

/// Entry of a symmetric matrix whose lower triangle is stored.
static inline hexload_real_t param_cov(const hexload_paper_filter_t* self, int i, int j) {
    return i >= j ? self->param_cov[i][j] : self->param_cov[j][i];
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
    HEXLOAD_UNROLL
    for (int i = 0; i < 3; i++) {
        self->rate_rad_s[i] += model->rate_step_rad_s[i];
        HEXLOAD_UNROLL
        for (int j = 0; j <= i; j++) { // Q + N P_tw
            const hexload_real_t* row = self->cross_cov[j];
            self->rate_cov[i][j] = add_row(model, i, row[HEXLOAD_PAPER_DZ], row[HEXLOAD_PAPER_IXX + i],
                                           self->rate_cov[i][j] + model->noise[i][j]);
        }
    }
    HEXLOAD_UNROLL
    for (int i = 0; i < 3; i++) {
        hexload_real_t* row = self->cross_cov[i];
        HEXLOAD_UNROLL
        for (int k = 0; k < HEXLOAD_PAPER_DIM; k++) { // P_wt += N P_tt
            row[k] = add_row(model, i, param_cov(self, k, HEXLOAD_PAPER_DZ),
                             param_cov(self, k, HEXLOAD_PAPER_IXX + i), row[k]);
        }
        HEXLOAD_UNROLL
        for (int j = 0; j <= i; j++) { // + P_wt(new) N^T
            self->rate_cov[i][j] =
                add_row(model, j, row[HEXLOAD_PAPER_DZ], row[HEXLOAD_PAPER_IXX + j], self->rate_cov[i][j]);
        }
    }
}

/// Omega (29), platform axes, from the leg velocities, and its noise.
static void measure_rate(const hexload_present_tick_t* now, hexload_paper_step_t* measured) {
    const hexload_motion_t* motion = now->motion;
    const hexload_real_t sigma_m_s = now->sensors.velocity_sigma_m_s;
    hexload_real_t to_platform[3][3]; // for legs with errors of sigma_m_s
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++) {
            to_platform[i][k] = sigma_m_s * motion->R[k][i];
        }
    }
    hexload_motion_to_platform(motion, &motion->twist[3], measured->rate_rad_s);
    hexload_rate_noise(motion->jacobian, to_platform, measured->noise);
}

/// Value held within -most..most; sets the health bit when that changes it.
static inline hexload_real_t bound_noise(hexload_real_t value, hexload_real_t most, uint32_t* health) {
    if (hexload_abs(value) <= most) {
        return value;
    }
    hexload_health_set(health, HEXLOAD_HEALTH_NOISE_BOUNDED);
    return hexload_min(hexload_max(value, -most), most);
}

/// A step in the same direction at each tick, often smaller than what single precision tells from dz: what
/// rounding leaves of it waits for the next one.
static void add_to_dz(hexload_paper_filter_t* self, hexload_real_t step_m) {
    const hexload_real_t last_m = self->param[HEXLOAD_PAPER_DZ];
    const hexload_real_t whole_m = step_m + self->dz_rest_m;
    self->param[HEXLOAD_PAPER_DZ] = last_m + whole_m;
    self->dz_rest_m = whole_m - (self->param[HEXLOAD_PAPER_DZ] - last_m);
}

/// Takes out what force noise alone has done in this update. It stands in the Jacobian as it does in the
/// innovation: its variance there looks like motion and shrinks P, its product with itself moves dz and the
/// row's own inertia, each also by what P ties it to the other (D15). A spike counts as noise of its size; it
/// can at most double a variance, move dz by one sigma and an inertia by its lever.
static void remove_noise_effects(hexload_paper_filter_t* self, const hexload_real_t lever_kg_m2[3],
                                 hexload_real_t S[3][3], const hexload_real_t prior_variance[3],
                                 uint32_t* health) {
    const hexload_real_t one = HEXLOAD_REAL(1.0);
    hexload_jacobian_noise_t* noise = &self->jacobian_noise;
    hexload_real_t* dz_variance = &self->param_cov[HEXLOAD_PAPER_DZ][HEXLOAD_PAPER_DZ];
    const hexload_real_t dz_sigma = hexload_sqrt(*dz_variance);
    hexload_real_t dz_moved = HEXLOAD_REAL(0.0);
    HEXLOAD_UNROLL
    for (int i = 0; i < 3; i++) {
        const int own = HEXLOAD_PAPER_IXX + i;
        hexload_real_t* variance = &self->param_cov[own][own];
        const hexload_real_t kept = self->rate_cov[i][i] / prior_variance[i]; // 1 - K
        const hexload_real_t kept_variance = kept * kept;
        const hexload_real_t weight = noise->inertia[i] / S[i][i];
        const hexload_real_t false_share = bound_noise(*variance * weight, one, health);
        hexload_real_t moved = false_share;
        if (i < 2) {
            const hexload_real_t both = self->param_cov[own][HEXLOAD_PAPER_DZ];
            const hexload_real_t mixed = noise->mixed[i] / S[i][i];
            const hexload_real_t dz_share = bound_noise(*dz_variance * noise->dz[i] / S[i][i], one, health);
            moved = bound_noise(hexload_fma(both, mixed, moved), one, health);
            dz_moved = hexload_fma(lever_kg_m2[i], hexload_fma(*dz_variance, mixed, both * weight), dz_moved);
            *dz_variance = hexload_fma(*dz_variance, dz_share, *dz_variance);
            noise->dz[i] *= kept_variance;
            noise->mixed[i] *= kept_variance;
        }
        self->param[own] = hexload_fma(-lever_kg_m2[i], moved, self->param[own]);
        *variance = hexload_fma(*variance, false_share, *variance);
        noise->inertia[i] *= kept_variance;
    }
    add_to_dz(self, -bound_noise(dz_moved, dz_sigma, health));
}

/// What is left of a number without column k of U times three others.
static inline hexload_real_t take_off(hexload_real_t number, hexload_real_t U[3][3 + HEXLOAD_PAPER_DIM],
                                      int k, hexload_real_t a, hexload_real_t b, hexload_real_t c) {
    return hexload_fma(-U[2][k], c, hexload_fma(-U[1][k], b, hexload_fma(-U[0][k], a, number)));
}

/// P -= U^T U with U = S^-1/2 H P, and x += U^T S^-1/2 y (36): symmetric by construction.
static void correct(hexload_paper_filter_t* self, hexload_real_t L[3][3], const hexload_real_t whitened[3]) {
    hexload_real_t U[3][3 + HEXLOAD_PAPER_DIM]; // column k belongs to state k
    HEXLOAD_UNROLL
    for (int k = 0; k < 3 + HEXLOAD_PAPER_DIM; k++) {
        hexload_real_t column[3];
        hexload_real_t solved[3];
        HEXLOAD_UNROLL
        for (int i = 0; i < 3; i++) {
            column[i] = k >= 3   ? self->cross_cov[i][k - 3]
                        : k <= i ? self->rate_cov[i][k]
                                 : self->rate_cov[k][i];
        }
        forward_substitute3(L, column, solved);
        HEXLOAD_UNROLL
        for (int i = 0; i < 3; i++) {
            U[i][k] = solved[i];
        }
    }
    HEXLOAD_UNROLL
    for (int i = 0; i < 3; i++) {
        HEXLOAD_UNROLL
        for (int j = 0; j <= i; j++) {
            self->rate_cov[i][j] = take_off(self->rate_cov[i][j], U, i, U[0][j], U[1][j], U[2][j]);
        }
        HEXLOAD_UNROLL
        for (int k = 0; k < HEXLOAD_PAPER_DIM; k++) {
            self->cross_cov[i][k] =
                take_off(self->cross_cov[i][k], U, i, U[0][3 + k], U[1][3 + k], U[2][3 + k]);
        }
        self->rate_rad_s[i] = take_off(self->rate_rad_s[i], U, i, -whitened[0], -whitened[1], -whitened[2]);
    }
    HEXLOAD_UNROLL
    for (int i = 0; i < HEXLOAD_PAPER_DIM; i++) {
        HEXLOAD_UNROLL
        for (int j = 0; j <= i; j++) {
            self->param_cov[i][j] =
                take_off(self->param_cov[i][j], U, 3 + i, U[0][3 + j], U[1][3 + j], U[2][3 + j]);
        }
        self->param[i] = take_off(self->param[i], U, 3 + i, -whitened[0], -whitened[1], -whitened[2]);
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
                self->param_cov[j < k ? k : j][j < k ? j : k] *= scale;
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
static void seed_rate(hexload_paper_filter_t* self, const hexload_paper_step_t* measured) {
    memcpy(self->rate_rad_s, measured->rate_rad_s, sizeof self->rate_rad_s);
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j <= i; j++) {
            self->rate_cov[i][j] = measured->noise[i][j];
        }
    }
    memset(self->cross_cov, 0, sizeof self->cross_cov);
    self->jacobian_noise = (hexload_jacobian_noise_t){0};
    self->gated = 0;
    self->nis = IDEAL_NIS; // no innovation: a mean of NIS stands still
}

/// Innovation of the measured rates, whitened, S and its factor (29)-(31).
/// @return false when rounding has cost P its definiteness.
static inline bool innovate(hexload_paper_filter_t* self, const hexload_paper_step_t* step,
                            hexload_real_t S[3][3], hexload_real_t L[3][3], hexload_real_t whitened[3]) {
    hexload_real_t innovation[3];
    HEXLOAD_UNROLL
    for (int i = 0; i < 3; i++) {
        innovation[i] = step->rate_rad_s[i] - self->rate_rad_s[i];
        HEXLOAD_UNROLL
        for (int j = 0; j <= i; j++) {
            S[i][j] = self->rate_cov[i][j] + step->noise[i][j];
        }
    }
    if (!cholesky3(S, L)) {
        return false;
    }
    forward_substitute3(L, innovation, whitened);
    self->nis = dot3(whitened, whitened);
    return true;
}

/// (29)-(31), (36), and what keeps an estimate honest.
static void update(hexload_paper_filter_t* self, const hexload_config_t* config, hexload_paper_step_t* step,
                   uint32_t* health) {
    hexload_real_t S[3][3];
    hexload_real_t L[3][3];
    if (!innovate(self, step, S, L, step->whitened)) {
        seed_rate(self, step);
        hexload_health_set(health, HEXLOAD_HEALTH_RATE_RESEEDED);
        return;
    }
    if (!(self->nis <= config->paper.gate_nis)) { // also NaN
        hexload_health_set(health, HEXLOAD_HEALTH_MEASUREMENT_GATED);
        self->gated++;
        if (self->gated > config->paper.longest_gate_ticks) {
            seed_rate(self, step);
            hexload_health_set(health, HEXLOAD_HEALTH_RATE_RESEEDED);
        }
        return;
    }
    const hexload_real_t prior_variance[3] = {self->rate_cov[0][0], self->rate_cov[1][1],
                                              self->rate_cov[2][2]};
    self->gated = 0;
    correct(self, L, step->whitened);
    step->is_used = true;
    remove_noise_effects(self, step->noise_lever_kg_m2, S, prior_variance, health);
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
    for (int age = HEXLOAD_FORCE_HISTORY - 1; age > 0; age--) {
        memcpy(self->last_force_n[age], self->last_force_n[age - 1], sizeof self->last_force_n[age]);
    }
    memcpy(self->last_force_n[0], sample->force_n, sizeof self->last_force_n[0]);
    if (self->history < HEXLOAD_FORCE_HISTORY) {
        self->history++;
    }
}

void hexload_paper_filter_predict(hexload_paper_filter_t* self, const hexload_config_t* config,
                                  const hexload_present_tick_t* now, const hexload_wrench_t* wrench,
                                  hexload_paper_step_t* step, uint32_t* health) {
    measure_rate(now, step);
    step->is_used = false;
    step->is_predicted = now->gap_ticks > 0 && now->gap_ticks <= config->paper.longest_gap_ticks;
    if (now->gap_ticks != 1) {
        self->history = 0; // differences over a gap are motion
    }
    if (step->is_predicted) {
        hexload_paper_model_t model;
        hexload_paper_model_linearise(self, config, now, wrench,
                                      config->tick_s * (hexload_real_t)now->gap_ticks, &model);
        predict(self, &model);
        add_jacobian_noise(&self->jacobian_noise, &model.jacobian_noise);
        memcpy(step->noise_lever_kg_m2, model.noise_lever_kg_m2, sizeof step->noise_lever_kg_m2);
        return;
    }
    seed_rate(self, step);
    if (now->gap_ticks > 0) {
        hexload_health_set(health, HEXLOAD_HEALTH_RATE_RESEEDED);
    }
}

void hexload_paper_filter_correct(hexload_paper_filter_t* self, const hexload_config_t* config,
                                  const hexload_present_tick_t* now, const hexload_wrench_t* wrench,
                                  hexload_paper_step_t* step, uint32_t* health) {
    if (step->is_predicted) {
        update(self, config, step, health);
    }
    if (!is_finite(self)) {
        hexload_paper_filter_init(self, config);
        seed_rate(self, step);
        hexload_health_set(health, HEXLOAD_HEALTH_FILTER_RESTARTED);
    }
    remember(self, now->sample, wrench);
}

void hexload_paper_filter_read(const hexload_paper_filter_t* self, hexload_real_t value[HEXLOAD_PAPER_DIM],
                               hexload_real_t sigma[HEXLOAD_PAPER_DIM]) {
    for (int k = 0; k < HEXLOAD_PAPER_DIM; k++) {
        value[k] = self->param[k];
        sigma[k] = hexload_sqrt(self->param_cov[k][k]);
    }
}
