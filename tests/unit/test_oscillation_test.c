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

static void test_pairs_of_half_seconds_are_judged_by_their_difference_and_by_all_that_lasts(void) {
    // GIVEN loads with half seconds of noise, of what lasts, of what swings and of what directions do, in a
    // memory that was used before
    uint64_t seed = 91;
    int seen[2] = {0, 0};
    for (int load = 0; load < 40; load++) {
        bench_t bench;
        double swinging = 0.0, lasting = 0.0, sum[2][6], shown[2][TESTED][6];
        begin(&bench);
        // WHEN the first, which has the shock of a change in it, and pairs of them have gone by
        for (int a = 0; a < 6; a++) {
            sum[0][a] = 1e4;
        }
        show(&bench, sum[0], NULL);
        for (int pair = 1; pair <= 8; pair++) {
            const double size = 150.0 * pow(uniform(&seed), 2.0);
            const bool turns = uniform(&seed) > (load % 4 < 2 ? 0.9 : -0.9);
            for (int half = 0; half < 2; half++) {
                for (int a = 0; a < 6; a++) {
                    const double turned = turns ? -1.0 : 1.0;
                    sum[half][a] =
                        (half == 1 ? turned * sum[0][a] : size * normal(&seed)) + 20.0 * normal(&seed);
                    for (int n = 0; n < TESTED; n++) {
                        shown[half][n][a] = load % 2 == 0 ? 0.0 : 15.0 * normal(&seed);
                    }
                }
                show(&bench, sum[half], (const double(*)[6])shown[half]);
            }
            // THEN sums are those of the equations, from 0 up, and it swings where three pairs do so, by more
            // than chance and than what lasts
            swinging = fmax(0.0, 0.9 * swinging + square_of_swing((const double(*)[6])sum, shown) - 9.0);
            lasting = 0.9 * lasting + square_of_both((const double(*)[6])sum);
            TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(300, 10.0 + swinging), swinging, (double)bench.self.swinging);
            TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(300, 10.0 + lasting), lasting, (double)bench.self.lasting);
            const double least = fmax(60.0, 2.0 * lasting);
            if (fabs(swinging - least) > 0.01 * least) {
                TEST_ASSERT_EQUAL_INT(pair >= 3 && swinging > least, bench.self.is_there);
                seen[bench.self.is_there]++;
            }
        }
    }
    TEST_ASSERT_GREATER_THAN_INT(30, seen[0]);
    TEST_ASSERT_GREATER_THAN_INT(30, seen[1]);
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

static void test_noise_and_slow_errors_do_not_swing_and_what_turns_within_a_second_does(void) {
    // GIVEN innovations of noise WHEN a quarter of an hour goes by THEN nothing swings
    uint64_t seed = 92;
    TEST_ASSERT_EQUAL_DOUBLE(-1.0, first_said_s(0.0, 1.0, 900.0, &seed));
    // NOR where an error of half a sigma follows a motion of 5 s
    TEST_ASSERT_EQUAL_DOUBLE(-1.0, first_said_s(0.5, 0.2, 60.0, &seed));
    // AND one of 0.8 Hz, of which the halves of a second have some 400 of squares, is said after the first
    // half second and three pairs
    TEST_ASSERT_DOUBLE_WITHIN(1.5, 4.0, first_said_s(0.5, 0.8, 60.0, &seed));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_pairs_of_half_seconds_are_judged_by_their_difference_and_by_all_that_lasts);
    RUN_TEST(test_noise_and_slow_errors_do_not_swing_and_what_turns_within_a_second_does);
    return UNITY_END();
}
