/// @file authentication.h
/// What a controller with a key asks of a command before it carries it out: bus/authentication.h has the
/// frames and the codes, this the order of things and the limits. Internal to node.c.
///
/// A Command is held until its CommandMac comes. Without one in time, or with another Command first, it is
/// refused; with a code that does not match too, and then no code is looked at for a while: whoever guesses
/// has 50 guesses a second at one of 2^64.
#ifndef HEXLOAD_APP_AUTHENTICATION_H
#define HEXLOAD_APP_AUTHENTICATION_H

#include "bus/authentication.h"

HEXLOAD_DECLS_BEGIN

enum {
    HEXLOAD_AUTHENTICATION_HOLD_MS = 50,  ///< that a Command waits for its CommandMac
    HEXLOAD_AUTHENTICATION_PAUSE_MS = 20, ///< without a look at a code, after one that did not match
};

typedef struct hexload_authentication {
    hexload_cipher_t cipher; ///< without a function: off
    uint64_t seed;
    uint64_t nonces;       ///< made so far
    hexload_nonce_t nonce; ///< of the next command
    hexload_bus_frame_t frame;
    hexload_bus_command_t command; ///< the one that is held, decoded; kind 0: none
    uint32_t held_ms;              ///< since it came
    uint32_t pause_ms;             ///< left of it
} hexload_authentication_t;

/// @param seed as of hexload_bus_make_nonce().
void hexload_authentication_init(hexload_authentication_t* self, const hexload_cipher_t* cipher,
                                 uint64_t seed);

/// Whether commands need a code at all.
static inline bool hexload_authentication_is_on(const hexload_authentication_t* self) {
    return self->cipher.encrypt_block != NULL;
}

/// A frame of a command. Worst case: six blocks encrypted.
/// @param[out] command with HEXLOAD_BUS_OK to be carried out; with _ERR_AUTHENTICATION refused, kind 0: there
///             is none to speak of.
/// @return HEXLOAD_BUS_OK, _PARTIAL: held; _OTHER; else refused.
HEXLOAD_MUST_USE hexload_bus_status_t hexload_authentication_take(hexload_authentication_t* self,
                                                                  const hexload_bus_frame_t* frame,
                                                                  hexload_bus_command_t* command);

/// Time passes.
/// @param[out] command the one whose code did not come in time, when true.
bool hexload_authentication_elapse(hexload_authentication_t* self, uint32_t elapsed_ms,
                                   hexload_bus_command_t* command);

HEXLOAD_DECLS_END

#endif
