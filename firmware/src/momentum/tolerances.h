/// @file tolerances.h
/// What no motion tells from a load: the common gain of the force sensors, and the platform's own body.
/// Internal.
///
/// The forces on platform and load are linear in the sum of both thetas and in the gain. Sensors that show
/// (1 + g) times the force give (1 + g) times that sum, so the load is off by g (theta + theta_platform),
/// and by what theta_platform is off, with the other sign: exactly, whatever the motion (R14). No innovation
/// changes, and no time averages it out.
#ifndef HEXLOAD_TOLERANCES_H
#define HEXLOAD_TOLERANCES_H

#include "momentum/momentum_filter.h"

/// Adds what of the legs hangs on the platform, at its rim, where the filter's model has more that is free and
/// takes up what their swing would leave: a share of the platform's mass, and twice that of its moments.
void hexload_tolerances_add_legs(hexload_tolerances_t* tolerances, hexload_real_t share);

/// Covariance that the tolerances add to parameters i and j of the load. Constant time.
hexload_real_t hexload_tolerances_covariance(const hexload_momentum_filter_t* filter, int i, int j);

/// Adds that of each parameter to its standard deviation; without tolerances they stay as they are, to the
/// bit. Some 150 instructions. Reentrant.
/// @param[in,out] sigma of the load's parameters.
/// @param[out] variance that was added.
void hexload_tolerances_widen(const hexload_momentum_filter_t* filter, hexload_real_t sigma[HEXLOAD_LOAD_DIM],
                              hexload_real_t variance[HEXLOAD_LOAD_DIM]);

#endif
