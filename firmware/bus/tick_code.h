/// @file tick_code.h
/// A code over the frames of some ticks, of samples or of answers: the CMAC over the Data ID of the frame
/// that carries it, the nonce of START's code, the first of the ticks, and the bytes of the frames. Internal
/// to firmware/bus.
#ifndef HEXLOAD_BUS_TICK_CODE_H
#define HEXLOAD_BUS_TICK_CODE_H

#include "bus/authentication.h"

void hexload_tick_code_begin(hexload_cmac_blocks_t* blocks, uint32_t id, const hexload_nonce_t* nonce,
                             uint32_t tick);

/// Encrypts count / 16 blocks, rounded up: the last one is filled up with zeros.
void hexload_tick_code_add(hexload_cmac_blocks_t* blocks, const hexload_cipher_t* cipher,
                           const uint8_t* bytes, uint32_t count);

/// The frame with the code. Encrypts two blocks.
void hexload_tick_code_encode(hexload_cmac_blocks_t* blocks, const hexload_cipher_t* cipher, uint32_t id,
                              hexload_bus_frame_t* frame);

/// Whether a frame is one with this identifier and a code.
/// @return HEXLOAD_BUS_OK, _OTHER or _ERR_LENGTH.
HEXLOAD_MUST_USE hexload_bus_status_t hexload_tick_code_is_frame(const hexload_bus_frame_t* frame,
                                                                 uint32_t id);

/// Whether it is this code; takes as long if not. Encrypts two blocks.
bool hexload_tick_code_matches(hexload_cmac_blocks_t* blocks, const hexload_cipher_t* cipher,
                               const hexload_bus_frame_t* frame);

#endif
