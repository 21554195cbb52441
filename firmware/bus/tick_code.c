#include "bus/tick_code.h"

#include <hexload_dbc.h>

#include <string.h>

enum { MAC_BYTES = 8 };
_Static_assert(MAC_BYTES == HEXLOAD_DBC_SAMPLE_MAC_LENGTH, "length of the DBC");
_Static_assert(MAC_BYTES == HEXLOAD_DBC_ANSWER_MAC_LENGTH, "length of the DBC");

static void write_word(uint32_t word, uint8_t* bytes) {
    for (uint32_t n = 0; n < 4u; n++) {
        bytes[n] = (uint8_t)(word >> (8u * n));
    }
}

void hexload_tick_code_begin(hexload_cmac_blocks_t* blocks, uint32_t id, const hexload_nonce_t* nonce,
                             uint32_t tick) {
    uint8_t first[HEXLOAD_CIPHER_BYTES];
    write_word(UINT32_C(0x484C0000) + id, first);
    (void)memcpy(&first[4], nonce->bytes, sizeof nonce->bytes);
    write_word(tick, &first[12]);
    hexload_cmac_begin(blocks, first);
}

void hexload_tick_code_add(hexload_cmac_blocks_t* blocks, const hexload_cipher_t* cipher,
                           const uint8_t* bytes, uint32_t count) {
    const uint32_t rest = count % (uint32_t)HEXLOAD_CIPHER_BYTES;
    for (uint32_t n = 0; n < (count - rest); n += (uint32_t)HEXLOAD_CIPHER_BYTES) {
        hexload_cmac_add(blocks, cipher, &bytes[n]);
    }
    if (rest > 0u) {
        uint8_t block[HEXLOAD_CIPHER_BYTES] = {0};
        (void)memcpy(block, &bytes[count - rest], rest);
        hexload_cmac_add(blocks, cipher, block);
    }
}

void hexload_tick_code_encode(hexload_cmac_blocks_t* blocks, const hexload_cipher_t* cipher, uint32_t id,
                              hexload_bus_frame_t* frame) {
    uint8_t code[HEXLOAD_CIPHER_BYTES];
    hexload_cmac_end(blocks, cipher, code);
    frame->id = id;
    frame->is_fd = false;
    frame->length = MAC_BYTES;
    (void)memcpy(frame->data, code, MAC_BYTES);
}

hexload_bus_status_t hexload_tick_code_is_frame(const hexload_bus_frame_t* frame, uint32_t id) {
    if (frame->id != id) {
        return HEXLOAD_BUS_OTHER;
    }
    const bool is_one = (!frame->is_fd) && (frame->length == MAC_BYTES);
    return is_one ? HEXLOAD_BUS_OK : HEXLOAD_BUS_ERR_LENGTH;
}

bool hexload_tick_code_matches(hexload_cmac_blocks_t* blocks, const hexload_cipher_t* cipher,
                               const hexload_bus_frame_t* frame) {
    uint8_t code[HEXLOAD_CIPHER_BYTES];
    uint8_t difference = 0;
    hexload_cmac_end(blocks, cipher, code);
    for (int n = 0; n < MAC_BYTES; n++) { // all of them, so that the time tells nothing
        difference |= (uint8_t)(code[n] ^ frame->data[n]);
    }
    return difference == 0u;
}
