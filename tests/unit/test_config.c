#include "configuration/health.h"
#include "machine.h"

#include <math.h>
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

static void test_the_default_bridges_gaps_as_its_errors_allow(void) {
    // GIVEN the default configuration WHEN its ticks are read THEN the paper's filter integrates over gaps of
    // which the trapezoid's error at 3 Hz is below 4e-4, and no longer ones; and the momentum filter over
    // five
    hexload_config_t config;
    hexload_config_default(&config);
    const double radians = 2.0 * 3.14159265358979 * 3.0 * 1e-3;
    const double ticks = (double)config.paper.longest_gap_ticks;
    TEST_ASSERT_TRUE(radians * radians * ticks * ticks / 12.0 < 4e-4);
    TEST_ASSERT_TRUE(radians * radians * (ticks + 1.0) * (ticks + 1.0) / 12.0 > 4e-4);
    TEST_ASSERT_EQUAL_UINT32(20, config.paper.longest_gate_ticks);
    // AND its gates are those of chi-square at 1e-8 of good innovations with 3 degrees of freedom, 39.8, and
    // of the sigmas that may be understated by 300
    TEST_ASSERT_DOUBLE_WITHIN(0.5, 39.8, (double)config.paper.gate_nis);
    TEST_ASSERT_DOUBLE_WITHIN(1.0, 3.0 * 300.0 * 300.0, (double)config.paper.inconsistent_nis);
    TEST_ASSERT_EQUAL_DOUBLE(0.5, (double)config.paper.nis_time_constant_s);
    TEST_ASSERT_DOUBLE_WITHIN(1e-7, 0.1, (double)config.paper.converged_relative_sigma);
    TEST_ASSERT_DOUBLE_WITHIN(1e-7, 0.05, (double)config.momentum.converged_relative_sigma);
    TEST_ASSERT_EQUAL_UINT32(5, config.momentum.longest_gap_ticks);
}

/// Seven digits of a number that a float has.
#define ASSERT_NUMBER(expected, found)                                                                       \
    TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(1.2e-7 * fabs(expected), expected, (double)(found), #found)

static void test_the_default_machine_is_that_of_the_paper(void) {
    // GIVEN the default configuration WHEN its hinges are looked at from above THEN those of the base lie at
    // 0.6 m and 10 degrees from the axes of symmetry, those of the platform at 0.4 m and 15 degrees from the
    // axes between them, legs being numbered all round
    const double base_deg[HEXLOAD_LEGS] = {10, 110, 130, 230, 250, 350};
    const double platform_deg[HEXLOAD_LEGS] = {45, 75, 165, 195, 285, 315};
    const double radians = 3.14159265358979 / 180.0;
    hexload_config_t config;
    hexload_config_default(&config);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        const hexload_real_t* base = config.geometry.base_hinge_m[leg];
        const hexload_real_t* platform = config.geometry.platform_hinge_m[leg];
        TEST_ASSERT_DOUBLE_WITHIN(1e-7, 0.6 * cos(radians * base_deg[leg]), (double)base[0]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-7, 0.6 * sin(radians * base_deg[leg]), (double)base[1]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-7, 0.4 * cos(radians * platform_deg[leg]), (double)platform[0]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-7, 0.4 * sin(radians * platform_deg[leg]), (double)platform[1]);
        TEST_ASSERT_EQUAL_DOUBLE(0.0, (double)base[2]);
        TEST_ASSERT_EQUAL_DOUBLE(0.0, (double)platform[2]);
        ASSERT_NUMBER(0.8741, config.geometry.home_leg_length_m[leg]);
    }
    ASSERT_NUMBER(-0.3, config.geometry.stroke_min_m);
    ASSERT_NUMBER(0.3, config.geometry.stroke_max_m);
    // AND mass, inertia, sensors and gravity are those of its Table 1
    ASSERT_NUMBER(100.0, config.platform.mass_kg);
    const double inertia_kg_m2[6] = {25.0, 25.0, 44.0};
    for (int k = 0; k < 6; k++) {
        ASSERT_NUMBER(inertia_kg_m2[k], config.platform.inertia_kg_m2[k]);
        ASSERT_NUMBER(0.0, config.platform.com_m[k % 3]);
    }
    ASSERT_NUMBER(20e-6, config.sensors.displacement_sigma_m);
    ASSERT_NUMBER(0.001, config.sensors.velocity_sigma_m_s);
    ASSERT_NUMBER(5.0, config.sensors.force_sigma_n);
    ASSERT_NUMBER(0.001, config.tick_s);
    ASSERT_NUMBER(9.81, config.gravity_m_s2);
    ASSERT_NUMBER(500.0, config.paper.load_mass_kg);
}

static void test_the_default_tolerances_ranges_and_speeds_are_those_of_the_header(void) {
    hexload_config_t config;
    hexload_config_default(&config);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_KIND_MOMENTUM, config.kind);
    ASSERT_NUMBER(10.0, config.sensors.velocity_range_m_s);
    ASSERT_NUMBER(1e6, config.sensors.force_range_n);
    // six load cells of 1 % and gravity's 0.3 %, a scale, and that mass at a disc's rim
    ASSERT_NUMBER(0.005, config.tolerances.force_gain);
    ASSERT_NUMBER(0.03, config.tolerances.platform_mass);
    ASSERT_NUMBER(0.002, config.tolerances.platform_com_m);
    ASSERT_NUMBER(0.06, config.tolerances.platform_inertia);
    ASSERT_NUMBER(9.0, config.momentum.inconsistent_nis);
    ASSERT_NUMBER(0.5, config.momentum.nis_time_constant_s);
    ASSERT_NUMBER(10.0, config.momentum.excitation_time_constant_s);
    ASSERT_NUMBER(0.5e-3, config.momentum.timing_s);
    ASSERT_NUMBER(5e-3, config.actuator_effects.friction_speed_m_s);
    ASSERT_NUMBER(0.15, config.actuator_effects.leg_share);
    ASSERT_NUMBER(0.01, config.rig.stribeck_speed_m_s);
    ASSERT_NUMBER(0.001, config.rig.reversal_speed_m_s);
    // AND the priors are the safe ones of 500 kg, and of a platform of 100 kg
    ASSERT_NUMBER(0.31622777, config.paper.prior_dz_sigma_m);
    for (int k = 0; k < 3; k++) {
        ASSERT_NUMBER(500.0 * 0.04472136, config.paper.prior_inertia_sigma_kg_m2[k]);
    }
    ASSERT_NUMBER(0.0, config.momentum.prior_mass_kg);
    ASSERT_NUMBER(300.0, config.momentum.prior_mass_sigma_kg);
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
    ASSERT_REFUSED(geometry.platform_hinge_m[0][0], (hexload_real_t)-INFINITY);
    ASSERT_REFUSED(geometry.base_hinge_m[3][1], (hexload_real_t)-INFINITY);
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
    ASSERT_REFUSED(actuator_effects.friction_shape, nan);
}

static void test_printed_prior_is_the_papers_start_covariance(void) {
    hexload_config_t config = paper_machine();
    memset(config.paper.prior_inertia_sigma_kg_m2, 0, sizeof config.paper.prior_inertia_sigma_kg_m2);
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

static void test_the_momentum_filters_prior_grows_with_mass_and_size_of_the_platform(void) {
    // GIVEN hinges at 0.3, 0.4 and 1.2 m WHEN the prior is set THEN moments of a load are open to its mass at
    // a quarter more than their distance from O_A, 1.3 m, and inertias to 4/3 of its mass at that
    hexload_config_t config = paper_machine();
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        config.geometry.platform_hinge_m[leg][leg % 3] = HEXLOAD_REAL(0.3);
        config.geometry.platform_hinge_m[leg][(leg + 1) % 3] = HEXLOAD_REAL(-0.4);
        config.geometry.platform_hinge_m[leg][(leg + 2) % 3] = HEXLOAD_REAL(1.2);
    }
    hexload_config_set_momentum(&config);
    const double mass_kg = (double)config.momentum.prior_mass_sigma_kg, reach_m = 1.25 * 1.3;
    TEST_ASSERT_DOUBLE_WITHIN(1e-5 * mass_kg, mass_kg * reach_m,
                              (double)config.momentum.prior_moment_sigma_kg_m);
    TEST_ASSERT_DOUBLE_WITHIN(1e-5 * mass_kg, 4.0 / 3.0 * mass_kg * reach_m * reach_m,
                              (double)config.momentum.prior_inertia_sigma_kg_m2);
}

static void test_the_lag_is_the_least_whose_regression_is_a_32nd_of_the_velocity_sensors_sigma(void) {
    // GIVEN displacements of which a line through 2 n + 1 has a slope with 1/32 of the velocities' sigma, and
    // a thousandth more or less WHEN the lag is set THEN it is the n that is just enough, within its range
    hexload_config_t config = paper_machine();
    for (uint32_t n = 1; n < HEXLOAD_LAG_TICKS_MAX + 5; n++) {
        const double window = 2.0 * n + 1.0;
        const double sigma_m = (double)(config.sensors.velocity_sigma_m_s * config.tick_s) / 32.0 *
                               sqrt(window * window * window / 12.0);
        for (uint32_t more = 0; more < 2; more++) {
            config.sensors.displacement_sigma_m = (hexload_real_t)(sigma_m * (0.999 + 0.002 * more));
            hexload_config_set_momentum(&config);
            const uint32_t least = n + more > HEXLOAD_TRANSIENT_TICKS ? n + more : HEXLOAD_TRANSIENT_TICKS;
            TEST_ASSERT_EQUAL_UINT32(least < HEXLOAD_LAG_TICKS_MAX ? least : HEXLOAD_LAG_TICKS_MAX,
                                     config.momentum.lag_ticks);
        }
    }
}

static void test_a_known_mass_is_known_to_a_thousandth(void) {
    hexload_config_t config = paper_machine();
    hexload_config_set_known_mass(&config, HEXLOAD_REAL(320.5));
    ASSERT_NUMBER(320.5, config.paper.load_mass_kg);
    ASSERT_NUMBER(320.5, config.momentum.prior_mass_kg);
    ASSERT_NUMBER(0.3205, config.momentum.prior_mass_sigma_kg);
    // AND of what is not known it is thrice the platform's, about none
    hexload_config_set_momentum(&config);
    ASSERT_NUMBER(0.0, config.momentum.prior_mass_kg);
    ASSERT_NUMBER(300.0, config.momentum.prior_mass_sigma_kg);
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

static void test_config_names_what_contradicts_another_field(void) {
    // a leg of 0.8741 m that may be 0.9 m shorter, and 0.1 N of friction that pushes at rest
    ASSERT_REFUSED(geometry.stroke_min_m, HEXLOAD_REAL(-0.9));
    ASSERT_REFUSED(rig.stribeck_n[4], HEXLOAD_REAL(-0.1));
    // moments of (25, 25, 44) kg m^2: one below zero; one beyond the sum of the others; a product beyond the
    // root of 25 times 44
    ASSERT_REFUSED(platform.inertia_kg_m2[HEXLOAD_I_XX], HEXLOAD_REAL(-1.0));
    ASSERT_REFUSED(platform.inertia_kg_m2[HEXLOAD_I_XX], HEXLOAD_REAL(69.1));
    ASSERT_REFUSED(platform.inertia_kg_m2[HEXLOAD_I_YY], HEXLOAD_REAL(69.1));
    ASSERT_REFUSED(platform.inertia_kg_m2[HEXLOAD_I_YZ], HEXLOAD_REAL(33.2));
    ASSERT_REFUSED(momentum.lag_ticks, HEXLOAD_TRANSIENT_TICKS - 1);
    ASSERT_REFUSED(momentum.lag_ticks, HEXLOAD_LAG_TICKS_MAX + 1);
    ASSERT_REFUSED(momentum.longest_gap_ticks, 0);
    ASSERT_REFUSED(momentum.longest_gap_ticks, HEXLOAD_MISSING_TICKS_MAX + 1);
    ASSERT_REFUSED(momentum.nis_time_constant_s, HEXLOAD_REAL(0.0009));
    ASSERT_REFUSED(momentum.excitation_time_constant_s, HEXLOAD_REAL(0.0009));
    ASSERT_REFUSED(sensors.half_window_ticks, 1);
    ASSERT_REFUSED(sensors.half_window_ticks, HEXLOAD_HALF_WINDOW_TICKS_MAX + 1);
    // 8 ticks of 1 ms, and no number of directions that there is no room for
    ASSERT_REFUSED(rig.force_delay_s, HEXLOAD_REAL(0.0081));
    ASSERT_REFUSED(rig.velocity_delay_s, HEXLOAD_REAL(0.0081));
    ASSERT_REFUSED(rig.direction_count, HEXLOAD_RIG_DIRECTIONS_MAX + 1);
    ASSERT_REFUSED(rig.direction_count, UINT32_MAX);
}

static void test_any_leg_that_may_be_as_short_as_nothing_is_refused(void) {
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        // GIVEN a leg that is just as long as it may be shorter WHEN it is checked THEN it is refused
        hexload_config_t config = paper_machine();
        const char* bad_field = NULL;
        config.geometry.stroke_min_m = HEXLOAD_REAL(-0.5);
        config.geometry.home_leg_length_m[leg] = HEXLOAD_REAL(0.5);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_ERR_CONFIG, hexload_config_check(&config, &bad_field));
        TEST_ASSERT_EQUAL_STRING("geometry.stroke_min_m", bad_field);
    }
}

static void test_a_leg_whose_friction_pushes_at_rest_is_refused(void) {
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        hexload_config_t config = paper_machine();
        const char* bad_field = NULL;
        config.rig.coulomb_n[leg] = HEXLOAD_REAL(0.1);
        config.rig.stribeck_n[leg] = HEXLOAD_REAL(-0.2);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_ERR_CONFIG, hexload_config_check(&config, &bad_field));
        TEST_ASSERT_EQUAL_STRING("rig.stribeck_n", bad_field);
    }
}

static void test_a_flat_platform_is_a_body(void) {
    // GIVEN moments of (25, 25, 44) kg m^2, one of which becomes the sum of the others, as of a sheet WHEN
    // they are checked THEN none is refused
    const hexload_real_t sum[3] = {HEXLOAD_REAL(69.0), HEXLOAD_REAL(69.0), HEXLOAD_REAL(50.0)};
    for (int k = 0; k < 3; k++) {
        hexload_config_t config = paper_machine();
        config.platform.inertia_kg_m2[k] = sum[k];
        TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_config_check(&config, NULL));
    }
}

static void test_a_light_platform_is_a_body_and_a_rod_without_width_is_none(void) {
    hexload_config_t config = paper_machine();
    const hexload_real_t light[3] = {HEXLOAD_REAL(0.03), HEXLOAD_REAL(0.03), HEXLOAD_REAL(0.05)};
    memcpy(config.platform.inertia_kg_m2, light, sizeof light);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_config_check(&config, NULL));
    for (int axis = 0; axis < 3; axis++) {
        config = paper_machine();
        for (int k = 0; k < 3; k++) {
            config.platform.inertia_kg_m2[k] = k == axis ? HEXLOAD_REAL(0.0) : HEXLOAD_REAL(25.0);
        }
        TEST_ASSERT_EQUAL_INT(HEXLOAD_ERR_CONFIG, hexload_config_check(&config, NULL));
    }
}

static void test_a_tensor_is_that_of_a_body_about_its_own_centre(void) {
    // GIVEN platforms with any mass, centre of mass and tensor about that, which is given about O_A
    uint64_t seed = 81;
    int bodies = 0, others = 0;
    for (int trial = 0; trial < 2000; trial++) {
        hexload_config_t config = paper_machine();
        const double m = 60.0 + 40.0 * uniform(&seed);
        double c[3], I[6];
        for (int k = 0; k < 3; k++) {
            config.platform.com_m[k] = (hexload_real_t)(0.4 * uniform(&seed));
            c[k] = (double)config.platform.com_m[k];
            I[k] = 10.0 + 9.0 * uniform(&seed);
            I[3 + k] = 8.0 * uniform(&seed);
        }
        const double square = c[0] * c[0] + c[1] * c[1] + c[2] * c[2];
        const double product[3] = {c[0] * c[1], c[0] * c[2], c[1] * c[2]};
        config.platform.mass_kg = (hexload_real_t)m;
        for (int k = 0; k < 3; k++) {
            config.platform.inertia_kg_m2[k] = (hexload_real_t)(I[k] + m * (square - c[k] * c[k]));
            config.platform.inertia_kg_m2[3 + k] = (hexload_real_t)(I[3 + k] - m * product[k]);
        }
        // WHEN it is positive definite, by its factor, and no moment is more than the two others together
        const double first = I[0], second = I[1] - I[3] * I[3] / first, rest = I[5] - I[3] * I[4] / first;
        const double third = I[2] - I[4] * I[4] / first - rest * rest / second;
        const double excess = 2.0 * fmax(I[0], fmax(I[1], I[2])) - (I[0] + I[1] + I[2]);
        if (fabs(second) < 0.01 || fabs(third) < 0.01 || fabs(excess) < 0.01) {
            continue;
        }
        // THEN the platform is accepted, and else refused
        const bool is_body = second > 0.0 && third > 0.0 && excess < 0.0;
        bodies += is_body;
        others += !is_body;
        TEST_ASSERT_EQUAL_INT(is_body ? HEXLOAD_OK : HEXLOAD_ERR_CONFIG, hexload_config_check(&config, NULL));
    }
    TEST_ASSERT_GREATER_THAN_INT(200, bodies);
    TEST_ASSERT_GREATER_THAN_INT(200, others);
}

static void test_config_accepts_the_ends_of_its_ranges(void) {
    // GIVEN the numbers just inside what contradicts another field WHEN they are checked THEN none is refused
    hexload_config_t config = paper_machine();
    const char* bad_field = "not yet asked";
    config.geometry.stroke_min_m = HEXLOAD_REAL(-0.874);
    config.rig.coulomb_n[4] = HEXLOAD_REAL(0.1);
    config.rig.stribeck_n[4] = HEXLOAD_REAL(-0.1);
    config.platform.inertia_kg_m2[HEXLOAD_I_XX] = HEXLOAD_REAL(69.0);
    config.momentum.lag_ticks = HEXLOAD_LAG_TICKS_MAX;
    config.momentum.longest_gap_ticks = HEXLOAD_MISSING_TICKS_MAX;
    config.momentum.nis_time_constant_s = config.tick_s;
    config.momentum.excitation_time_constant_s = config.tick_s;
    config.paper.nis_time_constant_s = config.tick_s;
    config.paper.longest_gap_ticks = config.paper.longest_gate_ticks = 1;
    config.sensors.half_window_ticks = HEXLOAD_HALF_WINDOW_TICKS_MAX;
    config.rig.force_delay_s = config.rig.velocity_delay_s = HEXLOAD_REAL(0.008);
    config.rig.direction_count = HEXLOAD_RIG_DIRECTIONS_MAX;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_config_check(&config, &bad_field));
    TEST_ASSERT_NULL_MESSAGE(bad_field, bad_field);
    config.momentum.lag_ticks = HEXLOAD_TRANSIENT_TICKS;
    config.momentum.longest_gap_ticks = 1;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_config_check(&config, NULL));
}

static void test_only_directions_that_count_are_checked(void) {
    // GIVEN a second direction with a number that is none WHEN one direction counts THEN it is of no account,
    // WHEN two do THEN it is refused
    hexload_config_t config = paper_machine();
    const char* bad_field = NULL;
    config.rig.direction[1].platform_hinge_m[5][2] = (hexload_real_t)NAN;
    config.rig.direction_count = 1;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_config_check(&config, &bad_field));
    config.rig.direction_count = 2;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_ERR_CONFIG, hexload_config_check(&config, &bad_field));
    TEST_ASSERT_EQUAL_STRING("rig.direction", bad_field);
    // AND so is one in the last of all that there is room for
    config = paper_machine();
    config.rig.direction_count = HEXLOAD_RIG_DIRECTIONS_MAX;
    config.rig.direction[HEXLOAD_RIG_DIRECTIONS_MAX - 1].platform_hinge_m[5][2] = (hexload_real_t)NAN;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_ERR_CONFIG, hexload_config_check(&config, &bad_field));
    TEST_ASSERT_EQUAL_STRING("rig.direction", bad_field);
}

static void test_gravity_that_is_no_vector_or_points_up_is_refused(void) {
    static const hexload_real_t bad[][3] = {
        {HEXLOAD_REAL(0.0), HEXLOAD_REAL(0.0), HEXLOAD_REAL(9.81)},
        {HEXLOAD_REAL(9.81), HEXLOAD_REAL(0.0), HEXLOAD_REAL(0.0)},
        {(hexload_real_t)NAN, HEXLOAD_REAL(0.0), HEXLOAD_REAL(-9.81)},
        {HEXLOAD_REAL(0.0), (hexload_real_t)INFINITY, HEXLOAD_REAL(-9.81)},
    };
    for (size_t n = 0; n < sizeof bad / sizeof bad[0]; n++) {
        // GIVEN such a vector WHEN it is set THEN it is refused and no hinge is turned
        hexload_config_t config = paper_machine();
        const hexload_config_t before = paper_machine();
        TEST_ASSERT_EQUAL_INT(HEXLOAD_ERR_CONFIG, hexload_config_set_gravity(&config, bad[n]));
        TEST_ASSERT_EQUAL_MEMORY(&before.geometry, &config.geometry, sizeof before.geometry);
        TEST_ASSERT_TRUE(config.gravity_m_s2 == before.gravity_m_s2);
    }
}

static void test_health_counters_stay_at_their_end(void) {
    // GIVEN counters that are one below their end
    hexload_health_t health = {.refused = UINT32_MAX - 1};
    const uint32_t bits = 1u << HEXLOAD_HEALTH_INCONSISTENT | 1u << HEXLOAD_HEALTH_FRAMES_REFUSED;
    health.count[HEXLOAD_HEALTH_INCONSISTENT] = UINT32_MAX - 1;
    // WHEN they count on
    for (int n = 0; n < 3; n++) {
        TEST_ASSERT_EQUAL_INT(HEXLOAD_ERR_POSE, hexload_health_refuse(&health, HEXLOAD_ERR_POSE));
        hexload_health_count(&health, bits);
    }
    // THEN they stay there, and others count what they were given
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, health.refused);
    TEST_ASSERT_EQUAL_HEX32(bits, health.bits);
    for (int bit = 0; bit < HEXLOAD_HEALTH_BITS; bit++) {
        const uint32_t expected = bit == HEXLOAD_HEALTH_INCONSISTENT     ? UINT32_MAX
                                  : bit == HEXLOAD_HEALTH_FRAMES_REFUSED ? 3
                                                                         : 0;
        TEST_ASSERT_EQUAL_UINT32(expected, health.count[bit]);
    }
}

static void test_bits_beyond_those_of_health_count_nothing(void) {
    // GIVEN bits of which only the lowest have a counter WHEN they are counted THEN nothing else is written
    struct {
        hexload_health_t health;
        uint8_t behind[64];
    } memory;
    memset(&memory, 0, sizeof memory);
    hexload_health_count(&memory.health, UINT32_MAX);
    for (int bit = 0; bit < HEXLOAD_HEALTH_BITS; bit++) {
        TEST_ASSERT_EQUAL_UINT32(1, memory.health.count[bit]);
    }
    TEST_ASSERT_EQUAL_UINT32(0, memory.health.refused);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_INPUT_PLAUSIBLE, memory.health.input.cause);
    TEST_ASSERT_EQUAL_UINT32(0, memory.health.input.leg);
    TEST_ASSERT_EACH_EQUAL_UINT8(0, memory.behind, sizeof memory.behind);
}

static void test_numbers_without_a_name_are_called_unknown(void) {
    TEST_ASSERT_EQUAL_STRING("unknown health bit", hexload_health_name(HEXLOAD_HEALTH_BITS));
    TEST_ASSERT_EQUAL_STRING("unknown health bit", hexload_health_name((hexload_health_bit_t)31));
    TEST_ASSERT_EQUAL_STRING("unknown status", hexload_status_name((hexload_status_t)-6));
    TEST_ASSERT_EQUAL_STRING("unknown", hexload_verdict_name((hexload_verdict_t)5));
}

#define END_MARGIN(least, most) (0.01 * fmin((most) - (least), fabs((double)(most))))
#define LEAST_MARGIN(least) (0.01 * ((least) == 0.0 ? 1e-6 : fabs((double)(least))))

/// Just outside its range, by a hundredth of each end or of the range, a field is refused.
#define ASSERT_REFUSED_OUTSIDE(field, least, most)                                                           \
    do {                                                                                                     \
        ASSERT_REFUSED(field, (hexload_real_t)((most) + END_MARGIN(least, most)));                           \
        ASSERT_REFUSED(field, (hexload_real_t)((least)-LEAST_MARGIN(least)));                                \
    } while (0)

/// GIVEN the default machine WHEN one field is set to a value THEN what the check says is not about it.
#define ASSERT_NOT_NAMED(field, value)                                                                       \
    do {                                                                                                     \
        hexload_config_t config = paper_machine();                                                           \
        const char* bad_field = "";                                                                          \
        config.field = (value);                                                                              \
        TEST_ASSERT_TRUE_MESSAGE(hexload_config_check(&config, &bad_field) == HEXLOAD_OK ||                  \
                                     strncmp(#field, bad_field, strlen(bad_field)) != 0,                     \
                                 #field);                                                                    \
    } while (0)

/// And as far inside, or at the upper end itself, it is not.
#define ASSERT_RANGE(field, least, most)                                                                     \
    do {                                                                                                     \
        ASSERT_REFUSED_OUTSIDE(field, least, most);                                                          \
        ASSERT_NOT_NAMED(field, (hexload_real_t)(most));                                                     \
        ASSERT_NOT_NAMED(field, (hexload_real_t)((most)-END_MARGIN(least, most)));                           \
        ASSERT_NOT_NAMED(field, (hexload_real_t)((least) + LEAST_MARGIN(least)));                            \
    } while (0)

static void test_config_knows_both_ends_of_every_range(void) {
    ASSERT_RANGE(tick_s, 0.9999e-4, 5.0001e-3);
    ASSERT_RANGE(gravity_m_s2, 0.0, 30.0);
    ASSERT_RANGE(sensors.displacement_sigma_m, 1e-10, 0.1);
    ASSERT_RANGE(sensors.velocity_sigma_m_s, 1e-8, 1.0);
    ASSERT_RANGE(sensors.force_sigma_n, 1e-6, 1e5);
    ASSERT_RANGE(sensors.velocity_range_m_s, 0.0, 50.0);
    ASSERT_RANGE(sensors.force_range_n, 0.0, 1e8);
    ASSERT_RANGE(paper.load_mass_kg, 0.0, 1e6);
    ASSERT_RANGE(paper.prior_dz_sigma_m, 0.0, 1e3);
    ASSERT_RANGE(paper.gate_nis, 3.0, 1e6);
    ASSERT_RANGE(paper.inconsistent_nis, 3.0, 1e6);
    // what is also refused for another field: periods below a tick, friction that pushes at rest
    ASSERT_REFUSED_OUTSIDE(paper.nis_time_constant_s, 0.0, 1e3);
    ASSERT_RANGE(paper.converged_relative_sigma, 0.0, 1.0);
    ASSERT_RANGE(momentum.prior_mass_kg, 0.0, 1e6);
    ASSERT_RANGE(momentum.prior_mass_sigma_kg, 0.0, 1e6);
    ASSERT_RANGE(momentum.prior_moment_sigma_kg_m, 0.0, 1e6);
    ASSERT_RANGE(momentum.prior_inertia_sigma_kg_m2, 0.0, 1e8);
    ASSERT_RANGE(momentum.inconsistent_nis, 6.0, 1e6);
    ASSERT_REFUSED_OUTSIDE(momentum.nis_time_constant_s, 0.0, 1e3);
    ASSERT_RANGE(momentum.converged_relative_sigma, 0.0, 1.0);
    ASSERT_REFUSED_OUTSIDE(momentum.excitation_time_constant_s, 0.0, 1e3);
    ASSERT_RANGE(momentum.timing_s, 0.0, 1.0);
    ASSERT_RANGE(actuator_effects.prior_bias_sigma_n, 0.0, 1e6);
    ASSERT_RANGE(actuator_effects.prior_coulomb_sigma_n, 0.0, 1e6);
    ASSERT_RANGE(actuator_effects.prior_viscous_sigma_n_s_m, 0.0, 1e8);
    ASSERT_RANGE(actuator_effects.prior_tilt_sigma_m_s2, 0.0, 30.0);
    ASSERT_RANGE(actuator_effects.friction_speed_m_s, 1e-6, 10.0);
    ASSERT_RANGE(actuator_effects.friction_shape, 0.0, 10.0);
    ASSERT_RANGE(actuator_effects.leg_share, 0.0, 1.0);
    ASSERT_RANGE(rig.force_offset_n[5], -1e6, 1e6);
    ASSERT_RANGE(rig.force_gain[5], -0.5, 0.5);
    ASSERT_RANGE(rig.coulomb_n[5], 0.0, 1e6);
    ASSERT_REFUSED_OUTSIDE(rig.stribeck_n[5], -1e6, 1e6);
    ASSERT_RANGE(rig.growth_n_n[5], 0.0, 0.5);
    ASSERT_RANGE(rig.viscous_n_s_m[5], 0.0, 1e8);
    ASSERT_RANGE(rig.stribeck_speed_m_s, 1e-6, 10.0);
    ASSERT_RANGE(rig.reversal_speed_m_s, 1e-6, 10.0);
    ASSERT_RANGE(rig.presliding_m, 0.0, 0.01);
    ASSERT_RANGE(rig.leg_inertia_kg_m2, -1e6, 1e6);
    ASSERT_RANGE(rig.leg_slide_kg_m, -1e6, 1e6);
    ASSERT_RANGE(rig.leg_tilt_kg_m, -1e6, 1e6);
    // what is only to be positive may be the least that a float has all digits of, 1.2e-38
    ASSERT_NOT_NAMED(sensors.force_range_n, HEXLOAD_REAL(1.3e-38));
    ASSERT_REFUSED(sensors.force_range_n, HEXLOAD_REAL(1.1e-38));
    ASSERT_REFUSED(tolerances, ((hexload_tolerances_t){.platform_inertia = HEXLOAD_REAL(1.01)}));
    ASSERT_REFUSED(tolerances, ((hexload_tolerances_t){.force_gain = HEXLOAD_REAL(-1e-6)}));
}

static void test_priors_of_legs_are_those_of_the_platform_s_mass(void) {
    // GIVEN the default configuration, with another platform WHEN the momentum filter's numbers are set anew
    hexload_config_t config = paper_machine();
    const hexload_real_t mass_kg = HEXLOAD_REAL(123.0);
    config.platform.mass_kg = mass_kg;
    hexload_config_set_momentum(&config);
    // THEN of a kilogram a leg may have 1 N of bias, 2 N of friction and 10 N s/m of viscous friction
    TEST_ASSERT_EQUAL_DOUBLE(123.0, (double)config.actuator_effects.prior_bias_sigma_n);
    TEST_ASSERT_EQUAL_DOUBLE(246.0, (double)config.actuator_effects.prior_coulomb_sigma_n);
    TEST_ASSERT_EQUAL_DOUBLE(1230.0, (double)config.actuator_effects.prior_viscous_sigma_n_s_m);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_config_accepts_the_default_machine);
    RUN_TEST(test_the_default_bridges_gaps_as_its_errors_allow);
    RUN_TEST(test_the_default_machine_is_that_of_the_paper);
    RUN_TEST(test_the_default_tolerances_ranges_and_speeds_are_those_of_the_header);
    RUN_TEST(test_config_accepts_a_platform_off_its_centre);
    RUN_TEST(test_config_names_each_field_out_of_range);
    RUN_TEST(test_printed_prior_is_the_papers_start_covariance);
    RUN_TEST(test_the_momentum_filters_prior_grows_with_mass_and_size_of_the_platform);
    RUN_TEST(test_the_lag_is_the_least_whose_regression_is_a_32nd_of_the_velocity_sensors_sigma);
    RUN_TEST(test_a_known_mass_is_known_to_a_thousandth);
    RUN_TEST(test_safe_prior_grows_with_the_load_it_is_for);
    RUN_TEST(test_config_names_what_contradicts_another_field);
    RUN_TEST(test_any_leg_that_may_be_as_short_as_nothing_is_refused);
    RUN_TEST(test_a_leg_whose_friction_pushes_at_rest_is_refused);
    RUN_TEST(test_a_flat_platform_is_a_body);
    RUN_TEST(test_a_light_platform_is_a_body_and_a_rod_without_width_is_none);
    RUN_TEST(test_a_tensor_is_that_of_a_body_about_its_own_centre);
    RUN_TEST(test_config_accepts_the_ends_of_its_ranges);
    RUN_TEST(test_only_directions_that_count_are_checked);
    RUN_TEST(test_gravity_that_is_no_vector_or_points_up_is_refused);
    RUN_TEST(test_health_counters_stay_at_their_end);
    RUN_TEST(test_bits_beyond_those_of_health_count_nothing);
    RUN_TEST(test_numbers_without_a_name_are_called_unknown);
    RUN_TEST(test_config_knows_both_ends_of_every_range);
    RUN_TEST(test_priors_of_legs_are_those_of_the_platform_s_mass);
    return UNITY_END();
}
