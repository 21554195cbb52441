#include "bus/answer_code.h"

#include "bus/tick_code.h"

#include <hexload_dbc.h>

static uint32_t code_ticks(const hexload_answer_code_t* self) {
    const bool is_fd = self->profile == HEXLOAD_BUS_FD;
    return is_fd ? (uint32_t)HEXLOAD_BUS_CODE_TICKS : (uint32_t)HEXLOAD_BUS_PAGE_CODE_TICKS;
}

void hexload_answer_code_init(hexload_answer_code_t* self, hexload_bus_profile_t profile,
                              const hexload_nonce_t* nonce) {
    *self = (hexload_answer_code_t){.profile = profile, .nonce = *nonce};
}

static void begin_answers(hexload_answer_code_t* self, uint32_t first_tick) {
    hexload_tick_code_begin(&self->blocks, HEXLOAD_DBC_ANSWER_MAC_FRAME_ID, &self->nonce, first_tick);
    self->first_tick = first_tick;
    self->next_tick = first_tick;
    if (self->unproven < UINT32_MAX) {
        self->unproven++;
    }
    self->has_frames = true;
    self->is_whole = true;
}

void hexload_answer_code_add(hexload_answer_code_t* self, const hexload_cipher_t* cipher,
                             const hexload_bus_frame_t* frame, bool ends_answer, uint32_t tick) {
    const uint32_t first_tick = tick - (tick % code_ticks(self));
    if ((!self->has_frames) || (first_tick != self->first_tick)) {
        begin_answers(self, first_tick);
    }
    hexload_tick_code_add(&self->blocks, cipher, frame->data, frame->length);
    if (ends_answer) {
        const bool is_fd = self->profile == HEXLOAD_BUS_FD;
        self->is_whole = self->is_whole && (tick == self->next_tick);
        self->next_tick = tick + (is_fd ? 1u : (uint32_t)HEXLOAD_BUS_ANSWER_PERIOD);
    }
}

bool hexload_answer_code_is_due(const hexload_answer_code_t* self) {
    return self->has_frames && (self->next_tick == (self->first_tick + code_ticks(self)));
}

void hexload_answer_code_encode(hexload_answer_code_t* self, const hexload_cipher_t* cipher,
                                hexload_bus_frame_t* frame) {
    hexload_tick_code_encode(&self->blocks, cipher, HEXLOAD_DBC_ANSWER_MAC_FRAME_ID, frame);
    self->has_frames = false;
    self->unproven = 0;
}

hexload_bus_status_t hexload_answer_code_check(hexload_answer_code_t* self, const hexload_cipher_t* cipher,
                                               const hexload_bus_frame_t* frame) {
    const hexload_bus_status_t status = hexload_tick_code_is_frame(frame, HEXLOAD_DBC_ANSWER_MAC_FRAME_ID);
    if (status != HEXLOAD_BUS_OK) {
        return status;
    }
    if (!self->has_frames) {
        return HEXLOAD_BUS_PARTIAL;
    }
    const bool tells = self->is_whole && hexload_answer_code_is_due(self);
    hexload_cmac_blocks_t blocks = self->blocks; // a false code in between must not spoil the right one
    if (!hexload_tick_code_matches(&blocks, cipher, frame)) {
        return tells ? HEXLOAD_BUS_ERR_AUTHENTICATION : HEXLOAD_BUS_PARTIAL;
    }
    self->has_frames = false;
    self->unproven = 0;
    return HEXLOAD_BUS_OK;
}
