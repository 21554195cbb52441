// Registers: Arm Cortex-M System Design Kit, Technical Reference Manual (DDI 0479), APB UART.
#include "uart.h"

#include "interrupts.h"

#define UART0 ((volatile uint32_t*)0x40004000u)
enum { UART_DATA, UART_STATE, UART_CONTROL, UART_INTERRUPT, UART_BAUD_DIVIDER };
enum { STATE_SEND_FULL = 1, STATE_RECEIVE_FULL = 2 };
enum { CONTROL_ALL = 0xF }; // send, receive, and an interrupt of either
enum { INTERRUPT_SEND = 1, INTERRUPT_RECEIVE = 2 };
enum { SMALLEST_DIVIDER = 16 };

// Indices run on and wrap; each has one writer.
static char received[UART_RECEIVE_BYTES];
static volatile uint32_t received_end;
static volatile uint32_t received_begin;

static char unsent[UART_SEND_BYTES];
static volatile uint32_t unsent_end;
static volatile uint32_t unsent_begin;

_Static_assert((UART_RECEIVE_BYTES & (UART_RECEIVE_BYTES - 1)) == 0,
               "indices wrap at a multiple of the size");
_Static_assert((UART_SEND_BYTES & (UART_SEND_BYTES - 1)) == 0, "indices wrap at a multiple of the size");

void uart0_receive_interrupt(void) {
    UART0[UART_INTERRUPT] = INTERRUPT_RECEIVE;
    while ((UART0[UART_STATE] & STATE_RECEIVE_FULL) != 0) {
        const char byte = (char)UART0[UART_DATA];
        const uint32_t end = received_end;
        if (end - received_begin < UART_RECEIVE_BYTES) {
            received[end % UART_RECEIVE_BYTES] = byte;
            received_end = end + 1;
        }
    }
}

/// Only with interrupts off, or in the interrupt.
static void send_queued(void) {
    while (unsent_begin != unsent_end && (UART0[UART_STATE] & STATE_SEND_FULL) == 0) {
        const uint32_t begin = unsent_begin;
        UART0[UART_DATA] = (uint8_t)unsent[begin % UART_SEND_BYTES];
        unsent_begin = begin + 1;
    }
}

void uart0_send_interrupt(void) {
    UART0[UART_INTERRUPT] = INTERRUPT_SEND;
    send_queued();
}

void uart_start(void) {
    UART0[UART_BAUD_DIVIDER] = SMALLEST_DIVIDER;
    UART0[UART_CONTROL] = CONTROL_ALL;
    interrupt_enable(INTERRUPT_UART0_RECEIVE);
    interrupt_enable(INTERRUPT_UART0_SEND);
}

bool uart_has_byte(void) {
    return received_begin != received_end;
}

bool uart_read(char* byte) {
    const uint32_t begin = received_begin;
    if (begin == received_end) {
        return false;
    }
    *byte = received[begin % UART_RECEIVE_BYTES];
    received_begin = begin + 1;
    return true;
}

bool uart_write(const char* bytes, uint32_t count) {
    const uint32_t end = unsent_end;
    if (count > UART_SEND_BYTES - (end - unsent_begin)) {
        return false;
    }
    for (uint32_t n = 0; n < count; n++) {
        unsent[(end + n) % UART_SEND_BYTES] = bytes[n];
    }
    unsent_end = end + count;
    interrupts_off(); // the first byte of a silent line has no interrupt before it
    send_queued();
    interrupts_on();
    return true;
}
