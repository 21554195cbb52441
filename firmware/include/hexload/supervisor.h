/// @file supervisor.h
/// Fifth stage: whether the estimate can be believed.
#ifndef HEXLOAD_SUPERVISOR_H
#define HEXLOAD_SUPERVISOR_H

#include "hexload/paper_filter.h"

HEXLOAD_DECLS_BEGIN

/// What is known about one parameter, or about all (then the worst of them). A larger value is worse.
typedef enum hexload_verdict {
    HEXLOAD_VERDICT_CONVERGED,    ///< sigma below converged_relative_sigma of value or prior
    HEXLOAD_VERDICT_CONVERGING,   ///< sigma has fallen below half the prior's
    HEXLOAD_VERDICT_NOT_EXCITED,  ///< the motion has told (nearly) nothing about it
    HEXLOAD_VERDICT_INCONSISTENT, ///< innovations or inertia contradict the model or the stated sigmas
} hexload_verdict_t;

typedef struct hexload_supervisor {
    hexload_real_t nis_mean; ///< leaky mean; starts at its ideal, 3
} hexload_supervisor_t;

/// Estimate of one tick.
typedef struct hexload_estimate {
    uint32_t tick;
    hexload_real_t value[HEXLOAD_PAPER_DIM]; ///< dz m; Ixx, Iyy, Izz kg m^2 about the load's centre of mass
    hexload_real_t sigma[HEXLOAD_PAPER_DIM]; ///< standard deviation of each, same units
    hexload_verdict_t parameter_verdict[HEXLOAD_PAPER_DIM];
    hexload_verdict_t verdict; ///< the worst of the four
    hexload_real_t nis;        ///< normalised innovation squared of this tick; ideal mean 3
    hexload_real_t nis_mean;   ///< over nis_time_constant_s
} hexload_estimate_t;

void hexload_supervisor_init(hexload_supervisor_t* self);

/// Fills in the estimate from the filter and judges it.
/// @param[in,out] health sets NOT_EXCITED, INCONSISTENT. Reentrant, constant time.
void hexload_supervisor_judge(hexload_supervisor_t* self, const hexload_config_t* config,
                              const hexload_paper_filter_t* filter, hexload_estimate_t* estimate,
                              uint32_t* health);

/// "converged", "converging", "not_excited" or "inconsistent". Static storage.
const char* hexload_verdict_name(hexload_verdict_t verdict);

HEXLOAD_DECLS_END

#endif
