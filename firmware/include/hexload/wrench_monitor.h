/// @file wrench_monitor.h
/// Whether another wrench acts on the platform than the known load's, on a machine that is not quite its
/// model.
///
/// White noise says nothing of how large the errors of such a machine are; its own past does. A momentum
/// observer with a memory of 20 ms (De Luca, Mattone 2005) gives the wrench that is missing,
///
///     r += b (dY / dt theta - u - G theta - r),   A likewise of the regressors,   b = tick / 20 ms
///
/// of which F_z, M_x and M_y about O_A, y, are compared with what the parameters' errors explain, A P A^T,
/// and with C, the mean of y y^T over the last 10 s of motion, up to 200 ms ago: y^T (A P A^T + C)^-1 y. A
/// load that comes or goes is weight, which these three show.
#ifndef HEXLOAD_WRENCH_MONITOR_H
#define HEXLOAD_WRENCH_MONITOR_H

#include "hexload/momentum_filter.h"

HEXLOAD_DECLS_BEGIN

/// How well the machine has fitted its model of late.
typedef enum hexload_fit {
    HEXLOAD_FIT_NOISE,    ///< the sensors' noise is all there is to an innovation
    HEXLOAD_FIT_FRICTION, ///< and errors of a friction that is known
    HEXLOAD_FIT_NONE,     ///< not
} hexload_fit_t;

enum {
    HEXLOAD_WRENCH_PARTS = 3,   ///< of y
    HEXLOAD_WRENCH_SQUARES = 6, ///< of y y^T, the lower triangle by rows
    HEXLOAD_WRENCH_BINS = 4,    ///< of the 200 ms that do not count yet
};

typedef struct hexload_wrench_monitor {
    hexload_real_t residual[6];                                      ///< r, about the home point
    hexload_real_t regressor[6][HEXLOAD_LOAD_DIM];                   ///< A
    hexload_real_t last_regressor[6][HEXLOAD_LOAD_DIM];              ///< Y of the last tick
    hexload_real_t friction[HEXLOAD_WRENCH_SQUARES];                 ///< what slow legs leave open of y y^T
    hexload_real_t mean_square[HEXLOAD_WRENCH_SQUARES];              ///< C
    hexload_real_t bin[HEXLOAD_WRENCH_BINS][HEXLOAD_WRENCH_SQUARES]; ///< means of 50 ms each
    hexload_real_t filling[HEXLOAD_WRENCH_SQUARES];                  ///< the next bin, so far
    hexload_real_t filled_s;                                         ///< time in it
    hexload_real_t motion_s; ///< time that counts in C, up to its memory
    uint32_t bins;           ///< filled since the last change, at most all
    uint32_t next_bin;       ///< the oldest
    uint32_t ticks;          ///< since the last change; 0: there is no last tick
} hexload_wrench_monitor_t;

/// Starts from nothing.
void hexload_wrench_monitor_init(hexload_wrench_monitor_t* self);

/// The load is another one, or a tick is missing: what the machine's errors are like stays.
void hexload_wrench_monitor_restart(hexload_wrench_monitor_t* self);

/// One sample of the present.
/// @param fit of none: the estimates of another load are given two seconds, as their sigmas mean little.
/// @param last,input what moved mu at the tick before and moves it now.
/// @param variance_n2 of the legs' friction, as of hexload_rig_compensate().
/// @return true when y does not fit, and C is of 4 s of motion at least. Reentrant, constant time.
HEXLOAD_MUST_USE bool hexload_wrench_monitor_step(
    hexload_wrench_monitor_t* self, const hexload_config_t* config, const hexload_momentum_filter_t* filter,
    hexload_fit_t fit, const hexload_motion_t* motion, const hexload_momentum_input_t* last,
    const hexload_momentum_input_t* input, const hexload_real_t variance_n2[HEXLOAD_LEGS]);

HEXLOAD_DECLS_END

#endif
