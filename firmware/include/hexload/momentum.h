/// @file momentum.h
/// The estimator for all ten parameters and any motion, tick by tick.
///
///     static hexload_momentum_t estimator;
///     status = hexload_momentum_init(&estimator, &config);                     // once
///     status = hexload_momentum_tick(&estimator, &config, &sample, &estimate); // every sampling period
///
/// As for hexload_t: all lasting memory is in the caller's struct, instances are independent.
#ifndef HEXLOAD_MOMENTUM_H
#define HEXLOAD_MOMENTUM_H

#include "hexload/consider.h"
#include "hexload/load_supervisor.h"
#include "hexload/noise_meter.h"

HEXLOAD_DECLS_BEGIN

typedef struct hexload_momentum {
    hexload_leg_gate_t leg_gate;
    hexload_rig_history_t history;
    hexload_kinematics_t kinematics; ///< at the present tick
    hexload_noise_meter_t noise_meter;
    hexload_load_monitor_t monitor;
    hexload_smoother_t smoother;
    hexload_rig_twists_t twists;          ///< of the smoother
    hexload_rig_slide_t slide;            ///< likewise
    hexload_kinematics_t past_kinematics; ///< lag_ticks ago, or more after a gap
    hexload_momentum_filter_t filter;
    hexload_consider_t consider;
    hexload_load_supervisor_t supervisor;
    hexload_health_t health;
    uint32_t change_tick; ///< of the first sample with the new load
    bool is_changing;     ///< the filter has not reached change_tick yet
    bool is_interrupted;  ///< the filter's momentum must begin anew
} hexload_momentum_t;

/// Starts an estimator from nothing.
/// @return as hexload_init().
HEXLOAD_MUST_USE hexload_status_t hexload_momentum_init(hexload_momentum_t* self,
                                                        const hexload_config_t* config);

/// One sampling period: leg sample -> motion -> is it still the same load? -> smooth twist of lag_ticks ago
/// -> motion there -> filter -> verdict. The estimate is one for the present, as the load does not move. In
/// the first lag_ticks + HEXLOAD_RINGING_TICKS, and after a restart of the filter, no change of the load is
/// told.
/// @return as hexload_tick().
HEXLOAD_MUST_USE hexload_status_t hexload_momentum_tick(hexload_momentum_t* self,
                                                        const hexload_config_t* config,
                                                        const hexload_leg_sample_t* sample,
                                                        hexload_estimate_t* estimate);

HEXLOAD_DECLS_END

#endif
