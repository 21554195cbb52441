/// @file tick_clock.h
/// The controller's clock: SysTick interrupts every millisecond. Not together with instruction_counter.h,
/// which has the same timer.
#ifndef HEXLOAD_MPS2_AN500_TICK_CLOCK_H
#define HEXLOAD_MPS2_AN500_TICK_CLOCK_H

#include <stdbool.h>
#include <stdint.h>

void tick_clock_start(void);

/// Whether tick_clock_take_periods() has something to give.
bool tick_clock_has_period(void);

/// Milliseconds that have begun since the last call, or since the start. From one thread.
uint32_t tick_clock_take_periods(void);

/// Microseconds since the start; wraps after 71 minutes. Not from interrupts, nor while they are off.
uint32_t tick_clock_us(void);

#endif
