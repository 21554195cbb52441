/// @file momentum.h
/// The recommended estimator: all ten parameters of the load from any motion, nothing known beforehand.
///
///     static hexload_momentum_t estimator;
///     status = hexload_momentum_init(&estimator, &config);                     // once
///     status = hexload_momentum_tick(&estimator, &config, &sample, &estimate); // every sampling period
///
/// hexload.h has the same estimator behind one interface with the others; this header is for a controller
/// that links nothing else. All lasting memory is in the caller's struct, instances are independent.
#ifndef HEXLOAD_MOMENTUM_H
#define HEXLOAD_MOMENTUM_H

#include "hexload/state.h"

HEXLOAD_DECLS_BEGIN

typedef struct hexload_momentum {
    hexload_leg_gate_t leg_gate;               ///< last accepted sample
    hexload_lost_channels_t lost;              ///< what of it was missing
    hexload_rig_history_t history;             ///< samples of late, to look up what was late
    hexload_kinematics_t kinematics;           ///< at the present tick
    hexload_noise_estimator_t noise_estimator; ///< effective sigmas of the sensors
    hexload_plausibility_t plausibility;       ///< whether channels contradict each other
    hexload_load_monitor_t monitor;            ///< detects load changes, at the present tick
    hexload_frozen_channels_t frozen;          ///< whether a sensor has stopped
    hexload_smoother_t smoother;               ///< motion of lag_ticks ago
    hexload_rig_twists_t twists;               ///< of the smoother, for the acceleration of legs with mass
    hexload_rig_slide_t slide;                 ///< how friction has turned, by the smoother's speeds
    hexload_kinematics_t delayed_kinematics;   ///< lag_ticks ago, or more after a gap
    hexload_momentum_filter_t filter;          ///< theta and mu, of lag_ticks ago
    hexload_consider_t consider;               ///< what the rig's open constants do to theta
    hexload_jackknife_t jackknife;             ///< how much theta varies from block to block
    hexload_residual_test_t residual_test;     ///< whether the filter's innovations are white
    hexload_oscillation_test_t oscillation;    ///< whether they swing
    hexload_momentum_supervisor_t supervisor;  ///< verdicts
    hexload_health_t health;                   ///< bits and counters
    hexload_real_t sigma[HEXLOAD_LOAD_DIM];    ///< of the last estimate
    uint32_t change_tick;                      ///< first tick after the last load change
    uint8_t newton_steps;                      ///< of the last tick's two poses
    bool is_changing;                          ///< the filter has not reached change_tick yet
    bool is_mass_known;                        ///< the configured mass is still taken for granted
    bool is_interrupted;                       ///< the filter's momentum must begin anew
} hexload_momentum_t;

/// Starts an estimator from nothing.
/// @return HEXLOAD_OK; HEXLOAD_ERR_CONFIG when hexload_config_check() refuses; HEXLOAD_ERR_POSE,
///         HEXLOAD_ERR_SINGULAR when the geometry has no usable home pose. On refusal self does not change.
HEXLOAD_MUST_USE hexload_status_t hexload_momentum_init(hexload_momentum_t* self,
                                                        const hexload_config_t* config);

/// One sampling period: pose -> load monitor -> smooth motion of lag_ticks ago -> filter -> verdict. The
/// estimate is one for the present, as the load does not move. No load change is detected in the first
/// two lags and a quarter, after a change or a restart of the filter, nor while a load moves for its first
/// half second.
/// @param config the one of hexload_momentum_init().
/// @return HEXLOAD_OK or the status of the stage that refused: HEXLOAD_ERR_SAMPLE, HEXLOAD_ERR_TICK,
///         HEXLOAD_ERR_POSE, HEXLOAD_ERR_SINGULAR; then estimate does not change, and self in
///         health.refused and in what it remembers of missing channels only. Reentrant for different self;
///         not for an interrupt that shares one.
HEXLOAD_MUST_USE HEXLOAD_NONNULL hexload_status_t hexload_momentum_tick(hexload_momentum_t* self,
                                                                        const hexload_config_t* config,
                                                                        const hexload_leg_sample_t* sample,
                                                                        hexload_estimate_t* estimate);

/// hexload_momentum_tick() that also hands out its measurement update. @param[out] trace of an accepted tick.
HEXLOAD_MUST_USE HEXLOAD_NONNULL hexload_status_t hexload_momentum_trace(hexload_momentum_t* self,
                                                                         const hexload_config_t* config,
                                                                         const hexload_leg_sample_t* sample,
                                                                         hexload_estimate_t* estimate,
                                                                         hexload_trace_t* trace);

/// The momentum estimator with a stage for actuator effects: the force sensors' biases, the legs' friction
/// and the base's tilt are found together with the load, each where its prior sigma says that it is unknown.
/// What config->rig knows of them is taken off before. Twice the work.
typedef struct hexload_momentum_effects {
    hexload_momentum_t momentum;     ///< its filter holds theta, mu and their covariance
    hexload_effects_stage_t effects; ///< biases, friction and tilt, and what is confounded with them
} hexload_momentum_effects_t;

/// As hexload_momentum_init().
HEXLOAD_MUST_USE hexload_status_t hexload_momentum_effects_init(hexload_momentum_effects_t* self,
                                                                const hexload_config_t* config);

/// As hexload_momentum_tick(). A load change leaves what is known of the actuators.
HEXLOAD_MUST_USE HEXLOAD_NONNULL hexload_status_t
hexload_momentum_effects_tick(hexload_momentum_effects_t* self, const hexload_config_t* config,
                              const hexload_leg_sample_t* sample, hexload_estimate_t* estimate);

/// As hexload_momentum_trace().
HEXLOAD_MUST_USE HEXLOAD_NONNULL hexload_status_t hexload_momentum_effects_trace(
    hexload_momentum_effects_t* self, const hexload_config_t* config, const hexload_leg_sample_t* sample,
    hexload_estimate_t* estimate, hexload_trace_t* trace);

/// Actuator effects, and with which load parameters they are confounded. Reentrant, constant time.
/// @param estimate that of the last tick.
void hexload_momentum_effects_read(const hexload_momentum_effects_t* self, const hexload_estimate_t* estimate,
                                   hexload_effects_estimate_t* effects);

HEXLOAD_DECLS_END

#endif
