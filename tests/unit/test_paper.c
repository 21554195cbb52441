#include "motion.h"
#include "paper/known_mass.h"

#include <math.h>
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

/// What an estimator of `believed` says of four seconds of a brisk motion on `machine`, whose force sensors
/// show 1 + gain times the force and whose noise is `noise` times the machine's.
static hexload_estimate_t identify(const hexload_config_t* machine, const hexload_config_t* believed,
                                   double gain, double noise, hexload_paper_t* estimator) {
    const motion_t motion = random_motion(46, 0.05, 0.1);
    hexload_config_t noisy = *machine;
    hexload_estimate_t estimate = {0};
    uint64_t seed = 12;
    noisy.sensors.displacement_sigma_m *= (hexload_real_t)noise;
    noisy.sensors.velocity_sigma_m_s *= (hexload_real_t)noise;
    noisy.sensors.force_sigma_n *= (hexload_real_t)noise;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_paper_init(estimator, believed));
    for (uint32_t tick = 0; tick < 4000; tick++) {
        hexload_leg_sample_t sample =
            perfect_sample(machine, &paper_load, &motion, (double)estimator->kinematics.home_height_m, tick);
        add_noise(&noisy, &seed, &sample);
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            sample.force_n[leg] *= (hexload_real_t)(1.0 + gain);
        }
        TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_paper_tick(estimator, believed, &sample, &estimate));
    }
    return estimate;
}

/// D of platform and load about the axes of the paper's machine, whose platform's centre is O_A.
static void combined_inertia(const hexload_config_t* config, double D[3]) {
    const double own = (double)config->platform.mass_kg;
    const double reduced = own * paper_load.mass_kg / (own + paper_load.mass_kg);
    for (int k = 0; k < 3; k++) {
        D[k] = (double)config->platform.inertia_kg_m2[k] + 25.0 + (k < 2 ? reduced * 0.3 * 0.3 : 0.0);
    }
}

static void test_a_common_gain_is_that_share_of_all_inertia_and_sigma_has_it(void) {
    // GIVEN force sensors that all show three thousandths too much, as their tolerance says, WHEN a load
    // moves
    const double gain = 0.003;
    const hexload_config_t machine = paper_machine();
    hexload_config_t believed = machine;
    believed.tolerances.force_gain = (hexload_real_t)gain;
    hexload_paper_t estimator;
    const hexload_estimate_t exact = identify(&machine, &machine, 0.0, 1.0, &estimator);
    const hexload_estimate_t off = identify(&machine, &believed, gain, 1.0, &estimator);
    double D[3];
    combined_inertia(&machine, D);
    // THEN dz stays, AND each inertia is off by that share of the load's and the platform's together
    TEST_ASSERT_DOUBLE_WITHIN((double)exact.own_sigma[0], 0.0, (double)(off.value[0] - exact.value[0]));
    for (int k = 0; k < 3; k++) {
        const int own = HEXLOAD_PAPER_IXX + k;
        TEST_ASSERT_DOUBLE_WITHIN((double)exact.own_sigma[own], gain * D[k],
                                  (double)(off.value[own] - exact.value[own]));
        // AND sigma has it
        const double expected = hypot((double)off.own_sigma[own], gain * D[k]);
        TEST_ASSERT_DOUBLE_WITHIN(0.02 * expected, expected, (double)off.sigma[own]);
    }
}

static void test_what_the_platform_is_off_moves_the_papers_parameters_as_sigma_says(void) {
    // GIVEN one of the platform's mass, height of its centre and inertia, which is not as believed
    const hexload_config_t machine = paper_machine();
    hexload_paper_t estimator;
    const hexload_estimate_t exact = identify(&machine, &machine, 0.0, 1.0, &estimator);
    for (int source = 0; source < 3; source++) {
        hexload_config_t believed = machine;
        if (source == 0) {
            believed.platform.mass_kg *= HEXLOAD_REAL(1.02);
            believed.tolerances.platform_mass = HEXLOAD_REAL(0.02);
        } else if (source == 1) {
            believed.platform.com_m[2] = HEXLOAD_REAL(0.004);
            believed.tolerances.platform_com_m = HEXLOAD_REAL(0.004);
        } else {
            believed.tolerances.platform_inertia = HEXLOAD_REAL(0.03);
            for (int k = 0; k < 3; k++) {
                believed.platform.inertia_kg_m2[k] *= HEXLOAD_REAL(0.97);
            }
        }
        // WHEN a load moves
        const hexload_estimate_t off = identify(&machine, &believed, 0.0, 1.0, &estimator);
        for (int k = 0; k < HEXLOAD_PAPER_DIM; k++) {
            // THEN its parameters are off by as much as sigma says beside the filter's own part
            const double shift = fabs((double)(off.value[k] - exact.value[k]));
            const double own = (double)exact.own_sigma[k];
            const double open =
                sqrt(fmax(0.0, pow((double)off.sigma[k], 2.0) - pow((double)off.own_sigma[k], 2.0)));
            TEST_ASSERT_DOUBLE_WITHIN(0.5 * own + 0.05 * open, open, shift);
        }
    }
}

static void test_without_tolerances_the_papers_sigma_is_the_filters(void) {
    // GIVEN a machine known exactly and sensors as stated WHEN a load moves THEN every bit of sigma is the
    // filter's
    const hexload_config_t machine = paper_machine();
    hexload_paper_t estimator;
    const hexload_estimate_t estimate = identify(&machine, &machine, 0.0, 1.0, &estimator);
    TEST_ASSERT_EQUAL_MEMORY(estimate.own_sigma, estimate.sigma, sizeof estimate.sigma);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_VERDICT_CONVERGED, estimate.verdict);
    // AND no noise is found misstated
    TEST_ASSERT_EQUAL_UINT32(0, estimator.health.count[HEXLOAD_HEALTH_NOISE_MISSTATED]);
}

static void test_noise_that_is_misstated_is_measured_by_the_papers_estimator(void) {
    // GIVEN sensors three times as noisy as stated WHEN a load moves
    const double truth[HEXLOAD_PAPER_DIM] = {0.3, 25.0, 25.0, 25.0};
    const hexload_config_t machine = paper_machine();
    hexload_paper_t estimator;
    const hexload_estimate_t estimate = identify(&machine, &machine, 0.0, 3.0, &estimator);
    // THEN it says so, is right within five sigmas, and has converged with innovations of the mean square 3
    TEST_ASSERT_BITS_HIGH(1u << HEXLOAD_HEALTH_NOISE_MISSTATED, estimator.health.bits);
    TEST_ASSERT_EQUAL_UINT32(0, estimator.health.count[HEXLOAD_HEALTH_INCONSISTENT]);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_VERDICT_CONVERGED, estimate.verdict);
    TEST_ASSERT_DOUBLE_WITHIN(0.6, 3.0, (double)estimate.nis_mean);
    for (int k = 0; k < HEXLOAD_PAPER_DIM; k++) {
        TEST_ASSERT_DOUBLE_WITHIN(5.0 * (double)estimate.sigma[k], truth[k], (double)estimate.value[k]);
    }
}

static void test_a_weight_that_is_not_that_of_the_masses_widens_sigma(void) {
    // GIVEN force sensors that all show two per cent too much, of which no tolerance says anything
    const double gain = 0.02;
    const hexload_config_t machine = paper_machine();
    hexload_paper_t estimator;
    const hexload_estimate_t exact = identify(&machine, &machine, 0.0, 1.0, &estimator);
    // WHEN a load of known mass moves for four seconds
    const hexload_estimate_t off = identify(&machine, &machine, gain, 1.0, &estimator);
    // THEN its weight says so, within a tenth, of which the eccentric load's rotation over 2 s is the most
    TEST_ASSERT_DOUBLE_WITHIN(0.1 * gain, gain, (double)estimator.known_mass.weight_error);
    // AND the inertias' error is within two of their sigmas, of whose own part it is many
    for (int k = HEXLOAD_PAPER_IXX; k < HEXLOAD_PAPER_DIM; k++) {
        const double error = (double)(off.value[k] - exact.value[k]);
        TEST_ASSERT_TRUE(error > 5.0 * (double)off.own_sigma[k]);
        TEST_ASSERT_TRUE(error < 2.0 * (double)off.sigma[k]);
    }
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
    // AND none of those within
    config.geometry.stroke_max_m = HEXLOAD_REAL(0.5);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_paper_init(&estimator, &config));
    run(&estimator, &config, 500, 4, 0);
    TEST_ASSERT_EQUAL_UINT32(0, estimator.health.count[HEXLOAD_HEALTH_LEG_OUT_OF_STROKE]);
}

static void test_a_lost_force_lets_the_papers_filter_wait_and_go_on(void) {
    // GIVEN the paper's motion, in which one force is missing from the start, or for 20 ticks in mid-run
    for (uint32_t from = 0; from <= 300; from += 300) {
        const hexload_config_t config = paper_machine();
        const motion_t motion = paper_motion(0.002);
        hexload_paper_t estimator;
        hexload_estimate_t estimate, before = {0};
        uint64_t seed = 5;
        TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_paper_init(&estimator, &config));
        for (uint32_t tick = 0; tick < 600; tick++) {
            hexload_leg_sample_t sample = perfect_sample(&config, &paper_load, &motion,
                                                         (double)estimator.kinematics.home_height_m, tick);
            const bool is_lost = tick >= from && tick < from + 20;
            add_noise(&config, &seed, &sample);
            sample.force_n[4] = is_lost ? (hexload_real_t)NAN : sample.force_n[4];
            TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_paper_tick(&estimator, &config, &sample, &estimate));
            // WHEN it is missing THEN that is said, and values and sigmas stay as they were
            TEST_ASSERT_EQUAL(is_lost, (estimator.health.bits >> HEXLOAD_HEALTH_CHANNEL_LOST & 1u) != 0);
            if (is_lost && tick > from) {
                TEST_ASSERT_EQUAL_MEMORY(before.value, estimate.value, sizeof before.value);
                TEST_ASSERT_EQUAL_MEMORY(before.own_sigma, estimate.own_sigma, sizeof before.own_sigma);
            }
            // AND when it is back rates restart, as after a gap of 20 ticks
            TEST_ASSERT_EQUAL(tick == from + 20,
                              (estimator.health.bits >> HEXLOAD_HEALTH_RATE_RESEEDED & 1u) != 0);
            before = estimate;
        }
        // AND the load is found all the same: dz of 0.3 m within four of its sigmas
        TEST_ASSERT_DOUBLE_WITHIN(4.0 * (double)estimate.sigma[0], 0.3, (double)estimate.value[0]);
    }
}

static void test_a_force_that_is_lost_for_a_tick_or_two_is_a_gap_that_the_trapezoid_bridges(void) {
    // GIVEN the paper's motion without noise, in which a force is missing now and then WHEN no other is, for
    // as long as a trapezoid bridges
    for (uint32_t lost = 1; lost < paper_machine().paper.longest_gap_ticks; lost++) {
        const hexload_config_t config = paper_machine();
        const motion_t motion = paper_motion(0.002);
        hexload_paper_t estimator, gapped;
        hexload_estimate_t estimate, expected;
        TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_paper_init(&estimator, &config));
        TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_paper_init(&gapped, &config));
        for (uint32_t tick = 0; tick < 600; tick++) {
            hexload_leg_sample_t sample = perfect_sample(&config, &paper_load, &motion,
                                                         (double)estimator.kinematics.home_height_m, tick);
            const bool is_lost = tick % 50 >= 50 - lost;
            if (!is_lost) {
                TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_paper_tick(&gapped, &config, &sample, &expected));
            }
            sample.force_n[4] = is_lost ? (hexload_real_t)NAN : sample.force_n[4];
            TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_paper_tick(&estimator, &config, &sample, &estimate));
            // THEN no rate restarts
            TEST_ASSERT_EQUAL_UINT32(0, estimator.health.bits >> HEXLOAD_HEALTH_RATE_RESEEDED & 1u);
        }
        // AND the load is the one that is found when those samples are missing as a whole
        for (int k = 0; k < HEXLOAD_PAPER_DIM; k++) {
            TEST_ASSERT_DOUBLE_WITHIN((double)expected.sigma[k], (double)expected.value[k],
                                      (double)estimate.value[k]);
        }
    }
}

static void test_a_force_that_stays_away_does_not_wrap_the_time_held(void) {
    // GIVEN a filter that has been held for as long as it can count WHEN one more force is missing, and then
    // none THEN its rates restart as after any long gap
    const hexload_config_t config = paper_machine();
    hexload_paper_t estimator;
    hexload_estimate_t estimate;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_paper_init(&estimator, &config));
    run(&estimator, &config, 50, 1, 0);
    estimator.held_ticks = UINT32_MAX;
    hexload_leg_sample_t sample = {.tick = 50};
    memcpy(sample.displacement_m, estimator.leg_gate.last_displacement_m, sizeof sample.displacement_m);
    for (; sample.tick < 52; sample.tick++) {
        sample.force_n[0] = sample.tick == 50 ? (hexload_real_t)NAN : HEXLOAD_REAL(900.0);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_paper_tick(&estimator, &config, &sample, &estimate));
    }
    TEST_ASSERT_EQUAL_UINT32(0, estimator.held_ticks);
    TEST_ASSERT_BITS_HIGH(1u << HEXLOAD_HEALTH_RATE_RESEEDED, estimator.health.bits);
}

static void test_a_guessed_force_says_nothing_of_the_stated_mass(void) {
    // GIVEN a platform at rest under the load that is stated, which leans on one leg by 2 kN more than on the
    // others
    const hexload_config_t config = paper_machine();
    hexload_paper_t estimator;
    hexload_estimate_t estimate;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_paper_init(&estimator, &config));
    const hexload_real_t steepness =
        estimator.kinematics.home_height_m / config.geometry.home_leg_length_m[0]; // of all legs
    const hexload_real_t push_n = HEXLOAD_REAL(5886.0) / steepness;
    const hexload_real_t share_n = (push_n - HEXLOAD_REAL(2000.0)) / HEXLOAD_REAL(6.0);
    for (uint32_t tick = 0; tick < 3000; tick++) {
        hexload_leg_sample_t sample = {.tick = tick};
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            sample.force_n[leg] = leg == 2 ? share_n + HEXLOAD_REAL(2000.0) : share_n;
        }
        // WHEN that leg's force stays away, so that it is guessed from the others
        sample.force_n[2] = tick < 500 ? sample.force_n[2] : (hexload_real_t)NAN;
        TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_paper_tick(&estimator, &config, &sample, &estimate));
    }
    // THEN the stated mass is not called wrong
    TEST_ASSERT_FALSE(estimator.known_mass.is_contradicted);
}

static void test_what_a_rig_may_be_off_by_is_no_wrong_mass(void) {
    // GIVEN legs whose friction grows by 2 % of their force, or whose gain is 2 % off WHEN the stated mass is
    // checked THEN 2 % of the weight more are allowed
    const double weight_n = (100.0 + 500.0) * 9.81;
    hexload_config_t config = paper_machine();
    hexload_known_mass_t plain, rubbing, shown;
    hexload_known_mass_init(&plain, &config);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        config.rig.growth_n_n[leg] = HEXLOAD_REAL(0.02);
    }
    hexload_known_mass_init(&rubbing, &config);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        config.rig.force_gain[leg] = HEXLOAD_REAL(-0.02);
    }
    hexload_known_mass_init(&shown, &config);
    TEST_ASSERT_DOUBLE_WITHIN(1e-5 * weight_n, 0.02 * weight_n, (double)(rubbing.limit_n - plain.limit_n));
    TEST_ASSERT_DOUBLE_WITHIN(1e-5 * weight_n, 0.04 * weight_n, (double)(shown.limit_n - plain.limit_n));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_init_refuses_a_bad_configuration_and_leaves_the_instance_alone);
    RUN_TEST(test_refused_sample_changes_nothing_but_the_counter);
    RUN_TEST(test_two_instances_do_not_know_of_each_other);
    RUN_TEST(test_tick_counter_may_wrap_in_mid_run);
    RUN_TEST(test_a_common_gain_is_that_share_of_all_inertia_and_sigma_has_it);
    RUN_TEST(test_what_the_platform_is_off_moves_the_papers_parameters_as_sigma_says);
    RUN_TEST(test_without_tolerances_the_papers_sigma_is_the_filters);
    RUN_TEST(test_noise_that_is_misstated_is_measured_by_the_papers_estimator);
    RUN_TEST(test_a_weight_that_is_not_that_of_the_masses_widens_sigma);
    RUN_TEST(test_health_counts_every_tick_out_of_stroke);
    RUN_TEST(test_a_lost_force_lets_the_papers_filter_wait_and_go_on);
    RUN_TEST(test_a_force_that_is_lost_for_a_tick_or_two_is_a_gap_that_the_trapezoid_bridges);
    RUN_TEST(test_a_force_that_stays_away_does_not_wrap_the_time_held);
    RUN_TEST(test_a_guessed_force_says_nothing_of_the_stated_mass);
    RUN_TEST(test_what_a_rig_may_be_off_by_is_no_wrong_mass);
    return UNITY_END();
}
