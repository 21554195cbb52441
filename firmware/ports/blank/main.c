// The blank port: where a new one starts. It compiles, shows the loop and does nothing: no bus, no clock.
// Fill in the five functions for the machine; nothing else of the application depends on it.
#include "app/node.h"

#include <stddef.h>

// Starts clock and CAN controller. Returns false when the machine cannot run.
static bool start_machine(void) {
    return false;
}

// Takes a received frame out of the CAN controller. Returns false when there is none.
static bool receive(hexload_bus_frame_t* frame) {
    (void)frame;
    return false;
}

// Hands a frame to the CAN controller. Returns false when its queue is full.
static bool send(void* context, const hexload_bus_frame_t* frame) {
    (void)context;
    (void)frame;
    return false;
}

// Periods of 1 ms that have begun since the last call.
static uint32_t take_periods(void) {
    return 0;
}

// False while the CAN controller is bus-off.
static bool is_bus_up(void) {
    return true;
}

// Frames first: a sample that has arrived is answered before time passes.
static void step(hexload_node_t* node) {
    hexload_bus_frame_t frame;
    while (receive(&frame)) {
        hexload_node_receive(node, &frame);
    }
    hexload_node_bus_state(node, is_bus_up());
    hexload_node_period(node, take_periods());
}

int main(void) {
    static hexload_node_t node;
    hexload_config_t config; // a const struct in flash does as well
    hexload_app_settings_t settings;
    const hexload_port_t port = {.send = send};
    hexload_config_default(&config);
    hexload_app_settings_default(&settings);
    if (!start_machine() ||
        hexload_node_init(&node, &config, &settings, HEXLOAD_BUS_CLASSIC, &port) != HEXLOAD_OK) {
        return 1;
    }
    for (;;) {
        step(&node);
    }
}
