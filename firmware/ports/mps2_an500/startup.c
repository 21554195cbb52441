/// From reset to main(), and what happens when the processor refuses to go on.
#include "interrupts.h"
#include "semihosting.h"

#include <stdint.h>
#include <string.h>

// Of the linker script; their addresses are the values.
extern uint32_t data_load[], data_start[], data_end[], bss_start[], bss_end[], stack_top[];

int main(void);

void reset(void);

static volatile uint32_t* const coprocessor_access = (volatile uint32_t*)0xE000ED88u;

void reset(void) {
    *coprocessor_access |= 0xFu << 20; // FPU on for all code, before any instruction that uses it
    __asm volatile("dsb\n isb");
    memcpy(data_start, data_load, (size_t)((const char*)data_end - (const char*)data_start));
    memset(bss_start, 0, (size_t)((const char*)bss_end - (const char*)bss_start));
    semihosting_exit(main());
}

/// Exceptions that nothing here causes on purpose end the program with a status of their own.
static void stop(void) {
    semihosting_exit(SEMIHOSTING_STATUS_FAULT);
}

// A program that uses an interrupt defines its handler.
void systick_interrupt(void) __attribute__((weak, alias("stop")));
void uart0_receive_interrupt(void) __attribute__((weak, alias("stop")));
void uart0_send_interrupt(void) __attribute__((weak, alias("stop")));

/// Of the processor up to SysTick, then the board's (Application Note AN500) as far as a program uses them.
__attribute__((section(".vectors"), used)) static const struct {
    uint32_t* initial_stack;
    void (*handler[17])(void);
} vectors = {stack_top,
             {reset, stop, stop, stop, stop, stop, stop, stop, stop, stop, stop, stop, stop, stop,
              systick_interrupt, uart0_receive_interrupt, uart0_send_interrupt}};
