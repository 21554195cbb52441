/// @file body.h
/// The load as a body: centre of mass and central inertia tensor that ten parameters stand for, whether a
/// body can have them, and the nearest ones that it can have. EQUATIONS.md derives it.
///
///     hexload_covariance(&estimator, covariance);
///     hexload_body_describe(estimate.value, covariance, &body);
///     if (!body.is_consistent && hexload_body_nearest(estimate.value, covariance, nearest, &distance)) ...
///
/// No part of the tick: call it when you need the answer, between two ticks, or at leisure on a copy of value
/// and covariance. Pure functions, reentrant, of bounded time.
#ifndef HEXLOAD_BODY_H
#define HEXLOAD_BODY_H

#include "hexload/estimate.h"

#include <stdbool.h>

HEXLOAD_DECLS_BEGIN

typedef struct hexload_body {
    hexload_real_t mass_kg;        ///< m
    hexload_real_t mass_sigma_kg;  ///< standard deviation, as all sigmas here
    hexload_real_t com_m[3];       ///< centre of mass c = h / m, platform axes
    hexload_real_t com_sigma_m[3]; ///< of each coordinate
    /// Tensor about the centre of mass, platform axes, in the order of enum hexload_inertia, and its signs.
    hexload_real_t inertia_kg_m2[HEXLOAD_I_DIM];
    hexload_real_t inertia_sigma_kg_m2[HEXLOAD_I_DIM]; ///< of each entry
    bool has_com;       ///< false: centre of mass and tensor are unknown, and zero with their sigmas
    bool has_inertia;   ///< false: the tensor is unknown, and zero with its sigmas
    bool is_consistent; ///< some body has these parameters: the pseudo-inertia is positive definite
} hexload_body_t;

/// Mass, centre of mass and central tensor, each with its sigma by first order from the whole covariance.
/// First order needs small errors: the centre of mass is unknown while the mass's sigma is beyond a tenth of
/// the mass (its mean is then off by up to 0.1 sigma, its sigma by 4 %); so is the tensor, and while what
/// first order leaves out, the square of the errors of h over m, may be beyond half a sigma of an entry.
/// @param theta enum hexload_load_parameter; finite.
/// @param covariance of theta, lower triangle by rows; positive semidefinite.
/// On a Cortex-M7 6,800 instructions at -O2, 2,900 at -O3.
void hexload_body_describe(const hexload_real_t theta[HEXLOAD_LOAD_DIM],
                           const hexload_real_t covariance[HEXLOAD_LOAD_COVARIANCES], hexload_body_t* body);

/// The parameters that a body can have and that are nearest to theta, measured in sigmas with the whole
/// covariance (Mahalanobis): to 0.01 sigma, or a hundredth of the distance when that is more. Their
/// pseudo-inertia is at least 1e-5 of the scale that theta and its sigmas have. From there it is never
/// farther to the truth, which is some body's, than from theta.
/// @param[out] nearest theta itself, to the bit, when it is consistent, and when the result is false.
/// @param[out] distance_sigmas from theta; 0 when it is consistent.
/// @return false when a number is not finite, or when 40 steps were not enough, which has been seen only of
/// estimates that are a hundred sigmas off.
/// On a Cortex-M7 at -O2 17,000 instructions a step, 700,000 for 40; estimates of a filter that has just begun
/// take 120,000 in the middle and 351,000, the longest found.
HEXLOAD_MUST_USE bool hexload_body_nearest(const hexload_real_t theta[HEXLOAD_LOAD_DIM],
                                           const hexload_real_t covariance[HEXLOAD_LOAD_COVARIANCES],
                                           hexload_real_t nearest[HEXLOAD_LOAD_DIM],
                                           hexload_real_t* distance_sigmas);

HEXLOAD_DECLS_END

#endif
