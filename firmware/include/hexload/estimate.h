/// @file estimate.h
/// What the estimators say of one tick.
#ifndef HEXLOAD_ESTIMATE_H
#define HEXLOAD_ESTIMATE_H

#include "hexload/status.h"

HEXLOAD_DECLS_BEGIN

enum { HEXLOAD_PARAMETERS_MAX = 10 };

/// What is known about one parameter, or about all (then the worst of them). A larger value is worse.
typedef enum hexload_verdict {
    HEXLOAD_VERDICT_CONVERGED,    ///< sigma below converged_relative_sigma of the parameter's scale
    HEXLOAD_VERDICT_CONVERGING,   ///< the motion is telling more
    HEXLOAD_VERDICT_NOT_EXCITED,  ///< the motion has told (nearly) nothing about it
    HEXLOAD_VERDICT_INCONSISTENT, ///< innovations or the estimate contradict the model or the stated sigmas
} hexload_verdict_t;

typedef struct hexload_estimate {
    uint32_t tick;
    /// Paper's filter: the first four, enum hexload_paper_parameter. Momentum filter: all ten, enum
    /// hexload_load_parameter.
    hexload_real_t value[HEXLOAD_PARAMETERS_MAX];
    hexload_real_t sigma[HEXLOAD_PARAMETERS_MAX]; ///< standard deviation of each, same units
    hexload_real_t
        own_sigma[HEXLOAD_PARAMETERS_MAX]; ///< the filter's part of it, without what of the rig is open
    hexload_verdict_t parameter_verdict[HEXLOAD_PARAMETERS_MAX];
    hexload_verdict_t verdict; ///< the worst of them
    hexload_real_t nis;        ///< normalised innovation squared; ideal mean 3 (paper) or 6 (momentum)
    hexload_real_t nis_mean;   ///< over nis_time_constant_s
} hexload_estimate_t;

/// "converged", "converging", "not_excited" or "inconsistent". Static storage.
const char* hexload_verdict_name(hexload_verdict_t verdict);

HEXLOAD_DECLS_END

#endif
