// Commands to a controller with a key.
#include "frames.h"

#include "app/node.h"
#include "bus/answer_assembly.h"
#include "bus/answer_code.h"
#include "bus/sample_code.h"
#include "bus/tick_code.h"
#include "motion.h"
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

static void begin_in(hexload_bus_profile_t profile, uint64_t seed) {
    const hexload_config_t config = paper_machine();
    const hexload_port_t port = {.context = &aes,
                                 .send = log_frame,
                                 .aes128_encrypt_block = hexload_aes128_encrypt_block,
                                 .nonce_seed = seed};
    hexload_app_settings_t settings;
    hexload_app_settings_default(&settings);
    hexload_aes128_init(&aes, rfc_key);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_node_init(&node, &config, &settings, profile, &port));
    hexload_node_period(&node, HEXLOAD_NODE_LISTEN_MS);
    sent_count = 0;
}

static void begin_with(uint64_t seed) {
    begin_in(HEXLOAD_BUS_CLASSIC, seed);
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
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OTHER, hexload_bus_decode_challenge(&start, &next));
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

static void test_a_command_that_waited_in_vain_is_given_back(void) {
    // GIVEN a STOP that waits for its code WHEN its time is over THEN it is told which command that was
    hexload_authentication_t authentication;
    hexload_bus_command_t expected, waiting, late = {0};
    const hexload_bus_frame_t stop = command(HEXLOAD_COMMAND_STOP);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, hexload_bus_decode_command(&stop, &expected));
    hexload_aes128_init(&aes, rfc_key);
    hexload_authentication_init(&authentication, &cipher, 1);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_PARTIAL, hexload_authentication_take(&authentication, &stop, &waiting));
    TEST_ASSERT_FALSE(
        hexload_authentication_elapse(&authentication, HEXLOAD_AUTHENTICATION_HOLD_MS - 1, &late));
    TEST_ASSERT_TRUE(hexload_authentication_elapse(&authentication, 1, &late));
    TEST_ASSERT_EQUAL_UINT8(HEXLOAD_COMMAND_STOP, late.kind);
    TEST_ASSERT_EQUAL_UINT8(expected.source, late.source);
    TEST_ASSERT_EQUAL_UINT16(expected.session, late.session);
    TEST_ASSERT_EQUAL_UINT8(expected.sequence, late.sequence);
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
    // AND WHEN nobody asks any more THEN the last one is answered, and no other is told
    hexload_node_period(&node, HEXLOAD_NODE_CHALLENGE_MS);
    sent_count = 0;
    hexload_node_period(&node, HEXLOAD_NODE_CHALLENGE_MS);
    TEST_ASSERT_EQUAL_UINT32(0, sent_of(ID_CHALLENGE, NULL));
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

static void test_commands_without_codes_are_told_so_at_a_bounded_rate(void) {
    // GIVEN a controller with a key WHEN a command without a code comes every millisecond THEN each takes the
    // place of the one before, and one in 20 ms is told that it is refused
    begin_with(1);
    uint32_t told = 0;
    for (uint32_t ms = 0; ms < 200; ms++) {
        const hexload_bus_frame_t stop = command(HEXLOAD_COMMAND_STOP);
        sent_count = 0;
        hexload_node_receive(&node, &stop);
        TEST_ASSERT_EQUAL_UINT32(ms % HEXLOAD_NODE_REFUSAL_MS == 1, sent_of(ID_ACKNOWLEDGE, NULL));
        told += sent_count;
        hexload_node_period(&node, 1);
    }
    TEST_ASSERT_EQUAL_UINT32(200 / HEXLOAD_NODE_REFUSAL_MS, told);
    TEST_ASSERT_EQUAL_UINT32(199, node.status.frames_refused);
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

// Samples with codes.

/// A source of samples that has the key: what it has sent, and its code.
typedef struct source {
    hexload_bus_profile_t profile;
    hexload_sample_code_t code;
    hexload_answer_assembly_t assembly;
    hexload_answer_code_t answers; ///< that it has read
} source_t;

/// START in lockstep with codes of these kinds, carried out.
static source_t begin_run_with(hexload_bus_profile_t profile, int codes) {
    source_t source = {.profile = profile};
    const hexload_nonce_t nonce = challenge();
    const hexload_bus_command_t order = {.kind = HEXLOAD_COMMAND_START,
                                         .source = HEXLOAD_SOURCE_SIMULATOR,
                                         .sequence = ++sequence,
                                         .argument = (float)(HEXLOAD_PACING_LOCKSTEP + codes)};
    hexload_bus_frame_t start;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, hexload_bus_encode_command(&order, &start));
    const hexload_bus_frame_t code = code_of(&start, nonce);
    hexload_node_receive(&node, &start);
    hexload_node_receive(&node, &code);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_APP_ARMED, node.app.state);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_PACING_LOCKSTEP, node.app.pacing);
    hexload_sample_code_init(&source.code, &nonce);
    hexload_answer_code_init(&source.answers, profile, &nonce);
    hexload_answer_assembly_init(&source.assembly, profile);
    return source;
}

static source_t begin_run(hexload_bus_profile_t profile) {
    return begin_run_with(profile, HEXLOAD_PACING_CODES);
}

/// Samples of these ticks, each frame to the node; where a code is due its frame too, as `change` leaves it.
static void give_ticks(source_t* source, uint32_t begin, uint32_t end,
                       bool (*change)(hexload_bus_frame_t* frame)) {
    static const body_t load = {500.0, {0.0, 0.0, 0.3}, {25.0, 25.0, 25.0, 0.0, 0.0, 0.0}};
    const motion_t motion = paper_motion(0.02);
    for (uint32_t tick = begin; tick < end; tick++) {
        const hexload_leg_sample_t sample =
            perfect_sample(&node.app.config, &load, &motion,
                           (double)node.app.estimator.as.paper.kinematics.home_height_m, tick);
        hexload_bus_frame_t frames[HEXLOAD_BUS_SAMPLE_FRAMES];
        const int count = encode_sample(source->profile, &sample, frames);
        sent_count = 0;
        for (int n = 0; n < count; n++) {
            hexload_sample_code_add(&source->code, &cipher, &frames[n], n + 1 == count, tick);
            hexload_node_receive(&node, &frames[n]);
        }
        if (hexload_sample_code_is_due(&source->code)) {
            hexload_bus_frame_t code;
            hexload_sample_code_encode(&source->code, &cipher, &code);
            TEST_ASSERT_EQUAL_HEX32(ID_SAMPLE_MAC, code.id);
            if (change == NULL || change(&code)) {
                hexload_node_receive(&node, &code);
            }
        }
    }
}

static bool lose(hexload_bus_frame_t* frame) {
    (void)frame;
    return false;
}

static bool flip(hexload_bus_frame_t* frame) {
    frame->data[7] ^= 0x80u;
    return true;
}

static bool shorten(hexload_bus_frame_t* frame) {
    frame->length = 7;
    return true;
}

static bool lengthen(hexload_bus_frame_t* frame) {
    frame->is_fd = true;
    return true;
}

static void test_whole_blocks_one_by_one_have_the_code_of_all(void) {
    // GIVEN the RFC's four blocks WHEN they come one by one THEN the code is that of the whole
    hexload_cmac_blocks_t blocks;
    uint8_t code[HEXLOAD_CIPHER_BYTES];
    hexload_aes128_init(&aes, rfc_key);
    hexload_cmac_begin(&blocks, rfc_message);
    for (size_t n = HEXLOAD_CIPHER_BYTES; n < MESSAGE_BYTES; n += HEXLOAD_CIPHER_BYTES) {
        hexload_cmac_add(&blocks, &cipher, &rfc_message[n]);
    }
    hexload_cmac_end(&blocks, &cipher, code);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(rfc_codes[3].code, code, sizeof code);
}

/// What a code goes over, as the contract has it.
typedef struct message {
    uint8_t bytes[8192];
    size_t count;
} message_t;

/// As many as are given, and zeros up to a whole number of blocks.
static void put_bytes(message_t* message, const uint8_t* bytes, size_t count) {
    memcpy(&message->bytes[message->count], bytes, count);
    message->count += count;
    while (message->count % HEXLOAD_CIPHER_BYTES != 0) {
        message->bytes[message->count++] = 0;
    }
}

static void assert_code_of(const message_t* message, const hexload_bus_frame_t* frame) {
    uint8_t code[HEXLOAD_CIPHER_BYTES];
    hexload_cmac(&cipher, message->bytes, message->count, code);
    TEST_ASSERT_EQUAL_UINT8(8, frame->length);
    TEST_ASSERT_FALSE(frame->is_fd);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(code, frame->data, 8);
}

static const hexload_nonce_t some_nonce = {{0xA1, 0xA2, 0xA3, 0xA4, 0xA5, 0xA6, 0xA7, 0xA8}};

static void test_nonces_and_codes_of_commands_go_over_data_id_nonce_and_command(void) {
    // GIVEN the bytes that the contract names, the lowest of each number first WHEN a nonce and a command's
    // code are made THEN they are the first half of their CMAC
    const uint8_t of_nonce[20] = {0x11, 0x01, 0x4C, 0x48, 1,  2,  3,  4,  5,  6,
                                  7,    8,    9,    10,   11, 12, 13, 14, 15, 16};
    const uint8_t of_command[20] = {0x11, 0x00, 0x4C, 0x48, 0xA1, 0xA2, 0xA3, 0xA4, 0xA5, 0xA6,
                                    0xA7, 0xA8, 1,    2,    3,    4,    5,    6,    7,    8};
    const hexload_bus_frame_t order = {.id = ID_COMMAND, .length = 8, .data = {1, 2, 3, 4, 5, 6, 7, 8}};
    uint8_t expected[HEXLOAD_CIPHER_BYTES];
    hexload_nonce_t nonce;
    hexload_aes128_init(&aes, rfc_key);
    hexload_cmac(&cipher, of_nonce, sizeof of_nonce, expected);
    hexload_bus_make_nonce(&cipher, UINT64_C(0x0807060504030201), UINT64_C(0x100F0E0D0C0B0A09), &nonce);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(expected, nonce.bytes, sizeof nonce.bytes);
    hexload_cmac(&cipher, of_command, sizeof of_command, expected);
    const hexload_bus_frame_t code = code_of(&order, some_nonce);
    TEST_ASSERT_EQUAL_HEX32(ID_COMMAND_MAC, code.id);
    TEST_ASSERT_EQUAL_HEX8_ARRAY(expected, code.data, 8);
}

static void test_codes_of_samples_go_over_data_id_nonce_tick_and_legs(void) {
    const uint8_t first[16] = {0x87, 0x00, 0x4C, 0x48, 0xA1, 0xA2, 0xA3, 0xA4,
                               0xA5, 0xA6, 0xA7, 0xA8, 0x50, 0x34, 0x12, 0x80};
    hexload_aes128_init(&aes, rfc_key);
    for (int profile = HEXLOAD_BUS_FD; profile <= HEXLOAD_BUS_CLASSIC; profile++) {
        // GIVEN sixteen ticks WHEN their code is made THEN it goes over these bytes, and no whole tick's
        static message_t message;
        hexload_sample_code_t code;
        hexload_bus_frame_t frames[HEXLOAD_BUS_SAMPLE_FRAMES];
        message.count = 0;
        put_bytes(&message, first, sizeof first);
        hexload_sample_code_init(&code, &some_nonce);
        for (uint32_t tick = 0x80123450; tick < 0x80123460; tick++) {
            const hexload_leg_sample_t sample = numbered_sample(tick);
            uint8_t legs[64];
            size_t bytes = 0;
            TEST_ASSERT_FALSE(hexload_sample_code_is_due(&code));
            const int count = encode_sample((hexload_bus_profile_t)profile, &sample, frames);
            for (int n = 0; n < count; n++) {
                hexload_sample_code_add(&code, &cipher, &frames[n], n + 1 == count, tick);
                if (frames[n].id != ID_SAMPLE_TICK) {
                    memcpy(&legs[bytes], frames[n].data, frames[n].length);
                    bytes += frames[n].length;
                }
            }
            put_bytes(&message, legs, bytes);
        }
        TEST_ASSERT_TRUE(hexload_sample_code_is_due(&code));
        hexload_sample_code_encode(&code, &cipher, &frames[0]);
        TEST_ASSERT_EQUAL_HEX32(ID_SAMPLE_MAC, frames[0].id);
        assert_code_of(&message, &frames[0]);
        TEST_ASSERT_FALSE(hexload_sample_code_is_due(&code));
    }
}

static void test_codes_of_answers_go_over_data_id_nonce_tick_and_frames(void) {
    const uint8_t first[16] = {0x07, 0x01, 0x4C, 0x48, 0xA1, 0xA2, 0xA3, 0xA4,
                               0xA5, 0xA6, 0xA7, 0xA8, 0x40, 0x34, 0x12, 0x80};
    hexload_aes128_init(&aes, rfc_key);
    for (int profile = HEXLOAD_BUS_FD; profile <= HEXLOAD_BUS_CLASSIC; profile++) {
        // GIVEN the answers of sixteen ticks, or pages of sixty-four WHEN their code is made THEN it goes
        // over these bytes
        static message_t message;
        hexload_answer_code_t code;
        hexload_bus_frame_t frames[HEXLOAD_BUS_ANSWER_FRAMES];
        const bool is_fd = profile == HEXLOAD_BUS_FD;
        const uint32_t step = is_fd ? 1 : 2, begin = 0x80123440, end = begin + (is_fd ? 16 : 64);
        message.count = 0;
        put_bytes(&message, first, sizeof first);
        hexload_answer_code_init(&code, (hexload_bus_profile_t)profile, &some_nonce);
        for (uint32_t tick = begin; tick < end; tick += step) {
            const hexload_bus_answer_t answer = numbered_answer(HEXLOAD_FILTER_PAPER, tick);
            TEST_ASSERT_FALSE(hexload_answer_code_is_due(&code));
            const int count =
                encode_answer((hexload_bus_profile_t)profile, &answer, (int)(tick / 2 % 13), frames);
            for (int n = 0; n < count; n++) {
                hexload_answer_code_add(&code, &cipher, &frames[n], n + 1 == count, tick);
                put_bytes(&message, frames[n].data, frames[n].length);
            }
        }
        TEST_ASSERT_TRUE(hexload_answer_code_is_due(&code));
        TEST_ASSERT_EQUAL_UINT32(1, code.unproven);
        hexload_answer_code_encode(&code, &cipher, &frames[0]);
        TEST_ASSERT_EQUAL_HEX32(ID_ANSWER_MAC, frames[0].id);
        assert_code_of(&message, &frames[0]);
        TEST_ASSERT_FALSE(hexload_answer_code_is_due(&code));
        TEST_ASSERT_EQUAL_UINT32(0, code.unproven);
    }
}

static void test_bytes_of_any_number_are_filled_up_with_zeros(void) {
    const uint8_t first[16] = {0x87, 0x00, 0x4C, 0x48, 0xA1, 0xA2, 0xA3, 0xA4, 0xA5, 0xA6, 0xA7, 0xA8, 9};
    hexload_aes128_init(&aes, rfc_key);
    for (uint32_t count = 1; count <= MESSAGE_BYTES; count++) {
        // GIVEN so many bytes WHEN they are added to a code THEN zeros follow them up to the end of a block
        static message_t message;
        hexload_cmac_blocks_t blocks;
        hexload_bus_frame_t frame;
        message.count = 0;
        put_bytes(&message, first, sizeof first);
        put_bytes(&message, rfc_message, count);
        hexload_tick_code_begin(&blocks, ID_SAMPLE_MAC, &some_nonce, 9);
        hexload_tick_code_add(&blocks, &cipher, rfc_message, count);
        hexload_tick_code_encode(&blocks, &cipher, ID_SAMPLE_MAC, &frame);
        assert_code_of(&message, &frame);
    }
}

static void test_frames_of_codes_have_eight_bytes_and_the_classic_format(void) {
    // GIVEN frames of all lengths and both formats WHEN they come as nonce or code THEN others than the
    // contract's are refused
    hexload_sample_code_t samples;
    hexload_answer_code_t answers;
    hexload_aes128_init(&aes, rfc_key);
    hexload_sample_code_init(&samples, &some_nonce);
    hexload_answer_code_init(&answers, HEXLOAD_BUS_FD, &some_nonce);
    for (int n = 0; n < 2 * (HEXLOAD_BUS_FRAME_BYTES + 1); n++) {
        hexload_bus_frame_t frame = {.length = (uint8_t)(n / 2), .is_fd = n % 2 == 1};
        hexload_nonce_t nonce;
        const bool is_right = n == 2 * 8;
        frame.id = ID_CHALLENGE;
        TEST_ASSERT_EQUAL_INT(is_right ? HEXLOAD_BUS_OK : HEXLOAD_BUS_ERR_LENGTH,
                              hexload_bus_decode_challenge(&frame, &nonce));
        frame.id = ID_COMMAND_MAC;
        TEST_ASSERT_EQUAL_INT(is_right ? HEXLOAD_BUS_OK : HEXLOAD_BUS_ERR_LENGTH,
                              hexload_bus_is_command_mac(&frame));
        frame.id = ID_SAMPLE_MAC;
        TEST_ASSERT_EQUAL_INT(is_right ? HEXLOAD_BUS_ERR_AUTHENTICATION : HEXLOAD_BUS_ERR_LENGTH,
                              hexload_sample_code_check(&samples, &cipher, &frame));
        frame.id = ID_ANSWER_MAC;
        TEST_ASSERT_EQUAL_INT(is_right ? HEXLOAD_BUS_PARTIAL : HEXLOAD_BUS_ERR_LENGTH,
                              hexload_answer_code_check(&answers, &cipher, &frame));
    }
}

static void test_a_run_whose_samples_have_codes_goes_on(void) {
    for (int profile = HEXLOAD_BUS_FD; profile <= HEXLOAD_BUS_CLASSIC; profile++) {
        // GIVEN a START with codes WHEN samples come with theirs, from a tick in the middle of sixteen on
        begin_in((hexload_bus_profile_t)profile, 3);
        source_t source = begin_run((hexload_bus_profile_t)profile);
        give_ticks(&source, 16 * 7 + 5, 16 * 20, NULL);
        // THEN it estimates, and nothing is refused
        TEST_ASSERT_TRUE(hexload_app_is_running(&node.app));
        TEST_ASSERT_EQUAL_UINT32(0, node.status.frames_refused);
        TEST_ASSERT_EQUAL_UINT32(0, node.unproven);
    }
}

static void test_a_run_whose_codes_lack_ends(void) {
    static bool (*const changes[3])(hexload_bus_frame_t*) = {lose, shorten, lengthen};
    for (int profile = HEXLOAD_BUS_FD; profile <= HEXLOAD_BUS_CLASSIC; profile++) {
        for (int n = 0; n < 3; n++) {
            // GIVEN a run with codes WHEN they are lost, or no frames of the contract, for four times sixteen
            // ticks
            begin_in((hexload_bus_profile_t)profile, 3);
            source_t source = begin_run((hexload_bus_profile_t)profile);
            give_ticks(&source, 0, 32, NULL);
            give_ticks(&source, 32, 32 + 16 * HEXLOAD_NODE_UNPROVEN, changes[n]);
            TEST_ASSERT_TRUE(hexload_app_is_running(&node.app));
            // THEN at the next sample it is in fault
            give_ticks(&source, 32 + 16 * HEXLOAD_NODE_UNPROVEN, 33 + 16 * HEXLOAD_NODE_UNPROVEN, NULL);
            TEST_ASSERT_EQUAL_INT(HEXLOAD_FAULT_NOT_AUTHENTICATED, node.app.fault);
            // AND each sixteen without their code are counted, and the frames that were no codes
            TEST_ASSERT_EQUAL_UINT32((n == 0 ? 1 : 2) * HEXLOAD_NODE_UNPROVEN, node.status.frames_refused);
        }
    }
}

static void test_a_wrong_code_of_whole_ticks_ends_the_run_at_once(void) {
    for (int profile = HEXLOAD_BUS_FD; profile <= HEXLOAD_BUS_CLASSIC; profile++) {
        // GIVEN a run with codes WHEN one of them is wrong, of ticks that have all come
        begin_in((hexload_bus_profile_t)profile, 3);
        source_t source = begin_run((hexload_bus_profile_t)profile);
        give_ticks(&source, 0, 47, NULL);
        TEST_ASSERT_TRUE(hexload_app_is_running(&node.app));
        give_ticks(&source, 47, 48, flip);
        // THEN it is in fault, and a second wrong one changes nothing
        TEST_ASSERT_EQUAL_INT(HEXLOAD_FAULT_NOT_AUTHENTICATED, node.app.fault);
        give_ticks(&source, 48, 64, flip);
        TEST_ASSERT_EQUAL_UINT32(2 + 1, node.status.frames_refused); // and sixteen ticks without one
    }
}

static void test_before_the_first_code_matches_wrong_ones_have_time(void) {
    // GIVEN a START with codes WHEN the first ones are wrong, as of a source that has not heard of it yet
    begin_in(HEXLOAD_BUS_FD, 3);
    source_t source = begin_run(HEXLOAD_BUS_FD);
    give_ticks(&source, 0, 16 * HEXLOAD_NODE_UNPROVEN, flip);
    TEST_ASSERT_TRUE(hexload_app_is_running(&node.app));
    // THEN the run ends when they go on to be
    give_ticks(&source, 16 * HEXLOAD_NODE_UNPROVEN, 16 * HEXLOAD_NODE_UNPROVEN + 32, flip);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_FAULT_NOT_AUTHENTICATED, node.app.fault);
}

static void test_a_tick_that_is_lost_costs_no_more_than_its_sixteen(void) {
    // GIVEN a run with codes WHEN a tick is lost in every second sixteen THEN the others prove it
    begin_in(HEXLOAD_BUS_FD, 3);
    source_t source = begin_run(HEXLOAD_BUS_FD);
    for (uint32_t tick = 0; tick < 16 * 20; tick += 32) {
        give_ticks(&source, tick, tick + 5, NULL);
        give_ticks(&source, tick + 6, tick + 32, NULL);
    }
    TEST_ASSERT_TRUE(hexload_app_is_running(&node.app));
    TEST_ASSERT_EQUAL_UINT32(9, node.status.frames_refused); // sixteens without a code, since the first one
    // AND a code that comes without its ticks is refused
    hexload_bus_frame_t code = {.id = ID_SAMPLE_MAC, .length = 8};
    hexload_node_receive(&node, &code);
    TEST_ASSERT_EQUAL_UINT32(9 + 1, node.status.frames_refused);
}

static void test_samples_from_far_ahead_are_never_followed_where_samples_have_codes(void) {
    // GIVEN a run with codes, whose source is silent WHEN any number of samples comes from far ahead
    begin_in(HEXLOAD_BUS_FD, 3);
    source_t source = begin_run(HEXLOAD_BUS_FD), other = source;
    give_ticks(&source, 0, 37, NULL);
    hexload_node_period(&node, 9900);
    give_ticks(&other, 1u << 20, (1u << 20) + 500, lose);
    // THEN it is where it was, and the source's codes prove what comes then
    TEST_ASSERT_EQUAL_UINT32(36, node.app.last_tick);
    give_ticks(&source, 37, 64, NULL);
    TEST_ASSERT_EQUAL_UINT32(0, node.unproven);
    TEST_ASSERT_TRUE(hexload_app_is_running(&node.app));
}

static void test_samples_without_their_code_are_a_remark(void) {
    // GIVEN a run with codes WHEN one does not come THEN the samples after are answered with a remark for a
    // while
    begin_in(HEXLOAD_BUS_FD, 3);
    source_t source = begin_run(HEXLOAD_BUS_FD);
    give_ticks(&source, 5, 32, NULL);
    TEST_ASSERT_EQUAL_UINT32(0, node.refused.count);
    give_ticks(&source, 32, 48, lose);
    TEST_ASSERT_EQUAL_UINT32(0, node.refused.count);
    give_ticks(&source, 48, 49, NULL);
    TEST_ASSERT_EQUAL_UINT32(HEXLOAD_NODE_MANY_REFUSED, node.refused.count);
    // AND a count that stays
    TEST_ASSERT_EQUAL_UINT32(1, node.status.frames_refused);
}

static void test_a_leg_that_is_lost_spoils_no_other_tick(void) {
    // GIVEN a classic run with codes WHEN one leg frame of a tick is lost
    begin_with(3);
    source_t source = begin_run(HEXLOAD_BUS_CLASSIC);
    give_ticks(&source, 0, 16, NULL);
    hexload_leg_sample_t sample = numbered_sample(16);
    hexload_bus_frame_t frames[HEXLOAD_BUS_SAMPLE_FRAMES];
    const int count = encode_sample(HEXLOAD_BUS_CLASSIC, &sample, frames);
    for (int n = 0; n + 1 < count; n++) {
        hexload_node_receive(&node, &frames[n]);
    }
    // THEN the next sixteen are proven again
    give_ticks(&source, 17, 48, NULL);
    TEST_ASSERT_EQUAL_UINT32(0, node.unproven);
    TEST_ASSERT_TRUE(hexload_app_is_running(&node.app));
}

static bool double_code(hexload_bus_frame_t* frame) {
    hexload_node_receive(&node, frame);
    return true;
}

static void test_a_code_that_comes_twice_is_refused_and_stops_nothing(void) {
    for (int profile = HEXLOAD_BUS_FD; profile <= HEXLOAD_BUS_CLASSIC; profile++) {
        // GIVEN a run with codes WHEN each of them comes twice THEN the second one is refused, and it goes on
        begin_in((hexload_bus_profile_t)profile, 3);
        source_t source = begin_run((hexload_bus_profile_t)profile);
        give_ticks(&source, 0, 16 * 5, double_code);
        TEST_ASSERT_EQUAL_UINT32(5, node.status.frames_refused);
        TEST_ASSERT_TRUE(hexload_app_is_running(&node.app));
    }
}

static void test_more_legs_than_a_tick_has_are_left_out(void) {
    // GIVEN leg frames without a first one WHEN more of them come than fit THEN nothing is written beyond
    hexload_sample_code_t code;
    hexload_sample_code_init(&code, &(hexload_nonce_t){{0}});
    const hexload_bus_frame_t leg = {.id = ID_LEG_SAMPLE_1 + 1, .length = 8};
    for (int n = 0; n < 20; n++) {
        hexload_sample_code_add(&code, &cipher, &leg, false, 0);
    }
    TEST_ASSERT_EQUAL_UINT8(HEXLOAD_BUS_FRAME_BYTES, code.count);
}

static void test_a_recorded_run_is_not_the_next_ones(void) {
    // GIVEN the codes of one run
    begin_in(HEXLOAD_BUS_FD, 3);
    source_t source = begin_run(HEXLOAD_BUS_FD);
    // WHEN the same samples come with them after another START
    const hexload_bus_frame_t stop = command(HEXLOAD_COMMAND_STOP);
    const hexload_bus_frame_t code = code_of(&stop, challenge());
    hexload_node_receive(&node, &stop);
    hexload_node_receive(&node, &code);
    (void)begin_run(HEXLOAD_BUS_FD);
    give_ticks(&source, 0, 16 * HEXLOAD_NODE_UNPROVEN + 1, NULL);
    // THEN that run ends
    TEST_ASSERT_EQUAL_INT(HEXLOAD_FAULT_NOT_AUTHENTICATED, node.app.fault);
}

static void test_a_start_without_codes_asks_for_none(void) {
    // GIVEN a run with codes, stopped, and a START without WHEN samples without codes come THEN it goes on
    begin_in(HEXLOAD_BUS_FD, 3);
    (void)begin_run(HEXLOAD_BUS_FD);
    const hexload_bus_frame_t orders[2] = {command(HEXLOAD_COMMAND_STOP), command(HEXLOAD_COMMAND_START)};
    for (int n = 0; n < 2; n++) {
        const hexload_bus_frame_t code = code_of(&orders[n], challenge());
        hexload_node_receive(&node, &orders[n]);
        hexload_node_receive(&node, &code);
    }
    source_t source = {.profile = HEXLOAD_BUS_FD};
    give_ticks(&source, 0, 16 * 8, NULL);
    TEST_ASSERT_TRUE(hexload_app_is_running(&node.app));
    // AND passes over a code that comes nevertheless
    const uint32_t refused = node.status.frames_refused;
    const hexload_bus_frame_t mac = {.id = ID_SAMPLE_MAC, .length = 8};
    hexload_node_receive(&node, &mac);
    TEST_ASSERT_EQUAL_UINT32(refused, node.status.frames_refused);
    // AND a controller without a key refuses one with codes
    hexload_bus_acknowledge_t acknowledge;
    const hexload_bus_command_t start = {.kind = HEXLOAD_COMMAND_START, .argument = HEXLOAD_PACING_CODES};
    begin_with(4);
    hexload_app_command(&node.app, &start, &acknowledge);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_RESULT_BAD_ARGUMENT, acknowledge.result);
}

// Answers with codes.

/// What the source makes of a frame of the node's.
static hexload_bus_status_t read_frame(source_t* source, const hexload_bus_frame_t* frame, uint32_t tick) {
    const hexload_bus_status_t status = hexload_answer_code_check(&source->answers, &cipher, frame);
    hexload_bus_answer_t answer;
    uint32_t answered_tick = 0;
    if (status != HEXLOAD_BUS_OTHER) {
        return status;
    }
    const hexload_bus_status_t taken =
        hexload_answer_assembly_add(&source->assembly, frame, tick, &answered_tick, &answer);
    if (taken == HEXLOAD_BUS_OK || taken == HEXLOAD_BUS_PARTIAL) {
        const bool ends_answer = taken == HEXLOAD_BUS_OK || source->profile == HEXLOAD_BUS_CLASSIC;
        hexload_answer_code_add(&source->answers, &cipher, frame, ends_answer, answered_tick);
    }
    return status;
}

/// Samples of these ticks without codes; what the node answers goes through `change` to the source.
/// @return what the last AnswerMac among it was, _OTHER: none.
static hexload_bus_status_t read_ticks(source_t* source, uint32_t begin, uint32_t end,
                                       bool (*change)(hexload_bus_frame_t* frame, uint32_t tick)) {
    hexload_bus_status_t found = HEXLOAD_BUS_OTHER;
    for (uint32_t tick = begin; tick < end; tick++) {
        give_ticks(source, tick, tick + 1, lose);
        for (uint32_t n = 0; n < sent_count; n++) {
            hexload_bus_frame_t frame = sent[n];
            const bool has_come = change == NULL || change(&frame, tick);
            const hexload_bus_status_t status =
                has_come ? read_frame(source, &frame, tick) : HEXLOAD_BUS_OTHER;
            found = status != HEXLOAD_BUS_OTHER ? status : found;
        }
    }
    return found;
}

static uint32_t ticks_of_a_code(int profile) {
    return profile == HEXLOAD_BUS_FD ? HEXLOAD_BUS_CODE_TICKS : HEXLOAD_BUS_PAGE_CODE_TICKS;
}

static bool leave(hexload_bus_frame_t* frame, uint32_t tick) {
    (void)frame;
    (void)tick;
    return true;
}

static bool is_estimate(const hexload_bus_frame_t* frame) {
    return frame->id == ID_ESTIMATE_FD || frame->id == ID_ANSWER_PAGE;
}

static bool forge_estimate(hexload_bus_frame_t* frame, uint32_t tick) {
    if (is_estimate(frame) && tick % 64u == 20u) { // a value's last bit
        frame->data[frame->is_fd ? 8 : 4] ^= 1u;
        seal(frame);
    }
    return true;
}

static bool forge_code(hexload_bus_frame_t* frame, uint32_t tick) {
    (void)tick;
    frame->data[0] ^= frame->id == ID_ANSWER_MAC ? 1u : 0u;
    return true;
}

static bool lose_estimate(hexload_bus_frame_t* frame, uint32_t tick) {
    return !(is_estimate(frame) && tick % 16u == 4u);
}

static bool lose_last_answer(hexload_bus_frame_t* frame, uint32_t tick) {
    return frame->id == ID_ANSWER_MAC || tick % 16u < 14u;
}

static bool lose_answers(hexload_bus_frame_t* frame, uint32_t tick) {
    (void)tick;
    return frame->id == ID_ANSWER_MAC;
}

static bool shorten_code(hexload_bus_frame_t* frame, uint32_t tick) {
    (void)tick;
    frame->length = frame->id == ID_ANSWER_MAC ? 7 : frame->length;
    return true;
}

static const struct {
    const char* name;
    bool (*change)(hexload_bus_frame_t* frame, uint32_t tick);
    hexload_bus_status_t expected;
} changes_of_answers[] = {
    {"none", leave, HEXLOAD_BUS_OK},
    {"another estimate, with its checksum", forge_estimate, HEXLOAD_BUS_ERR_AUTHENTICATION},
    {"another code", forge_code, HEXLOAD_BUS_ERR_AUTHENTICATION},
    {"a frame is lost", lose_estimate, HEXLOAD_BUS_PARTIAL},
    {"the last ones are lost", lose_last_answer, HEXLOAD_BUS_PARTIAL},
    {"all are lost", lose_answers, HEXLOAD_BUS_PARTIAL},
    {"the code's length", shorten_code, HEXLOAD_BUS_ERR_LENGTH},
};

static void test_a_reader_with_the_key_knows_the_controllers_answers_from_others(void) {
    for (int profile = HEXLOAD_BUS_FD; profile <= HEXLOAD_BUS_CLASSIC; profile++) {
        for (size_t n = 0; n < sizeof changes_of_answers / sizeof changes_of_answers[0]; n++) {
            // GIVEN a run whose answers have codes, the first of them read
            begin_in((hexload_bus_profile_t)profile, 3);
            source_t source = begin_run_with((hexload_bus_profile_t)profile, HEXLOAD_PACING_ANSWER_CODES);
            const uint32_t ticks = ticks_of_a_code(profile);
            TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, read_ticks(&source, 0, ticks, NULL));
            // WHEN somebody changes what comes then THEN the code tells, unless frames are missing
            TEST_ASSERT_EQUAL_INT_MESSAGE(changes_of_answers[n].expected,
                                          read_ticks(&source, ticks, 2 * ticks, changes_of_answers[n].change),
                                          changes_of_answers[n].name);
            // AND what is honest after it is taken
            TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, read_ticks(&source, 2 * ticks, 3 * ticks, NULL));
            TEST_ASSERT_EQUAL_UINT32(0, source.answers.unproven);
            TEST_ASSERT_FALSE(node.app.has_codes);
        }
    }
}

static bool hear_nothing(hexload_bus_frame_t* frame, uint32_t tick) {
    (void)frame;
    (void)tick;
    return false;
}

static void test_a_reader_that_joins_late_knows_a_false_answer_from_the_first_whole_code_on(void) {
    for (int profile = HEXLOAD_BUS_FD; profile <= HEXLOAD_BUS_CLASSIC; profile++) {
        // GIVEN a reader that has missed what the first code goes over WHEN of the next one is false THEN it
        // is told
        begin_in((hexload_bus_profile_t)profile, 3);
        source_t source = begin_run_with((hexload_bus_profile_t)profile, HEXLOAD_PACING_ANSWER_CODES);
        const uint32_t ticks = ticks_of_a_code(profile);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OTHER, read_ticks(&source, 0, ticks, hear_nothing));
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_AUTHENTICATION,
                              read_ticks(&source, ticks, 2 * ticks, forge_code));
    }
}

static void test_answers_without_codes_are_counted(void) {
    // GIVEN a run whose answers have codes WHEN these do not come THEN the reader counts
    begin_in(HEXLOAD_BUS_FD, 3);
    source_t source = begin_run_with(HEXLOAD_BUS_FD, HEXLOAD_PACING_ANSWER_CODES);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OTHER, read_ticks(&source, 8, 15, NULL));
    TEST_ASSERT_EQUAL_UINT32(1, source.answers.unproven);
    for (uint32_t tick = 32; tick < 96; tick += 16) { // the tick with the code is not answered
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OTHER, read_ticks(&source, tick, tick + 15, NULL));
    }
    TEST_ASSERT_EQUAL_UINT32(5, source.answers.unproven);
    // AND no more than it can
    source.answers.unproven = UINT32_MAX;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OTHER, read_ticks(&source, 96, 97, NULL));
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, source.answers.unproven);
}

static void test_a_code_goes_over_the_samples_that_were_answered(void) {
    // GIVEN a run that begins between two codes and loses a sample WHEN the codes come THEN they are right
    begin_in(HEXLOAD_BUS_FD, 3);
    source_t source = begin_run_with(HEXLOAD_BUS_FD, HEXLOAD_PACING_ANSWER_CODES);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, read_ticks(&source, 5, 16, NULL));
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OTHER, read_ticks(&source, 16, 20, NULL));
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, read_ticks(&source, 21, 32, NULL));
}

static void test_a_stop_is_acknowledged_after_the_code_of_the_last_answers(void) {
    for (int profile = HEXLOAD_BUS_FD; profile <= HEXLOAD_BUS_CLASSIC; profile++) {
        // GIVEN a run whose last answers have no code yet
        begin_in((hexload_bus_profile_t)profile, 3);
        source_t source = begin_run_with((hexload_bus_profile_t)profile, HEXLOAD_PACING_ANSWER_CODES);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OTHER, read_ticks(&source, 0, 7, NULL));
        // WHEN it is stopped
        const hexload_bus_frame_t stop = command(HEXLOAD_COMMAND_STOP);
        const hexload_bus_frame_t code = code_of(&stop, challenge());
        hexload_node_receive(&node, &stop);
        hexload_node_receive(&node, &code);
        // THEN the code comes before the acknowledge, which is behind the challenge
        TEST_ASSERT_EQUAL_UINT32(3, sent_count);
        TEST_ASSERT_EQUAL_HEX32(ID_ACKNOWLEDGE, sent[2].id);
        const hexload_bus_frame_t before = sent[1];
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, hexload_answer_code_check(&source.answers, &cipher, &before));
        // AND is not the next run's
        source = begin_run_with((hexload_bus_profile_t)profile, HEXLOAD_PACING_ANSWER_CODES);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OTHER, read_ticks(&source, 0, 7, NULL));
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_PARTIAL,
                              hexload_answer_code_check(&source.answers, &cipher, &before));
    }
}

static void test_recorded_answers_are_not_the_next_runs(void) {
    // GIVEN the answers of a run, with their code
    begin_in(HEXLOAD_BUS_FD, 3);
    source_t source = begin_run_with(HEXLOAD_BUS_FD, HEXLOAD_PACING_ANSWER_CODES);
    hexload_bus_frame_t recorded[LOG_FRAMES];
    uint32_t count = 0;
    for (uint32_t tick = 0; tick < 16; tick++) {
        give_ticks(&source, tick, tick + 1, lose);
        for (uint32_t n = 0; n < sent_count; n++) {
            recorded[count++] = sent[n];
        }
    }
    TEST_ASSERT_EQUAL_UINT32(3 * 16 + 1, count);
    // WHEN they come again after another START THEN their code does not match
    const hexload_bus_frame_t stop = command(HEXLOAD_COMMAND_STOP);
    const hexload_bus_frame_t code = code_of(&stop, challenge());
    hexload_node_receive(&node, &stop);
    hexload_node_receive(&node, &code);
    source = begin_run_with(HEXLOAD_BUS_FD, HEXLOAD_PACING_ANSWER_CODES);
    for (uint32_t n = 0; n + 1 < count; n++) {
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OTHER, read_frame(&source, &recorded[n], n / 3));
    }
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_AUTHENTICATION, read_frame(&source, &recorded[count - 1], 15));
}

static void test_without_a_word_in_start_answers_have_no_code(void) {
    for (int profile = HEXLOAD_BUS_FD; profile <= HEXLOAD_BUS_CLASSIC; profile++) {
        // GIVEN a START with codes of samples alone WHEN samples are answered THEN no answer has a code
        begin_in((hexload_bus_profile_t)profile, 3);
        source_t source = begin_run((hexload_bus_profile_t)profile);
        for (uint32_t tick = 0; tick < 70; tick++) {
            give_ticks(&source, tick, tick + 1, NULL);
            TEST_ASSERT_EQUAL_UINT32(0, sent_of(ID_ANSWER_MAC, NULL));
        }
        TEST_ASSERT_TRUE(hexload_app_is_running(&node.app));
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_codes_are_those_of_the_rfc);
    RUN_TEST(test_codes_are_those_of_mbedtls_whatever_the_length);
    RUN_TEST(test_a_command_with_the_code_is_carried_out);
    RUN_TEST(test_a_recorded_command_is_refused);
    RUN_TEST(test_another_start_has_other_nonces);
    RUN_TEST(test_a_command_without_its_code_is_refused_in_time);
    RUN_TEST(test_a_command_that_waited_in_vain_is_given_back);
    RUN_TEST(test_a_command_in_between_takes_the_place_of_the_one_that_waits);
    RUN_TEST(test_damaged_frames_of_a_command_are_refused);
    RUN_TEST(test_challenges_are_answered_at_a_bounded_rate);
    RUN_TEST(test_guesses_are_looked_at_and_answered_at_a_bounded_rate);
    RUN_TEST(test_commands_without_codes_are_told_so_at_a_bounded_rate);
    RUN_TEST(test_who_listens_does_not_look_at_commands);
    RUN_TEST(test_whole_blocks_one_by_one_have_the_code_of_all);
    RUN_TEST(test_nonces_and_codes_of_commands_go_over_data_id_nonce_and_command);
    RUN_TEST(test_codes_of_samples_go_over_data_id_nonce_tick_and_legs);
    RUN_TEST(test_codes_of_answers_go_over_data_id_nonce_tick_and_frames);
    RUN_TEST(test_bytes_of_any_number_are_filled_up_with_zeros);
    RUN_TEST(test_frames_of_codes_have_eight_bytes_and_the_classic_format);
    RUN_TEST(test_a_run_whose_samples_have_codes_goes_on);
    RUN_TEST(test_a_run_whose_codes_lack_ends);
    RUN_TEST(test_a_wrong_code_of_whole_ticks_ends_the_run_at_once);
    RUN_TEST(test_before_the_first_code_matches_wrong_ones_have_time);
    RUN_TEST(test_a_tick_that_is_lost_costs_no_more_than_its_sixteen);
    RUN_TEST(test_samples_from_far_ahead_are_never_followed_where_samples_have_codes);
    RUN_TEST(test_samples_without_their_code_are_a_remark);
    RUN_TEST(test_a_leg_that_is_lost_spoils_no_other_tick);
    RUN_TEST(test_a_code_that_comes_twice_is_refused_and_stops_nothing);
    RUN_TEST(test_more_legs_than_a_tick_has_are_left_out);
    RUN_TEST(test_a_recorded_run_is_not_the_next_ones);
    RUN_TEST(test_a_start_without_codes_asks_for_none);
    RUN_TEST(test_a_reader_with_the_key_knows_the_controllers_answers_from_others);
    RUN_TEST(test_a_reader_that_joins_late_knows_a_false_answer_from_the_first_whole_code_on);
    RUN_TEST(test_answers_without_codes_are_counted);
    RUN_TEST(test_a_code_goes_over_the_samples_that_were_answered);
    RUN_TEST(test_a_stop_is_acknowledged_after_the_code_of_the_last_answers);
    RUN_TEST(test_recorded_answers_are_not_the_next_runs);
    RUN_TEST(test_without_a_word_in_start_answers_have_no_code);
    RUN_TEST(test_of_a_million_forged_commands_none_is_carried_out);
    return UNITY_END();
}
