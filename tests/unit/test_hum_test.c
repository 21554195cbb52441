#include "machine.h"
#include "paper/hum_test.h"

#include <math.h>

void setUp(void) {}
void tearDown(void) {}

#define PI 3.14159265358979323846

enum { BLOCK_TICKS = 500 }; // half a second

/// Whitened innovations: three normal numbers each tick, and an oscillation in the second.
static void show(hexload_hum_test_t* test, const hexload_config_t* config, int ticks, double amplitude,
                 double frequency_hz, uint64_t* seed) {
    for (int tick = 0; tick < ticks; tick++) {
        const double angle = 2.0 * PI * frequency_hz * (double)config->tick_s * tick;
        hexload_real_t innovation[3];
        for (int k = 0; k < 3; k++) {
            innovation[k] = (hexload_real_t)(normal(seed) + (k == 1 ? amplitude * sin(angle + 0.7) : 0.0));
        }
        hexload_hum_test_step(test, 1, innovation);
    }
}

static void test_noise_does_not_hum(void) {
    // GIVEN innovations as a filter has them that fits its model WHEN a quarter of an hour goes by
    const hexload_config_t config = paper_machine();
    hexload_hum_test_t test;
    uint64_t seed = 7;
    hexload_hum_test_init(&test, &config);
    for (int block = 0; block < 1800; block++) {
        show(&test, &config, BLOCK_TICKS, 0.0, 0.0, &seed);
        // THEN no sigma is widened
        TEST_ASSERT_EQUAL_DOUBLE(0.0, (double)test.energy);
    }
}

static void test_a_hum_of_the_mains_is_heard_with_its_energy(void) {
    // GIVEN 0.4 sigma of 50 or 60 Hz in one of three innovations, 0.08 of the NIS of a tick, or of the mains
    // when it is a quarter of a hertz off WHEN the start goes by, which does not count, and twenty seconds
    const hexload_config_t config = paper_machine();
    const double frequency_hz[] = {50.0, 60.0, 49.75, 60.25};
    for (int n = 0; n < 4; n++) {
        hexload_hum_test_t test;
        uint64_t seed = 8;
        hexload_hum_test_init(&test, &config);
        show(&test, &config, BLOCK_TICKS / 2, 4.0, frequency_hz[n], &seed);
        TEST_ASSERT_EQUAL_DOUBLE(0.0, (double)test.energy);
        show(&test, &config, 40 * BLOCK_TICKS, 0.4, frequency_hz[n], &seed);
        // THEN 500 ticks add 500 0.4^2 / 2 = 40 to a block's 6, of which 9 are granted; sin(x)^2 / x^2 of it
        // with x = pi 0.25 0.5 when it is off. Their variance is 12 + 4 40, that of twenty twenty times as
        // much; and the frequencies take turns, so that each block stands for two.
        const double x = n < 2 ? 1e-9 : PI * 0.125;
        const double excess = 2.0 * 20.0 * (40.0 * pow(sin(x) / x, 2.0) - 3.0);
        const double spread = 2.0 * 5.0 * sqrt(20.0 * (12.0 + 4.0 * 40.0));
        TEST_ASSERT_DOUBLE_WITHIN(spread, excess, (double)test.energy);
    }
}

static void test_motion_and_other_frequencies_are_no_hum(void) {
    // GIVEN a sigma of what oscillates with whole periods in half a second, slower or beside the mains
    const hexload_config_t config = paper_machine();
    const double frequency_hz[] = {2.0, 10.0, 44.0, 56.0, 66.0, 100.0};
    for (int n = 0; n < 6; n++) {
        hexload_hum_test_t test;
        uint64_t seed = 9;
        hexload_hum_test_init(&test, &config);
        // WHEN ten seconds go by THEN nothing hums
        show(&test, &config, 20 * BLOCK_TICKS, 1.0, frequency_hz[n], &seed);
        TEST_ASSERT_EQUAL_DOUBLE(0.0, (double)test.energy);
    }
}

static void test_a_gap_begins_its_block_anew(void) {
    // GIVEN a strong hum, and a sample that is missing before each half second is over
    const hexload_config_t config = paper_machine();
    const hexload_real_t nothing[3] = {0};
    hexload_hum_test_t test;
    uint64_t seed = 10;
    hexload_hum_test_init(&test, &config);
    hexload_hum_test_step(&test, 2, nothing);
    for (int n = 0; n < 20; n++) {
        show(&test, &config, BLOCK_TICKS - 2, 4.0, 50.0, &seed);
        hexload_hum_test_step(&test, 2, nothing);
        // THEN no block is whole, and nothing is said
        TEST_ASSERT_EQUAL_UINT32(1, test.ticks);
        TEST_ASSERT_FALSE(test.has_begun);
    }
}

static void test_no_hum_is_heard_in_speeds_from_displacements(void) {
    // GIVEN a machine without velocity sensors, whose innovations are no white noise WHEN they hum
    hexload_config_t config = paper_machine();
    hexload_hum_test_t test;
    uint64_t seed = 9;
    config.sensors.half_window_ticks = 12;
    hexload_hum_test_init(&test, &config);
    show(&test, &config, 20 * BLOCK_TICKS, 4.0, 50.0, &seed);
    // THEN no sigma is widened
    TEST_ASSERT_EQUAL_DOUBLE(0.0, (double)test.energy);
}

static void test_factors_are_those_of_the_frequencies_or_nothing_is_heard(void) {
    // GIVEN periods from 0.1 to 20 ms
    for (double tick_s = 1e-4; tick_s < 0.02; tick_s *= 1.3) {
        hexload_config_t config = paper_machine();
        config.tick_s = (hexload_real_t)tick_s;
        hexload_hum_test_t test;
        hexload_hum_test_init(&test, &config);
        // WHEN 60 Hz turn by 1.6 or more in one THEN nothing is heard, whatever comes, else the factors are
        // twice the cosines, to the polynomial's 1e-6
        const bool is_heard = 2.0 * PI * 60.0 * tick_s <= 1.6;
        TEST_ASSERT_EQUAL_INT(is_heard, test.is_heard);
        for (int n = 0; n < 2 && is_heard; n++) {
            const double angle = 2.0 * PI * (n == 0 ? 50.0 : 60.0) * tick_s;
            TEST_ASSERT_DOUBLE_WITHIN(2e-6, 2.0 * cos(angle), (double)test.twice_cosine[n]);
        }
        uint64_t seed = 11;
        show(&test, &config, 3 * (int)test.block_ticks, 40.0, 50.0, &seed);
        TEST_ASSERT_EQUAL_INT(is_heard, test.energy > HEXLOAD_REAL(0.0));
    }
}

static void test_the_energy_is_what_each_frequency_has_beyond_nine_by_block(void) {
    // GIVEN blocks with 50 and 60 Hz in all three innovations, loud ones and others
    const hexload_config_t config = paper_machine();
    hexload_hum_test_t test;
    uint64_t seed = 12;
    double excess[2] = {0.0, 0.0};
    int humming = 0;
    hexload_hum_test_init(&test, &config);
    show(&test, &config, BLOCK_TICKS / 2, 1.0, 50.0, &seed);
    for (int block = 0; block < 60; block++) {
        const double amplitude = (block % 20 < 8 ? 0.1 : 0.5) * (double)uniform(&seed);
        double in_phase[3] = {0}, quadrature[3] = {0};
        // WHEN half a second goes by
        for (int tick = 0; tick < BLOCK_TICKS; tick++) {
            const double turn = 2.0 * PI * (double)config.tick_s * tick;
            hexload_real_t innovation[3];
            for (int k = 0; k < 3; k++) {
                innovation[k] =
                    (hexload_real_t)(amplitude * (sin(50.0 * turn + k) + (k - 0.5) * cos(60.0 * turn)));
                in_phase[k] += (double)innovation[k] * cos((block % 2 == 0 ? 50.0 : 60.0) * turn);
                quadrature[k] += (double)innovation[k] * sin((block % 2 == 0 ? 50.0 : 60.0) * turn);
            }
            hexload_hum_test_step(&test, 1, innovation);
        }
        // THEN what the Fourier sums of the one whose turn it is have beyond 9 is summed, from 0 up, and each
        // sum beyond 60 stands for two blocks
        double nis = 0.0, energy = 0.0;
        for (int k = 0; k < 3; k++) {
            nis += 2.0 / BLOCK_TICKS * (in_phase[k] * in_phase[k] + quadrature[k] * quadrature[k]);
        }
        excess[block % 2] = fmax(0.0, excess[block % 2] + nis - 9.0);
        for (int n = 0; n < 2; n++) {
            energy += excess[n] > 60.0 ? 2.0 * excess[n] : 0.0;
        }
        // AND the factors' 2e-6 turn the phase by 500 2e-6 / (2 sin(0.31)) = 2e-3 in a block at most
        const double bound = 2e-3 * (excess[0] + excess[1] + 9.0);
        for (int n = 0; n < 2; n++) {
            TEST_ASSERT_DOUBLE_WITHIN(bound, excess[n], (double)test.excess[n]);
        }
        TEST_ASSERT_DOUBLE_WITHIN(2.0 * bound, energy, (double)test.energy);
        TEST_ASSERT_EQUAL_INT(energy > 0.0, test.hums);
        humming += energy > 0.0;
    }
    TEST_ASSERT_GREATER_THAN_INT(5, humming);
    TEST_ASSERT_LESS_THAN_INT(60, humming);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_noise_does_not_hum);
    RUN_TEST(test_a_hum_of_the_mains_is_heard_with_its_energy);
    RUN_TEST(test_motion_and_other_frequencies_are_no_hum);
    RUN_TEST(test_a_gap_begins_its_block_anew);
    RUN_TEST(test_no_hum_is_heard_in_speeds_from_displacements);
    RUN_TEST(test_factors_are_those_of_the_frequencies_or_nothing_is_heard);
    RUN_TEST(test_the_energy_is_what_each_frequency_has_beyond_nine_by_block);
    return UNITY_END();
}
