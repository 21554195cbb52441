#include "message_words.h"

#include <string.h>

enum { LONGEST = 8, DLC_SHIFT = 28, SILICON_ID_SHIFT = 21 };

// SRR (remote request of a standard frame) and IDE (extended identifier).
static const uint32_t silicon_not_ours = (1u << 20) | (1u << 19);
// Extended, remote, error.
static const uint32_t emulated_not_ours = 7u << 29;

static uint32_t big_endian(const uint8_t bytes[4]) {
    return (uint32_t)bytes[0] << 24 | (uint32_t)bytes[1] << 16 | (uint32_t)bytes[2] << 8 | bytes[3];
}

static uint32_t little_endian(const uint8_t bytes[4]) {
    return (uint32_t)bytes[3] << 24 | (uint32_t)bytes[2] << 16 | (uint32_t)bytes[1] << 8 | bytes[0];
}

// Bytes beyond the frame's length are sent as 0.
static void padded(const hexload_bus_frame_t* frame, uint8_t bytes[LONGEST]) {
    memset(bytes, 0, LONGEST);
    memcpy(bytes, frame->data, frame->length < LONGEST ? frame->length : LONGEST);
}

static void begin(const message_words_t* words, uint32_t id, hexload_bus_frame_t* frame) {
    const uint32_t length = words->dlc >> DLC_SHIFT;
    memset(frame, 0, sizeof *frame);
    frame->id = id;
    frame->length = (uint8_t)(length < LONGEST ? length : LONGEST); // ISO 11898-1: 9..15 mean 8
}

void message_words_pack_silicon(const hexload_bus_frame_t* frame, message_words_t* words) {
    uint8_t bytes[LONGEST];
    padded(frame, bytes);
    words->id = frame->id << SILICON_ID_SHIFT;
    words->dlc = (uint32_t)frame->length << DLC_SHIFT;
    words->data[0] = big_endian(&bytes[0]);
    words->data[1] = big_endian(&bytes[4]);
}

bool message_words_unpack_silicon(const message_words_t* words, hexload_bus_frame_t* frame) {
    begin(words, words->id >> SILICON_ID_SHIFT, frame);
    for (int n = 0; n < frame->length; n++) {
        frame->data[n] = (uint8_t)(words->data[n / 4] >> (24 - 8 * (n % 4)));
    }
    return (words->id & silicon_not_ours) == 0;
}

void message_words_pack_emulated(const hexload_bus_frame_t* frame, message_words_t* words) {
    uint8_t bytes[LONGEST];
    padded(frame, bytes);
    words->id = frame->id;
    words->dlc = (uint32_t)frame->length << DLC_SHIFT;
    words->data[0] = little_endian(&bytes[0]);
    words->data[1] = little_endian(&bytes[4]);
}

bool message_words_unpack_emulated(const message_words_t* words, hexload_bus_frame_t* frame) {
    begin(words, words->id, frame);
    for (int n = 0; n < frame->length; n++) {
        frame->data[n] = (uint8_t)(words->data[n / 4] >> (8 * (n % 4)));
    }
    return (words->id & emulated_not_ours) == 0;
}
