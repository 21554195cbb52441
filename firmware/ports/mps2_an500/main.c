// The controller on Arm's MPS2 board with the Cortex-M7 image AN500: the application on a CAN bus that comes
// as SLCAN over the board's serial line, in the classic profile, for the paper's machine or the one of the
// boot options.
#include "app/node.h"
#include "bus/slcan.h"
#include "ports/boot/boot_options.h"
#include "ports/boot/built_key.h"

#include "interrupts.h"
#include "painted_stack.h"
#include "tick_clock.h"
#include "uart.h"

#include <stddef.h>

// Takes a received frame off the line. Returns false when there is none.
static bool receive(hexload_slcan_t* slcan, hexload_bus_frame_t* frame) {
    char byte;
    while (uart_read(&byte)) {
        if (hexload_slcan_take(slcan, byte, frame)) {
            return true;
        }
    }
    return false;
}

// Returns false when the line's queue has no room for the frame.
static bool send(void* context, const hexload_bus_frame_t* frame) {
    (void)context;
    char text[HEXLOAD_SLCAN_FRAME_BYTES];
    const int count = hexload_slcan_encode(frame, text);
    return count > 0 && uart_write(text, (uint32_t)count);
}

static uint32_t clock_us(void* context) {
    (void)context;
    return tick_clock_us();
}

static uint32_t stack_margin_bytes(void* context) {
    (void)context;
    return painted_stack_margin_bytes();
}

// Frames first: a sample that has arrived is answered before time passes. A serial line does not show that
// nobody is at its other end, so the bus is always up.
static void step(hexload_node_t* node, hexload_slcan_t* slcan) {
    hexload_bus_frame_t frame;
    while (receive(slcan, &frame)) {
        hexload_node_receive(node, &frame);
    }
    hexload_node_period(node, tick_clock_take_periods());
}

// Asks with interrupts off: one that comes in between ends the sleep at once.
static void sleep_until_work(void) {
    interrupts_off();
    if (!uart_has_byte() && !tick_clock_has_period()) {
        interrupt_wait();
    }
    interrupts_on();
}

extern const hexload_boot_options_t boot_options; // the place is the linker script's

int main(void) {
    static hexload_node_t node;
    static hexload_slcan_t slcan;
    hexload_config_t config;
    hexload_app_settings_t settings;
    hexload_port_t port = {.send = send, .clock_us = clock_us, .stack_margin_bytes = stack_margin_bytes};
    painted_stack_paint();
    hexload_config_default(&config);
    config.kind = HEXLOAD_KIND_PAPER; // until the source of samples selects another
    hexload_app_settings_default(&settings);
    hexload_slcan_init(&slcan);
    if (hexload_boot_options_take(&boot_options, &config, &settings) != HEXLOAD_OK ||
        !hexload_built_key_give(&port, hexload_boot_options_seed(&boot_options)) ||
        hexload_node_init(&node, &config, &settings, HEXLOAD_BUS_CLASSIC, &port) != HEXLOAD_OK) {
        return 1;
    }
    uart_start();
    tick_clock_start();
    for (;;) {
        step(&node, &slcan);
        sleep_until_work();
    }
}
