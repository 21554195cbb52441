/// @file hum_test.h
/// Whether the filter's innovations hum at a frequency of the mains. Internal.
///
/// A hum of the force sensors stands in the Jacobian as it does in the innovations, and moves the inertias as
/// force noise does (D15), but third differences do not measure it: at 50 Hz they pass a thirtieth. In sums
/// over half a second (R15) it is none. White innovations turned back by that frequency, summed over n ticks
/// and times sqrt(2 / n), are again independent normal numbers, two for each innovation.
#ifndef HEXLOAD_HUM_TEST_H
#define HEXLOAD_HUM_TEST_H

#include "hexload/state.h"

void hexload_hum_test_init(hexload_hum_test_t* self, const hexload_config_t* config);

/// Takes the whitened innovation of one update of the filter. Some 40 instructions, and 50 more once in half
/// a second. Reentrant.
/// @param gap_ticks since the last one: sums go on over 1.
void hexload_hum_test_step(hexload_hum_test_t* self, const hexload_config_t* config, uint32_t gap_ticks,
                           const hexload_real_t whitened[HEXLOAD_PAPER_MEASUREMENTS]);

#endif
