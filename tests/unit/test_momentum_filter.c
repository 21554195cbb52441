#include "momentum/momentum_filter.h"
#include "textbook.h"

#include <math.h>
#include <string.h>

void setUp(void) {}
void tearDown(void) {}

enum { DIM = HEXLOAD_LOAD_DIM, ALL = HEXLOAD_MOMENTUM_STATES };

/// Of states and covariance, beside their sigmas: some hundred operations on numbers that are up to a hundred
/// times their difference.
static const double rounding = 2e4 * (double)HEXLOAD_REAL_EPSILON;

static const double state_sigma[ALL] = {30, 5, 6, 7, 3, 4, 5, 1, 2, 1.5, 2, 3, 2.5, 1, 1.5, 2};

typedef struct textbook {
    double theta[DIM];
    double momentum[6];
    double P[ALL][ALL]; ///< theta, then mu
    double nis;
} textbook_t;

/// Angular velocities that have no noise.
static const hexload_smoother_constants_t without_noise = {.rate_gain = {19, 17, 22}};

typedef struct step {
    scene_t before, now;
    hexload_sensors_t sensors;
    hexload_delayed_tick_t past;
    hexload_momentum_filter_t filter;
    textbook_t textbook; ///< of the same state
    double body[DIM];    ///< of platform and load
} step_t;

/// P = F P F^T with mu+ = mu + Gbar theta, plus the noise of forces.
static void predict(const step_t* step, textbook_t* self) {
    const hexload_smooth_sample_t* smooth = &step->past.smooth;
    const double dt_s = (double)step->now.config.tick_s * smooth->gap_ticks;
    const double sigma_n_s = dt_s * (double)step->sensors.force_sigma_n;
    double G[2][6][10], Jw[2][6][6], F[ALL][ALL] = {{0}}, FP[ALL][ALL], variance[6], noise[6][6] = {{0}};
    const scene_t* scene[2] = {&step->before, &step->now};
    const hexload_real_t* force_n[2] = {step->before.sample.force_n, smooth->sample.force_n};
    for (int at = 0; at < 2; at++) {
        weights_of(&scene[at]->motion, (double)step->now.config.gravity_m_s2, G[at]);
        pushes_of(&scene[at]->motion, Jw[at]);
    }
    for (int a = 0; a < ALL; a++) {
        F[a][a] = 1.0;
    }
    for (int a = 0; a < 6; a++) {
        for (int at = 0; at < 2; at++) {
            for (int leg = 0; leg < 6; leg++) {
                self->momentum[a] += 0.5 * dt_s * Jw[at][a][leg] * (double)force_n[at][leg];
            }
            for (int k = 0; k < DIM; k++) {
                F[DIM + a][k] += 0.5 * dt_s * G[at][a][k];
                self->momentum[a] += 0.5 * dt_s * G[at][a][k] * step->body[k];
            }
        }
    }
    times_transposed(&F[0][0], &self->P[0][0], ALL, ALL, ALL, &FP[0][0]);
    times_transposed(&FP[0][0], &F[0][0], ALL, ALL, ALL, &self->P[0][0]);
    for (int leg = 0; leg < 6; leg++) {
        variance[leg] = sigma_n_s * sigma_n_s + dt_s * dt_s * (double)smooth->force_variance_n2[leg];
    }
    add_noise_of(Jw[1], variance, noise);
    for (int a = 0; a < 6; a++) {
        for (int b = 0; b < 6; b++) {
            self->P[DIM + a][DIM + b] += noise[a][b];
        }
    }
}

/// Speeds that the smoother finds, those that it leaves of the measured ones, and how far these stand out.
typedef struct speeds {
    double smooth_m_s[6], left_m_s[6], smooth_twist[6], left_twist[6], twist[6];
    double q;
} speeds_t;

static speeds_t speeds_of(const step_t* step) {
    const hexload_smooth_sample_t* smooth = &step->past.smooth;
    speeds_t speeds = {.q = 0.0};
    for (int leg = 0; leg < 6; leg++) {
        speeds.smooth_m_s[leg] = (double)smooth->smooth_velocity_m_s[leg];
        speeds.left_m_s[leg] = (double)smooth->sample.velocity_m_s[leg] - speeds.smooth_m_s[leg];
        speeds.twist[leg] = (double)step->now.motion.twist[leg];
        speeds.q += pow(speeds.left_m_s[leg] / (double)step->sensors.velocity_sigma_m_s, 2.0);
    }
    twist_of(&step->now.motion, speeds.smooth_m_s, speeds.smooth_twist);
    for (int k = 0; k < 6; k++) {
        speeds.left_twist[k] = speeds.twist[k] - speeds.smooth_twist[k];
    }
    return speeds;
}

/// Platform and load, whose mass and moments of inertia are none below 0 and a sigma larger, and its products
/// a sigma nearer to 0; no sigma above what half the mass has at the speed of the legs.
static void cautious_body(const step_t* step, const textbook_t* self, double body[DIM]) {
    const hexload_real_t* gain = step->past.smoother->rate_gain;
    memcpy(body, step->body, sizeof step->body);
    body[HEXLOAD_LOAD_M] = (double)step->filter.platform[HEXLOAD_LOAD_M] +
                           fmax((double)step->filter.theta[HEXLOAD_LOAD_M], 0.0) + sqrt(self->P[0][0]);
    const double most = 0.5 * body[HEXLOAD_LOAD_M] / (double)(gain[0] + gain[1] + gain[2]);
    for (int k = HEXLOAD_LOAD_IXX; k < DIM; k++) {
        const double sigma = fmin(sqrt(self->P[k][k]), most);
        if (k <= HEXLOAD_LOAD_IZZ) {
            body[k] = (double)step->filter.platform[k] + fmax((double)step->filter.theta[k], 0.0) + sigma;
        } else {
            body[k] = copysign(fmax(fabs(body[k]) - sigma, 0.0), body[k]);
        }
    }
}

/// R: of leg speeds by the cautious body; of the parameters by the part of the twist that is left out. What
/// stands out of noise lasts 12 ticks.
static void measurement_noise(const step_t* step, const textbook_t* self, const speeds_t* speeds,
                              double R[6][6]) {
    const double ticks = 1.0 + 12.0 * fmax(0.0, 1.0 - 12.59 / speeds->q);
    const double white = pow((double)step->sensors.velocity_sigma_m_s, 2.0);
    double body[DIM], columns[6][6], Y[6][10], P[DIM][DIM], YP[6][10], variance[6];
    cautious_body(step, self, body);
    momenta_of_legs(&step->now.motion, body, columns);
    regressor_of(&step->now.motion, speeds->left_twist, Y);
    for (int i = 0; i < DIM; i++) {
        memcpy(P[i], self->P[i], sizeof P[i]);
    }
    times_transposed(&Y[0][0], &P[0][0], 6, DIM, DIM, &YP[0][0]);
    times_transposed(&YP[0][0], &Y[0][0], 6, 6, DIM, &R[0][0]);
    for (int a = 0; a < 6; a++) {
        variance[a] = (step->sensors.half_window_ticks > 0 ? ticks : 1.0) * white;
        for (int b = 0; b < 6; b++) {
            R[a][b] *= ticks;
        }
    }
    add_noise_of(columns, variance, R);
}

/// x -= K e, P -= K H P, K = P H^T (H P H^T + R)^-1, H = [Y, -E], e = Y(V) body - mu.
static void correct(const step_t* step, textbook_t* self, const speeds_t* speeds) {
    double Y[6][10], H[6][ALL] = {{0}}, e[6], HP[6][ALL], S[6][6], inverse[6][6], K[ALL][6], R[6][6];
    measurement_noise(step, self, speeds, R);
    regressor_of(&step->now.motion, speeds->smooth_twist, Y);
    momentum_of(&step->now.motion, speeds->twist, step->body, e);
    for (int k = 0; k < DIM; k++) {
        self->P[k][k] *= 1.000000238;
    }
    for (int a = 0; a < 6; a++) {
        memcpy(H[a], Y[a], sizeof Y[a]);
        H[a][DIM + a] = -1.0;
        e[a] -= self->momentum[a];
    }
    times_transposed(&H[0][0], &self->P[0][0], 6, ALL, ALL, &HP[0][0]);
    times_transposed(&HP[0][0], &H[0][0], 6, 6, ALL, &S[0][0]);
    for (int a = 0; a < 6; a++) {
        for (int b = 0; b < 6; b++) {
            S[a][b] += R[a][b];
        }
        S[a][a] += 4e-6 * self->P[DIM + a][DIM + a]; // what rounding leaves
    }
    invert(&S[0][0], 6, &inverse[0][0]);
    self->nis = 0.0;
    for (int i = 0; i < ALL; i++) {
        double correction = 0.0;
        for (int a = 0; a < 6; a++) {
            K[i][a] = 0.0;
            for (int b = 0; b < 6; b++) {
                K[i][a] += HP[b][i] * inverse[b][a];
                self->nis += i == 0 ? e[a] * inverse[a][b] * e[b] : 0.0;
            }
            correction -= K[i][a] * e[a];
        }
        *(i < DIM ? &self->theta[i] : &self->momentum[i - DIM]) += correction;
    }
    for (int i = 0; i < ALL; i++) {
        for (int j = 0; j < ALL; j++) {
            for (int a = 0; a < 6; a++) {
                self->P[i][j] -= K[i][a] * HP[a][j];
            }
        }
    }
}

/// P_mt = Y P_tt, P_mm = Y P_tt Y^T and the noise of leg speeds, with four times the square of what is left.
static void seed_momentum(const step_t* step, textbook_t* self, const speeds_t* speeds) {
    double Y[6][10], body[DIM], columns[6][6], variance[6], P[DIM][DIM], YP[6][10], M[6][6];
    regressor_of(&step->now.motion, speeds->smooth_twist, Y);
    momentum_of(&step->now.motion, speeds->smooth_twist, step->body, self->momentum);
    for (int i = 0; i < DIM; i++) {
        memcpy(P[i], self->P[i], sizeof P[i]);
    }
    times_transposed(&Y[0][0], &P[0][0], 6, DIM, DIM, &YP[0][0]);
    times_transposed(&YP[0][0], &Y[0][0], 6, 6, DIM, &M[0][0]);
    cautious_body(step, self, body);
    momenta_of_legs(&step->now.motion, body, columns);
    for (int leg = 0; leg < 6; leg++) {
        variance[leg] =
            pow((double)step->sensors.velocity_sigma_m_s, 2.0) + pow(2.0 * speeds->left_m_s[leg], 2.0);
    }
    add_noise_of(columns, variance, M);
    for (int a = 0; a < 6; a++) {
        for (int k = 0; k < DIM; k++) {
            self->P[DIM + a][k] = self->P[k][DIM + a] = YP[a][k];
        }
        memcpy(&self->P[DIM + a][DIM], M[a], sizeof M[a]);
    }
    self->nis = 6.0;
}

/// The covariance of the textbook in the filter's blocks, rounded; the textbook goes on with what that is.
static void write_covariance(step_t* step) {
    hexload_momentum_filter_t* filter = &step->filter;
    for (int i = 0; i < ALL; i++) {
        for (int j = 0; j <= i; j++) {
            const hexload_real_t rounded = (hexload_real_t)step->textbook.P[i][j];
            step->textbook.P[i][j] = step->textbook.P[j][i] = (double)rounded;
            if (i < DIM) {
                filter->load_cov[i][j] = filter->load_cov[j][i] = rounded;
            } else {
                *(j < DIM ? &filter->cross_cov[i - DIM][j] : &filter->momentum_cov[i - DIM][j - DIM]) =
                    rounded;
            }
        }
    }
}

/// A filter in any state, one tick or more after another pose, with speeds that the smoother leaves so far
/// off.
static void make_step(step_t* step, uint64_t* seed, uint32_t gap_ticks, double left_m_s) {
    memset(step, 0, sizeof *step);
    scene_at(&step->before, 150);
    scene_at(&step->now, 240);
    step->sensors = step->now.config.sensors;
    step->sensors.velocity_sigma_m_s = HEXLOAD_REAL(0.01);
    hexload_momentum_filter_init(&step->filter, &step->now.config);
    for (int i = 0; i < ALL; i++) {
        const hexload_real_t value = (hexload_real_t)(10.0 * state_sigma[i] * uniform(seed));
        if (i < DIM) {
            step->filter.theta[i] = value;
            step->textbook.theta[i] = (double)value;
            step->body[i] = (double)(step->filter.platform[i] + value);
        } else {
            step->filter.momentum[i - DIM] = value;
            step->textbook.momentum[i - DIM] = (double)value;
        }
    }
    random_covariance(seed, ALL, state_sigma, &step->textbook.P[0][0]);
    write_covariance(step);
    step->past.motion = step->now.motion;
    step->past.sensors = &step->sensors;
    step->past.smoother = &without_noise;
    step->past.smooth.sample = step->now.sample;
    step->past.smooth.gap_ticks = gap_ticks;
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        step->past.smooth.smooth_velocity_m_s[leg] =
            step->now.sample.velocity_m_s[leg] - (hexload_real_t)(left_m_s * uniform(seed));
        step->past.smooth.force_variance_n2[leg] = (hexload_real_t)(1e5 * (1.0 + uniform(seed)));
    }
    double Jw[6][6];
    pushes_of(&step->before.motion, Jw);
    for (int a = 0; a < 6; a++) {
        double sum = 0.0;
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            sum += Jw[a][leg] * (double)step->before.sample.force_n[leg];
        }
        step->filter.last_input.wrench[a] = (hexload_real_t)sum;
    }
    for (int axis = 0; axis < 2; axis++) {
        step->filter.last_input.arm[axis][0] = step->before.motion.p_m[axis];
        memcpy(&step->filter.last_input.arm[axis][1], step->before.motion.R[axis],
               sizeof step->before.motion.R[axis]);
    }
}

static void assert_same(const step_t* step, const textbook_t* expected) {
    const hexload_momentum_filter_t* filter = &step->filter;
    for (int i = 0; i < ALL; i++) {
        const double value = i < DIM ? (double)filter->theta[i] : (double)filter->momentum[i - DIM];
        const double sought = i < DIM ? expected->theta[i] : expected->momentum[i - DIM];
        TEST_ASSERT_DOUBLE_WITHIN(rounding * 10.0 * state_sigma[i], sought, value);
        for (int j = 0; j <= i; j++) {
            const double found = i < DIM   ? (double)filter->load_cov[i][j]
                                 : j < DIM ? (double)filter->cross_cov[i - DIM][j]
                                           : (double)filter->momentum_cov[i - DIM][j - DIM];
            const double scale = sqrt(expected->P[i][i] * expected->P[j][j]);
            TEST_ASSERT_DOUBLE_WITHIN(rounding * scale, expected->P[i][j], found);
            if (i < DIM) {
                TEST_ASSERT_EQUAL_DOUBLE(found, (double)filter->load_cov[j][i]);
            }
        }
    }
    TEST_ASSERT_DOUBLE_WITHIN(rounding * (1.0 + expected->nis), expected->nis, (double)filter->nis);
}

static void test_a_step_is_the_textbooks(void) {
    // GIVEN filters in any state, gaps of up to three ticks, residuals of the smoother that are noise or
    // stand far out of it, speeds of sensors of their own or from displacements
    uint64_t seed = 11;
    for (int trial = 0; trial < 60; trial++) {
        static const double left_in_sigmas[4] = {0.5, 3.0, 6.0, 20.0};
        step_t step;
        hexload_momentum_update_t update;
        make_step(&step, &seed, 1U + (uint32_t)trial % 3U, 0.01 * left_in_sigmas[trial % 4]);
        step.sensors.half_window_ticks = trial % 5 == 0 ? 4 : 0;
        const speeds_t speeds = speeds_of(&step);
        textbook_t expected = step.textbook;
        predict(&step, &expected);
        correct(&step, &expected, &speeds);
        // WHEN it takes a sample THEN estimates and covariance are those of the Kalman filter with full
        // matrices
        hexload_momentum_filter_step(&step.filter, &step.now.config, &step.past, &update);
        assert_same(&step, &expected);
        // AND the next sample begins where this one ends
        for (int k = 0; k < 6; k++) {
            TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(200, 1.0), speeds.smooth_twist[k],
                                      (double)step.filter.smooth_twist[k]);
        }
        TEST_ASSERT_EQUAL_MEMORY(&step.now.motion.p_m[1], &step.filter.last_input.arm[1][0],
                                 sizeof step.now.motion.p_m[1]);
    }
}

static void test_momentum_begins_anew_without_a_last_sample(void) {
    // GIVEN filters in any state WHEN the sample has none before it
    uint64_t seed = 12;
    for (int trial = 0; trial < 20; trial++) {
        step_t step;
        hexload_momentum_update_t update;
        make_step(&step, &seed, 0, trial % 2 == 0 ? 0.005 : 0.05);
        const speeds_t speeds = speeds_of(&step);
        textbook_t expected = step.textbook;
        seed_momentum(&step, &expected, &speeds);
        hexload_momentum_filter_step(&step.filter, &step.now.config, &step.past, &update);
        // THEN the momentum is that of the smooth twist, with the parameters' errors and the speeds' noise
        assert_same(&step, &expected);
    }
}

static void test_an_angular_velocity_counts_beyond_its_noise(void) {
    // GIVEN angular velocities from nothing to ten times their noise, and means of their squares likewise
    uint64_t seed = 14;
    hexload_smoother_constants_t constants = without_noise;
    int none = 0;
    for (int trial = 0; trial < 300; trial++) {
        step_t step;
        hexload_momentum_update_t update;
        double speed_m_s[HEXLOAD_LEGS], twist[6], rate[3], expected[3] = {0};
        make_step(&step, &seed, 1, 0.01);
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            speed_m_s[leg] = (double)step.past.smooth.smooth_velocity_m_s[leg];
        }
        twist_of(&step.now.motion, speed_m_s, twist);
        const double sigma_m = (double)step.sensors.displacement_sigma_m;
        step.past.smoother = &constants;
        for (int k = 0; k < 3; k++) {
            rate[k] = 0.0;
            for (int j = 0; j < 3; j++) {
                rate[k] += (double)step.now.motion.R[j][k] * twist[3 + j];
            }
            const double noise = fabs(rate[k]) / (5.0 + 5.0 * uniform(&seed)) + 1e-9;
            constants.slope_gain = HEXLOAD_REAL(3.0);
            constants.rate_gain[k] = (hexload_real_t)(pow(noise / sigma_m, 2.0) / 3.0);
            step.filter.rate_square[k] = (hexload_real_t)pow(noise * (3.0 + 3.0 * uniform(&seed)), 2.0);
            // WHEN a sample is taken THEN four times the noise's square is off the mean of a second, or off a
            // third of its own square
            const double mean = 0.999 * (double)step.filter.rate_square[k] + 0.001 * rate[k] * rate[k];
            const double share = fmax(0.0, 1.0 - 4.0 * noise * noise / fmax(mean, rate[k] * rate[k] / 3.0));
            none += share == 0.0;
            for (int j = 0; j < 3; j++) {
                expected[j] += (double)step.now.motion.R[j][k] * share * rate[k];
            }
        }
        hexload_momentum_filter_step(&step.filter, &step.now.config, &step.past, &update);
        for (int j = 0; j < 3; j++) {
            TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(1000, 1.0), expected[j],
                                      (double)step.filter.smooth_twist[3 + j]);
            // AND what shifts it stays
            TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(1000, 1.0), twist[j], (double)step.filter.smooth_twist[j]);
        }
    }
    TEST_ASSERT_TRUE(none > 50);
}

static void test_what_rounding_adds_to_a_parameter_is_made_up_for(void) {
    // GIVEN parameters to which rounding has added much WHEN a sample corrects them THEN the excess is taken
    // off, and what is left of it is no more than a rounding
    uint64_t seed = 13;
    step_t step, without;
    hexload_momentum_update_t update;
    make_step(&step, &seed, 1, 0.01);
    without = step;
    without.past.sensors = &without.sensors;
    without.past.motion.jacobian = step.past.motion.jacobian;
    for (int k = 0; k < DIM; k++) {
        step.filter.theta_excess[k] = (hexload_real_t)(0.1 * state_sigma[k]);
    }
    hexload_momentum_filter_step(&step.filter, &step.now.config, &step.past, &update);
    hexload_momentum_filter_step(&without.filter, &without.now.config, &without.past, &update);
    for (int k = 0; k < DIM; k++) {
        const double theta = (double)step.filter.theta[k], excess = (double)step.filter.theta_excess[k];
        const double exact = (double)without.filter.theta[k] - (double)without.filter.theta_excess[k];
        TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(1, fabs(theta)), 0.0, excess);
        TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(8, 0.1 * state_sigma[k] + fabs(theta)),
                                  exact - 0.1 * state_sigma[k], theta - excess);
    }
}

static void test_a_filter_that_is_not_finite_is_known(void) {
    // GIVEN a filter that is sound WHEN any of its numbers is none, or a variance is below zero THEN that is
    // known
    uint64_t seed = 14;
    step_t step;
    make_step(&step, &seed, 1, 0.01);
    TEST_ASSERT_TRUE(hexload_momentum_filter_is_finite(&step.filter));
    for (int i = 0; i < ALL; i++) {
        hexload_momentum_filter_t broken = step.filter;
        *(i < DIM ? &broken.theta[i] : &broken.momentum[i - DIM]) = (hexload_real_t)NAN;
        TEST_ASSERT_FALSE(hexload_momentum_filter_is_finite(&broken));
        broken = step.filter;
        *(i < DIM ? &broken.load_cov[i][i] : &broken.momentum_cov[i - DIM][i - DIM]) = HEXLOAD_REAL(-1.0);
        TEST_ASSERT_FALSE(hexload_momentum_filter_is_finite(&broken));
    }
}

static void test_a_new_load_has_the_priors_sigmas_and_keeps_the_estimate(void) {
    // GIVEN a filter in any state WHEN the load is another one THEN the estimate stays, its covariance is
    // that of the prior, and nothing of mu is written
    uint64_t seed = 15;
    step_t step;
    hexload_real_t value[DIM], sigma[DIM];
    make_step(&step, &seed, 1, 0.01);
    hexload_config_t* config = &step.now.config;
    config->momentum.prior_mass_sigma_kg = HEXLOAD_REAL(400.0);
    config->momentum.prior_moment_sigma_kg_m = HEXLOAD_REAL(90.0);
    config->momentum.prior_inertia_sigma_kg_m2 = HEXLOAD_REAL(70.0);
    const hexload_momentum_filter_t before = step.filter;
    hexload_momentum_filter_forget(&step.filter, config);
    hexload_momentum_filter_read(&step.filter, value, sigma);
    for (int k = 0; k < DIM; k++) {
        TEST_ASSERT_EQUAL_DOUBLE((double)before.theta[k], (double)value[k]);
        TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(4, 400.0),
                                  k == 0  ? 400.0
                                  : k < 4 ? 90.0
                                          : 70.0,
                                  (double)sigma[k]);
        for (int j = 0; j < DIM; j++) {
            TEST_ASSERT_TRUE(j == k || step.filter.load_cov[k][j] == HEXLOAD_REAL(0.0));
        }
    }
    TEST_ASSERT_EQUAL_MEMORY(before.momentum, step.filter.momentum, sizeof before.momentum);
}

static void test_a_filter_starts_with_prior_and_platform(void) {
    // GIVEN a configuration WHEN a filter starts THEN it has the platform's ten parameters and the prior's
    // mass and sigmas, and has not begun
    hexload_config_t config = crooked_machine();
    hexload_momentum_filter_t filter;
    config.momentum.prior_mass_kg = HEXLOAD_REAL(321.0);
    hexload_momentum_filter_init(&filter, &config);
    const double m = (double)config.platform.mass_kg;
    TEST_ASSERT_EQUAL_DOUBLE(m, (double)filter.platform[0]);
    for (int k = 0; k < 3; k++) {
        TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(2, m), m * (double)config.platform.com_m[k],
                                  (double)filter.platform[1 + k]);
    }
    TEST_ASSERT_EQUAL_MEMORY(config.platform.inertia_kg_m2, &filter.platform[4],
                             sizeof config.platform.inertia_kg_m2);
    TEST_ASSERT_EQUAL_DOUBLE(321.0, (double)filter.theta[0]);
    TEST_ASSERT_EQUAL_DOUBLE(6.0, (double)filter.nis);
    TEST_ASSERT_FALSE(hexload_momentum_filter_has_begun(&filter));
    hexload_real_t sigma[DIM];
    hexload_momentum_prior_sigma(&config.momentum, sigma);
    for (int k = 0; k < DIM; k++) {
        TEST_ASSERT_EQUAL_DOUBLE((double)(sigma[k] * sigma[k]), (double)filter.load_cov[k][k]);
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_step_is_the_textbooks);
    RUN_TEST(test_momentum_begins_anew_without_a_last_sample);
    RUN_TEST(test_an_angular_velocity_counts_beyond_its_noise);
    RUN_TEST(test_what_rounding_adds_to_a_parameter_is_made_up_for);
    RUN_TEST(test_a_filter_that_is_not_finite_is_known);
    RUN_TEST(test_a_new_load_has_the_priors_sigmas_and_keeps_the_estimate);
    RUN_TEST(test_a_filter_starts_with_prior_and_platform);
    return UNITY_END();
}
