/// @file identifiability.h
/// Whether load and actuator effects can be identified together: what the sigma of a load parameter would be
/// if the effects were known.
///
/// Given the effects e, the covariance of theta is P_tt - P_te P_ee^-1 P_et. Eliminating one effect after the
/// other gives its diagonal: in turns, on a copy of the covariance, so a round takes twenty ticks.
#ifndef HEXLOAD_IDENTIFIABILITY_H
#define HEXLOAD_IDENTIFIABILITY_H

#include "hexload/estimate.h"
#include "actuator_effects/actuator_effects.h"

void hexload_identifiability_init(hexload_identifiability_t* self);

/// One sample of the filter. A parameter is confounded when its sigma would be less than half if the effects
/// were known, and when that half of its prior sigma at most: the motion has excited it.
/// Reentrant; a copy or an elimination at a time.
void hexload_identifiability_step(hexload_identifiability_t* self, const hexload_config_t* config,
                                  const hexload_momentum_filter_t* load,
                                  const hexload_actuator_effects_t* effects,
                                  const hexload_smooth_sample_t* sample);

/// A confounded parameter that has not converged is not converging either.
/// @param[in,out] estimate verdicts. @param[in,out] health sets NOT_EXCITED.
void hexload_identifiability_judge(const hexload_identifiability_t* self, hexload_estimate_t* estimate,
                                   uint32_t* health);

#endif
