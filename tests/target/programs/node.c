/// What a leg sample costs from its frames to the answer's: arguments fd|classic paper|momentum LOG OUT,
/// files of the host in the format of tools/python/hexload_dev/target.py. Each sample is encoded, handed to
/// the application as frames, and counted: all of it, and on copies its decoding and the encoding of its
/// answer alone.
#include "app/node.h"
#include "bus/answer_code.h"
#include "bus/authentication.h"
#include "bus/sample_code.h"
#include "ports/mbedtls/aes128.h"

#include "arguments.h"
#include "instruction_counter.h"
#include "painted_stack.h"
#include "semihosting.h"

#include <string.h>

enum exit_status { DONE, BAD_ARGUMENTS = 2, BAD_FILE, BAD_CONFIG, BAD_SAMPLE };

/// What the answer starts with.
typedef struct {
    uint32_t config_bytes;
    uint32_t node_bytes;
    uint32_t start_instructions;   ///< of the command START, acknowledge included
    uint32_t period_instructions;  ///< of the longest hexload_node_period(), one with a status page
    uint32_t code_instructions;    ///< by which a command to a node with a key costs more, AES in software
    uint32_t proof_instructions;   ///< by which a sample with a code costs more, the mean of its sixteen
    uint32_t longest_proof;        ///< the longest of them, with the code's frame
    uint32_t answer_proof;         ///< by which a sample costs more whose answer has a code, the mean
    uint32_t longest_answer_proof; ///< the longest of them, with the code's frame
} header_t;

typedef struct {
    uint32_t state; ///< hexload_app_state_t after the sample
    uint32_t frames_sent;
    uint32_t decode_instructions;
    uint32_t encode_instructions;
    uint32_t whole_instructions;
    uint32_t stack_bytes;
} answer_t;

/// A port that drops what it should send: what sending costs is each port's own.
typedef struct {
    uint32_t sent;
} mailbox_t;

static bool send(void* context, const hexload_bus_frame_t* frame) {
    mailbox_t* mailbox = context;
    (void)frame;
    mailbox->sent++;
    return true;
}

static uint32_t count_decoding(hexload_sample_assembly_t assembly, const hexload_bus_frame_t* frames,
                               int count) {
    hexload_leg_sample_t sample;
    const uint32_t mark = instruction_counter_mark();
    for (int n = 0; n < count; n++) {
        const hexload_bus_status_t status = hexload_sample_assembly_add(&assembly, &frames[n], &sample);
        (void)status; // the node judges it
    }
    return instruction_counter_since(mark);
}

/// The answer that the node has just sent, or the page of it.
static uint32_t count_encoding(const hexload_node_t* node, const hexload_leg_sample_t* sample) {
    const hexload_bus_answer_t answer = {.tick = sample->tick,
                                         .filter = (uint8_t)hexload_bus_filter_of(node->app.config.kind),
                                         .estimate = node->app.estimate};
    hexload_bus_frame_t frames[HEXLOAD_BUS_ANSWER_FRAMES];
    const uint32_t mark = instruction_counter_mark();
    const int count = hexload_bus_encode_answer(node->assembly.profile, &answer, node->answer_page, frames);
    (void)count;
    return instruction_counter_since(mark);
}

static void run_sample(hexload_node_t* node, mailbox_t* mailbox, const hexload_leg_sample_t* sample,
                       const hexload_bus_frame_t* frames, int count, answer_t* answer) {
    const uint32_t sent_before = mailbox->sent;
    answer->decode_instructions = count_decoding(node->assembly, frames, count);
    const uint32_t* stack = paint_stack();
    const uint32_t mark = instruction_counter_mark();
    for (int n = 0; n < count; n++) {
        hexload_node_receive(node, &frames[n]);
    }
    answer->whole_instructions = instruction_counter_since(mark);
    answer->stack_bytes = used_stack_bytes(stack);
    answer->encode_instructions = count_encoding(node, sample);
    answer->frames_sent = mailbox->sent - sent_before;
    answer->state = node->app.state;
}

static uint32_t count_longest_period(hexload_node_t* node) {
    uint32_t longest = 0;
    for (int ms = 0; ms < HEXLOAD_BUS_STATUS_PAGES * HEXLOAD_NODE_STATUS_PERIOD_MS; ms++) {
        const uint32_t mark = instruction_counter_mark();
        hexload_node_period(node, 1);
        const uint32_t instructions = instruction_counter_since(mark);
        longest = instructions > longest ? instructions : longest;
    }
    return longest;
}

/// Of a command that does nothing, its acknowledge included; with the code that goes with it unless `cipher`
/// is NULL.
static uint32_t count_command(hexload_node_t* node, const hexload_cipher_t* cipher) {
    const hexload_bus_command_t command = {.kind = 15};
    hexload_bus_frame_t frames[2];
    const hexload_bus_status_t status = hexload_bus_encode_command(&command, &frames[0]);
    if (cipher != NULL) {
        hexload_bus_encode_command_mac(cipher, &node->authentication.nonce, &frames[0], &frames[1]);
    }
    const uint32_t mark = instruction_counter_mark();
    for (int n = 0; n < (cipher != NULL ? 2 : 1); n++) {
        hexload_node_receive(node, &frames[n]);
    }
    const uint32_t count = instruction_counter_since(mark);
    return status == HEXLOAD_BUS_OK ? count : 0;
}

/// What the code of a command costs; 0: the node did not take it.
static uint32_t count_code(hexload_node_t* node, const hexload_config_t* config,
                           hexload_app_settings_t* settings, hexload_port_t port, mailbox_t* mailbox) {
    static hexload_aes128_t aes;
    static const uint8_t key[HEXLOAD_AES128_KEY_BYTES] = {1, 2, 3};
    const hexload_cipher_t cipher = {&aes, hexload_aes128_encrypt_block};
    const hexload_bus_profile_t profile = (hexload_bus_profile_t)node->status.profile;
    const uint32_t plain = count_command(node, NULL);
    hexload_aes128_init(&aes, key);
    if (hexload_node_init(node, config, settings, profile, &port) != HEXLOAD_OK) {
        return 0;
    }
    hexload_node_period(node, HEXLOAD_NODE_LISTEN_MS);
    hexload_authentication_init(&node->authentication, &cipher, 1); // the port's context is the mailbox
    const uint32_t sent = mailbox->sent;
    const uint32_t with_code = count_command(node, &cipher);
    const bool is_taken = mailbox->sent == sent + 2 && node->status.frames_refused == 0;
    return is_taken ? with_code - plain : 0;
}

/// What the codes of samples cost: the frames of sixteen ticks, and the code's.
static bool count_proofs(hexload_bus_profile_t profile, header_t* header) {
    static hexload_aes128_t aes;
    static const uint8_t key[HEXLOAD_AES128_KEY_BYTES] = {1, 2, 3};
    const hexload_cipher_t cipher = {&aes, hexload_aes128_encrypt_block};
    const hexload_nonce_t nonce = {{0}};
    hexload_sample_code_t source;
    hexload_sample_code_t node;
    uint32_t sum = 0;
    hexload_aes128_init(&aes, key);
    hexload_sample_code_init(&source, &nonce);
    hexload_sample_code_init(&node, &nonce);
    for (uint32_t tick = 0; tick < (uint32_t)HEXLOAD_BUS_CODE_TICKS; tick++) {
        const hexload_leg_sample_t sample = {.tick = tick, .force_n = {100.0f, 200.0f}};
        hexload_bus_frame_t frames[HEXLOAD_BUS_SAMPLE_FRAMES];
        hexload_bus_frame_t code;
        uint32_t saturated = 0;
        const int count = hexload_bus_encode_sample(profile, &sample, frames, &saturated);
        for (int n = 0; n < count; n++) {
            hexload_sample_code_add(&source, &cipher, &frames[n], n + 1 == count, tick);
        }
        const bool is_due = hexload_sample_code_is_due(&source);
        if (is_due) {
            hexload_sample_code_encode(&source, &cipher, &code);
        }
        const uint32_t mark = instruction_counter_mark();
        for (int n = 0; n < count; n++) {
            hexload_sample_code_add(&node, &cipher, &frames[n], n + 1 == count, tick);
        }
        if (is_due && hexload_sample_code_check(&node, &cipher, &code) != HEXLOAD_BUS_OK) {
            return false;
        }
        const uint32_t instructions = instruction_counter_since(mark);
        sum += instructions;
        header->longest_proof = instructions > header->longest_proof ? instructions : header->longest_proof;
    }
    header->proof_instructions = sum / (uint32_t)HEXLOAD_BUS_CODE_TICKS;
    return true;
}

/// What the codes of answers cost: the frames of the ticks that have one code, and the code's.
static void count_answer_proofs(hexload_bus_profile_t profile, hexload_kind_t kind, header_t* header) {
    static hexload_aes128_t aes;
    static const uint8_t key[HEXLOAD_AES128_KEY_BYTES] = {1, 2, 3};
    const hexload_cipher_t cipher = {&aes, hexload_aes128_encrypt_block};
    const hexload_nonce_t nonce = {{0}};
    const bool is_fd = profile == HEXLOAD_BUS_FD;
    const uint32_t ticks = is_fd ? (uint32_t)HEXLOAD_BUS_CODE_TICKS : (uint32_t)HEXLOAD_BUS_PAGE_CODE_TICKS;
    hexload_answer_code_t codes;
    uint32_t sum = 0;
    hexload_aes128_init(&aes, key);
    hexload_answer_code_init(&codes, profile, &nonce);
    for (uint32_t tick = 0; tick < ticks; tick += is_fd ? 1u : (uint32_t)HEXLOAD_BUS_ANSWER_PERIOD) {
        const hexload_bus_answer_t answer = {.tick = tick, .filter = (uint8_t)hexload_bus_filter_of(kind)};
        hexload_bus_frame_t frames[HEXLOAD_BUS_ANSWER_FRAMES];
        hexload_bus_frame_t code;
        const int count = hexload_bus_encode_answer(profile, &answer, 1, frames);
        const uint32_t mark = instruction_counter_mark();
        for (int n = 0; n < count; n++) {
            hexload_answer_code_add(&codes, &cipher, &frames[n], n + 1 == count, tick);
        }
        if (hexload_answer_code_is_due(&codes)) {
            hexload_answer_code_encode(&codes, &cipher, &code);
        }
        const uint32_t instructions = instruction_counter_since(mark);
        sum += instructions;
        if (instructions > header->longest_answer_proof) {
            header->longest_answer_proof = instructions;
        }
    }
    header->answer_proof = sum / ticks;
}

/// Past the listening time, in lockstep, so that no time-out ends the run.
static bool start(hexload_node_t* node, const hexload_config_t* config, hexload_bus_profile_t profile,
                  mailbox_t* mailbox, header_t* header) {
    const hexload_port_t port = {.context = mailbox, .send = send};
    const hexload_bus_command_t command = {.kind = HEXLOAD_COMMAND_START,
                                           .argument = (float)HEXLOAD_PACING_LOCKSTEP};
    hexload_app_settings_t settings;
    hexload_bus_frame_t frame;
    hexload_app_settings_default(&settings);
    settings.refused_limit = UINT32_MAX;
    if (hexload_node_init(node, config, &settings, profile, &port) != HEXLOAD_OK ||
        hexload_bus_encode_command(&command, &frame) != HEXLOAD_BUS_OK) {
        return false;
    }
    hexload_node_period(node, HEXLOAD_NODE_LISTEN_MS);
    header->code_instructions = count_code(node, config, &settings, port, mailbox);
    if (header->code_instructions == 0 || !count_proofs(profile, header) ||
        hexload_node_init(node, config, &settings, profile, &port) != HEXLOAD_OK) {
        return false;
    }
    count_answer_proofs(profile, config->kind, header);
    hexload_node_period(node, HEXLOAD_NODE_LISTEN_MS);
    const uint32_t mark = instruction_counter_mark();
    hexload_node_receive(node, &frame);
    header->start_instructions = instruction_counter_since(mark);
    header->period_instructions = count_longest_period(node);
    return node->app.state == HEXLOAD_APP_ARMED;
}

static enum exit_status run(hexload_bus_profile_t profile, hexload_kind_t kind, int32_t log, int32_t out) {
    static hexload_node_t node;
    static hexload_config_t config;
    static mailbox_t mailbox;
    header_t header = {.config_bytes = sizeof config, .node_bytes = sizeof node};
    hexload_leg_sample_t sample;
    if (!semihosting_read(log, &config, sizeof config)) {
        return BAD_CONFIG;
    }
    config.kind = kind;
    if (!start(&node, &config, profile, &mailbox, &header)) {
        return BAD_CONFIG;
    }
    if (!semihosting_write(out, &header, sizeof header)) {
        return BAD_FILE;
    }
    while (semihosting_read(log, &sample, sizeof sample)) {
        answer_t answer = {0};
        hexload_bus_frame_t frames[HEXLOAD_BUS_SAMPLE_FRAMES];
        uint32_t saturated = 0;
        const int count = hexload_bus_encode_sample(profile, &sample, frames, &saturated);
        if (count < 0) {
            return BAD_SAMPLE;
        }
        run_sample(&node, &mailbox, &sample, frames, count, &answer);
        if (!semihosting_write(out, &answer, sizeof answer)) {
            return BAD_FILE;
        }
    }
    return semihosting_close(out) ? DONE : BAD_FILE;
}

int main(void) {
    const char* words[4];
    if (!arguments_read(words, 4)) {
        return BAD_ARGUMENTS;
    }
    const int32_t log = semihosting_open(words[2], SEMIHOSTING_READ);
    const int32_t out = semihosting_open(words[3], SEMIHOSTING_WRITE);
    if (log < 0 || out < 0) {
        return BAD_FILE;
    }
    instruction_counter_start();
    return run(strcmp(words[0], "fd") == 0 ? HEXLOAD_BUS_FD : HEXLOAD_BUS_CLASSIC,
               strcmp(words[1], "paper") == 0 ? HEXLOAD_KIND_PAPER : HEXLOAD_KIND_MOMENTUM, log, out);
}
