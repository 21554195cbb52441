#include "machine.h"

#include <string.h>

void setUp(void) {}
void tearDown(void) {}

static void test_config_accepts_the_default_machine(void) {
    const hexload_config_t config = paper_machine();
    const char* bad_field = "not yet asked";
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_config_check(&config, &bad_field));
    TEST_ASSERT_NULL(bad_field);
}

static void test_config_accepts_a_platform_off_its_centre(void) {
    const hexload_config_t config = crooked_machine();
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_config_check(&config, NULL));
}

/// GIVEN the default machine WHEN one field is set to a value THEN the check refuses and names the field.
#define ASSERT_REFUSED(field, value)                                                                         \
    do {                                                                                                     \
        hexload_config_t config = paper_machine();                                                           \
        const char* bad_field = NULL;                                                                        \
        config.field = (value);                                                                              \
        TEST_ASSERT_EQUAL_INT_MESSAGE(HEXLOAD_ERR_CONFIG, hexload_config_check(&config, &bad_field),         \
                                      #field);                                                               \
        TEST_ASSERT_NOT_NULL_MESSAGE(bad_field, #field);                                                     \
        TEST_ASSERT_EQUAL_STRING_LEN(#field, bad_field, strlen(bad_field));                                  \
    } while (0)

static void test_config_names_each_field_out_of_range(void) {
    const hexload_real_t nan = (hexload_real_t)NAN;
    ASSERT_REFUSED(tick_s, HEXLOAD_REAL(0.1));
    ASSERT_REFUSED(tick_s, nan);
    ASSERT_REFUSED(geometry.base_hinge_m[5][2], nan);
    ASSERT_REFUSED(geometry.platform_hinge_m[0][0], (hexload_real_t)INFINITY);
    ASSERT_REFUSED(geometry.home_leg_length_m[3], HEXLOAD_REAL(0.0));
    ASSERT_REFUSED(geometry.stroke_min_m, (hexload_real_t)-INFINITY);
    ASSERT_REFUSED(geometry.stroke_max_m, HEXLOAD_REAL(-0.3));
    ASSERT_REFUSED(sensors.velocity_range_m_s, HEXLOAD_REAL(0.0));
    ASSERT_REFUSED(sensors.force_range_n, (hexload_real_t)INFINITY);
    ASSERT_REFUSED(platform.inertia_kg_m2[HEXLOAD_I_XX], (hexload_real_t)INFINITY);
    ASSERT_REFUSED(platform.inertia_kg_m2[HEXLOAD_I_ZZ], HEXLOAD_REAL(51.0)); // more than Ixx + Iyy
    ASSERT_REFUSED(paper.gate_nis, (hexload_real_t)INFINITY);
    ASSERT_REFUSED(tick_s, HEXLOAD_REAL(0.0));
    ASSERT_REFUSED(paper.converged_relative_sigma, HEXLOAD_REAL(-0.1));
    ASSERT_REFUSED(platform.mass_kg, HEXLOAD_REAL(-1.0));
    ASSERT_REFUSED(platform.com_m[1], nan);
    ASSERT_REFUSED(platform.inertia_kg_m2[HEXLOAD_I_YY], HEXLOAD_REAL(0.0));
    ASSERT_REFUSED(platform.inertia_kg_m2[HEXLOAD_I_XY], HEXLOAD_REAL(30.0));
    ASSERT_REFUSED(sensors.displacement_sigma_m, HEXLOAD_REAL(1e-11));
    ASSERT_REFUSED(sensors.velocity_sigma_m_s, HEXLOAD_REAL(1e-9));
    ASSERT_REFUSED(sensors.force_sigma_n, HEXLOAD_REAL(1e-7));
    ASSERT_REFUSED(sensors.force_sigma_n, HEXLOAD_REAL(-5.0));
    ASSERT_REFUSED(paper.load_mass_kg, HEXLOAD_REAL(0.0));
    ASSERT_REFUSED(paper.prior_dz_sigma_m, nan);
    ASSERT_REFUSED(paper.prior_inertia_sigma_kg_m2[2], HEXLOAD_REAL(0.0));
    ASSERT_REFUSED(paper.gate_nis, HEXLOAD_REAL(2.0));
    ASSERT_REFUSED(paper.inconsistent_nis, HEXLOAD_REAL(1.0));
    ASSERT_REFUSED(paper.nis_time_constant_s, HEXLOAD_REAL(0.0001));
    ASSERT_REFUSED(paper.converged_relative_sigma, HEXLOAD_REAL(1.5));
    ASSERT_REFUSED(paper.longest_gap_ticks, 0);
    ASSERT_REFUSED(paper.longest_gate_ticks, 0);
    ASSERT_REFUSED(actuator_effects.prior_bias_sigma_n, HEXLOAD_REAL(-1.0));
    ASSERT_REFUSED(actuator_effects.prior_coulomb_sigma_n, nan);
    ASSERT_REFUSED(actuator_effects.prior_viscous_sigma_n_s_m, HEXLOAD_REAL(-0.1));
    ASSERT_REFUSED(actuator_effects.prior_tilt_sigma_m_s2, HEXLOAD_REAL(-0.1));
    ASSERT_REFUSED(actuator_effects.friction_speed_m_s, HEXLOAD_REAL(0.0));
}

static void test_printed_prior_is_the_papers_start_covariance(void) {
    hexload_config_t config = paper_machine();
    hexload_config_set_prior(&config, HEXLOAD_PRIOR_PRINTED);
    const double expected[4] = {1.0, 10.0, 500.0,
                                500.0}; // paper, section 4; the rates' 1 is a start from the sensors
    const hexload_paper_config_t* paper = &config.paper;
    const double sigma[4] = {(double)paper->prior_dz_sigma_m, (double)paper->prior_inertia_sigma_kg_m2[0],
                             (double)paper->prior_inertia_sigma_kg_m2[1],
                             (double)paper->prior_inertia_sigma_kg_m2[2]};
    for (int k = 0; k < 4; k++) { // constants stand with 8 digits
        TEST_ASSERT_DOUBLE_WITHIN(1e-6 * expected[k], expected[k], sigma[k] * sigma[k]);
    }
}

static void test_safe_prior_grows_with_the_load_it_is_for(void) {
    // GIVEN a load three times as heavy as the paper's WHEN the safe prior is set
    hexload_config_t config = paper_machine();
    config.paper.load_mass_kg = HEXLOAD_REAL(1500.0);
    hexload_config_set_prior(&config, HEXLOAD_PRIOR_SAFE);
    // THEN the sigma of the inertias is three times sqrt(500), that of the height is what it was
    TEST_ASSERT_DOUBLE_WITHIN(1e-4, 3.0 * sqrt(500.0), (double)config.paper.prior_inertia_sigma_kg_m2[1]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, sqrt(0.1), (double)config.paper.prior_dz_sigma_m);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_config_accepts_the_default_machine);
    RUN_TEST(test_config_accepts_a_platform_off_its_centre);
    RUN_TEST(test_config_names_each_field_out_of_range);
    RUN_TEST(test_printed_prior_is_the_papers_start_covariance);
    RUN_TEST(test_safe_prior_grows_with_the_load_it_is_for);
    return UNITY_END();
}
