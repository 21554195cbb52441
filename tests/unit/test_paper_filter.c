#include "motion.h"

#include <stdbool.h>

void setUp(void) {}
void tearDown(void) {}

static const body_t paper_load = {500.0, {0.0, 0.0, 0.3}, {25.0, 25.0, 25.0, 0.0, 0.0, 0.0}};

/// The estimator after `seconds` of a motion; seed 0: perfect sensors. Ticks from skip_from to skip_to are
/// lost.
static hexload_paper_t run(const hexload_config_t* config, const body_t* load, const motion_t* motion,
                           double seconds, uint64_t seed, uint32_t skip_from, uint32_t skip_to,
                           hexload_estimate_t* estimate) {
    hexload_paper_t estimator;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_paper_init(&estimator, config));
    const double home_height_m = (double)estimator.kinematics.home_height_m;
    const bool is_noisy = seed != 0;
    const uint32_t ticks = (uint32_t)(seconds / (double)config->tick_s);
    for (uint32_t tick = 0; tick <= ticks; tick++) {
        hexload_leg_sample_t sample = perfect_sample(config, load, motion, home_height_m, tick);
        if (is_noisy) {
            add_noise(config, &seed, &sample);
        }
        if (tick < skip_from || tick >= skip_to) {
            TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_paper_tick(&estimator, config, &sample, estimate));
        }
    }
    return estimator;
}

static void truth_of(const body_t* load, double truth[HEXLOAD_PAPER_DIM]) {
    truth[HEXLOAD_PAPER_DZ] = load->com_m[2];
    for (int k = 0; k < 3; k++) {
        truth[HEXLOAD_PAPER_IXX + k] = load->inertia_com_kg_m2[k];
    }
}

static void assert_within_percent(const body_t* load, const hexload_estimate_t* estimate,
                                  const double percent[HEXLOAD_PAPER_DIM]) {
    double truth[HEXLOAD_PAPER_DIM];
    truth_of(load, truth);
    for (int k = 0; k < HEXLOAD_PAPER_DIM; k++) {
        TEST_ASSERT_DOUBLE_WITHIN(0.01 * percent[k] * truth[k], truth[k], (double)estimate->value[k]);
    }
}

static void test_filter_identifies_the_papers_load_on_the_papers_motion(void) {
    // GIVEN perfect sensors on (23), with the 2 mrad of tilt that a servo leaves
    const hexload_config_t config = paper_machine();
    const motion_t motion = paper_motion(0.002);
    hexload_estimate_t estimate;
    // WHEN ten seconds have passed
    run(&config, &paper_load, &motion, 10.0, 0, 0, 0, &estimate);
    // THEN the errors are below the clean-log limits of the issue
    assert_within_percent(&paper_load, &estimate, (const double[]){0.1, 1.0, 1.0, 1.0});
}

static void test_filter_holds_for_large_tilts_and_any_motion(void) {
    // GIVEN a load with three different inertias that is turned by up to 10 degrees about all axes at up to 3
    // Hz
    hexload_config_t config = paper_machine();
    config.paper.load_mass_kg = HEXLOAD_REAL(300.0);
    const body_t load = {300.0, {0.0, 0.0, 0.45}, {30.0, 20.0, 12.0, 0.0, 0.0, 0.0}};
    const motion_t motion = random_motion(11, 0.04, 0.17);
    hexload_estimate_t estimate;
    // WHEN ten seconds have passed
    run(&config, &load, &motion, 10.0, 0, 0, 0, &estimate);
    // THEN no small-angle error is left (1 - cos 10 degrees is 1.5 %): only the trapezoid's, (w dt)^2 / 12 at
    // 3 Hz, 3e-5, and what the start from zero still weighs after ten seconds
    assert_within_percent(&load, &estimate, (const double[]){0.05, 0.1, 0.1, 0.1});
}

static void test_filter_takes_the_platforms_own_mass_distribution_into_account(void) {
    // GIVEN a platform whose centre of mass is 6 cm off O_A, with products of inertia, on a crooked machine
    const hexload_config_t config = crooked_machine();
    const motion_t motion = random_motion(12, 0.04, 0.1);
    hexload_estimate_t estimate;
    // WHEN ten seconds have passed
    run(&config, &paper_load, &motion, 10.0, 0, 0, 0, &estimate);
    // THEN the load comes out as on a platform that is symmetric
    assert_within_percent(&paper_load, &estimate, (const double[]){0.05, 0.2, 0.2, 0.2});
}

static void test_errors_agree_with_the_stated_sigmas(void) {
    // GIVEN 20 runs with nominal noise on different motions
    const hexload_config_t config = paper_machine();
    double truth[HEXLOAD_PAPER_DIM], square[HEXLOAD_PAPER_DIM] = {0}, nis = 0.0;
    const int runs = 20;
    truth_of(&paper_load, truth);
    for (int n = 0; n < runs; n++) {
        const motion_t motion = random_motion(100 + (uint64_t)n, 0.03, 0.03);
        hexload_estimate_t estimate;
        run(&config, &paper_load, &motion, 2.0, 500 + (uint64_t)n, 0, 0, &estimate);
        for (int k = 0; k < HEXLOAD_PAPER_DIM; k++) {
            const double error = ((double)estimate.value[k] - truth[k]) / (double)estimate.sigma[k];
            square[k] += error * error / runs;
        }
        nis += (double)estimate.nis_mean / runs;
    }
    // THEN the mean square of error over sigma is that of 20 standard normal numbers: 0.999 quantile of
    // chi-square / 20 is 2.27; below 1 is only cautious
    for (int k = 0; k < HEXLOAD_PAPER_DIM; k++) {
        TEST_ASSERT_TRUE(square[k] < 2.27);
    }
    // and the mean NIS over 0.5 s is 3: 20 runs x 1000 independent ticks leave 3 sqrt(2/3 / 20000) = 0.017,
    // five sigma
    TEST_ASSERT_DOUBLE_WITHIN(0.09, 3.0, nis);
}

static void test_sigma_stays_at_the_prior_when_nothing_moves(void) {
    // GIVEN a platform at rest under nominal noise
    const hexload_config_t config = paper_machine();
    const motion_t rest = {.frequency_hz = {{0.0}}};
    hexload_estimate_t estimate;
    // WHEN five seconds have passed
    run(&config, &paper_load, &rest, 5.0, 21, 0, 0, &estimate);
    // THEN noise has not been taken for motion: sigma is still above half the prior's, where the verdict says
    // so
    TEST_ASSERT_TRUE((double)estimate.sigma[HEXLOAD_PAPER_DZ] > 0.5 * sqrt(0.1));
    // and has not moved dz, which starts one prior sigma off, by more than it may
    TEST_ASSERT_DOUBLE_WITHIN(4.0 * sqrt(0.1), 0.0, (double)estimate.value[HEXLOAD_PAPER_DZ]);
    for (int k = HEXLOAD_PAPER_IXX; k < HEXLOAD_PAPER_DIM; k++) {
        TEST_ASSERT_TRUE((double)estimate.sigma[k] > 0.5 * sqrt(500.0));
        TEST_ASSERT_EQUAL_INT(HEXLOAD_VERDICT_NOT_EXCITED, estimate.parameter_verdict[k]);
    }
}

static void test_missing_samples_are_bridged(void) {
    // GIVEN two lost ticks in the middle of a motion
    const hexload_config_t config = paper_machine();
    const motion_t motion = random_motion(13, 0.03, 0.03);
    hexload_estimate_t estimate;
    // WHEN the run ends
    const hexload_paper_t estimator = run(&config, &paper_load, &motion, 2.0, 0, 1000, 1002, &estimate);
    // THEN it was said once, and costs nothing to speak of: the trapezoid over 3 ms errs by (w T)^2 / 12 of 3
    // Hz, 3e-4, in one of 2000 steps
    TEST_ASSERT_EQUAL_UINT32(1, estimator.health.count[HEXLOAD_HEALTH_SAMPLE_MISSING]);
    TEST_ASSERT_EQUAL_UINT32(0, estimator.health.count[HEXLOAD_HEALTH_RATE_RESEEDED]);
    assert_within_percent(&paper_load, &estimate, (const double[]){0.1, 0.2, 0.2, 0.2});
}

static void test_force_spike_at_any_time_leaves_a_finite_and_recovering_estimate(void) {
    static const uint32_t spike_ticks[] = {3, 100, 1000};
    const hexload_config_t config = paper_machine();
    const motion_t motion = random_motion(17, 0.03, 0.03);
    double truth[HEXLOAD_PAPER_DIM];
    truth_of(&paper_load, truth);
    for (int n = 0; n < 3; n++) {
        // GIVEN one leg's force that is wrong by 100 kN in one tick
        hexload_paper_t estimator;
        hexload_estimate_t estimate;
        uint64_t seed = 51;
        TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_paper_init(&estimator, &config));
        for (uint32_t tick = 0; tick < 4000; tick++) {
            hexload_leg_sample_t sample = perfect_sample(&config, &paper_load, &motion,
                                                         (double)estimator.kinematics.home_height_m, tick);
            add_noise(&config, &seed, &sample);
            sample.force_n[4] += tick == spike_ticks[n] ? HEXLOAD_REAL(1e5) : HEXLOAD_REAL(0.0);
            // WHEN the run goes on
            TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_paper_tick(&estimator, &config, &sample, &estimate));
        }
        // THEN the estimate has come back to within six sigma or 2 %
        for (int k = 0; k < HEXLOAD_PAPER_DIM; k++) {
            const double tolerance = fmax(6.0 * (double)estimate.sigma[k], 0.02 * truth[k]);
            TEST_ASSERT_DOUBLE_WITHIN(tolerance, truth[k], (double)estimate.value[k]);
        }
    }
}

static void test_centre_of_mass_in_the_platform_plane_converges_too(void) {
    // GIVEN a load with dz = 0, where no sigma is small beside the value
    const hexload_config_t config = paper_machine();
    const body_t load = {500.0, {0.0, 0.0, 0.0}, {25.0, 25.0, 25.0, 0.0, 0.0, 0.0}};
    const motion_t motion = random_motion(18, 0.03, 0.03);
    hexload_estimate_t estimate;
    run(&config, &load, &motion, 3.0, 61, 0, 0, &estimate);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_VERDICT_CONVERGED, estimate.parameter_verdict[HEXLOAD_PAPER_DZ]);
    TEST_ASSERT_DOUBLE_WITHIN(5.0 * (double)estimate.sigma[HEXLOAD_PAPER_DZ], 0.0,
                              (double)estimate.value[HEXLOAD_PAPER_DZ]);
}

static void test_rates_restart_after_a_long_gap_and_parameters_stay(void) {
    const hexload_config_t config = paper_machine();
    const motion_t motion = random_motion(14, 0.03, 0.03);
    hexload_estimate_t estimate;
    const hexload_paper_t estimator = run(&config, &paper_load, &motion, 2.0, 0, 1000, 1300, &estimate);
    TEST_ASSERT_EQUAL_UINT32(1, estimator.health.count[HEXLOAD_HEALTH_RATE_RESEEDED]);
    assert_within_percent(&paper_load, &estimate, (const double[]){0.1, 1.0, 1.0, 1.0});
}

/// A converged estimator and the next sample of its motion.
static hexload_paper_t converged(const hexload_config_t* config, hexload_leg_sample_t* next) {
    const motion_t motion = random_motion(15, 0.03, 0.03);
    hexload_estimate_t estimate;
    const hexload_paper_t estimator = run(config, &paper_load, &motion, 1.0, 31, 0, 0, &estimate);
    *next = perfect_sample(config, &paper_load, &motion, (double)estimator.kinematics.home_height_m, 1001);
    return estimator;
}

static void test_velocity_spike_is_gated_and_changes_no_parameter(void) {
    // GIVEN a converged filter
    const hexload_config_t config = paper_machine();
    hexload_leg_sample_t sample;
    hexload_estimate_t estimate;
    hexload_paper_t estimator = converged(&config, &sample);
    const hexload_paper_filter_t before = estimator.filter;
    // WHEN one velocity reads 0.1 m/s too much
    sample.velocity_m_s[2] += HEXLOAD_REAL(0.1);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_paper_tick(&estimator, &config, &sample, &estimate));
    // THEN the tick says so and the parameters are what they were
    TEST_ASSERT_BITS_HIGH(1u << HEXLOAD_HEALTH_MEASUREMENT_GATED, estimator.health.bits);
    TEST_ASSERT_EQUAL_MEMORY(before.param, estimator.filter.param, sizeof before.param);
}

static void test_gate_opens_when_the_new_rate_stays(void) {
    // GIVEN a converged filter whose platform is suddenly turning, without any force that says why
    const hexload_config_t config = paper_machine();
    hexload_leg_sample_t sample;
    hexload_estimate_t estimate;
    hexload_paper_t estimator = converged(&config, &sample);
    // WHEN that goes on for longer than the gate may stay shut
    for (uint32_t n = 0; n <= config.paper.longest_gate_ticks; n++) {
        sample.tick = 1001 + n;
        sample.velocity_m_s[2] = HEXLOAD_REAL(0.5);
        TEST_ASSERT_EQUAL_UINT32(0, estimator.health.count[HEXLOAD_HEALTH_RATE_RESEEDED]); // not yet
        TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_paper_tick(&estimator, &config, &sample, &estimate));
    }
    // THEN the rates restart from the sensors
    TEST_ASSERT_EQUAL_UINT32(1, estimator.health.count[HEXLOAD_HEALTH_RATE_RESEEDED]);
    TEST_ASSERT_EQUAL_UINT32(0, estimator.filter.gated);
}

static void test_covariance_stays_positive_definite(void) {
    const hexload_config_t config = paper_machine();
    const motion_t motion = random_motion(16, 0.03, 0.05);
    hexload_estimate_t estimate;
    const hexload_paper_t estimator = run(&config, &paper_load, &motion, 5.0, 41, 0, 0, &estimate);
    const hexload_paper_filter_t* filter = &estimator.filter;
    for (int i = 0; i < HEXLOAD_PAPER_DIM; i++) {
        TEST_ASSERT_TRUE((double)filter->param_cov[i][i] > 0.0);
        for (int j = 0; j < i; j++) {
            const double product = (double)filter->param_cov[i][i] * (double)filter->param_cov[j][j];
            TEST_ASSERT_TRUE((double)filter->param_cov[i][j] * (double)filter->param_cov[i][j] < product);
        }
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_filter_identifies_the_papers_load_on_the_papers_motion);
    RUN_TEST(test_filter_holds_for_large_tilts_and_any_motion);
    RUN_TEST(test_filter_takes_the_platforms_own_mass_distribution_into_account);
    RUN_TEST(test_sigma_stays_at_the_prior_when_nothing_moves);
    RUN_TEST(test_missing_samples_are_bridged);
    RUN_TEST(test_force_spike_at_any_time_leaves_a_finite_and_recovering_estimate);
    RUN_TEST(test_centre_of_mass_in_the_platform_plane_converges_too);
    RUN_TEST(test_rates_restart_after_a_long_gap_and_parameters_stay);
    RUN_TEST(test_velocity_spike_is_gated_and_changes_no_parameter);
    RUN_TEST(test_gate_opens_when_the_new_rate_stays);
    RUN_TEST(test_covariance_stays_positive_definite);
    RUN_TEST(test_errors_agree_with_the_stated_sigmas);
    return UNITY_END();
}
