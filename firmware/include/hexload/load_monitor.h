/// @file load_monitor.h
/// Whether the load is still the one that the filter knows, at once: the momentum of the present tick, with
/// the parameters as they are, against the present leg speeds.
///
/// The momentum filter runs lag_ticks behind, so its own innovations would tell of a new load that much too
/// late. Here mu has six states of its own and no smoothing. What the filter does not know yet counts as
/// noise: each parameter with its sigma, as far as the present acceleration would show it within the memory
/// of the test.
///
/// Two tests: the mean of the normalised innovations squared tells jumps, of a load that is picked up or
/// dropped; the square of the innovations' mean tells ramps, of a centre of mass that has shifted, as the
/// wrong wrench then adds up in one direction.
#ifndef HEXLOAD_LOAD_MONITOR_H
#define HEXLOAD_LOAD_MONITOR_H

#include "hexload/momentum_filter.h"
#include "hexload/rig.h"
#include "hexload/wrench_monitor.h"

HEXLOAD_DECLS_BEGIN

/// Time constant of the mean, and how long an error of the parameters has added up in mu.
#define HEXLOAD_LOAD_MONITOR_MEMORY_S HEXLOAD_REAL(0.05)

typedef struct hexload_load_monitor {
    hexload_real_t momentum[6];
    hexload_real_t covariance[6][6];        ///< the lower triangle counts
    hexload_real_t theta[HEXLOAD_LOAD_DIM]; ///< that of the last tick
    hexload_momentum_input_t last_input;
    hexload_real_t last_force_n[2][HEXLOAD_LEGS]; ///< newest first
    hexload_real_t late_twist[6];                 ///< leaky mean of the last 5 ms
    hexload_real_t acceleration[6];               ///< of the tick before, less gravity's
    hexload_real_t nis;      ///< of the last sample, bounded; 6 when nothing could be told
    hexload_real_t nis_mean; ///< leaky; ideal 6
    hexload_real_t drift[6]; ///< leaky mean of the last 5 ms' innovations in sigmas, by direction
    uint32_t ticks;          ///< since the start, up to those that it takes to settle
    hexload_wrench_monitor_t wrench;
    hexload_rig_slide_t slide;
} hexload_load_monitor_t;

/// mu comes with the next sample.
void hexload_load_monitor_init(hexload_load_monitor_t* self);

/// The same for another load on the same machine.
void hexload_load_monitor_restart(hexload_load_monitor_t* self);

/// One sample of the present.
/// @param fit but for HEXLOAD_FIT_NOISE the machine's own past says what is noise (wrench_monitor.h).
/// @param gap_ticks periods since the last; but for 1 mu begins anew, and the sample tells nothing.
/// @return true when the load has changed. Reentrant, constant time.
HEXLOAD_MUST_USE bool
hexload_load_monitor_step(hexload_load_monitor_t* self, const hexload_config_t* config,
                          const hexload_sensors_t* sensors, const hexload_momentum_filter_t* filter,
                          const hexload_leg_sample_t* sample, const hexload_motion_t* motion,
                          const hexload_leg_blocks_t* jacobian, hexload_fit_t fit, uint32_t gap_ticks);

HEXLOAD_DECLS_END

#endif
