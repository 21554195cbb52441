// Commands to a controller with a key.
#include "frames.h"

#include "app/node.h"
#include "ports/mbedtls/aes128.h"

#include <mbedtls/cipher.h>
#include <mbedtls/cmac.h>
#include <string.h>

void setUp(void) {}
void tearDown(void) {}

enum { LOG_FRAMES = 512, MESSAGE_BYTES = 64, FORGERIES = 1000000 };

// RFC 4493, chapter 4.
static const uint8_t rfc_key[HEXLOAD_AES128_KEY_BYTES] = {0x2b, 0x7e, 0x15, 0x16, 0x28, 0xae, 0xd2, 0xa6,
                                                          0xab, 0xf7, 0x15, 0x88, 0x09, 0xcf, 0x4f, 0x3c};
static const uint8_t rfc_message[MESSAGE_BYTES] = {
    0x6b, 0xc1, 0xbe, 0xe2, 0x2e, 0x40, 0x9f, 0x96, 0xe9, 0x3d, 0x7e, 0x11, 0x73, 0x93, 0x17, 0x2a,
    0xae, 0x2d, 0x8a, 0x57, 0x1e, 0x03, 0xac, 0x9c, 0x9e, 0xb7, 0x6f, 0xac, 0x45, 0xaf, 0x8e, 0x51,
    0x30, 0xc8, 0x1c, 0x46, 0xa3, 0x5c, 0xe4, 0x11, 0xe5, 0xfb, 0xc1, 0x19, 0x1a, 0x0a, 0x52, 0xef,
    0xf6, 0x9f, 0x24, 0x45, 0xdf, 0x4f, 0x9b, 0x17, 0xad, 0x2b, 0x41, 0x7b, 0xe6, 0x6c, 0x37, 0x10};
static const struct {
    size_t count;
    uint8_t code[HEXLOAD_CIPHER_BYTES];
} rfc_codes[4] = {
    {0, {0xbb, 0x1d, 0x69, 0x29, 0xe9, 0x59, 0x37, 0x28, 0x7f, 0xa3, 0x7d, 0x12, 0x9b, 0x75, 0x67, 0x46}},
    {16, {0x07, 0x0a, 0x16, 0xb4, 0x6b, 0x4d, 0x41, 0x44, 0xf7, 0x9b, 0xdd, 0x9d, 0xd0, 0x4a, 0x28, 0x7c}},
    {40, {0xdf, 0xa6, 0x67, 0x47, 0xde, 0x9a, 0xe6, 0x30, 0x30, 0xca, 0x32, 0x61, 0x14, 0x97, 0xc8, 0x27}},
    {64, {0x51, 0xf0, 0xbe, 0xbf, 0x7e, 0x3b, 0x9d, 0x92, 0xfc, 0x49, 0x74, 0x17, 0x79, 0x36, 0x3c, 0xfe}}};

static hexload_aes128_t aes;
static const hexload_cipher_t cipher = {&aes, hexload_aes128_encrypt_block};

static hexload_node_t node;
static hexload_bus_frame_t sent[LOG_FRAMES];
static uint32_t sent_count;
static uint8_t sequence;

static bool log_frame(void* context, const hexload_bus_frame_t* frame) {
    (void)context;
    sent[sent_count % LOG_FRAMES] = *frame;
    sent_count++;
    return true;
}

static void begin_with(uint64_t seed) {
    const hexload_config_t config = paper_machine();
    const hexload_port_t port = {.context = &aes,
                                 .send = log_frame,
                                 .aes128_encrypt_block = hexload_aes128_encrypt_block,
                                 .nonce_seed = seed};
    hexload_app_settings_t settings;
    hexload_app_settings_default(&settings);
    hexload_aes128_init(&aes, rfc_key);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK,
                          hexload_node_init(&node, &config, &settings, HEXLOAD_BUS_CLASSIC, &port));
    hexload_node_period(&node, HEXLOAD_NODE_LISTEN_MS);
    sent_count = 0;
}

static hexload_bus_frame_t command(uint8_t kind) {
    const hexload_bus_command_t order = {
        .kind = kind, .source = HEXLOAD_SOURCE_OPERATOR, .session = 1234, .sequence = ++sequence};
    hexload_bus_frame_t frame;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, hexload_bus_encode_command(&order, &frame));
    return frame;
}

/// How many frames of this identifier have been sent; `last`: of them, unless NULL.
static uint32_t sent_of(uint32_t id, hexload_bus_frame_t* last) {
    uint32_t count = 0;
    TEST_ASSERT_LESS_OR_EQUAL_UINT32(LOG_FRAMES, sent_count);
    for (uint32_t n = 0; n < sent_count; n++) {
        if (sent[n].id == id) {
            count++;
            if (last != NULL) {
                *last = sent[n];
            }
        }
    }
    return count;
}

static hexload_bus_acknowledge_t last_acknowledge(void) {
    hexload_bus_frame_t frame;
    hexload_bus_acknowledge_t acknowledge = {0};
    TEST_ASSERT_GREATER_THAN_UINT32(0, sent_of(ID_ACKNOWLEDGE, &frame));
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, hexload_bus_decode_acknowledge(&frame, &acknowledge));
    return acknowledge;
}

/// Asks for the nonce and has it.
static hexload_nonce_t challenge(void) {
    const hexload_bus_frame_t frame = command(HEXLOAD_COMMAND_CHALLENGE);
    hexload_bus_frame_t answer;
    hexload_nonce_t nonce;
    sent_count = 0;
    hexload_node_receive(&node, &frame);
    hexload_node_period(&node, HEXLOAD_NODE_CHALLENGE_MS);
    TEST_ASSERT_EQUAL_UINT32(1, sent_of(ID_CHALLENGE, &answer));
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, hexload_bus_decode_challenge(&answer, &nonce));
    sent_count = 0;
    return nonce;
}

static hexload_bus_frame_t code_of(const hexload_bus_frame_t* frame, hexload_nonce_t nonce) {
    hexload_bus_frame_t code;
    hexload_bus_encode_command_mac(&cipher, &nonce, frame, &code);
    return code;
}

static void test_codes_are_those_of_the_rfc(void) {
    // GIVEN the key and the messages of RFC 4493 WHEN their codes are computed THEN they are its codes
    hexload_aes128_init(&aes, rfc_key);
    for (int n = 0; n < 4; n++) {
        uint8_t code[HEXLOAD_CIPHER_BYTES];
        hexload_cmac(&cipher, rfc_codes[n].count > 0 ? rfc_message : NULL, rfc_codes[n].count, code);
        TEST_ASSERT_EQUAL_HEX8_ARRAY(rfc_codes[n].code, code, sizeof code);
    }
}

static void test_codes_are_those_of_mbedtls_whatever_the_length(void) {
    // GIVEN a message and a key of random bytes
    const mbedtls_cipher_info_t* kind = mbedtls_cipher_info_from_type(MBEDTLS_CIPHER_AES_128_ECB);
    uint64_t seed = 11;
    for (size_t count = 0; count <= MESSAGE_BYTES; count++) {
        const hexload_bus_frame_t key = random_frame(&seed);
        const hexload_bus_frame_t message = random_frame(&seed);
        uint8_t expected[HEXLOAD_CIPHER_BYTES];
        uint8_t found[HEXLOAD_CIPHER_BYTES];
        hexload_aes128_init(&aes, key.data);
        // WHEN its code is computed here and by mbedTLS THEN both are the same
        TEST_ASSERT_EQUAL_INT(0, mbedtls_cipher_cmac(kind, key.data, 8 * HEXLOAD_AES128_KEY_BYTES,
                                                     message.data, count, expected));
        hexload_cmac(&cipher, message.data, count, found);
        TEST_ASSERT_EQUAL_HEX8_ARRAY(expected, found, sizeof found);
    }
}

static void test_a_command_with_the_code_is_carried_out(void) {
    // GIVEN a controller with a key, and its nonce
    begin_with(1);
    const hexload_nonce_t nonce = challenge();
    // WHEN a START comes and its code follows
    const hexload_bus_frame_t start = command(HEXLOAD_COMMAND_START);
    const hexload_bus_frame_t code = code_of(&start, nonce);
    hexload_node_receive(&node, &start);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_APP_IDLE, node.app.state);
    hexload_node_receive(&node, &code);
    // THEN it is carried out, and the next nonce is told before the acknowledge
    TEST_ASSERT_EQUAL_INT(HEXLOAD_APP_ARMED, node.app.state);
    TEST_ASSERT_EQUAL_UINT32(2, sent_count);
    hexload_nonce_t next;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, hexload_bus_decode_challenge(&sent[0], &next));
    TEST_ASSERT_EQUAL_INT(HEXLOAD_RESULT_DONE, last_acknowledge().result);
    TEST_ASSERT_EQUAL_UINT32(0, node.status.frames_refused);
    // AND with that the next command
    const hexload_bus_frame_t stop = command(HEXLOAD_COMMAND_STOP);
    const hexload_bus_frame_t next_code = code_of(&stop, next);
    hexload_node_receive(&node, &stop);
    hexload_node_receive(&node, &next_code);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_APP_IDLE, node.app.state);
}

static void test_a_recorded_command_is_refused(void) {
    // GIVEN a RESET with its code that was carried out
    begin_with(1);
    const hexload_bus_frame_t reset = command(HEXLOAD_COMMAND_RESET);
    const hexload_bus_frame_t code = code_of(&reset, challenge());
    hexload_node_receive(&node, &reset);
    hexload_node_receive(&node, &code);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_RESULT_DONE, last_acknowledge().result);
    // WHEN both frames come again THEN they are refused, counted and acknowledged as such
    hexload_node_receive(&node, &reset);
    hexload_node_receive(&node, &code);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_RESULT_NOT_AUTHENTICATED, last_acknowledge().result);
    TEST_ASSERT_EQUAL_UINT8(HEXLOAD_COMMAND_RESET, last_acknowledge().kind);
    TEST_ASSERT_EQUAL_UINT32(1, node.status.frames_refused);
}

static void test_another_start_has_other_nonces(void) {
    // GIVEN a command that was recorded at one start
    begin_with(1);
    const hexload_bus_frame_t start = command(HEXLOAD_COMMAND_START);
    const hexload_bus_frame_t code = code_of(&start, challenge());
    // WHEN the controller has started again with another seed, and both frames come
    begin_with(2);
    hexload_node_receive(&node, &start);
    hexload_node_receive(&node, &code);
    // THEN they are refused
    TEST_ASSERT_EQUAL_INT(HEXLOAD_APP_IDLE, node.app.state);
    TEST_ASSERT_EQUAL_UINT32(1, node.status.frames_refused);
}

static void test_a_command_without_its_code_is_refused_in_time(void) {
    // GIVEN a controller with a key WHEN a STOP comes and no code
    begin_with(1);
    const hexload_bus_frame_t stop = command(HEXLOAD_COMMAND_STOP);
    hexload_node_receive(&node, &stop);
    hexload_node_period(&node, HEXLOAD_AUTHENTICATION_HOLD_MS - 1);
    TEST_ASSERT_EQUAL_UINT32(0, sent_of(ID_ACKNOWLEDGE, NULL));
    hexload_node_period(&node, 1);
    // THEN it is refused after its time, once, and its code is late then
    TEST_ASSERT_EQUAL_INT(HEXLOAD_RESULT_NOT_AUTHENTICATED, last_acknowledge().result);
    TEST_ASSERT_EQUAL_UINT32(1, node.status.frames_refused);
    hexload_node_period(&node, HEXLOAD_AUTHENTICATION_HOLD_MS);
    TEST_ASSERT_EQUAL_UINT32(1, sent_of(ID_ACKNOWLEDGE, NULL));
    const hexload_bus_frame_t code = code_of(&stop, challenge());
    hexload_node_receive(&node, &code);
    TEST_ASSERT_EQUAL_UINT32(0, sent_of(ID_ACKNOWLEDGE, NULL));
    TEST_ASSERT_EQUAL_UINT32(2, node.status.frames_refused);
}

static void test_a_command_in_between_takes_the_place_of_the_one_that_waits(void) {
    // GIVEN a START that waits for its code
    begin_with(1);
    const hexload_bus_frame_t start = command(HEXLOAD_COMMAND_START);
    const hexload_bus_frame_t code = code_of(&start, challenge());
    hexload_node_receive(&node, &start);
    // WHEN a STOP of somebody else comes first, then the code
    const hexload_bus_frame_t stop = command(HEXLOAD_COMMAND_STOP);
    hexload_node_receive(&node, &stop);
    TEST_ASSERT_EQUAL_UINT8(HEXLOAD_COMMAND_START, last_acknowledge().kind);
    hexload_node_receive(&node, &code);
    // THEN neither is carried out, and START's refusal is told
    TEST_ASSERT_EQUAL_INT(HEXLOAD_APP_IDLE, node.app.state);
    TEST_ASSERT_EQUAL_UINT32(1, sent_of(ID_ACKNOWLEDGE, NULL));
    TEST_ASSERT_EQUAL_UINT32(2, node.status.frames_refused);
}

static void test_damaged_frames_of_a_command_are_refused(void) {
    // GIVEN a START with its code
    begin_with(1);
    const hexload_bus_frame_t start = command(HEXLOAD_COMMAND_START);
    const hexload_bus_frame_t code = code_of(&start, challenge());
    // WHEN a wrong length, the FD format and a wrong checksum come
    hexload_bus_frame_t damaged[3] = {code, code, start};
    damaged[0].length = 7;
    damaged[1].is_fd = true;
    damaged[2].data[7] ^= 1;
    for (uint32_t n = 0; n < 3; n++) {
        hexload_node_receive(&node, &damaged[n]);
        // THEN each is refused, and nothing is said of it
        TEST_ASSERT_EQUAL_UINT32(n + 1, node.status.frames_refused);
    }
    TEST_ASSERT_EQUAL_UINT32(0, sent_count);
    // AND the whole ones count
    hexload_node_receive(&node, &start);
    hexload_node_receive(&node, &code);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_APP_ARMED, node.app.state);
}

static void test_challenges_are_answered_at_a_bounded_rate(void) {
    // GIVEN a controller with a key WHEN challenges are asked for all the time
    begin_with(1);
    for (int ms = 0; ms < 100; ms++) {
        const hexload_bus_frame_t frame = command(HEXLOAD_COMMAND_CHALLENGE);
        hexload_node_receive(&node, &frame);
        hexload_node_period(&node, 1);
    }
    // THEN one comes every 10 ms, always the same, and none of them is a command of its own
    TEST_ASSERT_EQUAL_UINT32(100 / HEXLOAD_NODE_CHALLENGE_MS, sent_of(ID_CHALLENGE, NULL));
    TEST_ASSERT_EQUAL_UINT32(0, sent_of(ID_ACKNOWLEDGE, NULL));
    TEST_ASSERT_EQUAL_UINT64(1, node.authentication.nonces);
}

static void test_guesses_are_looked_at_and_answered_at_a_bounded_rate(void) {
    // GIVEN a controller with a key
    begin_with(1);
    const hexload_bus_frame_t stop = command(HEXLOAD_COMMAND_STOP);
    hexload_bus_frame_t guess = code_of(&stop, (hexload_nonce_t){{0}});
    // WHEN a hundred guesses come every millisecond for a second
    for (int ms = 0; ms < 1000; ms++) {
        for (int n = 0; n < 100; n++) {
            hexload_node_receive(&node, &stop);
            hexload_node_receive(&node, &guess);
        }
        hexload_node_period(&node, 1);
    }
    // THEN 50 are looked at, each tells a new nonce, and as many acknowledges are sent
    const uint32_t most = 1000 / HEXLOAD_AUTHENTICATION_PAUSE_MS;
    TEST_ASSERT_EQUAL_UINT64(1 + most, node.authentication.nonces);
    TEST_ASSERT_EQUAL_UINT32(most, sent_of(ID_CHALLENGE, NULL));
    TEST_ASSERT_EQUAL_UINT32(1000 / HEXLOAD_NODE_REFUSAL_MS, sent_of(ID_ACKNOWLEDGE, NULL));
    TEST_ASSERT_EQUAL_UINT32(100000, node.status.frames_refused);
}

static void test_who_listens_does_not_look_at_commands(void) {
    // GIVEN a controller with a key that has just started WHEN a command with a code comes
    begin_with(1);
    node.age_ms = 0;
    const hexload_bus_frame_t start = command(HEXLOAD_COMMAND_START);
    const hexload_bus_frame_t code = code_of(&start, node.authentication.nonce);
    hexload_node_receive(&node, &start);
    hexload_node_receive(&node, &code);
    // THEN it does nothing, and the nonce is as it was
    TEST_ASSERT_EQUAL_INT(HEXLOAD_APP_IDLE, node.app.state);
    TEST_ASSERT_EQUAL_UINT64(1, node.authentication.nonces);
    TEST_ASSERT_EQUAL_UINT32(0, sent_count);
}

/// One of somebody without the key, who hears all that is on the bus: random bits, a code of before, the
/// right code with one bit changed, the right code of another command.
static hexload_bus_frame_t forge(uint32_t way, const hexload_bus_frame_t* stop, uint64_t* seed) {
    static hexload_bus_frame_t before;
    hexload_bus_frame_t code = code_of(stop, node.authentication.nonce);
    if (way == 0u) {
        const hexload_bus_frame_t noise = random_frame(seed);
        (void)memcpy(code.data, noise.data, 8);
    } else if (way == 1u) {
        code = before;
    } else if (way == 2u) {
        code.data[*seed % 8u] ^= (uint8_t)(1u << (*seed / 8u % 8u));
        *seed = *seed * 6364136223846793005u + 1442695040888963407u;
    } else {
        hexload_bus_frame_t other = *stop;
        other.data[2] ^= 1u;
        code = code_of(&other, node.authentication.nonce);
    }
    before = code_of(stop, node.authentication.nonce);
    return code;
}

static void test_of_a_million_forged_commands_none_is_carried_out(void) {
    // GIVEN a run under way on a controller with a key
    begin_with(7);
    uint64_t seed = 12345;
    const hexload_bus_frame_t start = command(HEXLOAD_COMMAND_START);
    const hexload_bus_frame_t right = code_of(&start, challenge());
    hexload_node_receive(&node, &start);
    hexload_node_receive(&node, &right);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_APP_ARMED, node.app.state);
    const uint64_t nonces = node.authentication.nonces;
    // WHEN STOP is forged again and again, at the rate at which each one is looked at
    for (uint32_t n = 0; n < (uint32_t)FORGERIES; n++) {
        const hexload_bus_frame_t stop = command(HEXLOAD_COMMAND_STOP);
        const hexload_bus_frame_t code = forge(n % 4u, &stop, &seed);
        hexload_node_receive(&node, &stop);
        hexload_node_receive(&node, &code);
        hexload_node_period(&node, HEXLOAD_AUTHENTICATION_PAUSE_MS);
        // THEN the run goes on
        if (node.app.state != HEXLOAD_APP_ARMED) {
            TEST_FAIL_MESSAGE("a forged command was carried out");
        }
    }
    // AND all were looked at, and refused
    TEST_ASSERT_EQUAL_UINT64(nonces + FORGERIES, node.authentication.nonces);
    TEST_ASSERT_EQUAL_UINT32(FORGERIES, node.status.frames_refused);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_codes_are_those_of_the_rfc);
    RUN_TEST(test_codes_are_those_of_mbedtls_whatever_the_length);
    RUN_TEST(test_a_command_with_the_code_is_carried_out);
    RUN_TEST(test_a_recorded_command_is_refused);
    RUN_TEST(test_another_start_has_other_nonces);
    RUN_TEST(test_a_command_without_its_code_is_refused_in_time);
    RUN_TEST(test_a_command_in_between_takes_the_place_of_the_one_that_waits);
    RUN_TEST(test_damaged_frames_of_a_command_are_refused);
    RUN_TEST(test_challenges_are_answered_at_a_bounded_rate);
    RUN_TEST(test_guesses_are_looked_at_and_answered_at_a_bounded_rate);
    RUN_TEST(test_who_listens_does_not_look_at_commands);
    RUN_TEST(test_of_a_million_forged_commands_none_is_carried_out);
    return UNITY_END();
}
