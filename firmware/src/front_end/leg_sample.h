/// @file leg_sample.h
/// First stage: what the legs' sensors said at one tick, and whether it can be used.
#ifndef HEXLOAD_LEG_SAMPLE_H
#define HEXLOAD_LEG_SAMPLE_H

#include "hexload/state.h"

/// Of a displacement's noise, granted beyond what its leg can have moved.
#define HEXLOAD_REACH_SIGMAS HEXLOAD_REAL(10.0)

void hexload_leg_sample_init(hexload_leg_gate_t* self);

/// Checks a sample: finite and in range, every leg longer than nothing, later than the last, and no leg
/// farther from there than its range of speed allows: a spike, which would mislead for as long as a window
/// holds it. A source that starts its tick counter anew needs hexload_paper_init().
/// @param[out] gap_ticks periods since the last accepted sample: 1 when none is missing, 0 for the first
/// sample.
/// @param[in,out] health sets LEG_OUT_OF_STROKE, SAMPLE_MISSING.
/// @return HEXLOAD_OK, HEXLOAD_ERR_SAMPLE, HEXLOAD_ERR_TICK. self does not change:
/// hexload_leg_sample_accept() does that
///         once the later stages have taken the sample too.
HEXLOAD_MUST_USE hexload_status_t hexload_leg_sample_check(const hexload_leg_gate_t* self,
                                                           const hexload_config_t* config,
                                                           const hexload_leg_sample_t* sample,
                                                           uint32_t* gap_ticks, uint32_t* health);

/// Remembers the sample's tick and displacements.
void hexload_leg_sample_accept(hexload_leg_gate_t* self, const hexload_leg_sample_t* sample);

#endif
