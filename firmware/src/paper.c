#include "hexload/paper.h"

#include "configuration/health.h"
#include "front_end/leg_sample.h"
#include "front_end/wrench.h"
#include "paper/paper_filter.h"
#include "paper/paper_supervisor.h"

#include <stddef.h>

// The lasting memory of an estimator: 4-byte numbers, or 8-byte ones in the reference build.
_Static_assert(sizeof(hexload_paper_t) <= 1152 * sizeof(hexload_real_t) / sizeof(float),
               "an estimator fits in 1.125 KiB");

hexload_status_t hexload_paper_init(hexload_paper_t* self, const hexload_config_t* config) {
    hexload_kinematics_t kinematics;
    hexload_status_t status = hexload_config_check(config, NULL);
    if (status != HEXLOAD_OK) {
        return status;
    }
    status = hexload_kinematics_init(&kinematics, config);
    if (status != HEXLOAD_OK) {
        return status;
    }
    *self = (hexload_paper_t){.kinematics = kinematics};
    hexload_leg_sample_init(&self->leg_gate);
    hexload_paper_filter_init(&self->filter, config);
    hexload_paper_supervisor_init(&self->supervisor);
    return HEXLOAD_OK;
}

hexload_status_t hexload_paper_trace(hexload_paper_t* self, const hexload_config_t* config,
                                     const hexload_leg_sample_t* sample, hexload_estimate_t* estimate,
                                     hexload_trace_t* trace) {
    uint32_t health = 0;
    hexload_motion_t motion;
    hexload_wrench_t wrench;
    hexload_present_tick_t now = {.sample = sample, .motion = &motion, .sensors = config->sensors};
    hexload_status_t status =
        hexload_leg_sample_check(&self->leg_gate, config, sample, &now.gap_ticks, &health);
    if (status != HEXLOAD_OK) {
        return hexload_health_refuse(&self->health, status);
    }
    status = hexload_kinematics_solve(&self->kinematics, config, sample, &motion);
    if (status != HEXLOAD_OK) {
        return hexload_health_refuse(&self->health, status);
    }
    hexload_leg_sample_accept(&self->leg_gate, sample);
    if (trace != NULL) {
        *trace = (hexload_trace_t){.tick = sample->tick, .dimension = 3};
    }

    hexload_wrench_compute(&motion, sample, &wrench);
    hexload_paper_filter_step(&self->filter, config, &now, &wrench, &health, trace);
    hexload_paper_supervisor_judge(&self->supervisor, config, &self->filter, estimate, &health);
    estimate->tick = sample->tick;
    hexload_health_count(&self->health, health);
    return HEXLOAD_OK;
}

hexload_status_t hexload_paper_tick(hexload_paper_t* self, const hexload_config_t* config,
                                    const hexload_leg_sample_t* sample, hexload_estimate_t* estimate) {
    return hexload_paper_trace(self, config, sample, estimate, NULL);
}
