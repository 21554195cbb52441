#include "bus/sample_code.h"

#include <hexload_dbc.h>

#include <string.h>

enum { MAC_BYTES = 8 };
_Static_assert(MAC_BYTES == HEXLOAD_DBC_SAMPLE_MAC_LENGTH, "length of the DBC");

static void write_word(uint32_t word, uint8_t* bytes) {
    for (uint32_t n = 0; n < 4u; n++) {
        bytes[n] = (uint8_t)(word >> 8u * n);
    }
}

static void begin(hexload_sample_code_t* self, uint32_t tick) {
    uint8_t first[HEXLOAD_CIPHER_BYTES];
    write_word(UINT32_C(0x484C0000) + HEXLOAD_DBC_SAMPLE_MAC_FRAME_ID, first);
    (void)memcpy(&first[4], self->nonce.bytes, sizeof self->nonce.bytes);
    write_word(tick, &first[12]);
    hexload_cmac_begin(&self->blocks, first);
    self->next_tick = tick;
    self->is_whole = true;
}

void hexload_sample_code_init(hexload_sample_code_t* self, const hexload_nonce_t* nonce) {
    *self = (hexload_sample_code_t){.nonce = *nonce};
}

static void add_tick(hexload_sample_code_t* self, const hexload_cipher_t* cipher, uint32_t tick) {
    if (tick % (uint32_t)HEXLOAD_BUS_CODE_TICKS == 0u) {
        begin(self, tick);
    }
    self->is_whole = self->is_whole && tick == self->next_tick;
    self->next_tick = tick + 1u;
    for (uint32_t n = 0; self->is_whole && n < self->count; n += (uint32_t)HEXLOAD_CIPHER_BYTES) {
        hexload_cmac_add(&self->blocks, cipher, &self->legs[n]);
    }
}

void hexload_sample_code_add(hexload_sample_code_t* self, const hexload_cipher_t* cipher,
                             const hexload_bus_frame_t* frame, bool ends_tick, uint32_t tick) {
    if (frame->id == (uint32_t)HEXLOAD_DBC_SAMPLE_TICK_FRAME_ID) {
        return;
    }
    if (frame->id == (uint32_t)HEXLOAD_DBC_LEG_SAMPLE1_FRAME_ID || frame->is_fd) {
        self->count = 0; // what there is of another tick has lost legs
    }
    const uint32_t length = frame->length;
    if (self->count + length <= sizeof self->legs) {
        (void)memcpy(&self->legs[self->count], frame->data, length);
        self->count = (uint8_t)(self->count + length);
    }
    if (ends_tick) {
        add_tick(self, cipher, tick);
        self->count = 0;
    }
}

bool hexload_sample_code_is_due(const hexload_sample_code_t* self) {
    return self->is_whole && self->next_tick % (uint32_t)HEXLOAD_BUS_CODE_TICKS == 0u;
}

void hexload_sample_code_encode(hexload_sample_code_t* self, const hexload_cipher_t* cipher,
                                hexload_bus_frame_t* frame) {
    uint8_t code[HEXLOAD_CIPHER_BYTES];
    hexload_cmac_end(&self->blocks, cipher, code);
    self->is_whole = false;
    frame->id = HEXLOAD_DBC_SAMPLE_MAC_FRAME_ID;
    frame->is_fd = false;
    frame->length = MAC_BYTES;
    (void)memcpy(frame->data, code, MAC_BYTES);
}

hexload_bus_status_t hexload_sample_code_check(hexload_sample_code_t* self, const hexload_cipher_t* cipher,
                                               const hexload_bus_frame_t* frame) {
    if (frame->id != HEXLOAD_DBC_SAMPLE_MAC_FRAME_ID) {
        return HEXLOAD_BUS_OTHER;
    }
    if (frame->is_fd || frame->length != MAC_BYTES) {
        return HEXLOAD_BUS_ERR_LENGTH;
    }
    if (!hexload_sample_code_is_due(self)) {
        return HEXLOAD_BUS_ERR_AUTHENTICATION;
    }
    uint8_t code[HEXLOAD_CIPHER_BYTES];
    uint8_t difference = 0;
    hexload_cmac_end(&self->blocks, cipher, code);
    self->is_whole = false;
    for (int n = 0; n < MAC_BYTES; n++) {
        difference |= (uint8_t)(code[n] ^ frame->data[n]);
    }
    return difference == 0u ? HEXLOAD_BUS_OK : HEXLOAD_BUS_ERR_AUTHENTICATION;
}
