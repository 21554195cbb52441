/// @file momentum_effects.h
/// The momentum estimator with the machine's own effects as unknowns: force sensors' biases and the legs'
/// friction, found together with the load.
///
///     static hexload_momentum_effects_t estimator;
///     status = hexload_momentum_effects_init(&estimator, &config);                     // once
///     status = hexload_momentum_effects_tick(&estimator, &config, &sample, &estimate); // every sampling
///     period hexload_momentum_effects_read(&estimator, &estimate, &answer);                   // when wanted
///
/// As for hexload_momentum_t: all lasting memory is in the caller's struct, instances are independent.
#ifndef HEXLOAD_MOMENTUM_EFFECTS_H
#define HEXLOAD_MOMENTUM_EFFECTS_H

#include "hexload/momentum.h"
#include "hexload/identifiability.h"

HEXLOAD_DECLS_BEGIN

typedef struct hexload_momentum_effects {
    hexload_momentum_t momentum; ///< its filter holds theta, mu and their covariance
    hexload_actuator_effects_t filter;
    hexload_identifiability_t identifiability;
} hexload_momentum_effects_t;

/// What is known beside the load.
typedef struct hexload_effects_estimate {
    hexload_real_t value[HEXLOAD_EFFECTS_DIM]; ///< order and units of enum hexload_actuator_effect
    hexload_real_t sigma[HEXLOAD_EFFECTS_DIM];
    uint32_t confounded_with_bias;     ///< bit k: load parameter k has not converged, as the biases hide it
    uint32_t confounded_with_friction; ///< bit k: as friction hides it
    hexload_real_t fastest_leg_m_s;    ///< of late; fades over excitation_time_constant_s
} hexload_effects_estimate_t;

/// Starts an estimator from nothing.
/// @return as hexload_paper_init().
HEXLOAD_MUST_USE hexload_status_t hexload_momentum_effects_init(hexload_momentum_effects_t* self,
                                                                const hexload_config_t* config);

/// One sampling period, as hexload_momentum_tick(). A new load leaves what is known of the machine.
/// @return as hexload_paper_tick().
HEXLOAD_MUST_USE hexload_status_t hexload_momentum_effects_tick(hexload_momentum_effects_t* self,
                                                                const hexload_config_t* config,
                                                                const hexload_leg_sample_t* sample,
                                                                hexload_estimate_t* estimate);

/// Effects of the machine, and whether they can be told from the load. Reentrant, constant time.
/// @param estimate that of the last tick.
void hexload_momentum_effects_read(const hexload_momentum_effects_t* self, const hexload_estimate_t* estimate,
                                   hexload_effects_estimate_t* answer);

HEXLOAD_DECLS_END

#endif
