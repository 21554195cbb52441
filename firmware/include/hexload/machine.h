/// @file machine.h
/// The momentum estimator with the machine's own effects as unknowns: force sensors' biases and the legs'
/// friction, found together with the load.
///
///     static hexload_machine_t estimator;
///     status = hexload_machine_init(&estimator, &config);                     // once
///     status = hexload_machine_tick(&estimator, &config, &sample, &estimate); // every sampling period
///     hexload_machine_read(&estimator, &estimate, &answer);                   // when wanted
///
/// As for hexload_momentum_t: all lasting memory is in the caller's struct, instances are independent.
#ifndef HEXLOAD_MACHINE_H
#define HEXLOAD_MACHINE_H

#include "hexload/momentum.h"
#include "hexload/separation.h"

HEXLOAD_DECLS_BEGIN

typedef struct hexload_machine {
    hexload_momentum_t momentum; ///< its filter holds theta, mu and their covariance
    hexload_machine_filter_t filter;
    hexload_separation_t separation;
} hexload_machine_t;

/// What is known beside the load.
typedef struct hexload_machine_answer {
    hexload_real_t value[HEXLOAD_MACHINE_DIM]; ///< order and units of enum hexload_machine_effect
    hexload_real_t sigma[HEXLOAD_MACHINE_DIM];
    uint32_t hidden_by_bias;        ///< bit k: load parameter k has not converged, as the biases hide it
    uint32_t hidden_by_friction;    ///< bit k: as friction hides it
    hexload_real_t fastest_leg_m_s; ///< of late; fades over excitation_time_constant_s
} hexload_machine_answer_t;

/// Starts an estimator from nothing.
/// @return as hexload_init().
HEXLOAD_MUST_USE hexload_status_t hexload_machine_init(hexload_machine_t* self,
                                                       const hexload_config_t* config);

/// One sampling period, as hexload_momentum_tick(). A new load leaves what is known of the machine.
/// @return as hexload_tick().
HEXLOAD_MUST_USE hexload_status_t hexload_machine_tick(hexload_machine_t* self,
                                                       const hexload_config_t* config,
                                                       const hexload_leg_sample_t* sample,
                                                       hexload_estimate_t* estimate);

/// Effects of the machine, and whether they can be told from the load. Reentrant, constant time.
/// @param estimate that of the last tick.
void hexload_machine_read(const hexload_machine_t* self, const hexload_estimate_t* estimate,
                          hexload_machine_answer_t* answer);

HEXLOAD_DECLS_END

#endif
