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

static void test_a_block_is_looked_at_in_one_tick_of_eight(void) {
    // GIVEN a block in which five sigma last in an innovation WHEN it goes by THEN sigma follows once in
    // eight ticks, in the third of them, so that the work of a tick is not that of all its stages: the sum's
    // square over the 500 ticks of a block, less the 9 granted, if that is more than 60
    const hexload_config_t config = paper_machine();
    const hexload_real_t innovation[6] = {HEXLOAD_REAL(5.0)};
    hexload_residual_test_t test;
    uint64_t seed = 12;
    double factor = 1.0;
    hexload_residual_test_init(&test, 6);
    (void)show(&test, &config, BLOCK_TICKS, 0.0, &seed);
    for (int tick = 1; tick < BLOCK_TICKS; tick++) {
        hexload_residual_test_step(&test, &config, innovation, false);
        const double excess = 25.0 * tick * tick / BLOCK_TICKS - 9.0;
        factor = tick % 8 == 2 && excess > 60.0 ? sqrt(1.0 + excess) : factor;
        TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(8, factor), factor, (double)test.factor);
    }
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

static void test_what_open_constants_leave_counts_as_that_of_blocks_that_know_nothing_of_each_other(void) {
    // GIVEN a commissioned rig WHEN noise is all there is to its innovations, or a fifth of a sigma lasts in
    // one of six
    hexload_config_t config = paper_machine();
    config.rig.direction_count = 1;
    const double errors[] = {0.0, 0.2};
    for (int n = 0; n < 2; n++) {
        hexload_residual_test_t test;
        uint64_t seed = 11;
        hexload_residual_test_init(&test, 6);
        (void)show(&test, &config, 60 * BLOCK_TICKS, errors[n], &seed);
        // THEN the filter's variance is too small by as much as that of half seconds' sums is too large, AND
        // never too large; 500 ticks add 20 to each one's 6, with a variance of 12 + 4 20, of which a mean of
        // ten keeps a nineteenth
        const double factor = (double)hexload_residual_test_factor(&test, true);
        TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(4, 3.0), sqrt(fmax(1.0, (double)test.nis_mean / 6.0)), factor);
        TEST_ASSERT_DOUBLE_WITHIN(5.0 * sqrt((12.0 + 80.0 * n) / 19.0), 6.0 + 20.0 * n,
                                  (double)test.nis_mean);
        // AND where no constants are open it is what the excess says
        TEST_ASSERT_EQUAL_DOUBLE(1.0, (double)hexload_residual_test_factor(&test, false));
    }
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

static void test_the_excess_is_what_blocks_have_beyond_one_and_a_half_of_their_freedoms(void) {
    // GIVEN blocks of innovations that are the same in each tick of one, calm ones and others
    const hexload_config_t config = paper_machine();
    for (uint32_t dimension = 4; dimension <= 6; dimension += 2) {
        hexload_residual_test_t test;
        uint64_t seed = 10;
        double nis = dimension, nis_mean = dimension, excess = 0.0;
        int widened = 0;
        hexload_residual_test_init(&test, dimension);
        for (int block = 0; block < 60; block++) {
            hexload_real_t innovation[6];
            double square = 0.0;
            for (uint32_t k = 0; k < 6; k++) {
                innovation[k] = (hexload_real_t)((block % 20 < 8 ? 0.05 : 0.2) * uniform(&seed));
                square += k < dimension ? (double)(innovation[k] * innovation[k]) : 0.0;
            }
            // WHEN half a second of each goes by
            for (int tick = 0; tick < BLOCK_TICKS; tick++) {
                hexload_residual_test_step(&test, &config, innovation, false);
            }
            // THEN its NIS is that of the sum, a tenth of it goes into the mean, and what it has beyond 1.5
            // times its degrees of freedom is summed, from 0 up; but for the first block
            if (block > 0) {
                nis = (double)BLOCK_TICKS * square;
                nis_mean += 0.1 * (nis - nis_mean);
                excess = fmax(0.0, excess + nis - 1.5 * dimension);
            }
            const double factor = excess > 60.0 ? sqrt(1.0 + excess) : 1.0;
            const double rounding =
                ROUNDINGS(2 * BLOCK_TICKS, 60.0); // of sums of 500, whose NIS is 60 at most
            TEST_ASSERT_DOUBLE_WITHIN(rounding, nis, (double)test.nis);
            TEST_ASSERT_DOUBLE_WITHIN(rounding, nis_mean, (double)test.nis_mean);
            TEST_ASSERT_DOUBLE_WITHIN((block + 1) * rounding, excess, (double)test.excess);
            if (fabs(excess - 60.0) > 0.5) {
                TEST_ASSERT_DOUBLE_WITHIN((block + 1) * rounding, factor, (double)test.factor);
                widened += excess > 60.0;
            }
        }
        TEST_ASSERT_GREATER_THAN_INT(5, widened);
        TEST_ASSERT_LESS_THAN_INT(55, widened);
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_sums_of_noise_are_noise);
    RUN_TEST(test_an_error_that_single_ticks_do_not_show_widens_sigma);
    RUN_TEST(test_a_mismatch_that_is_certain_does_not_wait_for_the_end_of_its_half_second);
    RUN_TEST(test_a_block_is_looked_at_in_one_tick_of_eight);
    RUN_TEST(test_a_first_half_second_widens_nothing_before_its_end_either);
    RUN_TEST(test_what_open_constants_leave_counts_as_that_of_blocks_that_know_nothing_of_each_other);
    RUN_TEST(test_a_machine_known_to_a_tolerance_is_not_widened_twice);
    RUN_TEST(test_the_excess_is_what_blocks_have_beyond_one_and_a_half_of_their_freedoms);
    return UNITY_END();
}
