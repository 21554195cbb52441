#include "momentum/leg_or_weight.h"
#include "textbook.h"

#include "motion.h"

#include <math.h>
#include <string.h>

void setUp(void) {}
void tearDown(void) {}

enum { DIM = HEXLOAD_LOAD_DIM };

#define KEPT (0.2 / 1.8) ///< of a mean of a fifth a tick
#define LEAST_ODDS 6.0   ///< as load_monitor.c has it

/// A platform with a load, in some pose, and what acts on it beside that load.
typedef struct bench {
    scene_t scene;
    hexload_present_tick_t now;
    double body[DIM], pull[3], wrench[6]; ///< about O_A
} bench_t;

static void begin(bench_t* bench, uint64_t* seed, uint32_t tick) {
    static const double body[DIM] = {500, 20, -15, 120, 80, 70, 60, 3, -4, 5};
    memset(bench, 0, sizeof *bench);
    scene_at(&bench->scene, tick);
    bench->now.motion = &bench->scene.motion;
    bench->now.sample = &bench->scene.sample;
    bench->now.sensors = bench->scene.config.sensors;
    memcpy(bench->body, body, sizeof body);
    for (int k = 0; k < 3; k++) {
        bench->pull[k] = (k == 2 ? 9.81 : 0.0) + 2.0 * uniform(seed);
    }
}

static hexload_explained_t explain(const bench_t* bench) {
    hexload_real_t wrench[6], pull[3], body[DIM];
    hexload_explained_t explained;
    for (int k = 0; k < 6; k++) {
        wrench[k] = (hexload_real_t)bench->wrench[k];
    }
    for (int k = 0; k < 3; k++) {
        pull[k] = (hexload_real_t)bench->pull[k];
    }
    for (int k = 0; k < DIM; k++) {
        body[k] = (hexload_real_t)bench->body[k];
    }
    const hexload_missing_t missing = {
        .wrench = wrench, .pull_m_s2 = pull, .body = body, .kept = (hexload_real_t)KEPT};
    hexload_explain_missing(&bench->scene.config, &bench->now, &missing, &explained);
    return explained;
}

static double odds_of(const bench_t* bench) {
    const hexload_explained_t explained = explain(bench);
    return 0.5 * ((double)explained.by_weight - (double)explained.by_leg);
}

/// A wrench about O_A as one about the home point, base axes, or with side -1 the other way.
static void move_point(const bench_t* bench, double side, const double wrench[6], double moved[6]) {
    double p[3], moment[3];
    for (int k = 0; k < 3; k++) {
        p[k] = (double)bench->scene.motion.p_m[k];
    }
    cross(p, wrench, moment);
    for (int k = 0; k < 3; k++) {
        moved[k] = wrench[k];
        moved[3 + k] = wrench[3 + k] + side * moment[k];
    }
}

/// w^T N W (W^T N W)^-1 W^T N w, N the inverse of the noise's covariance.
static double explained(const double w[6], double N[6][6], double W[3][6], int columns) {
    double right[3], left[9], inverse[9], sum = 0.0;
    for (int n = 0; n < columns; n++) {
        right[n] = 0.0;
        for (int m = 0; m < columns; m++) {
            left[n * columns + m] = 0.0;
        }
        for (int a = 0; a < 6; a++) {
            for (int b = 0; b < 6; b++) {
                right[n] += W[n][a] * N[a][b] * w[b];
                for (int m = 0; m < columns; m++) {
                    left[n * columns + m] += W[n][a] * N[a][b] * W[m][b];
                }
            }
        }
    }
    invert(left, columns, inverse);
    for (int n = 0; n < columns; n++) {
        for (int m = 0; m < columns; m++) {
            sum += right[n] * inverse[n * columns + m] * right[m];
        }
    }
    return sum;
}

/// Momenta, or wrenches, of the legs' unit speeds and of unit forces; rows are legs.
static void legs_of(const bench_t* bench, double of_speeds[6][6], double of_forces[6][6]) {
    double momenta[6][6], pushes[6][6];
    momenta_of_legs(bench->now.motion, bench->body, momenta);
    pushes_of(bench->now.motion, pushes);
    for (int leg = 0; leg < 6; leg++) {
        for (int k = 0; k < 6; k++) {
            of_speeds[leg][k] = momenta[k][leg];
            of_forces[leg][k] = pushes[k][leg];
        }
    }
}

/// J M^-1, of which momenta of unit speeds are the inverse, and the variance of a leg's noise.
static double legs_of_wrench(const bench_t* bench, double to_legs[6][6]) {
    double momenta[6][6], pushes[6][6], squares = 0.0;
    const double tick_s = (double)bench->scene.config.tick_s;
    momenta_of_legs(bench->now.motion, bench->body, momenta);
    invert(&momenta[0][0], 6, &to_legs[0][0]);
    pushes_of(bench->now.motion, pushes);
    for (int leg = 0; leg < 6; leg++) {
        for (int other = 0; other < 6; other++) {
            double sum = 0.0;
            for (int k = 0; k < 6; k++) {
                sum += to_legs[leg][k] * pushes[k][other];
            }
            squares += sum * sum;
        }
    }
    return KEPT * pow((double)bench->now.sensors.velocity_sigma_m_s / 0.02, 2.0) +
           tick_s / (2.0 * 0.02 - tick_s) * pow((double)bench->now.sensors.force_sigma_n, 2.0) * squares /
               6.0;
}

/// N, with w^T N w = y^T y / s^2.
static void weigh(const bench_t* bench, double N[6][6]) {
    double to_legs[6][6];
    const double variance = legs_of_wrench(bench, to_legs);
    for (int a = 0; a < 6; a++) {
        for (int b = 0; b < 6; b++) {
            N[a][b] = 0.0;
            for (int leg = 0; leg < 6; leg++) {
                N[a][b] += to_legs[leg][a] * to_legs[leg][b] / variance;
            }
        }
    }
}

typedef struct expected {
    double whole, by_weight, by_leg;
} expected_t;

static expected_t expect(const bench_t* bench) {
    double N[6][6], of_speeds[6][6], of_forces[6][6], w[6], weights[3][6];
    expected_t expected = {0.0, 0.0, 0.0};
    weigh(bench, N);
    move_point(bench, 1.0, bench->wrench, w);
    legs_of(bench, of_speeds, of_forces);
    for (int n = 0; n < 6; n++) {
        expected.by_leg = fmax(expected.by_leg, explained(w, N, &of_speeds[n], 1));
        expected.by_leg = fmax(expected.by_leg, explained(w, N, &of_forces[n], 1));
        for (int m = 0; m < 6; m++) {
            expected.whole += w[n] * N[n][m] * w[m];
        }
    }
    for (int n = 0; n < 3; n++) { // of a mass at O_A, and of what moves it by a metre to x or y
        const double to[3] = {n == 1, n == 2, 0};
        double of_mass[6] = {0};
        memcpy(of_mass, n == 0 ? bench->pull : of_mass, 3 * sizeof of_mass[0]);
        cross(to, bench->pull, &of_mass[3]);
        move_point(bench, 1.0, of_mass, weights[n]);
    }
    expected.by_weight = explained(w, N, weights, 3);
    return expected;
}

/// A wrench about the home point is missing.
static void miss(bench_t* bench, const double wrench[6], double size) {
    double scaled[6];
    for (int k = 0; k < 6; k++) {
        scaled[k] = size * wrench[k];
    }
    move_point(bench, -1.0, scaled, bench->wrench);
}

static void test_what_is_explained_is_that_of_the_equations(void) {
    // GIVEN poses, loads, accelerations and wrenches of all kinds WHEN a weight is held against a leg THEN
    // both explain what least squares do
    uint64_t seed = 61;
    for (uint32_t trial = 0; trial < 300; trial++) {
        bench_t bench;
        begin(&bench, &seed, 100 + trial);
        for (int k = 0; k < 6; k++) {
            bench.wrench[k] = (k < 3 ? 100.0 : 30.0) * uniform(&seed);
        }
        const expected_t expected = expect(&bench);
        const hexload_explained_t found = explain(&bench);
        // the inertia's condition is some 1e3: of all six directions so many roundings
        const double within = ROUNDINGS(2e4, 1.0 + expected.whole);
        TEST_ASSERT_DOUBLE_WITHIN(within, expected.whole, (double)found.whole);
        TEST_ASSERT_DOUBLE_WITHIN(within, expected.by_weight, (double)found.by_weight);
        TEST_ASSERT_DOUBLE_WITHIN(within, expected.by_leg, (double)found.by_leg);
    }
}

static void assert_explained_by_a_leg(const bench_t* bench) {
    const hexload_explained_t found = explain(bench);
    TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(2e4, 1.0 + (double)found.whole), (double)found.whole,
                              (double)found.by_leg);
    TEST_ASSERT_TRUE(odds_of(bench) < LEAST_ODDS);
}

static void test_a_weight_is_none_of_a_leg_and_a_sensor_that_is_off_is_no_weight(void) {
    // GIVEN noise of the stated sigmas WHEN 15 kg come somewhere on the platform, also above a hinge, where
    // a leg explains all but one in a hundred of them THEN a weight is likelier; WHEN one leg's force, or
    // speed, is off THEN that leg explains all
    uint64_t seed = 62;
    for (uint32_t trial = 0; trial < 300; trial++) {
        bench_t bench;
        begin(&bench, &seed, 100 + trial);
        const double to[3] = {0.3 * uniform(&seed), 0.3 * uniform(&seed), 0.3 * uniform(&seed)};
        double of_mass[6], at_home[6], of_speeds[6][6], of_forces[6][6];
        memcpy(of_mass, bench.pull, sizeof bench.pull);
        cross(to, bench.pull, &of_mass[3]);
        move_point(&bench, 1.0, of_mass, at_home);
        miss(&bench, at_home, trial % 2 ? 15.0 : -15.0);
        TEST_ASSERT_TRUE(odds_of(&bench) > LEAST_ODDS);
        legs_of(&bench, of_speeds, of_forces);
        miss(&bench, of_forces[trial % 6], trial % 2 ? 60.0 : -60.0);
        assert_explained_by_a_leg(&bench);
        miss(&bench, of_speeds[trial % 6], (trial % 2 ? 0.003 : -0.003) / 0.02);
        assert_explained_by_a_leg(&bench);
    }
}

static void test_noise_of_speeds_has_as_many_squares_as_legs(void) {
    // GIVEN wrenches that are noise of speeds, and forces without any WHEN they are explained THEN their
    // square has a mean of 6, with a standard deviation of sqrt(12 / 2000) = 0.08, and weights explain 3 of
    // it
    uint64_t seed = 63;
    double whole = 0.0, by_weight = 0.0;
    enum { TRIALS = 2000 };
    for (uint32_t trial = 0; trial < TRIALS; trial++) {
        bench_t bench;
        double of_speeds[6][6], of_forces[6][6], w[6] = {0};
        begin(&bench, &seed, 100 + trial);
        bench.now.sensors.force_sigma_n = HEXLOAD_REAL(0.0);
        legs_of(&bench, of_speeds, of_forces);
        const double rate = sqrt(KEPT) * (double)bench.now.sensors.velocity_sigma_m_s / 0.02;
        for (int leg = 0; leg < 6; leg++) {
            const double speed = rate * normal(&seed);
            for (int k = 0; k < 6; k++) {
                w[k] += speed * of_speeds[leg][k];
            }
        }
        miss(&bench, w, 1.0);
        const hexload_explained_t found = explain(&bench);
        whole += (double)found.whole / TRIALS;
        by_weight += (double)found.by_weight / TRIALS;
    }
    TEST_ASSERT_DOUBLE_WITHIN(5.0 * 0.08, 6.0, whole);
    TEST_ASSERT_DOUBLE_WITHIN(5.0 * 0.06, 3.0, by_weight);
}

static void test_of_a_body_that_no_mass_has_nothing_is_explained(void) {
    // GIVEN numbers that no body has, as an estimate may in its first ticks WHEN a wrench is missing THEN all
    // is not a number, and no comparison with it holds
    uint64_t seed = 65;
    bench_t bench;
    begin(&bench, &seed, 150);
    bench.body[0] = -100.0;
    bench.wrench[2] = 50.0;
    const hexload_explained_t found = explain(&bench);
    TEST_ASSERT_TRUE(isnan((double)found.whole));
    TEST_ASSERT_TRUE(isnan((double)found.by_leg));
    TEST_ASSERT_TRUE(isnan((double)found.by_weight));
}

static void test_without_gravity_and_acceleration_nothing_is_a_weight(void) {
    // GIVEN a platform that nothing pulls or moves WHEN a wrench is missing THEN no weight explains it
    uint64_t seed = 64;
    bench_t bench;
    begin(&bench, &seed, 150);
    memset(bench.pull, 0, sizeof bench.pull);
    bench.wrench[2] = 50.0;
    TEST_ASSERT_TRUE(odds_of(&bench) < 0.0);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_what_is_explained_is_that_of_the_equations);
    RUN_TEST(test_a_weight_is_none_of_a_leg_and_a_sensor_that_is_off_is_no_weight);
    RUN_TEST(test_noise_of_speeds_has_as_many_squares_as_legs);
    RUN_TEST(test_of_a_body_that_no_mass_has_nothing_is_explained);
    RUN_TEST(test_without_gravity_and_acceleration_nothing_is_a_weight);
    return UNITY_END();
}
