#include "motion.h"

#include <string.h>

void setUp(void) {}
void tearDown(void) {}

static const body_t paper_load = {500.0, {0.0, 0.0, 0.3}, {25.0, 25.0, 25.0, 0.0, 0.0, 0.0}};

/// Runs `ticks` of the paper's motion with the noise of a seed, the tick counter starting at first_tick.
static hexload_estimate_t run(hexload_paper_t* estimator, const hexload_config_t* config, uint32_t ticks,
                              uint64_t seed, uint32_t first_tick) {
    const motion_t motion = paper_motion(0.002);
    hexload_estimate_t estimate = {0};
    for (uint32_t tick = 0; tick < ticks; tick++) {
        hexload_leg_sample_t sample =
            perfect_sample(config, &paper_load, &motion, (double)estimator->kinematics.home_height_m, tick);
        add_noise(config, &seed, &sample);
        sample.tick += first_tick;
        TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_paper_tick(estimator, config, &sample, &estimate));
    }
    return estimate;
}

static void test_init_refuses_a_bad_configuration_and_leaves_the_instance_alone(void) {
    hexload_config_t config = paper_machine();
    hexload_paper_t estimator, before;
    memset(&estimator, 0x5A, sizeof estimator);
    memcpy(&before, &estimator, sizeof before);
    config.platform.mass_kg = HEXLOAD_REAL(0.0);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_ERR_CONFIG, hexload_paper_init(&estimator, &config));
    TEST_ASSERT_EQUAL_MEMORY(&before, &estimator, sizeof before);
}

static void test_refused_sample_changes_nothing_but_the_counter(void) {
    // GIVEN a running estimator
    const hexload_config_t config = paper_machine();
    hexload_paper_t estimator;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_paper_init(&estimator, &config));
    const hexload_estimate_t last = run(&estimator, &config, 50, 1, 0);
    hexload_paper_t before;
    memcpy(&before, &estimator, sizeof before); // padding too
    // WHEN it is given a NaN, an old tick and legs that no pose has
    hexload_leg_sample_t broken[3] = {{.tick = 50}, {.tick = 49}, {.tick = 50}};
    broken[0].force_n[3] = (hexload_real_t)NAN;
    broken[2].displacement_m[0] = HEXLOAD_REAL(0.8);
    hexload_estimate_t estimate = last;
    for (int n = 0; n < 3; n++) {
        TEST_ASSERT_NOT_EQUAL(HEXLOAD_OK, hexload_paper_tick(&estimator, &config, &broken[n], &estimate));
    }
    // THEN only the count of refusals has changed
    TEST_ASSERT_EQUAL_UINT32(before.health.refused + 3, estimator.health.refused);
    estimator.health.refused = before.health.refused;
    TEST_ASSERT_EQUAL_MEMORY(&before, &estimator, sizeof before);
    TEST_ASSERT_EQUAL_MEMORY(&last, &estimate, sizeof last);
}

static void test_two_instances_do_not_know_of_each_other(void) {
    const hexload_config_t config = paper_machine();
    const motion_t motion = paper_motion(0.002);
    hexload_paper_t alone, first, second;
    hexload_estimate_t estimate;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_paper_init(&alone, &config));
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_paper_init(&first, &config));
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_paper_init(&second, &config));
    // GIVEN one estimator that runs alone and the same interleaved with another on another load
    run(&alone, &config, 200, 1, 0);
    const body_t other_load = {300.0, {0.0, 0.0, 0.1}, {5.0, 6.0, 7.0, 0.0, 0.0, 0.0}};
    uint64_t seed = 1, other_seed = 2;
    for (uint32_t tick = 0; tick < 200; tick++) {
        hexload_leg_sample_t sample =
            perfect_sample(&config, &paper_load, &motion, (double)first.kinematics.home_height_m, tick);
        hexload_leg_sample_t other =
            perfect_sample(&config, &other_load, &motion, (double)second.kinematics.home_height_m, tick);
        add_noise(&config, &seed, &sample);
        add_noise(&config, &other_seed, &other);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_paper_tick(&second, &config, &other, &estimate));
        TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_paper_tick(&first, &config, &sample, &estimate));
    }
    // THEN both came to the same state, bit by bit
    const hexload_paper_filter_t *expected = &alone.filter, *found = &first.filter;
    TEST_ASSERT_EQUAL_MEMORY(expected->rate_rad_s, found->rate_rad_s, sizeof found->rate_rad_s);
    TEST_ASSERT_EQUAL_MEMORY(expected->param, found->param, sizeof found->param);
    TEST_ASSERT_EQUAL_MEMORY(expected->param_cov, found->param_cov, sizeof found->param_cov);
}

static void test_tick_counter_may_wrap_in_mid_run(void) {
    const hexload_config_t config = paper_machine();
    hexload_paper_t plain, wrapping;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_paper_init(&plain, &config));
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_paper_init(&wrapping, &config));
    const hexload_estimate_t expected = run(&plain, &config, 200, 3, 0);
    const hexload_estimate_t wrapped = run(&wrapping, &config, 200, 3, UINT32_MAX - 100);
    TEST_ASSERT_EQUAL_MEMORY(expected.value, wrapped.value, sizeof expected.value);
    TEST_ASSERT_EQUAL_UINT32(98, wrapped.tick);
}

static void test_health_counts_every_tick_out_of_stroke(void) {
    hexload_config_t config = paper_machine();
    config.geometry.stroke_max_m = HEXLOAD_REAL(0.01); // the paper's motion goes to 0.15 m
    hexload_paper_t estimator;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_paper_init(&estimator, &config));
    run(&estimator, &config, 500, 4, 0);
    TEST_ASSERT_GREATER_THAN_UINT32(400, estimator.health.count[HEXLOAD_HEALTH_LEG_OUT_OF_STROKE]);
    TEST_ASSERT_BITS_HIGH(1u << HEXLOAD_HEALTH_LEG_OUT_OF_STROKE, estimator.health.bits);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_init_refuses_a_bad_configuration_and_leaves_the_instance_alone);
    RUN_TEST(test_refused_sample_changes_nothing_but_the_counter);
    RUN_TEST(test_two_instances_do_not_know_of_each_other);
    RUN_TEST(test_tick_counter_may_wrap_in_mid_run);
    RUN_TEST(test_health_counts_every_tick_out_of_stroke);
    return UNITY_END();
}
