/// @file identifiability.h
/// Whether load and machine can be told from each other: what the sigma of a load parameter would be if the
/// machine's effects were known.
///
/// Given the effects e, the covariance of theta is P_tt - P_te P_ee^-1 P_et. Eliminating one effect after the
/// other gives its diagonal: one in each tick, on a copy of the covariance, so a round takes twenty ticks.
#ifndef HEXLOAD_IDENTIFIABILITY_H
#define HEXLOAD_IDENTIFIABILITY_H

#include "hexload/estimate.h"
#include "hexload/actuator_effects.h"

HEXLOAD_DECLS_BEGIN

typedef struct hexload_identifiability {
    hexload_real_t effects[HEXLOAD_EFFECTS_DIM * (HEXLOAD_EFFECTS_DIM + 1) / 2]; ///< P_ee, lower triangle
    hexload_real_t cross[HEXLOAD_LOAD_DIM][HEXLOAD_EFFECTS_DIM];                 ///< P_te
    hexload_real_t variance[HEXLOAD_LOAD_DIM];       ///< of theta, given the effects eliminated so far
    hexload_real_t before[HEXLOAD_LOAD_DIM];         ///< with none eliminated
    hexload_real_t given_bias[HEXLOAD_LOAD_DIM];     ///< with the biases eliminated
    hexload_real_t least_pivot[HEXLOAD_EFFECTS_DIM]; ///< below, what is left of P_ee is rounding
    uint32_t next;                                   ///< effect to eliminate; HEXLOAD_EFFECTS_DIM: copy first
    uint32_t bias_mask;             ///< bit k: the biases hide parameter k, as of the last round
    uint32_t friction_mask;         ///< bit k: friction does
    hexload_real_t fastest_leg_m_s; ///< fades over excitation_time_constant_s
} hexload_identifiability_t;

void hexload_identifiability_init(hexload_identifiability_t* self);

/// One sample of the filter. A parameter is hidden when its sigma would be less than half if the effects were
/// known, and when that half of its prior sigma at most: the motion has told something.
/// Reentrant; a copy or an elimination at a time.
void hexload_identifiability_step(hexload_identifiability_t* self, const hexload_config_t* config,
                                  const hexload_momentum_filter_t* load,
                                  const hexload_actuator_effects_t* machine,
                                  const hexload_smooth_sample_t* sample);

/// A hidden parameter that has not converged is not converging either.
/// @param[in,out] estimate verdicts. @param[in,out] health sets NOT_EXCITED.
void hexload_identifiability_judge(const hexload_identifiability_t* self, hexload_estimate_t* estimate,
                                   uint32_t* health);

HEXLOAD_DECLS_END

#endif
