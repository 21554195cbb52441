#include "hexload/machine.h"

#include "health.h"
#include "momentum_frame.h"
#include "momentum_prior.h"

#include <stddef.h>

// The lasting memory of an estimator: 4-byte numbers, or 8-byte ones in the reference build.
_Static_assert(sizeof(hexload_machine_t) <= (size_t)18 * 1024 * sizeof(hexload_real_t) / sizeof(float) ||
                   HEXLOAD_LAG_TICKS_MAX > 82,
               "an estimator fits in 18 KiB");

hexload_status_t hexload_machine_init(hexload_machine_t* self, const hexload_config_t* config) {
    const hexload_status_t status = hexload_momentum_init(&self->momentum, config);
    if (status == HEXLOAD_OK) {
        hexload_machine_filter_init(&self->filter, config);
        hexload_separation_init(&self->separation);
    }
    return status;
}

/// The load monitor looks at what is left of the forces without the machine's effects.
static void watch_load(hexload_machine_t* self, const hexload_config_t* config, momentum_tick_t* tick) {
    if (!tick->is_aligned) {
        return;
    }
    hexload_leg_sample_t clean = tick->sample;
    hexload_sensors_t sensors = tick->sensors;
    hexload_machine_filter_clean(&self->filter, config, HEXLOAD_LOAD_MONITOR_MEMORY_S, &clean, &sensors);
    momentum_frame_watch(&self->momentum, config, &clean, &sensors, tick);
}

/// The machine stays as it is known; but the biases take what a mass that was told wrong weighs too much, and
/// a first change may be just that coming out.
static void forget_load(hexload_machine_t* self, const hexload_config_t* config) {
    const bool was_told = config->momentum.prior_mass_sigma_kg < momentum_open_mass_sigma_kg(config);
    hexload_momentum_filter_forget(&self->momentum.filter, config);
    if (was_told && self->momentum.health.count[HEXLOAD_HEALTH_LOAD_CHANGED] == 1) {
        hexload_machine_filter_init(&self->filter, config);
    } else {
        hexload_machine_filter_forget(&self->filter);
    }
}

/// One sample of lag_ticks ago.
static void filter_past(hexload_machine_t* self, const hexload_config_t* config, momentum_tick_t* tick) {
    hexload_momentum_t* momentum = &self->momentum;
    momentum_past_t past;
    if (!momentum_frame_take(momentum, config, tick, &past)) {
        return;
    }
    if (past.is_new_load) {
        forget_load(self, config);
    }
    momentum->is_interrupted = !hexload_machine_filter_step(
        &self->filter, &momentum->filter, config, &tick->sensors, &momentum->smoother.constants, &past.sample,
        &past.motion, &momentum->past_kinematics.jacobian);
    const uint32_t gap_ticks = momentum->is_interrupted ? 1 : past.sample.gap_ticks; // at rest, time goes on
    hexload_load_supervisor_watch(&momentum->supervisor, config, &momentum->filter, &past.motion, gap_ticks);
    hexload_separation_step(&self->separation, config, &momentum->filter, &self->filter, &past.sample);
}

hexload_status_t hexload_machine_tick(hexload_machine_t* self, const hexload_config_t* config,
                                      const hexload_leg_sample_t* sample, hexload_estimate_t* estimate) {
    hexload_momentum_t* momentum = &self->momentum;
    momentum_tick_t tick;
    const hexload_status_t status = momentum_frame_begin(momentum, config, sample, &tick);
    if (status != HEXLOAD_OK) {
        return status;
    }
    watch_load(self, config, &tick);
    filter_past(self, config, &tick);
    const bool is_finite = hexload_momentum_filter_is_finite(&momentum->filter) &&
                           hexload_machine_filter_is_finite(&self->filter);
    momentum_frame_end(momentum, config, sample, is_finite, &tick, estimate);
    if ((tick.health >> HEXLOAD_HEALTH_FILTER_RESTARTED & 1u) != 0) {
        hexload_machine_filter_init(&self->filter, config);
        hexload_separation_init(&self->separation);
    }
    hexload_separation_judge(&self->separation, estimate, &tick.health);
    hexload_health_count(&momentum->health, tick.health);
    return HEXLOAD_OK;
}

void hexload_machine_read(const hexload_machine_t* self, const hexload_estimate_t* estimate,
                          hexload_machine_answer_t* answer) {
    uint32_t open = 0;
    for (int k = 0; k < HEXLOAD_LOAD_DIM; k++) {
        open |= estimate->parameter_verdict[k] != HEXLOAD_VERDICT_CONVERGED ? (uint32_t)1 << k : 0;
    }
    hexload_machine_filter_read(&self->filter, answer->value, answer->sigma);
    answer->hidden_by_bias = self->separation.bias_mask & open;
    answer->hidden_by_friction = self->separation.friction_mask & open;
    answer->fastest_leg_m_s = self->separation.fastest_leg_m_s;
}
