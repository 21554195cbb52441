#include "ports/mbedtls/aes128.h"

void hexload_aes128_init(hexload_aes128_t* self, const uint8_t key[HEXLOAD_AES128_KEY_BYTES]) {
    mbedtls_aes_init(&self->keys);
    (void)mbedtls_aes_setkey_enc(&self->keys, key, 8u * HEXLOAD_AES128_KEY_BYTES); // fails for other lengths
}

void hexload_aes128_encrypt_block(void* context, const uint8_t in[16], uint8_t out[16]) {
    hexload_aes128_t* self = context;
    (void)mbedtls_aes_crypt_ecb(&self->keys, MBEDTLS_AES_ENCRYPT, in, out); // no way to fail
}
