/// @file clock.h
/// Time from the processor's own cycle counter (PMCCNTR, 32 bits). It wraps within seconds: look at it at
/// least once in four. No function blocks; one thread.
#ifndef HEXLOAD_ZYNQMP_R5_CLOCK_H
#define HEXLOAD_ZYNQMP_R5_CLOCK_H

#include <stdint.h>

typedef struct cycle_clock {
    uint32_t cycles;       ///< counter at the last look
    uint32_t left_cycles;  ///< not yet a microsecond
    uint32_t now_us;       ///< since the start, wraps
    uint32_t period_at_us; ///< when the last period of 1 ms began
} cycle_clock_t;

/// Starts the counter.
void cycle_clock_start(cycle_clock_t* self);

/// Microseconds since the start; wraps after 71 minutes.
uint32_t cycle_clock_us(cycle_clock_t* self);

/// Periods of 1 ms that have begun since the last call.
uint32_t cycle_clock_take_periods(cycle_clock_t* self);

#endif
