/// @file sample_code.h
/// Samples of who has the key: one code for the leg frames of 16 ticks, in either profile, in a frame
/// SampleMac behind them. Both sides compute it as the frames go by.
///
/// The nonce is the one that START's code counted in: a recorded run is worth nothing in the next.
#ifndef HEXLOAD_BUS_SAMPLE_CODE_H
#define HEXLOAD_BUS_SAMPLE_CODE_H

#include "bus/authentication.h"

HEXLOAD_DECLS_BEGIN

typedef struct hexload_sample_code {
    hexload_cmac_blocks_t blocks;
    hexload_nonce_t nonce;
    uint32_t next_tick;                    ///< that goes on with what there is
    bool is_whole;                         ///< no tick of it is missing so far
    uint8_t count;                         ///< bytes of legs
    uint8_t legs[HEXLOAD_BUS_FRAME_BYTES]; ///< of the tick whose frames come
} hexload_sample_code_t;

/// Nothing until the next tick that is a multiple of 16.
void hexload_sample_code_init(hexload_sample_code_t* self, const hexload_nonce_t* nonce);

/// A frame of a sample that was sent, or received and taken. With the last one of a tick four blocks to
/// encrypt (FD) or three (classic).
/// @param ends_tick whether it is that one.
/// @param tick of the sample, looked at then.
void hexload_sample_code_add(hexload_sample_code_t* self, const hexload_cipher_t* cipher,
                             const hexload_bus_frame_t* frame, bool ends_tick, uint32_t tick);

/// Whether 16 ticks are there, and their code is due.
bool hexload_sample_code_is_due(const hexload_sample_code_t* self);

/// The code that is due. Two blocks to encrypt.
void hexload_sample_code_encode(hexload_sample_code_t* self, const hexload_cipher_t* cipher,
                                hexload_bus_frame_t* frame);

/// Whether a received frame is the code that is due. Two blocks to encrypt when one is.
/// @return HEXLOAD_BUS_OK; _OTHER: no such frame; _ERR_LENGTH; _ERR_AUTHENTICATION: another code, or none is
/// due.
HEXLOAD_MUST_USE hexload_bus_status_t hexload_sample_code_check(hexload_sample_code_t* self,
                                                                const hexload_cipher_t* cipher,
                                                                const hexload_bus_frame_t* frame);

HEXLOAD_DECLS_END

#endif
