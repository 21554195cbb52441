#include "tick_clock.h"

#include "interrupts.h"
#include "systick.h"

enum {
    COUNTS_PER_US = 25,
    COUNTS_PER_MS = 25000,
    RUN_WITH_INTERRUPT = 7, // on, interrupt, processor clock
};

static volatile uint32_t begun_ms; // the interrupt alone writes it
static uint32_t taken_ms;

void systick_interrupt(void) {
    begun_ms = begun_ms + 1;
}

void tick_clock_start(void) {
    SYSTICK[SYSTICK_RELOAD] = COUNTS_PER_MS - 1;
    SYSTICK[SYSTICK_VALUE] = 0;
    SYSTICK[SYSTICK_CONTROL] = RUN_WITH_INTERRUPT;
    while (SYSTICK[SYSTICK_VALUE] == 0) { // loaded with the first count; 0 would read as a whole period
    }
}

bool tick_clock_has_period(void) {
    return begun_ms != taken_ms;
}

uint32_t tick_clock_take_periods(void) {
    const uint32_t begun = begun_ms;
    const uint32_t periods = begun - taken_ms;
    taken_ms = begun;
    return periods;
}

uint32_t tick_clock_us(void) {
    uint32_t milliseconds;
    uint32_t counts_left;
    do { // again when a millisecond has begun in between
        milliseconds = begun_ms;
        counts_left = SYSTICK[SYSTICK_VALUE];
    } while (milliseconds != begun_ms);
    return 1000 * milliseconds + (COUNTS_PER_MS - 1 - counts_left) / COUNTS_PER_US;
}
