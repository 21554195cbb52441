/// Looks at the port's clock with another one: argument OUT, a file of the host in the format of
/// tests/target/test_ticks.py. The other one is the board's first timer, which has the same 25 MHz and
/// nothing else to do with SysTick.
#include "semihosting.h"
#include "tick_clock.h"

#include <string.h>

// Cortex-M System Design Kit, Technical Reference Manual (DDI 0479), APB timer.
#define TIMER0 ((volatile uint32_t*)0x40000000u)
enum { TIMER_CONTROL, TIMER_VALUE, TIMER_RELOAD };

enum { TICKS = 1000, LATE_COUNTS = 87500 }; // 3.5 ms

enum exit_status { DONE, BAD_ARGUMENTS = 2, BAD_FILE };

/// At each begin of a millisecond, after a long computation, and at the begin of the millisecond after that.
typedef struct {
    uint32_t counts;  ///< of the timer
    uint32_t us;      ///< of the clock
    uint32_t periods; ///< that have begun since the last entry
    uint32_t returns; ///< times that the clock went back in the meantime
} entry_t;

static entry_t entries[TICKS + 2];

static uint32_t timer_counts(void) {
    return UINT32_MAX - TIMER0[TIMER_VALUE];
}

static void note(entry_t* entry) {
    entry->counts = timer_counts();
    entry->us = tick_clock_us();
    entry->periods = tick_clock_take_periods();
}

static void await_tick(entry_t* entry) {
    uint32_t last_us = tick_clock_us();
    while (!tick_clock_has_period()) {
        const uint32_t us = tick_clock_us();
        entry->returns += us < last_us ? 1u : 0u;
        last_us = us;
    }
    note(entry);
}

int main(void) {
    char command_line[512];
    char* rest = NULL;
    if (!semihosting_command_line(command_line, sizeof command_line) ||
        strtok_r(command_line, " ", &rest) == NULL) {
        return BAD_ARGUMENTS;
    }
    const char* path = strtok_r(NULL, " ", &rest);
    const int32_t out = path == NULL ? -1 : semihosting_open(path, SEMIHOSTING_WRITE);
    if (out < 0) {
        return BAD_FILE;
    }
    TIMER0[TIMER_RELOAD] = UINT32_MAX;
    TIMER0[TIMER_VALUE] = UINT32_MAX;
    TIMER0[TIMER_CONTROL] = 1;
    tick_clock_start();
    // Without sleep: when the processor waits for an interrupt, QEMU moves its time on by two ticks at once.
    for (int n = 0; n < TICKS; n++) {
        await_tick(&entries[n]);
    }
    while (timer_counts() - entries[TICKS - 1].counts < LATE_COUNTS) {
    }
    note(&entries[TICKS]);
    await_tick(&entries[TICKS + 1]);
    return semihosting_write(out, entries, sizeof entries) && semihosting_close(out) ? DONE : BAD_FILE;
}
