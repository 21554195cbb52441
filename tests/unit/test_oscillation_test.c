#include "momentum/oscillation_test.h"
#include "front_end/residual_test.h"
#include "textbook.h"

#include <math.h>
#include <string.h>

void setUp(void) {}
void tearDown(void) {}

enum { BLOCK_TICKS = 500, TESTED = HEXLOAD_RIG_DIRECTIONS_MAX };

typedef struct bench {
    hexload_oscillation_test_t self;
    hexload_consider_t consider;
} bench_t;

static void begin(bench_t* bench) {
    memset(bench, 0xFF, sizeof *bench);
    hexload_oscillation_test_init(&bench->self);
}

/// A half second with these sums; directions have added theirs to what was there.
static void show(bench_t* bench, const double sum[6], const double shown[TESTED][6]) {
    hexload_residual_test_t residual = {.ticks = BLOCK_TICKS - 1};
    hexload_real_t last[6];
    for (int a = 0; a < 6; a++) {
        last[a] = (hexload_real_t)(0.1 * sum[a]);
        residual.sum[a] = (hexload_real_t)(0.9 * sum[a]);
        for (int n = 0; n < TESTED && shown != NULL; n++) {
            bench->consider.shown[n][a] += (hexload_real_t)shown[n][a];
        }
    }
    hexload_oscillation_test_step(&bench->self, &bench->consider, &residual, last);
}

/// Squares of the difference of two halves, less what the directions may do.
static double square_of_swing(const double sum[2][6], double shown[2][TESTED][6]) {
    double covariance[36], inverse[36], square = 0.0;
    for (int a = 0; a < 6; a++) {
        for (int b = 0; b < 6; b++) {
            covariance[6 * a + b] = a == b ? 2.0 * BLOCK_TICKS : 0.0;
            for (int n = 0; n < TESTED; n++) {
                covariance[6 * a + b] +=
                    (shown[1][n][a] - shown[0][n][a]) * (shown[1][n][b] - shown[0][n][b]);
            }
        }
    }
    invert(covariance, 6, inverse);
    for (int a = 0; a < 6; a++) {
        for (int b = 0; b < 6; b++) {
            square += (sum[1][a] - sum[0][a]) * inverse[6 * a + b] * (sum[1][b] - sum[0][b]);
        }
    }
    return square;
}

static double square_of_both(const double sum[2][6]) {
    double square = 0.0;
    for (int a = 0; a < 6; a++) {
        square += pow(sum[0][a] + sum[1][a], 2.0) / (2.0 * BLOCK_TICKS);
    }
    return square;
}

/// Two half seconds of noise and of an error that lasts or turns; each direction shows something, or nothing.
static void draw_pair(double size, bool turns, double shown_size, uint64_t* seed, double sum[2][6],
                      double shown[2][TESTED][6]) {
    for (int half = 0; half < 2; half++) {
        for (int a = 0; a < 6; a++) {
            const double error = half == 0 ? size * normal(seed) : (turns ? -1.0 : 1.0) * sum[0][a];
            sum[half][a] = error + 20.0 * normal(seed);
            for (int n = 0; n < TESTED; n++) {
                shown[half][n][a] = shown_size * normal(seed);
            }
        }
    }
}

static void test_pairs_of_half_seconds_are_judged_by_their_difference_and_by_all_that_lasts(void) {
    // GIVEN loads with half seconds of noise, of what lasts, of what swings and of what directions do, in a
    // memory that was used before
    uint64_t seed = 91;
    int seen[2] = {0, 0};
    for (int load = 0; load < 40; load++) {
        bench_t bench;
        double swinging[2] = {0.0, 0.0}, lasting[2] = {0.0, 0.0}, sum[2][6], shown[2][TESTED][6];
        const double apart[6] = {1e4, 1e4, 1e4, 1e4, 1e4, 1e4};
        bool swings = false;
        begin(&bench);
        // WHEN the first, which has the shock of a change in it, and pairs have gone by, of which each other
        // one has a half second between it that counts in neither
        show(&bench, apart, NULL);
        for (int pair = 0; pair < 16; pair++) {
            const int lag = pair % 2;
            const bool turns = uniform(&seed) > (load % 4 < 2 ? 0.9 : -0.9);
            draw_pair(150.0 * pow(uniform(&seed), 2.0), turns, load % 2 == 0 ? 0.0 : 15.0, &seed, sum, shown);
            show(&bench, sum[0], (const double(*)[6])shown[0]);
            TEST_ASSERT_EQUAL_INT(lag == 1, bench.consider.is_paused);
            if (lag == 1) {
                show(&bench, apart, NULL);
            }
            TEST_ASSERT_FALSE(bench.consider.is_paused);
            show(&bench, sum[1], (const double(*)[6])shown[1]);
            // THEN sums are those of the equations, from 0 up, and it swings where three pairs of a kind do
            // so, by more than chance and than what lasts, and goes on to until what swings is chance
            const double square = square_of_swing((const double(*)[6])sum, shown);
            swinging[lag] = fmax(0.0, 0.9 * swinging[lag] + square - 9.0);
            lasting[lag] = 0.9 * lasting[lag] + square_of_both((const double(*)[6])sum);
            TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(300, 10.0 + swinging[lag]), swinging[lag],
                                      (double)bench.self.swinging[lag]);
            TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(300, 10.0 + lasting[lag]), lasting[lag],
                                      (double)bench.self.lasting[lag]);
            const double share = swings ? 0.0 : 1.2;
            const bool near = pair >= 4 && swinging[0] > fmax(60.0, share * lasting[0]);
            const bool far = pair >= 5 && swinging[1] > fmax(60.0, share * lasting[1]);
            swings = near || far;
            TEST_ASSERT_EQUAL_INT(swings, bench.self.is_there);
            seen[bench.self.is_there]++;
        }
    }
    TEST_ASSERT_GREATER_THAN_INT(100, seen[0]);
    TEST_ASSERT_GREATER_THAN_INT(100, seen[1]);
}

static void test_what_swings_is_a_fifth_more_than_what_lasts(void) {
    // GIVEN half seconds of which one component has 1000 together in each pair, squares of 1000 over all
    // ticks, and differs by as much as 9 and 1.1 or 1.3 times that make WHEN three pairs of each kind have
    // gone by THEN the latter swing
    for (int n = 0; n < 2; n++) {
        const double both = 1000.0, difference = 1000.0 * sqrt(n == 0 ? 1.109 : 1.309);
        const double first[6] = {0.0, 0.0, 0.0, 0.5 * (both - difference)};
        const double second[6] = {0.0, 0.0, 0.0, 0.5 * (both + difference)};
        bench_t bench;
        begin(&bench);
        show(&bench, first, NULL);
        memset(&bench.consider, 0, sizeof bench.consider);
        for (int round = 0; round < 3; round++) {
            TEST_ASSERT_FALSE(bench.self.is_there);
            show(&bench, first, NULL);
            show(&bench, second, NULL);
            show(&bench, first, NULL);
            show(&bench, first, NULL);
            show(&bench, second, NULL);
        }
        TEST_ASSERT_EQUAL_INT(n, bench.self.is_there);
    }
}

/// Seconds of innovations with an amplitude at a frequency. Returns when it was first said, or -1.
static double first_said_s(double amplitude, double hz, double seconds, uint64_t* seed) {
    const hexload_config_t config = paper_machine();
    hexload_residual_test_t residual;
    bench_t bench;
    begin(&bench);
    memset(&bench.consider, 0, sizeof bench.consider);
    hexload_residual_test_init(&residual, 6);
    for (int tick = 0; tick < (int)(seconds * 1000.0); tick++) {
        hexload_real_t innovation[6];
        for (int a = 0; a < 6; a++) {
            const double swing = a == 2 ? amplitude * sin(6.2831853 * hz * tick * 1e-3 + 1.0) : 0.0;
            innovation[a] = (hexload_real_t)(normal(seed) + swing);
        }
        if (hexload_residual_test_ends(&residual, &config)) {
            hexload_oscillation_test_step(&bench.self, &bench.consider, &residual, innovation);
        }
        hexload_residual_test_step(&residual, &config, innovation, true);
        if (bench.self.is_there) {
            return tick * 1e-3;
        }
    }
    return -1.0;
}

static void test_noise_and_slow_errors_do_not_swing_and_what_turns_within_two_seconds_does(void) {
    // GIVEN innovations of noise WHEN a quarter of an hour goes by THEN nothing swings
    uint64_t seed = 92;
    TEST_ASSERT_EQUAL_DOUBLE(-1.0, first_said_s(0.0, 1.0, 900.0, &seed));
    // NOR where an error of half a sigma follows a motion of 5 s
    TEST_ASSERT_EQUAL_DOUBLE(-1.0, first_said_s(0.5, 0.2, 60.0, &seed));
    // AND one of 0.9 or of 0.45 Hz is said after the first half second and three rounds of two and a half
    TEST_ASSERT_DOUBLE_WITHIN(1.5, 7.0, first_said_s(0.5, 0.9, 60.0, &seed));
    TEST_ASSERT_DOUBLE_WITHIN(1.5, 7.0, first_said_s(0.5, 0.45, 60.0, &seed));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_pairs_of_half_seconds_are_judged_by_their_difference_and_by_all_that_lasts);
    RUN_TEST(test_what_swings_is_a_fifth_more_than_what_lasts);
    RUN_TEST(test_noise_and_slow_errors_do_not_swing_and_what_turns_within_two_seconds_does);
    return UNITY_END();
}
