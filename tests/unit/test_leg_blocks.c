#include "paper/rate_noise.h"

#include "algebra/linalg.h"
#include "machine.h"

#include <math.h>
#include <string.h>

void setUp(void) {}
void tearDown(void) {}

/// Row of a leg: direction, of any length, and the lever of its hinge.
static void set_leg(hexload_real_t J[HEXLOAD_LEGS][6], int leg, const hexload_real_t direction[3],
                    const hexload_real_t lever[3]) {
    const hexload_real_t length = hexload_sqrt(dot3(direction, direction));
    for (int k = 0; k < 3; k++) {
        J[leg][k] = direction[k] / length;
    }
    cross3(lever, &J[leg][0], &J[leg][3]);
}

/// Legs in all directions with levers up to 1 m: anything but a usual platform.
static void random_jacobian(uint64_t* seed, hexload_real_t J[HEXLOAD_LEGS][6]) {
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        hexload_real_t direction[3], lever[3];
        for (int k = 0; k < 3; k++) {
            direction[k] = (hexload_real_t)normal(seed);
            lever[k] = (hexload_real_t)uniform(seed);
        }
        set_leg(J, leg, direction, lever);
    }
}

static void assert_solved_by(const hexload_leg_blocks_t* blocks, hexload_real_t J[HEXLOAD_LEGS][6],
                             const hexload_real_t y[HEXLOAD_LEGS]) {
    hexload_real_t x[6];
    hexload_leg_blocks_solve(blocks, y, x);
    double size = 1.0;
    for (int k = 0; k < 6; k++) {
        size = fmax(size, fabs((double)x[k]));
    }
    // S^-1 from the adjugate is good to its condition number, which six legs of random directions take to a
    // few hundred
    for (int i = 0; i < HEXLOAD_LEGS; i++) {
        double sum = 0.0;
        for (int k = 0; k < 6; k++) {
            sum += (double)J[i][k] * (double)x[k];
        }
        TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(500, size), (double)y[i], sum);
    }
}

static void assert_solves(hexload_real_t J[HEXLOAD_LEGS][6], const hexload_real_t y[HEXLOAD_LEGS]) {
    hexload_leg_blocks_t blocks;
    TEST_ASSERT_TRUE(hexload_leg_blocks_make(J, &blocks));
    assert_solved_by(&blocks, J, y);
}

static void random_lengths(uint64_t* seed, hexload_real_t y[HEXLOAD_LEGS]) {
    for (int i = 0; i < HEXLOAD_LEGS; i++) {
        y[i] = (hexload_real_t)uniform(seed);
    }
}

static void test_solution_satisfies_the_equations_for_legs_in_all_directions(void) {
    uint64_t seed = 1;
    for (int run = 0; run < 1000; run++) {
        hexload_real_t J[HEXLOAD_LEGS][6], y[HEXLOAD_LEGS];
        random_jacobian(&seed, J);
        random_lengths(&seed, y);
        assert_solves(J, y);
    }
}

static void test_legs_along_the_axes_are_solved_whatever_their_order(void) {
    // GIVEN a vibration table: three vertical legs, two along x, one along y; no three legs are a usual
    // platform's
    static const hexload_real_t direction[HEXLOAD_LEGS][3] = {{0, 0, 1}, {0, 0, 1}, {0, 0, 1},
                                                              {1, 0, 0}, {1, 0, 0}, {0, 1, 0}};
    static const hexload_real_t lever[HEXLOAD_LEGS][3] = {{1, 0, 0},  {-1, 1, 0},  {-1, -1, 0},
                                                          {-1, 1, 0}, {-1, -1, 0}, {0, -1, 0}};
    static const hexload_real_t y[HEXLOAD_LEGS] = {1, 2, 3, -1, -2, -3};
    for (int first = 0; first < HEXLOAD_LEGS; first++) {
        hexload_real_t J[HEXLOAD_LEGS][6];
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            set_leg(J, (first + leg) % HEXLOAD_LEGS, direction[leg], lever[leg]);
        }
        // WHEN its Jacobian is solved, any leg being the first THEN the equations hold
        assert_solves(J, y);
    }
}

static void test_update_solves_as_well_wherever_the_legs_have_gone(void) {
    uint64_t seed = 6;
    int kept = 0;
    for (int run = 0; run < 1000; run++) {
        // GIVEN the carriers of six legs
        hexload_real_t J[HEXLOAD_LEGS][6], y[HEXLOAD_LEGS];
        hexload_leg_blocks_t blocks;
        random_jacobian(&seed, J);
        TEST_ASSERT_TRUE(hexload_leg_blocks_make(J, &blocks));
        const hexload_leg_blocks_t before = blocks;
        // WHEN the legs point elsewhere, so that those three may well lie in a plane
        random_jacobian(&seed, J);
        random_lengths(&seed, y);
        TEST_ASSERT_TRUE(hexload_leg_blocks_update(J, &blocks));
        // THEN the equations hold as with carriers that are chosen for them
        assert_solved_by(&blocks, J, y);
        kept += memcmp(before.leg, blocks.leg, sizeof before.leg) == 0 ? 1 : 0;
    }
    TEST_ASSERT_GREATER_THAN_INT(0, kept); // both ways were gone
    TEST_ASSERT_LESS_THAN_INT(1000, kept);
}

static void jacobian_of(const hexload_config_t* config, const pose_t* pose,
                        hexload_real_t J[HEXLOAD_LEGS][6]) {
    static const double home_height_m = 0.798276; // of the paper's machine
    double exact[HEXLOAD_LEGS][6];
    leg_jacobian(config, home_height_m, pose, exact);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        for (int k = 0; k < 6; k++) {
            J[leg][k] = (hexload_real_t)exact[leg][k];
        }
    }
}

static void test_update_keeps_the_carriers_of_a_platform_in_motion(void) {
    // GIVEN the carriers of the paper's platform at home
    const hexload_config_t config = paper_machine();
    const pose_t home = {.p_m = {0}};
    hexload_real_t J[HEXLOAD_LEGS][6];
    hexload_leg_blocks_t blocks;
    uint64_t seed = 7;
    jacobian_of(&config, &home, J);
    TEST_ASSERT_TRUE(hexload_leg_blocks_make(J, &blocks));
    const hexload_leg_blocks_t before = blocks;
    for (int run = 0; run < 100; run++) {
        // WHEN it goes up to 0.15 m and 0.15 rad from there in each direction
        pose_t pose;
        for (int k = 0; k < 3; k++) {
            pose.p_m[k] = 0.15 * uniform(&seed);
            pose.rpy[k] = 0.15 * uniform(&seed);
        }
        jacobian_of(&config, &pose, J);
        TEST_ASSERT_TRUE(hexload_leg_blocks_update(J, &blocks));
        // THEN they are not chosen anew
        TEST_ASSERT_EQUAL_MEMORY(before.leg, blocks.leg, sizeof before.leg);
    }
}

static void test_columns_are_those_of_the_inverse(void) {
    uint64_t seed = 2;
    for (int run = 0; run < 1000; run++) {
        // GIVEN the blocks of a Jacobian
        hexload_real_t J[HEXLOAD_LEGS][6], columns[HEXLOAD_LEGS][6];
        hexload_leg_blocks_t blocks;
        random_jacobian(&seed, J);
        TEST_ASSERT_TRUE(hexload_leg_blocks_make(J, &blocks));
        // WHEN the columns of the inverse are asked for THEN the Jacobian times each is one leg at unit speed
        hexload_leg_blocks_invert(&blocks, columns);
        for (int i = 0; i < HEXLOAD_LEGS; i++) {
            double size = 1.0;
            for (int k = 0; k < 6; k++) {
                size = fmax(size, fabs((double)columns[i][k]));
            }
            for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
                double sum = 0.0;
                for (int k = 0; k < 6; k++) {
                    sum += (double)columns[i][k] * (double)J[leg][k];
                }
                TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(1000, size), leg == i ? 1.0 : 0.0, sum);
            }
        }
    }
}

static void test_rate_noise_is_the_sum_over_the_columns(void) {
    uint64_t seed = 12;
    for (int run = 0; run < 1000; run++) {
        // GIVEN the blocks of a Jacobian, and the angular velocity turned by a matrix
        hexload_real_t J[HEXLOAD_LEGS][6], columns[HEXLOAD_LEGS][6], T[3][3], noise[3][3];
        hexload_leg_blocks_t blocks;
        double turned[HEXLOAD_LEGS][3], size = 1.0;
        random_jacobian(&seed, J);
        TEST_ASSERT_TRUE(hexload_leg_blocks_make(J, &blocks));
        hexload_leg_blocks_invert(&blocks, columns);
        for (int i = 0; i < 3; i++) {
            for (int k = 0; k < 3; k++) {
                T[i][k] = (hexload_real_t)uniform(&seed);
            }
            for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
                turned[leg][i] = 0.0;
                for (int k = 0; k < 3; k++) {
                    turned[leg][i] += (double)T[i][k] * (double)columns[leg][3 + k];
                }
                size = fmax(size, fabs(turned[leg][i]));
            }
        }
        // WHEN its noise is asked for THEN it is the sum of the squares that the legs give
        hexload_rate_noise(&blocks, T, noise);
        for (int i = 0; i < 3; i++) {
            for (int k = 0; k <= i; k++) {
                double sum = 0.0;
                for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
                    sum += turned[leg][i] * turned[leg][k];
                }
                TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(2000, size * size), sum, (double)noise[i][k]);
            }
        }
    }
}

static void test_legs_that_leave_a_direction_free_are_refused(void) {
    // GIVEN six legs whose directions lie in one plane
    uint64_t seed = 3;
    hexload_real_t J[HEXLOAD_LEGS][6];
    hexload_leg_blocks_t blocks;
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        const hexload_real_t direction[3] = {(hexload_real_t)normal(&seed), (hexload_real_t)normal(&seed),
                                             HEXLOAD_REAL(0.0)};
        const hexload_real_t lever[3] = {(hexload_real_t)uniform(&seed), (hexload_real_t)uniform(&seed),
                                         (hexload_real_t)uniform(&seed)};
        set_leg(J, leg, direction, lever);
    }
    TEST_ASSERT_FALSE(hexload_leg_blocks_make(J, &blocks));
}

static void test_legs_that_leave_a_rotation_free_are_refused(void) {
    // GIVEN six legs that all meet the z axis
    uint64_t seed = 4;
    hexload_real_t J[HEXLOAD_LEGS][6];
    hexload_leg_blocks_t blocks;
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        const hexload_real_t direction[3] = {(hexload_real_t)normal(&seed), (hexload_real_t)normal(&seed),
                                             (hexload_real_t)normal(&seed)};
        const hexload_real_t lever[3] = {HEXLOAD_REAL(0.0), HEXLOAD_REAL(0.0),
                                         (hexload_real_t)uniform(&seed)};
        set_leg(J, leg, direction, lever);
    }
    TEST_ASSERT_FALSE(hexload_leg_blocks_make(J, &blocks));
}

static void test_a_jacobian_with_nan_is_refused(void) {
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        uint64_t seed = 5;
        hexload_real_t J[HEXLOAD_LEGS][6];
        hexload_leg_blocks_t blocks;
        random_jacobian(&seed, J);
        for (int k = 0; k < 6; k++) {
            J[leg][k] = (hexload_real_t)NAN;
        }
        TEST_ASSERT_FALSE(hexload_leg_blocks_make(J, &blocks));
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_solution_satisfies_the_equations_for_legs_in_all_directions);
    RUN_TEST(test_legs_along_the_axes_are_solved_whatever_their_order);
    RUN_TEST(test_update_solves_as_well_wherever_the_legs_have_gone);
    RUN_TEST(test_update_keeps_the_carriers_of_a_platform_in_motion);
    RUN_TEST(test_columns_are_those_of_the_inverse);
    RUN_TEST(test_rate_noise_is_the_sum_over_the_columns);
    RUN_TEST(test_legs_that_leave_a_direction_free_are_refused);
    RUN_TEST(test_legs_that_leave_a_rotation_free_are_refused);
    RUN_TEST(test_a_jacobian_with_nan_is_refused);
    return UNITY_END();
}
