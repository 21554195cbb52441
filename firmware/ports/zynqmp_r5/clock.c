#include "clock.h"

// The processor's clock: 500 MHz is the ZCU102's default; the emulator counts nanoseconds.
#ifdef HEXLOAD_ZYNQMP_EMULATED
enum { CYCLES_PER_US = 1000 };
#else
enum { CYCLES_PER_US = 500 };
#endif

enum { US_PER_PERIOD = 1000 };

static uint32_t count_cycles(void) {
    uint32_t cycles;
    __asm volatile("mrc p15, 0, %0, c9, c13, 0" : "=r"(cycles)); // PMCCNTR
    return cycles;
}

void cycle_clock_start(cycle_clock_t* self) {
    const uint32_t enable_and_reset = 1u << 2 | 1u << 0; // PMCR.C and .E; .D stays 0: every cycle counts
    const uint32_t cycle_counter = 1u << 31;
    __asm volatile("mcr p15, 0, %0, c9, c12, 0" ::"r"(enable_and_reset)); // PMCR
    __asm volatile("mcr p15, 0, %0, c9, c12, 1" ::"r"(cycle_counter));    // PMCNTENSET
    *self = (cycle_clock_t){.cycles = count_cycles()};
}

uint32_t cycle_clock_us(cycle_clock_t* self) {
    const uint32_t cycles = count_cycles();
    const uint32_t passed = cycles - self->cycles;
    const uint32_t sum = self->left_cycles + passed % CYCLES_PER_US;
    self->cycles = cycles;
    self->now_us += passed / CYCLES_PER_US + sum / CYCLES_PER_US;
    self->left_cycles = sum % CYCLES_PER_US;
    return self->now_us;
}

uint32_t cycle_clock_take_periods(cycle_clock_t* self) {
    const uint32_t periods = (cycle_clock_us(self) - self->period_at_us) / US_PER_PERIOD;
    self->period_at_us += periods * US_PER_PERIOD;
    return periods;
}
