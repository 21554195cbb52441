#include "momentum/attenuation.h"
#include "momentum/momentum_filter.h"
#include "motion.h"

#include <math.h>
#include <string.h>

void setUp(void) {}
void tearDown(void) {}

enum { TICKS = 20000 };

#define OWN_AND_LOAD 60.0 ///< moment, kg m^2

/// A platform that does not translate, level at home; its angular velocities are what is given.
typedef struct bench {
    hexload_config_t config;
    hexload_momentum_t estimator;
    hexload_kinematics_t kinematics;
    hexload_smoother_constants_t constants;
    hexload_sensors_t sensors;
    hexload_delayed_tick_t past;
    uint32_t tick;
    uint64_t seed;
} bench_t;

static void begin(bench_t* bench, uint64_t seed) {
    memset(bench, 0, sizeof *bench);
    bench->seed = seed;
    bench->config = paper_machine();
    bench->sensors.velocity_sigma_m_s = HEXLOAD_REAL(1e-3);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_kinematics_init(&bench->kinematics, &bench->config));
    const hexload_leg_sample_t at_home = {.tick = 0};
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_kinematics_solve(&bench->kinematics, &bench->config, &at_home,
                                                               &bench->past.motion));
    memset(bench->past.motion.R, 0, sizeof bench->past.motion.R);
    for (int k = 0; k < 3; k++) {
        bench->past.motion.R[k][k] = HEXLOAD_REAL(1.0);
        bench->constants.rate_gain[k] = HEXLOAD_REAL(4.0); // 2 mrad/s of a mm/s
        bench->estimator.filter.platform[HEXLOAD_LOAD_IXX + k] = HEXLOAD_REAL(25.0);
        bench->estimator.filter.theta[HEXLOAD_LOAD_IXX + k] = HEXLOAD_REAL(35.0);
    }
    for (int k = 0; k < HEXLOAD_LOAD_DIM; k++) {
        bench->estimator.filter.load_cov[k][k] = HEXLOAD_REAL(1.0);
        bench->estimator.supervisor.kept[k] = HEXLOAD_REAL(1.0);
    }
    bench->past.sensors = &bench->sensors;
    bench->past.smoother = &bench->constants;
}

/// One tick of windows of 16, of which the plausibility step has two for itself.
static void step(bench_t* bench) {
    bench->tick++;
    bench->estimator.plausibility.ticks = (uint8_t)(bench->tick % 16u);
    hexload_attenuation_step(&bench->estimator, &bench->config, &bench->past);
}

/// Of the hinges, their root mean square distance from the platform's origin.
static double arm_m(const bench_t* bench) {
    double square_m2 = 0.0;
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        for (int k = 0; k < 3; k++) {
            square_m2 += pow((double)bench->config.geometry.platform_hinge_m[leg][k], 2.0) / HEXLOAD_LEGS;
        }
    }
    return sqrt(square_m2);
}

/// About y, of a turning at 8 Hz of an amplitude, and of noise in the smooth velocity, mrad/s.
static void turn(bench_t* bench, double motion_mrad_s, double noise_mrad_s, uint32_t ticks) {
    for (uint32_t n = 0; n < ticks; n++) {
        const double true_rad_s = 1e-3 * motion_mrad_s * sin(0.05 * (double)(bench->tick + 1));
        bench->estimator.filter.smooth_twist[4] =
            (hexload_real_t)(true_rad_s + 1e-3 * noise_mrad_s * normal(&bench->seed));
        bench->past.motion.twist[4] = (hexload_real_t)(true_rad_s + 2e-3 * normal(&bench->seed));
        step(bench);
    }
}

static double kept(const bench_t* bench, int parameter) {
    return (double)bench->estimator.supervisor.kept[parameter];
}

/// Until moments have been seen to, and products.
static void end_round(bench_t* bench, double motion_mrad_s, double noise_mrad_s) {
    const uint32_t round = 20;
    const uint32_t of_products = 1;
    do {
        turn(bench, motion_mrad_s, noise_mrad_s, 1);
    } while (bench->estimator.filter.attenuation.calls % round != of_products);
    while (bench->estimator.filter.attenuation.calls % round == of_products) {
        turn(bench, motion_mrad_s, noise_mrad_s, 1);
    }
}

static void forget_factors(bench_t* bench) {
    for (int k = 0; k < HEXLOAD_LOAD_DIM; k++) {
        bench->estimator.supervisor.kept[k] = HEXLOAD_REAL(1.0);
    }
}

/// The factors of a last round alone.
static void look_again(bench_t* bench, double motion_mrad_s, double noise_mrad_s) {
    end_round(bench, motion_mrad_s, noise_mrad_s);
    forget_factors(bench);
    end_round(bench, motion_mrad_s, noise_mrad_s);
}

static void test_noise_taken_for_a_turning_widens_moments_by_its_share(void) {
    // GIVEN a platform that turns with 1.4 mrad/s rms about y, and as much noise in the smooth velocity WHEN
    // that has gone on for 20 s
    bench_t bench;
    begin(&bench, 1);
    turn(&bench, 2.0, sqrt(2.0), TICKS);
    look_again(&bench, 2.0, sqrt(2.0));
    // THEN sigma has that share of the moment that is none, to three standard deviations, 2 mrad/s over the
    // root of the sum of squares; of products with y half of it. Of the noise the mean of eight, which has
    // the newest in it, leaves 7/8, in square 0.82; of the motion 0.22, as 12 ticks are 0.53 rad of it
    const double noise_square = 2.0 * 0.82;
    const double square = noise_square + 2.0 * 0.22;
    const double share = 2.0 * 0.875 / square;
    const double deviation = 2.0 / sqrt(TICKS * 21.0 / 32.0 * square);
    const double within = OWN_AND_LOAD * 3.0 * deviation;
    TEST_ASSERT_DOUBLE_WITHIN(within, OWN_AND_LOAD * share, kept(&bench, HEXLOAD_LOAD_IYY));
    TEST_ASSERT_DOUBLE_WITHIN(within, 0.5 * OWN_AND_LOAD * share, kept(&bench, HEXLOAD_LOAD_IXY));
    TEST_ASSERT_DOUBLE_WITHIN(within, 0.5 * OWN_AND_LOAD * share, kept(&bench, HEXLOAD_LOAD_IYZ));
    // AND nothing else, of axes that have not turned
    TEST_ASSERT_TRUE(kept(&bench, HEXLOAD_LOAD_IXX) == 1.0);
    TEST_ASSERT_TRUE(kept(&bench, HEXLOAD_LOAD_IXZ) == 1.0);
    TEST_ASSERT_TRUE(kept(&bench, HEXLOAD_LOAD_M) == 1.0);
    // AND nothing of it is known of another load
    hexload_momentum_filter_forget(&bench.estimator.filter, &bench.config);
    look_again(&bench, 2.0, 0.0);
    TEST_ASSERT_TRUE(kept(&bench, HEXLOAD_LOAD_IYY) == 1.0);
}

static void test_a_true_turning_hardly_ever_widens_sigma(void) {
    // GIVEN 400 platforms that turn as they seem to WHEN a second has gone by THEN as many are widened as
    // chance has beyond 2.5 standard deviations, 2.5 of them: 8 at most, of which there are less than 0.2 %
    int widened = 0;
    for (uint64_t seed = 1; seed <= 400; seed++) {
        bench_t bench;
        begin(&bench, seed);
        turn(&bench, 20.0, 0.0, 1000);
        look_again(&bench, 20.0, 0.0);
        widened += kept(&bench, HEXLOAD_LOAD_IYY) > 1.0 ? 1 : 0;
    }
    printf("%d of 400 widened\n", widened);
    TEST_ASSERT_TRUE(widened <= 8);
}

static void test_noise_alone_is_no_more_than_all_of_the_moment(void) {
    // GIVEN a platform that does not turn, and a smooth velocity that is far off WHEN e would be beyond one
    bench_t bench;
    begin(&bench, 3);
    for (uint32_t tick = 0; tick < 4000; tick++) {
        bench.estimator.filter.smooth_twist[3] = (hexload_real_t)(tick % 2u == 0 ? 0.002 : -0.002);
        bench.past.motion.twist[3] = -bench.estimator.filter.smooth_twist[3];
        step(&bench);
    }
    // THEN sigma has the moment of platform and load, and no more: less what chance may be of it, 6.25 over a
    // sum of squares beyond 2,000, 0.3 %
    TEST_ASSERT_DOUBLE_WITHIN(0.01 * OWN_AND_LOAD, OWN_AND_LOAD, kept(&bench, HEXLOAD_LOAD_IXX));
}

static void test_what_other_misfits_have_widened_is_not_widened_twice(void) {
    // GIVEN a moment whose sigma the filter has at 1 kg m^2, and was published with 30, WHEN as much
    // noise as motion turns
    bench_t bench;
    begin(&bench, 4);
    turn(&bench, 2.0, sqrt(2.0), TICKS);
    look_again(&bench, 2.0, sqrt(2.0));
    const double missing = sqrt(pow(kept(&bench, HEXLOAD_LOAD_IYY), 2.0) - 1.0);
    bench.estimator.sigma[HEXLOAD_LOAD_IYY] = HEXLOAD_REAL(30.0);
    look_again(&bench, 2.0, sqrt(2.0));
    // THEN the factor is on what was published: the same is missing, but for a round more, which is one in
    // 2,000 of the sums
    TEST_ASSERT_DOUBLE_WITHIN(0.01 * missing, missing,
                              30.0 * sqrt(pow(kept(&bench, HEXLOAD_LOAD_IYY), 2.0) - 1.0));
}

static void test_a_displacement_that_is_bridged_says_nothing(void) {
    // GIVEN a displacement that is missing, whose place the velocity takes WHEN its slope is off
    bench_t bench;
    begin(&bench, 5);
    bench.estimator.lost.displacement_ticks = 1;
    turn(&bench, 2.0, sqrt(2.0), TICKS);
    // THEN that is no encoder's fault
    TEST_ASSERT_TRUE(kept(&bench, HEXLOAD_LOAD_IYY) == 1.0);
}

/// Twist that each leg makes of its acceleration times that time, by J from finite differences.
static void twists_of_late_legs(const bench_t* bench, double timing_s, double twist[6][6]) {
    const pose_t home = {{0.0, 0.0, 0.0}, {0.0, 0.0, 0.0}};
    for (int leg = 0; leg < 6; leg++) {
        double J[6][6];
        double late_m_s[6] = {0};
        leg_jacobian(&bench->config, (double)bench->kinematics.home_height_m, &home, J);
        for (int k = 0; k < 6; k++) {
            late_m_s[leg] += timing_s * J[leg][k] * (double)bench->estimator.supervisor.acceleration[k];
        }
        solve6(J, late_m_s, twist[leg]);
    }
}

/// A motion that lasts, and that the velocity sensors show too.
static void move(bench_t* bench, const double twist[6], const double acceleration[6], uint32_t ticks) {
    for (int k = 0; k < 6; k++) {
        bench->estimator.filter.smooth_twist[k] = (hexload_real_t)twist[k];
        bench->past.motion.twist[k] = (hexload_real_t)twist[k];
        bench->estimator.supervisor.acceleration[k] = (hexload_real_t)acceleration[k];
    }
    for (uint32_t n = 0; n < ticks; n++) {
        step(bench);
    }
}

/// In which all legs have been late more than a hundred times.
enum { ROUNDS_TICKS = 8000 };

/// What is added to a sigma of 1.
static double added(const bench_t* bench, int parameter) {
    return sqrt(pow(kept(bench, parameter), 2.0) - 1.0);
}

static void test_a_turning_that_late_legs_may_have_made_leaves_inertias_and_height_open(void) {
    // GIVEN legs that are sampled within half a millisecond of each other, a platform that heaves with 3
    // m/s^2 and turns briskly about z, little about x and hardly about y
    const double twist[6] = {0.5e-3, 0.5e-3, 0.3, 4e-3, 1e-4, 0.08};
    const double acceleration[6] = {0.0, 0.0, 3.0, 0.3, 0.0, 0.5};
    const double mass_kg = 600.0;
    bench_t bench;
    begin(&bench, 6);
    bench.config.momentum.timing_s = HEXLOAD_REAL(0.5e-3);
    bench.estimator.filter.theta[HEXLOAD_LOAD_M] = HEXLOAD_REAL(500.0);
    bench.estimator.filter.platform[HEXLOAD_LOAD_M] = HEXLOAD_REAL(100.0);
    // WHEN that has gone on for some seconds
    move(&bench, twist, acceleration, ROUNDS_TICKS);
    forget_factors(&bench); // of the first round, in which two legs have been late
    move(&bench, twist, acceleration, ROUNDS_TICKS);
    // THEN sigma has of each moment the share of the turning that six such legs make, all of it at most
    double late[6][6];
    double share[4] = {0};
    twists_of_late_legs(&bench, 0.5e-3, late);
    for (int leg = 0; leg < 6; leg++) {
        for (int k = 0; k < 3; k++) {
            share[k] += fmin(1.0, 6.0 * pow(late[leg][3 + k] / twist[3 + k], 2.0)) / 6.0;
        }
        const double shift = pow(late[leg][0], 2.0) + pow(late[leg][1], 2.0);
        share[3] += fmin(1.0, 6.0 * shift / (pow(twist[0], 2.0) + pow(twist[1], 2.0))) / 6.0;
    }
    // AND that is nearly nothing about z, a part about x, and most about y
    TEST_ASSERT_TRUE(share[2] < 0.01 && share[0] > 0.05 && share[0] < 0.5 && share[1] > 0.6);
    // within a tick of one leg more than of another in the 700 of a call, 1.4e-3
    for (int k = 0; k < 3; k++) {
        TEST_ASSERT_DOUBLE_WITHIN(2e-3 * OWN_AND_LOAD, OWN_AND_LOAD * share[k],
                                  added(&bench, HEXLOAD_LOAD_IXX + k));
    }
    // AND of a product that of the axis that is known better
    TEST_ASSERT_DOUBLE_WITHIN(2e-3 * OWN_AND_LOAD, OWN_AND_LOAD * share[0], added(&bench, HEXLOAD_LOAD_IXY));
    TEST_ASSERT_DOUBLE_WITHIN(2e-3 * OWN_AND_LOAD, OWN_AND_LOAD * share[2], added(&bench, HEXLOAD_LOAD_IXZ));
    TEST_ASSERT_DOUBLE_WITHIN(2e-3 * OWN_AND_LOAD, OWN_AND_LOAD * share[2], added(&bench, HEXLOAD_LOAD_IYZ));
    // AND of h_z that of the way in which it is known best, of the mass at the hinges' root mean square
    const double all_kg_m = mass_kg * arm_m(&bench);
    TEST_ASSERT_DOUBLE_WITHIN(2e-3 * all_kg_m, all_kg_m * fmin(share[3], share[0]),
                              added(&bench, HEXLOAD_LOAD_HZ));
    // AND nothing else
    TEST_ASSERT_TRUE(kept(&bench, HEXLOAD_LOAD_M) == 1.0);
    TEST_ASSERT_TRUE(kept(&bench, HEXLOAD_LOAD_HX) == 1.0);
    TEST_ASSERT_TRUE(kept(&bench, HEXLOAD_LOAD_HY) == 1.0);
}

static void test_noise_and_late_legs_add_up(void) {
    // GIVEN a turning about y of which half is noise, and of which a quarter may be late legs', as half of
    // that about x
    bench_t bench;
    begin(&bench, 8);
    hexload_attenuation_t* self = &bench.estimator.filter.attenuation;
    self->error[1] = HEXLOAD_REAL(50.0);
    self->square[1] = HEXLOAD_REAL(100.0);
    self->moved[0] = self->moved[1] = HEXLOAD_REAL(1.0);
    self->late[0] = HEXLOAD_REAL(0.5);
    self->late[1] = HEXLOAD_REAL(0.25);
    // WHEN moments and products are seen to
    self->calls = 3 * 20 - 1;
    end_round(&bench, 0.0, 0.0);
    // THEN sigma has both: of the noise what is beyond 2.5 standard deviations, (50^2 - 6.25 100) / (50 100)
    const double noise = 0.375;
    TEST_ASSERT_DOUBLE_WITHIN(1e-3 * OWN_AND_LOAD, (noise + 0.25) * OWN_AND_LOAD,
                              added(&bench, HEXLOAD_LOAD_IYY));
    TEST_ASSERT_DOUBLE_WITHIN(1e-3 * OWN_AND_LOAD, 0.5 * (noise + 2.0 * 0.25) * OWN_AND_LOAD,
                              added(&bench, HEXLOAD_LOAD_IXY));
}

static void test_old_twists_fade_where_single_precision_ends(void) {
    // GIVEN sums at 2^24, and beyond
    bench_t bench;
    begin(&bench, 10);
    hexload_attenuation_t* self = &bench.estimator.filter.attenuation;
    self->square[0] = HEXLOAD_REAL(16777216.0);
    self->error[0] = HEXLOAD_REAL(1000.0);
    self->square[2] = HEXLOAD_REAL(2e7);
    self->error[2] = HEXLOAD_REAL(8e6);
    // WHEN products have been seen to
    self->calls = 3 * 20 - 1;
    end_round(&bench, 0.0, 0.0);
    // THEN what is beyond has half of both
    TEST_ASSERT_TRUE(self->square[0] == HEXLOAD_REAL(16777216.0) && self->error[0] == HEXLOAD_REAL(1000.0));
    TEST_ASSERT_TRUE(self->square[2] == HEXLOAD_REAL(1e7) && self->error[2] == HEXLOAD_REAL(4e6));
}

static void test_what_is_faster_than_the_smoother_follows_is_no_noise(void) {
    // GIVEN a platform that turns, and is turned by a shock that only one of both twists has
    bench_t bench;
    begin(&bench, 9);
    turn(&bench, 2.0, 0.0, 400);
    hexload_attenuation_t* self = &bench.estimator.filter.attenuation;
    const uint32_t calls = self->calls;
    const hexload_real_t square = self->square[1];
    const hexload_real_t error = self->error[1];
    // WHEN two rounds go by
    for (int n = 0; n < 60; n++) {
        bench.estimator.filter.smooth_twist[4] = HEXLOAD_REAL(1.0);
        bench.past.motion.twist[4] = HEXLOAD_REAL(0.0);
        step(&bench);
    }
    // THEN nothing of it is in the sums
    TEST_ASSERT_TRUE(self->calls != calls);
    TEST_ASSERT_TRUE(self->square[1] == square && self->error[1] == error);
}

static void test_a_height_is_open_where_neither_turning_nor_shift_is_certain(void) {
    // GIVEN a platform that heaves and, as legs sampled at other instants make it seem, moves a little
    const double twist[6] = {1e-4, 1e-4, 0.3, 2e-4, 2e-4, 2e-4};
    const double acceleration[6] = {0.0, 0.0, 3.0, 0.0, 0.0, 0.0};
    bench_t bench;
    begin(&bench, 7);
    bench.config.momentum.timing_s = HEXLOAD_REAL(0.5e-3);
    bench.estimator.filter.theta[HEXLOAD_LOAD_M] = HEXLOAD_REAL(600.0);
    move(&bench, twist, acceleration, ROUNDS_TICKS);
    TEST_ASSERT_TRUE(added(&bench, HEXLOAD_LOAD_HZ) > 0.9 * 600.0 * arm_m(&bench));
    // WHEN it moves along x as it heaves, for as long THEN the height of the centre of mass is known
    const double shift[6] = {0.3, 0.0, 0.3, 2e-4, 2e-4, 2e-4};
    move(&bench, shift, acceleration, ROUNDS_TICKS);
    forget_factors(&bench);
    move(&bench, shift, acceleration, ROUNDS_TICKS);
    TEST_ASSERT_TRUE(added(&bench, HEXLOAD_LOAD_HZ) < 0.01 * 600.0 * arm_m(&bench));
    // AND moments are as open as before
    TEST_ASSERT_TRUE(added(&bench, HEXLOAD_LOAD_IYY) > 0.9 * OWN_AND_LOAD);
}

static void test_of_legs_that_are_sampled_together_nothing_is_open(void) {
    // GIVEN exact instants WHEN a platform heaves and hardly turns THEN no sigma changes
    const double twist[6] = {1e-4, 1e-4, 0.3, 2e-4, 2e-4, 2e-4};
    const double acceleration[6] = {0.0, 0.0, 3.0, 0.0, 0.0, 0.0};
    bench_t bench;
    begin(&bench, 8);
    move(&bench, twist, acceleration, ROUNDS_TICKS);
    for (int k = 0; k < HEXLOAD_LOAD_DIM; k++) {
        TEST_ASSERT_TRUE(kept(&bench, k) == 1.0);
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_noise_taken_for_a_turning_widens_moments_by_its_share);
    RUN_TEST(test_a_true_turning_hardly_ever_widens_sigma);
    RUN_TEST(test_noise_alone_is_no_more_than_all_of_the_moment);
    RUN_TEST(test_what_other_misfits_have_widened_is_not_widened_twice);
    RUN_TEST(test_a_displacement_that_is_bridged_says_nothing);
    RUN_TEST(test_a_turning_that_late_legs_may_have_made_leaves_inertias_and_height_open);
    RUN_TEST(test_noise_and_late_legs_add_up);
    RUN_TEST(test_old_twists_fade_where_single_precision_ends);
    RUN_TEST(test_what_is_faster_than_the_smoother_follows_is_no_noise);
    RUN_TEST(test_a_height_is_open_where_neither_turning_nor_shift_is_certain);
    RUN_TEST(test_of_legs_that_are_sampled_together_nothing_is_open);
    return UNITY_END();
}
