#include "front_end/noise_estimator.h"
#include "motion.h"

#include <math.h>
#include <string.h>

void setUp(void) {}
void tearDown(void) {}

/// Sensors as the estimator takes them after `ticks` of violent motion with noise of `scale` times the stated
/// sigmas.
static hexload_sensors_t measured(double scale, uint32_t ticks, uint32_t shock_every, uint32_t* health) {
    static const body_t load = {500.0, {0.05, -0.03, 0.3}, {25.0, 30.0, 20.0, 1.0, -2.0, 0.5}};
    const motion_t motion = random_motion(5, 0.05, 0.1);
    hexload_config_t config = paper_machine();
    hexload_config_t noisy = config;
    hexload_noise_estimator_t meter;
    hexload_sensors_t sensors;
    uint64_t seed = 11;
    noisy.sensors.displacement_sigma_m *= (hexload_real_t)scale;
    noisy.sensors.velocity_sigma_m_s *= (hexload_real_t)scale;
    noisy.sensors.force_sigma_n *= (hexload_real_t)scale;
    hexload_noise_estimator_init(&meter);
    for (uint32_t tick = 0; tick < ticks; tick++) {
        hexload_leg_sample_t sample = perfect_sample(&config, &load, &motion, 0.7982755, tick);
        add_noise(&noisy, &seed, &sample);
        if (shock_every > 0 && tick / shock_every % 2 == 1) {
            sample.force_n[2] += HEXLOAD_REAL(3000.0);
        }
        hexload_noise_estimator_step(&meter, &config, &sample, tick > 0);
    }
    *health = 0;
    hexload_noise_estimator_read(&meter, &config.sensors, &sensors, health);
    return sensors;
}

static void test_stated_sigmas_that_are_right_are_used_as_they_are(void) {
    uint32_t health = 0;
    const hexload_sensors_t sensors = measured(1.0, 2000, 0, &health);
    TEST_ASSERT_EQUAL_FLOAT(20e-6, sensors.displacement_sigma_m);
    TEST_ASSERT_EQUAL_FLOAT(0.001, sensors.velocity_sigma_m_s);
    TEST_ASSERT_EQUAL_FLOAT(5.0, sensors.force_sigma_n);
    TEST_ASSERT_EQUAL_UINT32(0, health);
}

static void test_misstated_sigmas_are_measured(void) {
    static const double scales[] = {0.5, 2.0, 5.0};
    for (int n = 0; n < 3; n++) {
        // GIVEN a motion with other noise than stated WHEN 2 s of it have been seen
        uint32_t health = 0;
        const hexload_sensors_t sensors = measured(scales[n], 2000, 0, &health);
        // THEN the true sigmas are used: a leaky mean of squares over a second, each kind at every third tick
        // of six legs, is worth 4,000 of them and spreads by 2.2 %, a sigma by half of that; five sigma
        TEST_ASSERT_DOUBLE_WITHIN(0.06 * scales[n] * 20e-6, scales[n] * 20e-6,
                                  (double)sensors.displacement_sigma_m);
        TEST_ASSERT_DOUBLE_WITHIN(0.06 * scales[n] * 1e-3, scales[n] * 1e-3,
                                  (double)sensors.velocity_sigma_m_s);
        TEST_ASSERT_DOUBLE_WITHIN(0.06 * scales[n] * 5.0, scales[n] * 5.0, (double)sensors.force_sigma_n);
        TEST_ASSERT_EQUAL_UINT32(1u << HEXLOAD_HEALTH_NOISE_MISSTATED, health);
    }
}

static void test_shocks_are_not_taken_for_noise(void) {
    // GIVEN a force that jumps by 3 kN every 200 ticks WHEN the noise is measured THEN the stated sigma stays
    uint32_t health = 0;
    const hexload_sensors_t sensors = measured(1.0, 3000, 200, &health);
    TEST_ASSERT_EQUAL_FLOAT(5.0, sensors.force_sigma_n);
    TEST_ASSERT_EQUAL_UINT32(0, health);
}

static void test_a_few_samples_prove_nothing(void) {
    uint32_t health = 0;
    const hexload_sensors_t sensors = measured(2.0, 50, 0, &health);
    TEST_ASSERT_EQUAL_FLOAT(5.0, sensors.force_sigma_n);
    TEST_ASSERT_EQUAL_UINT32(0, health);
}

static void test_before_the_first_sample_noise_is_taken_to_be_as_stated(void) {
    // GIVEN a noise estimator that begins WHEN it has seen nothing THEN each kind has the ratio of one that
    // its mean starts from
    hexload_noise_estimator_t meter;
    hexload_noise_estimator_init(&meter);
    for (int kind = 0; kind < 3; kind++) {
        TEST_ASSERT_EQUAL_FLOAT(1.0, meter.ratio[kind]);
    }
}

static void test_a_ratio_is_the_mean_of_all_squares_and_then_of_a_second(void) {
    // GIVEN noise as stated for 0.6 s and twice as much then, of which each kind is looked at in every third
    // tick
    const hexload_config_t config = paper_machine();
    hexload_noise_estimator_t meter;
    uint64_t seed = 12;
    double last[4][6] = {{0}}, ratio[3] = {1.0, 1.0, 1.0};
    hexload_noise_estimator_init(&meter);
    for (uint32_t tick = 0; tick < 2400; tick++) {
        hexload_leg_sample_t sample = {.tick = tick};
        memmove(last[1], last[0], 3 * sizeof last[0]);
        for (int leg = 0; leg < 6; leg++) { // the same for all kinds, in sigmas
            last[0][leg] = (tick < 600 ? 1.0 : 2.0) * normal(&seed);
            sample.displacement_m[leg] = (hexload_real_t)last[0][leg] * config.sensors.displacement_sigma_m;
            sample.velocity_m_s[leg] = (hexload_real_t)last[0][leg] * config.sensors.velocity_sigma_m_s;
            sample.force_n[leg] = (hexload_real_t)last[0][leg] * config.sensors.force_sigma_n;
        }
        hexload_noise_estimator_step(&meter, &config, &sample, 1);
        if (tick < 3) {
            continue;
        }
        const uint32_t kind = (tick - 3) % 3;
        double square = 0.0;
        for (int leg = 0; leg < 6; leg++) {
            const double third = last[0][leg] - 3.0 * last[1][leg] + 3.0 * last[2][leg] - last[3][leg];
            square += fmin(third * third / 20.0, 25.0 * fmax(1.0, ratio[kind])) / 6.0;
        }
        // WHEN a tick has been seen THEN its kind's ratio is the mean so far, or a leaky one of 1,000 ticks
        ratio[kind] += fmin(1.0, 3.0 / fmin(tick - 2.0, 1000.0)) * (square - ratio[kind]);
        TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(2000, ratio[kind]), ratio[kind], (double)meter.ratio[kind]);
    }
}

static void test_the_mean_goes_back_a_second(void) {
    // GIVEN ticks of 1/1024 s WHEN two seconds and more have passed THEN those of one are counted
    hexload_config_t config = paper_machine();
    const hexload_leg_sample_t sample = {.tick = 0};
    hexload_noise_estimator_t meter;
    config.tick_s = HEXLOAD_REAL(1.0) / HEXLOAD_REAL(1024.0);
    hexload_noise_estimator_init(&meter);
    for (int tick = 0; tick < 2100; tick++) {
        hexload_noise_estimator_step(&meter, &config, &sample, 1);
    }
    TEST_ASSERT_EQUAL_UINT32(1024, meter.ticks);
}

static void test_what_changes_over_a_gap_is_no_noise(void) {
    // GIVEN sensors without noise WHEN samples are missing, and all channels are elsewhere when they come
    // again
    const hexload_config_t config = paper_machine();
    hexload_noise_estimator_t meter;
    hexload_noise_estimator_init(&meter);
    for (uint32_t tick = 0; tick < 40; tick++) {
        hexload_leg_sample_t sample = {.tick = tick};
        for (int leg = 0; leg < HEXLOAD_LEGS && tick >= 20; leg++) {
            sample.displacement_m[leg] = sample.velocity_m_s[leg] = HEXLOAD_REAL(0.1);
            sample.force_n[leg] = HEXLOAD_REAL(1000.0);
        }
        hexload_noise_estimator_step(&meter, &config, &sample, tick == 0 ? 0 : tick == 20 ? 3 : 1);
        // THEN no channel has any
        for (int kind = 0; kind < 3 && tick >= 6; kind++) {
            TEST_ASSERT_TRUE(meter.ratio[kind] == HEXLOAD_REAL(0.0));
        }
    }
}

static void test_ratios_are_believed_from_a_hundred_ticks_on_beyond_a_fifth_and_within_limits(void) {
    // GIVEN ratios of variances: sigmas beyond a fifth of the stated, of a quarter to ten times it
    static const double ratios[] = {0.01, 0.06, 0.0625, 0.07, 0.69, 0.70, 1.0, 1.43, 1.45, 99.0, 101.0, 1e4};
    const hexload_config_t config = paper_machine();
    for (int n = 0; n < 3 * 12; n++) {
        const int kind = n / 12;
        const double ratio = ratios[n % 12];
        for (int way = 0; way < 4; way++) {
            const bool has_window = way & 1, has_ticks = way & 2;
            hexload_sensors_t stated = config.sensors, used;
            hexload_noise_estimator_t meter;
            uint32_t health = 0;
            hexload_noise_estimator_init(&meter);
            memset(&used, 0xff, sizeof used);
            stated.half_window_ticks = has_window ? 1 : 0;
            meter.ticks = has_ticks ? 100 : 99;
            meter.ratio[kind] = (hexload_real_t)ratio;
            // WHEN they are asked for THEN that kind has its measured sigma, and speeds that come of
            // displacements have theirs
            hexload_noise_estimator_read(&meter, &stated, &used, &health);
            const bool is_off = has_ticks && (ratio < 1.0 / 1.44 || ratio > 1.44);
            const double factor = is_off ? sqrt(fmin(fmax(ratio, 0.0625), 100.0)) : 1.0;
            const int of_speeds = has_window ? 0 : 1;
            const double expected[3] = {kind == 0 ? factor : 1.0, kind == of_speeds ? factor : 1.0,
                                        kind == 2 ? factor : 1.0};
            const double found[3] = {(double)(used.displacement_sigma_m / stated.displacement_sigma_m),
                                     (double)(used.velocity_sigma_m_s / stated.velocity_sigma_m_s),
                                     (double)(used.force_sigma_n / stated.force_sigma_n)};
            for (int k = 0; k < 3; k++) {
                TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(4, factor + 1.0), expected[k], found[k]);
            }
            // AND all else is as stated
            TEST_ASSERT_EQUAL_UINT32(stated.half_window_ticks, used.half_window_ticks);
            TEST_ASSERT_TRUE(used.velocity_range_m_s == stated.velocity_range_m_s &&
                             used.force_range_n == stated.force_range_n);
            const bool is_used = is_off && (kind != 1 || !has_window);
            TEST_ASSERT_EQUAL_UINT32(is_used ? 1u << HEXLOAD_HEALTH_NOISE_MISSTATED : 0, health);
        }
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_stated_sigmas_that_are_right_are_used_as_they_are);
    RUN_TEST(test_misstated_sigmas_are_measured);
    RUN_TEST(test_shocks_are_not_taken_for_noise);
    RUN_TEST(test_a_few_samples_prove_nothing);
    RUN_TEST(test_before_the_first_sample_noise_is_taken_to_be_as_stated);
    RUN_TEST(test_a_ratio_is_the_mean_of_all_squares_and_then_of_a_second);
    RUN_TEST(test_the_mean_goes_back_a_second);
    RUN_TEST(test_what_changes_over_a_gap_is_no_noise);
    RUN_TEST(test_ratios_are_believed_from_a_hundred_ticks_on_beyond_a_fifth_and_within_limits);
    return UNITY_END();
}
