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
    hexload_noise_estimator_read(&meter, &config, &sensors, health);
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
        // THEN the true sigmas are used: a leaky mean of squares over a second, each kind at every fourth
        // tick of six legs, is worth 3,000 of them and spreads by 2.6 %, a sigma by half of that; 4.6 sigma
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

static void test_few_samples_prove_what_is_far_off_only(void) {
    // GIVEN the first 15 ms of noise, of which each kind has been looked at three times WHEN it is twice as
    // large as stated THEN the stated sigma stays, and where it is five times as large it is not
    uint32_t health = 0;
    const hexload_sensors_t sensors = measured(2.0, 15, 0, &health);
    TEST_ASSERT_EQUAL_FLOAT(5.0, sensors.force_sigma_n);
    TEST_ASSERT_EQUAL_UINT32(0, health);
    TEST_ASSERT_DOUBLE_WITHIN(8.0, 25.0, (double)measured(5.0, 15, 0, &health).force_sigma_n);
    TEST_ASSERT_EQUAL_UINT32(1u << HEXLOAD_HEALTH_NOISE_MISSTATED, health);
}

static void test_before_the_first_sample_noise_is_taken_to_be_as_stated(void) {
    // GIVEN a noise estimator that begins WHEN it has seen nothing THEN each kind has the ratio of one that
    // its mean starts from
    hexload_noise_estimator_t meter;
    hexload_noise_estimator_init(&meter);
    for (int turn = 0; turn < 4; turn++) {
        TEST_ASSERT_EQUAL_FLOAT(1.0, meter.ratio[turn]);
    }
}

static void test_a_ratio_is_the_mean_of_all_squares_and_then_of_a_second(void) {
    // GIVEN noise as stated for 0.6 s and twice as much then, of which each kind is looked at in every fourth
    // tick, and forces by what they have in common with it in the next one
    const hexload_config_t config = paper_machine();
    hexload_noise_estimator_t meter;
    uint64_t seed = 12;
    double last[5][6] = {{0}}, ratio[4] = {1.0, 1.0, 1.0, 1.0};
    hexload_noise_estimator_init(&meter);
    for (uint32_t tick = 0; tick < 2400; tick++) {
        hexload_leg_sample_t sample = {.tick = tick};
        memmove(last[1], last[0], 4 * sizeof last[0]);
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
        const uint32_t turn = (tick - 3) % 4;
        double square = 0.0;
        for (int leg = 0; leg < 6; leg++) {
            const double third = last[0][leg] - 3.0 * last[1][leg] + 3.0 * last[2][leg] - last[3][leg];
            const double before = last[1][leg] - 3.0 * last[2][leg] + 3.0 * last[3][leg] - last[4][leg];
            const double one = turn < 3 ? third * third / 20.0 : third * before / -15.0;
            square += fmin(one, 9.0 * fmax(1.0, ratio[turn < 3 ? turn : 2])) / 6.0;
        }
        // WHEN a tick has been seen THEN its ratio is the mean so far, or a leaky one of 1,000 ticks
        ratio[turn] += fmin(1.0, 4.0 / fmin(tick - 2.0, 1000.0)) * (square - ratio[turn]);
        TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(2000, 1.0 + fabs(ratio[turn])), ratio[turn],
                                  (double)meter.ratio[turn]);
    }
}

/// Whether forces with `scale` times the stated noise, through two low-passes that keep `kept` of their last
/// value, are quiet after 2 s.
static bool are_quiet(double scale, double kept, uint32_t gap_every, double delay_s) {
    static const body_t load = {500.0, {0.05, -0.03, 0.3}, {25.0, 30.0, 20.0, 1.0, -2.0, 0.5}};
    const motion_t motion = random_motion(5, 0.05, 0.1);
    hexload_config_t config = paper_machine();
    config.rig.force_delay_s = (hexload_real_t)delay_s;
    hexload_config_t noisy = config;
    hexload_noise_estimator_t meter;
    uint64_t seed = 13;
    double once_n[6] = {0}, twice_n[6] = {0};
    noisy.sensors.force_sigma_n *= (hexload_real_t)scale;
    hexload_noise_estimator_init(&meter);
    for (uint32_t tick = 0; tick < 2000; tick++) {
        const hexload_leg_sample_t clean = perfect_sample(&config, &load, &motion, 0.7982755, tick);
        hexload_leg_sample_t sample = clean;
        add_noise(&noisy, &seed, &sample);
        for (int leg = 0; leg < 6; leg++) {
            const double noise_n = (double)sample.force_n[leg] - (double)clean.force_n[leg];
            once_n[leg] += (1.0 - kept) * (noise_n - once_n[leg]);
            twice_n[leg] += (1.0 - kept) * (once_n[leg] - twice_n[leg]);
            sample.force_n[leg] = (hexload_real_t)(scale * (double)clean.force_n[leg] + twice_n[leg]);
        }
        const bool is_gap = tick % gap_every == 0;
        hexload_noise_estimator_step(&meter, &config, &sample, is_gap ? 2 : 1);
    }
    return hexload_noise_estimator_are_forces_quiet(&meter, &config);
}

static void test_forces_of_another_unit_are_quiet_and_filtered_ones_are_not(void) {
    // GIVEN forces in lbf, kgf or daN read as newtons, also with sensors that are a fifth louder or half as
    // loud as stated, or samples missing WHEN they have been seen THEN they are quiet
    TEST_ASSERT_TRUE(are_quiet(0.2248, 0.0, 4000, 0.0));
    TEST_ASSERT_TRUE(are_quiet(0.2248 * 1.2, 0.0, 4000, 0.0));
    TEST_ASSERT_TRUE(are_quiet(0.10197, 0.0, 4000, 0.0));
    TEST_ASSERT_TRUE(are_quiet(0.1 * 0.4, 0.0, 4000, 0.0));
    TEST_ASSERT_TRUE(are_quiet(0.10197, 0.0, 10, 0.0));
    // AND those in newtons are not, of a stated noise that is up to three times the true one, or without any,
    // nor where two low-passes leave 0.13 or 0.076 of it, as written beside WHITE, or a stated delay tells
    TEST_ASSERT_FALSE(are_quiet(1.0, 0.0, 4000, 0.0));
    TEST_ASSERT_FALSE(are_quiet(0.33, 0.0, 4000, 0.0));
    TEST_ASSERT_FALSE(are_quiet(1e-3, 0.0, 4000, 0.0));
    TEST_ASSERT_FALSE(are_quiet(1.0, 0.5, 4000, 0.0));
    TEST_ASSERT_FALSE(are_quiet(1.0, 0.6, 4000, 0.0));
    TEST_ASSERT_FALSE(are_quiet(0.10197, 0.0, 4000, 1e-3));
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
        for (int kind = 0; kind < 4 && tick >= 8; kind++) {
            TEST_ASSERT_TRUE(meter.ratio[kind] == HEXLOAD_REAL(0.0));
        }
    }
}

static void test_ratios_are_believed_beyond_a_fifth_and_more_of_few_ticks_and_within_limits(void) {
    // GIVEN ratios of variances: sigmas beyond a fifth of the stated, or beyond twice of 15 ticks, up to a
    // quarter and ten times it
    static const double ratios[] = {0.01, 0.06, 0.0625, 0.07, 0.25, 0.26, 0.69,  0.70,
                                    1.0,  1.43, 1.45,   3.9,  4.0,  99.0, 101.0, 1e4};
    enum { RATIOS = 16, KINDS = 3, DELAYS = 2, WINDOWS = 2 };
    for (int n = 0; n < KINDS * RATIOS * DELAYS * WINDOWS; n++) {
        const double ratio = ratios[n % RATIOS];
        const int kind = n / RATIOS % KINDS;
        const bool is_late = n / RATIOS / KINDS % DELAYS, has_window = n / RATIOS / KINDS / DELAYS;
        for (uint32_t ticks = 15; ticks <= 300; ticks += 85) {
            hexload_config_t config = paper_machine();
            hexload_sensors_t used;
            hexload_noise_estimator_t meter;
            uint32_t health = 0;
            hexload_noise_estimator_init(&meter);
            memset(&used, 0xff, sizeof used);
            config.sensors.half_window_ticks = has_window ? 1 : 0;
            config.rig.velocity_delay_s = config.rig.force_delay_s = is_late ? (hexload_real_t)1e-4 : 0;
            meter.ticks = ticks;
            meter.ratio[kind] = (hexload_real_t)ratio;
            // WHEN they are asked for THEN that kind has its measured sigma, speeds that come of
            // displacements have theirs, and late channels no less than the stated
            hexload_noise_estimator_read(&meter, &config, &used, &health);
            const double most = 1.0 + 44.0 / fmin(ticks, 100.0);
            const bool is_more = ratio > most, is_less = ratio < 1.0 / most;
            const double factor = sqrt(fmin(fmax(ratio, 0.0625), 100.0));
            const int of_speeds = has_window ? 0 : 1, of[3] = {0, of_speeds, 2};
            const double found[3] = {
                (double)(used.displacement_sigma_m / config.sensors.displacement_sigma_m),
                (double)(used.velocity_sigma_m_s / config.sensors.velocity_sigma_m_s),
                (double)(used.force_sigma_n / config.sensors.force_sigma_n)};
            bool is_any = false;
            for (int k = 0; k < 3; k++) {
                const bool is_off = of[k] == kind && (is_more || (is_less && (k == 0 || !is_late)));
                TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(4, factor + 1.0), is_off ? factor : 1.0, found[k]);
                is_any = is_any || is_off;
            }
            TEST_ASSERT_EQUAL_UINT32(is_any ? 1u << HEXLOAD_HEALTH_NOISE_MISSTATED : 0, health);
            // AND all else is as stated
            TEST_ASSERT_EQUAL_UINT32(config.sensors.half_window_ticks, used.half_window_ticks);
            TEST_ASSERT_TRUE(used.velocity_range_m_s == config.sensors.velocity_range_m_s &&
                             used.force_range_n == config.sensors.force_range_n);
        }
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_stated_sigmas_that_are_right_are_used_as_they_are);
    RUN_TEST(test_misstated_sigmas_are_measured);
    RUN_TEST(test_shocks_are_not_taken_for_noise);
    RUN_TEST(test_few_samples_prove_what_is_far_off_only);
    RUN_TEST(test_before_the_first_sample_noise_is_taken_to_be_as_stated);
    RUN_TEST(test_a_ratio_is_the_mean_of_all_squares_and_then_of_a_second);
    RUN_TEST(test_forces_of_another_unit_are_quiet_and_filtered_ones_are_not);
    RUN_TEST(test_the_mean_goes_back_a_second);
    RUN_TEST(test_what_changes_over_a_gap_is_no_noise);
    RUN_TEST(test_ratios_are_believed_beyond_a_fifth_and_more_of_few_ticks_and_within_limits);
    return UNITY_END();
}
