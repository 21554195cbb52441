/// @file slcan.h
/// Classic CAN frames as text on a serial line, in the format of Lawicel's adapters (SLCAN): `tIIILDD..` and
/// a carriage return, III the identifier, L the length, DD the bytes, all in hexadecimal digits.
///
/// Source: LAWICEL, CANUSB manual, ASCII commands. Commands of a host to an adapter (open, close, bit rate)
/// are passed over without an answer, for python-can, slcand and the `slcan:` bus of the Linux port wait for
/// none. Reentrant, keeps no pointer.
#ifndef HEXLOAD_BUS_SLCAN_H
#define HEXLOAD_BUS_SLCAN_H

#include "bus/bus.h"

HEXLOAD_DECLS_BEGIN

enum {
    HEXLOAD_SLCAN_FRAME_BYTES = 22, ///< longest text of a frame, carriage return included
    HEXLOAD_SLCAN_LINE_BYTES = 25, ///< longest line of a frame that comes in, without the return: with a time
};

/// Puts bytes together again; the counters saturate.
typedef struct hexload_slcan {
    uint32_t passed_over; ///< lines without a frame of ours: commands, acknowledges, extended, remote, FD
    uint32_t dropped;     ///< lines that are none of the format
    uint32_t refusals;    ///< bells: the adapter could not do what it was asked
    uint8_t length;       ///< of the line so far; beyond HEXLOAD_SLCAN_LINE_BYTES only that it is too long
    char line[HEXLOAD_SLCAN_LINE_BYTES];
} hexload_slcan_t;

/// Writes a frame's text, digits above 9 as capitals, without a terminating zero.
/// @return number of bytes, 6..HEXLOAD_SLCAN_FRAME_BYTES; HEXLOAD_BUS_ERR_LENGTH: FD or longer than 8 bytes;
///         HEXLOAD_BUS_ERR_VALUE: the identifier has more than 11 bits. Then the text is unchanged.
HEXLOAD_MUST_USE int hexload_slcan_encode(const hexload_bus_frame_t* frame,
                                          char text[HEXLOAD_SLCAN_FRAME_BYTES]);

void hexload_slcan_init(hexload_slcan_t* self);

/// One received byte. After garbage, or a line too long, the next line is read again. The four digits of an
/// adapter's time may follow a frame. Constant time.
/// @param[out] frame changes with true only.
/// @return whether the byte has ended a frame.
HEXLOAD_MUST_USE bool hexload_slcan_take(hexload_slcan_t* self, char byte, hexload_bus_frame_t* frame);

HEXLOAD_DECLS_END

#endif
