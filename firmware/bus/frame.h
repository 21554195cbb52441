/// @file frame.h
/// What all frames of hexload.dbc have in common. Internal to firmware/bus.
///
/// Frames longer than 8 bytes have the FD format, all others the classic one. Each is protected end to end,
/// in the manner of AUTOSAR's "E2E Protocol Specification":
///
/// - Classic: Profile 22. CRC-8H2F in byte 0, a counter in the low half of byte 1. The CRC is over the bytes
///   after it and the Data ID, whose list of sixteen is of one number: a Data ID that changes with the
///   counter would cost the CRC its Hamming distance of 4.
/// - FD: as Profile 4, without its header. CRC-32P4 in the last four bytes, over the bytes before it and the
///   Data ID; the tick, which stands in the first four, is the counter.
///
/// The Data ID is not sent: a frame that comes under another's identifier has a wrong checksum.
#ifndef HEXLOAD_BUS_FRAME_H
#define HEXLOAD_BUS_FRAME_H

#include "bus/bus.h"

enum { HEXLOAD_FRAME_COUNTS = 16 }; ///< of the counter of Profile 22

/// What the DBC says of one frame.
typedef struct hexload_frame_layout {
    uint32_t id;
    uint8_t length;
} hexload_frame_layout_t;

static inline bool hexload_frame_is_fd(const hexload_frame_layout_t* layout) {
    return layout->length > 8;
}

/// The low four bits of a number that goes up by one from frame to frame.
static inline uint8_t hexload_frame_counter(uint32_t number) {
    return (uint8_t)(number % (uint32_t)HEXLOAD_FRAME_COUNTS);
}

/// Sets identifier, format and length. The codec writes the bytes, all of them.
static inline void hexload_frame_begin(hexload_bus_frame_t* frame, const hexload_frame_layout_t* layout) {
    frame->id = layout->id;
    frame->is_fd = hexload_frame_is_fd(layout);
    frame->length = layout->length;
}

/// Writes the checksum.
void hexload_frame_seal(hexload_bus_frame_t* frame, const hexload_frame_layout_t* layout);

/// @return HEXLOAD_BUS_OK, _OTHER, _ERR_LENGTH or _ERR_CRC.
HEXLOAD_MUST_USE hexload_bus_status_t hexload_frame_check(const hexload_bus_frame_t* frame,
                                                          const hexload_frame_layout_t* layout);

/// Code of the input fault's leg: 1..6, or 0 for none in particular.
static inline uint8_t hexload_frame_leg_code(const hexload_input_fault_t* input) {
    return (uint8_t)(input->leg < (uint32_t)HEXLOAD_LEGS ? input->leg + 1 : 0);
}

/// An input fault's cause from its code. One that is not known yet has no words.
static inline hexload_input_cause_t hexload_frame_input_cause(uint8_t code) {
    return code < (uint8_t)HEXLOAD_INPUT_CAUSES ? (hexload_input_cause_t)code : HEXLOAD_INPUT_CAUSES;
}

/// Its leg from its code.
static inline uint32_t hexload_frame_input_leg(uint8_t code) {
    return code > 0 && code <= HEXLOAD_LEGS ? (uint32_t)code - 1 : (uint32_t)HEXLOAD_LEGS;
}

#endif
