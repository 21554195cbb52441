/// @file interrupts.h
/// Handlers that startup.c puts into the vector table when a program defines them; without one, the interrupt
/// ends the program.
#ifndef HEXLOAD_MPS2_AN500_INTERRUPTS_H
#define HEXLOAD_MPS2_AN500_INTERRUPTS_H

#include <stdint.h>

/// External interrupts of the board, as numbers of the interrupt controller.
enum { INTERRUPT_UART0_RECEIVE = 0, INTERRUPT_UART0_SEND = 1 };

void systick_interrupt(void);
void uart0_receive_interrupt(void);
void uart0_send_interrupt(void);

/// Lets an external interrupt through, numbers 0 to 31.
static inline void interrupt_enable(uint32_t number) {
    *(volatile uint32_t*)0xE000E100u = 1u << number; // NVIC_ISER0: zeros are without effect
}

/// No handler runs from here to interrupts_on(). Does not nest.
static inline void interrupts_off(void) {
    __asm volatile("cpsid i" ::: "memory");
}

static inline void interrupts_on(void) {
    __asm volatile("cpsie i" ::: "memory");
}

/// Sleeps until an interrupt is pending; with interrupts off it runs when they are on again.
static inline void interrupt_wait(void) {
    __asm volatile("wfi" ::: "memory");
}

#endif
