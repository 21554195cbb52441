/// The whole node: frames, periods and a bus that goes down, in any order.
#include "bytes.h"

#include "frames.h"

#include "app/node.h"

#include <math.h>

void setUp(void) {}
void tearDown(void) {}

static bool check_sent(void* context, const hexload_bus_frame_t* frame) {
    const uint8_t* is_full = (const uint8_t*)context;
    PROMISE(hexload_bus_check_controller(frame) == HEXLOAD_BUS_OK);
    return *is_full == 0;
}

static void receive_sample(hexload_node_t* node, hexload_bus_profile_t profile, uint32_t tick,
                           bytes_t* bytes) {
    hexload_leg_sample_t sample = {.tick = tick};
    hexload_bus_frame_t frames[HEXLOAD_BUS_SAMPLE_FRAMES];
    uint32_t saturated = 0;
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        sample.displacement_m[leg] = (hexload_real_t)(1e-4 * (int8_t)take_byte(bytes));
        sample.force_n[leg] = HEXLOAD_REAL(900.0);
    }
    const int count = hexload_bus_encode_sample(profile, &sample, frames, &saturated);
    for (int n = 0; n < count; n++) {
        hexload_node_receive(node, &frames[n]);
    }
}

static void receive_frame(hexload_node_t* node, bytes_t* bytes, bool is_sealed) {
    hexload_bus_frame_t frame = {0};
    uint16_t id;
    take(bytes, &id, sizeof id);
    frame.id = id % 0x130u;
    frame.is_fd = (id & 0x8000u) != 0;
    frame.length = (uint8_t)(take_byte(bytes) % (frame.is_fd ? 65 : 9));
    take(bytes, frame.data, frame.length);
    if (is_sealed && frame.length >= 4) {
        seal(&frame);
    }
    hexload_node_receive(node, &frame);
}

static void command(hexload_node_t* node, uint8_t kind, float argument) {
    const hexload_bus_command_t order = {.kind = kind, .sequence = kind, .argument = argument};
    hexload_bus_frame_t frame;
    if (hexload_bus_encode_command(&order, &frame) == HEXLOAD_BUS_OK) {
        hexload_node_receive(node, &frame);
    }
}

static void check_node(const hexload_node_t* node) {
    PROMISE((unsigned)node->app.state <= (unsigned)HEXLOAD_APP_FAULT);
    for (uint32_t k = 0; k < hexload_describe(node->app.config.kind)->parameters; k++) {
        PROMISE(isfinite(node->app.estimate.value[k]) && node->app.estimate.sigma[k] >= 0);
    }
    PROMISE(hexload_config_check(&node->app.config, NULL) == HEXLOAD_OK);
}

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    static hexload_node_t node;
    bytes_t bytes = {data, size};
    uint8_t is_full = 0;
    const uint8_t options = take_byte(&bytes);
    const hexload_bus_profile_t profile = options % 2 == 0 ? HEXLOAD_BUS_FD : HEXLOAD_BUS_CLASSIC;
    const hexload_port_t port = {.context = &is_full, .send = check_sent};
    hexload_config_t config;
    hexload_app_settings_t settings;
    uint32_t tick = 0;
    hexload_config_default(&config);
    config.kind = (hexload_kind_t)(options / 2 % HEXLOAD_KINDS);
    hexload_app_settings_default(&settings);
    PROMISE(hexload_node_init(&node, &config, &settings, profile, &port) == HEXLOAD_OK);
    hexload_node_period(&node, 300);
    while (bytes.left > 0) {
        const uint8_t what = take_byte(&bytes);
        switch (what % 8) {
        case 0:
        case 1:
            receive_frame(&node, &bytes, what % 8 == 0);
            break;
        case 2:
            command(&node, take_byte(&bytes) % 8, take_float(&bytes));
            break;
        case 3:
            command(&node, HEXLOAD_COMMAND_START, (float)(what / 8 % 2));
            break;
        case 4:
            hexload_node_period(&node, what / 8);
            break;
        case 5:
            hexload_node_bus_state(&node, what / 8 % 4 != 0);
            is_full = what / 128;
            break;
        default:
            tick += what / 8 < 28 ? 1u : 5000u * (what / 8u);
            receive_sample(&node, profile, tick, &bytes);
            break;
        }
        check_node(&node);
    }
    return 0;
}
