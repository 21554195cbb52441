#include "hexload/smoother.h"
#include "machine.h"

#include <math.h>
#include <string.h>

void setUp(void) {}
void tearDown(void) {}

/// 2^-26 m: what a stored displacement may lose.
static const double step_m = 1.4901161193847656e-8;

static hexload_config_t machine_with_lag(uint32_t lag_ticks, double displacement_sigma_m) {
    hexload_config_t config = paper_machine();
    config.momentum.lag_ticks = lag_ticks;
    config.sensors.displacement_sigma_m = (hexload_real_t)displacement_sigma_m;
    return config;
}

/// Polynomial of degree six in t, another one for each leg.
static double displacement_at(int leg, double t_s) {
    const double u = 4.0 * t_s - 0.5;
    return 0.1 * (0.3 * leg + u + u * u * (0.5 - 0.2 * u) + 0.1 * leg * u * u * u * u * (1.0 - u) +
                  0.05 * u * u * u * u * u * u);
}

static hexload_leg_sample_t sample_of(uint32_t tick) {
    hexload_leg_sample_t sample = {.tick = tick};
    const double t_s = 1e-3 * tick;
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        sample.displacement_m[leg] = (hexload_real_t)displacement_at(leg, t_s);
        sample.velocity_m_s[leg] =
            (hexload_real_t)((displacement_at(leg, t_s + 1e-5) - displacement_at(leg, t_s - 1e-5)) / 2e-5);
        sample.force_n[leg] = (hexload_real_t)(tick + 10000u * (uint32_t)leg);
    }
    return sample;
}

static void test_slope_of_a_polynomial_of_degree_six_is_exact(void) {
    // GIVEN displacement sensors so good that every slope stands out of their noise, and legs that move as
    // polynomials of degree six
    const hexload_config_t config = machine_with_lag(60, 1e-9);
    hexload_smoother_t smoother;
    hexload_smooth_sample_t past;
    hexload_smoother_init(&smoother, &config);
    int taken = 0;
    for (uint32_t tick = 0; tick < 300; tick++) {
        const hexload_leg_sample_t sample = sample_of(tick);
        (void)hexload_smoother_put(&smoother, &config, &sample, tick > 0);
        if (!hexload_smoother_take(&smoother, &past)) {
            continue;
        }
        taken++;
        // WHEN a sample of the past is taken out THEN its slopes are those of the polynomials. The kernel of
        // degree six over 121 ticks has a sum of absolute values of 110 /s and a root sum of squares of 12
        // /s. What a stored displacement loses, half a step on average, changes its sign where a leg passes
        // home; float's rounding of 0.5 m is noise, four sigma
        const hexload_leg_sample_t exact = sample_of(past.sample.tick);
        const double tolerance = 110 * 0.5 * step_m + 4 * 12 * ROUNDINGS(0.3, 0.5) + ROUNDINGS(20, 2.0);
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            TEST_ASSERT_DOUBLE_WITHIN(tolerance, (double)exact.velocity_m_s[leg],
                                      (double)past.smooth_velocity_m_s[leg]);
            TEST_ASSERT_DOUBLE_WITHIN(step_m, (double)exact.displacement_m[leg],
                                      (double)past.sample.displacement_m[leg]);
        }
        // AND velocities and forces are those that were put in
        TEST_ASSERT_EQUAL_MEMORY(exact.velocity_m_s, past.sample.velocity_m_s, sizeof exact.velocity_m_s);
        TEST_ASSERT_EQUAL_MEMORY(exact.force_n, past.sample.force_n, sizeof exact.force_n);
    }
    TEST_ASSERT_EQUAL_INT(300 - 120, taken);
}

static void test_noise_of_the_slope_at_rest_is_that_of_a_line(void) {
    // GIVEN legs at rest with white noise
    const hexload_config_t config = machine_with_lag(70, 20e-6);
    hexload_smoother_t smoother;
    hexload_smooth_sample_t past;
    uint64_t seed = 7;
    double square = 0.0;
    int count = 0;
    hexload_smoother_init(&smoother, &config);
    for (uint32_t tick = 0; tick < 141 * 200; tick++) {
        hexload_leg_sample_t sample = {.tick = tick};
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            sample.displacement_m[leg] = (hexload_real_t)(20e-6 * normal(&seed));
        }
        (void)hexload_smoother_put(&smoother, &config, &sample, tick > 0);
        if (hexload_smoother_take(&smoother, &past) && tick % 141 == 0) { // independent windows
            for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
                const double v = (double)past.smooth_velocity_m_s[leg];
                square += v * v;
                count++;
            }
        }
    }
    // WHEN the slopes' mean square is compared with that of a line through 141 points, 12 sigma^2 / (dt^2
    // N^3)
    const double line = 12.0 * 20e-6 * 20e-6 / (1e-3 * 1e-3 * 141.0 * 141.0 * 141.0);
    // THEN it is that, plus the share of higher degrees that noise lets through now and then; 1,200 squares
    // spread by 4 %
    TEST_ASSERT_TRUE(square / count > 0.85 * line);
    TEST_ASSERT_TRUE(square / count < 2.0 * line);
}

static void test_sums_do_not_drift(void) {
    // GIVEN a smoother that has run for 100,000 ticks, more than its counters go without a round
    const hexload_config_t config = machine_with_lag(20, 20e-6);
    hexload_smoother_t old, fresh;
    hexload_smooth_sample_t from_old, from_fresh;
    hexload_smoother_init(&old, &config);
    hexload_smoother_init(&fresh, &config);
    uint64_t seed = 3;
    bool has_old = false, has_fresh = false;
    for (uint32_t tick = 0; tick < 100000; tick++) {
        hexload_leg_sample_t sample = {.tick = tick};
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            sample.displacement_m[leg] = (hexload_real_t)(0.2 * uniform(&seed));
        }
        (void)hexload_smoother_put(&old, &config, &sample, tick > 0);
        has_old = hexload_smoother_take(&old, &from_old);
        if (tick >= 100000 - 41) { // WHEN another one sees the last window only
            (void)hexload_smoother_put(&fresh, &config, &sample, tick > 100000 - 41);
            has_fresh = hexload_smoother_take(&fresh, &from_fresh);
        }
    }
    // THEN both say the same, bit by bit
    TEST_ASSERT_TRUE(has_old && has_fresh);
    TEST_ASSERT_EQUAL_UINT32(from_fresh.sample.tick, from_old.sample.tick);
    TEST_ASSERT_EQUAL_MEMORY(from_fresh.smooth_velocity_m_s, from_old.smooth_velocity_m_s,
                             sizeof from_old.smooth_velocity_m_s);
}

static void test_missing_ticks_are_bridged_and_told(void) {
    // GIVEN a motion of which ticks 100, 101 and 150 are missing
    const hexload_config_t config = machine_with_lag(30, 1e-9);
    hexload_smoother_t smoother;
    hexload_smooth_sample_t past;
    hexload_smoother_init(&smoother, &config);
    uint32_t last_put = 0, next = 30, taken = 0, put = 0;
    for (uint32_t tick = 0; tick < 260; tick++) {
        if (tick == 100 || tick == 101 || tick == 150) {
            continue;
        }
        const hexload_leg_sample_t sample = sample_of(tick);
        (void)hexload_smoother_put(&smoother, &config, &sample, tick - last_put);
        last_put = tick;
        put++;
        // WHEN samples are taken out THEN at most one comes for each that is put in, in order, each with the
        // distance to the one before
        if (hexload_smoother_take(&smoother, &past)) {
            TEST_ASSERT_EQUAL_UINT32(next, past.sample.tick);
            TEST_ASSERT_EQUAL_UINT32(next == 30 ? 0 : next == 102 ? 3 : next == 151 ? 2 : 1, past.gap_ticks);
            next = next == 99 ? 102 : next == 149 ? 151 : next + 1;
            taken++;
            // AND the bridge, a cubic over three ticks, keeps the slope of the windows around it
            const hexload_leg_sample_t exact = sample_of(past.sample.tick);
            TEST_ASSERT_DOUBLE_WITHIN(1e-4, (double)exact.velocity_m_s[3],
                                      (double)past.smooth_velocity_m_s[3]);
        }
    }
    TEST_ASSERT_EQUAL_UINT32(put - 60, taken); // the window's two halves hold real ones only, again
}

static void test_too_long_a_gap_begins_anew(void) {
    const hexload_config_t config = machine_with_lag(10, 20e-6);
    hexload_smoother_t smoother;
    hexload_smooth_sample_t past;
    hexload_smoother_init(&smoother, &config);
    for (uint32_t tick = 0; tick < 40; tick++) {
        const hexload_leg_sample_t sample = sample_of(tick);
        TEST_ASSERT_EQUAL(tick > 0, hexload_smoother_put(&smoother, &config, &sample, tick > 0));
        (void)hexload_smoother_take(&smoother, &past);
    }
    // GIVEN a gap of one tick more than can be bridged WHEN the next samples come THEN a whole window must
    // fill, and the first one out has no predecessor
    const uint32_t after = 39 + config.momentum.longest_gap_ticks + 1;
    const hexload_leg_sample_t sample = sample_of(after);
    TEST_ASSERT_FALSE(hexload_smoother_put(&smoother, &config, &sample, after - 39));
    for (uint32_t tick = after + 1; tick <= after + 20; tick++) {
        const hexload_leg_sample_t next = sample_of(tick);
        TEST_ASSERT_EQUAL(false, hexload_smoother_take(&smoother, &past));
        TEST_ASSERT_TRUE(hexload_smoother_put(&smoother, &config, &next, 1));
    }
    TEST_ASSERT_TRUE(hexload_smoother_take(&smoother, &past));
    TEST_ASSERT_EQUAL_UINT32(after + 10, past.sample.tick);
    TEST_ASSERT_EQUAL_UINT32(0, past.gap_ticks);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_slope_of_a_polynomial_of_degree_six_is_exact);
    RUN_TEST(test_noise_of_the_slope_at_rest_is_that_of_a_line);
    RUN_TEST(test_sums_do_not_drift);
    RUN_TEST(test_missing_ticks_are_bridged_and_told);
    RUN_TEST(test_too_long_a_gap_begins_anew);
    return UNITY_END();
}
