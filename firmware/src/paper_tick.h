/// @file paper_tick.h
/// The tick of the paper's estimator, in the paper's order. Internal.
///
///     leg sample -> motion -> wrench -> filter -> verdict
///
/// Inline, so that a tick without a trace holds nothing of it: `trace` is NULL there at compile time.
#ifndef HEXLOAD_PAPER_TICK_H
#define HEXLOAD_PAPER_TICK_H

#include "configuration/health.h"
#include "front_end/leg_sample.h"
#include "front_end/plausibility.h"
#include "front_end/wrench.h"
#include "hexload/paper.h"
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

static inline hexload_status_t hexload_paper_run(hexload_paper_t* self, const hexload_config_t* config,
                                                 const hexload_leg_sample_t* sample,
                                                 hexload_estimate_t* estimate, hexload_trace_t* trace) {
    uint32_t health = 0;
    hexload_motion_t motion;
    hexload_wrench_t wrench;
    hexload_paper_step_t step;
    hexload_present_tick_t now = {.sample = sample, .motion = &motion, .sensors = config->sensors};
    hexload_status_t status =
        hexload_leg_sample_check(&self->leg_gate, config, sample, &now.gap_ticks, &health);
    if (status == HEXLOAD_OK) {
        status = hexload_kinematics_solve(&self->kinematics, config, sample, &motion);
    }
    if (status != HEXLOAD_OK) {
        return hexload_health_refuse(&self->health, status);
    }
    hexload_leg_sample_accept(&self->leg_gate, sample);
    hexload_plausibility_step(&self->plausibility, config, sample, &now, config->rig.velocity_delay_s);
    hexload_known_mass_step(&self->known_mass, config, &now);

    hexload_wrench_compute(&motion, sample, &wrench);
    hexload_paper_filter_predict(&self->filter, config, &now, &wrench, &step, &health);
    if (trace != NULL) {
        hexload_paper_write_trace(&self->filter, &step, trace);
    }
    hexload_paper_filter_correct(&self->filter, config, &now, &wrench, &step, &health);
    hexload_paper_supervisor_judge(&self->supervisor, config, &self->filter, estimate, &health);
    hexload_plausibility_judge(&self->plausibility, HEXLOAD_PAPER_DIM, estimate, &self->health.input,
                               &health);
    hexload_known_mass_judge(&self->known_mass, estimate, &self->health.input, &health);
    estimate->tick = sample->tick;
    hexload_health_count(&self->health, health);
    return HEXLOAD_OK;
}

#endif
