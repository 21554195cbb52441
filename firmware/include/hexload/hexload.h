/// @file hexload.h
/// hexload: identifies the load on a Gough-Stewart platform, tick by tick. The header that applications
/// include: one estimator of the kind that the configuration names.
///
///     static const hexload_config_t config = { ... }; // hexload_config_default() shows every field
///     static hexload_t estimator;
///     status = hexload_init(&estimator, &config);                     // once
///     status = hexload_tick(&estimator, &config, &sample, &estimate); // every sampling period
///
/// All lasting memory is in hexload_t: no heap, no hidden statics, so instances are independent. The caller
/// owns it and may copy it. No function blocks, allocates, prints or keeps a pointer. hexload_t has room for
/// any kind and links all of them; momentum.h and paper.h are for a controller that wants a single one.
#ifndef HEXLOAD_HEXLOAD_H
#define HEXLOAD_HEXLOAD_H

#include "hexload/momentum.h"
#include "hexload/paper.h"

HEXLOAD_DECLS_BEGIN

enum {
    HEXLOAD_UNKNOWNS_MAX = +HEXLOAD_LOAD_DIM + +HEXLOAD_EFFECTS_DIM,
    /// Numbers of a symmetric matrix of all unknowns, the lower triangle by rows.
    HEXLOAD_COVARIANCES_MAX = HEXLOAD_UNKNOWNS_MAX * (HEXLOAD_UNKNOWNS_MAX + 1) / 2,
};

/// Name and unit of one unknown.
typedef struct hexload_unknown {
    const char* name; ///< as the estimates file and the bus have it, e.g. "hx"
    const char* unit; ///< SI, e.g. "kg m"
} hexload_unknown_t;

/// What an estimator of a kind estimates.
typedef struct hexload_descriptor {
    const char* name;                 ///< of the kind, as platform files have it
    uint32_t parameters;              ///< of the load: 10 or 4
    uint32_t effects;                 ///< of the machine: 20 or 0; unknowns after the parameters
    uint32_t measurements;            ///< degrees of freedom of the NIS: 6 or 3
    const hexload_unknown_t* unknown; ///< parameters + effects of them
} hexload_descriptor_t;

typedef struct {                             // no tag: hexload is a namespace in C++
    hexload_kind_t kind;                     ///< of the instance; set by hexload_init()
    hexload_differentiator_t differentiator; ///< of legs without velocity sensors
    union {
        hexload_momentum_t momentum;
        hexload_momentum_effects_t momentum_effects;
        hexload_paper_t paper;
    } as; ///< the member that kind names
} hexload_t;

/// Descriptor of a kind; NULL for a number that is none. Static storage.
const hexload_descriptor_t* hexload_describe(hexload_kind_t kind);

/// Starts an estimator of config->kind from nothing.
/// @return HEXLOAD_OK; HEXLOAD_ERR_CONFIG when hexload_config_check() refuses; HEXLOAD_ERR_POSE,
///         HEXLOAD_ERR_SINGULAR when the geometry has no usable home pose. On refusal self does not change.
HEXLOAD_MUST_USE hexload_status_t hexload_init(hexload_t* self, const hexload_config_t* config);

/// One sampling period. Without velocity sensors (config.h, half_window_ticks) the velocities of a sample
/// mean nothing, the estimator is given the channels of half a window ago, and a sample is refused half a
/// window later when its legs have no pose. Until a window is complete the estimate is the prior; after a gap
/// of more than four samples it is left as it was for a window: give the same one at each tick.
/// @param config the one of hexload_init(), or one that differs from it in numbers only.
/// @param[in,out] estimate that of the last tick, and of this one when its sample was accepted.
/// @return HEXLOAD_OK or the status of the stage that refused; then estimate does not change, and self only
///         in its health's `refused` and in what the front end remembers of the samples as they came.
///         Reentrant for different self; not for an interrupt that shares one. Worst case: that of the kind,
///         in firmware/README.md.
HEXLOAD_MUST_USE hexload_status_t hexload_tick(hexload_t* self, const hexload_config_t* config,
                                               const hexload_leg_sample_t* sample,
                                               hexload_estimate_t* estimate);

/// hexload_tick() that also hands out its measurement update: some 200 instructions more.
/// @param[out] trace of an accepted tick; unchanged when the sample was refused.
HEXLOAD_MUST_USE hexload_status_t hexload_trace(hexload_t* self, const hexload_config_t* config,
                                                const hexload_leg_sample_t* sample,
                                                hexload_estimate_t* estimate, hexload_trace_t* trace);

/// Values, sigmas and NIS as they stand, also before the first sample, when they are the prior's. Verdicts
/// come with a tick: here all are `not_excited`, and tick is 0.
void hexload_read(const hexload_t* self, hexload_estimate_t* estimate);

/// Actuator effects.
/// @param estimate that of the last tick.
/// @return false, and effects as it was, when the kind has none.
bool hexload_read_effects(const hexload_t* self, const hexload_estimate_t* estimate,
                          hexload_effects_estimate_t* effects);

/// Health bits of the last accepted tick, and counters since hexload_init(). Never NULL; lives as self does.
const hexload_health_t* hexload_health(const hexload_t* self);

/// Covariance of all unknowns in the descriptor's order, lower triangle by rows, products of their units; its
/// diagonal are the squares of hexload_estimate_t::sigma. Not for the tick: some 7,000 instructions, 36,000
/// with actuator effects.
/// @return numbers written: n (n + 1) / 2 of n unknowns.
uint32_t hexload_covariance(const hexload_t* self, hexload_real_t covariance[HEXLOAD_COVARIANCES_MAX]);

HEXLOAD_DECLS_END

#endif
