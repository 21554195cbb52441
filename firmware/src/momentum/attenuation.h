/// @file attenuation.h
/// Motion that is none: by how much moments of inertia and h_z may be wrong for it. Errors in variables.
/// Internal.
///
/// The momentum filter takes H from a smooth twist (smoother.h). What of its angular velocity w is no motion,
/// as of an encoder that is off by a sine with each turn, counts as if the platform had turned and not shown
/// inertia: the moments of platform and load become too small by the share that it has of w, however many
/// samples there are, and the filter is as sure as if it had turned. The velocity sensors' own angular
/// velocity w_v has another noise, so that about each axis of the platform
///
///     e = sum of f (w - w_v) / sum of f^2,   f = w - (mean of w over some 12 ticks)                 (M23)
///
/// is that share, with a standard deviation of sigma / sqrt(sum of f^2), sigma that of w_v. f, because slow
/// changes of momentum are lost in what the force sensors' noise adds up to, and tell little of inertias. A
/// velocity that is late by t ticks makes e t / 12.
///
/// Legs whose instants of sampling differ show a turning of their own, in all channels alike, that no channel
/// contradicts. With n(l) the twist that leg l alone makes of its acceleration times timing_s, about each
/// axis and along x and y together
///
///     l = sum of min(w^2, 6 n(l)^2) / sum of w^2,   l one leg after the other                       (M24)
///
/// is the share of what has moved that may be none.
/// All sums are of one load; those of M23 of the last 2^24 sigma^2 at most.
/// Source: Carroll, Ruppert, Stefanski, Crainiceanu, Measurement Error in Nonlinear Models, 2006, ch. 3.
#ifndef HEXLOAD_ATTENUATION_H
#define HEXLOAD_ATTENUATION_H

#include "hexload/momentum.h"
#include "momentum/delayed_tick.h"

/// Takes a twist that the filter has taken, or every now and then sees to sigma: where e stands out of two
/// and a half of its standard deviations, sigma is to have what moments and products of inertia are too small
/// by, e of an axis times the moment of platform and load, of products the mean of both axes; and what M24
/// leaves open of them, of products that of the axis that is known better, of h_z the least of x, y and the
/// shift, times the mass and the hinges' distance from O_A. It raises what misfits have left in the
/// supervisor's factors, which fall again as the motion shows more. In ticks in which the plausibility step
/// has had little to do; some 400 instructions. Reentrant.
/// @param past the tick of that twist.
void hexload_attenuation_step(hexload_momentum_t* estimator, const hexload_config_t* config,
                              const hexload_delayed_tick_t* past);

/// What M24 leaves open of a moment of inertia, kg m^2. Reentrant.
/// @param axis 0..2: about x, y, z.
hexload_real_t hexload_attenuation_late(const hexload_momentum_filter_t* filter, int axis);

#endif
