/// @file paper_tolerances.h
/// What no motion tells the paper's filter: the common gain of the force sensors and the platform's own body;
/// and what the weight says of the given masses. Internal.
///
/// Euler's equation about the common centre of mass is linear in forces and D, so a gain is all of D's: with
/// it the load's inertias are off by that share of D, and dz by nothing. Of the platform's mass, height of
/// its centre and inertia each has its own row of derivatives (R16).
#ifndef HEXLOAD_PAPER_TOLERANCES_H
#define HEXLOAD_PAPER_TOLERANCES_H

#include "paper/paper_filter.h"

/// Covariance that they add to parameters i and j; 0 without tolerances. Reentrant, constant time.
/// @param weight_error share by which the weight is not that of the given masses.
hexload_real_t hexload_paper_tolerances_covariance(const hexload_paper_filter_t* filter,
                                                   hexload_real_t weight_error, int i, int j);

#endif
