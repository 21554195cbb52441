#include "app/app.h"

#include "app/saturate.h"
#include "bus/crc.h"

#include <hexload_dbc.h>

#include <stddef.h>

// Codes of the DBC are those of the header.
#define SAME_STATES(message)                                                                                 \
    _Static_assert((int)HEXLOAD_DBC_##message##_STATE_IDLE_CHOICE == HEXLOAD_APP_IDLE &&                     \
                       (int)HEXLOAD_DBC_##message##_STATE_ARMED_CHOICE == HEXLOAD_APP_ARMED &&               \
                       (int)HEXLOAD_DBC_##message##_STATE_ESTIMATING_CHOICE == HEXLOAD_APP_ESTIMATING &&     \
                       (int)HEXLOAD_DBC_##message##_STATE_CONVERGED_CHOICE == HEXLOAD_APP_CONVERGED &&       \
                       (int)HEXLOAD_DBC_##message##_STATE_FAULT_CHOICE == HEXLOAD_APP_FAULT,                 \
                   "states of the DBC")
SAME_STATES(HEALTH_FD);
SAME_STATES(ANSWER_PAGE);
SAME_STATES(ACKNOWLEDGE);
SAME_STATES(CONTROLLER_STATUS);

#define SAME_FAULTS(message)                                                                                 \
    _Static_assert(                                                                                          \
        (int)HEXLOAD_DBC_##message##_FAULT_NONE_CHOICE == HEXLOAD_FAULT_NONE &&                              \
            (int)HEXLOAD_DBC_##message##_FAULT_SAMPLE_TIMEOUT_CHOICE == HEXLOAD_FAULT_SAMPLE_TIMEOUT &&      \
            (int)HEXLOAD_DBC_##message##_FAULT_SAMPLES_REFUSED_CHOICE == HEXLOAD_FAULT_SAMPLES_REFUSED &&    \
            (int)HEXLOAD_DBC_##message##_FAULT_WRONG_PROFILE_CHOICE == HEXLOAD_FAULT_WRONG_PROFILE &&        \
            (int)HEXLOAD_DBC_##message##_FAULT_SECOND_CONTROLLER_CHOICE ==                                   \
                HEXLOAD_FAULT_SECOND_CONTROLLER &&                                                           \
            (int)HEXLOAD_DBC_##message##_FAULT_BUS_DOWN_CHOICE == HEXLOAD_FAULT_BUS_DOWN &&                  \
            (int)HEXLOAD_DBC_##message##_FAULT_SECOND_SOURCE_CHOICE == HEXLOAD_FAULT_SECOND_SOURCE &&        \
            (int)HEXLOAD_DBC_##message##_FAULT_SAMPLES_NOT_AUTHENTICATED_CHOICE ==                           \
                HEXLOAD_FAULT_NOT_AUTHENTICATED,                                                             \
        "faults of the DBC")
SAME_FAULTS(HEALTH_FD);
SAME_FAULTS(ANSWER_PAGE);
SAME_FAULTS(ACKNOWLEDGE);
SAME_FAULTS(CONTROLLER_STATUS);

enum { SHORTEST_TIMEOUT_MS = 5, LONGEST_TIMEOUT_MS = 60000, LONGEST_LOCKSTEP_TIMEOUT_MS = 600000 };

void hexload_app_settings_default(hexload_app_settings_t* settings) {
    *settings = (hexload_app_settings_t){
        .sample_timeout_ms = 100,
        .lockstep_timeout_ms = 10000,
        .refused_limit = 100,
    };
}

static bool is_in(uint32_t value, uint32_t least, uint32_t most) {
    return value >= least && value <= most;
}

const hexload_health_t* hexload_app_health(const hexload_app_t* self) {
    return hexload_health(&self->estimator);
}

hexload_real_t hexload_app_known_mass_kg(const hexload_app_t* self) {
    return self->config.kind == HEXLOAD_KIND_PAPER ? self->config.paper.load_mass_kg
                                                   : self->config.momentum.prior_mass_kg;
}

uint32_t hexload_app_configuration(const hexload_config_t* config) {
    const uint8_t* bytes = (const uint8_t*)config;
    const size_t begin = offsetof(hexload_config_t, tick_s);
    const size_t directions = sizeof config->rig.direction[0] * config->rig.direction_count;
    return hexload_crc32(0, &bytes[begin], offsetof(hexload_config_t, rig.direction) + directions - begin);
}

/// A fresh estimator and counters that start from 0. Every configuration was checked when it came.
static void begin_anew(hexload_app_t* self) {
    (void)(hexload_init(&self->estimator, &self->config) == HEXLOAD_OK);
    hexload_read(&self->estimator, &self->estimate);
    self->fault = HEXLOAD_FAULT_NONE;
    self->silence_ms = 0;
    self->refused_in_a_row = 0;
    self->samples_missing = 0;
    self->last_tick = 0;
    self->jump_samples = 0;
    self->has_codes = false;
    self->change_tick = 0;
}

hexload_status_t hexload_app_init(hexload_app_t* self, const hexload_config_t* config,
                                  const hexload_app_settings_t* settings) {
    if (!is_in(settings->sample_timeout_ms, SHORTEST_TIMEOUT_MS, LONGEST_TIMEOUT_MS) ||
        !is_in(settings->lockstep_timeout_ms, SHORTEST_TIMEOUT_MS, LONGEST_LOCKSTEP_TIMEOUT_MS) ||
        settings->refused_limit == 0) {
        return HEXLOAD_ERR_CONFIG;
    }
    const hexload_status_t status = hexload_init(&self->estimator, config);
    if (status != HEXLOAD_OK) {
        return status;
    }
    self->config = *config;
    self->configured_paper = config->paper;
    self->configured_momentum = config->momentum;
    self->configuration = hexload_app_configuration(&self->config);
    self->settings = *settings;
    self->state = HEXLOAD_APP_IDLE;
    self->pacing = HEXLOAD_PACING_REAL_TIME;
    begin_anew(self);
    return HEXLOAD_OK;
}

/// Whether a source works with the configuration in force, or does not say.
static bool has_same_configuration(const hexload_app_t* self, uint32_t stated) {
    return stated == 0 || (stated ^ self->configuration) % (HEXLOAD_BUS_CONFIGURATION_MASK + 1) == 0;
}

static hexload_bus_result_t start(hexload_app_t* self, float argument, uint32_t configuration) {
    if (self->state != HEXLOAD_APP_IDLE) {
        return HEXLOAD_RESULT_WRONG_STATE;
    }
    if (argument != (float)HEXLOAD_PACING_REAL_TIME && argument != (float)HEXLOAD_PACING_LOCKSTEP) {
        return HEXLOAD_RESULT_BAD_ARGUMENT;
    }
    if (!has_same_configuration(self, configuration)) {
        return HEXLOAD_RESULT_OTHER_CONFIGURATION;
    }
    begin_anew(self);
    self->pacing =
        argument == (float)HEXLOAD_PACING_LOCKSTEP ? HEXLOAD_PACING_LOCKSTEP : HEXLOAD_PACING_REAL_TIME;
    self->state = HEXLOAD_APP_ARMED;
    return HEXLOAD_RESULT_DONE;
}

static hexload_bus_result_t stop(hexload_app_t* self) {
    if (self->state == HEXLOAD_APP_FAULT) {
        return HEXLOAD_RESULT_WRONG_STATE;
    }
    self->state = HEXLOAD_APP_IDLE;
    return HEXLOAD_RESULT_DONE;
}

static hexload_bus_result_t reset(hexload_app_t* self) {
    self->config.paper = self->configured_paper;
    self->config.momentum = self->configured_momentum;
    self->configuration = hexload_app_configuration(&self->config);
    begin_anew(self);
    self->state = HEXLOAD_APP_IDLE;
    return HEXLOAD_RESULT_DONE;
}

static hexload_bus_result_t select_filter(hexload_app_t* self, float argument) {
    if (self->state != HEXLOAD_APP_IDLE) {
        return HEXLOAD_RESULT_WRONG_STATE;
    }
    if (!(argument >= 0.0f && argument < (float)HEXLOAD_KINDS) || argument != (float)(uint32_t)argument) {
        return HEXLOAD_RESULT_BAD_ARGUMENT;
    }
    const hexload_kind_t kind = (hexload_kind_t)(uint32_t)argument;
    if (kind == self->config.kind) {
        return HEXLOAD_RESULT_DONE;
    }
    self->config.kind = kind;
    begin_anew(self);
    return HEXLOAD_RESULT_DONE;
}

/// Leaves the configuration as it is.
static bool has_safe_prior(hexload_config_t* config) {
    const hexload_paper_config_t paper = config->paper;
    hexload_config_set_prior(config, HEXLOAD_PRIOR_SAFE);
    bool is_same = config->paper.prior_dz_sigma_m == paper.prior_dz_sigma_m;
    for (int k = 0; k < 3; k++) {
        is_same = is_same && config->paper.prior_inertia_sigma_kg_m2[k] == paper.prior_inertia_sigma_kg_m2[k];
    }
    config->paper = paper;
    return is_same;
}

/// The safe prior goes with the mass; another one stays as it was configured.
static hexload_bus_result_t set_known_mass(hexload_app_t* self, float mass_kg) {
    if (self->state != HEXLOAD_APP_IDLE) {
        return HEXLOAD_RESULT_WRONG_STATE;
    }
    const hexload_paper_config_t paper = self->config.paper;
    const hexload_momentum_config_t momentum = self->config.momentum;
    const bool is_safe = has_safe_prior(&self->config);
    hexload_config_set_known_mass(&self->config, (hexload_real_t)mass_kg);
    if (is_safe) {
        hexload_config_set_prior(&self->config, HEXLOAD_PRIOR_SAFE);
    }
    if (hexload_config_check(&self->config, NULL) != HEXLOAD_OK) {
        self->config.paper = paper;
        self->config.momentum = momentum;
        return HEXLOAD_RESULT_BAD_ARGUMENT;
    }
    self->configuration = hexload_app_configuration(&self->config);
    return HEXLOAD_RESULT_DONE;
}

static hexload_bus_result_t carry_out(hexload_app_t* self, const hexload_bus_command_t* command) {
    switch (command->kind) {
    case HEXLOAD_COMMAND_START:
        return start(self, command->argument, command->configuration);
    case HEXLOAD_COMMAND_STOP:
        return stop(self);
    case HEXLOAD_COMMAND_RESET:
        return reset(self);
    case HEXLOAD_COMMAND_SELECT_FILTER:
        return select_filter(self, command->argument);
    case HEXLOAD_COMMAND_SET_KNOWN_MASS:
        return set_known_mass(self, command->argument);
    default:
        return HEXLOAD_RESULT_UNKNOWN_COMMAND;
    }
}

void hexload_app_command(hexload_app_t* self, const hexload_bus_command_t* command,
                         hexload_bus_acknowledge_t* acknowledge) {
    acknowledge->kind = command->kind;
    acknowledge->source = command->source;
    acknowledge->session = command->session;
    acknowledge->sequence = command->sequence;
    acknowledge->result = (uint8_t)carry_out(self, command);
    acknowledge->state = (uint8_t)self->state;
    acknowledge->fault = (uint8_t)self->fault;
    acknowledge->known_mass_crc = hexload_bus_known_mass_crc((float)hexload_app_known_mass_kg(self));
}

bool hexload_app_is_running(const hexload_app_t* self) {
    return self->state == HEXLOAD_APP_ARMED || self->state == HEXLOAD_APP_ESTIMATING ||
           self->state == HEXLOAD_APP_CONVERGED;
}

bool hexload_app_has_load_changed(const hexload_app_t* self, uint32_t tick) {
    return hexload_app_is_running(self) && self->last_tick == tick &&
           (hexload_app_health(self)->bits >> HEXLOAD_HEALTH_LOAD_CHANGED & 1u) != 0;
}

static void take_estimate(hexload_app_t* self, uint32_t tick) {
    if (self->state != HEXLOAD_APP_ARMED) { // the first sample has none before it
        hexload_count(&self->samples_missing, tick - self->last_tick - 1);
    }
    self->last_tick = tick;
    if (hexload_app_has_load_changed(self, tick)) {
        self->change_tick = tick;
    }
    self->refused_in_a_row = 0;
    self->jump_samples = 0;
    self->state =
        self->estimate.verdict == HEXLOAD_VERDICT_CONVERGED ? HEXLOAD_APP_CONVERGED : HEXLOAD_APP_ESTIMATING;
}

/// Silence of the source that is a fault.
static uint32_t silence_limit_ms(const hexload_app_t* self) {
    return self->pacing == HEXLOAD_PACING_LOCKSTEP ? self->settings.lockstep_timeout_ms
                                                   : self->settings.sample_timeout_ms;
}

/// Whether a sample is so far ahead that only the silence of the source, and others after it, make it
/// believable.
static bool is_jump(hexload_app_t* self, uint32_t tick) {
    const uint32_t ahead = tick - self->last_tick;
    if (self->state == HEXLOAD_APP_ARMED || ahead <= (uint32_t)HEXLOAD_APP_FARTHEST_JUMP ||
        ahead > UINT32_MAX / 2) {
        return false;
    }
    const bool follows = self->jump_samples > 0 && tick - self->jump_tick - 1u < HEXLOAD_APP_JUMP_SAMPLES;
    if (!follows) {
        self->jump_samples = 0;
    }
    if (self->jump_samples < (uint16_t)HEXLOAD_APP_JUMP_SAMPLES) {
        self->jump_samples++;
    }
    self->jump_tick = tick;
    const bool is_silent = self->silence_ms >= silence_limit_ms(self) / 2u;
    return self->has_codes || !is_silent || self->jump_samples < (uint16_t)HEXLOAD_APP_JUMP_SAMPLES;
}

static hexload_status_t run(hexload_app_t* self, const hexload_leg_sample_t* sample) {
    if (is_jump(self, sample->tick)) { // not the source's, whose silence goes on
        return HEXLOAD_ERR_TICK;
    }
    self->silence_ms = 0;
    const hexload_status_t status = hexload_tick(&self->estimator, &self->config, sample, &self->estimate);
    if (status == HEXLOAD_OK) {
        take_estimate(self, sample->tick);
        return status;
    }
    hexload_count(&self->refused_in_a_row, 1);
    if (self->refused_in_a_row >= self->settings.refused_limit) {
        hexload_app_set_fault(self, status == HEXLOAD_ERR_TICK ? HEXLOAD_FAULT_SECOND_SOURCE
                                                               : HEXLOAD_FAULT_SAMPLES_REFUSED);
    }
    return status;
}

void hexload_app_sample(hexload_app_t* self, const hexload_leg_sample_t* sample,
                        hexload_bus_answer_t* answer) {
    const hexload_status_t status = hexload_app_is_running(self) ? run(self, sample) : HEXLOAD_OK;
    answer->tick = sample->tick;
    answer->status = (int8_t)status;
    answer->state = (uint8_t)self->state;
    answer->fault = (uint8_t)self->fault;
    answer->filter = (uint8_t)hexload_bus_filter_of(self->config.kind);
    answer->health = (uint16_t)hexload_app_health(self)->bits;
    answer->input = hexload_app_health(self)->input;
    answer->refused = hexload_app_health(self)->refused;
    answer->estimate = self->estimate;
}

void hexload_app_elapse(hexload_app_t* self, uint32_t elapsed_ms) {
    if (self->state != HEXLOAD_APP_ESTIMATING && self->state != HEXLOAD_APP_CONVERGED) {
        return;
    }
    hexload_count(&self->silence_ms, elapsed_ms);
    if (self->silence_ms >= silence_limit_ms(self)) {
        hexload_app_set_fault(self, HEXLOAD_FAULT_SAMPLE_TIMEOUT);
    }
}

void hexload_app_set_fault(hexload_app_t* self, hexload_app_fault_t fault) {
    if (self->state == HEXLOAD_APP_FAULT || fault == HEXLOAD_FAULT_NONE) {
        return;
    }
    self->state = HEXLOAD_APP_FAULT;
    self->fault = fault;
}

const char* hexload_app_state_name(hexload_app_state_t state) {
    switch (state) {
    case HEXLOAD_APP_IDLE:
        return "idle";
    case HEXLOAD_APP_ARMED:
        return "armed";
    case HEXLOAD_APP_ESTIMATING:
        return "estimating";
    case HEXLOAD_APP_CONVERGED:
        return "converged";
    case HEXLOAD_APP_FAULT:
        return "fault";
    default:
        return "unknown state";
    }
}

const char* hexload_app_fault_name(hexload_app_fault_t fault) {
    switch (fault) {
    case HEXLOAD_FAULT_NONE:
        return "no fault";
    case HEXLOAD_FAULT_SAMPLE_TIMEOUT:
        return "no samples";
    case HEXLOAD_FAULT_SAMPLES_REFUSED:
        return "samples refused";
    case HEXLOAD_FAULT_WRONG_PROFILE:
        return "samples of the other bus profile";
    case HEXLOAD_FAULT_SECOND_CONTROLLER:
        return "second controller on the bus";
    case HEXLOAD_FAULT_BUS_DOWN:
        return "bus down";
    case HEXLOAD_FAULT_NOT_AUTHENTICATED:
        return "samples not authenticated";
    case HEXLOAD_FAULT_SECOND_SOURCE:
        return "samples of two sources";
    default:
        return "unknown fault";
    }
}
