/// @file momentum_tick.h
/// The tick of the momentum estimator, on one screen. Internal.
///
///     channels of one instant -> pose -> do channels contradict each other? -> load monitor -> smooth motion
///     of lag_ticks ago -> forces without the rig's own -> filter -> verdict
///
/// Inline, so that an estimator without a stage for actuator effects, or a tick without a trace, holds and
/// links nothing of either: `effects` and `update` are NULL there at compile time.
#ifndef HEXLOAD_MOMENTUM_TICK_H
#define HEXLOAD_MOMENTUM_TICK_H

#include "actuator_effects/actuator_effects.h"
#include "actuator_effects/gain_errors.h"
#include "actuator_effects/identifiability.h"
#include "algebra/leg_blocks.h"
#include "configuration/health.h"
#include "front_end/leg_sample.h"
#include "front_end/lost_channels.h"
#include "front_end/noise_estimator.h"
#include "front_end/plausibility.h"
#include "front_end/residual_test.h"
#include "hexload/momentum.h"
#include "momentum/attenuation.h"
#include "momentum/consider.h"
#include "momentum/frozen_channels.h"
#include "momentum/jackknife.h"
#include "momentum/load_monitor.h"
#include "momentum/loose_plug.h"
#include "momentum/momentum_filter.h"
#include "momentum/momentum_supervisor.h"
#include "momentum/oscillation_test.h"
#include "momentum/smoother.h"
#include "momentum/tolerances.h"
#include "rig/rig.h"

#include <stddef.h>
#include <string.h>

/// What the present tick points to.
typedef struct hexload_present_memory {
    hexload_leg_sample_t mended;  ///< without gaps, where there were any
    hexload_leg_sample_t aligned; ///< all channels of one instant, without the rig's offsets and gains
    hexload_motion_t motion;      ///< there
} hexload_present_memory_t;

/// Closes gaps of the sample, a jump being one, and checks it, brings its channels to one instant, finds pose
/// and twist there and the effective sigmas.
/// @param[out] now its sample is NULL while late channels leave no instant complete.
static inline hexload_status_t read_present(hexload_momentum_t* self, const hexload_config_t* config,
                                            const hexload_leg_sample_t* raw, hexload_present_memory_t* memory,
                                            hexload_present_tick_t* now, uint32_t* health) {
    uint32_t gap_ticks = 0;
    bool has_instant = false;
    const hexload_leg_sample_t* sample = hexload_lost_channels_mend(&self->lost, config, &self->leg_gate, raw,
                                                                    &memory->mended, &now->lost, health);
    sample = hexload_loose_plug_bridge(&self->lost, config, &self->leg_gate, sample, &memory->mended,
                                       &now->lost, health);
    hexload_status_t status = hexload_leg_sample_check(&self->leg_gate, config, sample, &gap_ticks, health);
    if (status == HEXLOAD_OK) {
        has_instant =
            hexload_rig_align(&self->history, config, sample, gap_ticks, &memory->aligned, &now->gap_ticks);
    }
    if (has_instant) {
        status = hexload_kinematics_solve(&self->kinematics, config, &memory->aligned, &memory->motion);
    }
    if (status != HEXLOAD_OK) {
        return hexload_health_refuse(&self->health, status);
    }
    now->sample = has_instant ? &memory->aligned : NULL;
    now->motion = &memory->motion;
    hexload_leg_sample_accept(&self->leg_gate, sample);
    self->lost = now->lost;
    hexload_rig_history_store(&self->history, sample, gap_ticks, has_instant);
    if (config->sensors.half_window_ticks == 0) { // else it has seen the samples before their filter
        hexload_noise_estimator_step(&self->noise_estimator, config, sample, gap_ticks);
    }
    hexload_noise_estimator_read(&self->noise_estimator, config, &now->sensors, health);
    now->noise = &self->noise_estimator;
    return HEXLOAD_OK;
}

/// A known mass that is wrong is no fault of the machine: until a first change it may be that.
static inline hexload_fit_t fit_of(const hexload_momentum_t* self, const hexload_config_t* config,
                                   const hexload_real_t velocity_m_s[HEXLOAD_LEGS]) {
    const bool is_moving = hexload_is_moving(velocity_m_s);
    const hexload_fit_t fit = hexload_momentum_supervisor_fit(&self->supervisor, config, is_moving);
    return fit != HEXLOAD_FIT_FRICTION && self->is_mass_known && !self->is_changing ? HEXLOAD_FIT_NOISE : fit;
}

/// Is it still the same load? Reported at once; the filter forgets when it reaches the change.
static inline void watch_load(hexload_momentum_t* self, const hexload_config_t* config,
                              hexload_effects_stage_t* effects, const hexload_present_tick_t* now,
                              uint32_t* health) {
    hexload_present_tick_t without_effects;
    hexload_leg_sample_t clean;
    const hexload_present_tick_t* seen = now;
    if (!hexload_momentum_filter_has_begun(&self->filter)) {
        return;
    }
    if (effects != NULL) {
        without_effects = *now;
        clean = *now->sample;
        without_effects.sample = &clean;
        hexload_actuator_effects_clean(&effects->filter, &self->filter, config, now->motion, &clean,
                                       &without_effects.sensors);
        seen = &without_effects;
    }
    const hexload_fit_t fit = fit_of(self, config, now->sample->velocity_m_s);
    const hexload_real_t scale = hexload_jackknife_variance_scale(&self->jackknife);
    const bool is_alarm = hexload_load_monitor_step(&self->monitor, config, &self->filter, scale, fit, seen);
    // a change that is known already is not held against the legs again, nor one where a pose takes longer
    const bool is_held_against_legs = !self->is_changing && (seen->motion->newton_steps <= 2U);
    const bool is_weight = is_alarm && hexload_load_monitor_is_weight(&self->monitor, config, fit) &&
                           !(is_held_against_legs &&
                             hexload_load_monitor_is_one_leg(&self->monitor, config, &self->filter, seen));
    const bool is_mismatch =
        (fit == HEXLOAD_FIT_UNPROVEN || !is_weight) && hexload_load_monitor_is_late(&self->monitor);
    const bool is_of_sensors = hexload_frozen_channels_are_there(&self->frozen) ||
                               hexload_plausibility_is_wiring(&self->plausibility);
    if (is_alarm && (is_mismatch || is_of_sensors)) {
        hexload_momentum_supervisor_doubt(&self->supervisor);
    } else if (is_weight && !self->is_changing) {
        self->is_changing = true;
        // The first sample that is certainly the new load's: one of before would be taken for it. Half a
        // window later where there are no velocity sensors: until then a sample has something of both.
        self->change_tick = now->sample->tick + config->sensors.half_window_ticks;
        hexload_momentum_supervisor_alarm(&self->supervisor);
        hexload_health_set(health, HEXLOAD_HEALTH_LOAD_CHANGED);
        if (effects != NULL) {
            hexload_actuator_effects_hold(&effects->filter, config);
        }
    }
    hexload_momentum_supervisor_hear(&self->supervisor, config, &self->monitor);
}

/// The first sample after a load change reaches the filter. The actuators stay as they are known; but their
/// biases have taken what a wrong known mass weighs too much, and a first change may be just that coming out.
static inline void forget_load(hexload_momentum_t* self, const hexload_config_t* config,
                               hexload_effects_stage_t* effects) {
    hexload_load_monitor_restart(&self->monitor);
    hexload_residual_test_init(&self->residual_test, HEXLOAD_MOMENTUM_MEASUREMENTS);
    hexload_oscillation_test_init(&self->oscillation);
    hexload_momentum_supervisor_forget(&self->supervisor);
    hexload_momentum_filter_forget(&self->filter, config);
    hexload_jackknife_forget(&self->jackknife);
    if (effects != NULL) {
        if (self->is_mass_known) {
            hexload_actuator_effects_init(&effects->filter, config);
            hexload_actuator_effects_hold(&effects->filter, config);
        } else {
            hexload_actuator_effects_forget(&effects->filter);
        }
    }
    self->is_mass_known = false;
    self->is_changing = false;
}

/// Velocities that come at a lower rate are late by half of their period.
static inline void watch_rate(hexload_momentum_t* self) {
    if (hexload_frozen_channels_are_held(&self->frozen)) {
        hexload_momentum_supervisor_doubt(&self->supervisor);
    }
}

/// Takes off what the rig's own parameters make of a sample of the past.
static inline void take_off_rig(hexload_momentum_t* self, const hexload_config_t* config,
                                hexload_delayed_tick_t* past) {
    hexload_smooth_sample_t* smooth = &past->smooth;
    hexload_real_t twist[6];
    hexload_real_t acceleration[6];
    hexload_rig_compensate(&self->slide, config, smooth->smooth_velocity_m_s, smooth->gap_ticks,
                           smooth->sample.force_n, smooth->force_variance_n2);
    hexload_lost_channels_doubt(&self->lost, smooth->sample.force_n, smooth->force_variance_n2);
    if (!hexload_rig_has_leg_mass(config)) {
        return; // leg_wrench is the smoother's zero
    }
    hexload_leg_blocks_solve(past->motion.jacobian, smooth->smooth_velocity_m_s, twist);
    hexload_rig_accelerate(&self->twists, config, twist, smooth->gap_ticks, acceleration);
    hexload_rig_leg_wrench(config, &smooth->sample, &past->motion, twist, acceleration, smooth->leg_wrench);
}

/// Puts the sample into the smoother and takes that of lag_ticks ago out, with the motion there.
/// @return false when there is none.
static inline bool take_delayed(hexload_momentum_t* self, const hexload_config_t* config,
                                const hexload_present_tick_t* now, hexload_delayed_tick_t* past,
                                uint32_t* health) {
    if (!hexload_smoother_put(&self->smoother, config, now) && now->gap_ticks > 0) {
        hexload_health_set(health, HEXLOAD_HEALTH_RATE_RESEEDED);
    }
    if (!hexload_smoother_take(&self->smoother, &now->sensors, &past->smooth)) {
        return false;
    }
    if (hexload_kinematics_solve(&self->delayed_kinematics, config, &past->smooth.sample, &past->motion) !=
        HEXLOAD_OK) {
        self->is_interrupted = true;
        return false;
    }
    past->sensors = &now->sensors;
    past->smoother = &self->smoother.constants;
    take_off_rig(self, config, past);
    return true;
}

/// Whether the sample is the first after a load change, or of a motion of which mu knows nothing: then mu
/// begins anew.
static inline void join(hexload_momentum_t* self, const hexload_config_t* config,
                        hexload_effects_stage_t* effects, hexload_smooth_sample_t* smooth) {
    const bool is_new_load = self->is_changing && smooth->sample.tick - self->change_tick < UINT32_MAX / 2;
    if (is_new_load) {
        forget_load(self, config, effects);
    }
    if (is_new_load || self->is_interrupted || smooth->gap_ticks > HEXLOAD_LONGEST_STEP_TICKS) {
        smooth->gap_ticks = 0;
    }
    self->is_interrupted = false;
}

/// With open constants only what they do not do counts.
static inline void test_residual(hexload_momentum_t* self, const hexload_config_t* config,
                                 const hexload_real_t whitened[6]) {
    const bool is_open = config->rig.direction_count > 0;
    if (is_open && hexload_residual_test_ends(&self->residual_test, config)) {
        hexload_oscillation_test_step(&self->oscillation, &self->consider, &self->residual_test, whitened);
    }
    hexload_residual_test_step(&self->residual_test, config, whitened,
                               is_open && !self->oscillation.is_there);
}

static inline void filter(hexload_momentum_t* self, const hexload_config_t* config,
                          hexload_effects_stage_t* effects, hexload_delayed_tick_t* past,
                          hexload_momentum_update_t* update) {
    hexload_momentum_update_t own;
    hexload_momentum_update_t* left = update != NULL ? update : &own;
    const bool is_measured = past->smooth.gap_ticks > 0;
    if (effects == NULL) {
        hexload_consider_step(&self->consider, &self->filter, config, past, left);
    } else if (!hexload_actuator_effects_step(&effects->filter, &self->filter, &self->consider, config, past,
                                              left)) {
        self->is_interrupted = true;
        past->smooth.gap_ticks = 1; // at rest, time goes on
    }
    if (is_measured && !self->is_interrupted) {
        test_residual(self, config, left->innovation);
    }
    hexload_momentum_supervisor_watch(&self->supervisor, config, &self->filter, &self->jackknife,
                                      &self->residual_test, past);
    if (effects != NULL) {
        if (hexload_actuator_effects_drive(&effects->filter, config)) {
            hexload_momentum_supervisor_doubt(&self->supervisor);
        }
        if (!self->is_interrupted) { // at rest the filter takes no forces
            hexload_gain_errors_step(&effects->filter.gains, past);
        }
        hexload_identifiability_step(&effects->identifiability, config, &self->filter, &effects->filter,
                                     &past->smooth);
    }
}

/// Work that can wait does so in a tick whose poses have taken more steps than those of the tick before.
static inline void compare_blocks(hexload_momentum_t* self, const hexload_config_t* config,
                                  uint32_t newton_steps) {
    if (newton_steps <= self->newton_steps) {
        hexload_jackknife_step(&self->jackknife, config, &self->filter);
    }
    self->newton_steps = (uint8_t)newton_steps;
}

/// Nothing is known of the effects. After the filter has begun.
static inline void begin_effects(hexload_momentum_t* self, const hexload_config_t* config,
                                 hexload_effects_stage_t* effects) {
    hexload_actuator_effects_init(&effects->filter, config);
    hexload_identifiability_init(&effects->identifiability);
    hexload_tolerances_add_legs(&self->filter.tolerances, config->actuator_effects.leg_share);
}

/// After a number that is not finite, or samples that have come again: everything begins from nothing.
static inline void restart(hexload_momentum_t* self, const hexload_config_t* config,
                           hexload_effects_stage_t* effects, uint32_t* health) {
    hexload_momentum_filter_init(&self->filter, config);
    if (!self->is_mass_known) { // that of another load may not come back
        hexload_momentum_filter_forget(&self->filter, config);
    }
    hexload_consider_init(&self->consider);
    hexload_jackknife_init(&self->jackknife);
    hexload_load_monitor_init(&self->monitor);
    hexload_residual_test_init(&self->residual_test, HEXLOAD_MOMENTUM_MEASUREMENTS);
    hexload_oscillation_test_init(&self->oscillation);
    hexload_momentum_supervisor_forget(&self->supervisor);
    if (effects != NULL) {
        begin_effects(self, config, effects);
    }
    self->is_interrupted = true;
    hexload_health_set(health, HEXLOAD_HEALTH_FILTER_RESTARTED);
}

/// Do the channels contradict each other? With the sample's gaps: a value that is missing keeps its half
/// second from saying anything. Where samples have come again the platform did not stand where they say: what
/// the filter has made of them goes when the source has been in order for a while.
static inline void watch_input(hexload_momentum_t* self, const hexload_config_t* config,
                               hexload_effects_stage_t* effects, const hexload_leg_sample_t* sample,
                               const hexload_present_tick_t* now, uint32_t* health) {
    const bool had_repeats = hexload_plausibility_has_repeats(&self->plausibility);
    hexload_plausibility_step(&self->plausibility, config, sample, now, HEXLOAD_REAL(0.0));
    if (had_repeats && !hexload_plausibility_has_repeats(&self->plausibility)) {
        restart(self, config, effects, health);
    }
}

/// The filter's values and sigmas, and these widened by what its model leaves out: by what varies and by what
/// is open of the rig's constants. The supervisor adds what no motion tells.
static inline void read_load(const hexload_momentum_t* self, const hexload_config_t* config,
                             const hexload_effects_stage_t* effects, hexload_estimate_t* estimate) {
    hexload_momentum_filter_read(&self->filter, estimate->value, estimate->own_sigma);
    memcpy(estimate->sigma, estimate->own_sigma, sizeof estimate->sigma);
    const bool is_open = config->rig.direction_count > 0;
    hexload_jackknife_widen(&self->jackknife, hexload_residual_test_factor(&self->residual_test, is_open),
                            estimate->sigma);
    if (effects != NULL) {
        hexload_gain_errors_widen(&effects->filter.gains, config, self, effects->identifiability.bias_mask,
                                  estimate->sigma);
    }
    const hexload_real_t dispersion = effects != NULL ? effects->filter.dispersion : HEXLOAD_REAL(1.0);
    hexload_consider_widen(&self->consider, config, dispersion, estimate->sigma);
}

/// @param[out] update of the filter. NULL: not wanted.
static inline hexload_status_t hexload_momentum_run(hexload_momentum_t* self, const hexload_config_t* config,
                                                    hexload_effects_stage_t* effects,
                                                    const hexload_leg_sample_t* sample,
                                                    hexload_estimate_t* estimate,
                                                    hexload_momentum_update_t* update) {
    uint32_t health = 0;
    hexload_present_memory_t memory;
    hexload_present_tick_t now = {.sample = NULL};
    hexload_delayed_tick_t past;
    const hexload_status_t status = read_present(self, config, sample, &memory, &now, &health);
    if (status != HEXLOAD_OK) {
        return status;
    }
    hexload_frozen_channels_step(&self->frozen, config, sample);
    watch_input(self, config, effects, sample, &now, &health);
    if (effects != NULL) { // they would take up what velocities at a lower rate leave
        watch_rate(self);
    }
    if (now.sample != NULL) {
        watch_load(self, config, effects, &now, &health);
    }
    if (now.sample != NULL && take_delayed(self, config, &now, &past, &health)) {
        join(self, config, effects, &past.smooth);
        filter(self, config, effects, &past, update);
        compare_blocks(self, config, now.motion->newton_steps + past.motion.newton_steps);
        hexload_attenuation_step(self, config, &past);
    }
    bool is_finite = hexload_momentum_filter_is_finite(&self->filter);
    if (effects != NULL) {
        is_finite = is_finite && hexload_actuator_effects_is_finite(&effects->filter);
    }
    if (!is_finite) {
        restart(self, config, effects, &health);
    }
    read_load(self, config, effects, estimate);
    health |= hexload_momentum_supervisor_judge(&self->supervisor, config, &self->filter, &self->jackknife,
                                                &self->residual_test, estimate);
    if (effects != NULL) {
        hexload_identifiability_judge(&effects->identifiability, estimate, &health);
    }
    hexload_momentum_supervisor_hold_back(&self->supervisor, &self->jackknife, estimate);
    hexload_plausibility_judge(&self->plausibility, HEXLOAD_LOAD_DIM, estimate, &self->health.input, &health);
    memcpy(self->sigma, estimate->sigma, sizeof self->sigma);
    estimate->tick = sample->tick;
    hexload_health_count(&self->health, health);
    return HEXLOAD_OK;
}

#endif
