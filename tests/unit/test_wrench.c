#include "front_end/wrench.h"
#include "machine.h"

void setUp(void) {}
void tearDown(void) {}

static void test_wrench_times_twist_is_leg_force_times_leg_velocity(void) {
    const hexload_config_t config = crooked_machine();
    uint64_t seed = 8;
    for (int run = 0; run < 100; run++) {
        // GIVEN legs that push 1 kN each and move at 1 m/s in a random pose
        hexload_kinematics_t kinematics;
        hexload_motion_t motion;
        hexload_wrench_t wrench;
        TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_kinematics_init(&kinematics, &config));
        pose_t pose;
        hexload_leg_sample_t sample = {0};
        double displacement_m[6], power_w = 0.0;
        for (int k = 0; k < 3; k++) {
            pose.p_m[k] = 0.1 * uniform(&seed);
            pose.rpy[k] = 0.2 * uniform(&seed);
        }
        leg_displacements(&config, (double)kinematics.home_height_m, &pose, displacement_m);
        for (int leg = 0; leg < 6; leg++) {
            sample.displacement_m[leg] = (hexload_real_t)displacement_m[leg];
            sample.velocity_m_s[leg] = (hexload_real_t)uniform(&seed);
            sample.force_n[leg] = (hexload_real_t)(1000.0 * uniform(&seed));
            power_w += (double)sample.force_n[leg] * (double)sample.velocity_m_s[leg];
        }
        TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_kinematics_solve(&kinematics, &config, &sample, &motion));
        // WHEN their wrench is computed
        hexload_wrench_compute(&motion, &sample, &wrench);
        // THEN it does the same work on the platform: (12) is the principle of virtual work
        hexload_real_t v[3], w[3];
        hexload_motion_to_platform(&motion, &motion.twist[0], v);
        hexload_motion_to_platform(&motion, &motion.twist[3], w);
        double platform_w = 0.0;
        for (int k = 0; k < 3; k++) {
            platform_w +=
                (double)wrench.force_n[k] * (double)v[k] + (double)wrench.moment_nm[k] * (double)w[k];
        }
        TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(60, 6 * 1000.0 * 10.0), power_w, platform_w); // twists reach 10
    }
}

static void test_six_equal_forces_at_home_lift_without_a_moment(void) {
    const hexload_config_t config = paper_machine();
    hexload_kinematics_t kinematics;
    hexload_motion_t motion;
    hexload_wrench_t wrench;
    hexload_leg_sample_t sample = {0};
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_kinematics_init(&kinematics, &config));
    for (int leg = 0; leg < 6; leg++) {
        sample.force_n[leg] = HEXLOAD_REAL(1074.180641); // holds 600 kg: 600 * 9.81 * 0.8741 / (6 * 0.798276)
    }
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_kinematics_solve(&kinematics, &config, &sample, &motion));
    hexload_wrench_compute(&motion, &sample, &wrench);
    const double tolerance = 600.0 * 9.81 * 1e-6; // h0 and L0 with six digits
    TEST_ASSERT_DOUBLE_WITHIN(tolerance, 600.0 * 9.81, (double)wrench.force_n[2]);
    for (int k = 0; k < 3; k++) {
        TEST_ASSERT_DOUBLE_WITHIN(tolerance, 0.0, (double)wrench.moment_nm[k]);
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_wrench_times_twist_is_leg_force_times_leg_velocity);
    RUN_TEST(test_six_equal_forces_at_home_lift_without_a_moment);
    return UNITY_END();
}
