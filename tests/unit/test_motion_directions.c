#include "momentum/motion_directions.h"
#include "algebra/linalg.h"
#include "textbook.h"

#include <math.h>
#include <string.h>

void setUp(void) {}
void tearDown(void) {}

enum { LEGS = HEXLOAD_LEGS, TICKS_APART = 8, LONGEST = 128 };

static void test_slopes_count_as_far_as_motion_has_stood_out_of_noise(void) {
    // GIVEN slopes of a few sigma, now and then a thousand and more, in directions that change, for longer
    // than the mean is
    hexload_motion_directions_t directions;
    double A[LEGS][LEGS] = {{0}};
    uint64_t seed = 61;
    int slopes = 0, few = 0, many = 0;
    hexload_motion_directions_init(&directions);
    for (int tick = 0; tick < TICKS_APART * 400; tick++) {
        hexload_real_t slope_m_s[LEGS];
        const double sigma_m_s = 2e-3, size = tick % 56 == 0 ? 3000.0 * uniform(&seed) : 3.0 * uniform(&seed);
        double square = 0.0;
        for (int leg = 0; leg < LEGS; leg++) {
            slope_m_s[leg] = (hexload_real_t)(sigma_m_s * size * (uniform(&seed) + (leg == tick / 800)));
            square += pow((double)slope_m_s[leg] / sigma_m_s, 2.0);
        }
        // WHEN each eighth of them is taken: its square counts up to a million, in the mean of the last 128
        if (tick % TICKS_APART == 0) {
            slopes += slopes < LONGEST;
            for (int i = 0; i < LEGS; i++) {
                for (int j = 0; j < LEGS; j++) {
                    const double product =
                        (double)slope_m_s[i] * (double)slope_m_s[j] / (sigma_m_s * sigma_m_s);
                    A[i][j] += (fmin(1.0, 1e6 / square) * product - A[i][j]) / slopes;
                }
            }
        }
        hexload_motion_directions_learn(&directions, slope_m_s, (hexload_real_t)(1.0 / sigma_m_s));
        if (tick % TICKS_APART != TICKS_APART - 1) {
            continue;
        }
        // THEN of another slope W = A (A + 5 E)^-1 is kept. What A loses by rounding, beside 5, is up to its
        // own rounding
        double sum[LEGS][LEGS], inverse[LEGS][LEGS], largest = 0.0;
        hexload_real_t kept[LEGS];
        memcpy(sum, A, sizeof sum);
        for (int i = 0; i < LEGS; i++) {
            sum[i][i] += 5.0;
            kept[i] = (hexload_real_t)uniform(&seed);
            largest = fmax(largest, A[i][i]);
        }
        invert(&sum[0][0], LEGS, &inverse[0][0]);
        for (int i = 0; i < LEGS; i++) {
            for (int j = 0; j <= i; j++) {
                TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(200, largest), A[i][j],
                                          (double)directions.spread[ROW(i) + j]);
            }
        }
        // AND of what that leaves out, as much as is beyond 12.59 of the squares of its own sigmas
        const double sigma = tick % 2 == 0 ? 1.0 : 0.05;
        double expected[LEGS], rest[LEGS], square_of_rest = 0.0;
        for (int i = 0; i < LEGS; i++) {
            rest[i] = 0.0;
            for (int j = 0; j < LEGS; j++) {
                rest[i] += 5.0 * inverse[i][j] * (double)kept[j];
            }
            square_of_rest += pow(rest[i] / sigma, 2.0);
        }
        const double beyond = fmax(0.0, 1.0 - 12.59 / square_of_rest);
        for (int i = 0; i < LEGS; i++) {
            expected[i] = (double)kept[i] - (1.0 - beyond) * rest[i];
        }
        few += beyond == 0.0;
        many += beyond > 0.1;
        hexload_motion_directions_keep(&directions, (hexload_real_t)(1.0 / (sigma * sigma)), kept);
        for (int i = 0; i < LEGS; i++) {
            TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(400, 1.0 + largest / 5.0), expected[i], (double)kept[i]);
        }
    }
    TEST_ASSERT_TRUE(few > 20 && many > 20);
}

static void test_without_motion_noise_is_not_kept_and_what_stands_out_of_it_is(void) {
    // GIVEN no motion yet WHEN a slope comes that may be noise THEN nothing of it is kept
    hexload_motion_directions_t directions;
    hexload_real_t slope_m_s[LEGS] = {1, 2, 3, -4, 5, -6};
    hexload_motion_directions_init(&directions);
    hexload_motion_directions_keep(&directions, HEXLOAD_REAL(0.09), slope_m_s); // 91 of squares, times 0.09
    for (int leg = 0; leg < LEGS; leg++) {
        TEST_ASSERT_EQUAL_DOUBLE(0.0, (double)slope_m_s[leg]);
    }
    // AND of one of a thousand sigmas nearly all
    slope_m_s[1] = HEXLOAD_REAL(1000.0);
    hexload_motion_directions_keep(&directions, HEXLOAD_REAL(1.0), slope_m_s);
    TEST_ASSERT_DOUBLE_WITHIN(0.02, 1000.0, (double)slope_m_s[1]);
}

static void test_a_factor_is_made_row_by_row_and_used_when_it_is_whole(void) {
    // GIVEN a first slope WHEN the six ticks after it make the factor's rows THEN the old one is used until
    // the seventh
    hexload_motion_directions_t directions, before;
    const hexload_real_t slope_m_s[LEGS] = {1, 2, 3, -4, 5, -6};
    hexload_motion_directions_init(&directions);
    before = directions;
    for (int tick = 0; tick < TICKS_APART; tick++) {
        TEST_ASSERT_EQUAL_MEMORY(before.factor, directions.factor, sizeof before.factor);
        hexload_motion_directions_learn(&directions, slope_m_s, HEXLOAD_REAL(1.0));
    }
    TEST_ASSERT_TRUE(memcmp(before.factor, directions.factor, sizeof before.factor) != 0);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_slopes_count_as_far_as_motion_has_stood_out_of_noise);
    RUN_TEST(test_without_motion_noise_is_not_kept_and_what_stands_out_of_it_is);
    RUN_TEST(test_a_factor_is_made_row_by_row_and_used_when_it_is_whole);
    return UNITY_END();
}
