/// @file frame.h
/// What all frames of hexload.dbc have in common. Internal to firmware/bus.
///
/// Frames longer than 8 bytes have the FD format, all others the classic one. A checksum stands in a frame's
/// last bytes and goes over all bytes before it; its size says which one it is.
#ifndef HEXLOAD_BUS_FRAME_H
#define HEXLOAD_BUS_FRAME_H

#include "bus/bus.h"

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

/// Sets identifier, format and length; all bytes 0.
void hexload_frame_begin(hexload_bus_frame_t* frame, const hexload_frame_layout_t* layout);

/// Writes the checksum over the bytes before it.
void hexload_frame_seal(hexload_bus_frame_t* frame, const hexload_frame_layout_t* layout);

/// Whether length and format are those of the layout.
bool hexload_frame_fits(const hexload_bus_frame_t* frame, const hexload_frame_layout_t* layout);

/// @return HEXLOAD_BUS_OK, _OTHER, _ERR_LENGTH or _ERR_CRC.
HEXLOAD_MUST_USE hexload_bus_status_t hexload_frame_check(const hexload_bus_frame_t* frame,
                                                          const hexload_frame_layout_t* layout);

#endif
