/// @file paper.h
/// The paper's estimator, corrected: height of the centre of mass and three central inertias of a load whose
/// mass is known. EQUATIONS.md has its equations, (24)-(36), and the reason of every deviation.
///
///     static hexload_paper_t estimator;
///     status = hexload_paper_init(&estimator, &config);                     // once
///     status = hexload_paper_tick(&estimator, &config, &sample, &estimate); // every sampling period
///
/// A fifth of the recommended estimator's work and a twelfth of its memory. A load that is not on the
/// platform's z axis, or has products of inertia, ends as inconsistent or as a misfit of the model.
#ifndef HEXLOAD_PAPER_H
#define HEXLOAD_PAPER_H

#include "hexload/state.h"

HEXLOAD_DECLS_BEGIN

typedef struct hexload_paper {
    hexload_leg_gate_t leg_gate;               ///< last accepted sample
    hexload_kinematics_t kinematics;           ///< at the present tick
    hexload_noise_estimator_t noise_estimator; ///< measured sigmas of the sensors
    hexload_lost_channels_t lost;              ///< what the samples lack
    hexload_plausibility_t plausibility;       ///< whether channels contradict each other
    hexload_known_mass_t known_mass;           ///< whether the legs carry the stated mass
    hexload_paper_filter_t filter;             ///< rates and four parameters
    hexload_residual_test_t residual_test;   ///< whether the filter's innovations are noise over half seconds
    hexload_hum_test_t hum_test;             ///< whether they hum
    hexload_paper_supervisor_t supervisor;   ///< verdicts
    uint32_t held_ticks;                     ///< for which the filter has waited for a force that is missing
    hexload_health_t health;                 ///< bits and counters
} hexload_paper_t;

/// As hexload_momentum_init() (momentum.h).
HEXLOAD_MUST_USE hexload_status_t hexload_paper_init(hexload_paper_t* self, const hexload_config_t* config);

/// One sampling period: leg sample -> motion -> wrench -> filter -> verdict.
/// @return as hexload_momentum_tick() (momentum.h), and likewise reentrant.
HEXLOAD_MUST_USE hexload_status_t hexload_paper_tick(hexload_paper_t* self, const hexload_config_t* config,
                                                     const hexload_leg_sample_t* sample,
                                                     hexload_estimate_t* estimate);

/// hexload_paper_tick() that also hands out its measurement update. @param[out] trace of an accepted tick.
HEXLOAD_MUST_USE hexload_status_t hexload_paper_trace(hexload_paper_t* self, const hexload_config_t* config,
                                                      const hexload_leg_sample_t* sample,
                                                      hexload_estimate_t* estimate, hexload_trace_t* trace);

HEXLOAD_DECLS_END

#endif
