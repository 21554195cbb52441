/// @file paper_supervisor.h
/// Fifth stage: whether the estimate can be trusted.
#ifndef HEXLOAD_PAPER_SUPERVISOR_H
#define HEXLOAD_PAPER_SUPERVISOR_H

#include "hexload/estimate.h"
#include "paper/paper_filter.h"

void hexload_paper_supervisor_init(hexload_paper_supervisor_t* self);

/// Fills in the estimate from the filter and judges it.
/// @param mismatch factor by which the filter's sigmas are too small for what lasts in its innovations; 1:
/// none.
/// @param weight_error share by which the weight is not that of the given masses (hexload_known_mass_t).
/// @return health bits: NOT_EXCITED, INCONSISTENT, MODEL_MISFIT. Reentrant, constant time.
uint32_t hexload_paper_supervisor_judge(hexload_paper_supervisor_t* self, const hexload_config_t* config,
                                        const hexload_paper_filter_t* filter, hexload_real_t mismatch,
                                        hexload_real_t weight_error, hexload_estimate_t* estimate);

/// Of the last tick: the factor that sigmas needed, beside `mismatch`, for some body to have the values; 1 or
/// more. @param mismatch as of that tick.
hexload_real_t hexload_paper_supervisor_possible(const hexload_paper_supervisor_t* self,
                                                 hexload_real_t mismatch);

#endif
