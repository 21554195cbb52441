#include "paper/paper_filter.h"
#include "paper/paper_supervisor.h"
#include "machine.h"

#include <math.h>
#include <string.h>

void setUp(void) {}
void tearDown(void) {}

/// A filter that has converged to the paper's load, with an ideal innovation.
static hexload_paper_filter_t good_filter(const hexload_config_t* config) {
    const hexload_real_t value[HEXLOAD_PAPER_DIM] = {HEXLOAD_REAL(0.3), HEXLOAD_REAL(25.0),
                                                     HEXLOAD_REAL(25.0), HEXLOAD_REAL(25.0)};
    const hexload_real_t sigma[HEXLOAD_PAPER_DIM] = {HEXLOAD_REAL(1e-4), HEXLOAD_REAL(0.5), HEXLOAD_REAL(1.5),
                                                     HEXLOAD_REAL(0.5)};
    hexload_paper_filter_t filter;
    hexload_paper_filter_init(&filter, config);
    for (int k = 0; k < HEXLOAD_PAPER_DIM; k++) {
        filter.param[k] = value[k];
        filter.param_cov[k][k] = sigma[k] * sigma[k];
    }
    filter.nis = HEXLOAD_REAL(3.0);
    return filter;
}

/// @param factor by which sigmas are too small for what lasts in the innovations.
static hexload_estimate_t judge_misfit(const hexload_config_t* config, const hexload_paper_filter_t* filter,
                                       int ticks, double factor, uint32_t* health) {
    hexload_paper_supervisor_t supervisor;
    hexload_estimate_t estimate;
    hexload_paper_supervisor_init(&supervisor);
    for (int n = 0; n < ticks; n++) {
        *health = hexload_paper_supervisor_judge(&supervisor, config, filter, (hexload_real_t)factor,
                                                 HEXLOAD_REAL(0.0), &estimate);
    }
    return estimate;
}

static hexload_estimate_t judge(const hexload_config_t* config, const hexload_paper_filter_t* filter,
                                int ticks, uint32_t* health) {
    return judge_misfit(config, filter, ticks, 1.0, health);
}

static void test_supervisor_calls_a_small_sigma_converged(void) {
    const hexload_config_t config = paper_machine();
    const hexload_paper_filter_t filter = good_filter(&config);
    uint32_t health = 0;
    const hexload_estimate_t estimate = judge(&config, &filter, 1, &health);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_VERDICT_CONVERGED, estimate.verdict);
    TEST_ASSERT_EQUAL_UINT32(0, health);
}

static void test_supervisor_passes_on_values_sigmas_and_nis(void) {
    const hexload_config_t config = paper_machine();
    const hexload_paper_filter_t filter = good_filter(&config);
    uint32_t health = 0;
    const hexload_estimate_t estimate = judge(&config, &filter, 1, &health);
    TEST_ASSERT_EQUAL_DOUBLE((double)filter.param[HEXLOAD_PAPER_IYY],
                             (double)estimate.value[HEXLOAD_PAPER_IYY]);
    TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(2, 1.5), 1.5, (double)estimate.sigma[HEXLOAD_PAPER_IYY]);
    TEST_ASSERT_EQUAL_DOUBLE(3.0, (double)estimate.nis);
}

static void test_one_parameter_that_is_not_known_yet_decides_the_verdict(void) {
    // GIVEN a sigma of Iyy at a fifth of its value WHEN judged THEN that parameter, and so the whole, is
    // converging
    const hexload_config_t config = paper_machine();
    hexload_paper_filter_t filter = good_filter(&config);
    uint32_t health = 0;
    filter.param_cov[HEXLOAD_PAPER_IYY][HEXLOAD_PAPER_IYY] = HEXLOAD_REAL(25.0);
    const hexload_estimate_t estimate = judge(&config, &filter, 1, &health);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_VERDICT_CONVERGING, estimate.parameter_verdict[HEXLOAD_PAPER_IYY]);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_VERDICT_CONVERGED, estimate.parameter_verdict[HEXLOAD_PAPER_IZZ]);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_VERDICT_CONVERGING, estimate.verdict);
}

static void test_sigma_near_the_prior_is_not_excited(void) {
    const hexload_config_t config = paper_machine();
    hexload_paper_filter_t filter = good_filter(&config);
    uint32_t health = 0;
    filter.param_cov[HEXLOAD_PAPER_IXX][HEXLOAD_PAPER_IXX] = HEXLOAD_REAL(400.0); // prior 500
    const hexload_estimate_t estimate = judge(&config, &filter, 1, &health);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_VERDICT_NOT_EXCITED, estimate.parameter_verdict[HEXLOAD_PAPER_IXX]);
    TEST_ASSERT_EQUAL_UINT32(1u << HEXLOAD_HEALTH_NOT_EXCITED, health);
}

static void test_innovations_beyond_what_sigma_covers_are_inconsistent(void) {
    // GIVEN innovations of which next to none is within the gate, and a limit on the factor that sigma may
    // have of sqrt(100 / 3) WHEN three time constants have passed
    hexload_config_t config = paper_machine();
    config.paper.inconsistent_nis = HEXLOAD_REAL(100.0);
    hexload_paper_filter_t filter = good_filter(&config);
    uint32_t health = 0;
    filter.nis = HEXLOAD_REAL(400.0);
    const hexload_estimate_t estimate = judge(&config, &filter, 1500, &health);
    // THEN the verdict says so
    TEST_ASSERT_EQUAL_INT(HEXLOAD_VERDICT_INCONSISTENT, estimate.verdict);
    TEST_ASSERT_EQUAL_UINT32(1u << HEXLOAD_HEALTH_INCONSISTENT | 1u << HEXLOAD_HEALTH_MODEL_MISFIT, health);
}

static void test_innovations_that_are_too_large_widen_sigma_at_once(void) {
    // GIVEN innovations of the mean NIS 12 WHEN three time constants have passed THEN sigma is as large as
    // they say
    const hexload_config_t config = paper_machine();
    hexload_paper_filter_t filter = good_filter(&config);
    uint32_t health = 0;
    filter.nis = HEXLOAD_REAL(12.0);
    const hexload_estimate_t estimate = judge(&config, &filter, 1500, &health);
    const double expected = sqrt((12.0 - 9.0 * exp(-3.0)) / 3.0);
    TEST_ASSERT_DOUBLE_WITHIN(0.01, expected, (double)(estimate.sigma[1] / estimate.own_sigma[1]));
    // AND the verdict says that the machine is not its model
    TEST_ASSERT_EQUAL_INT(HEXLOAD_VERDICT_MISFIT, estimate.verdict);
    TEST_ASSERT_EQUAL_UINT32(1u << HEXLOAD_HEALTH_MODEL_MISFIT, health);
}

static void test_a_place_that_the_prior_rules_out_widens_sigma_until_no_sigma_covers_it(void) {
    // GIVEN a centre of mass 5 m above the platform, as that of a load beside the axis may show, WHEN judged
    const hexload_config_t config = paper_machine();
    hexload_paper_filter_t filter = good_filter(&config);
    uint32_t health = 0;
    filter.param[HEXLOAD_PAPER_DZ] = HEXLOAD_REAL(5.0);
    hexload_estimate_t estimate = judge(&config, &filter, 1, &health);
    // THEN it is not believed: sigma reaches to ten prior sigmas, or 300 of them do not
    const double needed = (5.0 - 10.0 * (double)config.paper.prior_dz_sigma_m);
    const bool is_covered = needed <= 300.0 * (double)estimate.own_sigma[HEXLOAD_PAPER_DZ];
    TEST_ASSERT_EQUAL_INT(is_covered ? HEXLOAD_VERDICT_MISFIT : HEXLOAD_VERDICT_INCONSISTENT,
                          estimate.verdict);
    // AND one far enough is inconsistent
    filter.param[HEXLOAD_PAPER_DZ] = HEXLOAD_REAL(5e3);
    estimate = judge(&config, &filter, 1, &health);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_VERDICT_INCONSISTENT, estimate.verdict);
}

static void test_one_spike_does_not_turn_the_verdict(void) {
    const hexload_config_t config = paper_machine();
    hexload_paper_filter_t filter = good_filter(&config);
    uint32_t health = 0;
    filter.nis = HEXLOAD_REAL(1e9);
    const hexload_estimate_t estimate = judge(&config, &filter, 1, &health);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_VERDICT_CONVERGED, estimate.verdict);
}

static void test_inertias_that_no_body_has_widen_sigma_until_some_body_has_them(void) {
    // GIVEN one of Ixx, Iyy and Izz larger than the two others by far more than three sigma
    for (int large = HEXLOAD_PAPER_IXX; large <= HEXLOAD_PAPER_IZZ; large++) {
        const hexload_config_t config = paper_machine();
        hexload_paper_filter_t filter = good_filter(&config);
        uint32_t health = 0;
        filter.param[large] = HEXLOAD_REAL(80.0);
        hexload_estimate_t estimate = judge(&config, &filter, 1, &health);
        // THEN three sigmas of all of them reach to a body, and none counts as converged
        const hexload_real_t* I = &estimate.value[HEXLOAD_PAPER_IXX];
        const hexload_real_t* sigma = &estimate.sigma[HEXLOAD_PAPER_IXX];
        const double missing = 2.0 * (double)estimate.value[large] - (double)(I[0] + I[1] + I[2]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-5 * missing, missing, 3.0 * (double)(sigma[0] + sigma[1] + sigma[2]));
        const double factor = (double)(sigma[0] / estimate.own_sigma[HEXLOAD_PAPER_IXX]);
        for (int k = 0; k < HEXLOAD_PAPER_DIM; k++) { // by one factor
            TEST_ASSERT_EQUAL_INT(HEXLOAD_VERDICT_MISFIT, estimate.parameter_verdict[k]);
            const double widened = factor * (double)estimate.own_sigma[k];
            TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(8, widened), widened, (double)estimate.sigma[k]);
        }
        // AND where a factor of 300 does not, no parameter of it is believed
        filter.param[large] = HEXLOAD_REAL(8e4);
        estimate = judge(&config, &filter, 1, &health);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_VERDICT_INCONSISTENT, estimate.verdict);
    }
}

static void test_a_mismatch_that_lasts_widens_sigma_and_nothing_counts_as_converged(void) {
    // GIVEN innovations whose sums say that sigma is eight times too small, or a fifth WHEN judged
    const hexload_config_t config = paper_machine();
    const hexload_paper_filter_t filter = good_filter(&config);
    uint32_t health = 0;
    (void)judge_misfit(&config, &filter, 1, 1.2, &health);
    TEST_ASSERT_EQUAL_UINT32(1u << HEXLOAD_HEALTH_MODEL_MISFIT, health);
    const hexload_estimate_t estimate = judge_misfit(&config, &filter, 1, 8.0, &health);
    for (int k = 0; k < HEXLOAD_PAPER_DIM; k++) {
        // THEN the published sigma has it, the filter's own does not
        const double own = (double)estimate.own_sigma[k];
        TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(2, 8.0 * own), 8.0 * own, (double)estimate.sigma[k]);
        // AND dz, of which 0.8 mm is still little, has not converged either
        TEST_ASSERT_EQUAL_INT(HEXLOAD_VERDICT_MISFIT, estimate.parameter_verdict[k]);
    }
    TEST_ASSERT_EQUAL_UINT32(1u << HEXLOAD_HEALTH_MODEL_MISFIT, health);
}

static void test_every_verdict_and_status_has_a_name_of_its_own(void) {
    TEST_ASSERT_EQUAL_STRING("converged", hexload_verdict_name(HEXLOAD_VERDICT_CONVERGED));
    TEST_ASSERT_EQUAL_STRING("converging", hexload_verdict_name(HEXLOAD_VERDICT_CONVERGING));
    TEST_ASSERT_EQUAL_STRING("not_excited", hexload_verdict_name(HEXLOAD_VERDICT_NOT_EXCITED));
    TEST_ASSERT_EQUAL_STRING("misfit", hexload_verdict_name(HEXLOAD_VERDICT_MISFIT));
    TEST_ASSERT_EQUAL_STRING("inconsistent", hexload_verdict_name(HEXLOAD_VERDICT_INCONSISTENT));
    const char* unknown = hexload_status_name((hexload_status_t)-99);
    for (int status = HEXLOAD_ERR_SINGULAR; status <= HEXLOAD_OK; status++) {
        TEST_ASSERT_NOT_EQUAL(0, strcmp(unknown, hexload_status_name((hexload_status_t)status)));
    }
    for (int bit = 0; bit < HEXLOAD_HEALTH_BITS; bit++) {
        const char* name = hexload_health_name((hexload_health_bit_t)bit);
        TEST_ASSERT_NOT_EQUAL(0, strcmp(hexload_health_name(HEXLOAD_HEALTH_BITS), name));
    }
}

static void test_what_the_papers_filter_does_not_know_of_is_zero(void) {
    // GIVEN an estimate with numbers of another estimator in it WHEN the paper's filter is judged THEN none
    // are left
    const hexload_config_t config = paper_machine();
    const hexload_paper_filter_t filter = good_filter(&config);
    hexload_paper_supervisor_t supervisor;
    hexload_estimate_t estimate;
    memset(&estimate, 1, sizeof estimate);
    hexload_paper_supervisor_init(&supervisor);
    (void)hexload_paper_supervisor_judge(&supervisor, &config, &filter, HEXLOAD_REAL(1.0), HEXLOAD_REAL(0.0),
                                         &estimate);
    for (int k = HEXLOAD_PAPER_DIM; k < HEXLOAD_PARAMETERS_MAX; k++) {
        TEST_ASSERT_TRUE(estimate.value[k] == HEXLOAD_REAL(0.0) && estimate.sigma[k] == HEXLOAD_REAL(0.0));
        TEST_ASSERT_TRUE(estimate.own_sigma[k] == HEXLOAD_REAL(0.0));
        TEST_ASSERT_EQUAL_INT(HEXLOAD_VERDICT_CONVERGED, estimate.parameter_verdict[k]);
    }
}

static void test_a_mean_nis_above_five_widens_sigma_by_its_root_over_three(void) {
    // GIVEN innovations of a NIS just below five, or of six, for twenty time constants of its mean
    const hexload_config_t config = paper_machine();
    hexload_paper_filter_t filter = good_filter(&config);
    const double nis[] = {4.99, 6.0}, expected[] = {1.0, sqrt(2.0)};
    for (int k = 0; k < 2; k++) {
        filter.nis = (hexload_real_t)nis[k];
        uint32_t health = 0;
        // WHEN the filter is judged THEN sigma is its own, or larger by the root of 6 over the ideal 3
        const hexload_estimate_t estimate = judge(&config, &filter, 10000, &health);
        TEST_ASSERT_DOUBLE_WITHIN(
            1e-4, expected[k],
            (double)(estimate.sigma[HEXLOAD_PAPER_IYY] / estimate.own_sigma[HEXLOAD_PAPER_IYY]));
    }
}

static void test_what_a_misfit_has_left_goes_only_as_the_motion_shows_more(void) {
    // GIVEN a filter whose innovations have been twice as large as they should be, for a tick
    const hexload_config_t config = paper_machine();
    hexload_paper_filter_t filter = good_filter(&config);
    hexload_paper_supervisor_t supervisor;
    hexload_estimate_t estimate;
    hexload_paper_supervisor_init(&supervisor);
    (void)hexload_paper_supervisor_judge(&supervisor, &config, &filter, HEXLOAD_REAL(2.0), HEXLOAD_REAL(0.0),
                                         &estimate);
    const double first_sigma = (double)estimate.own_sigma[HEXLOAD_PAPER_IXX];
    const double error = sqrt(2.0 * 2.0 - 1.0) * first_sigma; // beside the filter's own
    // WHEN they fit again, and its variance of Ixx falls from tick to tick, and once rises
    const double shares[] = {1.0, 0.8, 0.5, 0.6, 0.34, 0.32, 0.1};
    double left = error, last = 1.0;
    for (int n = 0; n < 7; n++) {
        filter.param_cov[HEXLOAD_PAPER_IXX][HEXLOAD_PAPER_IXX] =
            (hexload_real_t)(shares[n] * first_sigma * first_sigma);
        const uint32_t health = hexload_paper_supervisor_judge(
            &supervisor, &config, &filter, HEXLOAD_REAL(1.0), HEXLOAD_REAL(0.0), &estimate);
        // THEN the error that may be left falls with the variance; as that rises, by what is forgotten, it
        // stays as many sigmas
        left *= shares[n] < last ? shares[n] / last : sqrt(shares[n] / last);
        last = shares[n];
        const double own = sqrt(last) * first_sigma;
        TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(30, 1.0), 1.0,
                                  (double)estimate.sigma[HEXLOAD_PAPER_IXX] / hypot(own, left));
        // AND the parameter is misfit while that is more than the filter's own sigma, as are those of which
        // nothing more is shown
        TEST_ASSERT_EQUAL_INT(left > own ? HEXLOAD_VERDICT_MISFIT : HEXLOAD_VERDICT_CONVERGED,
                              estimate.parameter_verdict[HEXLOAD_PAPER_IXX]);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_VERDICT_MISFIT, estimate.parameter_verdict[HEXLOAD_PAPER_IZZ]);
        TEST_ASSERT_EQUAL_UINT32(1u << HEXLOAD_HEALTH_MODEL_MISFIT, health);
    }
    TEST_ASSERT_EQUAL_INT(HEXLOAD_VERDICT_CONVERGED, estimate.parameter_verdict[HEXLOAD_PAPER_IXX]);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_what_a_misfit_has_left_goes_only_as_the_motion_shows_more);
    RUN_TEST(test_what_the_papers_filter_does_not_know_of_is_zero);
    RUN_TEST(test_a_mean_nis_above_five_widens_sigma_by_its_root_over_three);
    RUN_TEST(test_supervisor_calls_a_small_sigma_converged);
    RUN_TEST(test_supervisor_passes_on_values_sigmas_and_nis);
    RUN_TEST(test_one_parameter_that_is_not_known_yet_decides_the_verdict);
    RUN_TEST(test_sigma_near_the_prior_is_not_excited);
    RUN_TEST(test_innovations_beyond_what_sigma_covers_are_inconsistent);
    RUN_TEST(test_innovations_that_are_too_large_widen_sigma_at_once);
    RUN_TEST(test_a_place_that_the_prior_rules_out_widens_sigma_until_no_sigma_covers_it);
    RUN_TEST(test_one_spike_does_not_turn_the_verdict);
    RUN_TEST(test_inertias_that_no_body_has_widen_sigma_until_some_body_has_them);
    RUN_TEST(test_a_mismatch_that_lasts_widens_sigma_and_nothing_counts_as_converged);
    RUN_TEST(test_every_verdict_and_status_has_a_name_of_its_own);
    return UNITY_END();
}
