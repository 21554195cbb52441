/// @file cmac.h
/// CMAC, the message authentication code of NIST SP 800-38B and RFC 4493, over a cipher that the machine
/// supplies: its hardware, or a library's AES. No cipher is in here.
#ifndef HEXLOAD_BUS_CMAC_H
#define HEXLOAD_BUS_CMAC_H

#include "hexload/real.h"

#include <stddef.h>
#include <stdint.h>

HEXLOAD_DECLS_BEGIN

enum { HEXLOAD_CIPHER_BYTES = 16 }; ///< of a block, and of a code that is not truncated

/// AES-128 with the machine's key, which nobody else sees.
typedef struct hexload_cipher {
    void* context; ///< handed to the function
    /// One block. in and out do not overlap. NULL: the machine has no key.
    void (*encrypt_block)(void* context, const uint8_t in[HEXLOAD_CIPHER_BYTES],
                          uint8_t out[HEXLOAD_CIPHER_BYTES]);
} hexload_cipher_t;

/// Encrypts count / 16 blocks, rounded up, at least one; and one more, of zeros. Reentrant as the cipher is.
/// @param bytes may be NULL when count is 0.
void hexload_cmac(const hexload_cipher_t* cipher, const uint8_t* bytes, size_t count,
                  uint8_t code[HEXLOAD_CIPHER_BYTES]);

HEXLOAD_DECLS_END

#endif
