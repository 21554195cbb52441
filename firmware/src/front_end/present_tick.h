/// @file present_tick.h
/// The present tick as later stages see it: the accepted sample and what the front end makes of it. Internal.
#ifndef HEXLOAD_PRESENT_TICK_H
#define HEXLOAD_PRESENT_TICK_H

#include "algebra/linalg.h"
#include "front_end/kinematics.h"

/// From which speed on the machine shows its friction and its inertia, of one leg or, by squares, of all.
#define HEXLOAD_MOVING_M_S HEXLOAD_REAL(0.01)

/// Whether they are faster.
static inline bool hexload_is_moving(const hexload_real_t velocity_m_s[HEXLOAD_LEGS]) {
    return dot6(velocity_m_s, velocity_m_s) > (HEXLOAD_MOVING_M_S * HEXLOAD_MOVING_M_S);
}

/// Lives as long as what it points to: for one tick.
typedef struct hexload_present_tick {
    const hexload_leg_sample_t* sample;
    const hexload_motion_t* motion;
    /// Effective sigmas: the stated ones, or those that the noise estimator has measured. Every stage of the
    /// tick uses these.
    hexload_sensors_t sensors;
    uint32_t gap_ticks;           ///< periods since the last accepted sample; 0 for the first
    hexload_lost_channels_t lost; ///< channels that are guesses
    const hexload_noise_estimator_t* noise;
} hexload_present_tick_t;

#endif
