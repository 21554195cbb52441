#include "painted_stack.h"

// Of the linker script; their addresses are the values.
extern uint32_t painted_stack[], stack_top[];

static const uint32_t paint = 0xC0FFEE00u;

void painted_stack_paint(void) {
    const uint32_t* stack;
    __asm volatile("mov %0, sp" : "=r"(stack));
    for (volatile uint32_t* word = painted_stack; word < stack; word++) {
        *word = paint;
    }
}

uint32_t painted_stack_margin_bytes(void) {
    const volatile uint32_t* word = painted_stack;
    while (word < stack_top && *word == paint) {
        word++;
    }
    return (uint32_t)word - (uint32_t)painted_stack;
}
