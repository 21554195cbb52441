/// @file motion_directions.h
/// In which directions of leg space the platform has moved of late. Internal.
///
/// A motion in one or two directions of six brings the noise of all six into the twist at which the momentum
/// filter linearises, where it counts as rotation that there is none of: information that no motion has
/// given. Most of it comes with degree three and five, whose slopes have 2.3 and 3.6 times the noise of the
/// line's. Of a slope c each direction therefore counts as far as the line's has stood out of its noise there
/// of late,
///
///     W c,   W = A (A + kappa E)^-1 = E - kappa (A + kappa E)^-1,   A = mean of c1 c1^T / sigma^2
///
/// the mean of c given what was seen, if motion has mean square A: what is left of its error is then
/// independent of what is used (Berkson's errors in variables), and leaves no bias. What W leaves out is kept
/// where it is more than noise: a motion in another direction has just begun.
/// Source: Carroll, Ruppert, Stefanski, Crainiceanu, Measurement Error in Nonlinear Models, 2006, ch. 4.
#ifndef HEXLOAD_MOTION_DIRECTIONS_H
#define HEXLOAD_MOTION_DIRECTIONS_H

#include "hexload/state.h"

/// No motion yet.
void hexload_motion_directions_init(hexload_motion_directions_t* self);

/// At every tick, before hexload_motion_directions_keep(): an eighth of what makes W of a slope and those
/// before it. @param slope_m_s c1. @param inverse_sigma_s_m 1 over its sigma in a leg. Reentrant, no constant
/// time.
void hexload_motion_directions_learn(hexload_motion_directions_t* self,
                                     const hexload_real_t slope_m_s[HEXLOAD_LEGS],
                                     hexload_real_t inverse_sigma_s_m);

/// c becomes W c, and as much of the rest as is more than noise. @param inverse_variance_s2_m2 1 over the
/// variance of the slope in a leg. Reentrant, constant time.
void hexload_motion_directions_keep(const hexload_motion_directions_t* self,
                                    hexload_real_t inverse_variance_s2_m2,
                                    hexload_real_t slope_m_s[HEXLOAD_LEGS]);

#endif
