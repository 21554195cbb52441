/// @file authentication.h
/// Commands of who has the key, in the manner of AUTOSAR's "Specification of Secure Onboard Communication":
/// challenge and response.
///
/// The controller tells a number that it uses once (frame Challenge). A command is two frames: Command, and
/// CommandMac with the first 64 bits of the CMAC over the latter's Data ID, that number and the Command's
/// eight bytes. Whatever comes of it, the controller then has another number: a command that was recorded is
/// worth nothing.
///
/// Neither frame has a checksum: one that is damaged makes a code that does not match.
#ifndef HEXLOAD_BUS_AUTHENTICATION_H
#define HEXLOAD_BUS_AUTHENTICATION_H

#include "bus/bus.h"
#include "bus/cmac.h"

HEXLOAD_DECLS_BEGIN

enum { HEXLOAD_NONCE_BYTES = 8 };

/// A number used once.
typedef struct hexload_nonce {
    uint8_t bytes[HEXLOAD_NONCE_BYTES];
} hexload_nonce_t;

/// The number-th nonce since the start: 64 bits of a CMAC, which nobody without the key can tell beforehand.
/// Three blocks to encrypt.
/// @param seed of this start, never the same again with the same key.
void hexload_bus_make_nonce(const hexload_cipher_t* cipher, uint64_t seed, uint64_t number,
                            hexload_nonce_t* nonce);

void hexload_bus_encode_challenge(const hexload_nonce_t* nonce, hexload_bus_frame_t* frame);
/// @return HEXLOAD_BUS_OK, _OTHER or _ERR_LENGTH; the output changes with OK only.
HEXLOAD_MUST_USE hexload_bus_status_t hexload_bus_decode_challenge(const hexload_bus_frame_t* frame,
                                                                   hexload_nonce_t* nonce);

/// The frame that follows a command's. Three blocks to encrypt.
/// @param command of hexload_bus_encode_command().
void hexload_bus_encode_command_mac(const hexload_cipher_t* cipher, const hexload_nonce_t* nonce,
                                    const hexload_bus_frame_t* command, hexload_bus_frame_t* frame);

/// Whether a frame is one that follows a command's.
/// @return HEXLOAD_BUS_OK, _OTHER or _ERR_LENGTH.
HEXLOAD_MUST_USE hexload_bus_status_t hexload_bus_is_command_mac(const hexload_bus_frame_t* frame);

/// Whether it is the one of this command and nonce; takes as long if not. Three blocks to encrypt.
/// @param frame for which hexload_bus_is_command_mac() says OK.
bool hexload_bus_matches_command(const hexload_cipher_t* cipher, const hexload_nonce_t* nonce,
                                 const hexload_bus_frame_t* command, const hexload_bus_frame_t* frame);

HEXLOAD_DECLS_END

#endif
