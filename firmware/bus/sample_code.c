#include "bus/sample_code.h"

#include "bus/tick_code.h"

#include <hexload_dbc.h>

#include <string.h>

static void begin(hexload_sample_code_t* self, uint32_t tick) {
    hexload_tick_code_begin(&self->blocks, HEXLOAD_DBC_SAMPLE_MAC_FRAME_ID, &self->nonce, tick);
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
    if (self->is_whole) {
        hexload_tick_code_add(&self->blocks, cipher, self->legs, self->count);
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
    }
}

bool hexload_sample_code_is_due(const hexload_sample_code_t* self) {
    return self->is_whole && self->next_tick % (uint32_t)HEXLOAD_BUS_CODE_TICKS == 0u;
}

void hexload_sample_code_encode(hexload_sample_code_t* self, const hexload_cipher_t* cipher,
                                hexload_bus_frame_t* frame) {
    hexload_tick_code_encode(&self->blocks, cipher, HEXLOAD_DBC_SAMPLE_MAC_FRAME_ID, frame);
    self->is_whole = false;
}

hexload_bus_status_t hexload_sample_code_check(hexload_sample_code_t* self, const hexload_cipher_t* cipher,
                                               const hexload_bus_frame_t* frame) {
    const hexload_bus_status_t status = hexload_tick_code_is_frame(frame, HEXLOAD_DBC_SAMPLE_MAC_FRAME_ID);
    if (status != HEXLOAD_BUS_OK) {
        return status;
    }
    if (!hexload_sample_code_is_due(self)) {
        return HEXLOAD_BUS_ERR_AUTHENTICATION;
    }
    self->is_whole = false;
    return hexload_tick_code_matches(&self->blocks, cipher, frame) ? HEXLOAD_BUS_OK
                                                                   : HEXLOAD_BUS_ERR_AUTHENTICATION;
}
