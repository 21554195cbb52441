#include "bus/cmac.h"

#include <string.h>

/// Times x in GF(2^128), most significant byte first: RFC 4493, 2.3.
static void double_block(uint8_t block[HEXLOAD_CIPHER_BYTES]) {
    const uint8_t carry = block[0] >> 7;
    for (int n = 0; n < HEXLOAD_CIPHER_BYTES - 1; n++) {
        block[n] = (uint8_t)(block[n] << 1 | block[n + 1] >> 7);
    }
    block[HEXLOAD_CIPHER_BYTES - 1] =
        (uint8_t)(block[HEXLOAD_CIPHER_BYTES - 1] << 1 ^ (carry != 0u ? 0x87u : 0u));
}

static void add(uint8_t sum[HEXLOAD_CIPHER_BYTES], const uint8_t* bytes, size_t count) {
    for (size_t n = 0; n < count; n++) {
        sum[n] ^= bytes[n];
    }
}

void hexload_cmac(const hexload_cipher_t* cipher, const uint8_t* bytes, size_t count,
                  uint8_t code[HEXLOAD_CIPHER_BYTES]) {
    const size_t before = count > 0u ? (count - 1u) / (size_t)HEXLOAD_CIPHER_BYTES : 0u; // the last block
    const size_t rest = count - before * (size_t)HEXLOAD_CIPHER_BYTES;
    uint8_t sum[HEXLOAD_CIPHER_BYTES] = {0};
    uint8_t last[HEXLOAD_CIPHER_BYTES];
    cipher->encrypt_block(cipher->context, sum, last);
    double_block(last); // the subkey K1 of whole blocks
    if (rest < (size_t)HEXLOAD_CIPHER_BYTES) {
        double_block(last); // K2
        last[rest] ^= 0x80u;
    }
    for (size_t n = 0; n < before; n++) {
        add(sum, &bytes[n * (size_t)HEXLOAD_CIPHER_BYTES], HEXLOAD_CIPHER_BYTES);
        cipher->encrypt_block(cipher->context, sum, code);
        (void)memcpy(sum, code, sizeof sum);
    }
    if (rest > 0u) {
        add(last, &bytes[before * (size_t)HEXLOAD_CIPHER_BYTES], rest);
    }
    add(sum, last, sizeof last);
    cipher->encrypt_block(cipher->context, sum, code);
}
