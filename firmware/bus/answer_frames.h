/// @file answer_frames.h
/// Single frames of an answer. Internal to firmware/bus: hexload_bus_encode_answer() writes them,
/// answer_assembly.h puts them together.
#ifndef HEXLOAD_BUS_ANSWER_FRAMES_H
#define HEXLOAD_BUS_ANSWER_FRAMES_H

#include "bus/bus.h"

/// Parts of an FD answer, in sending order, whichever filter's it is. Parts of a classic answer are its
/// pages.
enum {
    HEXLOAD_ANSWER_ESTIMATE = 0,
    HEXLOAD_ANSWER_SIGMA = 1,
    HEXLOAD_ANSWER_HEALTH = 2,
};

/// Of which a classic page tells one.
enum { HEXLOAD_ANSWER_TICKS = 1 << 14 };

/// Puts one FD frame into answer, its tick and filter too; the other fields stay.
/// @param[out] part which one it was.
/// @return HEXLOAD_BUS_OK, _OTHER, _ERR_LENGTH, _ERR_CRC, _ERR_VALUE; the outputs change with OK only.
///         Likewise below.
HEXLOAD_MUST_USE hexload_bus_status_t hexload_answer_decode_fd(const hexload_bus_frame_t* frame, int* part,
                                                               hexload_bus_answer_t* answer);

/// Puts one classic page into answer, but not its tick. Page 0 names the filter.
/// @param[out] page its place in a round of answer->filter; -1: such rounds have no such page.
/// @param[out] tick_low low 14 bits of the tick of the sample that the controller had just processed.
HEXLOAD_MUST_USE hexload_bus_status_t hexload_answer_decode_page(const hexload_bus_frame_t* frame, int* page,
                                                                 uint16_t* tick_low,
                                                                 hexload_bus_answer_t* answer);

/// As hexload_sample_check_profile(), for answers.
HEXLOAD_MUST_USE hexload_bus_status_t hexload_answer_check_profile(const hexload_bus_frame_t* frame,
                                                                   hexload_bus_profile_t own_profile);

#endif
