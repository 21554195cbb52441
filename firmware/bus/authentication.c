#include "bus/authentication.h"

#include <hexload_dbc.h>

#include <string.h>

enum {
    DATA_ID_BYTES = 4,
    COMMAND_BYTES = HEXLOAD_DBC_COMMAND_LENGTH,
    MAC_BYTES = HEXLOAD_DBC_COMMAND_MAC_LENGTH,
    INPUT_BYTES = DATA_ID_BYTES + HEXLOAD_NONCE_BYTES + COMMAND_BYTES,
};

/// 64 bits of the CMAC over the Data ID of a frame and two words, least significant byte first. Different
/// frames' inputs differ in the Data ID, so that a nonce is never the code of a command.
static void make_code(const hexload_cipher_t* cipher, uint32_t id, const uint8_t nonce[HEXLOAD_NONCE_BYTES],
                      const uint8_t payload[COMMAND_BYTES], uint8_t code[MAC_BYTES]) {
    const uint32_t data_id = UINT32_C(0x484C0000) + id;
    uint8_t input[INPUT_BYTES];
    uint8_t whole[HEXLOAD_CIPHER_BYTES];
    for (uint32_t n = 0; n < (uint32_t)DATA_ID_BYTES; n++) {
        input[n] = (uint8_t)(data_id >> 8u * n);
    }
    (void)memcpy(&input[DATA_ID_BYTES], nonce, HEXLOAD_NONCE_BYTES);
    (void)memcpy(&input[DATA_ID_BYTES + HEXLOAD_NONCE_BYTES], payload, COMMAND_BYTES);
    hexload_cmac(cipher, input, sizeof input, whole);
    (void)memcpy(code, whole, MAC_BYTES);
}

static void write_word(uint64_t word, uint8_t bytes[8]) {
    for (uint32_t n = 0; n < 8u; n++) {
        bytes[n] = (uint8_t)(word >> 8u * n);
    }
}

void hexload_bus_make_nonce(const hexload_cipher_t* cipher, uint64_t seed, uint64_t number,
                            hexload_nonce_t* nonce) {
    uint8_t seeds[HEXLOAD_NONCE_BYTES];
    uint8_t numbers[COMMAND_BYTES];
    write_word(seed, seeds);
    write_word(number, numbers);
    make_code(cipher, HEXLOAD_DBC_CHALLENGE_FRAME_ID, seeds, numbers, nonce->bytes);
}

static hexload_bus_status_t check_layout(const hexload_bus_frame_t* frame, uint32_t id, uint8_t length) {
    if (frame->id != id) {
        return HEXLOAD_BUS_OTHER;
    }
    return frame->is_fd || frame->length != length ? HEXLOAD_BUS_ERR_LENGTH : HEXLOAD_BUS_OK;
}

void hexload_bus_encode_challenge(const hexload_nonce_t* nonce, hexload_bus_frame_t* frame) {
    frame->id = HEXLOAD_DBC_CHALLENGE_FRAME_ID;
    frame->is_fd = false;
    frame->length = HEXLOAD_DBC_CHALLENGE_LENGTH;
    (void)memcpy(frame->data, nonce->bytes, sizeof nonce->bytes);
}

hexload_bus_status_t hexload_bus_decode_challenge(const hexload_bus_frame_t* frame, hexload_nonce_t* nonce) {
    const hexload_bus_status_t status =
        check_layout(frame, HEXLOAD_DBC_CHALLENGE_FRAME_ID, HEXLOAD_DBC_CHALLENGE_LENGTH);
    if (status == HEXLOAD_BUS_OK) {
        (void)memcpy(nonce->bytes, frame->data, sizeof nonce->bytes);
    }
    return status;
}

void hexload_bus_encode_command_mac(const hexload_cipher_t* cipher, const hexload_nonce_t* nonce,
                                    const hexload_bus_frame_t* command, hexload_bus_frame_t* frame) {
    frame->id = HEXLOAD_DBC_COMMAND_MAC_FRAME_ID;
    frame->is_fd = false;
    frame->length = HEXLOAD_DBC_COMMAND_MAC_LENGTH;
    make_code(cipher, frame->id, nonce->bytes, command->data, frame->data);
}

hexload_bus_status_t hexload_bus_is_command_mac(const hexload_bus_frame_t* frame) {
    return check_layout(frame, HEXLOAD_DBC_COMMAND_MAC_FRAME_ID, HEXLOAD_DBC_COMMAND_MAC_LENGTH);
}

bool hexload_bus_matches_command(const hexload_cipher_t* cipher, const hexload_nonce_t* nonce,
                                 const hexload_bus_frame_t* command, const hexload_bus_frame_t* frame) {
    uint8_t code[MAC_BYTES];
    uint8_t difference = 0;
    make_code(cipher, HEXLOAD_DBC_COMMAND_MAC_FRAME_ID, nonce->bytes, command->data, code);
    for (int n = 0; n < MAC_BYTES; n++) { // all of them, so that the time tells nothing
        difference |= (uint8_t)(code[n] ^ frame->data[n]);
    }
    return difference == 0u;
}
