/// @file momentum_supervisor.h
/// Whether the ten parameters can be believed, and what the motion tells about each.
#ifndef HEXLOAD_MOMENTUM_SUPERVISOR_H
#define HEXLOAD_MOMENTUM_SUPERVISOR_H

#include "hexload/estimate.h"
#include "hexload/load_monitor.h"

HEXLOAD_DECLS_BEGIN

typedef struct hexload_momentum_supervisor {
    hexload_real_t nis_mean; ///< of the load monitor, leaky; starts at its ideal, 6
    /// Information per tick that the motion gives on each parameter if the others were known, 1 / its unit
    /// squared: leaky mean over excitation_time_constant_s.
    hexload_real_t information[HEXLOAD_LOAD_DIM];
    hexload_real_t acceleration[6]; ///< base axes, of O_A, over ten ticks
    hexload_real_t last_twist[6];   ///< at their end
    uint32_t elapsed_ticks;         ///< since then
    uint32_t next;                  ///< parameter whose information is looked at: one in each tick
} hexload_momentum_supervisor_t;

void hexload_momentum_supervisor_init(hexload_momentum_supervisor_t* self);

/// Takes the innovations of the present: the monitor's, as those of the filter also tell of the smoother.
void hexload_momentum_supervisor_hear(hexload_momentum_supervisor_t* self, const hexload_config_t* config,
                                      const hexload_load_monitor_t* monitor);

/// The filter has begun anew: innovations of before say nothing any more. What the motion tells stays.
void hexload_momentum_supervisor_forget(hexload_momentum_supervisor_t* self);

/// Looks at the motion of one sample of the filter.
/// @param gap_ticks periods since the last; 0: the first.
void hexload_momentum_supervisor_watch(hexload_momentum_supervisor_t* self, const hexload_config_t* config,
                                       const hexload_momentum_filter_t* filter,
                                       const hexload_motion_t* motion, uint32_t gap_ticks);

/// Fills in the estimate from the filter and judges it. A parameter that has not converged is converging when
/// the motion of the last excitation_time_constant_s, gone on for as long again, would lower its sigma by a
/// third at least.
/// @param[in,out] health sets NOT_EXCITED, INCONSISTENT. Reentrant, constant time.
void hexload_momentum_supervisor_judge(hexload_momentum_supervisor_t* self, const hexload_config_t* config,
                                       const hexload_momentum_filter_t* filter, hexload_estimate_t* estimate,
                                       uint32_t* health);

HEXLOAD_DECLS_END

#endif
