#include "hexload/momentum.h"

#include "health.h"

#include <stddef.h>

/// Ticks before the alarm at which the new load may have been there already: the filter forgets then.
enum { ALARM_DELAY_TICKS = 6 };

/// Estimates of a filter that has just learnt little may be no body for some time.
enum { IMPOSSIBLE_TICKS = 100 };

// The lasting memory of an estimator: 4-byte numbers, or 8-byte ones in the reference build.
_Static_assert(sizeof(hexload_momentum_t) <= (size_t)12 * 1024 * sizeof(hexload_real_t) / sizeof(float) ||
                   HEXLOAD_LAG_TICKS_MAX > 85,
               "an estimator fits in 12 KiB");

hexload_status_t hexload_momentum_init(hexload_momentum_t* self, const hexload_config_t* config) {
    hexload_kinematics_t kinematics;
    hexload_status_t status = hexload_config_check(config, NULL);
    if (status != HEXLOAD_OK) {
        return status;
    }
    status = hexload_kinematics_init(&kinematics, config);
    if (status != HEXLOAD_OK) {
        return status;
    }
    *self = (hexload_momentum_t){.kinematics = kinematics, .past_kinematics = kinematics};
    hexload_leg_sample_init(&self->leg_gate);
    hexload_noise_meter_init(&self->noise_meter);
    hexload_load_monitor_init(&self->monitor);
    hexload_smoother_init(&self->smoother, config);
    hexload_momentum_filter_init(&self->filter, config);
    hexload_load_supervisor_init(&self->supervisor);
    return HEXLOAD_OK;
}

/// The alarm comes at once, and the filter forgets when it reaches the change.
static void watch_load(hexload_momentum_t* self, const hexload_config_t* config,
                       const hexload_sensors_t* sensors, const hexload_leg_sample_t* sample,
                       const hexload_motion_t* motion, uint32_t gap_ticks, uint32_t* health) {
    const bool has_changed = hexload_load_monitor_step(&self->monitor, config, sensors, &self->filter, sample,
                                                       motion, &self->kinematics.jacobian, gap_ticks);
    if (has_changed && !self->is_changing) {
        self->is_changing = true;
        self->change_tick = sample->tick - ALARM_DELAY_TICKS;
        hexload_health_set(health, HEXLOAD_HEALTH_LOAD_CHANGED);
    }
    hexload_load_supervisor_hear(&self->supervisor, config, &self->monitor);
}

/// One sample of lag_ticks ago.
static void filter_past(hexload_momentum_t* self, const hexload_config_t* config,
                        const hexload_sensors_t* sensors) {
    hexload_smooth_sample_t past;
    hexload_motion_t motion;
    if (!hexload_smoother_take(&self->smoother, &past)) {
        return;
    }
    if (hexload_kinematics_solve(&self->past_kinematics, config, &past.sample, &motion) != HEXLOAD_OK) {
        self->is_interrupted = true;
        return;
    }
    if (self->is_changing && past.sample.tick - self->change_tick < UINT32_MAX / 2) {
        hexload_momentum_filter_forget(&self->filter, config);
        hexload_load_monitor_init(&self->monitor);
        hexload_load_supervisor_forget(&self->supervisor);
        past.gap_ticks = 0;
        self->is_changing = false;
    }
    if (self->is_interrupted || past.gap_ticks > HEXLOAD_LONGEST_STEP_TICKS) {
        past.gap_ticks = 0;
    }
    self->is_interrupted = false;
    hexload_momentum_filter_step(&self->filter, config, sensors, &self->smoother.constants, &past, &motion,
                                 &self->past_kinematics.jacobian);
    hexload_load_supervisor_watch(&self->supervisor, config, &self->filter, &motion, past.gap_ticks);
}

/// From nothing, when a number is no longer finite, or when no body has had these parameters for long: an
/// unlucky start has been taken for knowledge.
static void restart_when_lost(hexload_momentum_t* self, const hexload_config_t* config, uint32_t* health) {
    if (!hexload_momentum_filter_is_finite(&self->filter) ||
        self->supervisor.impossible_ticks > IMPOSSIBLE_TICKS) {
        hexload_momentum_filter_init(&self->filter, config);
        hexload_load_monitor_init(&self->monitor);
        hexload_load_supervisor_forget(&self->supervisor);
        self->is_interrupted = true;
        hexload_health_set(health, HEXLOAD_HEALTH_FILTER_RESTARTED);
    }
}

hexload_status_t hexload_momentum_tick(hexload_momentum_t* self, const hexload_config_t* config,
                                       const hexload_leg_sample_t* sample, hexload_estimate_t* estimate) {
    uint32_t health = 0;
    uint32_t gap_ticks = 0;
    hexload_motion_t motion;
    hexload_sensors_t sensors;
    hexload_status_t status = hexload_leg_sample_check(&self->leg_gate, config, sample, &gap_ticks, &health);
    if (status != HEXLOAD_OK) {
        return hexload_health_refuse(&self->health, status);
    }
    status = hexload_kinematics_solve(&self->kinematics, config, sample, &motion);
    if (status != HEXLOAD_OK) {
        return hexload_health_refuse(&self->health, status);
    }
    hexload_leg_sample_accept(&self->leg_gate, sample);

    hexload_noise_meter_step(&self->noise_meter, config, sample, gap_ticks);
    hexload_noise_meter_read(&self->noise_meter, &config->sensors, &sensors, &health);
    watch_load(self, config, &sensors, sample, &motion, gap_ticks, &health);
    if (!hexload_smoother_put(&self->smoother, config, sample, gap_ticks) && gap_ticks > 0) {
        hexload_health_set(&health, HEXLOAD_HEALTH_RATE_RESEEDED);
    }
    filter_past(self, config, &sensors);
    restart_when_lost(self, config, &health);
    hexload_load_supervisor_judge(&self->supervisor, config, &self->filter, estimate, &health);
    estimate->tick = sample->tick;
    hexload_health_count(&self->health, health);
    return HEXLOAD_OK;
}
