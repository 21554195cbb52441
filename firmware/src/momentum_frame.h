/// @file momentum_frame.h
/// A tick around the filter: what both momentum estimators do alike. Internal.
///
///     begin -> watch -> take -> (the estimator's own filter) -> end
#ifndef HEXLOAD_MOMENTUM_FRAME_H
#define HEXLOAD_MOMENTUM_FRAME_H

#include "hexload/momentum.h"

/// The present tick.
typedef struct momentum_tick {
    uint32_t health;
    bool is_aligned;             ///< all channels of one instant are there; without, nothing can be filtered
    uint32_t gap_ticks;          ///< of that instant, periods since the last one
    hexload_leg_sample_t sample; ///< of that instant, without known delays, offsets and gains
    hexload_motion_t motion;
    hexload_sensors_t sensors; ///< sigmas to use
} momentum_tick_t;

/// What the filter takes in this tick.
typedef struct momentum_past {
    hexload_smooth_sample_t sample;
    hexload_motion_t motion;
    bool is_new_load; ///< the first sample of it: the filter must forget the old one
} momentum_past_t;

/// Checks the sample, finds pose and twist and how much the sensors' noise is.
/// @return as hexload_momentum_tick().
HEXLOAD_MUST_USE hexload_status_t momentum_frame_begin(hexload_momentum_t* self,
                                                       const hexload_config_t* config,
                                                       const hexload_leg_sample_t* sample,
                                                       momentum_tick_t* tick);

/// Is it still the same load? The alarm comes at once, and the filter forgets when it reaches the change.
/// @param sample,sensors those of the present tick, or what is left of them without known errors.
void momentum_frame_watch(hexload_momentum_t* self, const hexload_config_t* config,
                          const hexload_leg_sample_t* sample, const hexload_sensors_t* sensors,
                          momentum_tick_t* tick);

/// Puts the aligned sample into the smoother and takes the one of lag_ticks ago, with the motion there.
/// @return false when there is none.
HEXLOAD_MUST_USE bool momentum_frame_take(hexload_momentum_t* self, const hexload_config_t* config,
                                          momentum_tick_t* tick, momentum_past_t* past);

/// Judges the estimate.
/// @param is_finite every number of the filter is: if not, or if no body has had these parameters for long,
/// as an unlucky start has been taken for knowledge, the filter begins from nothing.
/// @param[in,out] tick health sets FILTER_RESTARTED.
void momentum_frame_end(hexload_momentum_t* self, const hexload_config_t* config,
                        const hexload_leg_sample_t* sample, bool is_finite, momentum_tick_t* tick,
                        hexload_estimate_t* estimate);

#endif
