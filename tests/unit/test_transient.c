#include "momentum/transient.h"
#include "algebra/linalg.h"
#include "textbook.h"

#include <math.h>
#include <string.h>

void setUp(void) {}
void tearDown(void) {}

enum { TICKS = HEXLOAD_TRANSIENT_TICKS, CAPACITY = HEXLOAD_DELAY_CAPACITY };

/// Value of the polynomial through the ticks on both sides, and its variance in those of a tick.
static double fit(const hexload_smoother_t* smoother, uint32_t place, int leg, int degree, double* variance) {
    double weight[TICKS], value = 0.0;
    *variance = weigh_polynomial(degree, TICKS, weight);
    for (uint32_t j = 1; j <= TICKS; j++) {
        value += weight[j - 1] * ((double)smoother->velocity_m_s[(place + j) % CAPACITY][leg] +
                                  (double)smoother->velocity_m_s[(place + CAPACITY - j) % CAPACITY][leg]);
    }
    return value;
}

typedef struct expected {
    double velocity_m_s[HEXLOAD_LEGS];
    bool is_transient;
    bool is_close; ///< to a limit: rounding decides
} expected_t;

/// As transient.h says: what degrees two, four and six add, each as far as it stands out of its own noise.
static expected_t expect(const hexload_smoother_t* smoother, uint32_t place, double sigma_m_s,
                         const hexload_real_t velocity_m_s[HEXLOAD_LEGS]) {
    expected_t expected = {{0}, false, false};
    double below[HEXLOAD_LEGS], variance_below = 0.0;
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        below[leg] = expected.velocity_m_s[leg] = (double)velocity_m_s[leg];
    }
    for (int degree = 2; degree <= 6; degree += 2) {
        double part[HEXLOAD_LEGS], variance = 0.0, square = 0.0;
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            const double value = fit(smoother, place, leg, degree, &variance);
            part[leg] = value - below[leg];
            square += part[leg] * part[leg];
            below[leg] = value;
        }
        const double least = 22.46 * (variance - variance_below) * sigma_m_s * sigma_m_s;
        variance_below = variance;
        expected.is_close = expected.is_close || fabs(square / least - 1.0) < 1e-3;
        expected.is_transient = expected.is_transient || square > least;
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            expected.velocity_m_s[leg] += fmax(0.0, 1.0 - least / square) * part[leg];
        }
    }
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

static void test_speeds_follow_polynomials_as_far_as_they_stand_out_of_noise(void) {
    // GIVEN speeds that are slow, fast or noise, in sizes from below to far above sigma, at every place of
    // the ring
    uint64_t seed = 3;
    int transients = 0, judged = 0;
    for (uint32_t trial = 0; trial < 4000; trial++) {
        hexload_smoother_t smoother;
        memset(&smoother, 0, sizeof smoother);
        const uint32_t place = trial % CAPACITY;
        const double sigma_m_s = trial % 3 == 0 ? 1e-3 : 0.2;
        hexload_real_t velocity_m_s[HEXLOAD_LEGS];
        smoother.constants.lag_ticks = 60;
        fill(&smoother, place, sigma_m_s * pow(10.0, 1.5 * uniform(&seed)),
             sigma_m_s * pow(10.0, 2.0 * uniform(&seed)), sigma_m_s, &seed);
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            velocity_m_s[leg] = (hexload_real_t)(sigma_m_s * uniform(&seed));
        }
        const expected_t expected = expect(&smoother, place, sigma_m_s, velocity_m_s);
        // WHEN the smooth speeds of the tick follow them
        hexload_transient_follow(&smoother, place, (hexload_real_t)sigma_m_s, velocity_m_s);
        if (expected.is_close) {
            continue;
        }
        // THEN they are those of polynomials that were fitted one by one, and the tick counts as a transient
        // when something was kept. Printed weights have ten digits: at j^4 = 20736 they are off by 5e-14
        // times that, over 24 ticks of 100 sigma and more; their terms, up to 3.7, round twice
        const double largest = 200.0 * sigma_m_s;
        judged++;
        transients += expected.is_transient;
        TEST_ASSERT_EQUAL_INT(expected.is_transient, smoother.transient_ticks);
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            TEST_ASSERT_DOUBLE_WITHIN((24 * 20736 * 5e-14 + ROUNDINGS(24 * 2, 3.7)) * largest,
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
    RUN_TEST(test_speeds_follow_polynomials_as_far_as_they_stand_out_of_noise);
    RUN_TEST(test_nothing_is_added_where_one_of_the_ticks_around_is_left_out);
    RUN_TEST(test_a_servo_that_rings_on_is_followed_for_four_lags);
    RUN_TEST(test_speeds_that_differ_by_nothing_are_no_transient);
    return UNITY_END();
}
