/// @file paper_tick.h
/// The tick of the paper's estimator, in the paper's order. Internal.
///
///     leg sample -> motion -> do channels contradict each other? -> wrench -> filter -> weight -> verdict
///
/// Inline, so that a tick without a trace holds nothing of it: `trace` is NULL there at compile time.
#ifndef HEXLOAD_PAPER_TICK_H
#define HEXLOAD_PAPER_TICK_H

#include "configuration/health.h"
#include "front_end/leg_sample.h"
#include "front_end/lost_channels.h"
#include "front_end/noise_estimator.h"
#include "front_end/plausibility.h"
#include "front_end/residual_test.h"
#include "front_end/wrench.h"
#include "hexload/paper.h"
#include "paper/hum_test.h"
#include "paper/known_mass.h"
#include "paper/paper_filter.h"
#include "paper/paper_supervisor.h"

#include <stddef.h>

/// The measurement update that is about to be made; its gate is seen afterwards.
static inline void hexload_paper_write_trace(const hexload_paper_filter_t* filter,
                                             const hexload_paper_step_t* step, hexload_trace_t* trace) {
    trace->gate = step->is_predicted ? HEXLOAD_GATE_ACCEPTED : HEXLOAD_GATE_NONE;
    for (int i = 0; i < 3 && step->is_predicted; i++) {
        trace->innovation[i] = step->rate_rad_s[i] - filter->rate_rad_s[i];
        trace->variance[i] = filter->rate_cov[i][i] + step->noise[i][i];
    }
}

#define HEXLOAD_PAPER_NEVER_TICKS (UINT32_MAX / 2) ///< longer than any gap

/// A sample that lacks a force tells nothing of the torque: the filter waits, and goes on as after a gap.
static inline bool hexload_paper_has_torque(hexload_paper_t* self, hexload_present_tick_t* now) {
    const bool has_begun = now->gap_ticks > 0;
    const uint32_t held_ticks =
        self->held_ticks < HEXLOAD_PAPER_NEVER_TICKS ? self->held_ticks : HEXLOAD_PAPER_NEVER_TICKS;
    if (hexload_lost_channels_lack_force(&now->lost)) {
        self->held_ticks = has_begun ? held_ticks + now->gap_ticks : HEXLOAD_PAPER_NEVER_TICKS;
        self->filter.nis =
            (hexload_real_t)HEXLOAD_PAPER_MEASUREMENTS; // no innovation: the last one counts once
        return false;
    }
    now->gap_ticks += held_ticks;
    self->held_ticks = 0;
    return true;
}

/// Filter and scales.
static inline void hexload_paper_identify(hexload_paper_t* self, const hexload_config_t* config,
                                          hexload_present_tick_t* now, hexload_trace_t* trace,
                                          uint32_t* health) {
    hexload_wrench_t wrench;
    hexload_paper_step_t step;
    if (!hexload_paper_has_torque(self, now)) {
        return;
    }
    hexload_wrench_compute(now->motion, now->sample, &wrench);
    hexload_paper_filter_predict(&self->filter, config, now, &wrench, &step, health);
    if (trace != NULL) {
        hexload_paper_write_trace(&self->filter, &step, trace);
    }
    hexload_paper_filter_correct(&self->filter, config, now, &wrench, &step, health);
    if (step.is_used) {
        hexload_residual_test_step(&self->residual_test, config, step.whitened, false);
        hexload_hum_test_step(&self->hum_test, now->gap_ticks, step.whitened);
    }
    hexload_known_mass_step(&self->known_mass, config, now, &wrench);
}

/// The factor by which the filter's sigmas are too small for what lasts and what hums in its innovations.
static inline hexload_real_t hexload_paper_mismatch(const hexload_paper_t* self) {
    const hexload_real_t factor = self->residual_test.factor;
    return self->hum_test.hums ? hexload_sqrt(hexload_fma(factor, factor, self->hum_test.energy)) : factor;
}

static inline hexload_status_t hexload_paper_run(hexload_paper_t* self, const hexload_config_t* config,
                                                 const hexload_leg_sample_t* raw,
                                                 hexload_estimate_t* estimate, hexload_trace_t* trace) {
    uint32_t health = 0;
    hexload_leg_sample_t mended;
    hexload_motion_t motion;
    hexload_present_tick_t now = {
        .motion = &motion, .sensors = config->sensors, .noise = &self->noise_estimator};
    const hexload_leg_sample_t* sample =
        hexload_lost_channels_mend(&self->lost, config, &self->leg_gate, raw, &mended, &now.lost, &health);
    hexload_status_t status =
        hexload_leg_sample_check(&self->leg_gate, config, sample, &now.gap_ticks, &health);
    if (status == HEXLOAD_OK) {
        status = hexload_kinematics_solve(&self->kinematics, config, sample, &motion);
    }
    if (status != HEXLOAD_OK) {
        return hexload_health_refuse(&self->health, status);
    }
    now.sample = sample;
    hexload_leg_sample_accept(&self->leg_gate, sample);
    self->lost = now.lost;
    if (config->sensors.half_window_ticks == 0) { // else it has seen the samples before their filter
        hexload_noise_estimator_step(&self->noise_estimator, config, sample, now.gap_ticks);
    }
    hexload_noise_estimator_read(&self->noise_estimator, config, &now.sensors, &health);
    // With its gaps: a value that is missing keeps its half second from saying anything.
    hexload_plausibility_step(&self->plausibility, config, raw, &now, config->rig.velocity_delay_s);
    hexload_paper_identify(self, config, &now, trace, &health);
    health |=
        hexload_paper_supervisor_judge(&self->supervisor, config, &self->filter, hexload_paper_mismatch(self),
                                       self->known_mass.weight_error, estimate);
    hexload_plausibility_judge(&self->plausibility, HEXLOAD_PAPER_DIM, estimate, &self->health.input,
                               &health);
    hexload_known_mass_judge(&self->known_mass, estimate, &self->health.input, &health);
    estimate->tick = sample->tick;
    hexload_health_count(&self->health, health);
    return HEXLOAD_OK;
}

#endif
