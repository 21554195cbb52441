#include "hexload/hexload.h"
#include "momentum/tolerances.h"
#include "paper/paper_tolerances.h"
#include "motion.h"

#include <math.h>
#include <string.h>

void setUp(void) {}
void tearDown(void) {}

enum { DIM = HEXLOAD_LOAD_DIM, TICKS = 3000 };

static const body_t eccentric = {312.0, {-0.09, 0.13, 0.27}, {17.0, 21.0, 12.0, 2.0, -1.0, 1.5}};

static void theta_of_platform(const hexload_config_t* config, double theta[DIM]) {
    const hexload_platform_t* platform = &config->platform;
    theta[HEXLOAD_LOAD_M] = (double)platform->mass_kg;
    for (int k = 0; k < 3; k++) {
        theta[HEXLOAD_LOAD_HX + k] = (double)(platform->mass_kg * platform->com_m[k]);
    }
    for (int k = 0; k < HEXLOAD_I_DIM; k++) {
        theta[HEXLOAD_LOAD_IXX + k] = (double)platform->inertia_kg_m2[k];
    }
}

/// What an estimator of `believed` says of three seconds on `machine`, whose force sensors show 1 + gain
/// times the force; and the covariance that it publishes.
static void identify(const hexload_config_t* machine, const hexload_config_t* believed, double gain,
                     hexload_estimate_t* estimate, hexload_real_t covariance[HEXLOAD_COVARIANCES_MAX]) {
    static hexload_t estimator;
    const motion_t motion = random_motion(46, 0.05, 0.1);
    uint64_t seed = 12;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_init(&estimator, believed));
    const double home_height_m = (double)estimator.as.momentum.kinematics.home_height_m;
    for (uint32_t tick = 0; tick < TICKS; tick++) {
        hexload_leg_sample_t sample = perfect_sample(machine, &eccentric, &motion, home_height_m, tick);
        add_noise(machine, &seed, &sample);
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            sample.force_n[leg] *= (hexload_real_t)(1.0 + gain);
        }
        TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_tick(&estimator, believed, &sample, estimate));
    }
    TEST_ASSERT_EQUAL_UINT32(HEXLOAD_LOAD_COVARIANCES, hexload_covariance(&estimator, covariance));
}

static hexload_config_t momentum_machine(void) {
    hexload_config_t config = crooked_machine();
    config.kind = HEXLOAD_KIND_MOMENTUM;
    return config;
}

static void test_a_common_gain_is_off_by_that_share_of_load_and_platform_and_sigma_has_it(void) {
    // GIVEN force sensors that all show half a per cent too much, as their tolerance says, WHEN a load moves
    const double gain = 0.005;
    const hexload_config_t machine = momentum_machine();
    hexload_config_t believed = machine;
    believed.tolerances.force_gain = (hexload_real_t)gain;
    hexload_estimate_t exact, off;
    hexload_real_t covariance[HEXLOAD_COVARIANCES_MAX];
    double load[DIM], own[DIM];
    identify(&machine, &machine, 0.0, &exact, covariance);
    identify(&machine, &believed, gain, &off, covariance);
    theta_of(&eccentric, load);
    theta_of_platform(&machine, own);
    for (int k = 0; k < DIM; k++) {
        // THEN the load is off by that share of both, but for what a larger force changes of the gain matrix:
        // less than one of the filter's own sigmas
        const double share = gain * (load[k] + own[k]);
        TEST_ASSERT_DOUBLE_WITHIN((double)exact.own_sigma[k], share, (double)(off.value[k] - exact.value[k]));
        // AND sigma is that and the filter's own part
        const double expected = hypot((double)off.own_sigma[k], gain * ((double)off.value[k] + own[k]));
        TEST_ASSERT_DOUBLE_WITHIN(0.02 * expected, expected, (double)off.sigma[k]);
    }
    // AND errors that come of one gain are correlated: of m and Ixx nearly wholly
    const double with_m = (double)covariance[HEXLOAD_LOAD_IXX * (HEXLOAD_LOAD_IXX + 1) / 2];
    const double correlation =
        with_m / ((double)off.sigma[HEXLOAD_LOAD_M] * (double)off.sigma[HEXLOAD_LOAD_IXX]);
    TEST_ASSERT_TRUE(correlation > 0.8);
}

static void test_what_the_platform_is_off_the_load_is_off_and_sigma_has_it(void) {
    // GIVEN a platform that is heavier than believed, its centre of mass aside, its inertia larger
    const hexload_config_t machine = momentum_machine();
    hexload_config_t believed = machine;
    believed.platform.mass_kg *= HEXLOAD_REAL(0.98);
    believed.platform.com_m[0] -= HEXLOAD_REAL(0.002);
    believed.platform.inertia_kg_m2[HEXLOAD_I_YY] -= HEXLOAD_REAL(0.6);
    believed.tolerances = (hexload_tolerances_t){.platform_mass = HEXLOAD_REAL(0.02),
                                                 .platform_com_m = HEXLOAD_REAL(0.002),
                                                 .platform_inertia = HEXLOAD_REAL(0.02)};
    hexload_estimate_t exact, off;
    hexload_real_t covariance[HEXLOAD_COVARIANCES_MAX];
    double truth[DIM], own[DIM];
    // WHEN a load moves
    identify(&machine, &machine, 0.0, &exact, covariance);
    identify(&machine, &believed, 0.0, &off, covariance);
    theta_of_platform(&machine, truth);
    theta_of_platform(&believed, own);
    const double moment = (own[HEXLOAD_LOAD_IXX] + own[HEXLOAD_LOAD_IYY] + own[HEXLOAD_LOAD_IZZ]) / 3.0;
    for (int k = 0; k < DIM; k++) {
        // THEN what it has more counts as load
        TEST_ASSERT_DOUBLE_WITHIN((double)exact.own_sigma[k], truth[k] - own[k],
                                  (double)(off.value[k] - exact.value[k]));
        // AND sigma says so
        const double of_mass = 0.02 * own[HEXLOAD_LOAD_M], of_h = 0.002 * own[HEXLOAD_LOAD_M];
        const double of_inertia = 0.02 * (k <= HEXLOAD_LOAD_IZZ ? own[k] : moment);
        const double open = k == HEXLOAD_LOAD_M ? of_mass : k <= HEXLOAD_LOAD_HZ ? of_h : of_inertia;
        const double expected = hypot((double)off.own_sigma[k], open);
        TEST_ASSERT_DOUBLE_WITHIN(0.02 * expected, expected, (double)off.sigma[k]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-3 * expected, (double)off.sigma[k],
                                  sqrt((double)covariance[k * (k + 1) / 2 + k]));
    }
}

static void test_an_untold_estimator_has_ordinary_tolerances_and_still_converges(void) {
    // GIVEN the default configuration WHEN a load moves for three seconds
    hexload_config_t config;
    hexload_estimate_t estimate;
    hexload_real_t covariance[HEXLOAD_COVARIANCES_MAX];
    hexload_config_default(&config);
    identify(&config, &config, 0.0, &estimate, covariance);
    // THEN its mass is known to half a per cent of all that hangs on the legs and three of the platform, not
    // to the grams of noise, AND that is good enough for the verdict
    const double expected = hypot(0.005 * (312.0 + 100.0), 0.03 * 100.0);
    TEST_ASSERT_DOUBLE_WITHIN(0.02 * expected, expected, (double)estimate.sigma[HEXLOAD_LOAD_M]);
    TEST_ASSERT_TRUE((double)estimate.own_sigma[HEXLOAD_LOAD_M] < 0.1);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_VERDICT_CONVERGED, estimate.verdict);
}

static void test_what_is_declared_open_keeps_no_parameter_from_having_converged(void) {
    // GIVEN a platform of which half is open WHEN a load moves for three seconds
    hexload_config_t config = momentum_machine();
    hexload_estimate_t estimate;
    hexload_real_t covariance[HEXLOAD_COVARIANCES_MAX];
    config.tolerances.platform_mass = HEXLOAD_REAL(0.5);
    config.tolerances.platform_inertia = HEXLOAD_REAL(0.5);
    identify(&config, &config, 0.0, &estimate, covariance);
    // THEN sigma says so, AND as more motion would not lower it, all has converged
    TEST_ASSERT_TRUE(estimate.sigma[HEXLOAD_LOAD_IZZ] >
                     HEXLOAD_REAL(0.49) * config.platform.inertia_kg_m2[2]);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_VERDICT_CONVERGED, estimate.verdict);
    // AND where nothing has moved yet, nothing has
    hexload_momentum_t first;
    const hexload_leg_sample_t rest = {.force_n = {HEXLOAD_REAL(0.0)}};
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_momentum_init(&first, &config));
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_momentum_tick(&first, &config, &rest, &estimate));
    TEST_ASSERT_TRUE(estimate.verdict > HEXLOAD_VERDICT_CONVERGED);
}

static void test_without_tolerances_sigmas_stay_as_they_are(void) {
    // GIVEN a filter without tolerances WHEN they are added THEN every bit of sigma stays
    const hexload_config_t config = momentum_machine();
    hexload_momentum_filter_t filter;
    hexload_momentum_filter_init(&filter, &config);
    hexload_real_t sigma[DIM], before[DIM];
    for (int k = 0; k < DIM; k++) {
        sigma[k] = HEXLOAD_REAL(0.1) + HEXLOAD_REAL(0.07) * (hexload_real_t)k;
    }
    memcpy(before, sigma, sizeof before);
    hexload_real_t added[DIM];
    hexload_tolerances_widen(&filter, sigma, added);
    TEST_ASSERT_EQUAL_MEMORY(before, sigma, sizeof before);
    for (int k = 0; k < DIM; k++) {
        TEST_ASSERT_TRUE(added[k] == HEXLOAD_REAL(0.0));
    }
}

static void test_a_weight_that_is_off_moves_the_papers_height_by_its_lever(void) {
    // GIVEN the paper's filter on a platform whose centre is off O_A, without tolerances WHEN the weight is
    // off by 2 % THEN the height is by as much of the platform's share of the lever between both centres
    const hexload_config_t config = crooked_machine();
    hexload_paper_filter_t filter;
    hexload_paper_filter_init(&filter, &config);
    filter.param[HEXLOAD_PAPER_DZ] = HEXLOAD_REAL(0.3);
    const double platform = (double)config.platform.mass_kg, load = (double)config.paper.load_mass_kg;
    const double lever_m = 0.3 - (double)config.platform.com_m[2];
    const double error_m = 0.02 * lever_m * platform / (platform + load);
    const hexload_real_t variance =
        hexload_paper_tolerances_covariance(&filter, HEXLOAD_REAL(0.02), HEXLOAD_PAPER_DZ, HEXLOAD_PAPER_DZ);
    TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(100, error_m * error_m), error_m * error_m, (double)variance);
    TEST_ASSERT_EQUAL_DOUBLE(0.0, (double)hexload_paper_tolerances_covariance(
                                      &filter, HEXLOAD_REAL(0.0), HEXLOAD_PAPER_DZ, HEXLOAD_PAPER_DZ));
}

static void test_the_papers_parameters_have_the_tolerances_in_common_both_ways(void) {
    // GIVEN the paper's filter on a machine of which little is known WHEN the covariance of two parameters is
    // asked for in either order THEN it is the same, not a variance, and within what both variances allow
    hexload_config_t config = crooked_machine();
    hexload_paper_filter_t filter;
    config.tolerances = (hexload_tolerances_t){.force_gain = HEXLOAD_REAL(0.01),
                                               .platform_mass = HEXLOAD_REAL(0.03),
                                               .platform_com_m = HEXLOAD_REAL(0.002)};
    hexload_paper_filter_init(&filter, &config);
    filter.param[HEXLOAD_PAPER_DZ] = HEXLOAD_REAL(0.3);
    for (int k = HEXLOAD_PAPER_IXX; k <= HEXLOAD_PAPER_IZZ; k++) {
        filter.param[k] = (hexload_real_t)(20.0 + 5.0 * k);
    }
    double covariance[HEXLOAD_PAPER_DIM][HEXLOAD_PAPER_DIM];
    for (int i = 0; i < HEXLOAD_PAPER_DIM; i++) {
        for (int j = 0; j < HEXLOAD_PAPER_DIM; j++) {
            covariance[i][j] = (double)hexload_paper_tolerances_covariance(&filter, HEXLOAD_REAL(0.01), i, j);
        }
    }
    for (int i = 0; i < HEXLOAD_PAPER_DIM; i++) {
        for (int j = 0; j < i; j++) {
            const double most = sqrt(covariance[i][i] * covariance[j][j]);
            TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(4, most), covariance[i][j], covariance[j][i]);
            TEST_ASSERT_DOUBLE_WITHIN(most * (1.0 + 1e-6), 0.0, covariance[i][j]);
        }
    }
}

static void test_without_tolerances_sigmas_stay_to_the_bit(void) {
    // GIVEN a machine of which nothing is open WHEN sigmas are widened THEN they stay, even where float has
    // no square of them
    hexload_config_t config = momentum_machine();
    hexload_momentum_filter_t filter;
    hexload_real_t sigma[DIM], variance[DIM];
    memset(&config.tolerances, 0, sizeof config.tolerances);
    hexload_momentum_filter_init(&filter, &config);
    for (int k = 0; k < DIM; k++) {
        sigma[k] = HEXLOAD_REAL(1e30);
    }
    hexload_tolerances_widen(&filter, sigma, variance);
    for (int k = 0; k < DIM; k++) {
        TEST_ASSERT_EQUAL_DOUBLE((double)HEXLOAD_REAL(1e30), (double)sigma[k]);
        TEST_ASSERT_EQUAL_DOUBLE(0.0, (double)variance[k]);
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_common_gain_is_off_by_that_share_of_load_and_platform_and_sigma_has_it);
    RUN_TEST(test_what_the_platform_is_off_the_load_is_off_and_sigma_has_it);
    RUN_TEST(test_an_untold_estimator_has_ordinary_tolerances_and_still_converges);
    RUN_TEST(test_what_is_declared_open_keeps_no_parameter_from_having_converged);
    RUN_TEST(test_without_tolerances_sigmas_stay_as_they_are);
    RUN_TEST(test_a_weight_that_is_off_moves_the_papers_height_by_its_lever);
    RUN_TEST(test_the_papers_parameters_have_the_tolerances_in_common_both_ways);
    RUN_TEST(test_without_tolerances_sigmas_stay_to_the_bit);
    return UNITY_END();
}
