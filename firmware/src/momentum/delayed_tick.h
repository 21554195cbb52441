/// @file delayed_tick.h
/// The tick of lag_ticks ago, which the filter takes: smooth speeds there need samples on both sides.
/// Internal.
#ifndef HEXLOAD_DELAYED_TICK_H
#define HEXLOAD_DELAYED_TICK_H

#include "front_end/kinematics.h"
#include "momentum/smoother.h"

/// Lives as long as what it points to: for one tick.
typedef struct hexload_delayed_tick {
    hexload_smooth_sample_t smooth;               ///< the sample, and leg speeds without phase lag
    hexload_motion_t motion;                      ///< there; its twist is that of the velocity sensors
    const hexload_sensors_t* sensors;             ///< effective sigmas of the present tick
    const hexload_smoother_constants_t* smoother; ///< of the smoother that gave the sample
} hexload_delayed_tick_t;

#endif
