/// @file painted_stack.h
/// How much stack a call has used: paint below the caller's frame, and what is left of it afterwards.
#ifndef PAINTED_STACK_H
#define PAINTED_STACK_H

#include <stdint.h>

enum { PAINTED_WORDS = 1536 };
#define STACK_PAINT 0x5AFEC0DEu

/// Fills the free stack with paint. Inline, as a frame of its own would lie in it; nothing interrupts here.
static inline uint32_t* paint_stack(void) {
    uint32_t* stack;
    __asm volatile("mov %0, sp" : "=r"(stack));
    for (int n = 1; n <= PAINTED_WORDS; n++) {
        ((volatile uint32_t*)stack)[-n] = STACK_PAINT;
    }
    return stack;
}

/// Bytes below `stack` that are no longer paint.
static inline uint32_t used_stack_bytes(const uint32_t* stack) {
    int free_words = 0;
    while (free_words < PAINTED_WORDS && stack[free_words - PAINTED_WORDS] == STACK_PAINT) {
        free_words++;
    }
    return (uint32_t)(PAINTED_WORDS - free_words) * sizeof(uint32_t);
}

#endif
