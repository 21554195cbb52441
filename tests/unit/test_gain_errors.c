#include "actuator_effects/gain_errors.h"

#include "machine.h"

#include <math.h>
#include <string.h>

void setUp(void) {}
void tearDown(void) {}

enum { TICKS = 4000 };

#define NOISE_N 4.0
/// Of the noise in forces whose trapezoids are the integral, in that of the sensors: f - D2 f / 12 + 11 D4 f
/// / 720.
#define SMOOTH_VARIANCE ((906.0 * 906.0 + 2.0 * 104.0 * 104.0 + 2.0 * 11.0 * 11.0) / (720.0 * 720.0))
#define MOMENT 60.0     ///< of platform and load, kg m^2
#define OWN_SQUARE 2.25 ///< the filter's variance of mass and first moments

typedef struct bench {
    hexload_config_t config;
    hexload_momentum_t estimator;
    hexload_gain_errors_t self;
    hexload_sensors_t sensors;
    hexload_delayed_tick_t past;
} bench_t;

/// All moments are known to a hundredth, mass and first moments to 1.5, products to 1 of 0.
static void begin(bench_t* bench) {
    memset(bench, 0, sizeof *bench);
    hexload_config_default(&bench->config);
    bench->config.tolerances.force_gain = HEXLOAD_REAL(0.004);
    bench->sensors.force_sigma_n = (hexload_real_t)NOISE_N;
    bench->past.sensors = &bench->sensors;
    for (int k = HEXLOAD_LOAD_M; k <= HEXLOAD_LOAD_HZ; k++) {
        bench->estimator.filter.load_cov[k][k] = (hexload_real_t)OWN_SQUARE;
    }
    bench->estimator.filter.load_cov[HEXLOAD_LOAD_IXY][HEXLOAD_LOAD_IXY] = HEXLOAD_REAL(1.0);
    for (int k = HEXLOAD_LOAD_IXX; k <= HEXLOAD_LOAD_IZZ; k++) {
        bench->estimator.filter.platform[k] = HEXLOAD_REAL(25.0);
        bench->estimator.filter.theta[k] = HEXLOAD_REAL(35.0);
        bench->estimator.filter.load_cov[k][k] = (hexload_real_t)(1e-4 * MOMENT * MOMENT);
        bench->estimator.supervisor.kept[k] = HEXLOAD_REAL(1.0);
    }
}

static double force_n(int leg, int tick) {
    return 900.0 + 50.0 * leg + (80.0 + 10.0 * leg) * sin(0.007 * tick + leg);
}

/// Sum of squares of a leg's forces about their mean, in those of the noise, less what noise would make of
/// it.
static double square_of(int leg, int ticks) {
    double mean_n = 0.0;
    double square = 0.0;
    for (int tick = 0; tick < ticks; tick++) {
        mean_n += force_n(leg, tick) / ticks;
    }
    for (int tick = 0; tick < ticks; tick++) {
        square += pow((force_n(leg, tick) - mean_n) / NOISE_N, 2.0) - SMOOTH_VARIANCE;
    }
    return square;
}

/// @return the sum of all legs.
static double push(bench_t* bench) {
    double square = 0.0;
    for (int tick = 0; tick < TICKS; tick++) {
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            bench->past.smooth.sample.force_n[leg] = (hexload_real_t)force_n(leg, tick);
        }
        hexload_gain_errors_step(&bench->self, &bench->past);
    }
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        square += square_of(leg, TICKS);
    }
    return square;
}

/// Sigma of parameter k.
static double widened(const bench_t* bench, double sigma, uint32_t confounded, int k) {
    hexload_real_t sigmas[HEXLOAD_LOAD_DIM];
    for (int n = 0; n < HEXLOAD_LOAD_DIM; n++) {
        sigmas[n] = (hexload_real_t)sigma;
    }
    hexload_gain_errors_widen(&bench->self, &bench->config, &bench->estimator, confounded, sigmas);
    return (double)sigmas[k];
}

/// Where the biases are not confounded with anything.
static double factor_of(const bench_t* bench, double factor) {
    return widened(bench, factor, 0, HEXLOAD_LOAD_HX);
}

static void test_gains_are_in_the_sigmas_while_a_moment_is_not_known_to_a_half(void) {
    // GIVEN legs whose forces change, and a moment of platform and load of which sigma is a little more than
    // a half
    bench_t bench;
    begin(&bench);
    const double square = push(&bench);
    const double half = 0.25 * MOMENT * MOMENT;
    for (int k = HEXLOAD_LOAD_IXX; k <= HEXLOAD_LOAD_IZZ; k++) {
        bench.estimator.filter.load_cov[k][k] = (hexload_real_t)(1.01 * half);
        // WHEN sigma is asked for THEN it has 0.7 of the tolerance of what the forces have changed by,
        // beside what there was; single precision adds 4,000 squares up
        const double expected = sqrt(4.0 + pow(0.7 * 0.004, 2.0) * square * OWN_SQUARE);
        TEST_ASSERT_TRUE(expected > 4.0);
        TEST_ASSERT_DOUBLE_WITHIN(1e-3 * expected, expected, factor_of(&bench, 2.0));
        // AND a half is enough, but for what misfits have left in sigma
        bench.estimator.filter.load_cov[k][k] = (hexload_real_t)half;
        TEST_ASSERT_DOUBLE_WITHIN(0.0, 2.0, factor_of(&bench, 2.0));
        bench.estimator.filter.load_cov[k][k] = (hexload_real_t)(0.99 * half);
        TEST_ASSERT_DOUBLE_WITHIN(0.0, 2.0, factor_of(&bench, 2.0));
        bench.estimator.supervisor.kept[k] = HEXLOAD_REAL(1.1);
        TEST_ASSERT_DOUBLE_WITHIN(1e-3 * expected, expected, factor_of(&bench, 2.0));
        bench.estimator.supervisor.kept[k] = HEXLOAD_REAL(1.0);
        // AND for what late legs may have made of its axis
        const int axis = k - HEXLOAD_LOAD_IXX;
        hexload_attenuation_t* attenuation = &bench.estimator.filter.attenuation;
        bench.estimator.filter.load_cov[k][k] = (hexload_real_t)(1e-4 * MOMENT * MOMENT);
        attenuation->moved[axis] = HEXLOAD_REAL(1.0);
        attenuation->late[axis] = HEXLOAD_REAL(0.49);
        TEST_ASSERT_DOUBLE_WITHIN(0.0, 2.0, factor_of(&bench, 2.0));
        attenuation->late[axis] = HEXLOAD_REAL(0.51);
        TEST_ASSERT_DOUBLE_WITHIN(1e-3 * expected, expected, factor_of(&bench, 2.0));
        attenuation->late[axis] = HEXLOAD_REAL(0.0);
    }
}

static void test_gains_are_in_the_sigmas_of_what_the_biases_are_confounded_with(void) {
    // GIVEN legs whose forces change, all moments known
    bench_t bench;
    begin(&bench);
    const double square = push(&bench);
    const double expected = sqrt(4.0 + pow(0.7 * 0.004, 2.0) * square * OWN_SQUARE);
    const double tenth = sqrt(4.0 + pow(0.07 * 0.004, 2.0) * square * OWN_SQUARE);
    const uint32_t confounded = 1u << HEXLOAD_LOAD_HY;
    TEST_ASSERT_TRUE(tenth > 2.02);
    // WHEN the biases are confounded with one parameter THEN its sigma has a tenth of them
    for (int k = HEXLOAD_LOAD_M; k <= HEXLOAD_LOAD_HZ; k++) {
        const double of_this = k == HEXLOAD_LOAD_HY ? tenth : 2.0;
        TEST_ASSERT_DOUBLE_WITHIN(1e-3 * of_this, of_this, widened(&bench, 2.0, confounded, k));
    }
    // AND while a moment is not known, all have the whole
    bench.estimator.filter.load_cov[HEXLOAD_LOAD_IYY][HEXLOAD_LOAD_IYY] = (hexload_real_t)(MOMENT * MOMENT);
    for (int k = HEXLOAD_LOAD_M; k <= HEXLOAD_LOAD_HZ; k++) {
        TEST_ASSERT_DOUBLE_WITHIN(1e-3 * expected, expected, widened(&bench, 2.0, confounded, k));
    }
}

static void test_exact_or_commissioned_gains_widen_nothing(void) {
    // GIVEN a moment that is not known
    bench_t bench;
    begin(&bench);
    (void)push(&bench);
    bench.estimator.filter.load_cov[HEXLOAD_LOAD_IXX][HEXLOAD_LOAD_IXX] = (hexload_real_t)(MOMENT * MOMENT);
    TEST_ASSERT_TRUE(factor_of(&bench, 1.0) > 4.0);
    // WHEN a rig file has directions THEN they tell
    bench.config.rig.direction_count = 1;
    TEST_ASSERT_DOUBLE_WITHIN(0.0, 1.0, factor_of(&bench, 1.0));
    bench.config.rig.direction_count = 0;
    // AND of exact sensors nothing is open
    bench.config.tolerances.force_gain = HEXLOAD_REAL(0.0);
    TEST_ASSERT_DOUBLE_WITHIN(0.0, 1.0, factor_of(&bench, 1.0));
}

/// Noise as the smoother hands it out.
static double smooth_noise(double last[5], uint64_t* seed) {
    memmove(last, last + 1, 4 * sizeof last[0]);
    last[4] = NOISE_N * normal(seed);
    return (906.0 * last[2] - 104.0 * (last[1] + last[3]) + 11.0 * (last[0] + last[4])) / 720.0;
}

static void test_forces_that_stay_tell_of_no_gain_however_long(void) {
    // GIVEN forces that are what they are but for their noise, and a moment that is not known WHEN half an
    // hour goes by
    bench_t bench;
    begin(&bench);
    bench.estimator.filter.load_cov[HEXLOAD_LOAD_IXX][HEXLOAD_LOAD_IXX] = (hexload_real_t)(MOMENT * MOMENT);
    uint64_t seed = 1;
    double noise[HEXLOAD_LEGS][5] = {{0.0}};
    double largest = 1.0;
    for (int tick = 0; tick < 1800 * 1000; tick++) {
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            bench.past.smooth.sample.force_n[leg] =
                (hexload_real_t)(1000.0 + smooth_noise(noise[leg], &seed));
        }
        hexload_gain_errors_step(&bench.self, &bench.past);
        largest = fmax(largest, factor_of(&bench, 1.5));
    }
    // THEN sigma is as it was: the sum is one of 1.1e7 squares less their mean, 7,900 at one standard
    // deviation with what neighbours share, whose root at 0.7 times 0.4 % of 1.5 is 0.37 beside 1.5
    TEST_ASSERT_TRUE(largest < 1.65);
}

static void test_a_force_that_stands_in_for_a_lost_one_is_no_change(void) {
    // GIVEN a leg that is lost for the second half of a run, and the mean of the others in its place, 600 N
    // off
    bench_t bench;
    begin(&bench);
    const int lost = 2;
    double expected = -square_of(lost, TICKS) + square_of(lost, TICKS / 2);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        expected += square_of(leg, TICKS);
    }
    // WHEN it goes by
    for (int tick = 0; tick < TICKS; tick++) {
        const double off_n = tick < TICKS / 2 ? 0.0 : 600.0;
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            bench.past.smooth.sample.force_n[leg] =
                (hexload_real_t)(force_n(leg, tick) + (leg == lost ? off_n : 0.0));
        }
        bench.past.smooth.force_variance_n2[lost] = (hexload_real_t)(off_n > 0.0 ? 0.5 : 0.0);
        hexload_gain_errors_step(&bench.self, &bench.past);
    }
    // THEN what it changed by before counts, and that of the others
    TEST_ASSERT_DOUBLE_WITHIN(1e-3 * expected, expected, (double)bench.self.square);
}

static void test_of_loads_before_a_tick_counts_in_each_of_this_one(void) {
    // GIVEN forces that have changed with one load for a while
    bench_t bench;
    begin(&bench);
    bench.estimator.filter.load_cov[HEXLOAD_LOAD_IXX][HEXLOAD_LOAD_IXX] = (hexload_real_t)(MOMENT * MOMENT);
    const double of_tick = push(&bench) / TICKS;
    // WHEN a load has just come THEN nothing of before is in its sigma, however long that was
    hexload_gain_errors_forget(&bench.self);
    TEST_ASSERT_DOUBLE_WITHIN(0.0, 1.0, factor_of(&bench, 1.0));
    // AND after a hundred ticks, in which its forces stay at the mean, a hundred ticks of before
    const int ticks = 100;
    for (int tick = 0; tick < ticks; tick++) {
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            bench.past.smooth.sample.force_n[leg] = bench.self.mean_n[leg];
        }
        hexload_gain_errors_step(&bench.self, &bench.past);
    }
    const double expected = sqrt(1.0 + pow(0.7 * 0.004, 2.0) * of_tick * ticks * OWN_SQUARE);
    TEST_ASSERT_TRUE(expected > 1.1);
    TEST_ASSERT_DOUBLE_WITHIN(1e-3 * expected, expected, factor_of(&bench, 1.0));
    // AND nothing is in this load's own sum, in which noise cannot be less than none
    TEST_ASSERT_TRUE(bench.self.square == HEXLOAD_REAL(0.0));
    // AND with the next load the mean is one of all ticks, 4,000 as they were and 100 of rest
    hexload_gain_errors_forget(&bench.self);
    const double mean = of_tick * TICKS / (TICKS + ticks);
    TEST_ASSERT_DOUBLE_WITHIN(1e-3 * of_tick, mean, (double)bench.self.square_before);
}

static void test_a_load_that_has_not_begun_leaves_nothing_and_one_tick_what_it_had(void) {
    // GIVEN no tick at all, and one tick WHEN the next load begins THEN the mean is none, and that of the
    // tick
    hexload_gain_errors_t none = {.square = HEXLOAD_REAL(0.0)};
    hexload_gain_errors_forget(&none);
    TEST_ASSERT_TRUE(none.square_before == HEXLOAD_REAL(0.0));
    hexload_gain_errors_t one = {
        .ticks = HEXLOAD_REAL(1.0), .load_ticks = HEXLOAD_REAL(1.0), .square = HEXLOAD_REAL(5.0)};
    hexload_gain_errors_forget(&one);
    TEST_ASSERT_TRUE(one.square_before == HEXLOAD_REAL(5.0));
}

static void test_a_mean_of_forces_is_of_the_latest_minutes(void) {
    // GIVEN a mean of as many ticks as single precision has steps for WHEN a force changes by as many newtons
    bench_t bench;
    begin(&bench);
    const hexload_real_t most = HEXLOAD_REAL(262144.0); // 2^18
    bench.self.ticks = most;
    bench.past.smooth.sample.force_n[4] = most;
    hexload_gain_errors_step(&bench.self, &bench.past);
    // THEN the mean moves by one
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 1.0, (double)bench.self.mean_n[4]);
    TEST_ASSERT_TRUE(bench.self.ticks == most);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_gains_are_in_the_sigmas_while_a_moment_is_not_known_to_a_half);
    RUN_TEST(test_gains_are_in_the_sigmas_of_what_the_biases_are_confounded_with);
    RUN_TEST(test_exact_or_commissioned_gains_widen_nothing);
    RUN_TEST(test_forces_that_stay_tell_of_no_gain_however_long);
    RUN_TEST(test_a_force_that_stands_in_for_a_lost_one_is_no_change);
    RUN_TEST(test_of_loads_before_a_tick_counts_in_each_of_this_one);
    RUN_TEST(test_a_load_that_has_not_begun_leaves_nothing_and_one_tick_what_it_had);
    RUN_TEST(test_a_mean_of_forces_is_of_the_latest_minutes);
    return UNITY_END();
}
