/// @file answer_assembly.h
/// Answers from frames, in either profile: the reader's side (simulator, bridge, monitors).
///
/// FD: an answer begins with the first frame of a later tick, or with an estimate of any other; it is whole
/// when estimate, sigma and health of one tick and filter have come, in any order: a network may change it.
/// Until the next one begins, one that lacks frames is not counted as incomplete. Classic:
/// it begins with page 0, which names the filter, and is whole when all hexload_bus_answer_pages() of it have
/// come one after the other, without so long a gap that a whole round may be missing; all describe the tick
/// of page 0, and so an answer is two ticks old for each page when it is whole: 24 (paper) or 50 (momentum).
#ifndef HEXLOAD_BUS_ANSWER_ASSEMBLY_H
#define HEXLOAD_BUS_ANSWER_ASSEMBLY_H

#include "bus/bus.h"

HEXLOAD_DECLS_BEGIN

typedef struct hexload_answer_assembly {
    hexload_bus_profile_t profile;
    hexload_bus_answer_t answer;
    uint32_t parts;      ///< bit n: part n of answer.tick has come; 0: none has begun
    uint32_t page_tick;  ///< classic: of the last page used
    uint32_t incomplete; ///< answers given up, saturating
} hexload_answer_assembly_t;

void hexload_answer_assembly_init(hexload_answer_assembly_t* self, hexload_bus_profile_t profile);

/// Takes one frame.
/// @param near_tick the tick of the newest sample: completes the 14 tick bits of a classic page.
/// @param[out] answered_tick tick of the sample that the controller had just processed when it sent this
///             frame; written with HEXLOAD_BUS_OK and HEXLOAD_BUS_PARTIAL, also for a frame of an answer
///             whose beginning was lost. For lockstep: FD answers each sample with the frame that makes the
///             answer whole, classic each sample whose tick is a multiple of HEXLOAD_BUS_ANSWER_PERIOD with
///             one page.
/// @param[out] answer written with HEXLOAD_BUS_OK only.
/// @return as hexload_sample_assembly_add().
HEXLOAD_MUST_USE hexload_bus_status_t hexload_answer_assembly_add(hexload_answer_assembly_t* self,
                                                                  const hexload_bus_frame_t* frame,
                                                                  uint32_t near_tick, uint32_t* answered_tick,
                                                                  hexload_bus_answer_t* answer);

HEXLOAD_DECLS_END

#endif
