/// @file wrench_monitor.h
/// Whether another wrench acts on the platform than the known load's, on a machine that is not quite its
/// model.
///
/// White noise says nothing of how large the errors of such a machine are; its own past does. A momentum
/// observer with a memory of 20 ms (De Luca, Mattone 2005) gives the wrench that is missing,
///
///     r += b (d(Y theta) / dt - u - G theta - r),   b = tick / 20 ms
///
/// of which F_z, M_x and M_y about O_A, y, are compared with what the parameters' errors and slow legs leave
/// open, O, the same mean of squares, and with C, the mean of what else was in y y^T over the last 10 s of
/// motion, up to 200 ms ago: y^T (O + C)^-1 y. A load that comes or goes is weight, which these three show.
#ifndef HEXLOAD_WRENCH_MONITOR_H
#define HEXLOAD_WRENCH_MONITOR_H

#include "momentum/momentum_filter.h"

/// Time constants of r, and of its mean.
#define HEXLOAD_WRENCH_MEMORY_S HEXLOAD_REAL(0.02)
#define HEXLOAD_WRENCH_LASTING_S HEXLOAD_REAL(0.005)

/// How well the machine has fitted its model of late.
typedef enum hexload_fit {
    HEXLOAD_FIT_UNPROVEN, ///< the load is too new to tell
    HEXLOAD_FIT_NOISE,    ///< the sensors' noise is all there is to an innovation
    HEXLOAD_FIT_FRICTION, ///< and errors of a friction or of constants that are known to a tolerance
    HEXLOAD_FIT_NONE,     ///< not
} hexload_fit_t;

/// For how many ticks what monitors see of a new load counts for nothing: its first estimates move mu with
/// the noise of the twist, and the shock that came with it stays in the smoother's window for a lag.
static inline uint16_t hexload_settling_ticks(const hexload_config_t* config) {
    return (uint16_t)(config->momentum.lag_ticks * 5U / 4U);
}

/// What moves the platform at the present tick.
typedef struct hexload_push {
    const hexload_motion_t* motion;
    const hexload_real_t* momentum;           ///< mu of the measured twist; N s, N m s
    const hexload_real_t* momentum_of_change; ///< what of it the change of theta since the last tick is
    const hexload_real_t* impulse;     ///< by which forces and weight have moved mu since the last tick
    const hexload_real_t* variance_n2; ///< of each leg's friction, as of hexload_rig_compensate()
    /// covariance of the wrench that theta's errors make, of late; the lower triangle counts; N^2 and so on
    hexload_real_t (*unknown)[6];
    hexload_real_t unknown_scale; ///< by which that is too small; 1 or more
    bool is_moving;               ///< as of hexload_is_moving()
} hexload_push_t;

/// Starts from nothing.
void hexload_wrench_monitor_init(hexload_wrench_monitor_t* self);

/// The load is another one, or a tick is missing: what the machine's errors are like stays.
void hexload_wrench_monitor_restart(hexload_wrench_monitor_t* self);

/// One sample of the present.
/// @param fit of noise, or unproven: nothing is reported, only learnt; of none: the estimates of another load
/// are given two seconds, as their sigmas mean little.
/// @return true when y does not fit, and C is of 4 s of motion at least, or the machine is commissioned or
/// has not moved yet.
/// Reentrant, constant time.
HEXLOAD_MUST_USE bool hexload_wrench_monitor_step(hexload_wrench_monitor_t* self,
                                                  const hexload_config_t* config,
                                                  const hexload_momentum_filter_t* filter, hexload_fit_t fit,
                                                  const hexload_push_t* push);

#endif
