#include "stack.h"

extern const uint32_t stack_bottom[], stack_top[]; // of the linker script

static const uint32_t paint = 0xA5A5A5A5u; // as in startup.S

uint32_t stack_margin_bytes(void) {
    const uint32_t* word = stack_bottom;
    while (word < stack_top && *word == paint) {
        word++;
    }
    return (uint32_t)((const char*)word - (const char*)stack_bottom);
}
