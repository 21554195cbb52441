#include "momentum_frame.h"

#include "health.h"
#include "leg_blocks.h"
#include "momentum_prior.h"

/// Ticks before the alarm at which the new load may have been there already: the filter forgets then.
enum { ALARM_DELAY_TICKS = 6 };

hexload_status_t momentum_frame_begin(hexload_momentum_t* self, const hexload_config_t* config,
                                      const hexload_leg_sample_t* sample, momentum_tick_t* tick) {
    uint32_t gap_ticks = 0;
    tick->health = 0;
    tick->gap_ticks = 0;
    hexload_status_t status =
        hexload_leg_sample_check(&self->leg_gate, config, sample, &gap_ticks, &tick->health);
    if (status != HEXLOAD_OK) {
        return hexload_health_refuse(&self->health, status);
    }
    tick->is_aligned =
        hexload_rig_align(&self->history, config, sample, gap_ticks, &tick->sample, &tick->gap_ticks);
    if (tick->is_aligned) {
        status = hexload_kinematics_solve(&self->kinematics, config, &tick->sample, &tick->motion);
    }
    if (status != HEXLOAD_OK) {
        return hexload_health_refuse(&self->health, status);
    }
    hexload_leg_sample_accept(&self->leg_gate, sample);
    hexload_rig_history_store(&self->history, sample, gap_ticks, tick->is_aligned);

    hexload_noise_meter_step(&self->noise_meter, config, sample, gap_ticks);
    hexload_noise_meter_read(&self->noise_meter, &config->sensors, &tick->sensors, &tick->health);
    return HEXLOAD_OK;
}

/// A mass that was told wrong is no fault of the machine: until a first change it may be that.
static hexload_fit_t fit_of(const hexload_momentum_t* self, const hexload_config_t* config) {
    const hexload_fit_t fit = hexload_load_supervisor_fit(&self->supervisor, config);
    const bool was_told = config->momentum.prior_mass_sigma_kg < momentum_open_mass_sigma_kg(config);
    const bool is_first = self->health.count[HEXLOAD_HEALTH_LOAD_CHANGED] == 0;
    return fit == HEXLOAD_FIT_NONE && was_told && is_first ? HEXLOAD_FIT_NOISE : fit;
}

void momentum_frame_watch(hexload_momentum_t* self, const hexload_config_t* config,
                          const hexload_leg_sample_t* sample, const hexload_sensors_t* sensors,
                          momentum_tick_t* tick) {
    if (!tick->is_aligned || !hexload_momentum_filter_has_begun(&self->filter)) {
        return;
    }
    const bool has_changed =
        hexload_load_monitor_step(&self->monitor, config, sensors, &self->filter, sample, &tick->motion,
                                  &self->kinematics.jacobian, fit_of(self, config), tick->gap_ticks);
    if (has_changed && !self->is_changing) {
        self->is_changing = true;
        self->change_tick = sample->tick - ALARM_DELAY_TICKS;
        hexload_health_set(&tick->health, HEXLOAD_HEALTH_LOAD_CHANGED);
    }
    hexload_load_supervisor_hear(&self->supervisor, config, &self->monitor);
}

/// What the rig's own parameters make of a sample of the past.
static void take_off_rig(hexload_momentum_t* self, const hexload_config_t* config, momentum_past_t* past) {
    hexload_smooth_sample_t* sample = &past->sample;
    hexload_real_t twist[6];
    hexload_real_t acceleration[6];
    hexload_rig_compensate(&self->slide, config, sample->smooth_velocity_m_s, sample->gap_ticks,
                           sample->sample.force_n, sample->force_variance_n2);
    leg_blocks_solve(&self->past_kinematics.jacobian, sample->smooth_velocity_m_s, twist);
    hexload_rig_accelerate(&self->twists, config, twist, sample->gap_ticks, acceleration);
    hexload_rig_leg_wrench(config, &sample->sample, &past->motion, twist, acceleration, sample->leg_wrench);
}

bool momentum_frame_take(hexload_momentum_t* self, const hexload_config_t* config, momentum_tick_t* tick,
                         momentum_past_t* past) {
    if (!tick->is_aligned) {
        return false;
    }
    if (!hexload_smoother_put(&self->smoother, config, &tick->sample, tick->gap_ticks) &&
        tick->gap_ticks > 0) {
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
    take_off_rig(self, config, past);
    past->is_new_load = self->is_changing && past->sample.sample.tick - self->change_tick < UINT32_MAX / 2;
    if (past->is_new_load) {
        hexload_load_monitor_restart(&self->monitor);
        hexload_load_supervisor_forget(&self->supervisor);
        self->is_changing = false;
    }
    if (past->is_new_load || self->is_interrupted || past->sample.gap_ticks > HEXLOAD_LONGEST_STEP_TICKS) {
        past->sample.gap_ticks = 0;
    }
    self->is_interrupted = false;
    return true;
}

void momentum_frame_end(hexload_momentum_t* self, const hexload_config_t* config,
                        const hexload_leg_sample_t* sample, bool is_finite, momentum_tick_t* tick,
                        hexload_estimate_t* estimate) {
    if (!is_finite) {
        hexload_momentum_filter_init(&self->filter, config);
        hexload_consider_init(&self->consider);
        hexload_load_monitor_init(&self->monitor);
        hexload_load_supervisor_forget(&self->supervisor);
        self->is_interrupted = true;
        hexload_health_set(&tick->health, HEXLOAD_HEALTH_FILTER_RESTARTED);
    }
    hexload_load_supervisor_judge(&self->supervisor, config, &self->filter, &self->consider, estimate,
                                  &tick->health);
    estimate->tick = sample->tick;
}
