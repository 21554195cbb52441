/// @file load_supervisor.h
/// Whether the ten parameters can be believed, and what the motion tells about each.
#ifndef HEXLOAD_LOAD_SUPERVISOR_H
#define HEXLOAD_LOAD_SUPERVISOR_H

#include "hexload/consider.h"
#include "hexload/estimate.h"
#include "hexload/load_monitor.h"

HEXLOAD_DECLS_BEGIN

typedef struct hexload_load_supervisor {
    hexload_real_t nis_mean; ///< of the load monitor, leaky; starts at its ideal, 6
    /// Of the filter, each tick bounded, leaky over a second, also over changes of the load; ideal 6.
    hexload_real_t fit_nis;
    hexload_real_t unfit_s; ///< for so long the machine still counts as one that is not its model
    uint32_t fit_ticks;     ///< in the mean, since the start
    /// Information per tick that the motion gives on each parameter if the others were known, 1 / its unit
    /// squared: leaky mean over excitation_time_constant_s.
    hexload_real_t information[HEXLOAD_LOAD_DIM];
    hexload_real_t acceleration[6]; ///< base axes, of O_A, over ten ticks
    hexload_real_t last_twist[6];   ///< at their end
    uint32_t elapsed_ticks;         ///< since then
    uint32_t next;                  ///< parameter whose information is looked at: one in each tick
} hexload_load_supervisor_t;

void hexload_load_supervisor_init(hexload_load_supervisor_t* self);

/// Takes the innovations of the present: the monitor's, as those of the filter also tell of the smoother.
void hexload_load_supervisor_hear(hexload_load_supervisor_t* self, const hexload_config_t* config,
                                  const hexload_load_monitor_t* monitor);

/// How well the machine has fitted its model of late: by fit_nis, and by config->rig, whose friction has
/// errors that are not noise.
hexload_fit_t hexload_load_supervisor_fit(const hexload_load_supervisor_t* self,
                                          const hexload_config_t* config);

/// The filter has begun anew: innovations of before say nothing any more. What the motion tells stays.
void hexload_load_supervisor_forget(hexload_load_supervisor_t* self);

/// Looks at the motion of one sample of the filter.
/// @param gap_ticks periods since the last; 0: the first.
void hexload_load_supervisor_watch(hexload_load_supervisor_t* self, const hexload_config_t* config,
                                   const hexload_momentum_filter_t* filter, const hexload_motion_t* motion,
                                   uint32_t gap_ticks);

/// Fills in the estimate from the filter and judges it. A parameter that has not converged is converging when
/// the motion of the last excitation_time_constant_s, gone on for as long again, would lower its sigma by a
/// third at least.
/// @param[in,out] health sets NOT_EXCITED, INCONSISTENT. Reentrant, constant time.
void hexload_load_supervisor_judge(hexload_load_supervisor_t* self, const hexload_config_t* config,
                                   const hexload_momentum_filter_t* filter,
                                   const hexload_consider_t* consider, hexload_estimate_t* estimate,
                                   uint32_t* health);

HEXLOAD_DECLS_END

#endif
