#include "momentum/transient.h"
#include "algebra/linalg.h"
#include "machine.h"

#include <math.h>
#include <string.h>

void setUp(void) {}
void tearDown(void) {}

enum { TICKS = HEXLOAD_TRANSIENT_TICKS, NARROW_TICKS = 6, CAPACITY = HEXLOAD_DELAY_CAPACITY };

/// Value at 0 of the parabola that fits the ticks 1..n on both sides best, and its variance in those of a
/// tick: the normal equations of a + c j^2, solved by Cramer's rule; the linear part is odd and takes no
/// part.
static double parabola(const hexload_smoother_t* smoother, uint32_t place, int leg, int n, double* variance) {
    double ones = 0.0, second = 0.0, fourth = 0.0, sum = 0.0, moment = 0.0;
    for (int j = 1; j <= n; j++) {
        const double square = (double)(j * j);
        const double pair = (double)smoother->velocity_m_s[(place + (uint32_t)j) % CAPACITY][leg] +
                            (double)smoother->velocity_m_s[(place + CAPACITY - (uint32_t)j) % CAPACITY][leg];
        ones += 2.0;
        second += 2.0 * square;
        fourth += 2.0 * square * square;
        sum += pair;
        moment += square * pair;
    }
    const double determinant = ones * fourth - second * second;
    *variance = fourth / determinant;
    return (fourth * sum - second * moment) / determinant;
}

typedef struct expected {
    double velocity_m_s[HEXLOAD_LEGS];
    bool is_transient;
    bool is_close; ///< to a limit: rounding decides
} expected_t;

static void shrink(const double seen_m_s[HEXLOAD_LEGS], double least, expected_t* expected) {
    double square = 0.0;
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        square += pow(seen_m_s[leg] - expected->velocity_m_s[leg], 2.0);
    }
    expected->is_close = expected->is_close || fabs(square / least - 1.0) < 1e-3;
    if (square > least) {
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            expected->velocity_m_s[leg] +=
                (1.0 - least / square) * (seen_m_s[leg] - expected->velocity_m_s[leg]);
        }
        expected->is_transient = true;
    }
}

/// As transient.h says, from a smoother that is at its start or has a full window.
static expected_t expect(const hexload_smoother_t* smoother, uint32_t place, double sigma_m_s, bool is_full,
                         const hexload_real_t velocity_m_s[HEXLOAD_LEGS]) {
    expected_t expected = {{0}, false, false};
    double wide[HEXLOAD_LEGS], narrow[HEXLOAD_LEGS];
    double by_wide = 0.0, by_narrow = 0.0, wide_variance = 0.0, narrow_variance = 0.0;
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        wide[leg] = parabola(smoother, place, leg, TICKS, &wide_variance);
        narrow[leg] = parabola(smoother, place, leg, NARROW_TICKS, &narrow_variance);
        expected.velocity_m_s[leg] = (double)velocity_m_s[leg];
        by_wide += pow(wide[leg] - expected.velocity_m_s[leg], 2.0);
        by_narrow += pow(narrow[leg] - wide[leg], 2.0);
    }
    // the wide window counts where it explains more than it leaves to the narrow one
    expected.is_close = fabs(by_narrow / by_wide - 1.0) < 1e-3;
    if (by_narrow < by_wide) {
        shrink(wide, 22.46 * wide_variance * sigma_m_s * sigma_m_s, &expected);
    }
    shrink(narrow, (is_full ? 600.0 : 22.46) * narrow_variance * sigma_m_s * sigma_m_s, &expected);
    return expected;
}

/// A ring of speeds around `place`: smooth ones as large as `slow`, faster ones, and noise of sigma.
static void fill(hexload_smoother_t* smoother, uint32_t place, double slow, double fast, double sigma_m_s,
                 uint64_t* seed) {
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        const double height = slow * uniform(seed), bend = slow * uniform(seed), peak = fast * uniform(seed);
        for (int j = -TICKS; j <= TICKS; j++) {
            const uint32_t at = (place + CAPACITY + (uint32_t)j) % CAPACITY;
            smoother->velocity_m_s[at][leg] =
                (hexload_real_t)(height + bend * j / 20.0 + bend * j * j / 200.0 + peak * exp(-j * j / 16.0) +
                                 sigma_m_s * normal(seed));
        }
    }
}

static void test_speeds_follow_the_parabolas_as_far_as_they_stand_out_of_noise(void) {
    // GIVEN speeds that are slow, fast or noise, in sizes from below to far above sigma, at every place of
    // the ring, with a full window of displacements and before
    uint64_t seed = 3;
    int transients = 0, judged = 0;
    for (uint32_t trial = 0; trial < 4000; trial++) {
        hexload_smoother_t smoother;
        memset(&smoother, 0, sizeof smoother);
        const uint32_t place = trial % CAPACITY;
        const bool is_full = trial % 2 == 0;
        const double sigma_m_s = trial % 3 == 0 ? 1e-3 : 0.2;
        hexload_real_t velocity_m_s[HEXLOAD_LEGS];
        smoother.constants.lag_ticks = 60;
        smoother.entered = is_full ? 121 : 120;
        fill(&smoother, place, sigma_m_s * pow(10.0, 1.5 * uniform(&seed)),
             sigma_m_s * pow(10.0, 2.0 * uniform(&seed)), sigma_m_s, &seed);
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            velocity_m_s[leg] = (hexload_real_t)(sigma_m_s * uniform(&seed));
        }
        const expected_t expected = expect(&smoother, place, sigma_m_s, is_full, velocity_m_s);
        // WHEN the smooth speeds of the tick follow them
        hexload_transient_follow(&smoother, place, (hexload_real_t)sigma_m_s, velocity_m_s);
        if (expected.is_close) {
            continue;
        }
        // THEN they are those of parabolas that were fitted one by one, and the tick counts as a transient
        // when something was kept. Printed weights have eight decimals: over 24 ticks of 100 sigma and more,
        // up to j^2 = 144, they are off by 24 * 144 * 5e-9
        const double largest = 200.0 * sigma_m_s;
        judged++;
        transients += expected.is_transient;
        TEST_ASSERT_EQUAL_INT(expected.is_transient, smoother.transient_ticks);
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            TEST_ASSERT_DOUBLE_WITHIN((24 * 144 * 5e-9 + ROUNDINGS(40, 1.0)) * largest,
                                      expected.velocity_m_s[leg], (double)velocity_m_s[leg]);
        }
    }
    TEST_ASSERT_GREATER_THAN_INT(1000, transients);
    TEST_ASSERT_GREATER_THAN_INT(300, judged - transients);
}

static void test_nothing_is_added_where_one_of_the_ticks_around_is_left_out(void) {
    // GIVEN a clear transient, and one tick that is missing, nearer than the windows reach or just beyond
    for (int j = -TICKS - 1; j <= TICKS + 1; j++) {
        hexload_smoother_t smoother;
        uint64_t seed = 4;
        hexload_real_t velocity_m_s[HEXLOAD_LEGS] = {0};
        memset(&smoother, 0, sizeof smoother);
        smoother.constants.lag_ticks = 60;
        fill(&smoother, 1, 1.0, 1.0, 0.0, &seed);
        const uint32_t missing = (1 + CAPACITY + (uint32_t)j) % CAPACITY;
        smoother.left_out[missing / 32] = (uint32_t)1 << missing % 32;
        // WHEN the speeds follow THEN they stay as they are, but for the tick itself, which takes no part,
        // and for one beyond
        hexload_transient_follow(&smoother, 1, HEXLOAD_REAL(1e-3), velocity_m_s);
        const bool is_followed = j == 0 || j < -TICKS || j > TICKS;
        TEST_ASSERT_EQUAL_INT(is_followed, smoother.transient_ticks);
        TEST_ASSERT_EQUAL_INT(is_followed, velocity_m_s[0] != HEXLOAD_REAL(0.0));
    }
}

/// Follows for so many ticks, of a transient or of nothing. @return the ticks that moved the speeds.
static int follow(hexload_smoother_t* smoother, int ticks, bool is_transient) {
    int moved = 0;
    for (int tick = 0; tick < ticks; tick++) {
        hexload_real_t velocity_m_s[HEXLOAD_LEGS] = {0};
        uint64_t seed = 5;
        fill(smoother, 20, is_transient, is_transient, 0.0, &seed);
        hexload_transient_follow(smoother, 20, HEXLOAD_REAL(1e-3), velocity_m_s);
        moved += velocity_m_s[0] != HEXLOAD_REAL(0.0);
    }
    return moved;
}

static void test_a_servo_that_rings_on_is_followed_for_four_lags(void) {
    // GIVEN a lag of 12 ticks WHEN there is a transient for 200 ticks THEN the first 4 * 12 are followed
    hexload_smoother_t smoother;
    memset(&smoother, 0, sizeof smoother);
    smoother.constants.lag_ticks = 12;
    TEST_ASSERT_EQUAL_INT(48, follow(&smoother, 200, true));
    // AND after it, as it counts up to twice as many, once it has been calm for 48 ticks and one more
    TEST_ASSERT_EQUAL_INT(0, follow(&smoother, 48, false));
    TEST_ASSERT_EQUAL_INT(0, follow(&smoother, 1, true));
    TEST_ASSERT_EQUAL_INT(0, follow(&smoother, 2, false));
    TEST_ASSERT_EQUAL_INT(1, follow(&smoother, 2, true));
    // AND a calm that lasts counts down to nothing, not below
    TEST_ASSERT_EQUAL_INT(0, follow(&smoother, 200, false));
    TEST_ASSERT_EQUAL_INT(0, smoother.transient_ticks);
    TEST_ASSERT_EQUAL_INT(48, follow(&smoother, 60, true));
}

static void test_speeds_that_differ_by_nothing_are_no_transient(void) {
    // GIVEN speeds that are zero, and sensors without noise WHEN they follow THEN nothing counts
    hexload_smoother_t smoother;
    hexload_real_t velocity_m_s[HEXLOAD_LEGS] = {0};
    memset(&smoother, 0, sizeof smoother);
    smoother.constants.lag_ticks = 12;
    hexload_transient_follow(&smoother, 20, HEXLOAD_REAL(0.0), velocity_m_s);
    TEST_ASSERT_EQUAL_INT(0, smoother.transient_ticks);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        TEST_ASSERT_EQUAL_DOUBLE(0.0, (double)velocity_m_s[leg]);
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_speeds_follow_the_parabolas_as_far_as_they_stand_out_of_noise);
    RUN_TEST(test_nothing_is_added_where_one_of_the_ticks_around_is_left_out);
    RUN_TEST(test_a_servo_that_rings_on_is_followed_for_four_lags);
    RUN_TEST(test_speeds_that_differ_by_nothing_are_no_transient);
    return UNITY_END();
}
