// A Cortex-R5F of the Zynq UltraScale+ as a controller on its own CAN bus, in the classic profile. Everything
// is polled.
#include "can.h"
#include "clock.h"
#include "console.h"
#include "stack.h"

#include "app/node.h"
#include "ports/boot/boot_options.h"
#include "ports/boot/built_key.h"

#include <stddef.h>

static volatile uint32_t* const can0 = (volatile uint32_t*)0xFF060000u;

extern const hexload_boot_options_t boot_options; // the place is the linker script's

typedef struct machine {
    can_t can;
    cycle_clock_t clock;
} machine_t;

static bool send(void* context, const hexload_bus_frame_t* frame) {
    machine_t* self = (machine_t*)context;
    return can_send(&self->can, frame);
}

static uint32_t clock_us(void* context) {
    machine_t* self = (machine_t*)context;
    return cycle_clock_us(&self->clock);
}

static uint32_t measure_stack(void* context) {
    (void)context;
    return stack_margin_bytes();
}

// Frames first: a sample that has arrived is answered before time passes. Not more of them than the FIFO
// holds, so that time does pass. Where some were lost the four-bit tick may have gone round.
static void step(machine_t* machine, hexload_node_t* node) {
    hexload_bus_frame_t frame;
    const bool has_lost = can_take_overflow(&machine->can);
    for (int n = 0; n < CAN_FIFO_FRAMES && can_receive(&machine->can, &frame); n++) {
        hexload_node_receive(node, &frame);
    }
    if (has_lost) {
        hexload_sample_assembly_lose_tick(&node->assembly);
    }
    const uint32_t periods = cycle_clock_take_periods(&machine->clock);
    hexload_node_bus_state(node, can_check_bus(&machine->can, periods));
    hexload_node_period(node, periods);
}

// Says once whether this node speaks or found another one on the bus.
static void report_start(const hexload_node_t* node, bool* is_reported) {
    if (*is_reported || node->age_ms < HEXLOAD_NODE_LISTEN_MS) {
        return;
    }
    console_say(hexload_node_is_active(node) ? "active" : "silent: another controller is on the bus");
    *is_reported = true;
}

/// From startup.S. Leaves the bus, says what has happened, and waits for a reset.
void report_fault(uint32_t number, uint32_t address);
void report_fault(uint32_t number, uint32_t address) {
    static const char* const names[] = {"?",
                                        "fault: undefined instruction at 0x",
                                        "fault: supervisor call at 0x",
                                        "fault: prefetch abort at 0x",
                                        "fault: data abort at 0x",
                                        "?",
                                        "fault: interrupt at 0x",
                                        "fault: fast interrupt at 0x"};
    *can0 = 1; // reset: a controller that has failed is silent
    console_say_number(names[number & 7u], address);
    for (;;) {
    }
}

int main(void) {
    static machine_t machine;
    static hexload_node_t node;
    hexload_config_t config;
    hexload_app_settings_t settings;
    hexload_port_t port = {
        .context = &machine, .send = send, .clock_us = clock_us, .stack_margin_bytes = measure_stack};
    hexload_config_default(&config);
    config.kind = HEXLOAD_KIND_PAPER; // until the source of samples selects another
    hexload_app_settings_default(&settings);
    hexload_status_t status = hexload_boot_options_take(&boot_options, &config, &settings);
    if (!hexload_built_key_give(&port, hexload_boot_options_seed(&boot_options))) {
        console_say("it has a key, and nothing to make nonces of");
        return 1;
    }
    if (status == HEXLOAD_OK) {
        status = hexload_node_init(&node, &config, &settings, HEXLOAD_BUS_CLASSIC, &port);
    }
    if (status != HEXLOAD_OK) {
        console_say(hexload_status_name(status));
        return 1;
    }
    bool is_reported = false;
    cycle_clock_start(&machine.clock);
    can_start(&machine.can, can0);
    for (;;) {
        step(&machine, &node);
        report_start(&node, &is_reported);
    }
}
