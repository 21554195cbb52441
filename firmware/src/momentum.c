#include "hexload/momentum.h"

#include "health.h"
#include "momentum_frame.h"

#include <stddef.h>

// The lasting memory of an estimator: 4-byte numbers, or 8-byte ones in the reference build.
_Static_assert(sizeof(hexload_momentum_t) <= (size_t)15 * 1024 * sizeof(hexload_real_t) / sizeof(float) ||
                   HEXLOAD_LAG_TICKS_MAX > 82,
               "an estimator fits in 15 KiB");

HEXLOAD_RARE hexload_status_t hexload_momentum_init(hexload_momentum_t* self,
                                                    const hexload_config_t* config) {
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
    hexload_rig_history_init(&self->history);
    hexload_rig_twists_init(&self->twists);
    hexload_rig_slide_init(&self->slide);
    hexload_noise_meter_init(&self->noise_meter);
    hexload_load_monitor_init(&self->monitor);
    hexload_smoother_init(&self->smoother, config);
    hexload_momentum_filter_init(&self->filter, config);
    hexload_consider_init(&self->consider);
    hexload_load_supervisor_init(&self->supervisor);
    return HEXLOAD_OK;
}

/// One sample of lag_ticks ago.
static void filter_past(hexload_momentum_t* self, const hexload_config_t* config, momentum_tick_t* tick) {
    momentum_past_t past;
    if (!momentum_frame_take(self, config, tick, &past)) {
        return;
    }
    if (past.is_new_load) {
        hexload_momentum_filter_forget(&self->filter, config);
    }
    hexload_consider_step(&self->consider, &self->filter, config, &tick->sensors, &self->smoother.constants,
                          &past.sample, &past.motion, &self->past_kinematics.jacobian);
    hexload_load_supervisor_watch(&self->supervisor, config, &self->filter, &past.motion,
                                  past.sample.gap_ticks);
}

hexload_status_t hexload_momentum_tick(hexload_momentum_t* self, const hexload_config_t* config,
                                       const hexload_leg_sample_t* sample, hexload_estimate_t* estimate) {
    momentum_tick_t tick;
    const hexload_status_t status = momentum_frame_begin(self, config, sample, &tick);
    if (status != HEXLOAD_OK) {
        return status;
    }
    momentum_frame_watch(self, config, &tick.sample, &tick.sensors, &tick);
    filter_past(self, config, &tick);
    momentum_frame_end(self, config, sample, hexload_momentum_filter_is_finite(&self->filter), &tick,
                       estimate);
    hexload_health_count(&self->health, tick.health);
    return HEXLOAD_OK;
}
