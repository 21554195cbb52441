#include "momentum/momentum_model.h"
#include "motion.h"

#include <string.h>

void setUp(void) {}
void tearDown(void) {}

static const body_t load = {450.0, {0.06, -0.04, 0.3}, {25.0, 30.0, 20.0, 1.0, -2.0, 0.5}};

static void read_load(hexload_real_t theta[HEXLOAD_LOAD_DIM]) {
    double exact[HEXLOAD_LOAD_DIM];
    theta_of(&load, exact);
    for (int k = 0; k < HEXLOAD_LOAD_DIM; k++) {
        theta[k] = (hexload_real_t)exact[k];
    }
}

/// The crooked machine in mid-motion.
static hexload_motion_t motion_at(uint32_t tick, hexload_config_t* config, hexload_leg_sample_t* sample) {
    const motion_t motion = random_motion(4, 0.05, 0.15);
    hexload_kinematics_t kinematics;
    hexload_motion_t found;
    *config = crooked_machine();
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_kinematics_init(&kinematics, config));
    *sample = perfect_sample(config, &load, &motion, (double)kinematics.home_height_m, tick);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_kinematics_solve(&kinematics, config, sample, &found));
    return found;
}

static void test_regressor_times_parameters_is_the_momentum(void) {
    hexload_config_t config;
    hexload_leg_sample_t sample;
    const hexload_motion_t motion = motion_at(123, &config, &sample);
    hexload_real_t theta[HEXLOAD_LOAD_DIM], momentum[6], product[2][6], Y[6][HEXLOAD_LOAD_DIM];
    read_load(theta);
    // GIVEN a body on the platform WHEN its momentum is computed in one go and by the regressor
    hexload_momentum_of_body(theta, &motion, motion.twist, momentum);
    hexload_momentum_regressor(&motion, motion.twist, Y);
    // THEN both agree: ten terms of up to 500 kg m/s
    hexload_momentum_rows(Y, theta, theta, 0, 6, product);
    for (int a = 0; a < 6; a++) {
        TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(40, 500.0), (double)momentum[a], (double)product[1][a]);
    }
}

static void test_momentum_grows_by_the_impulse_of_legs_and_gravity(void) {
    // GIVEN leg forces that inverse dynamics, written without the firmware's formulas, has found for a motion
    hexload_config_t config;
    hexload_leg_sample_t sample[2];
    const hexload_motion_t before = motion_at(200, &config, &sample[0]);
    const hexload_motion_t after = motion_at(201, &config, &sample[1]);
    hexload_real_t theta[HEXLOAD_LOAD_DIM], momentum[6], expected[6], G[PULLED][LIFTED];
    hexload_momentum_filter_t filter;
    hexload_momentum_input_t input[2];
    hexload_momentum_filter_init(&filter, &config);
    read_load(theta);
    for (int k = 0; k < HEXLOAD_LOAD_DIM; k++) {
        theta[k] += filter.platform[k];
    }
    hexload_momentum_of_body(theta, &before, before.twist, momentum);
    hexload_momentum_of_body(theta, &after, after.twist, expected);
    // WHEN the momentum is moved on by a tick
    hexload_momentum_read_input(&before, sample[0].force_n, &input[0]);
    hexload_momentum_read_input(&after, sample[1].force_n, &input[1]);
    hexload_momentum_pull(&input[0], &input[1], config.tick_s * config.gravity_m_s2, G);
    hexload_momentum_move(momentum, &input[0], &input[1], config.tick_s, G, theta);
    // THEN it is that of the next tick: the trapezoid errs by dt^3 / 12 f'' < 1e-5 N s at 3 Hz and 3 kN, and
    // the momenta come from poses and twists in the core's precision
    for (int k = 0; k < 6; k++) {
        TEST_ASSERT_DOUBLE_WITHIN(1e-4 + ROUNDINGS(400, 500.0), (double)expected[k], (double)momentum[k]);
    }
}

static void test_spread_is_the_variance_of_the_parameters_momentum(void) {
    // GIVEN a covariance of the parameters that is a a^T + b b^T WHEN it is spread by Y
    hexload_config_t config;
    hexload_leg_sample_t sample;
    const hexload_motion_t motion = motion_at(77, &config, &sample);
    hexload_momentum_filter_t filter;
    hexload_real_t a[HEXLOAD_LOAD_DIM], b[HEXLOAD_LOAD_DIM], Ya[6], Yb[6];
    hexload_real_t Y[6][HEXLOAD_LOAD_DIM], spread[6][6];
    uint64_t seed = 9;
    hexload_momentum_filter_init(&filter, &config);
    for (int i = 0; i < HEXLOAD_LOAD_DIM; i++) {
        a[i] = (hexload_real_t)uniform(&seed);
        b[i] = (hexload_real_t)uniform(&seed);
    }
    for (int i = 0; i < HEXLOAD_LOAD_DIM; i++) {
        for (int j = 0; j < HEXLOAD_LOAD_DIM; j++) {
            filter.load_cov[i][j] = a[i] * a[j] + b[i] * b[j];
        }
    }
    hexload_momentum_regressor(&motion, motion.twist, Y);
    hexload_momentum_spread(&filter, Y, spread);
    hexload_momentum_of_body(a, &motion, motion.twist, Ya);
    hexload_momentum_of_body(b, &motion, motion.twist, Yb);
    // THEN it is Y a (Y a)^T + Y b (Y b)^T
    for (int i = 0; i < 6; i++) {
        for (int j = 0; j <= i; j++) {
            TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(200, 1.0), (double)(Ya[i] * Ya[j] + Yb[i] * Yb[j]),
                                      (double)spread[i][j]);
        }
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_regressor_times_parameters_is_the_momentum);
    RUN_TEST(test_momentum_grows_by_the_impulse_of_legs_and_gravity);
    RUN_TEST(test_spread_is_the_variance_of_the_parameters_momentum);
    return UNITY_END();
}
