/// @file instruction_counter.h
/// Instructions that the processor has executed, under QEMU with `-icount shift=6,sleep=off`: each takes 64
/// ns of the machine's time there, and SysTick counts 40 ns. The same program with the same input gives the
/// same numbers. On silicon this counts time.
#ifndef HEXLOAD_MPS2_AN500_INSTRUCTION_COUNTER_H
#define HEXLOAD_MPS2_AN500_INSTRUCTION_COUNTER_H

#include "systick.h"

/// Lets SysTick count down from 2^24 - 1 again and again, without an interrupt.
static inline void instruction_counter_start(void) {
    SYSTICK[SYSTICK_RELOAD] = 0xFFFFFFu;
    SYSTICK[SYSTICK_VALUE] = 0;
    SYSTICK[SYSTICK_CONTROL] = 5; // on, processor clock
}

/// A point in time. Inline, so that it adds one load to what it measures.
static inline uint32_t instruction_counter_mark(void) {
    __asm volatile("" ::: "memory"); // nothing is moved across
    const uint32_t value = SYSTICK[SYSTICK_VALUE];
    __asm volatile("" ::: "memory");
    return value;
}

/// Instructions since a mark, to within one; at most ten million.
static inline uint32_t instruction_counter_since(uint32_t mark) {
    return ((mark - instruction_counter_mark()) & 0xFFFFFFu) * 40u / 64u;
}

#endif
