/// @file hum_test.h
/// Whether the filter's innovations hum at a frequency of the mains. Internal.
///
/// A hum of the force sensors stands in the Jacobian as it does in the innovations, and moves the inertias as
/// force noise does (D15), but third differences do not measure it: at 50 Hz they pass a thirtieth. In sums
/// over half a second (R15) it is none. White innovations turned back by that frequency, summed over n ticks
/// and times sqrt(2 / n), are again independent normal numbers, two for each innovation. Speeds from
/// displacements have noise that is not white: without velocity sensors no hum is heard.
#ifndef HEXLOAD_HUM_TEST_H
#define HEXLOAD_HUM_TEST_H

#include "algebra/linalg.h"
#include "hexload/state.h"

void hexload_hum_test_init(hexload_hum_test_t* self, const hexload_config_t* config);

/// A block begins anew, as after a gap.
void hexload_hum_test_begin(hexload_hum_test_t* self);

/// A block is whole.
void hexload_hum_test_close(hexload_hum_test_t* self);

/// Takes the whitened innovation of one update of the filter. Some 25 instructions, and 80 more once in half
/// a second. Reentrant; inline, as every tick has it.
/// @param gap_ticks since the last one: sums go on over 1.
static inline void hexload_hum_test_step(hexload_hum_test_t* self, uint32_t gap_ticks,
                                         const hexload_real_t whitened[HEXLOAD_PAPER_MEASUREMENTS]) {
    const hexload_real_t factor = self->factor;
    if (gap_ticks != 1) {
        hexload_hum_test_begin(self);
    }
    HEXLOAD_UNROLL
    for (int k = 0; k < HEXLOAD_PAPER_MEASUREMENTS; k++) {
        const hexload_real_t sum = self->sum[k];
        self->sum[k] = hexload_fma(factor, sum, whitened[k] - self->last_sum[k]);
        self->last_sum[k] = sum;
    }
    self->ticks++;
    if (self->ticks >= self->block_ticks) {
        hexload_hum_test_close(self);
    }
}

#endif
