/// @file cmac.h
/// CMAC, the message authentication code of NIST SP 800-38B and RFC 4493, over a cipher that the machine
/// supplies: its hardware, or a library's AES. No cipher is in here.
#ifndef HEXLOAD_BUS_CMAC_H
#define HEXLOAD_BUS_CMAC_H

#include "hexload/types.h"

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

/// The same over whole blocks that come one by one.
typedef struct hexload_cmac_blocks {
    uint8_t sum[HEXLOAD_CIPHER_BYTES];  ///< of those before the last
    uint8_t last[HEXLOAD_CIPHER_BYTES]; ///< not yet counted in
} hexload_cmac_blocks_t;

void hexload_cmac_begin(hexload_cmac_blocks_t* self, const uint8_t first[HEXLOAD_CIPHER_BYTES]);
/// Encrypts one block.
void hexload_cmac_add(hexload_cmac_blocks_t* self, const hexload_cipher_t* cipher,
                      const uint8_t block[HEXLOAD_CIPHER_BYTES]);
/// Encrypts two. Then it is to begin anew.
void hexload_cmac_end(hexload_cmac_blocks_t* self, const hexload_cipher_t* cipher,
                      uint8_t code[HEXLOAD_CIPHER_BYTES]);

HEXLOAD_DECLS_END

#endif
