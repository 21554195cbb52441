/// @file message_words.h
/// A CAN frame as the four words of the controller's FIFOs: identifier, length, data, data.
///
/// Two layouts: that of silicon (Zynq UltraScale+ Registers UG1087, CAN TXFIFO_ID ... RXFIFO_DATA2), and that
/// of QEMU's model of it, which hands on the words of its own frames. Everything else of the controller is
/// alike on both. The switch HEXLOAD_ZYNQMP_EMULATED chooses; both are compiled everywhere. Reentrant,
/// constant time.
#ifndef HEXLOAD_ZYNQMP_R5_MESSAGE_WORDS_H
#define HEXLOAD_ZYNQMP_R5_MESSAGE_WORDS_H

#include "bus/bus.h"

HEXLOAD_DECLS_BEGIN

typedef struct message_words {
    uint32_t id;
    uint32_t dlc;
    uint32_t data[2];
} message_words_t;

/// Identifier at 31:21, data bytes from the most significant one on.
void message_words_pack_silicon(const hexload_bus_frame_t* frame, message_words_t* words);
/// @return false: an extended or a remote frame, which the contract has not; the output is then undefined.
HEXLOAD_MUST_USE bool message_words_unpack_silicon(const message_words_t* words, hexload_bus_frame_t* frame);

/// Identifier at 10:0 with SocketCAN's flags above it, data bytes from the least significant one on.
void message_words_pack_emulated(const hexload_bus_frame_t* frame, message_words_t* words);
/// @return as message_words_unpack_silicon().
HEXLOAD_MUST_USE bool message_words_unpack_emulated(const message_words_t* words, hexload_bus_frame_t* frame);

/// The layout of the machine that the program is built for.
static inline void message_words_pack(const hexload_bus_frame_t* frame, message_words_t* words) {
#ifdef HEXLOAD_ZYNQMP_EMULATED
    message_words_pack_emulated(frame, words);
#else
    message_words_pack_silicon(frame, words);
#endif
}

HEXLOAD_MUST_USE static inline bool message_words_unpack(const message_words_t* words,
                                                         hexload_bus_frame_t* frame) {
#ifdef HEXLOAD_ZYNQMP_EMULATED
    return message_words_unpack_emulated(words, frame);
#else
    return message_words_unpack_silicon(words, frame);
#endif
}

HEXLOAD_DECLS_END

#endif
