#include "actuator_effects/identifiability.h"

#include "algebra/linalg.h"
#include "configuration/health.h"
#include "actuator_effects/actuator_effects_model.h"

#include <string.h>

enum { LOAD = HEXLOAD_LOAD_DIM, DIM = HEXLOAD_EFFECTS_DIM };

/// Variance over conditional variance, and prior over conditional, from which a parameter counts as
/// confounded.
#define CONFOUNDED_RATIO HEXLOAD_REAL(4.0)

/// Share of an effect's variance below which the rest, after an elimination, is rounding.
#define ROUNDING_SHARE (HEXLOAD_REAL(64.0) * (hexload_real_t)HEXLOAD_REAL_EPSILON)

void hexload_identifiability_init(hexload_identifiability_t* self) {
    *self = (hexload_identifiability_t){.next = DIM + LOAD};
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
    }
    self->next = 0;
    memset(self->open, 0, sizeof self->open);
}

/// Of effect `at` from P_ee; those before it are gone.
static void eliminate(hexload_identifiability_t* self, uint32_t at, uint32_t count) {
    const hexload_real_t pivot = self->effects[ROW(at) + at];
    hexload_real_t column[DIM];
    if (!(pivot > self->least_pivot[at])) {
        return;
    }
    const hexload_real_t inverse = HEXLOAD_REAL(1.0) / pivot;
    for (uint32_t j = at + 1; j < count; j++) {
        column[j] = self->effects[ROW(j) + at];
    }
    for (uint32_t i = at + 1; i < count; i++) {
        const hexload_real_t factor = inverse * column[i];
        hexload_real_t* row = &self->effects[ROW(i)];
        for (uint32_t j = at + 1; j <= i; j++) {
            row[j] = hexload_fma(-factor, column[j], row[j]);
        }
    }
}

/// As many in a tick as take no longer than the first.
static void eliminate_some(hexload_identifiability_t* self, uint32_t count) {
    uint32_t left = ROW(count);
    while (self->next < count && left >= ROW(count - self->next)) {
        left -= ROW(count - self->next);
        eliminate(self, self->next, count);
        self->next++;
    }
    self->next = self->next < count ? self->next : DIM;
}

/// Variances of a parameter: nothing given, then the biases, then friction too, then all.
typedef struct given {
    hexload_real_t nothing;
    hexload_real_t bias;
    hexload_real_t friction;
    hexload_real_t all;
} given_t;

/// Of parameter k, whose row is eliminated as those of P_ee were.
static given_t eliminate_row(hexload_identifiability_t* self, uint32_t k, uint32_t count) {
    hexload_real_t* row = self->cross[k];
    hexload_real_t variance = self->variance[k];
    given_t given = {.nothing = variance};
    for (uint32_t at = 0; at < count; at++) {
        const hexload_real_t pivot = self->effects[ROW(at) + at];
        if (at == HEXLOAD_EFFECT_COULOMB * HEXLOAD_LEGS) {
            given.bias = variance;
        } else if (at == HEXLOAD_EFFECT_TILT) {
            given.friction = variance;
        }
        if (pivot > self->least_pivot[at]) {
            const hexload_real_t factor = HEXLOAD_REAL(1.0) / pivot * row[at];
            const hexload_real_t* entry = &self->effects[ROW(at) + at];
            variance -= factor * row[at];
            for (uint32_t j = at + 1; j < count; j++) {
                entry = &entry[j];
                row[j] = hexload_fma(-factor, *entry, row[j]);
            }
        }
    }
    self->variance[k] = variance;
    given.all = hexload_max(variance, HEXLOAD_REAL(0.0));
    given.friction = count > HEXLOAD_EFFECT_TILT ? given.friction : given.all;
    return given;
}

/// What parameter k is confounded with: the effects whose elimination has lowered its variance by the largest
/// factor.
static void conclude(hexload_identifiability_t* self, const hexload_momentum_config_t* momentum, uint32_t k,
                     const given_t* given) {
    hexload_real_t prior_sigma[LOAD];
    hexload_momentum_prior_sigma(momentum, prior_sigma);
    const hexload_real_t prior = prior_sigma[k] * prior_sigma[k];
    if (given->nothing > CONFOUNDED_RATIO * given->all && prior > CONFOUNDED_RATIO * given->all) {
        const bool is_tilt = given->friction * given->bias > given->all * given->nothing &&
                             given->friction * given->friction > given->all * given->bias;
        const bool is_bias = given->nothing * given->friction > given->bias * given->bias;
        self->open[is_tilt ? 2 : (is_bias ? 0 : 1)] |= (uint32_t)1 << k;
    }
}

static void publish(hexload_identifiability_t* self) {
    self->bias_mask = self->open[0];
    self->friction_mask = self->open[1];
    self->tilt_mask = self->open[2];
}

void hexload_identifiability_step(hexload_identifiability_t* self, const hexload_config_t* config,
                                  const hexload_momentum_filter_t* load,
                                  const hexload_actuator_effects_t* effects,
                                  const hexload_smooth_sample_t* sample) {
    const hexload_real_t fade = config->tick_s / config->momentum.excitation_time_constant_s;
    const bool has_tilt = config->actuator_effects.prior_tilt_sigma_m_s2 > HEXLOAD_REAL(0.0);
    const uint32_t count = has_tilt ? DIM : HEXLOAD_EFFECT_TILT;
    self->fastest_leg_m_s -= fade * self->fastest_leg_m_s;
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        self->fastest_leg_m_s =
            hexload_max(self->fastest_leg_m_s, hexload_abs(sample->smooth_velocity_m_s[leg]));
    }
    if (self->next >= DIM + LOAD) {
        copy_covariance(self, load, effects);
    } else if (self->next < DIM) {
        eliminate_some(self, count);
    } else {
        const uint32_t k = self->next - DIM;
        const given_t given = eliminate_row(self, k, count);
        conclude(self, &config->momentum, k, &given);
        self->next++;
        if (self->next == DIM + LOAD) {
            publish(self);
        }
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
