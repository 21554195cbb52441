#include "momentum/smoother.h"
#include "algebra/linalg.h"
#include "textbook.h"

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

static bool put(hexload_smoother_t* smoother, const hexload_config_t* config,
                const hexload_leg_sample_t* sample, uint32_t gap_ticks) {
    const hexload_present_tick_t now = {.sample = sample, .sensors = config->sensors, .gap_ticks = gap_ticks};
    return hexload_smoother_put(smoother, config, &now);
}

/// As if the motion had bent by a thousand sigma in all directions.
static void open_all_directions(hexload_smoother_t* smoother) {
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        smoother->directions.spread[ROW(leg) + leg] = HEXLOAD_REAL(1e6);
        smoother->directions.factor[ROW(leg) + leg] = HEXLOAD_REAL(0.002236); // 1 / sqrt(1e6 / 5)
    }
    smoother->directions.slopes = 128;
}

static void test_slope_of_a_polynomial_of_degree_six_is_exact(void) {
    // GIVEN displacement sensors so good that every slope stands out of their noise, in all directions, and
    // legs that move as polynomials of degree six
    const hexload_config_t config = machine_with_lag(60, 1e-9);
    hexload_smoother_t smoother;
    hexload_smooth_sample_t past;
    hexload_smoother_init(&smoother, &config);
    int taken = 0;
    for (uint32_t tick = 0; tick < 300; tick++) {
        const hexload_leg_sample_t sample = sample_of(tick);
        (void)put(&smoother, &config, &sample, tick > 0);
        open_all_directions(&smoother);
        memset(&past, 1, sizeof past);
        if (!hexload_smoother_take(&smoother, &config.sensors, &past)) {
            continue;
        }
        taken++;
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) { // which is the rig's business
            TEST_ASSERT_EQUAL_DOUBLE(0.0, (double)past.leg_wrench[leg]);
            TEST_ASSERT_EQUAL_DOUBLE(0.0, (double)past.force_variance_n2[leg]);
        }
        // WHEN a sample of the past is taken out THEN its slopes are those of the polynomials. The kernel of
        // degree six over 121 ticks has a sum of absolute values of 110 /s and a root sum of squares of 12
        // /s. What a stored displacement loses, half a step on average, changes its sign where a leg passes
        // home; float's rounding of 0.5 m is noise, four sigma. Before the window is full,
        // changes below the root of 22.46 * 0.0992 sigma^2 over the legs are not followed
        const hexload_leg_sample_t exact = sample_of(past.sample.tick);
        const double tolerance = past.sample.tick < 60
                                     ? 1.5e-3
                                     : 110 * 0.5 * step_m + 4 * 12 * ROUNDINGS(0.3, 0.5) + ROUNDINGS(20, 2.0);
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            TEST_ASSERT_DOUBLE_WITHIN(tolerance, (double)exact.velocity_m_s[leg],
                                      (double)past.smooth_velocity_m_s[leg]);
            TEST_ASSERT_DOUBLE_WITHIN(step_m, (double)exact.displacement_m[leg],
                                      (double)past.sample.displacement_m[leg]);
        }
        // AND velocities are those that were put in, and forces too, which grow evenly
        TEST_ASSERT_EQUAL_MEMORY(exact.velocity_m_s, past.sample.velocity_m_s, sizeof exact.velocity_m_s);
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(4, 6e4), (double)exact.force_n[leg],
                                      (double)past.sample.force_n[leg]);
        }
    }
    TEST_ASSERT_EQUAL_INT(300 - 60 - HEXLOAD_TRANSIENT_TICKS, taken);
}

/// Mean square of the slopes' errors over that of a line through 141 points with noise of 20 um, 12 sigma^2 /
/// (dt^2 N^3), for legs that move evenly, while leg 0, which does not count, swings at 0.8 Hz.
static double slope_noise(double speed_m_s, double swing_m) {
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
            sample.displacement_m[leg] =
                (hexload_real_t)(speed_m_s * 1e-3 * ((double)tick - 14100.0) + 20e-6 * normal(&seed));
            sample.velocity_m_s[leg] = (hexload_real_t)speed_m_s;
        }
        const double swing_1_s = 2.0 * 3.14159265358979 * 0.8;
        sample.displacement_m[0] += (hexload_real_t)(swing_m * sin(swing_1_s * 1e-3 * tick));
        sample.velocity_m_s[0] += (hexload_real_t)(swing_m * swing_1_s * cos(swing_1_s * 1e-3 * tick));
        (void)put(&smoother, &config, &sample, tick > 0);
        if (hexload_smoother_take(&smoother, &config.sensors, &past) && tick > 140 &&
            tick % 141 == 0) { // independent windows
            for (int leg = 1; leg < HEXLOAD_LEGS; leg++) {
                const double error = (double)past.smooth_velocity_m_s[leg] - speed_m_s;
                square += error * error;
                count++;
            }
        }
    }
    return square / count / (12.0 * 20e-6 * 20e-6 / (1e-3 * 1e-3 * 141.0 * 141.0 * 141.0));
}

static void test_noise_of_the_slope_in_motion_is_that_of_a_line_in_its_direction(void) {
    // GIVEN legs that move evenly and alike, with white noise WHEN their slopes are compared with a line's
    // THEN the noise is a line's in that direction of six, and in the others between the (1 / 6)^2 and (1 /
    // 2)^2 that a mean of seven windows leaves of it, plus what noise lets through of higher degrees and of
    // other directions now and then; 1,000 squares spread by 4.5 %, as those in one direction of 200 windows
    // by 10 %
    const double ratio = slope_noise(0.02, 0.0);
    printf("%.2f of a line's noise\n", ratio);
    TEST_ASSERT_TRUE(ratio > 0.8 / 6.0);
    TEST_ASSERT_TRUE(ratio < (1.0 + 5.0 / 4.0) / 6.0 + 2.0 * 0.005 * (1.0 + 5.0 + 14.0));
}

static void test_curvature_of_one_leg_does_not_bring_in_the_noise_of_the_others(void) {
    // GIVEN a leg that swings, so that degree three stands far out of its noise, and five that move evenly
    // and alike WHEN the slopes of the five are compared with a line's THEN they have the noise of the line
    // and of degree three, 1 and 5.25 times the line's, in one direction of five, and in four of it (1 / 6)^2
    // where it is seen as it is to (1 / 2)^2 where seven windows, which the mean remembers, show five times
    // as much by chance; all of it would be a ratio of 6
    const double ratio = slope_noise(0.02, 0.1);
    TEST_ASSERT_TRUE(ratio > 0.8 / 5.0);
    TEST_ASSERT_TRUE(ratio < 6.25 * (1.0 + 4.0 / 4.0) / 5.0);
}

static void test_noise_at_rest_is_not_taken_for_motion(void) {
    // GIVEN legs at rest with white noise WHEN their slopes are compared with a line's THEN little is left: a
    // degree passes one time in twenty, by 0.5 % of its variance on average, and those of degree one, three
    // and five are 1, 5 and 14 times the line's
    TEST_ASSERT_TRUE(slope_noise(0.0, 0.0) < 2.0 * 0.005 * (1.0 + 5.0 + 14.0));
}

/// A leg's speed with a transient that oscillates.
static double ringing_m_s(double frequency_hz, double amplitude_m_s, double t_s) {
    return amplitude_m_s * cos(2.0 * 3.14159265358979 * frequency_hz * t_s);
}

/// Largest error of the smooth speeds after a tick of a steady oscillation, over its amplitude.
static double ringing_left_in(double frequency_hz, double amplitude_m_s, uint32_t from, uint32_t ticks) {
    const hexload_config_t config = machine_with_lag(80, 20e-6);
    const double omega = 2.0 * 3.14159265358979 * frequency_hz;
    hexload_smoother_t smoother;
    hexload_smooth_sample_t past;
    double largest_m_s = 0.0;
    hexload_smoother_init(&smoother, &config);
    for (uint32_t tick = 0; tick < ticks; tick++) {
        const double t_s = 1e-3 * tick;
        hexload_leg_sample_t sample = {.tick = tick};
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            sample.displacement_m[leg] = (hexload_real_t)(amplitude_m_s / omega * sin(omega * t_s));
            sample.velocity_m_s[leg] = (hexload_real_t)ringing_m_s(frequency_hz, amplitude_m_s, t_s);
        }
        (void)put(&smoother, &config, &sample, tick > 0);
        if (hexload_smoother_take(&smoother, &config.sensors, &past) && past.sample.tick > from) {
            const double true_m_s = ringing_m_s(frequency_hz, amplitude_m_s, 1e-3 * past.sample.tick);
            largest_m_s = fmax(largest_m_s, fabs((double)past.smooth_velocity_m_s[2] - true_m_s));
        }
    }
    return largest_m_s / amplitude_m_s;
}

/// In the first 320 ticks, four lags.
static double ringing_left(double frequency_hz, double amplitude_m_s) {
    return ringing_left_in(frequency_hz, amplitude_m_s, 100, 400);
}

static void test_a_servo_that_rings_on_is_no_transient(void) {
    // GIVEN legs that ring at 50 Hz with 50 mm/s WHEN that has lasted for more than four lags, and the two of
    // the window THEN the speeds are the window's, which leaves nothing of it: off by the amplitude, and by a
    // fiftieth, its gain at that frequency
    const double left = ringing_left_in(50.0, 0.05, 600, 1200);
    TEST_ASSERT_DOUBLE_WITHIN(0.03, 1.0, left);
}

static void test_a_transient_faster_than_the_window_is_followed(void) {
    // GIVEN legs that ring with 50 mm/s, of which a window of 161 ms leaves nothing WHEN the speeds are asked
    // for THEN of 20 Hz a polynomial of degree six leaves out nothing, of 60 Hz 2.2 % (its weights times
    // cosines); and of each degree's part what counts as noise: the roots of 22.46 * 0.0992, 0.0659 and
    // 0.0760 sigma^2 over six legs, 0.61, 0.50 and 0.53 mm/s
    TEST_ASSERT_TRUE(ringing_left(20.0, 0.05) < 1e-4 + 1.64 / 50.0);
    TEST_ASSERT_TRUE(ringing_left(60.0, 0.05) < 0.0215 + 1.64 / 50.0);
}

static void test_a_transient_is_never_followed_the_wrong_way_round(void) {
    // GIVEN legs that ring at 110 Hz, of which degree two gives -0.15, degree four -0.24 more and degree six
    // 0.65 (their weights times cosines), so that of the three the last stands out first WHEN the smooth
    // speeds are asked for THEN they leave it out, or a part of it: off by the amplitude at most and a
    // fiftieth, the window's own gain, where degree four alone would be by 1.39 of it
    static const double amplitude_m_s[] = {5e-4, 1e-3, 2e-3, 4e-3, 0.015, 0.05};
    for (int n = 0; n < 6; n++) {
        TEST_ASSERT_TRUE(ringing_left(110.0, amplitude_m_s[n]) < 1.02);
    }
}

/// Speeds of legs at rest have noise of `sigma_m_s` in the first `noisy` of each `period` ticks, else the
/// stated 1 mm/s.
typedef struct noise {
    double sigma_m_s;
    uint32_t noisy, period;
} noise_t;

/// How many of `count` smooth speeds are not zero, one in the middle of each of the noisy ticks.
static int followed_at_rest(noise_t noise, uint32_t count) {
    const hexload_config_t config = machine_with_lag(20, 20e-6);
    hexload_smoother_t smoother;
    hexload_smooth_sample_t past;
    uint64_t seed = 5;
    int followed = 0;
    hexload_smoother_init(&smoother, &config);
    for (uint32_t tick = 0; tick < (count + 1) * noise.period + 40; tick++) {
        const double sigma_m_s = tick % noise.period < noise.noisy ? noise.sigma_m_s : 1e-3;
        hexload_leg_sample_t sample = {.tick = tick};
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            sample.velocity_m_s[leg] = (hexload_real_t)(sigma_m_s * normal(&seed));
        }
        (void)put(&smoother, &config, &sample, tick > 0);
        if (hexload_smoother_take(&smoother, &config.sensors, &past) && past.sample.tick >= noise.period &&
            past.sample.tick < (count + 1) * noise.period &&
            past.sample.tick % noise.period == noise.noisy / 2) {
            followed += (double)past.smooth_velocity_m_s[0] != 0.0 ? 1 : 0;
        }
    }
    return followed;
}

static void test_noise_of_speed_sensors_is_hardly_ever_followed(void) {
    // GIVEN legs at rest whose speed sensors have the stated noise WHEN 4,000 speeds are asked for, from
    // windows that share no tick THEN three in a thousand let something through, one for each degree: 12, and
    // more than 28 one time in 40,000
    TEST_ASSERT_TRUE(followed_at_rest((noise_t){1e-3, 25, 25}, 4000) <= 28);
    // AND of noise of 1.3 times the stated, which is measured around each with a sigma of 0.18 of itself: the
    // mean of 0.1 % exp(-9.2 x) over that is 0.38 %, 46 for the three, four sigma 27
    TEST_ASSERT_TRUE(followed_at_rest((noise_t){1.3e-3, 25, 25}, 4000) <= 73);
}

static void test_a_burst_of_noise_is_no_transient(void) {
    // GIVEN legs at rest whose speed sensors have five times the stated noise for 50 ticks, twice a second,
    // which does not last WHEN the speeds in the middle of 400 of them are asked for THEN few let something
    // through: 95 % of the noise are known there, with which 0.38 % are 0.6 %, 7 for the three, four sigma 11
    TEST_ASSERT_TRUE(followed_at_rest((noise_t){5e-3, 50, 500}, 400) <= 18);
}

/// Smooth speeds of ticks 28 to 52 of a motion that bends in all directions, one speed of whose tick 40 is
/// wrong.
static void speeds_around(double wrong_m_s, hexload_real_t smooth_m_s[25][HEXLOAD_LEGS]) {
    const hexload_config_t config = machine_with_lag(20, 20e-6);
    hexload_smoother_t smoother;
    hexload_smooth_sample_t past;
    hexload_smoother_init(&smoother, &config);
    for (uint32_t tick = 0; tick <= 72; tick++) {
        hexload_leg_sample_t sample = sample_of(tick);
        sample.velocity_m_s[4] += tick == 40 ? (hexload_real_t)wrong_m_s : HEXLOAD_REAL(0.0);
        (void)put(&smoother, &config, &sample, tick > 0);
        open_all_directions(&smoother);
        if (hexload_smoother_take(&smoother, &config.sensors, &past) && past.sample.tick >= 28) {
            memcpy(smooth_m_s[past.sample.tick - 28], past.smooth_velocity_m_s, sizeof smooth_m_s[0]);
        }
    }
}

static void test_a_ticks_own_speed_is_not_in_its_smooth_one(void) {
    // GIVEN a motion WHEN one speed differs by 20 mm/s THEN the smooth speed of that tick is the same, as its
    // noise would be the innovation's
    hexload_real_t right_m_s[25][HEXLOAD_LEGS], wrong_m_s[25][HEXLOAD_LEGS];
    speeds_around(0.0, right_m_s);
    speeds_around(0.02, wrong_m_s);
    TEST_ASSERT_EQUAL_MEMORY(right_m_s[12], wrong_m_s[12], sizeof right_m_s[12]);
    TEST_ASSERT_TRUE((double)right_m_s[12][4] != 0.0);
}

static void test_a_speed_that_is_wrong_once_is_not_followed(void) {
    // GIVEN a motion WHEN one speed is wrong by 1 m/s THEN that tick is left out, and no smooth speed around
    // it changes
    const hexload_real_t nothing = HEXLOAD_REAL(0.0);
    hexload_real_t right_m_s[25][HEXLOAD_LEGS], wrong_m_s[25][HEXLOAD_LEGS] = {{0}};
    speeds_around(0.0, right_m_s);
    speeds_around(1.0, wrong_m_s);
    TEST_ASSERT_EACH_EQUAL_MEMORY(&nothing, wrong_m_s[12], sizeof nothing, HEXLOAD_LEGS);
    memcpy(wrong_m_s[12], right_m_s[12], sizeof wrong_m_s[12]);
    for (int n = 0; n < 25 * HEXLOAD_LEGS; n++) { // open directions keep all but 5e-6, and learn a tick less
        TEST_ASSERT_DOUBLE_WITHIN(5e-6, (double)right_m_s[n / HEXLOAD_LEGS][n % HEXLOAD_LEGS],
                                  (double)wrong_m_s[n / HEXLOAD_LEGS][n % HEXLOAD_LEGS]);
    }
}

static void test_trapezoids_of_the_forces_are_their_integral(void) {
    // GIVEN forces that swing at 95 Hz by 1000 N
    const hexload_config_t config = machine_with_lag(20, 20e-6);
    const double omega = 2.0 * 3.14159265358979 * 95.0;
    hexload_smoother_t smoother;
    hexload_smooth_sample_t past;
    double impulse_n_s = 0.0, last_n = 0.0, start_s = 0.0, largest_n_s = 0.0;
    hexload_smoother_init(&smoother, &config);
    for (uint32_t tick = 0; tick < 200; tick++) {
        hexload_leg_sample_t sample = {.tick = tick};
        sample.force_n[3] = (hexload_real_t)(1000.0 * cos(omega * 1e-3 * tick));
        (void)put(&smoother, &config, &sample, tick > 0);
        if (!hexload_smoother_take(&smoother, &config.sensors, &past)) {
            continue;
        }
        const double now_n = (double)past.sample.force_n[3];
        const double now_s = 1e-3 * past.sample.tick;
        if (past.gap_ticks == 0) {
            start_s = now_s;
        } else {
            impulse_n_s += 0.5e-3 * (last_n + now_n);
        }
        last_n = now_n;
        // WHEN trapezoids add them up THEN the impulse is the integral, to (omega dt)^6 / 316: plain ones
        // would err by (omega dt)^2 / 12 of 1.7 N s
        const double exact_n_s = 1000.0 / omega * (sin(omega * now_s) - sin(omega * start_s));
        largest_n_s = fmax(largest_n_s, fabs(impulse_n_s - exact_n_s));
    }
    TEST_ASSERT_TRUE(largest_n_s < 2.0 * 1.7 * 1.44e-4 + ROUNDINGS(200, 1.0));
}

static void test_sums_do_not_drift(void) {
    // GIVEN a smoother that has run for 100,000 ticks
    hexload_config_t config = machine_with_lag(20, 20e-6);
    config.sensors.velocity_sigma_m_s = HEXLOAD_REAL(1e3); // no information beside the displacements
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
        (void)put(&old, &config, &sample, tick > 0);
        has_old = hexload_smoother_take(&old, &config.sensors, &from_old);
        if (tick >= 100000 - 41) { // WHEN another one sees the last window only
            (void)put(&fresh, &config, &sample, tick > 100000 - 41);
            has_fresh = hexload_smoother_take(&fresh, &config.sensors, &from_fresh);
        }
    }
    // THEN both have the same sums, bit by bit
    TEST_ASSERT_TRUE(has_old && has_fresh);
    TEST_ASSERT_EQUAL_UINT32(from_fresh.sample.tick, from_old.sample.tick);
    TEST_ASSERT_EQUAL_MEMORY(fresh.sum, old.sum, sizeof old.sum);
}

static void test_counters_that_begin_a_round_again_change_nothing(void) {
    // GIVEN two smoothers in the same motion, one of which has counted two rounds more, a round being a
    // multiple of all rings' sizes
    const hexload_config_t config = machine_with_lag(20, 1e-9);
    const uint32_t round =
        (uint32_t)HEXLOAD_WINDOW_CAPACITY * HEXLOAD_DELAY_CAPACITY * HEXLOAD_FORCE_CAPACITY;
    hexload_smoother_t young, old;
    hexload_smoother_init(&young, &config);
    for (uint32_t tick = 0; tick < 400; tick++) {
        const hexload_leg_sample_t sample = sample_of(tick);
        hexload_smooth_sample_t from_young = {.gap_ticks = 0}, from_old = {.gap_ticks = 0};
        if (tick == 200) {
            old = young;
            old.stored += 2 * round;
            old.entered += 2 * round;
        }
        (void)put(&young, &config, &sample, tick > 0);
        const bool has_young = hexload_smoother_take(&young, &config.sensors, &from_young);
        if (tick < 200) {
            continue;
        }
        // WHEN both go on THEN it goes back by a round, and what it says stays the same to the bit
        (void)put(&old, &config, &sample, 1);
        TEST_ASSERT_EQUAL(has_young, hexload_smoother_take(&old, &config.sensors, &from_old));
        TEST_ASSERT_EQUAL_UINT32(young.entered + round, old.entered);
        TEST_ASSERT_EQUAL_UINT32(young.stored + round, old.stored);
        TEST_ASSERT_EQUAL_UINT32(from_young.sample.tick, from_old.sample.tick);
        TEST_ASSERT_EQUAL_MEMORY(from_young.smooth_velocity_m_s, from_old.smooth_velocity_m_s,
                                 sizeof from_old.smooth_velocity_m_s);
        TEST_ASSERT_EQUAL_MEMORY(from_young.sample.velocity_m_s, from_old.sample.velocity_m_s,
                                 sizeof from_old.sample.velocity_m_s);
        TEST_ASSERT_EQUAL_MEMORY(from_young.sample.force_n, from_old.sample.force_n,
                                 sizeof from_old.sample.force_n);
    }
}

static void test_missing_ticks_are_bridged_and_reported(void) {
    // GIVEN a motion that bends in all directions, of which ticks 100, 101 and 150 are missing
    const hexload_config_t config = machine_with_lag(30, 1e-9);
    hexload_smoother_t smoother;
    hexload_smooth_sample_t past;
    hexload_smoother_init(&smoother, &config);
    uint32_t last_put = 0, next = HEXLOAD_TRANSIENT_TICKS, taken = 0, count = 0;
    for (uint32_t tick = 0; tick < 260; tick++) {
        if (tick == 100 || tick == 101 || tick == 150) {
            continue;
        }
        const hexload_leg_sample_t sample = sample_of(tick);
        (void)put(&smoother, &config, &sample, tick - last_put);
        open_all_directions(&smoother);
        last_put = tick;
        count++;
        // WHEN samples are taken out THEN at most one comes for each that is put in, in order, each with the
        // distance to the one before
        if (hexload_smoother_take(&smoother, &config.sensors, &past)) {
            TEST_ASSERT_EQUAL_UINT32(next, past.sample.tick);
            TEST_ASSERT_EQUAL_UINT32(taken == 0 ? 0 : next == 102 ? 3 : next == 151 ? 2 : 1, past.gap_ticks);
            next = next == 99 ? 102 : next == 149 ? 151 : next + 1;
            taken++;
            // AND the bridge, a cubic over three ticks, keeps the slope of the windows around it
            const hexload_leg_sample_t exact = sample_of(past.sample.tick);
            TEST_ASSERT_DOUBLE_WITHIN(past.sample.tick < 30 ? 1.5e-3 : 1e-4, (double)exact.velocity_m_s[3],
                                      (double)past.smooth_velocity_m_s[3]);
        }
    }
    TEST_ASSERT_EQUAL_UINT32(count - 30 - HEXLOAD_TRANSIENT_TICKS, taken); // real ones only, again
}

static void test_ticks_lost_at_random_never_begin_anew(void) {
    // GIVEN a log of which every fifth tick is lost at random, but never two running
    const hexload_config_t config = machine_with_lag(50, 20e-6);
    hexload_smoother_t smoother;
    hexload_smooth_sample_t past;
    hexload_smoother_init(&smoother, &config);
    uint64_t seed = 7;
    uint32_t last_put = 0, last_taken = 0, taken = 0, count = 0;
    for (uint32_t tick = 0; tick < 20000; tick++) {
        if (tick - last_put == 1 && uniform(&seed) < -0.6) { // uniform in -1 .. 1
            continue;
        }
        // WHEN each of the others is put in THEN the smoother goes on, although the ticks that were lost
        // within a lag are now few, now many
        const hexload_leg_sample_t sample = sample_of(tick);
        TEST_ASSERT_EQUAL(tick > 0, put(&smoother, &config, &sample, tick - last_put));
        last_put = tick;
        count++;
        if (hexload_smoother_take(&smoother, &config.sensors, &past)) {
            TEST_ASSERT_EQUAL_UINT32(taken == 0 ? 0 : past.sample.tick - last_taken, past.gap_ticks);
            last_taken = past.sample.tick;
            taken++;
        }
    }
    // AND hardly any sample is left out
    TEST_ASSERT_TRUE(taken > count - count / 50);
}

static void test_too_long_a_gap_begins_anew(void) {
    const hexload_config_t config = machine_with_lag(15, 20e-6);
    hexload_smoother_t smoother;
    hexload_smooth_sample_t past;
    hexload_smoother_init(&smoother, &config);
    for (uint32_t tick = 0; tick < 40; tick++) {
        const hexload_leg_sample_t sample = sample_of(tick);
        TEST_ASSERT_EQUAL(tick > 0, put(&smoother, &config, &sample, tick > 0));
        (void)hexload_smoother_take(&smoother, &config.sensors, &past);
    }
    // GIVEN a gap of one tick more than can be bridged WHEN the next samples come THEN the lag and the
    // ticks before must fill, and the first one out has no predecessor
    const uint32_t after = 39 + config.momentum.longest_gap_ticks + 1;
    const hexload_leg_sample_t sample = sample_of(after);
    TEST_ASSERT_FALSE(put(&smoother, &config, &sample, after - 39));
    for (uint32_t tick = after + 1; tick <= after + 15 + HEXLOAD_TRANSIENT_TICKS; tick++) {
        const hexload_leg_sample_t next = sample_of(tick);
        TEST_ASSERT_EQUAL(false, hexload_smoother_take(&smoother, &config.sensors, &past));
        TEST_ASSERT_TRUE(put(&smoother, &config, &next, 1));
    }
    TEST_ASSERT_TRUE(hexload_smoother_take(&smoother, &config.sensors, &past));
    TEST_ASSERT_EQUAL_UINT32(after + HEXLOAD_TRANSIENT_TICKS, past.sample.tick);
    TEST_ASSERT_EQUAL_UINT32(0, past.gap_ticks);
}

static void test_an_outlier_is_one_beside_its_own_neighbours_alone(void) {
    // GIVEN speeds of 0.5 m/s of long ago, which are still stored, and a machine at rest since WHEN one speed
    // is 0.5 m/s again THEN its tick is left out, and neither the one before nor the one after
    const hexload_config_t config = machine_with_lag(60, 20e-6);
    hexload_smoother_t smoother;
    hexload_smoother_init(&smoother, &config);
    const uint32_t outlier = HEXLOAD_DELAY_CAPACITY + 20;
    for (uint32_t tick = 0; tick <= outlier + 2; tick++) {
        hexload_leg_sample_t sample = {.tick = tick};
        if (tick <= 40 || tick == outlier) {
            sample.velocity_m_s[3] = HEXLOAD_REAL(0.5);
        }
        (void)put(&smoother, &config, &sample, tick > 0);
        hexload_smooth_sample_t past;
        (void)!hexload_smoother_take(&smoother, &config.sensors, &past);
    }
    TEST_ASSERT_FALSE(hexload_smoother_leaves_out(&smoother, (outlier - 1) % HEXLOAD_DELAY_CAPACITY));
    TEST_ASSERT_TRUE(hexload_smoother_leaves_out(&smoother, outlier % HEXLOAD_DELAY_CAPACITY));
    TEST_ASSERT_FALSE(hexload_smoother_leaves_out(&smoother, (outlier + 1) % HEXLOAD_DELAY_CAPACITY));
}

static void test_before_the_window_is_full_speeds_stay_until_they_change_clearly(void) {
    // GIVEN a machine that has just started, at ten sigma of speed WHEN its speed changes by half a sigma in
    // each leg, 1.5 of 2.2 in the sum of squares that count THEN the smooth speed stays as it is, to the bit;
    // and by ten more it follows
    const hexload_config_t config = machine_with_lag(60, 20e-6);
    const hexload_real_t sigma_m_s = config.sensors.velocity_sigma_m_s;
    hexload_smoother_t smoother;
    hexload_smooth_sample_t past;
    hexload_real_t at[2] = {0};
    hexload_smoother_init(&smoother, &config);
    for (uint32_t tick = 0; tick < 120; tick++) {
        hexload_leg_sample_t sample = {.tick = tick};
        const double sigmas = tick < 25 ? 10.0 : tick < 50 ? 10.5 : 20.0;
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            sample.velocity_m_s[leg] = (hexload_real_t)sigmas * sigma_m_s;
        }
        (void)put(&smoother, &config, &sample, tick > 0);
        if (hexload_smoother_take(&smoother, &config.sensors, &past)) {
            at[0] = past.sample.tick == 12 ? past.smooth_velocity_m_s[2] : at[0];
            at[1] = past.sample.tick == 37 ? past.smooth_velocity_m_s[2] : at[1];
        }
    }
    TEST_ASSERT_TRUE(at[0] > HEXLOAD_REAL(8.0) * sigma_m_s);
    TEST_ASSERT_EQUAL_DOUBLE((double)at[0], (double)at[1]);
    TEST_ASSERT_TRUE(past.smooth_velocity_m_s[2] > HEXLOAD_REAL(18.0) * sigma_m_s);
}

enum { HISTORY = 4000, LAG = 40, LEGS = HEXLOAD_LEGS, SEGMENT = 500, FOLLOWED = 12 };

/// What a smoother has been given, and what the equations make of it, in double precision.
typedef struct textbook {
    double displacement_m[HISTORY][LEGS];
    double velocity_m_s[HISTORY][LEGS];
    bool is_left_out[HISTORY];
    double spread[LEGS][LEGS], kept[LEGS][LEGS]; ///< A, and that by which slopes are kept
    double held_m_s[LEGS];
    uint32_t slopes, turn, transient_ticks;
    double noise_m2_s2;   ///< of the speeds around the middle
    double tolerance_m_s; ///< by roundings in single precision
    bool is_close;        ///< to a limit, so that rounding may decide
} textbook_t;

static double dot_of(const double a[LEGS], const double b[LEGS]) {
    double sum = 0.0;
    for (int k = 0; k < LEGS; k++) {
        sum += a[k] * b[k];
    }
    return sum;
}

/// a > b; remembers when rounding may decide otherwise.
static bool exceeds(textbook_t* book, double a, double b) {
    book->is_close = book->is_close || fabs(a - b) < 0.02 * (fabs(a) + fabs(b));
    return a > b;
}

/// x loses y = (A / 5 + E)^-1 x, by elimination, as A / 5 + E is positive definite, but for what of y is
/// beyond noise.
static void keep_directions(textbook_t* book, double x[LEGS], double sigma_m_s) {
    double M[LEGS][LEGS], y[LEGS], largest = 0.0;
    memcpy(y, x, sizeof y);
    for (int i = 0; i < LEGS; i++) {
        for (int j = 0; j < LEGS; j++) {
            M[i][j] = book->kept[i][j] / 5.0 + (i == j ? 1.0 : 0.0);
        }
        largest = fmax(largest, M[i][i]);
    }
    for (int i = 0; i < LEGS; i++) {
        for (int r = 0; r < LEGS; r++) {
            const double factor = r == i ? 0.0 : M[r][i] / M[i][i];
            for (int j = 0; j < LEGS; j++) {
                M[r][j] -= factor * M[i][j];
            }
            y[r] -= factor * y[i];
        }
    }
    for (int i = 0; i < LEGS; i++) {
        y[i] /= M[i][i];
    }
    const double square = dot_of(y, y) / (sigma_m_s * sigma_m_s);
    const double left = exceeds(book, square, 12.59) ? 12.59 / square : 1.0;
    for (int i = 0; i < LEGS; i++) {
        x[i] -= left * y[i];
    }
    // roundings of A beside E change what is taken off, which is 3.6 sigma at most
    book->tolerance_m_s += ROUNDINGS(6, largest) * 3.6 * sigma_m_s + ROUNDINGS(6, sqrt(dot_of(x, x)));
}

/// c of every eighth slope goes into A, which counts seven ticks later.
static void learn_directions(textbook_t* book, const double c[LEGS]) {
    if (book->turn == 0) {
        book->slopes += book->slopes < 128 ? 1 : 0;
        const double share = 1.0 / book->slopes, weight = share * fmin(1.0, 1e6 / dot_of(c, c));
        for (int i = 0; i < LEGS; i++) {
            for (int j = 0; j < LEGS; j++) {
                book->spread[i][j] += weight * c[i] * c[j] - share * book->spread[i][j];
            }
        }
    }
    if (book->turn == 7) {
        memcpy(book->kept, book->spread, sizeof book->kept);
    }
    book->turn = (book->turn + 1) % 8;
}

/// Odd polynomials of degrees 1, 3, 5 that are orthogonal over the window, by Gram and Schmidt.
typedef struct odd_polynomials {
    double value[3][LAG + 1]; ///< at tick j of the window
    double square[3];         ///< sum over it
    double slope[3];          ///< at its middle, per tick
} odd_polynomials_t;

static odd_polynomials_t make_odd_polynomials(void) {
    odd_polynomials_t odd = {.slope = {1.0, 0.0, 0.0}};
    for (int m = 0; m < 3; m++) {
        for (int j = 0; j <= LAG; j++) {
            odd.value[m][j] = pow(j, 2 * m + 1);
        }
        for (int n = 0; n < m; n++) {
            double shared = 0.0;
            for (int j = 1; j <= LAG; j++) {
                shared += 2.0 * odd.value[m][j] * odd.value[n][j];
            }
            for (int j = 1; j <= LAG; j++) {
                odd.value[m][j] -= shared / odd.square[n] * odd.value[n][j];
            }
            odd.slope[m] -= shared / odd.square[n] * odd.slope[n];
        }
        for (int j = 1; j <= LAG; j++) {
            odd.square[m] += 2.0 * odd.value[m][j] * odd.value[m][j];
        }
    }
    return odd;
}

/// The slopes of each polynomial's part of the displacements, of which what noise may be is taken off.
static void fit_window(textbook_t* book, uint32_t middle, double tick_s, double sigma_m, double v[LEGS]) {
    const odd_polynomials_t odd = make_odd_polynomials();
    double part[3][LEGS], share[3], bend[LEGS], c[LEGS], sigma_m_s[3];
    for (int m = 0; m < 3; m++) {
        const double gain = odd.slope[m] / (tick_s * odd.square[m]);
        double largest = 0.0; // of what single precision has before it is made orthogonal
        sigma_m_s[m] = sigma_m * fabs(gain) * sqrt(odd.square[m]);
        for (int leg = 0; leg < LEGS; leg++) {
            double sum = 0.0, moment = 0.0;
            for (uint32_t j = 1; j <= LAG; j++) {
                const double odd_m =
                    book->displacement_m[middle + j][leg] - book->displacement_m[middle - j][leg];
                sum += odd.value[m][j] * odd_m;
                moment += pow(j, 2 * m + 1) * odd_m;
            }
            part[m][leg] = gain * sum;
            largest = fmax(largest, fabs(gain * moment));
        }
        share[m] = fmax(0.0, 1.0 - 12.59 * sigma_m_s[m] * sigma_m_s[m] / dot_of(part[m], part[m]));
        book->tolerance_m_s += ROUNDINGS(15, largest);
    }
    for (int leg = 0; leg < LEGS; leg++) {
        c[leg] = part[0][leg] / sigma_m_s[0];
        v[leg] = share[0] * part[0][leg];
        bend[leg] = share[1] * part[1][leg] + share[2] * part[2][leg];
    }
    learn_directions(book, c);
    keep_directions(book, v, sigma_m_s[0]);
    keep_directions(book, bend, sigma_m_s[1]);
    for (int leg = 0; leg < LEGS; leg++) {
        v[leg] += bend[leg];
    }
}

/// The middle value of polynomials through the speeds on either side. @return its variance, of that of a
/// speed.
static double fit_polynomial(const textbook_t* book, uint32_t middle, int degree, double v[LEGS]) {
    double weight[FOLLOWED];
    const double variance = weigh_polynomial(degree, FOLLOWED, weight);
    for (int leg = 0; leg < LEGS; leg++) {
        v[leg] = 0.0;
        for (uint32_t j = 1; j <= FOLLOWED; j++) {
            v[leg] +=
                weight[j - 1] * (book->velocity_m_s[middle + j][leg] + book->velocity_m_s[middle - j][leg]);
        }
    }
    return variance;
}

static double distance2(const double a[LEGS], const double b[LEGS]) {
    double sum = 0.0;
    for (int k = 0; k < LEGS; k++) {
        sum += (a[k] - b[k]) * (a[k] - b[k]);
    }
    return sum;
}

/// Leaky mean of squares of third differences until the last tick around.
static double noise_around(textbook_t* book, uint32_t middle, double sigma_m_s) {
    const uint32_t t = middle + FOLLOWED;
    double mean = 0.0;
    for (int k = 0; k < LEGS; k++) {
        const double difference = book->velocity_m_s[t][k] - 3.0 * book->velocity_m_s[t - 1][k] +
                                  3.0 * book->velocity_m_s[t - 2][k] - book->velocity_m_s[t - 3][k];
        mean += difference * difference / (20.0 * LEGS);
    }
    book->noise_m2_s2 += (mean - book->noise_m2_s2) / FOLLOWED;
    return fmax(sigma_m_s * sigma_m_s, book->noise_m2_s2);
}

static void follow_transient(textbook_t* book, uint32_t middle, double sigma_m_s, double v[LEGS]) {
    const double noise_m2_s2 = noise_around(book, middle, sigma_m_s);
    double below[LEGS], value[LEGS], with[LEGS], variance_below = 0.0;
    bool is_whole = true, is_transient = false;
    for (uint32_t j = 1; j <= FOLLOWED; j++) {
        is_whole = is_whole && !book->is_left_out[middle - j] && !book->is_left_out[middle + j];
    }
    memcpy(with, v, sizeof with);
    memcpy(below, v, sizeof below);
    for (int degree = 2; degree <= 6 && is_whole; degree += 2) {
        const double variance = fit_polynomial(book, middle, degree, value);
        const double least = 22.46 * (variance - variance_below) * noise_m2_s2;
        const double square = distance2(value, below);
        const bool is_kept = exceeds(book, square, least);
        for (int k = 0; k < LEGS; k++) {
            with[k] += is_kept ? (1.0 - least / square) * (value[k] - below[k]) : 0.0;
        }
        is_transient = is_transient || is_kept;
        variance_below = variance;
        memcpy(below, value, sizeof below);
    }
    if (is_transient) {
        book->transient_ticks += book->transient_ticks < 8 * LAG ? 1 : 0;
    } else {
        book->transient_ticks -= book->transient_ticks > 0 ? 1 : 0;
    }
    if (is_transient && book->transient_ticks <= 4 * LAG) {
        memcpy(v, with, sizeof with);
    }
}

/// From rest to 3 m/s^2, with the sensors' noise, ringing of 80 Hz, and speeds that are wrong once.
static hexload_leg_sample_t random_tick(const hexload_config_t* config, uint32_t tick, uint64_t* seed) {
    static const double amplitude_m[] = {0.0, 2e-5, 0.05, 2e-4, 0.0, 0.01, 1e-3, 0.0};
    const uint32_t segment = tick / SEGMENT, since = tick % SEGMENT;
    const double a = amplitude_m[segment % 8], w = 2.0 * 3.14159265358979, t_s = 1e-3 * tick;
    const double ring_hz = segment % 2 == 1 ? 25.0 : 80.0;
    const double ring_m_s = segment % 6 == 1   ? 0.3
                            : segment % 3 == 2 ? 0.02 * exp(-(double)since / 20.0)
                                               : 0.0;
    hexload_leg_sample_t sample = {.tick = tick};
    for (int leg = 0; leg < LEGS; leg++) {
        const double f_hz = 1.0 + 0.7 * (segment % 5) + (leg % 2) * 0.3, phase = 1.1 * leg;
        const double once = tick % 97 == 50 && leg == (int)(tick % LEGS) ? 0.1 : 0.0;
        sample.displacement_m[leg] =
            (hexload_real_t)(a * sin(w * f_hz * t_s + phase) +
                             (double)config->sensors.displacement_sigma_m * normal(seed));
        sample.velocity_m_s[leg] =
            (hexload_real_t)(a * w * f_hz * cos(w * f_hz * t_s + phase) +
                             (double)config->sensors.velocity_sigma_m_s * normal(seed) + once +
                             ring_m_s * cos(w * ring_hz * t_s + leg));
    }
    return sample;
}

static void note(textbook_t* book, const hexload_config_t* config, const hexload_leg_sample_t* sample) {
    const uint32_t t = sample->tick;
    double largest = 0.0;
    for (int leg = 0; leg < LEGS; leg++) {
        book->displacement_m[t][leg] = trunc((double)sample->displacement_m[leg] / step_m) * step_m;
        book->velocity_m_s[t][leg] = (double)sample->velocity_m_s[leg];
        if (t >= 2) {
            const double last = book->velocity_m_s[t - 1][leg];
            largest =
                fmax(largest, (last - book->velocity_m_s[t - 2][leg]) * (last - book->velocity_m_s[t][leg]));
        }
    }
    book->is_left_out[t - (t > 0)] = largest > 3600.0 * pow((double)config->sensors.velocity_sigma_m_s, 2.0);
}

/// How often something happened.
typedef struct tally {
    int judged, left_out, moved, transients, lasting;
} tally_t;

/// Speeds of a tick that was taken out are those of the polynomials, but where rounding decides, and so is
/// for how long the legs have rung.
static void check_speeds(textbook_t* book, const hexload_config_t* config, double sigma_m_s,
                         const hexload_smoother_t* smoother, const hexload_smooth_sample_t* past,
                         tally_t* tally) {
    double v[LEGS], fitted[LEGS];
    TEST_ASSERT_FALSE(book->is_left_out[past->sample.tick]);
    memcpy(v, book->held_m_s, sizeof v);
    book->is_close = false;
    book->tolerance_m_s = 0.0;
    if (past->sample.tick >= LAG) {
        fit_window(book, past->sample.tick, (double)config->tick_s,
                   (double)config->sensors.displacement_sigma_m, v);
    }
    memcpy(fitted, v, sizeof v);
    follow_transient(book, past->sample.tick, sigma_m_s, v);
    const double largest_m_s = sqrt(dot_of(v, v)) + 0.3;
    // weights of 24 ticks have ten digits, at j^4 = 20736, and terms up to 3.7, which round twice
    book->tolerance_m_s += ROUNDINGS(20 + 24 * 2 * 3.7, largest_m_s) + 24 * 20736 * 5e-14 * largest_m_s;
    for (int leg = 0; leg < LEGS && !book->is_close; leg++) {
        TEST_ASSERT_DOUBLE_WITHIN(book->tolerance_m_s, v[leg], (double)past->smooth_velocity_m_s[leg]);
    }
    if (!book->is_close) {
        TEST_ASSERT_EQUAL_UINT32(book->transient_ticks, smoother->transient_ticks);
    }
    tally->judged += !book->is_close;
    tally->moved += dot_of(fitted, fitted) > 1e-6;
    tally->transients += distance2(fitted, v) > 0.0;
    tally->lasting += book->transient_ticks > 4 * LAG;
    book->transient_ticks = smoother->transient_ticks;
    for (int leg = 0; leg < LEGS; leg++) {
        book->held_m_s[leg] = (double)past->smooth_velocity_m_s[leg];
    }
}

static void test_a_smooth_speed_is_that_of_the_equations_at_every_tick(void) {
    // GIVEN legs that rest, move and ring, with noise, for sensors of speed and for speeds from displacements
    static textbook_t book;
    tally_t tally = {0};
    for (int machine = 0; machine < 2; machine++) {
        hexload_config_t config = machine_with_lag(LAG, 20e-6);
        hexload_smoother_t smoother;
        hexload_smooth_sample_t past;
        uint64_t seed = 71;
        config.sensors.half_window_ticks = machine == 0 ? 0 : 6;
        const double sigma_m_s =
            (double)config.sensors.velocity_sigma_m_s * (machine == 0 ? 1.0 : sqrt(10.0));
        memset(&book, 0, sizeof book);
        hexload_smoother_init(&smoother, &config);
        for (uint32_t tick = 0; tick < HISTORY; tick++) {
            const hexload_leg_sample_t sample = random_tick(&config, tick, &seed);
            (void)put(&smoother, &config, &sample, tick > 0);
            note(&book, &config, &sample);
            // WHEN a tick of the past is taken out THEN its speeds are those of the equations
            if (hexload_smoother_take(&smoother, &config.sensors, &past)) {
                check_speeds(&book, &config, sigma_m_s, &smoother, &past, &tally);
            } else {
                tally.left_out += tick > LAG + FOLLOWED;
            }
        }
    }
    // AND little was left to rounding, and all kinds were among them
    TEST_ASSERT_GREATER_THAN_INT(HISTORY, tally.judged);
    TEST_ASSERT_GREATER_THAN_INT(10, tally.left_out);
    TEST_ASSERT_GREATER_THAN_INT(1000, tally.moved);
    TEST_ASSERT_GREATER_THAN_INT(200, tally.transients);
    TEST_ASSERT_GREATER_THAN_INT(100, tally.lasting);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_slope_of_a_polynomial_of_degree_six_is_exact);
    RUN_TEST(test_noise_of_the_slope_in_motion_is_that_of_a_line_in_its_direction);
    RUN_TEST(test_curvature_of_one_leg_does_not_bring_in_the_noise_of_the_others);
    RUN_TEST(test_noise_at_rest_is_not_taken_for_motion);
    RUN_TEST(test_a_transient_faster_than_the_window_is_followed);
    RUN_TEST(test_a_servo_that_rings_on_is_no_transient);
    RUN_TEST(test_a_transient_is_never_followed_the_wrong_way_round);
    RUN_TEST(test_noise_of_speed_sensors_is_hardly_ever_followed);
    RUN_TEST(test_a_burst_of_noise_is_no_transient);
    RUN_TEST(test_a_ticks_own_speed_is_not_in_its_smooth_one);
    RUN_TEST(test_a_speed_that_is_wrong_once_is_not_followed);
    RUN_TEST(test_trapezoids_of_the_forces_are_their_integral);
    RUN_TEST(test_sums_do_not_drift);
    RUN_TEST(test_counters_that_begin_a_round_again_change_nothing);
    RUN_TEST(test_missing_ticks_are_bridged_and_reported);
    RUN_TEST(test_ticks_lost_at_random_never_begin_anew);
    RUN_TEST(test_too_long_a_gap_begins_anew);
    RUN_TEST(test_an_outlier_is_one_beside_its_own_neighbours_alone);
    RUN_TEST(test_before_the_window_is_full_speeds_stay_until_they_change_clearly);
    RUN_TEST(test_a_smooth_speed_is_that_of_the_equations_at_every_tick);
    return UNITY_END();
}
