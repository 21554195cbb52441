#include "actuator_effects/identifiability.h"

#include "algebra/linalg.h"
#include "actuator_effects/actuator_effects_model.h"

#include <string.h>

enum { LOAD = HEXLOAD_LOAD_DIM, DIM = HEXLOAD_EFFECTS_DIM };

/// Variance over conditional variance, and prior over conditional, from which a parameter counts as
/// confounded.
#define CONFOUNDED_RATIO HEXLOAD_REAL(4.0)

/// Share of an effect's variance below which the rest, after an elimination, is rounding.
#define ROUNDING_SHARE (HEXLOAD_REAL(64.0) * (hexload_real_t)HEXLOAD_REAL_EPSILON)

void hexload_identifiability_init(hexload_identifiability_t* self) {
    *self = (hexload_identifiability_t){.next = DIM};
}

static void copy_covariance(hexload_identifiability_t* self, const hexload_momentum_filter_t* load,
                            const hexload_actuator_effects_t* effects) {
    for (int i = 0; i < DIM; i++) {
        const hexload_real_t* row = &effects->covariance[EFFECT_ROW(i)];
        memcpy(&self->effects[ROW(i)], &row[HEXLOAD_MOMENTUM_STATES],
               (size_t)(i + 1) * sizeof self->effects[0]);
        self->least_pivot[i] = ROUNDING_SHARE * self->effects[ROW(i) + i];
        for (int k = 0; k < LOAD; k++) {
            self->cross[k][i] = row[k];
        }
    }
    for (int k = 0; k < LOAD; k++) {
        self->variance[k] = load->load_cov[k][k];
        self->before[k] = self->variance[k];
    }
}

/// Of effect `at`; those before it are gone.
static void eliminate(hexload_identifiability_t* self, uint32_t at) {
    const hexload_real_t pivot = self->effects[ROW(at) + at];
    if (!(pivot > self->least_pivot[at])) {
        return;
    }
    const hexload_real_t inverse = HEXLOAD_REAL(1.0) / pivot;
    for (uint32_t i = at + 1; i < DIM; i++) {
        const hexload_real_t factor = inverse * self->effects[ROW(i) + at];
        for (uint32_t j = at + 1; j <= i; j++) {
            self->effects[ROW(i) + j] -= factor * self->effects[ROW(j) + at];
        }
    }
    for (int k = 0; k < LOAD; k++) {
        const hexload_real_t factor = inverse * self->cross[k][at];
        self->variance[k] -= factor * self->cross[k][at];
        for (uint32_t j = at + 1; j < DIM; j++) {
            self->cross[k][j] -= factor * self->effects[ROW(j) + at];
        }
    }
}

/// What a parameter is confounded with: the effects whose elimination has lowered its variance by the larger
/// factor.
static void conclude(hexload_identifiability_t* self, const hexload_momentum_config_t* momentum) {
    hexload_real_t prior_sigma[LOAD];
    hexload_momentum_prior_sigma(momentum, prior_sigma);
    self->bias_mask = 0;
    self->friction_mask = 0;
    self->tilt_mask = 0;
    for (int k = 0; k < LOAD; k++) {
        const hexload_real_t sigma = prior_sigma[k];
        const hexload_real_t alone = hexload_max(self->variance[k], HEXLOAD_REAL(0.0));
        const uint32_t bit = (uint32_t)1 << k;
        if (self->before[k] > CONFOUNDED_RATIO * alone && sigma * sigma > CONFOUNDED_RATIO * alone) {
            const hexload_real_t level = hexload_max(self->given_friction[k], HEXLOAD_REAL(0.0));
            const bool is_tilt = level * self->given_bias[k] > alone * self->before[k] &&
                                 level * level > alone * self->given_bias[k];
            const bool is_bias =
                !is_tilt && self->before[k] * level > self->given_bias[k] * self->given_bias[k];
            self->tilt_mask |= is_tilt ? bit : 0;
            self->bias_mask |= is_bias ? bit : 0;
            self->friction_mask |= is_tilt || is_bias ? 0 : bit;
        }
    }
}

void hexload_identifiability_step(hexload_identifiability_t* self, const hexload_config_t* config,
                                  const hexload_momentum_filter_t* load,
                                  const hexload_actuator_effects_t* effects,
                                  const hexload_smooth_sample_t* sample) {
    const hexload_real_t fade = config->tick_s / config->momentum.excitation_time_constant_s;
    self->fastest_leg_m_s -= fade * self->fastest_leg_m_s;
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        self->fastest_leg_m_s =
            hexload_max(self->fastest_leg_m_s, hexload_abs(sample->smooth_velocity_m_s[leg]));
    }
    if (self->next == DIM) {
        copy_covariance(self, load, effects);
        self->next = 0;
        return;
    }
    eliminate(self, self->next);
    self->next++;
    if (self->next == HEXLOAD_EFFECT_COULOMB * HEXLOAD_LEGS) {
        memcpy(self->given_bias, self->variance, sizeof self->given_bias);
    } else if (self->next == HEXLOAD_EFFECT_TILT) {
        memcpy(self->given_friction, self->variance, sizeof self->given_friction);
        self->next = config->actuator_effects.prior_tilt_sigma_m_s2 > HEXLOAD_REAL(0.0) ? self->next : DIM;
    }
    if (self->next == DIM) {
        conclude(self, &config->momentum);
    }
}

void hexload_identifiability_judge(const hexload_identifiability_t* self, hexload_estimate_t* estimate,
                                   uint32_t* health) {
    for (int k = 0; k < LOAD; k++) {
        const uint32_t masks = self->bias_mask | self->friction_mask | self->tilt_mask;
        const bool is_confounded = (masks >> k & 1u) != 0;
        if (!is_confounded || estimate->parameter_verdict[k] != HEXLOAD_VERDICT_CONVERGING) {
            continue;
        }
        estimate->parameter_verdict[k] = HEXLOAD_VERDICT_NOT_EXCITED;
        if (estimate->verdict < HEXLOAD_VERDICT_NOT_EXCITED) {
            estimate->verdict = HEXLOAD_VERDICT_NOT_EXCITED;
        }
        hexload_health_set(health, HEXLOAD_HEALTH_NOT_EXCITED);
    }
}
