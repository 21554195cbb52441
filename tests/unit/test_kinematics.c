#include "front_end/kinematics.h"
#include "machine.h"

#include <string.h>

void setUp(void) {}
void tearDown(void) {}

/// A pose in the workspace: +-0.12 m and +-0.2 rad keep every leg of the paper's machine within its stroke.
static pose_t random_pose(uint64_t* seed) {
    pose_t pose;
    for (int k = 0; k < 3; k++) {
        pose.p_m[k] = 0.12 * uniform(seed);
        pose.rpy[k] = 0.2 * uniform(seed);
    }
    return pose;
}

static hexload_leg_sample_t sample_of(const hexload_config_t* config, const hexload_kinematics_t* kinematics,
                                      const pose_t* pose) {
    hexload_leg_sample_t sample = {0};
    double displacement_m[6];
    leg_displacements(config, (double)kinematics->home_height_m, pose, displacement_m);
    for (int leg = 0; leg < 6; leg++) {
        sample.displacement_m[leg] = (hexload_real_t)displacement_m[leg];
    }
    return sample;
}

static hexload_kinematics_t start_at_home(const hexload_config_t* config) {
    hexload_kinematics_t kinematics;
    const hexload_status_t status = hexload_kinematics_init(&kinematics, config);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, status);
    return kinematics;
}

/// |v| of the rotation vector between R and the pose's, for small differences.
static double angle_between(hexload_real_t R[3][3], const pose_t* pose) {
    double wanted[3][3], square = 0.0;
    rotation_of(pose, wanted);
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            square += 0.5 * ((double)R[i][j] - wanted[i][j]) * ((double)R[i][j] - wanted[i][j]);
        }
    }
    return sqrt(square);
}

/// Rounding of the inputs (lengths near 0.87 m and displacements up to 0.3 m) times the largest gain of J^-1
/// on this machine (3 rad/m, 2 m/m), with a factor 2 for the arithmetic: 0.5 um and 0.5 urad in float, as the
/// issue wants.
static const double pose_tolerance = sizeof(hexload_real_t) == sizeof(float) ? 0.5e-6 : 1e-14;

static void assert_finds_poses(const hexload_config_t* config) {
    uint64_t seed = 5;
    for (int run = 0; run < 500; run++) {
        // GIVEN the legs of a random pose, and kinematics that start at home
        hexload_kinematics_t kinematics = start_at_home(config);
        hexload_motion_t motion;
        const pose_t pose = random_pose(&seed);
        const hexload_leg_sample_t sample = sample_of(config, &kinematics, &pose);
        // WHEN the pose is asked for
        TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_kinematics_solve(&kinematics, config, &sample, &motion));
        // THEN it is the one that made the legs
        for (int k = 0; k < 3; k++) {
            TEST_ASSERT_DOUBLE_WITHIN(pose_tolerance, pose.p_m[k], (double)motion.p_m[k]);
        }
        TEST_ASSERT_DOUBLE_WITHIN(2.0 * pose_tolerance, 0.0,
                                  angle_between(motion.R, &pose)); // of three axes at once
    }
}

static void test_kinematics_finds_the_pose_from_home(void) {
    const hexload_config_t config = paper_machine();
    assert_finds_poses(&config);
}

static void test_kinematics_finds_the_pose_of_a_crooked_machine(void) {
    const hexload_config_t config = crooked_machine();
    assert_finds_poses(&config);
}

static void test_a_machine_of_another_size_takes_the_same_steps_to_the_same_pose(void) {
    // GIVEN a machine, and one that is larger or smaller by a power of two, of which every rounding is the
    // same
    uint64_t seed = 12;
    for (int n = 0; n < 200; n++) {
        const hexload_config_t config = n % 4 < 2 ? crooked_machine() : paper_machine();
        const hexload_real_t size = n % 2 == 0 ? HEXLOAD_REAL(64.0) : HEXLOAD_REAL(0.015625);
        hexload_config_t scaled = config;
        for (int leg = 0; leg < 6; leg++) {
            for (int k = 0; k < 3; k++) {
                scaled.geometry.base_hinge_m[leg][k] *= size;
                scaled.geometry.platform_hinge_m[leg][k] *= size;
            }
            scaled.geometry.home_leg_length_m[leg] *= size;
        }
        hexload_kinematics_t kinematics = start_at_home(&config), scaled_kinematics = start_at_home(&scaled);
        const pose_t pose = random_pose(&seed);
        hexload_leg_sample_t sample = sample_of(&config, &kinematics, &pose);
        hexload_leg_sample_t scaled_sample = sample;
        hexload_motion_t motion, scaled_motion;
        for (int leg = 0; leg < 6; leg++) {
            scaled_sample.displacement_m[leg] *= size;
        }
        // WHEN both look for a pose THEN they take as many steps, and find it to the bit
        TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_kinematics_solve(&kinematics, &config, &sample, &motion));
        TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_kinematics_solve(&scaled_kinematics, &scaled,
                                                                   &scaled_sample, &scaled_motion));
        TEST_ASSERT_EQUAL_UINT32(motion.newton_steps, scaled_motion.newton_steps);
        TEST_ASSERT_EQUAL_MEMORY(motion.R, scaled_motion.R, sizeof motion.R);
        for (int k = 0; k < 3; k++) {
            TEST_ASSERT_TRUE(size * motion.p_m[k] == scaled_motion.p_m[k]);
        }
    }
}

static void test_home_height_is_the_papers(void) {
    const hexload_config_t config = paper_machine();
    const hexload_kinematics_t kinematics = start_at_home(&config);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 0.798276,
                              (double)kinematics.home_height_m); // h0 as published, six digits
}

static void test_jacobian_agrees_with_finite_differences(void) {
    const hexload_config_t config = crooked_machine();
    uint64_t seed = 6;
    for (int run = 0; run < 100; run++) {
        hexload_kinematics_t kinematics = start_at_home(&config);
        hexload_motion_t motion;
        double J[6][6];
        const pose_t pose = random_pose(&seed);
        const hexload_leg_sample_t sample = sample_of(&config, &kinematics, &pose);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_kinematics_solve(&kinematics, &config, &sample, &motion));
        leg_jacobian(&config, (double)kinematics.home_height_m, &pose, J);
        for (int i = 0; i < 6; i++) {
            for (int k = 0; k < 6;
                 k++) { // differences are good to 1e-9; the core to the pose's error over the leg length
                TEST_ASSERT_DOUBLE_WITHIN(1e-9 + 4.0 * pose_tolerance, J[i][k], (double)motion.J[i][k]);
            }
        }
    }
}

static void test_twist_put_back_gives_the_leg_velocities(void) {
    const hexload_config_t config = crooked_machine();
    uint64_t seed = 7;
    for (int run = 0; run < 100; run++) {
        hexload_kinematics_t kinematics = start_at_home(&config);
        hexload_motion_t motion;
        const pose_t pose = random_pose(&seed);
        hexload_leg_sample_t sample = sample_of(&config, &kinematics, &pose);
        for (int leg = 0; leg < 6; leg++) {
            sample.velocity_m_s[leg] = (hexload_real_t)uniform(&seed);
        }
        TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_kinematics_solve(&kinematics, &config, &sample, &motion));
        for (int i = 0; i < 6; i++) {
            double rate = 0.0;
            for (int k = 0; k < 6; k++) {
                rate += (double)motion.J[i][k] * (double)motion.twist[k];
            }
            // Twists reach 10 here (condition number of J), six products.
            TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(60, 10.0), (double)sample.velocity_m_s[i], rate);
        }
    }
}

static void test_kinematics_needs_one_newton_step_from_tick_to_tick(void) {
    // GIVEN a motion of 0.6 m/s and 2 m/s^2 at 1 kHz, whose velocities are given
    const hexload_config_t config = paper_machine();
    hexload_kinematics_t kinematics = start_at_home(&config);
    hexload_motion_t motion;
    for (int tick = 0; tick < 500; tick++) {
        const double t_s = 1e-3 * tick;
        const pose_t pose = {.p_m = {0.2 * sin(3.0 * t_s), 0.1 * sin(3.0 * t_s), 0.0},
                             .rpy = {0.0, 0.1 * sin(3.0 * t_s), 0.0}};
        hexload_leg_sample_t sample = sample_of(&config, &kinematics, &pose);
        double J[6][6];
        leg_jacobian(&config, (double)kinematics.home_height_m, &pose, J);
        for (int leg = 0; leg < 6; leg++) {
            const double cosine = 3.0 * cos(3.0 * t_s);
            sample.velocity_m_s[leg] =
                (hexload_real_t)(cosine * (0.2 * J[leg][0] + 0.1 * J[leg][1] + 0.1 * J[leg][4]));
        }
        // WHEN the ticks follow each other
        TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_kinematics_solve(&kinematics, &config, &sample, &motion));
        // THEN the step with the last factors leaves one to do in float (two in double, which squares the
        // error once more)
        if (tick > 1) {
            TEST_ASSERT_LESS_OR_EQUAL_UINT32(sizeof(hexload_real_t) == sizeof(float) ? 1 : 2,
                                             motion.newton_steps);
        }
    }
}

static void test_a_search_takes_eight_steps_at_most(void) {
    // GIVEN poses far from home WHEN they are looked for from
    // home THEN no search that finds one has taken more than eight steps, and some have taken as many
    const hexload_config_t config = paper_machine();
    uint64_t seed = 77;
    int longest = 0;
    for (int run = 0; run < 2000; run++) {
        hexload_kinematics_t kinematics = start_at_home(&config);
        hexload_motion_t motion;
        pose_t pose;
        for (int k = 0; k < 3; k++) {
            pose.p_m[k] = 0.4 * uniform(&seed);
            pose.rpy[k] = 0.8 * uniform(&seed);
        }
        const hexload_leg_sample_t sample = sample_of(&config, &kinematics, &pose);
        if (hexload_kinematics_solve(&kinematics, &config, &sample, &motion) == HEXLOAD_OK) {
            TEST_ASSERT_LESS_OR_EQUAL_UINT32(8, motion.newton_steps);
            longest += motion.newton_steps == 8 ? 1 : 0;
        }
    }
    TEST_ASSERT_GREATER_THAN_INT(10, longest);
}

static void test_a_platform_that_is_turned_far_needs_no_more_steps(void) {
    // GIVEN a platform that turns by 0.5 rad about the vertical, whose velocities are given WHEN the ticks
    // follow
    const hexload_config_t config = paper_machine();
    hexload_kinematics_t kinematics = start_at_home(&config);
    hexload_motion_t motion;
    for (int tick = 0; tick < 2000; tick++) {
        const double t_s = 1e-3 * tick;
        const pose_t pose = {.rpy = {0.0, 0.0, 0.5 * sin(3.0 * t_s)}};
        hexload_leg_sample_t sample = sample_of(&config, &kinematics, &pose);
        double J[6][6];
        leg_jacobian(&config, (double)kinematics.home_height_m, &pose, J);
        for (int leg = 0; leg < 6; leg++) {
            sample.velocity_m_s[leg] = (hexload_real_t)(1.5 * cos(3.0 * t_s) * J[leg][5]);
        }
        // THEN they need what they need near home: the turn of a tick is joined to the turn before it exactly
        TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_kinematics_solve(&kinematics, &config, &sample, &motion));
        if (tick > 1) {
            TEST_ASSERT_LESS_OR_EQUAL_UINT32(sizeof(hexload_real_t) == sizeof(float) ? 1 : 2,
                                             motion.newton_steps);
        }
    }
}

/// GIVEN a last pose that is none, as a fault of memory may leave it WHEN good samples come THEN the second
/// at the latest has its pose.
static void assert_comes_back_from(const hexload_config_t* config, const hexload_kinematics_t* bad_start,
                                   const pose_t* pose) {
    hexload_kinematics_t kinematics = *bad_start;
    hexload_motion_t motion;
    const hexload_leg_sample_t sample = sample_of(config, &kinematics, pose);
    if (hexload_kinematics_solve(&kinematics, config, &sample, &motion) != HEXLOAD_OK) {
        TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_kinematics_solve(&kinematics, config, &sample, &motion));
    }
    for (int k = 0; k < 3; k++) {
        TEST_ASSERT_DOUBLE_WITHIN(pose_tolerance, pose->p_m[k], (double)motion.p_m[k]);
    }
}

static void test_kinematics_does_not_stay_in_another_assembly_of_the_legs(void) {
    // the mirror image of the pose below the base, where the legs fit just as well
    const hexload_config_t config = paper_machine();
    uint64_t seed = 10;
    for (int run = 0; run < 200; run++) {
        hexload_kinematics_t mirrored = start_at_home(&config);
        const pose_t pose = random_pose(&seed);
        mirrored.p_m[2] = HEXLOAD_REAL(-2.0) * mirrored.home_height_m;
        assert_comes_back_from(&config, &mirrored, &pose);
    }
}

static void test_kinematics_comes_back_from_far_away(void) {
    const hexload_config_t config = paper_machine();
    uint64_t seed = 9;
    for (int run = 0; run < 200; run++) {
        hexload_kinematics_t far = start_at_home(&config);
        const pose_t pose = random_pose(&seed);
        for (int k = 0; k < 3; k++) {
            far.p_m[k] = (hexload_real_t)(100.0 * uniform(&seed));
        }
        assert_comes_back_from(&config, &far, &pose);
    }
}

static void test_kinematics_refuses_legs_that_no_pose_has(void) {
    // GIVEN one leg 0.8 m longer than all others
    const hexload_config_t config = paper_machine();
    hexload_kinematics_t kinematics = start_at_home(&config);
    hexload_motion_t motion;
    const hexload_kinematics_t before = kinematics;
    hexload_leg_sample_t sample = {0};
    sample.displacement_m[0] = HEXLOAD_REAL(0.8);
    // WHEN the pose is asked for THEN it is refused and nothing has changed
    const hexload_status_t status = hexload_kinematics_solve(&kinematics, &config, &sample, &motion);
    TEST_ASSERT_TRUE(status == HEXLOAD_ERR_POSE || status == HEXLOAD_ERR_SINGULAR);
    TEST_ASSERT_EQUAL_MEMORY(&before, &kinematics, sizeof before);
}

static void test_home_height_is_found_for_hinges_far_below_the_control_point(void) {
    // GIVEN a control point 2.5 m above the upper hinges
    hexload_config_t config = paper_machine();
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        config.geometry.platform_hinge_m[leg][2] = HEXLOAD_REAL(-2.5);
    }
    const hexload_kinematics_t kinematics = start_at_home(&config);
    TEST_ASSERT_DOUBLE_WITHIN(2e-6, 2.5 + 0.798276, (double)kinematics.home_height_m);
}

static void test_home_height_is_found_for_hinges_at_heights_of_their_own(void) {
    for (int long_leg = 0; long_leg < HEXLOAD_LEGS; long_leg++) {
        // GIVEN base hinges 10 m above the base's origin, but for one, whose leg is so much longer
        hexload_config_t config = paper_machine();
        const double home_m = 10.0 + 0.798276, length_m = (double)config.geometry.home_leg_length_m[0];
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            config.geometry.base_hinge_m[leg][2] = (hexload_real_t)(leg == long_leg ? 0.0 : 10.0);
        }
        config.geometry.home_leg_length_m[long_leg] =
            (hexload_real_t)sqrt(length_m * length_m - 0.798276 * 0.798276 + home_m * home_m);
        // WHEN the height is looked for THEN it is that over the higher ones
        const hexload_kinematics_t kinematics = start_at_home(&config);
        TEST_ASSERT_DOUBLE_WITHIN(1e-6 + ROUNDINGS(20, 10.0), home_m, (double)kinematics.home_height_m);
    }
}

static void test_kinematics_refuses_legs_too_short_to_reach_the_platform(void) {
    hexload_config_t config = paper_machine();
    for (int leg = 0; leg < 6; leg++) {
        config.geometry.home_leg_length_m[leg] =
            HEXLOAD_REAL(0.2); // the hinges are 0.36 m apart in the plane
    }
    hexload_kinematics_t kinematics;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_ERR_POSE, hexload_kinematics_init(&kinematics, &config));
}

static void test_kinematics_refuses_a_machine_that_is_singular_at_home(void) {
    // GIVEN six parallel legs: base and platform hexagons are alike
    hexload_config_t config = paper_machine();
    memcpy(config.geometry.base_hinge_m, config.geometry.platform_hinge_m,
           sizeof config.geometry.base_hinge_m);
    hexload_kinematics_t kinematics;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_ERR_SINGULAR, hexload_kinematics_init(&kinematics, &config));
}

static void test_a_height_that_rounding_hides_is_no_home(void) {
    for (int n = 0; n < 2; n++) {
        // GIVEN legs of 0.8741 m, or 14 mm, and hinges so far above their origins that the height between
        // them has steps of half a metre, or of 0.1 mm
        hexload_config_t config = paper_machine();
        const hexload_real_t size = n == 0 ? HEXLOAD_REAL(1.0) : HEXLOAD_REAL(0.015625);
        const hexload_real_t far_m = (n == 0 ? HEXLOAD_REAL(0.5) : HEXLOAD_REAL(1e-4)) / HEXLOAD_REAL_EPSILON;
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            for (int k = 0; k < 2; k++) {
                config.geometry.platform_hinge_m[leg][k] *= size;
                config.geometry.base_hinge_m[leg][k] *= size;
            }
            config.geometry.home_leg_length_m[leg] *= size;
            config.geometry.platform_hinge_m[leg][2] = far_m;
            config.geometry.base_hinge_m[leg][2] = far_m;
        }
        // WHEN their height is looked for THEN none is found
        hexload_kinematics_t kinematics;
        TEST_ASSERT_EQUAL_INT(HEXLOAD_ERR_POSE, hexload_kinematics_init(&kinematics, &config));
    }
}

static void test_kinematics_refuses_a_platform_turned_by_more_than_90_degrees(void) {
    const double degree = 3.14159265358979 / 180.0;
    for (int n = 0; n < 2; n++) {
        // GIVEN a platform that has been turned by 89, or 91, degrees about the vertical
        const hexload_config_t config = crooked_machine();
        hexload_kinematics_t kinematics = start_at_home(&config);
        const double angle = (n == 0 ? 89.0 : 91.0) * degree;
        const pose_t pose = {.rpy = {0.0, 0.0, angle}};
        hexload_leg_sample_t sample = {0};
        hexload_motion_t motion;
        double displacement_m[6];
        leg_displacements(&config, (double)kinematics.home_height_m, &pose, displacement_m);
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            sample.displacement_m[leg] = kinematics.displacement_m[leg] = (hexload_real_t)displacement_m[leg];
        }
        kinematics.quaternion[0] = (hexload_real_t)cos(0.5 * angle);
        kinematics.quaternion[3] = (hexload_real_t)sin(0.5 * angle);
        // WHEN its legs are shown again THEN it is a pose up to 90 degrees, and none beyond
        TEST_ASSERT_EQUAL_INT(n == 0 ? HEXLOAD_OK : HEXLOAD_ERR_POSE,
                              hexload_kinematics_solve(&kinematics, &config, &sample, &motion));
        // AND the next search starts from home, and finds it, as often as that has failed
        if (n == 1) {
            TEST_ASSERT_NOT_EQUAL(HEXLOAD_OK,
                                  hexload_kinematics_solve(&kinematics, &config, &sample, &motion));
            TEST_ASSERT_TRUE(kinematics.is_lost);
            memset(sample.displacement_m, 0, sizeof sample.displacement_m);
            TEST_ASSERT_EQUAL_INT(HEXLOAD_OK,
                                  hexload_kinematics_solve(&kinematics, &config, &sample, &motion));
            TEST_ASSERT_FALSE(kinematics.is_lost);
            // unequal legs turn it by some degrees where all are at their home lengths
            TEST_ASSERT_DOUBLE_WITHIN(1.0 - cos(5.0 * degree), 1.0, (double)motion.R[0][0]);
        }
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_kinematics_finds_the_pose_from_home);
    RUN_TEST(test_kinematics_finds_the_pose_of_a_crooked_machine);
    RUN_TEST(test_a_machine_of_another_size_takes_the_same_steps_to_the_same_pose);
    RUN_TEST(test_home_height_is_the_papers);
    RUN_TEST(test_jacobian_agrees_with_finite_differences);
    RUN_TEST(test_twist_put_back_gives_the_leg_velocities);
    RUN_TEST(test_kinematics_needs_one_newton_step_from_tick_to_tick);
    RUN_TEST(test_a_search_takes_eight_steps_at_most);
    RUN_TEST(test_a_platform_that_is_turned_far_needs_no_more_steps);
    RUN_TEST(test_kinematics_does_not_stay_in_another_assembly_of_the_legs);
    RUN_TEST(test_kinematics_refuses_legs_that_no_pose_has);
    RUN_TEST(test_home_height_is_found_for_hinges_far_below_the_control_point);
    RUN_TEST(test_home_height_is_found_for_hinges_at_heights_of_their_own);
    RUN_TEST(test_kinematics_comes_back_from_far_away);
    RUN_TEST(test_kinematics_refuses_legs_too_short_to_reach_the_platform);
    RUN_TEST(test_kinematics_refuses_a_machine_that_is_singular_at_home);
    RUN_TEST(test_a_height_that_rounding_hides_is_no_home);
    RUN_TEST(test_kinematics_refuses_a_platform_turned_by_more_than_90_degrees);
    return UNITY_END();
}
