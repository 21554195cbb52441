#include "hexload/hexload.h"

#include "algebra/real.h"
#include "configuration/health.h"
#include "front_end/differentiator.h"
#include "front_end/leg_sample.h"
#include "front_end/lost_channels.h"
#include "front_end/noise_estimator.h"
#include "momentum/momentum_filter.h"
#include "momentum/tolerances.h"
#include "paper/paper_filter.h"
#include "paper/paper_supervisor.h"
#include "paper/paper_tolerances.h"
#include "paper_tick.h"

#include <stddef.h>
#include <string.h>

// For what a tick would call to do less than the call.
#if defined(__GNUC__)
#define IN_PLACE inline __attribute__((always_inline))
#else
#define IN_PLACE inline
#endif

static const hexload_unknown_t LOAD_AND_EFFECTS[HEXLOAD_UNKNOWNS_MAX] = {
    {"m", "kg"},           {"hx", "kg m"},        {"hy", "kg m"},        {"hz", "kg m"},
    {"Ixx", "kg m^2"},     {"Iyy", "kg m^2"},     {"Izz", "kg m^2"},     {"Ixy", "kg m^2"},
    {"Ixz", "kg m^2"},     {"Iyz", "kg m^2"},     {"bias1", "N"},        {"bias2", "N"},
    {"bias3", "N"},        {"bias4", "N"},        {"bias5", "N"},        {"bias6", "N"},
    {"coulomb1", "N"},     {"coulomb2", "N"},     {"coulomb3", "N"},     {"coulomb4", "N"},
    {"coulomb5", "N"},     {"coulomb6", "N"},     {"viscous1", "N s/m"}, {"viscous2", "N s/m"},
    {"viscous3", "N s/m"}, {"viscous4", "N s/m"}, {"viscous5", "N s/m"}, {"viscous6", "N s/m"},
    {"gx", "m/s^2"},       {"gy", "m/s^2"}};

static const hexload_unknown_t PAPER[HEXLOAD_PAPER_DIM] = {
    {"dz", "m"}, {"Ixx", "kg m^2"}, {"Iyy", "kg m^2"}, {"Izz", "kg m^2"}};

static const hexload_descriptor_t DESCRIPTORS[HEXLOAD_KINDS] = {
    [HEXLOAD_KIND_MOMENTUM] = {"momentum", HEXLOAD_LOAD_DIM, 0, 6, LOAD_AND_EFFECTS},
    [HEXLOAD_KIND_MOMENTUM_EFFECTS] = {"momentum_effects", HEXLOAD_LOAD_DIM, HEXLOAD_EFFECTS_DIM, 6,
                                       LOAD_AND_EFFECTS},
    [HEXLOAD_KIND_PAPER] = {"paper", HEXLOAD_PAPER_DIM, 0, 3, PAPER},
};

const hexload_descriptor_t* hexload_describe(hexload_kind_t kind) {
    return (unsigned)kind < (unsigned)HEXLOAD_KINDS ? &DESCRIPTORS[kind] : NULL;
}

/// The momentum estimator of an instance; NULL of the paper's.
static const hexload_momentum_t* momentum_of(const hexload_t* self) {
    switch (self->kind) {
    case HEXLOAD_KIND_MOMENTUM:
        return &self->as.momentum;
    case HEXLOAD_KIND_MOMENTUM_EFFECTS:
        return &self->as.momentum_effects.momentum;
    case HEXLOAD_KIND_PAPER:
    case HEXLOAD_KINDS:
    default:
        return NULL;
    }
}

static hexload_status_t init_kind(hexload_t* self, const hexload_config_t* config) {
    switch (config->kind) {
    case HEXLOAD_KIND_MOMENTUM:
        return hexload_momentum_init(&self->as.momentum, config);
    case HEXLOAD_KIND_MOMENTUM_EFFECTS:
        return hexload_momentum_effects_init(&self->as.momentum_effects, config);
    case HEXLOAD_KIND_PAPER:
        return hexload_paper_init(&self->as.paper, config);
    case HEXLOAD_KINDS:
    default:
        return HEXLOAD_ERR_CONFIG;
    }
}

hexload_status_t hexload_init(hexload_t* self, const hexload_config_t* config) {
    const hexload_status_t status = init_kind(self, config);
    if (status == HEXLOAD_OK) {
        self->kind = config->kind;
        hexload_differentiator_init(&self->differentiator);
    }
    return status;
}

/// As momentum_of(), to write to.
static hexload_momentum_t* momentum_in(hexload_t* self) {
    hexload_momentum_t* momentum =
        self->kind == HEXLOAD_KIND_MOMENTUM ? &self->as.momentum : &self->as.momentum_effects.momentum;
    return self->kind == HEXLOAD_KIND_PAPER ? NULL : momentum;
}

/// What the estimator is given where there are no velocity sensors: `middle`, all channels of half a window
/// ago. NULL: nothing, by a status or while no window is complete.
HEXLOAD_APART static const hexload_leg_sample_t* find_speeds(hexload_t* self, const hexload_config_t* config,
                                                             const hexload_leg_sample_t* sample,
                                                             hexload_leg_sample_t* middle,
                                                             hexload_status_t* status) {
    hexload_differentiator_t* differentiator = &self->differentiator;
    hexload_leg_sample_t seen;
    hexload_momentum_t* momentum = momentum_in(self);
    hexload_health_t* health = momentum != NULL ? &momentum->health : &self->as.paper.health;
    hexload_lost_channels_t* lost = momentum != NULL ? &momentum->lost : &self->as.paper.lost;
    uint32_t gap_ticks = 0;
    uint32_t bits = 0;
    hexload_lost_channels_t next;
    const bool is_guess = hexload_lost_channels_mend(lost, config, &differentiator->leg_gate, sample, &seen,
                                                     &next, &bits) != sample;
    if (!is_guess) {
        seen = *sample;
    }
    memset(seen.velocity_m_s, 0, sizeof seen.velocity_m_s);
    *status = hexload_leg_sample_check(&differentiator->leg_gate, config, &seen, &gap_ticks, &bits);
    if (*status != HEXLOAD_OK) {
        (void)hexload_health_refuse(health, *status);
        return NULL;
    }
    hexload_leg_sample_accept(&differentiator->leg_gate, &seen);
    if (is_guess) {
        *lost = next;
        lost->force_ticks++; // the estimator's tick counts down
    }
    hexload_noise_estimator_step(momentum != NULL ? &momentum->noise_estimator
                                                  : &self->as.paper.noise_estimator,
                                 config, &seen, gap_ticks);
    if (!hexload_differentiator_step(differentiator, config, &seen, gap_ticks, middle)) {
        hexload_health_count(health, bits);
        return NULL;
    }
    return middle;
}

/// After a tick that has given the estimator nothing.
static void hold(const hexload_t* self, const hexload_leg_sample_t* sample, hexload_estimate_t* estimate) {
    if (!self->differentiator.has_begun) {
        hexload_read(self, estimate);
    }
    estimate->tick = sample->tick;
}

static IN_PLACE hexload_status_t tick_of_kind(hexload_t* self, const hexload_config_t* config,
                                              const hexload_leg_sample_t* sample,
                                              hexload_estimate_t* estimate) {
    switch (self->kind) {
    case HEXLOAD_KIND_MOMENTUM:
        return hexload_momentum_tick(&self->as.momentum, config, sample, estimate);
    case HEXLOAD_KIND_MOMENTUM_EFFECTS:
        return hexload_momentum_effects_tick(&self->as.momentum_effects, config, sample, estimate);
    case HEXLOAD_KIND_PAPER:
        return hexload_paper_tick(&self->as.paper, config, sample, estimate);
    case HEXLOAD_KINDS:
    default:
        return HEXLOAD_ERR_CONFIG;
    }
}

HEXLOAD_APART static hexload_status_t tick_without_velocity(hexload_t* self, const hexload_config_t* config,
                                                            const hexload_leg_sample_t* sample,
                                                            hexload_estimate_t* estimate) {
    hexload_leg_sample_t middle;
    hexload_status_t status;
    const hexload_leg_sample_t* given = find_speeds(self, config, sample, &middle, &status);
    if (given != NULL) {
        status = tick_of_kind(self, config, given, estimate);
        if (status == HEXLOAD_OK) {
            estimate->tick = sample->tick;
        }
    } else if (status == HEXLOAD_OK) {
        hold(self, sample, estimate);
    }
    return status;
}

hexload_status_t hexload_tick(hexload_t* self, const hexload_config_t* config,
                              const hexload_leg_sample_t* sample, hexload_estimate_t* estimate) {
    return config->sensors.half_window_ticks == 0 ? tick_of_kind(self, config, sample, estimate)
                                                  : tick_without_velocity(self, config, sample, estimate);
}

static hexload_status_t trace_of_kind(hexload_t* self, const hexload_config_t* config,
                                      const hexload_leg_sample_t* sample, hexload_estimate_t* estimate,
                                      hexload_trace_t* trace) {
    switch (self->kind) {
    case HEXLOAD_KIND_MOMENTUM:
        return hexload_momentum_trace(&self->as.momentum, config, sample, estimate, trace);
    case HEXLOAD_KIND_MOMENTUM_EFFECTS:
        return hexload_momentum_effects_trace(&self->as.momentum_effects, config, sample, estimate, trace);
    case HEXLOAD_KIND_PAPER:
        return hexload_paper_trace(&self->as.paper, config, sample, estimate, trace);
    case HEXLOAD_KINDS:
    default:
        return HEXLOAD_ERR_CONFIG;
    }
}

hexload_status_t hexload_trace(hexload_t* self, const hexload_config_t* config,
                               const hexload_leg_sample_t* sample, hexload_estimate_t* estimate,
                               hexload_trace_t* trace) {
    hexload_leg_sample_t middle;
    hexload_status_t status;
    if (config->sensors.half_window_ticks == 0) {
        return trace_of_kind(self, config, sample, estimate, trace);
    }
    const hexload_leg_sample_t* given = find_speeds(self, config, sample, &middle, &status);
    if (given != NULL) {
        status = trace_of_kind(self, config, given, estimate, trace);
        if (status == HEXLOAD_OK) {
            estimate->tick = sample->tick;
        }
    } else if (status == HEXLOAD_OK) {
        hold(self, sample, estimate);
        *trace = (hexload_trace_t){.tick = sample->tick, .dimension = DESCRIPTORS[self->kind].measurements};
    }
    return status;
}

void hexload_read(const hexload_t* self, hexload_estimate_t* estimate) {
    const hexload_momentum_t* momentum = momentum_of(self);
    *estimate = (hexload_estimate_t){.verdict = HEXLOAD_VERDICT_NOT_EXCITED};
    for (int k = 0; k < HEXLOAD_PARAMETERS_MAX; k++) {
        estimate->parameter_verdict[k] = HEXLOAD_VERDICT_NOT_EXCITED;
    }
    if (momentum != NULL) {
        estimate->nis = momentum->filter.nis;
        estimate->nis_mean = momentum->supervisor.nis_mean;
        hexload_momentum_filter_read(&momentum->filter, estimate->value, estimate->sigma);
    } else {
        estimate->nis = self->as.paper.filter.nis;
        estimate->nis_mean = self->as.paper.supervisor.nis_mean;
        hexload_paper_filter_read(&self->as.paper.filter, estimate->value, estimate->sigma);
    }
}

bool hexload_read_effects(const hexload_t* self, const hexload_estimate_t* estimate,
                          hexload_effects_estimate_t* effects) {
    if (self->kind != HEXLOAD_KIND_MOMENTUM_EFFECTS) {
        return false;
    }
    hexload_momentum_effects_read(&self->as.momentum_effects, estimate, effects);
    return true;
}

const hexload_health_t* hexload_health(const hexload_t* self) {
    const hexload_momentum_t* momentum = momentum_of(self);
    return momentum != NULL ? &momentum->health : &self->as.paper.health;
}

/// Rows of the effects: their covariance with theta, then with the effects before; mu's lies between. Widened
/// by what the rig leaves open, as write_load() does.
static uint32_t write_effects(const hexload_momentum_effects_t* self, hexload_real_t* covariance) {
    const hexload_real_t scale = hexload_sqrt(self->effects.filter.dispersion);
    const hexload_real_t* known = self->effects.filter.covariance;
    uint32_t written = 0;
    int first = 0; // of the row
    for (int i = 0; i < HEXLOAD_EFFECTS_DIM; i++) {
        for (int j = 0; j < HEXLOAD_LOAD_DIM; j++) {
            covariance[written] = self->momentum.jackknife.factor[j] * known[first + j];
            for (int n = 0; n < HEXLOAD_RIG_DIRECTIONS_MAX; n++) {
                covariance[written] = hexload_fma(scale * self->effects.filter.considered[n][i],
                                                  self->momentum.consider.load[n][j], covariance[written]);
            }
            written++;
        }
        for (int j = 0; j <= i; j++) {
            covariance[written] = known[first + HEXLOAD_MOMENTUM_STATES + j];
            for (int n = 0; n < HEXLOAD_RIG_DIRECTIONS_MAX; n++) {
                covariance[written] = hexload_fma(self->effects.filter.considered[n][i],
                                                  self->effects.filter.considered[n][j], covariance[written]);
            }
            written++;
        }
        first += HEXLOAD_MOMENTUM_STATES + i + 1;
    }
    return written;
}

/// The filter's, widened by the blocks' factors or by the residual test's, by what the rig leaves open, and
/// by what no motion tells.
static uint32_t write_load(const hexload_momentum_t* momentum, hexload_real_t dispersion,
                           hexload_real_t* covariance) {
    const hexload_real_t* factor = momentum->jackknife.factor;
    const hexload_real_t least = momentum->residual_test.factor;
    uint32_t written = 0;
    for (int i = 0; i < HEXLOAD_LOAD_DIM; i++) {
        for (int j = 0; j <= i; j++) {
            hexload_real_t sum = hexload_max(factor[i], least) * hexload_max(factor[j], least) *
                                 momentum->filter.load_cov[i][j];
            for (int n = 0; n < HEXLOAD_RIG_DIRECTIONS_MAX; n++) { // zeros beyond the configured ones
                sum = hexload_fma(dispersion * momentum->consider.load[n][i], momentum->consider.load[n][j],
                                  sum);
            }
            covariance[written] = sum + hexload_tolerances_covariance(&momentum->filter, i, j);
            written++;
        }
    }
    return written;
}

/// The filter's, widened as its sigmas are.
static uint32_t write_paper(const hexload_paper_t* paper, hexload_real_t* covariance) {
    const hexload_real_t* kept = paper->supervisor.kept;
    const hexload_real_t factor =
        hexload_paper_supervisor_possible(&paper->supervisor, hexload_paper_mismatch(paper));
    const hexload_real_t weight_error = paper->known_mass.weight_error;
    uint32_t written = 0;
    for (int i = 0; i < HEXLOAD_PAPER_DIM; i++) {
        for (int j = 0; j <= i; j++) {
            const hexload_real_t open =
                hexload_paper_tolerances_covariance(&paper->filter, weight_error, i, j);
            covariance[written] =
                factor * factor * hexload_fma(kept[i] * kept[j], paper->filter.param_cov[i][j], open);
            written++;
        }
    }
    return written;
}

/// What judges have widened since, one parameter more than the other, and sigma alone tells: rows and columns
/// are scaled, so that the covariance remains one.
static void match_sigmas(const hexload_real_t sigma[HEXLOAD_LOAD_DIM], uint32_t unknowns,
                         hexload_real_t* covariance) {
    enum { KNOWN = HEXLOAD_LOAD_DIM };
    hexload_real_t scale[KNOWN];
    for (uint32_t i = 0; i < (uint32_t)KNOWN; i++) {
        const hexload_real_t variance = covariance[(i * (i + 1U) / 2U) + i];
        const bool is_told = sigma[i] > HEXLOAD_REAL(0.0);
        scale[i] = is_told ? sigma[i] / hexload_sqrt(variance) : HEXLOAD_REAL(1.0); // no tick yet: none
    }
    for (uint32_t i = 0; i < unknowns; i++) {
        for (uint32_t j = 0; (j <= i) && (j < (uint32_t)KNOWN); j++) {
            covariance[(i * (i + 1U) / 2U) + j] *=
                scale[j] * ((i < (uint32_t)KNOWN) ? scale[i] : HEXLOAD_REAL(1.0));
        }
    }
}

uint32_t hexload_covariance(const hexload_t* self, hexload_real_t covariance[HEXLOAD_COVARIANCES_MAX]) {
    const hexload_momentum_t* momentum = momentum_of(self);
    if (momentum == NULL) {
        return write_paper(&self->as.paper, covariance);
    }
    const bool has_effects = self->kind == HEXLOAD_KIND_MOMENTUM_EFFECTS;
    const hexload_momentum_effects_t* with_effects = &self->as.momentum_effects;
    const hexload_real_t dispersion =
        has_effects ? with_effects->effects.filter.dispersion : HEXLOAD_REAL(1.0);
    uint32_t written = write_load(momentum, dispersion, covariance);
    if (has_effects) {
        written += write_effects(with_effects, &covariance[written]);
    }
    match_sigmas(momentum->sigma,
                 has_effects ? (uint32_t)HEXLOAD_LOAD_DIM + (uint32_t)HEXLOAD_EFFECTS_DIM : HEXLOAD_LOAD_DIM,
                 covariance);
    return written;
}
