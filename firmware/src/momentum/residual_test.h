/// @file residual_test.h
/// Whether what the filter leaves unexplained is noise, over times that single ticks do not see. Internal.
///
/// A filter that fits its model has white innovations: the sum of n whitened ones, over sqrt(n), is again six
/// independent normal numbers, whatever the motion (Bar-Shalom, Li, Kirubarajan 2001, 5.4). An error that is
/// small beside the noise of a tick but lasts grows with n, their standard deviation with sqrt(n).
///
/// What a mismatch makes of theta, in its own sigmas, is at most the root of all it adds to those squares, if
/// theta takes as much of it as the innovations keep (R15): the filter's sigmas are widened by that,
/// self->factor.
#ifndef HEXLOAD_RESIDUAL_TEST_H
#define HEXLOAD_RESIDUAL_TEST_H

#include "momentum/momentum_filter.h"

/// Also of another load: sums and means of before say nothing of it.
void hexload_residual_test_init(hexload_residual_test_t* self);

/// Takes the innovation of one update of the filter. Six additions, and some 60 instructions once in half a
/// second. Reentrant.
void hexload_residual_test_step(hexload_residual_test_t* self, const hexload_config_t* config,
                                const hexload_momentum_update_t* update);

#endif
