/// @file residual_test.h
/// Whether what the filter leaves unexplained is noise, over times that single ticks do not see. Internal.
///
/// A filter that fits its model has white innovations: the sum of n whitened ones, over sqrt(n), is again as
/// many independent normal numbers, whatever the motion (Bar-Shalom, Li, Kirubarajan 2001, 5.4). An error
/// that is small beside the noise of a tick but lasts grows with n, their standard deviation with sqrt(n).
///
/// What a mismatch makes of theta, in its own sigmas, is at most the root of all it adds to those squares, if
/// theta takes as much of it as the innovations keep (R15): the filter's sigmas are widened by that,
/// self->factor, as soon as the sum of the present half second is certain to be one of a mismatch.
#ifndef HEXLOAD_RESIDUAL_TEST_H
#define HEXLOAD_RESIDUAL_TEST_H

#include "algebra/real.h"
#include "hexload/state.h"

/// Of a sum: long against the noise, short against a motion.
#define HEXLOAD_RESIDUAL_BLOCK_S HEXLOAD_REAL(0.5)

/// Also of another load: sums and means of before say nothing of it.
/// @param dimension of an innovation, 1..HEXLOAD_MEASUREMENTS_MAX.
void hexload_residual_test_init(hexload_residual_test_t* self, uint32_t dimension);

/// Whether the next innovation is the last one of a half second.
static inline bool hexload_residual_test_ends(const hexload_residual_test_t* self,
                                              const hexload_config_t* config) {
    const uint32_t ticks = self->ticks + 1U;
    return (hexload_real_t)ticks * config->tick_s >= HEXLOAD_RESIDUAL_BLOCK_S;
}

/// By how much the filter's own sigmas are too small.
/// @param is_considered sigma has what errors of constants do, which the sums have in them too: what these
/// leave of each half second is then taken for independent of the others' (R17), not for one error that
/// lasts.
hexload_real_t hexload_residual_test_factor(const hexload_residual_test_t* self, bool is_considered);

/// Takes the whitened innovation of one update of the filter. Some 30 instructions, and 60 more once in half
/// a second. Reentrant.
/// @param is_considered sigma has what errors of constants do, which the sums have in them too: no factor.
void hexload_residual_test_step(hexload_residual_test_t* self, const hexload_config_t* config,
                                const hexload_real_t* whitened, bool is_considered);

/// The factor on a parameter's sigma that a misfit asks for, also after it: an error that it has left stays
/// when it ends, and shrinks with P alone, as the motion shows more; in sigmas with the root of P (R7, R16).
/// @param kept that factor so far. @param ratio of the parameter's variance to that of then. @param factor of
/// now.
static inline hexload_real_t hexload_residual_kept(hexload_real_t kept, hexload_real_t ratio,
                                                   hexload_real_t factor) {
    hexload_real_t left = kept;
    if (ratio < HEXLOAD_REAL(1.0)) {
        const hexload_real_t square = hexload_fma(kept, kept, HEXLOAD_REAL(-1.0));
        left = hexload_sqrt(hexload_fma(ratio, square, HEXLOAD_REAL(1.0)));
    }
    return hexload_max(left, factor);
}

#endif
