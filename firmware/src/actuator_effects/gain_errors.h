/// @file gain_errors.h
/// Gains of force sensors that differ from leg to leg, beside free biases. Internal.
///
/// A gain that is g off adds g f to a leg's force. What of it is constant the leg's bias takes; what changes
/// goes with the motion, as what the load does. By Cauchy-Schwarz a parameter with the column r, whose sigma
/// from white noise sigma_f is s, is off by
///
///     abs(sum of r d) / sum of r^2 <= (s / sigma_f) sqrt(sum of d^2),   d = g (f - mean of f)       (A9)
///
/// at most, where all of d goes with its column. Of a parameter that the biases are not confounded with (A4)
/// the innovations show what of d does not (R15), once the motion has told all moments of inertia. Where it
/// has not, the other states take it: of gains 1 % off on motions along or about one axis a third of that
/// bound is in h_x and h_y, and no residual is left. Where the biases are confounded with a parameter, a
/// hinge that is 1 mm off leaves none either.
#ifndef HEXLOAD_GAIN_ERRORS_H
#define HEXLOAD_GAIN_ERRORS_H

#include "hexload/momentum.h"
#include "momentum/delayed_tick.h"

/// Adds the changes of the forces of a tick, but of a lost one. Reentrant; some 80 instructions.
void hexload_gain_errors_step(hexload_gain_errors_t* self, const hexload_delayed_tick_t* past);

/// Begins with the next load. Each of its ticks has what one of all before had in the mean: biases have taken
/// that, and no more of it than they can tell. Reentrant; some 20 instructions.
void hexload_gain_errors_forget(hexload_gain_errors_t* self);

/// Widens sigmas by them: of what the biases are confounded with, and of all while some moment of platform
/// and load is not known to a half. Of a rig file's gains its directions tell. Reentrant; some 100
/// instructions.
/// @param confounded bit k: the biases are confounded with parameter k.
void hexload_gain_errors_widen(const hexload_gain_errors_t* self, const hexload_config_t* config,
                               const hexload_momentum_t* estimator, uint32_t confounded,
                               hexload_real_t sigma[HEXLOAD_LOAD_DIM]);

#endif
