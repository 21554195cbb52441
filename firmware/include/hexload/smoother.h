/// @file smoother.h
/// Leg speeds from displacements alone, without phase lag: at a tick that lies `lag` ticks back, with as many
/// ticks before it as after it.
///
/// The momentum filter needs a twist at which to linearise whose noise is small and independent of the
/// velocity sensors'. A least-squares polynomial of degree six over 2 lag + 1 ticks has the slope
///
///     c1 + c3 + c5,   c_m = p_m'(0) / (tick_s |p_m|^2) * sum over j of p_m(j) x(j)
///
/// with p1, p3, p5 the odd orthogonal polynomials on -lag..lag. c3 and c5 count only as far as they stand out
/// of their noise in all legs together: times max(0, 1 - 12.59 / q), q the sum of (c_m / sigma)^2 over the
/// legs, 12.59 the 95 % point of chi-square with 6 degrees of freedom (positive-part shrinkage).
///
/// The sums run along in integers, so they cost the same for every lag and never drift.
#ifndef HEXLOAD_SMOOTHER_H
#define HEXLOAD_SMOOTHER_H

#include "hexload/leg_sample.h"

#include <stdbool.h>

HEXLOAD_DECLS_BEGIN

/// Longest lag that the memory of an instance allows, and missing ticks that may be under way at a time.
#ifndef HEXLOAD_LAG_TICKS_MAX
#define HEXLOAD_LAG_TICKS_MAX 85
#endif
enum {
    HEXLOAD_MISSING_TICKS_MAX = 16,
    HEXLOAD_SMOOTHER_ORDERS = 6,
    HEXLOAD_WINDOW_CAPACITY = 2 * HEXLOAD_LAG_TICKS_MAX + 1 + HEXLOAD_MISSING_TICKS_MAX,
    HEXLOAD_DELAY_CAPACITY = HEXLOAD_LAG_TICKS_MAX + 1 + HEXLOAD_MISSING_TICKS_MAX,
};

/// What the lag makes of the polynomials.
typedef struct hexload_smoother_constants {
    uint32_t lag_ticks;
    int32_t entering[HEXLOAD_SMOOTHER_ORDERS]; ///< weights of the window's newest tick in the sums
    int32_t leaving[HEXLOAD_SMOOTHER_ORDERS];  ///< of its oldest
    hexload_real_t project[3];                 ///< of the third on p1; of the fifth on p1 and p3
    hexload_real_t slope[3];                   ///< from a sum in steps to c_m in m/s
    hexload_real_t inverse_variance[3];        ///< 1 / sigma^2 of c_m
} hexload_smoother_constants_t;

typedef struct hexload_smoother {
    hexload_smoother_constants_t constants;
    uint64_t sum[HEXLOAD_LEGS]
                [HEXLOAD_SMOOTHER_ORDERS]; ///< of weights times steps over the window, modulo 2^64
    int32_t steps[HEXLOAD_WINDOW_CAPACITY][HEXLOAD_LEGS];
    hexload_real_t velocity_m_s[HEXLOAD_DELAY_CAPACITY][HEXLOAD_LEGS];
    hexload_real_t force_n[HEXLOAD_DELAY_CAPACITY][HEXLOAD_LEGS];
    uint8_t is_missing[HEXLOAD_DELAY_CAPACITY];
    uint32_t stored;      ///< ticks put in since the start; modulo the capacities the next one's place
    uint32_t entered;     ///< ticks that have entered the window
    uint32_t gap_ticks;   ///< from the last sample taken out to the middle of the window
    uint32_t middle_tick; ///< of the window's middle
    bool has_taken;       ///< a sample has been taken out since the start
} hexload_smoother_t;

/// A sample of the past, and the speeds that its neighbours on both sides tell.
typedef struct hexload_smooth_sample {
    hexload_leg_sample_t sample;
    hexload_real_t smooth_velocity_m_s[HEXLOAD_LEGS];
    uint32_t gap_ticks; ///< periods since the last one taken out; 0 for the first after a start
} hexload_smooth_sample_t;

/// Starts empty.
void hexload_smoother_init(hexload_smoother_t* self, const hexload_config_t* config);

/// Puts a sample in. Ticks that are missing before it are bridged by a cubic through the displacements and
/// velocities of both sides, for the window's sake only; when there are too many, everything begins anew.
/// @param gap_ticks periods since the last sample put in; 0 for the first.
/// @return false when it began anew. Worst case: as many bridged ticks as the configuration allows.
bool hexload_smoother_put(hexload_smoother_t* self, const hexload_config_t* config,
                          const hexload_leg_sample_t* sample, uint32_t gap_ticks);

/// Takes the next sample out whose window is complete. At most one is taken for each that is put in.
/// @return false when there is none: in the first 2 lag ticks.
bool hexload_smoother_take(hexload_smoother_t* self, hexload_smooth_sample_t* out);

HEXLOAD_DECLS_END

#endif
