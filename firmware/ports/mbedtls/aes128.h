/// @file aes128.h
/// AES-128 of mbedTLS as a port's cipher, for machines without one in hardware.
#ifndef HEXLOAD_PORTS_AES128_H
#define HEXLOAD_PORTS_AES128_H

#include "hexload/types.h"

#include <mbedtls/aes.h>
#include <stdint.h>

HEXLOAD_DECLS_BEGIN

enum { HEXLOAD_AES128_KEY_BYTES = 16 };

typedef struct hexload_aes128 {
    mbedtls_aes_context keys; ///< of the rounds
} hexload_aes128_t;

/// Not for the 1 ms path.
void hexload_aes128_init(hexload_aes128_t* self, const uint8_t key[HEXLOAD_AES128_KEY_BYTES]);

/// As hexload_port_t and hexload_cipher_t have it; `context` is the hexload_aes128_t.
void hexload_aes128_encrypt_block(void* context, const uint8_t in[16], uint8_t out[16]);

HEXLOAD_DECLS_END

#endif
