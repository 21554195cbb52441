/// @file hexload.h
/// hexload: identifies the load on a Gough-Stewart platform, tick by tick. The header that applications
/// include.
///
///     static const hexload_config_t config = { ... }; // hexload_config_default() shows every field
///     static hexload_paper_t estimator;
///     status = hexload_paper_init(&estimator, &config);                     // once
///     status = hexload_paper_tick(&estimator, &config, &sample, &estimate); // every sampling period
///
/// All lasting memory is in hexload_paper_t: no heap, no hidden statics, so instances are independent.
/// The caller owns it and may copy it. No function blocks, allocates, prints or keeps a pointer.
#ifndef HEXLOAD_HEXLOAD_H
#define HEXLOAD_HEXLOAD_H

#include "hexload/config.h"
#include "hexload/leg_sample.h"
#include "hexload/kinematics.h"
#include "hexload/wrench.h"
#include "hexload/paper_filter.h"
#include "hexload/paper_supervisor.h"
#include "hexload/momentum.h"
#include "hexload/body.h"
#include "hexload/momentum_effects.h"

HEXLOAD_DECLS_BEGIN

typedef struct { // no tag: hexload is a namespace in C++
    hexload_leg_gate_t leg_gate;
    hexload_kinematics_t kinematics;
    hexload_paper_filter_t paper_filter;
    hexload_paper_supervisor_t supervisor;
    hexload_health_t health;
} hexload_paper_t;

/// Starts an estimator from nothing.
/// @return HEXLOAD_OK; HEXLOAD_ERR_CONFIG when hexload_config_check() refuses; HEXLOAD_ERR_POSE,
/// HEXLOAD_ERR_SINGULAR when
///         the geometry has no usable home pose. On refusal self does not change.
HEXLOAD_MUST_USE hexload_status_t hexload_paper_init(hexload_paper_t* self, const hexload_config_t* config);

/// One sampling period: leg sample -> motion -> wrench -> filter -> verdict.
/// @param config the one of hexload_paper_init().
/// @return HEXLOAD_OK or the status of the stage that refused; then self changes in health.refused only and
/// estimate not at
///         all. Reentrant for different self; not for an interrupt that shares one.
HEXLOAD_MUST_USE hexload_status_t hexload_paper_tick(hexload_paper_t* self, const hexload_config_t* config,
                                                     const hexload_leg_sample_t* sample,
                                                     hexload_estimate_t* estimate);

HEXLOAD_DECLS_END

#endif
