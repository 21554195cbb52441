#include "algebra/leg_blocks.h"
#include "paper/paper_model.h"
#include "motion.h"

#include <string.h>

void setUp(void) {}
void tearDown(void) {}

enum { STATES = 3 + HEXLOAD_PAPER_DIM };

/// A filter of the crooked machine in mid-motion, with steady leg forces: this tick's and the last ones
/// alike.
typedef struct fixture {
    hexload_config_t config;
    hexload_paper_filter_t filter;
    hexload_motion_t motion;
    hexload_leg_blocks_t jacobian;
    hexload_leg_sample_t sample;
} fixture_t;

static fixture_t make_fixture(void) {
    static const body_t load = {500.0, {0.0, 0.0, 0.3}, {25.0, 25.0, 25.0, 0.0, 0.0, 0.0}};
    static const hexload_real_t param[HEXLOAD_PAPER_DIM] = {HEXLOAD_REAL(0.25), HEXLOAD_REAL(20.0),
                                                            HEXLOAD_REAL(30.0), HEXLOAD_REAL(15.0)};
    fixture_t x;
    hexload_kinematics_t kinematics;
    const motion_t motion = random_motion(3, 0.05, 0.15);
    x.config = crooked_machine();
    hexload_paper_filter_init(&x.filter, &x.config);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_kinematics_init(&kinematics, &x.config));
    x.sample = perfect_sample(&x.config, &load, &motion, (double)kinematics.home_height_m, 123);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_kinematics_solve(&kinematics, &x.config, &x.sample, &x.motion));
    x.jacobian = kinematics.jacobian;
    memcpy(x.filter.param, param, sizeof param);
    memset(x.filter.param_cov, 0, sizeof x.filter.param_cov);
    x.filter.history = HEXLOAD_FORCE_HISTORY;
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        x.sample.force_n[leg] = (hexload_real_t)(1000 + 300 * leg);
        for (int n = 0; n < HEXLOAD_FORCE_HISTORY; n++) {
            x.filter.last_force_n[n][leg] = x.sample.force_n[leg];
        }
    }
    return x;
}

static hexload_present_tick_t present(const fixture_t* x, uint32_t gap_ticks) {
    return (hexload_present_tick_t){
        .sample = &x->sample, .motion = &x->motion, .sensors = x->config.sensors, .gap_ticks = gap_ticks};
}

static hexload_wrench_t wrench_of(const fixture_t* x) {
    hexload_wrench_t wrench;
    hexload_wrench_compute(&x->motion, &x->sample, &wrench);
    return wrench;
}

/// The model of a step in which the wrench does not change.
static hexload_paper_model_t model_of(const fixture_t* x, double dt_s) {
    fixture_t steady = *x;
    hexload_paper_model_t model;
    const hexload_wrench_t wrench = wrench_of(x);
    steady.filter.last_wrench = wrench;
    const hexload_present_tick_t now = present(x, 1);
    hexload_paper_model_linearise(&steady.filter, &x->config, &now, &wrench, (hexload_real_t)dt_s, &model);
    return model;
}

static uint32_t step(fixture_t* x, uint32_t gap_ticks) {
    uint32_t health = 0;
    const hexload_wrench_t wrench = wrench_of(x);
    x->filter.last_wrench = wrench;
    x->motion.jacobian = &x->jacobian; // the fixture may have been copied
    const hexload_present_tick_t now = present(x, gap_ticks);
    hexload_paper_filter_step(&x->filter, &x->config, &now, &wrench, &health);
    return health;
}

static void measured_rate(const fixture_t* x, double rate[3]) {
    hexload_real_t platform_axes[3];
    hexload_motion_to_platform(&x->motion, &x->motion.twist[3], platform_axes);
    for (int k = 0; k < 3; k++) {
        rate[k] = (double)platform_axes[k];
    }
}

/// Noise of the measured rates, sigma^2 C C^T with C in platform axes.
static void measured_noise(const fixture_t* x, double noise[3][3]) {
    const double sigma = (double)x->config.sensors.velocity_sigma_m_s;
    hexload_real_t columns[HEXLOAD_LEGS][6];
    memset(noise, 0, 9 * sizeof(double));
    hexload_leg_blocks_invert(&x->jacobian, columns);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        hexload_real_t column[3];
        hexload_motion_to_platform(&x->motion, &columns[leg][3], column);
        for (int i = 0; i < 3; i++) {
            for (int j = 0; j < 3; j++) {
                noise[i][j] += sigma * sigma * (double)column[i] * (double)column[j];
            }
        }
    }
}

/// Small diagonal P, and rates from which one step of dt_s arrives at the measured ones: the innovation is
/// zero.
static void make_innovation_zero(fixture_t* x, double dt_s) {
    static const double variance[HEXLOAD_PAPER_DIM] = {4e-4, 4.0, 9.0, 6.25};
    double rate[3];
    measured_rate(x, rate);
    for (int k = 0; k < HEXLOAD_PAPER_DIM; k++) {
        x->filter.param_cov[k][k] = (hexload_real_t)variance[k];
    }
    for (int k = 0; k < 3; k++) {
        x->filter.rate_cov[k][k] = (hexload_real_t)(1e-6 * (1 + k));
        x->filter.rate_rad_s[k] = (hexload_real_t)rate[k];
    }
    const hexload_paper_model_t model = model_of(x, dt_s);
    for (int k = 0; k < 3; k++) {
        x->filter.rate_rad_s[k] -= model.rate_step_rad_s[k];
    }
}

static void test_derivatives_agree_with_finite_differences(void) {
    const fixture_t x = make_fixture();
    const hexload_paper_model_t model = model_of(&x, 1e-3);
    double scale[2] = {0.0, 0.0}; // of dz's column and of the inertias'
    for (int i = 0; i < 3; i++) {
        scale[0] += fabs((double)model.by_dz[i]);
        scale[1] += fabs((double)model.by_inertia[i]);
    }
    for (int k = 0; k < HEXLOAD_PAPER_DIM; k++) {
        // GIVEN a parameter moved up and down
        fixture_t ahead = x, behind = x;
        const double h = k == HEXLOAD_PAPER_DZ ? 0.005 : 0.5;
        ahead.filter.param[k] += (hexload_real_t)h;
        behind.filter.param[k] -= (hexload_real_t)h;
        const hexload_paper_model_t up = model_of(&ahead, 1e-3), down = model_of(&behind, 1e-3);
        for (int i = 0; i < 3; i++) {
            // WHEN the rates' steps are compared THEN their slope is N's entry. The products of inertia, 3 %
            // of D, are in the step but not in N.
            const double slope = (double)(up.rate_step_rad_s[i] - down.rate_step_rad_s[i]) / (2.0 * h);
            const double entry = k == HEXLOAD_PAPER_DZ        ? (double)model.by_dz[i]
                                 : k - HEXLOAD_PAPER_IXX == i ? (double)model.by_inertia[i]
                                                              : 0.0;
            TEST_ASSERT_DOUBLE_WITHIN(0.03 * scale[k == HEXLOAD_PAPER_DZ ? 0 : 1], slope, entry);
        }
    }
}

static void test_derivatives_are_taken_at_one_sigma_more_inertia(void) {
    // GIVEN sigmas of 0.1 m, 2 and 3 kg m^2 for dz, Ixx and Izz
    fixture_t x = make_fixture();
    x.filter.param_cov[HEXLOAD_PAPER_DZ][HEXLOAD_PAPER_DZ] = HEXLOAD_REAL(0.01);
    x.filter.param_cov[HEXLOAD_PAPER_IXX][HEXLOAD_PAPER_IXX] = HEXLOAD_REAL(4.0);
    x.filter.param_cov[HEXLOAD_PAPER_IZZ][HEXLOAD_PAPER_IZZ] = HEXLOAD_REAL(9.0);
    const hexload_paper_model_t model = model_of(&x, 1e-3);
    // THEN D gains sqrt(P_II + (2 mu s)^2 P_zz), s = dz - com z
    const double reduced_kg = 100.0 * 500.0 / 600.0, lever_m = 0.25 + 0.05;
    const double dz_share = 4.0 * reduced_kg * reduced_kg * lever_m * lever_m * 0.01;
    const double expected[3] = {sqrt(4.0 + dz_share), sqrt(dz_share), 3.0};
    for (int k = 0; k < 3; k++) {
        const double gained = (double)(model.cautious_inertia_kg_m2[k] - model.inertia_kg_m2[k]);
        TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(20, 60.0), expected[k], gained);
    }
}

static void test_noise_is_the_sum_over_legs_of_what_one_newton_does(void) {
    for (uint32_t history = 0; history <= HEXLOAD_FORCE_HISTORY; history += HEXLOAD_FORCE_HISTORY) {
        // GIVEN third differences of 2, 3 ... 7 N in the legs' forces, known or not
        fixture_t x = make_fixture();
        double variance[HEXLOAD_LEGS], Q[3][3] = {{0}}, by_inertia[3] = {0}, by_dz[2] = {0}, mixed[2] = {0};
        x.filter.history = history;
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            const double difference_n = 2.0 + leg;
            x.filter.last_force_n[2][leg] -= (hexload_real_t)difference_n;
            variance[leg] = history == 0 ? 25.0 : difference_n * difference_n / 20.0;
        }
        const hexload_paper_model_t model = model_of(&x, 1e-3);
        // WHEN each leg's force is moved by 500 N and back
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            fixture_t ahead = x, behind = x;
            double rate[3], inertia[3], dz[3];
            ahead.sample.force_n[leg] += HEXLOAD_REAL(500.0);
            behind.sample.force_n[leg] -= HEXLOAD_REAL(500.0);
            const hexload_paper_model_t up = model_of(&ahead, 1e-3), down = model_of(&behind, 1e-3);
            for (int i = 0; i < 3; i++) {
                rate[i] = (double)(up.rate_step_rad_s[i] - down.rate_step_rad_s[i]) / 1000.0;
                inertia[i] = (double)(up.by_inertia[i] - down.by_inertia[i]) / 1000.0;
                dz[i] = (double)(up.by_dz[i] - down.by_dz[i]) / 1000.0;
            }
            for (int i = 0; i < 3; i++) {
                by_inertia[i] += variance[leg] * inertia[i] * inertia[i];
                for (int j = 0; j < 3; j++) {
                    Q[i][j] += 25.0 * rate[i] * rate[j];
                }
                if (i < 2) {
                    by_dz[i] += variance[leg] * dz[i] * dz[i];
                    mixed[i] += variance[leg] * dz[i] * inertia[i];
                }
            }
        }
        // THEN the model's noise is the sum of their effects, but for the products of inertia, 3 % of D,
        // squared with it
        for (int i = 0; i < 3; i++) {
            for (int j = 0; j <= i; j++) {
                TEST_ASSERT_DOUBLE_WITHIN(0.07 * sqrt(Q[i][i] * Q[j][j]), Q[i][j], (double)model.noise[i][j]);
            }
            TEST_ASSERT_DOUBLE_WITHIN(0.07 * by_inertia[i], by_inertia[i],
                                      (double)model.jacobian_noise.inertia[i]);
            if (i < 2) {
                TEST_ASSERT_DOUBLE_WITHIN(0.07 * by_dz[i], by_dz[i], (double)model.jacobian_noise.dz[i]);
                TEST_ASSERT_DOUBLE_WITHIN(0.07 * sqrt(by_dz[i] * by_inertia[i]), mixed[i],
                                          (double)model.jacobian_noise.mixed[i]);
            }
        }
    }
}

static void test_what_the_linearisation_leaves_out_stands_in_the_noise(void) {
    // GIVEN a filter that knows nothing yet, beside one that knows all
    const fixture_t known = make_fixture();
    fixture_t unknown = known;
    unknown.filter.param_cov[HEXLOAD_PAPER_DZ][HEXLOAD_PAPER_DZ] = HEXLOAD_REAL(0.1);
    for (int k = HEXLOAD_PAPER_IXX; k < HEXLOAD_PAPER_DIM; k++) {
        unknown.filter.param_cov[k][k] = HEXLOAD_REAL(500.0);
    }
    const hexload_paper_model_t small = model_of(&known, 1e-3), large = model_of(&unknown, 1e-3);
    // the forces that dz turns into torque, of the derivative by dz at D where all is known
    const double lever = 2.0 * (100.0 * 500.0 / 600.0) * (0.25 + 0.05); // d D / d dz
    double side_n[3] = {0.0, 0.0, 0.0};
    for (int k = 0; k < 2; k++) {
        const double by_lever = lever * (double)small.by_inertia[k];
        side_n[k] =
            ((double)small.by_dz[k] - by_lever) * (double)small.inertia_kg_m2[k] / (1e-3 * 500.0 / 600.0);
    }
    for (int k = 0; k < 3; k++) {
        // THEN Q is larger by 5 times (D14) the variance of the second-order terms
        const double D = (double)large.inertia_kg_m2[k];
        const double relative = pow((double)large.cautious_inertia_kg_m2[k] / D - 1.0, 2.0);
        const double square = 2.0 * pow((double)large.rate_step_rad_s[k] * relative, 2.0);
        const double cross = pow(1e-3 * 500.0 / 600.0 * side_n[k] / D, 2.0) * 0.1 * relative;
        TEST_ASSERT_DOUBLE_WITHIN(1e-3 * 5.0 * (square + cross), 5.0 * (square + cross),
                                  (double)(large.noise[k][k] - small.noise[k][k]));
    }
}

/// Entry of the whole covariance, rates first.
static double covariance(const hexload_paper_filter_t* filter, int i, int j) {
    if (j > i) {
        return covariance(filter, j, i);
    }
    return (double)(i < 3   ? filter->rate_cov[i][j]
                    : j < 3 ? filter->cross_cov[j][i - 3]
                            : filter->param_cov[i - 3][j - 3]);
}

/// A covariance with correlations of about 0.3 everywhere.
static void fill_covariance(hexload_paper_filter_t* filter) {
    static const double sigma[STATES] = {1e-3, 1e-3, 1e-3, 0.02, 2.0, 3.0, 2.5};
    double L[STATES][STATES] = {{0}};
    uint64_t seed = 5;
    for (int i = 0; i < STATES; i++) {
        for (int j = 0; j <= i; j++) {
            L[i][j] = sigma[i] * (i == j ? 1.0 : 0.3 * uniform(&seed));
        }
    }
    for (int i = 0; i < STATES; i++) {
        for (int j = 0; j < STATES; j++) {
            double sum = 0.0;
            for (int k = 0; k < STATES; k++) {
                sum += L[i][k] * L[j][k];
            }
            if (i < 3 && j < 3) {
                filter->rate_cov[i][j] = (hexload_real_t)sum;
            } else if (i < 3) {
                filter->cross_cov[i][j - 3] = (hexload_real_t)sum;
            } else if (j >= 3) {
                filter->param_cov[i - 3][j - 3] = (hexload_real_t)sum;
            }
        }
    }
}

/// Dense (32) and (36) in double precision: P and x in and out.
static double dense_step(double P[STATES][STATES], double state[STATES], const hexload_paper_model_t* model,
                         const double rate[3], double noise[3][3]) {
    double J[STATES][STATES] = {{0}}, JP[STATES][STATES], predicted[STATES][STATES], innovation[3], nis = 0.0;
    for (int i = 0; i < STATES; i++) {
        J[i][i] = 1.0;
    }
    for (int i = 0; i < 3; i++) {
        J[i][3] = (double)model->by_dz[i];
        J[i][4 + i] = (double)model->by_inertia[i];
        state[i] += (double)model->rate_step_rad_s[i];
        innovation[i] = rate[i] - state[i];
    }
    for (int i = 0; i < STATES; i++) {
        for (int j = 0; j < STATES; j++) {
            JP[i][j] = 0.0;
            for (int k = 0; k < STATES; k++) {
                JP[i][j] += J[i][k] * P[k][j];
            }
        }
    }
    for (int i = 0; i < STATES; i++) {
        for (int j = 0; j < STATES; j++) {
            predicted[i][j] =
                i < 3 && j < 3 ? (double)(i > j ? model->noise[i][j] : model->noise[j][i]) : 0.0;
            for (int k = 0; k < STATES; k++) {
                predicted[i][j] += JP[i][k] * J[j][k];
            }
        }
    }
    for (int row = 0; row < STATES; row++) { // gain row K = P H^T S^-1 by elimination
        double A[6][6] = {{0}}, b[6] = {0}, K[6];
        for (int i = 0; i < 6; i++) {
            A[i][i] = 1.0;
        }
        for (int i = 0; i < 3; i++) {
            b[i] = predicted[row][i];
            for (int j = 0; j < 3; j++) {
                A[i][j] = predicted[i][j] + noise[i][j];
            }
        }
        solve6(A, b, K);
        for (int j = 0; j < STATES; j++) {
            P[row][j] =
                predicted[row][j] - K[0] * predicted[0][j] - K[1] * predicted[1][j] - K[2] * predicted[2][j];
        }
        state[row] += K[0] * innovation[0] + K[1] * innovation[1] + K[2] * innovation[2];
    }
    double A[6][6] = {{0}}, b[6] = {0}, whitened[6];
    for (int i = 0; i < 6; i++) {
        A[i][i] = 1.0;
    }
    for (int i = 0; i < 3; i++) {
        b[i] = innovation[i];
        for (int j = 0; j < 3; j++) {
            A[i][j] = predicted[i][j] + noise[i][j];
        }
    }
    solve6(A, b, whitened);
    for (int i = 0; i < 3; i++) {
        nis += innovation[i] * whitened[i];
    }
    return nis;
}

static void test_block_step_is_the_dense_filters(void) {
    // GIVEN a full covariance, steady forces (so that nothing is taken out for noise) and an innovation of 1,
    // 2, 3 mrad/s
    fixture_t x = make_fixture();
    double P[STATES][STATES], state[STATES], rate[3], noise[3][3];
    make_innovation_zero(&x, 1e-3);
    fill_covariance(&x.filter);
    measured_rate(&x, rate);
    measured_noise(&x, noise);
    for (int k = 0; k < 3; k++) {
        x.filter.rate_rad_s[k] -= (hexload_real_t)(1e-3 * (k + 1));
    }
    const hexload_paper_model_t model = model_of(&x, 1e-3);
    for (int i = 0; i < STATES; i++) {
        state[i] = (double)(i < 3 ? x.filter.rate_rad_s[i] : x.filter.param[i - 3]);
        for (int j = 0; j < STATES; j++) {
            P[i][j] = covariance(&x.filter, i, j);
        }
    }
    // WHEN one step is taken in blocks, and one with dense 7 x 7 matrices
    TEST_ASSERT_EQUAL_UINT32(0, step(&x, 1));
    const double nis = dense_step(P, state, &model, rate, noise);
    // THEN state, covariance and NIS agree to the roundings of P, whose factors span five orders of magnitude
    TEST_ASSERT_DOUBLE_WITHIN(1e-3 * nis, nis, (double)x.filter.nis);
    for (int i = 0; i < STATES; i++) {
        const double found = (double)(i < 3 ? x.filter.rate_rad_s[i] : x.filter.param[i - 3]);
        TEST_ASSERT_DOUBLE_WITHIN(2e-3 * sqrt(P[i][i]), state[i], found);
        for (int j = 0; j < STATES; j++) {
            TEST_ASSERT_DOUBLE_WITHIN(1e-3 * sqrt(P[i][i] * P[j][j]), P[i][j], covariance(&x.filter, i, j));
        }
    }
}

static void test_force_noise_is_taken_out_of_variance_and_value(void) {
    // GIVEN two filters that are alike but for the noise that their Jacobians have gathered
    static const double inertia[3] = {1e-8, 2e-8, 3e-8}, dz[2] = {2e-4, 3e-4}, mixed[2] = {-1e-6, 1.5e-6};
    fixture_t quiet = make_fixture();
    make_innovation_zero(&quiet, 1e-3);
    fixture_t noisy = quiet;
    double noise[3][3], prior[HEXLOAD_PAPER_DIM];
    measured_noise(&quiet, noise);
    for (int k = 0; k < HEXLOAD_PAPER_DIM; k++) {
        prior[k] = (double)quiet.filter.param_cov[k][k];
    }
    for (int i = 0; i < 3; i++) {
        noisy.filter.jacobian_noise.inertia[i] = (hexload_real_t)inertia[i];
        if (i < 2) {
            noisy.filter.jacobian_noise.dz[i] = (hexload_real_t)dz[i];
            noisy.filter.jacobian_noise.mixed[i] = (hexload_real_t)mixed[i];
        }
    }
    const hexload_paper_model_t model = model_of(&quiet, 1e-3);
    // WHEN both take the same step
    TEST_ASSERT_EQUAL_UINT32(0, step(&quiet, 1));
    TEST_ASSERT_EQUAL_UINT32(0, step(&noisy, 1));
    // THEN each row's noise has moved dz and the row's own inertia, each also by what P ties it to the other,
    // and widened both (D15), and it fades with (1 - K)^2
    double dz_variance = covariance(&quiet.filter, 3, 3), dz_moved = 0.0;
    for (int i = 0; i < 3; i++) {
        const double cautious_D = (double)model.cautious_inertia_kg_m2[i];
        const double lever = cautious_D * cautious_D / (double)model.inertia_kg_m2[i];
        const double predicted = 1e-6 * (1 + i) + (double)model.noise[i][i] +
                                 pow((double)model.by_dz[i], 2.0) * prior[0] +
                                 pow((double)model.by_inertia[i], 2.0) * prior[1 + i];
        const double S = predicted + noise[i][i];
        const double kept = (double)quiet.filter.rate_cov[i][i] / predicted;
        const double variance = covariance(&quiet.filter, 4 + i, 4 + i);
        const double both = i < 2 ? covariance(&quiet.filter, 4 + i, 3) : 0.0;
        const double of_both = i < 2 ? mixed[i] : 0.0;
        const double moved = lever * (variance * inertia[i] + both * of_both) / S,
                     widened = variance * variance * inertia[i] / S;
        dz_moved -= lever * (both * inertia[i] + dz_variance * of_both) / S;
        TEST_ASSERT_DOUBLE_WITHIN(0.02 * fabs(moved), moved,
                                  (double)(quiet.filter.param[1 + i] - noisy.filter.param[1 + i]));
        TEST_ASSERT_DOUBLE_WITHIN(0.02 * widened, widened,
                                  (double)noisy.filter.param_cov[1 + i][1 + i] - variance);
        TEST_ASSERT_DOUBLE_WITHIN(0.02 * inertia[i], inertia[i] * kept * kept,
                                  (double)noisy.filter.jacobian_noise.inertia[i]);
        if (i < 2) {
            dz_variance += dz_variance * dz_variance * dz[i] / S;
            TEST_ASSERT_DOUBLE_WITHIN(0.02 * dz[i], dz[i] * kept * kept,
                                      (double)noisy.filter.jacobian_noise.dz[i]);
            TEST_ASSERT_DOUBLE_WITHIN(0.02 * fabs(mixed[i]), mixed[i] * kept * kept,
                                      (double)noisy.filter.jacobian_noise.mixed[i]);
        }
    }
    TEST_ASSERT_DOUBLE_WITHIN(0.03 * fabs(dz_moved), dz_moved,
                              (double)(noisy.filter.param[0] - quiet.filter.param[0]));
    TEST_ASSERT_DOUBLE_WITHIN(0.01 * dz_variance, dz_variance, (double)noisy.filter.param_cov[0][0]);
}

/// A platform that turns about its own z axis under a load on that axis: what its legs do, without gravity,
/// which has no moment about the common centre of mass.
static hexload_wrench_t turning_about_z(const fixture_t* x, double rate_rad_s, double acceleration_rad_s2) {
    const hexload_platform_t* platform = &x->config.platform;
    const double mass_kg = (double)platform->mass_kg, square = rate_rad_s * rate_rad_s;
    const double cx = (double)platform->com_m[0], cy = (double)platform->com_m[1];
    const double xz = (double)platform->inertia_kg_m2[HEXLOAD_I_XZ],
                 yz = (double)platform->inertia_kg_m2[HEXLOAD_I_YZ],
                 zz = (double)(platform->inertia_kg_m2[HEXLOAD_I_ZZ] + x->filter.param[HEXLOAD_PAPER_IZZ]);
    const double force_n[3] = {mass_kg * (-acceleration_rad_s2 * cy - square * cx),
                               mass_kg * (acceleration_rad_s2 * cx - square * cy), 0.0};
    const double moment_nm[3] = {xz * acceleration_rad_s2 - yz * square,
                                 yz * acceleration_rad_s2 + xz * square, zz * acceleration_rad_s2};
    hexload_wrench_t wrench;
    for (int k = 0; k < 3; k++) {
        wrench.force_n[k] = (hexload_real_t)force_n[k];
        wrench.moment_nm[k] = (hexload_real_t)moment_nm[k];
    }
    return wrench;
}

static void test_a_platform_that_turns_about_its_z_axis_tells_nothing_of_dz(void) {
    // GIVEN a platform whose own centre of mass is off its axis, that turns about this axis alone
    fixture_t x = make_fixture();
    x.filter.rate_rad_s[0] = x.filter.rate_rad_s[1] = HEXLOAD_REAL(0.0);
    x.filter.rate_rad_s[2] = HEXLOAD_REAL(0.7);
    const hexload_wrench_t wrench = turning_about_z(&x, 0.7, 4.0);
    x.filter.last_wrench = wrench;
    const hexload_present_tick_t now = present(&x, 1);
    hexload_paper_model_t model;
    // WHEN the step is made linear
    hexload_paper_model_linearise(&x.filter, &x.config, &now, &wrench, HEXLOAD_REAL(1e-3), &model);
    // THEN it turns as it does, and does not depend on where on the axis the load is: but for half a tick of
    // its turning, and by hundreds of times less than the forces alone seem to tell
    TEST_ASSERT_DOUBLE_WITHIN(1e-4 * 4e-3, 4e-3, (double)model.rate_step_rad_s[2]);
    for (int k = 0; k < 2; k++) {
        const double by_force = 1e-3 * 500.0 / 600.0 *
                                hypot((double)wrench.force_n[0], (double)wrench.force_n[1]) /
                                (double)model.inertia_kg_m2[k];
        TEST_ASSERT_DOUBLE_WITHIN(0.005 * by_force, 0.0, (double)model.by_dz[k]);
    }
}

static void test_noise_removal_beyond_its_bound_is_held_and_said(void) {
    static const double far_beyond = 1e3; // makes each share of noise exceed one by orders of magnitude
    for (int n = 0; n < 3; n++) {
        // GIVEN a filter whose Jacobian has gathered too much noise of one kind: as after a spike in a force
        fixture_t quiet = make_fixture();
        make_innovation_zero(&quiet, 1e-3);
        fixture_t noisy = quiet;
        hexload_jacobian_noise_t* noise = &noisy.filter.jacobian_noise;
        hexload_real_t* const kinds[3] = {&noise->inertia[1], &noise->dz[1], &noise->mixed[1]};
        *kinds[n] = (hexload_real_t)far_beyond;
        const hexload_paper_model_t model = model_of(&quiet, 1e-3);
        // WHEN both take the same step
        TEST_ASSERT_EQUAL_UINT32(0, step(&quiet, 1));
        const uint32_t health = step(&noisy, 1);
        // THEN the bound is said, no variance has more than doubled, and dz has moved by one sigma at most
        TEST_ASSERT_BITS_HIGH(1u << HEXLOAD_HEALTH_NOISE_BOUNDED, health);
        const double sigma = sqrt((double)quiet.filter.param_cov[0][0]);
        TEST_ASSERT_DOUBLE_WITHIN(1.001 * sigma, (double)quiet.filter.param[0],
                                  (double)noisy.filter.param[0]);
        // AND an inertia by its lever (D15) at most, also where P ties it to dz
        for (int k = 0; k < HEXLOAD_PAPER_DIM; k++) {
            const double variance = (double)quiet.filter.param_cov[k][k];
            TEST_ASSERT_TRUE((double)noisy.filter.param_cov[k][k] <= 2.001 * variance);
        }
        for (int k = 0; k < 3; k++) {
            const double cautious_D = (double)model.cautious_inertia_kg_m2[k];
            const double lever = cautious_D * cautious_D / (double)model.inertia_kg_m2[k];
            TEST_ASSERT_DOUBLE_WITHIN(1.001 * lever, (double)quiet.filter.param[1 + k],
                                      (double)noisy.filter.param[1 + k]);
        }
    }
}

static void test_variances_stay_between_floor_and_prior(void) {
    // GIVEN an inertia below zero, one variance far below its floor and one above its prior, with
    // correlations
    fixture_t x = make_fixture();
    x.filter.param[HEXLOAD_PAPER_IXX] = HEXLOAD_REAL(-1.0);
    make_innovation_zero(&x, 1e-3);
    x.filter.param_cov[HEXLOAD_PAPER_IYY][HEXLOAD_PAPER_IYY] = HEXLOAD_REAL(1e-20);
    x.filter.param_cov[HEXLOAD_PAPER_IZZ][HEXLOAD_PAPER_IZZ] = HEXLOAD_REAL(1000.0);
    x.filter.param_cov[HEXLOAD_PAPER_IZZ][HEXLOAD_PAPER_IXX] = HEXLOAD_REAL(10.0);
    x.filter.cross_cov[2][HEXLOAD_PAPER_IZZ] = HEXLOAD_REAL(1e-3);
    fixture_t unbounded = x;
    unbounded.filter.constants.prior_variance[HEXLOAD_PAPER_IZZ] = HEXLOAD_REAL(1e6);
    // WHEN it takes a step, beside one whose prior is out of reach
    const uint32_t health = step(&x, 1);
    (void)step(&unbounded, 1);
    // THEN both bounds are said, the inertia is zero, and the correlations are kept
    const hexload_paper_filter_t *bounded = &x.filter, *free = &unbounded.filter;
    const double most = (double)bounded->constants.prior_variance[HEXLOAD_PAPER_IZZ];
    const double scale = sqrt(most / (double)free->param_cov[HEXLOAD_PAPER_IZZ][HEXLOAD_PAPER_IZZ]);
    TEST_ASSERT_EQUAL_UINT32(1u << HEXLOAD_HEALTH_COVARIANCE_BOUNDED | 1u << HEXLOAD_HEALTH_INERTIA_BOUNDED,
                             health);
    TEST_ASSERT_EQUAL_DOUBLE(0.0, (double)bounded->param[HEXLOAD_PAPER_IXX]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6 * most, most,
                              (double)bounded->param_cov[HEXLOAD_PAPER_IZZ][HEXLOAD_PAPER_IZZ]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-2, scale * (double)free->param_cov[HEXLOAD_PAPER_IZZ][HEXLOAD_PAPER_IXX],
                              (double)bounded->param_cov[HEXLOAD_PAPER_IZZ][HEXLOAD_PAPER_IXX]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, scale * (double)free->cross_cov[2][HEXLOAD_PAPER_IZZ],
                              (double)bounded->cross_cov[2][HEXLOAD_PAPER_IZZ]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-15, 1e-14 * 500.0,
                              (double)bounded->param_cov[HEXLOAD_PAPER_IYY][HEXLOAD_PAPER_IYY]);
}

static void test_restart_of_the_rates_forgets_all_that_hung_on_them(void) {
    // GIVEN a filter with correlations, gathered noise and a wrong rate
    fixture_t x = make_fixture();
    double noise[3][3];
    make_innovation_zero(&x, 1e-3);
    measured_noise(&x, noise);
    x.filter.cross_cov[0][0] = HEXLOAD_REAL(1e-4);
    x.filter.jacobian_noise.inertia[1] = HEXLOAD_REAL(1e-6);
    x.filter.gated = 5;
    // WHEN a sample comes after a gap that is too long
    TEST_ASSERT_EQUAL_UINT32(1u << HEXLOAD_HEALTH_RATE_RESEEDED,
                             step(&x, x.config.paper.longest_gap_ticks + 1));
    // THEN what is left is the parameters and the measured rate
    TEST_ASSERT_EQUAL_DOUBLE(0.0, (double)x.filter.cross_cov[0][0]);
    TEST_ASSERT_EQUAL_DOUBLE(0.0, (double)x.filter.jacobian_noise.inertia[1]);
    TEST_ASSERT_EQUAL_UINT32(0, x.filter.gated);
    TEST_ASSERT_EQUAL_DOUBLE(3.0, (double)x.filter.nis); // that of no innovation: its mean
    TEST_ASSERT_EQUAL_UINT32(1, x.filter.history);
    TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(20, noise[0][0]), noise[0][0], (double)x.filter.rate_cov[0][0]);
}

static void test_rates_restart_when_rounding_has_cost_p_its_sign(void) {
    fixture_t x = make_fixture();
    make_innovation_zero(&x, 1e-3);
    for (int k = 0; k < 3; k++) {
        x.filter.rate_cov[k][k] = HEXLOAD_REAL(-1.0);
    }
    TEST_ASSERT_EQUAL_UINT32(1u << HEXLOAD_HEALTH_RATE_RESEEDED, step(&x, 1));
    TEST_ASSERT_TRUE(x.filter.rate_cov[0][0] > HEXLOAD_REAL(0.0));
}

static void test_filter_begins_anew_when_a_number_is_no_longer_finite(void) {
    fixture_t x = make_fixture();
    make_innovation_zero(&x, 1e-3);
    x.filter.param[HEXLOAD_PAPER_DZ] = (hexload_real_t)NAN;
    TEST_ASSERT_BITS_HIGH(1u << HEXLOAD_HEALTH_FILTER_RESTARTED, step(&x, 1));
    TEST_ASSERT_EQUAL_DOUBLE(0.0, (double)x.filter.param[HEXLOAD_PAPER_DZ]);
    TEST_ASSERT_EQUAL_DOUBLE((double)x.filter.constants.prior_variance[0], (double)x.filter.param_cov[0][0]);
}

static void test_step_over_a_gap_is_as_long_as_the_gap(void) {
    // GIVEN rates that fit the measured ones after three ticks, and hardly any uncertainty
    fixture_t x = make_fixture();
    make_innovation_zero(&x, 3e-3);
    // WHEN the sample comes three ticks after the last THEN there is no innovation
    (void)step(&x, 3);
    TEST_ASSERT_TRUE(x.filter.nis < HEXLOAD_REAL(1e-3));
}

static void test_one_good_innovation_closes_the_count_of_gated_ones(void) {
    fixture_t x = make_fixture();
    make_innovation_zero(&x, 1e-3);
    x.filter.gated = 7;
    TEST_ASSERT_EQUAL_UINT32(0, step(&x, 1));
    TEST_ASSERT_EQUAL_UINT32(0, x.filter.gated);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_derivatives_agree_with_finite_differences);
    RUN_TEST(test_derivatives_are_taken_at_one_sigma_more_inertia);
    RUN_TEST(test_noise_is_the_sum_over_legs_of_what_one_newton_does);
    RUN_TEST(test_what_the_linearisation_leaves_out_stands_in_the_noise);
    RUN_TEST(test_block_step_is_the_dense_filters);
    RUN_TEST(test_force_noise_is_taken_out_of_variance_and_value);
    RUN_TEST(test_a_platform_that_turns_about_its_z_axis_tells_nothing_of_dz);
    RUN_TEST(test_noise_removal_beyond_its_bound_is_held_and_said);
    RUN_TEST(test_variances_stay_between_floor_and_prior);
    RUN_TEST(test_restart_of_the_rates_forgets_all_that_hung_on_them);
    RUN_TEST(test_rates_restart_when_rounding_has_cost_p_its_sign);
    RUN_TEST(test_filter_begins_anew_when_a_number_is_no_longer_finite);
    RUN_TEST(test_step_over_a_gap_is_as_long_as_the_gap);
    RUN_TEST(test_one_good_innovation_closes_the_count_of_gated_ones);
    return UNITY_END();
}
