#include "front_end/residual_test.h"
#include "machine.h"

#include <math.h>

void setUp(void) {}
void tearDown(void) {}

enum { BLOCK_TICKS = 500 }; // half a second

/// Whitened innovations: six normal numbers each tick, and an error that lasts in the second.
/// @return the mean NIS of single ticks.
static double show(hexload_residual_test_t* test, const hexload_config_t* config, int ticks, double error,
                   uint64_t* seed) {
    double sum = 0.0;
    for (int tick = 0; tick < ticks; tick++) {
        hexload_real_t innovation[6];
        for (int k = 0; k < 6; k++) {
            innovation[k] = (hexload_real_t)(normal(seed) + (k == 1 ? error : 0.0));
            sum += (double)(innovation[k] * innovation[k]);
        }
        hexload_residual_test_step(test, config, innovation, config->rig.direction_count > 0);
    }
    return sum / (double)ticks;
}

static void test_sums_of_noise_are_noise(void) {
    // GIVEN innovations as a filter has them that fits its model WHEN a quarter of an hour goes by
    const hexload_config_t config = paper_machine();
    hexload_residual_test_t test;
    uint64_t seed = 7;
    double mean = 0.0;
    hexload_residual_test_init(&test, 6);
    for (int block = 0; block < 1800; block++) {
        for (int part = 0; part < 10; part++) {
            (void)show(&test, &config, BLOCK_TICKS / 10, 0.0, &seed);
            // THEN no sigma is widened, nor in the middle of a block
            TEST_ASSERT_EQUAL_DOUBLE(1.0, (double)test.factor);
        }
        mean += (double)test.nis / 1800.0;
    }
    // AND the sums have a mean NIS of 6, to five standard deviations of sqrt(12 / 1800)
    TEST_ASSERT_DOUBLE_WITHIN(0.41, 6.0, mean);
}

static void test_an_error_that_single_ticks_do_not_show_widens_sigma(void) {
    // GIVEN a fifth of a sigma that lasts in one of six innovations: 0.04 of the NIS of a tick
    const hexload_config_t config = paper_machine();
    hexload_residual_test_t test;
    uint64_t seed = 8;
    hexload_residual_test_init(&test, 6);
    // WHEN the load's first half second goes by, which does not count, and ten seconds
    (void)show(&test, &config, BLOCK_TICKS, 5.0, &seed);
    TEST_ASSERT_EQUAL_DOUBLE(1.0, (double)test.factor);
    const double nis = show(&test, &config, 20 * BLOCK_TICKS, 0.2, &seed);
    // THEN ticks are as they should be, to five of their standard deviations
    TEST_ASSERT_DOUBLE_WITHIN(0.04 + 5.0 * sqrt(12.0 / 1e4), 6.0, nis);
    // AND the sums are not: 500 ticks add 500 0.2^2 = 20 to each one's 6, of which 9 are granted. Their
    // variance is 12 + 4 20, that of twenty of them twenty times as much.
    const double excess = 20.0 * (26.0 - 9.0);
    const double spread = 5.0 * sqrt(20.0 * 92.0);
    TEST_ASSERT_DOUBLE_WITHIN(spread, excess, (double)(test.factor * test.factor) - 1.0);
    // AND of another load it says nothing
    hexload_residual_test_init(&test, 6);
    TEST_ASSERT_EQUAL_DOUBLE(1.0, (double)test.factor);
}

static void test_a_mismatch_that_is_certain_does_not_wait_for_the_end_of_its_half_second(void) {
    // GIVEN a filter that fits its model, and is at the beginning of a block
    const hexload_config_t config = paper_machine();
    hexload_residual_test_t test;
    uint64_t seed = 10;
    hexload_residual_test_init(&test, 6);
    (void)show(&test, &config, 2 * BLOCK_TICKS, 0.0, &seed);
    // WHEN three sigma last in an innovation for a tenth of a second
    (void)show(&test, &config, 100, 3.0, &seed);
    // THEN sigma is wide already: of sums of six 300 in one, 10 of noise in each, their square over a whole
    // block's 500 ticks, less the 9 granted, to five of the noise's standard deviations
    const double excess = (300.0 * 300.0 + 6.0 * 100.0) / 500.0 - 9.0;
    const double spread = 5.0 * (2.0 * 300.0 * 10.0 + 100.0 * sqrt(12.0)) / 500.0;
    TEST_ASSERT_DOUBLE_WITHIN(spread, excess, (double)(test.factor * test.factor) - 1.0);
    // AND it stays so while the block lasts, though the error is over, and is as the block's end has it then
    const hexload_real_t wide = test.factor;
    (void)show(&test, &config, BLOCK_TICKS - 101, 0.0, &seed);
    TEST_ASSERT_TRUE(test.factor >= wide);
    (void)show(&test, &config, 1, 0.0, &seed);
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, (double)test.excess, (double)(test.factor * test.factor) - 1.0);
}

static void test_a_first_half_second_widens_nothing_before_its_end_either(void) {
    // GIVEN a load's first block, which has the shock of its change in it WHEN that is large
    const hexload_config_t config = paper_machine();
    hexload_residual_test_t test;
    uint64_t seed = 11;
    hexload_residual_test_init(&test, 6);
    (void)show(&test, &config, BLOCK_TICKS - 1, 5.0, &seed);
    // THEN sigma is left as it is
    TEST_ASSERT_EQUAL_DOUBLE(1.0, (double)test.factor);
}

static void test_a_machine_known_to_a_tolerance_is_not_widened_twice(void) {
    // GIVEN a commissioned rig, whose open constants stand in sigma and in the sums, WHEN an error lasts
    hexload_config_t config = paper_machine();
    config.rig.direction_count = 1;
    hexload_residual_test_t test;
    uint64_t seed = 9;
    hexload_residual_test_init(&test, 6);
    (void)show(&test, &config, 20 * BLOCK_TICKS, 1.0, &seed);
    // THEN the sums show it, and sigma is left to the directions
    TEST_ASSERT_TRUE((double)test.nis_mean > 100.0);
    TEST_ASSERT_EQUAL_DOUBLE(1.0, (double)test.factor);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_sums_of_noise_are_noise);
    RUN_TEST(test_an_error_that_single_ticks_do_not_show_widens_sigma);
    RUN_TEST(test_a_mismatch_that_is_certain_does_not_wait_for_the_end_of_its_half_second);
    RUN_TEST(test_a_first_half_second_widens_nothing_before_its_end_either);
    RUN_TEST(test_a_machine_known_to_a_tolerance_is_not_widened_twice);
    return UNITY_END();
}
