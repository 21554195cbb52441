#include "console.h"

// UG1087, module UART.
static volatile uint32_t* const uart0 = (volatile uint32_t*)0xFF000000u;
enum { CONTROL = 0x00 / 4, STATUS = 0x2C / 4, FIFO = 0x30 / 4 };
enum { CONTROL_TX_ENABLE = 1 << 4, STATUS_TX_FULL = 1 << 4 };

static void put(char character) {
    while ((uart0[STATUS] & STATUS_TX_FULL) != 0) {
    }
    uart0[FIFO] = (uint8_t)character;
}

static void put_all(const char* text) {
    uart0[CONTROL] = CONTROL_TX_ENABLE;
    while (*text != '\0') {
        put(*text++);
    }
}

void console_say(const char* line) {
    put_all(line);
    put('\n');
}

void console_say_number(const char* line, uint32_t number) {
    put_all(line);
    for (int shift = 28; shift >= 0; shift -= 4) {
        put("0123456789abcdef"[number >> shift & 0xFu]);
    }
    put('\n');
}
