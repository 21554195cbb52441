/// @file frame.h
/// What all frames of hexload.dbc have in common. Internal to firmware/bus.
///
/// Frames longer than 8 bytes have the FD format, all others the classic one. A checksum stands in a frame's
/// last bytes and goes over all bytes before it; its size says which one it is.
#ifndef HEXLOAD_BUS_FRAME_H
#define HEXLOAD_BUS_FRAME_H

#include "bus/bus.h"
#include "bus/crc.h"

#include <stddef.h>

enum {
    HEXLOAD_FRAME_NO_CRC = 0,
    HEXLOAD_FRAME_CRC8 = 1, ///< bytes of the checksum
    HEXLOAD_FRAME_CRC16 = 2,
    HEXLOAD_FRAME_CRC32 = 4,
};

/// What the DBC says of one frame.
typedef struct hexload_frame_layout {
    uint32_t id;
    uint8_t length;
    uint8_t crc_bytes;
} hexload_frame_layout_t;

// Inline, as most callers know the layout when they are compiled.

static inline bool hexload_frame_is_fd(const hexload_frame_layout_t* layout) {
    return layout->length > 8;
}

static inline uint32_t hexload_frame_checksum(const hexload_bus_frame_t* frame,
                                              const hexload_frame_layout_t* layout) {
    const size_t count = (size_t)layout->length - layout->crc_bytes;
    switch (layout->crc_bytes) {
    case HEXLOAD_FRAME_CRC8:
        return hexload_crc8(frame->data, count);
    case HEXLOAD_FRAME_CRC16:
        return hexload_crc16(frame->data, count);
    case HEXLOAD_FRAME_CRC32:
        return hexload_crc32(frame->data, count);
    default:
        return 0;
    }
}

/// Sets identifier, format and length. The codec writes the bytes, all of them.
static inline void hexload_frame_begin(hexload_bus_frame_t* frame, const hexload_frame_layout_t* layout) {
    frame->id = layout->id;
    frame->is_fd = hexload_frame_is_fd(layout);
    frame->length = layout->length;
}

/// Writes the checksum over the bytes before it.
static inline void hexload_frame_seal(hexload_bus_frame_t* frame, const hexload_frame_layout_t* layout) {
    const uint32_t crc = hexload_frame_checksum(frame, layout);
    uint8_t* bytes = &frame->data[layout->length - layout->crc_bytes];
    for (unsigned n = 0; n < layout->crc_bytes; n++) {
        bytes[n] = (uint8_t)(crc >> (8 * n) & 0xFFu);
    }
}

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

/// Whether length and format are those of the layout.
static inline bool hexload_frame_fits(const hexload_bus_frame_t* frame,
                                      const hexload_frame_layout_t* layout) {
    return frame->length == layout->length && frame->is_fd == hexload_frame_is_fd(layout);
}

/// @return HEXLOAD_BUS_OK, _OTHER, _ERR_LENGTH or _ERR_CRC.
HEXLOAD_MUST_USE static inline hexload_bus_status_t
hexload_frame_check(const hexload_bus_frame_t* frame, const hexload_frame_layout_t* layout) {
    if (frame->id != layout->id) {
        return HEXLOAD_BUS_OTHER;
    }
    if (!hexload_frame_fits(frame, layout)) {
        return HEXLOAD_BUS_ERR_LENGTH;
    }
    const uint8_t* bytes = &frame->data[layout->length - layout->crc_bytes];
    uint32_t found = 0;
    for (unsigned n = 0; n < layout->crc_bytes; n++) {
        found |= (uint32_t)bytes[n] << (8 * n);
    }
    return found == hexload_frame_checksum(frame, layout) ? HEXLOAD_BUS_OK : HEXLOAD_BUS_ERR_CRC;
}

#endif
