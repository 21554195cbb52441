#include "ports/boot/built_key.h"

#ifdef HEXLOAD_HAS_KEY
#include "ports/mbedtls/aes128.h"

#include <hexload_key.h>

static hexload_aes128_t aes;

static void encrypt_block(void* context, const uint8_t in[16], uint8_t out[16]) {
    (void)context;
    hexload_aes128_encrypt_block(&aes, in, out);
}

bool hexload_built_key_give(hexload_port_t* port, uint64_t nonce_seed) {
    static const uint8_t key[HEXLOAD_AES128_KEY_BYTES] = HEXLOAD_KEY;
    hexload_aes128_init(&aes, key);
    port->aes128_encrypt_block = encrypt_block;
    port->nonce_seed = nonce_seed;
    return nonce_seed != 0;
}
#else
bool hexload_built_key_give(hexload_port_t* port, uint64_t nonce_seed) {
    (void)port;
    (void)nonce_seed;
    return true;
}
#endif
