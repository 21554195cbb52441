/// @file momentum_supervisor.h
/// Whether the ten parameters can be trusted, and what the motion shows of each. Internal.
#ifndef HEXLOAD_MOMENTUM_SUPERVISOR_H
#define HEXLOAD_MOMENTUM_SUPERVISOR_H

#include "hexload/estimate.h"
#include "momentum/jackknife.h"
#include "momentum/load_monitor.h"

void hexload_momentum_supervisor_init(hexload_momentum_supervisor_t* self);

/// Takes the innovations of the present: the monitor's, as those of the filter have the smoother's residual
/// in them too.
void hexload_momentum_supervisor_hear(hexload_momentum_supervisor_t* self, const hexload_config_t* config,
                                      const hexload_load_monitor_t* monitor);

/// A load change has been detected. After a second one within seconds the machine counts as one that does not
/// fit its model, so that one that does not is no storm of alarms.
void hexload_momentum_supervisor_alarm(hexload_momentum_supervisor_t* self);

/// Takes the last alarm for an error of the machine, not for another load.
void hexload_momentum_supervisor_doubt(hexload_momentum_supervisor_t* self);

/// How well the machine has fitted its model of late: by fit_nis, and by config->rig, whose friction has
/// errors that are not noise.
/// @param is_moving now: before a load has moved for half a second nothing is known of what its motion shows,
/// at rest its weight.
hexload_fit_t hexload_momentum_supervisor_fit(const hexload_momentum_supervisor_t* self,
                                              const hexload_config_t* config, bool is_moving);

/// The filter has begun anew: innovations of before say nothing any more. What is known of the motion stays.
void hexload_momentum_supervisor_forget(hexload_momentum_supervisor_t* self);

/// Looks at the motion of one sample of the filter, and at what innovations that are too large leave.
void hexload_momentum_supervisor_watch(hexload_momentum_supervisor_t* self, const hexload_config_t* config,
                                       const hexload_momentum_filter_t* filter,
                                       const hexload_jackknife_t* jackknife,
                                       const hexload_residual_test_t* residual_test,
                                       const hexload_delayed_tick_t* past);

/// Judges the estimate, whose values and sigmas are there; widens the sigmas by what misfits have left and
/// what no motion tells, and where they are too small for any body to have the values. A parameter that has
/// not converged is converging when the motion of the last excitation_time_constant_s, gone on for as long
/// again, would lower the filter's own sigma by a third at least: what widens it is not lowered by more of
/// the same. A mismatch that widens sigmas beyond what counts as converged is a misfit too, if no
/// contradiction.
/// @return health bits: NOT_EXCITED, INCONSISTENT, MODEL_MISFIT. Reentrant, constant time.
uint32_t hexload_momentum_supervisor_judge(hexload_momentum_supervisor_t* self,
                                           const hexload_config_t* config,
                                           const hexload_momentum_filter_t* filter,
                                           const hexload_jackknife_t* jackknife,
                                           const hexload_residual_test_t* residual_test,
                                           hexload_estimate_t* estimate);

/// Nothing counts as converged while innovations and blocks have not said yet whether the machine fits its
/// model. After all that judges.
void hexload_momentum_supervisor_hold_back(const hexload_momentum_supervisor_t* self,
                                           const hexload_jackknife_t* jackknife,
                                           hexload_estimate_t* estimate);

#endif
