#include "momentum_frame.h"

#include "health.h"

/// Ticks before the alarm at which the new load may have been there already: the filter forgets then.
enum { ALARM_DELAY_TICKS = 6 };

hexload_status_t hexload_momentum_frame_begin(hexload_momentum_t* self, const hexload_config_t* config,
                                              const hexload_leg_sample_t* sample, momentum_tick_t* tick) {
    tick->health = 0;
    tick->gap_ticks = 0;
    hexload_status_t status =
        hexload_leg_sample_check(&self->leg_gate, config, sample, &tick->gap_ticks, &tick->health);
    if (status != HEXLOAD_OK) {
        return hexload_health_refuse(&self->health, status);
    }
    status = hexload_kinematics_solve(&self->kinematics, config, sample, &tick->motion);
    if (status != HEXLOAD_OK) {
        return hexload_health_refuse(&self->health, status);
    }
    hexload_leg_sample_accept(&self->leg_gate, sample);

    hexload_noise_estimator_step(&self->noise_estimator, config, sample, tick->gap_ticks);
    hexload_noise_estimator_read(&self->noise_estimator, &config->sensors, &tick->sensors, &tick->health);
    return HEXLOAD_OK;
}

void hexload_momentum_frame_watch(hexload_momentum_t* self, const hexload_config_t* config,
                                  const hexload_leg_sample_t* sample, const hexload_sensors_t* sensors,
                                  momentum_tick_t* tick) {
    if (!hexload_momentum_filter_has_begun(&self->filter)) {
        return;
    }
    const bool has_changed =
        hexload_load_monitor_step(&self->monitor, config, sensors, &self->filter, sample, &tick->motion,
                                  &self->kinematics.jacobian, tick->gap_ticks);
    if (has_changed && !self->is_changing) {
        self->is_changing = true;
        self->change_tick = sample->tick - ALARM_DELAY_TICKS;
        hexload_health_set(&tick->health, HEXLOAD_HEALTH_LOAD_CHANGED);
    }
    hexload_momentum_supervisor_hear(&self->supervisor, config, &self->monitor);
}

bool hexload_momentum_frame_take(hexload_momentum_t* self, const hexload_config_t* config,
                                 const hexload_leg_sample_t* sample, momentum_tick_t* tick,
                                 momentum_past_t* past) {
    if (!hexload_smoother_put(&self->smoother, config, sample, tick->gap_ticks) && tick->gap_ticks > 0) {
        hexload_health_set(&tick->health, HEXLOAD_HEALTH_RATE_RESEEDED);
    }
    if (!hexload_smoother_take(&self->smoother, &tick->sensors, &past->sample)) {
        return false;
    }
    if (hexload_kinematics_solve(&self->past_kinematics, config, &past->sample.sample, &past->motion) !=
        HEXLOAD_OK) {
        self->is_interrupted = true;
        return false;
    }
    past->is_new_load = self->is_changing && past->sample.sample.tick - self->change_tick < UINT32_MAX / 2;
    if (past->is_new_load) {
        hexload_load_monitor_init(&self->monitor);
        hexload_momentum_supervisor_forget(&self->supervisor);
        self->is_changing = false;
    }
    if (past->is_new_load || self->is_interrupted || past->sample.gap_ticks > HEXLOAD_LONGEST_STEP_TICKS) {
        past->sample.gap_ticks = 0;
    }
    self->is_interrupted = false;
    return true;
}

void hexload_momentum_frame_end(hexload_momentum_t* self, const hexload_config_t* config,
                                const hexload_leg_sample_t* sample, bool is_finite, momentum_tick_t* tick,
                                hexload_estimate_t* estimate) {
    if (!is_finite) {
        hexload_momentum_filter_init(&self->filter, config);
        hexload_load_monitor_init(&self->monitor);
        hexload_momentum_supervisor_forget(&self->supervisor);
        self->is_interrupted = true;
        hexload_health_set(&tick->health, HEXLOAD_HEALTH_FILTER_RESTARTED);
    }
    hexload_momentum_supervisor_judge(&self->supervisor, config, &self->filter, estimate, &tick->health);
    estimate->tick = sample->tick;
}
