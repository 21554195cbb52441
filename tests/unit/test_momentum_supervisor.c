#include "momentum/momentum_supervisor.h"
#include "body/pseudo_inertia.h"
#include "momentum/tolerances.h"
#include "textbook.h"

#include <math.h>
#include <string.h>

void setUp(void) {}
void tearDown(void) {}

enum { DIM = HEXLOAD_LOAD_DIM };

/// A supervisor in any state, and all that it looks at.
typedef struct bench {
    scene_t scene;
    hexload_sensors_t sensors;
    hexload_momentum_supervisor_t self;
    hexload_momentum_filter_t filter;
    hexload_jackknife_t jackknife;
    hexload_residual_test_t residual_test;
    hexload_delayed_tick_t past;
    hexload_estimate_t estimate;
} bench_t;

static double between(uint64_t* seed, double low, double high) {
    return low + 0.5 * (high - low) * (1.0 + uniform(seed));
}

static void begin(bench_t* bench) {
    memset(bench, 0, sizeof *bench);
    scene_at(&bench->scene, 170);
    hexload_momentum_filter_init(&bench->filter, &bench->scene.config);
    hexload_momentum_supervisor_init(&bench->self);
    hexload_jackknife_init(&bench->jackknife);
    bench->residual_test.factor = HEXLOAD_REAL(1.0);
    bench->sensors = bench->scene.config.sensors;
    bench->past.motion = bench->scene.motion;
    bench->past.sensors = &bench->sensors;
}

/// Numbers around all limits.
static void draw(bench_t* bench, uint64_t* seed) {
    hexload_momentum_supervisor_t* self = &bench->self;
    hexload_config_t* config = &bench->scene.config;
    self->nis_mean = (hexload_real_t)between(seed, 4.0, 20.0);
    self->fit_nis = (hexload_real_t)between(seed, 0.0, 40.0);
    self->unfit_s = (hexload_real_t)fmax(0.0, between(seed, -5.0, 10.0));
    self->wrong_s = (hexload_real_t)fmax(0.0, between(seed, -1.0, 1.0));
    self->calm_s = (hexload_real_t)(uniform(seed) > 0.0 ? between(seed, 0.1, 0.5) : between(seed, 4.9, 5.0));
    self->moved_s = (hexload_real_t)between(seed, -0.6, 3.0);
    self->fit_ticks = (uint16_t)between(seed, 0.0, 3000.0);
    self->elapsed_ticks = (uint8_t)between(seed, 0.0, 12.0);
    self->next = (uint8_t)between(seed, 0.0, 9.99);
    bench->filter.nis = (hexload_real_t)between(seed, 0.0, 200.0);
    bench->jackknife.pooled = (hexload_real_t)between(seed, 0.0, 12.0);
    bench->residual_test.factor = (hexload_real_t)fmax(1.0, between(seed, -3.0, 2.0));
    config->rig.direction_count = uniform(seed) > 0.0;
    config->momentum.excitation_time_constant_s = (hexload_real_t)(uniform(seed) > 0.8 ? 0.005 : 3.0);
    bench->past.smooth.gap_ticks = uniform(seed) > 0.9 ? 0 : 1 + (uint32_t)between(seed, 0.0, 2.0);
    const double shake = pow(10.0, 2.0 * uniform(seed)); // around the noise of accelerations
    for (int k = 0; k < 6; k++) {
        bench->past.smooth.smooth_velocity_m_s[k] = (hexload_real_t)(0.015 * uniform(seed));
        bench->filter.smooth_twist[k] = (hexload_real_t)(0.3 * uniform(seed));
        self->last_twist[k] = bench->filter.smooth_twist[k] + (hexload_real_t)(1e-3 * shake * uniform(seed));
        self->acceleration[k] = (hexload_real_t)(2.0 * uniform(seed));
    }
    for (int k = 0; k < DIM; k++) {
        self->information[k] = (hexload_real_t)between(seed, 0.0, 1e-3);
        self->kept[k] = (hexload_real_t)fmax(1.0, between(seed, -2.0, 4.0));
        self->last_variance[k] = (hexload_real_t)between(seed, 1.0, 2.0);
        bench->filter.load_cov[k][k] = (hexload_real_t)between(seed, 0.5, 2.0);
    }
}

/// Wrench about O_A in base axes that a unit of a parameter needs: F = m a + omega' x h + omega x (omega x
/// h), M = h x a + I omega' + omega x I omega, a less gravity.
static void wrench_of_unit(const bench_t* bench, const double acceleration[6], int parameter,
                           double wrench[6]) {
    static const int entry[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}};
    const hexload_motion_t* motion = &bench->past.motion;
    const double g = (double)bench->scene.config.gravity_m_s2;
    const double a[3] = {acceleration[0], acceleration[1], acceleration[2] + g};
    const double* alpha = &acceleration[3];
    double omega[3], h[3] = {0}, I[3][3] = {{0}}, swung[3], turned[3], pulled[3], spin[3] = {0}, moment[3];
    for (int k = 0; k < 3; k++) {
        omega[k] = (double)bench->filter.smooth_twist[3 + k];
        h[k] = parameter >= 1 && parameter <= 3 ? (double)motion->R[k][parameter - 1] : 0.0;
    }
    for (int i = 0; i < 3 && parameter >= 4; i++) {
        for (int j = 0; j < 3; j++) {
            const int p = entry[parameter - 4][0], q = entry[parameter - 4][1];
            I[i][j] = (double)(motion->R[i][p] * motion->R[j][q]);
            I[i][j] += p != q ? (double)(motion->R[i][q] * motion->R[j][p]) : 0.0;
        }
    }
    cross(alpha, h, swung);
    cross(omega, h, turned);
    cross(omega, turned, pulled);
    cross(h, a, moment);
    for (int i = 0; i < 3; i++) {
        wrench[i] = (parameter == 0 ? a[i] : 0.0) + swung[i] + pulled[i];
        wrench[3 + i] = moment[i];
        for (int j = 0; j < 3; j++) {
            spin[i] += I[i][j] * omega[j];
            wrench[3 + i] += I[i][j] * alpha[j];
        }
    }
    cross(omega, spin, moment);
    for (int i = 0; i < 3; i++) {
        wrench[3 + i] += moment[i];
    }
}

static double information_of(const bench_t* bench, const double acceleration[6], int parameter) {
    double wrench[6], sum = 0.0;
    wrench_of_unit(bench, acceleration, parameter, wrench);
    for (int k = 0; k < 6; k++) {
        double square = 0.0;
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            square += pow((double)bench->past.motion.J[leg][k] * (double)bench->sensors.force_sigma_n, 2.0);
        }
        sum += wrench[k] * wrench[k] / square;
    }
    return sum;
}

static bool is_near(double value, double limit) {
    return fabs(value - limit) < 1e-3 * fabs(limit);
}

/// For so long after an alarm a large NIS may be that of another one.
static hexload_real_t three_lags_s(const hexload_config_t* config) {
    return HEXLOAD_REAL(3.0) * (config->tick_s * (hexload_real_t)config->momentum.lag_ticks);
}

/// Of the fit. @return whether rounding decides.
static bool expect_fit(const bench_t* bench, hexload_momentum_supervisor_t* self) {
    const double dt_s = (double)bench->scene.config.tick_s;
    const double share = fmax(dt_s / 1.0, 1.0 / (20.0 + self->fit_ticks));
    const double fit_nis =
        (1.0 - share) * (double)self->fit_nis + share * fmin((double)bench->filter.nis, 120.0);
    const bool is_varied =
        bench->scene.config.rig.direction_count == 0 && bench->jackknife.pooled > HEXLOAD_REAL(9.0);
    const bool is_unfit = (fit_nis > 12.0 && self->calm_s > three_lags_s(&bench->scene.config)) ||
                          bench->residual_test.factor > HEXLOAD_REAL(1.0) || is_varied;
    const bool is_close = is_near(fit_nis, 12.0) ||
                          is_near((double)self->calm_s, (double)three_lags_s(&bench->scene.config)) ||
                          is_near((double)bench->jackknife.pooled, 9.0);
    self->fit_nis = (hexload_real_t)fit_nis;
    self->fit_ticks++;
    self->unfit_s = (hexload_real_t)fmax(0.0, (is_unfit ? 10.0 : (double)self->unfit_s) - dt_s);
    self->wrong_s = (hexload_real_t)fmax(0.0, (double)self->wrong_s - dt_s);
    self->calm_s = (hexload_real_t)fmin(5.0, (double)self->calm_s + dt_s);
    return is_close;
}

/// Of what misfits have left in the parameter whose turn it is: K P / (P of its last turn), or what the fit
/// of now asks for, with 1 + K the factor on the variance.
static void expect_kept(const bench_t* bench, hexload_momentum_supervisor_t* self) {
    const uint32_t k = bench->self.next;
    if (bench->past.smooth.gap_ticks == 0) {
        return;
    }
    const double variance = (double)bench->filter.load_cov[k][k];
    const double shrunk = fmin(1.0, variance / (double)self->last_variance[k]);
    const double kept = shrunk * (pow((double)self->kept[k], 2.0) - 1.0);
    const bool is_misfit =
        self->fit_nis > HEXLOAD_REAL(12.0) && self->calm_s > three_lags_s(&bench->scene.config);
    const double asked = is_misfit ? (double)self->fit_nis / 6.0 - 1.0 : 0.0;
    self->kept[k] = (hexload_real_t)sqrt(1.0 + fmax(kept, asked));
    self->last_variance[k] = bench->filter.load_cov[k][k];
}

/// Of the motion.
static bool expect_motion(const bench_t* bench, hexload_momentum_supervisor_t* self) {
    const hexload_config_t* config = &bench->scene.config;
    const double dt_s = (double)config->tick_s;
    const double lag_s = dt_s * config->momentum.lag_ticks;
    const double noise = 20.0 * sqrt(0.45) * (double)bench->sensors.displacement_sigma_m / (lag_s * lag_s);
    double squares = 0.0, square = 0.0, acceleration[6];
    for (int leg = 0; leg < 6; leg++) {
        squares += pow((double)bench->past.smooth.smooth_velocity_m_s[leg], 2.0);
    }
    bool is_close = is_near(squares, 1e-4);
    if (squares > 1e-4) {
        self->moved_s = (hexload_real_t)fmin(2.5, (double)self->moved_s + dt_s);
    }
    self->elapsed_ticks = (uint8_t)(self->elapsed_ticks + bench->past.smooth.gap_ticks);
    if (bench->past.smooth.gap_ticks == 0) {
        memcpy(self->last_twist, bench->filter.smooth_twist, sizeof self->last_twist);
        self->elapsed_ticks = 0;
        self->next = 1;
        return is_close;
    }
    if (self->next == 0) {
        for (int k = 0; k < 6; k++) {
            const double change = (double)bench->filter.smooth_twist[k] - (double)self->last_twist[k];
            self->acceleration[k] = (hexload_real_t)(change / (dt_s * self->elapsed_ticks));
            square += pow((double)self->acceleration[k], 2.0);
        }
        is_close = is_close || is_near(square, noise * noise);
        if (square < noise * noise) {
            memset(self->acceleration, 0, sizeof self->acceleration);
        }
        memcpy(self->last_twist, bench->filter.smooth_twist, sizeof self->last_twist);
        self->elapsed_ticks = 0;
    }
    for (int k = 0; k < 6; k++) {
        acceleration[k] = (double)self->acceleration[k];
    }
    const double weight = fmin(1.0, 10.0 * dt_s / (double)config->momentum.excitation_time_constant_s);
    hexload_real_t* mean = &self->information[self->next];
    *mean = (hexload_real_t)((1.0 - weight) * (double)*mean +
                             weight * information_of(bench, acceleration, (int)self->next));
    self->next = self->next == 9 ? 0 : self->next + 1;
    return is_close;
}

static void test_what_a_sample_shows_is_that_of_the_equations(void) {
    // GIVEN supervisors in any state, near all limits WHEN a sample is watched
    uint64_t seed = 51;
    bench_t bench;
    int closes = 0;
    begin(&bench);
    for (int trial = 0; trial < 5000; trial++) {
        draw(&bench, &seed);
        hexload_momentum_supervisor_t expected = bench.self;
        const bool is_fit_close = expect_fit(&bench, &expected);
        if (expect_motion(&bench, &expected) || is_fit_close) {
            closes++;
            continue;
        }
        expect_kept(&bench, &expected);
        hexload_momentum_supervisor_watch(&bench.self, &bench.scene.config, &bench.filter, &bench.jackknife,
                                          &bench.residual_test, &bench.past);
        // THEN fit, motion and information are those of Newton and Euler, and of the limits in numbers
        const hexload_momentum_supervisor_t* found = &bench.self;
        TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(8, 120.0), (double)expected.fit_nis, (double)found->fit_nis);
        TEST_ASSERT_EQUAL_UINT16(expected.fit_ticks, found->fit_ticks);
        TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(4, 10.0), (double)expected.unfit_s, (double)found->unfit_s);
        TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(4, 1.0), (double)expected.wrong_s, (double)found->wrong_s);
        TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(4, 5.0), (double)expected.calm_s, (double)found->calm_s);
        TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(4, 3.0), (double)expected.moved_s, (double)found->moved_s);
        TEST_ASSERT_EQUAL_UINT32(expected.next, found->next);
        TEST_ASSERT_EQUAL_UINT8(expected.elapsed_ticks, found->elapsed_ticks);
        TEST_ASSERT_EQUAL_MEMORY(expected.last_twist, found->last_twist, sizeof expected.last_twist);
        for (int k = 0; k < 6; k++) { // of twists of 0.4 over a tick of 1 ms at least
            TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(4, 400.0), (double)expected.acceleration[k],
                                      (double)found->acceleration[k]);
        }
        for (int k = 0; k < DIM; k++) {
            TEST_ASSERT_DOUBLE_WITHIN(1e-7 + ROUNDINGS(2000, (double)expected.information[k]),
                                      (double)expected.information[k], (double)found->information[k]);
            TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(8, 4.0), (double)expected.kept[k], (double)found->kept[k]);
            TEST_ASSERT_EQUAL_DOUBLE((double)expected.last_variance[k], (double)found->last_variance[k]);
        }
    }
    TEST_ASSERT_LESS_THAN_INT(500, closes);
}

/// A tensor that a body has or not, and sigmas around what counts as converged.
static void draw_estimate(bench_t* bench, uint64_t* seed) {
    const double size = between(seed, 0.0, 3.0), off = pow(10.0, uniform(seed));
    const double theta[DIM] = {
        100.0 * size, 10.0 * uniform(seed), 12.0 * uniform(seed), 20.0 * uniform(seed), 20.0 * size,
        18.0 * size,  25.0 * size,          uniform(seed),        uniform(seed),        uniform(seed)};
    bench->self.doubt = (hexload_real_t)fmax(1.0, pow(10.0, between(seed, -1.0, 2.47)));
    for (int k = 0; k < DIM; k++) {
        const double value = theta[k] * (k >= 4 ? 1.0 + off * 0.3 * uniform(seed) : 1.0);
        bench->filter.theta[k] = (hexload_real_t)value;
        bench->estimate.value[k] = bench->filter.theta[k];
        bench->estimate.own_sigma[k] = (hexload_real_t)(0.1 * between(seed, 0.0, 40.0 / (1.0 + k)));
        bench->estimate.sigma[k] =
            bench->estimate.own_sigma[k] * bench->residual_test.factor / bench->self.doubt;
    }
    if (uniform(seed) > 0.8) { // what no body has within any sigma
        bench->self.doubt = (hexload_real_t)between(seed, 250.0, 300.0);
        bench->filter.theta[4] = bench->estimate.value[4] = HEXLOAD_REAL(-1e4);
    }
    bench->scene.config.momentum.converged_relative_sigma = HEXLOAD_REAL(0.03);
    bench->scene.config.momentum.inconsistent_nis = HEXLOAD_REAL(12.0);
}

/// What a sigma is compared with: a value, at least the empty platform's.
static double scale_of(const bench_t* bench, int k) {
    double h = 0.0, mean = 0.0, own_mean = 0.0;
    for (int j = 0; j < 3; j++) {
        h += pow((double)bench->filter.theta[1 + j], 2.0);
        mean += (double)bench->filter.theta[4 + j] / 3.0;
        own_mean += (double)bench->filter.platform[4 + j] / 3.0;
    }
    const double mass = (double)bench->filter.platform[0];
    if (k == 0) {
        return fmax(fabs((double)bench->filter.theta[0]), mass);
    }
    if (k < 4) {
        return fmax(sqrt(h), 0.1 * sqrt(mass * own_mean));
    }
    return fmax(fabs(k < 7 ? (double)bench->filter.theta[k] : mean), own_mean);
}

typedef struct judged {
    hexload_verdict_t verdict[DIM], worst;
    uint32_t health;
    double doubt, sigma[DIM];
    bool is_close;
} judged_t;

static judged_t expect_judged(const bench_t* bench) {
    const hexload_config_t* config = &bench->scene.config;
    const hexload_momentum_supervisor_t* self = &bench->self;
    const double dt_s = (double)config->tick_s, pooled = (double)bench->jackknife.pooled;
    hexload_real_t sigma[DIM], open[DIM];
    judged_t judged = {.worst = HEXLOAD_VERDICT_CONVERGED};
    for (int k = 0; k < DIM; k++) {
        sigma[k] = bench->estimate.sigma[k] * self->kept[k];
    }
    hexload_tolerances_widen(&bench->filter, sigma, open);
    for (int k = 0; k < DIM; k++) {
        sigma[k] *= self->doubt;
        judged.sigma[k] = (double)sigma[k];
    }
    const bool has_body = hexload_pseudo_inertia_is_positive(bench->estimate.value, sigma);
    judged.doubt = has_body ? fmax(1.0, (double)self->doubt * (1.0 - dt_s / 0.2))
                            : fmin((double)self->doubt * (1.0 + dt_s / 0.05), 300.0);
    const bool is_body = has_body || judged.doubt < 300.0;
    const double factor = (double)bench->residual_test.factor;
    bool is_spoilt = false;
    for (int k = 0; k < DIM; k++) {
        const double limit = 0.03 * scale_of(bench, k), own = (double)bench->estimate.own_sigma[k];
        is_spoilt = is_spoilt || (factor > 1.0 && own <= limit && 3.0 * factor * own > limit);
        judged.is_close = judged.is_close || is_near(own, limit) || is_near(3.0 * factor * own, limit);
    }
    const bool is_misfit =
        self->fit_nis > HEXLOAD_REAL(30.0) || self->nis_mean > HEXLOAD_REAL(12.0) ||
        self->wrong_s > HEXLOAD_REAL(0.0) || is_spoilt ||
        (self->unfit_s > HEXLOAD_REAL(0.0) && config->rig.direction_count == 0 && pooled > 4.0) ||
        (bench->residual_test.factor > HEXLOAD_REAL(1.0) && config->rig.direction_count > 0);
    for (int k = 0; k < DIM; k++) {
        const double limit = 0.03 * scale_of(bench, k);
        const double variance = judged.sigma[k] * judged.sigma[k] - (double)open[k];
        // a motion that goes on for as long again lowers the filter's own sigma by a third
        const double own = pow((double)bench->estimate.own_sigma[k], 2.0);
        const double lower =
            1.0 / (1.0 / own +
                   (double)self->information[k] * (double)config->momentum.excitation_time_constant_s / dt_s);
        const double third = 4.0 / 9.0 * own;
        hexload_verdict_t* verdict = &judged.verdict[k];
        *verdict = variance <= limit * limit ? HEXLOAD_VERDICT_CONVERGED
                   : lower < third           ? HEXLOAD_VERDICT_CONVERGING
                                             : HEXLOAD_VERDICT_NOT_EXCITED;
        if (!is_body) {
            *verdict = HEXLOAD_VERDICT_INCONSISTENT;
        } else if (is_misfit) {
            *verdict = HEXLOAD_VERDICT_MISFIT;
        }
        judged.is_close = judged.is_close || is_near(variance, limit * limit) || is_near(lower, third);
        judged.worst = *verdict > judged.worst ? *verdict : judged.worst;
        judged.health |= *verdict == HEXLOAD_VERDICT_NOT_EXCITED ? 1U << HEXLOAD_HEALTH_NOT_EXCITED : 0U;
    }
    judged.health |= judged.worst == HEXLOAD_VERDICT_INCONSISTENT ? 1U << HEXLOAD_HEALTH_INCONSISTENT : 0U;
    judged.health |= judged.worst >= HEXLOAD_VERDICT_MISFIT ? 1U << HEXLOAD_HEALTH_MODEL_MISFIT : 0U;
    return judged;
}

static void test_verdicts_are_those_of_the_equations(void) {
    // GIVEN supervisors in any state, estimates that a body has or not, on machines with tolerances and
    // without
    uint64_t seed = 52;
    bench_t bench;
    int seen[5] = {0}, closes = 0;
    begin(&bench);
    for (int trial = 0; trial < 5000; trial++) {
        draw(&bench, &seed);
        bench.self.fit_nis = (hexload_real_t)(trial % 4 == 0 ? between(&seed, 20.0, 40.0) : 6.0);
        bench.self.nis_mean = (hexload_real_t)(trial % 4 == 1 ? between(&seed, 8.0, 16.0) : 6.0);
        bench.jackknife.pooled = (hexload_real_t)(trial % 4 == 2 ? between(&seed, 2.0, 7.0) : 1.0);
        bench.self.wrong_s = trial % 16 == 3 ? HEXLOAD_REAL(0.001) : HEXLOAD_REAL(0.0);
        bench.filter.tolerances.force_gain = (hexload_real_t)(trial % 2 == 0 ? 0.0 : 0.001);
        bench.residual_test.factor = (hexload_real_t)fmax(1.0, between(&seed, -2.0, 2.0));
        draw_estimate(&bench, &seed);
        const judged_t expected = expect_judged(&bench);
        if (expected.is_close) {
            closes++;
            continue;
        }
        // WHEN they judge
        const uint32_t health =
            hexload_momentum_supervisor_judge(&bench.self, &bench.scene.config, &bench.filter,
                                              &bench.jackknife, &bench.residual_test, &bench.estimate);
        // THEN verdicts and health are those of the limits in numbers, and sigmas are as wide as the doubt
        // says
        TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(8, expected.doubt), expected.doubt, (double)bench.self.doubt);
        for (int k = 0; k < DIM; k++) {
            seen[expected.verdict[k]]++;
            TEST_ASSERT_EQUAL_INT(expected.verdict[k], bench.estimate.parameter_verdict[k]);
            TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(4, expected.sigma[k]), expected.sigma[k],
                                      (double)bench.estimate.sigma[k]);
        }
        TEST_ASSERT_EQUAL_INT(expected.worst, bench.estimate.verdict);
        TEST_ASSERT_EQUAL_HEX32(expected.health, health);
        TEST_ASSERT_EQUAL_DOUBLE((double)bench.filter.nis, (double)bench.estimate.nis);
        TEST_ASSERT_EQUAL_DOUBLE((double)bench.self.nis_mean, (double)bench.estimate.nis_mean);
    }
    TEST_ASSERT_LESS_THAN_INT(1000, closes);
    for (int verdict = HEXLOAD_VERDICT_CONVERGED; verdict <= HEXLOAD_VERDICT_INCONSISTENT; verdict++) {
        TEST_ASSERT_GREATER_THAN_INT(20, seen[verdict]);
    }
}

static void test_fit_is_what_friction_motion_and_doubt_make_of_it(void) {
    // GIVEN a machine without friction, or one that rubs in a single leg, or one that is commissioned
    bench_t bench;
    begin(&bench);
    hexload_momentum_supervisor_t* self = &bench.self;
    for (int machine = 0; machine < HEXLOAD_LEGS + 2; machine++) {
        static const double moved_s[] = {-0.5, -1e-4, 0.0, 0.499, 0.501, 2.499, 2.5};
        hexload_config_t config = bench.scene.config;
        const bool rubs = machine < HEXLOAD_LEGS;
        const bool is_open = machine <= HEXLOAD_LEGS;
        if (rubs) {
            config.rig.coulomb_n[machine] = HEXLOAD_REAL(10.0);
        }
        config.rig.direction_count = machine == HEXLOAD_LEGS ? 1 : 0;
        for (size_t n = 0; n < sizeof moved_s / sizeof moved_s[0]; n++) {
            // WHEN a load has moved for so long, below 0 with the credit of the last one THEN the machine is
            // its model from 2.5 s on, none before 0.5 s, and unproven between; with friction it is known to
            // that
            const bool is_new = moved_s[n] >= 0.0 && moved_s[n] < 0.5;
            const bool is_proven = moved_s[n] < 0.0 || moved_s[n] >= 2.5;
            const hexload_fit_t fit = is_open     ? HEXLOAD_FIT_FRICTION
                                      : is_new    ? HEXLOAD_FIT_NONE
                                      : is_proven ? HEXLOAD_FIT_NOISE
                                                  : HEXLOAD_FIT_UNPROVEN;
            self->moved_s = (hexload_real_t)moved_s[n];
            self->unfit_s = HEXLOAD_REAL(0.0);
            TEST_ASSERT_EQUAL_INT(fit, hexload_momentum_supervisor_fit(self, &config, true));
            // AND at rest a new load is unproven, as its weight is all that counts there
            TEST_ASSERT_EQUAL_INT(fit == HEXLOAD_FIT_NONE ? HEXLOAD_FIT_UNPROVEN : fit,
                                  hexload_momentum_supervisor_fit(self, &config, false));
            // AND one that has not fitted of late does not
            self->unfit_s = HEXLOAD_REAL(0.001);
            TEST_ASSERT_EQUAL_INT(HEXLOAD_FIT_NONE, hexload_momentum_supervisor_fit(self, &config, true));
        }
    }
}

/// So many samples with one NIS.
static void watch(bench_t* bench, double nis, int ticks) {
    bench->filter.nis = (hexload_real_t)nis;
    for (int tick = 0; tick < ticks; tick++) {
        hexload_momentum_supervisor_watch(&bench->self, &bench->scene.config, &bench->filter,
                                          &bench->jackknife, &bench->residual_test, &bench->past);
    }
}

static void test_what_a_misfit_has_left_goes_only_as_the_motion_shows_more(void) {
    // GIVEN a filter whose innovations were ideal for a second WHEN they are ten times too large for half a
    // second, and ideal again for ten
    bench_t bench;
    begin(&bench);
    bench.past.smooth.gap_ticks = 1;
    watch(&bench, 6.0, 1000);
    TEST_ASSERT_EQUAL_DOUBLE(1.0, (double)bench.self.kept[HEXLOAD_LOAD_IZZ]);
    watch(&bench, 60.0, 500);
    const double largest_nis = (double)bench.self.fit_nis;
    watch(&bench, 6.0, 10000);
    // THEN sigma is too small by the root of what their mean was at its largest, within a turn's ticks, in
    // which it falls by 1 %, although they have been ideal since
    TEST_ASSERT_DOUBLE_WITHIN(0.05, 6.0, (double)bench.self.fit_nis);
    for (int k = 0; k < DIM; k++) {
        TEST_ASSERT_DOUBLE_WITHIN(0.01 * sqrt(largest_nis / 6.0), sqrt(largest_nis / 6.0),
                                  (double)bench.self.kept[k]);
    }
    // AND WHEN the motion shows a parameter four times as well in variance THEN that error is a quarter too,
    // in it alone
    const double before = pow((double)bench.self.kept[HEXLOAD_LOAD_IZZ], 2.0) - 1.0;
    const hexload_real_t other = bench.self.kept[HEXLOAD_LOAD_IYY];
    bench.filter.load_cov[HEXLOAD_LOAD_IZZ][HEXLOAD_LOAD_IZZ] *= HEXLOAD_REAL(0.25);
    watch(&bench, 6.0, DIM);
    TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(16, before), 0.25 * before,
                              pow((double)bench.self.kept[HEXLOAD_LOAD_IZZ], 2.0) - 1.0);
    TEST_ASSERT_EQUAL_DOUBLE((double)other, (double)bench.self.kept[HEXLOAD_LOAD_IYY]);
}

static void test_alarms_doubts_and_other_loads_are_remembered(void) {
    bench_t bench;
    begin(&bench);
    hexload_momentum_supervisor_t* self = &bench.self;
    // GIVEN a supervisor that has just started: it is calm, at its ideal, without doubt
    TEST_ASSERT_EQUAL_DOUBLE(6.0, (double)self->nis_mean);
    TEST_ASSERT_EQUAL_DOUBLE(6.0, (double)self->fit_nis);
    TEST_ASSERT_EQUAL_DOUBLE(1.0, (double)self->doubt);
    TEST_ASSERT_EQUAL_DOUBLE(5.0, (double)self->calm_s);
    // WHEN there is an alarm, and another within five seconds THEN the second one is the machine's for 10 s
    hexload_momentum_supervisor_alarm(self);
    TEST_ASSERT_EQUAL_DOUBLE(0.0, (double)self->unfit_s);
    TEST_ASSERT_EQUAL_DOUBLE(0.0, (double)self->calm_s);
    self->calm_s = HEXLOAD_REAL(4.99);
    hexload_momentum_supervisor_alarm(self);
    TEST_ASSERT_EQUAL_DOUBLE(10.0, (double)self->unfit_s);
    // AND one after five seconds leaves it as it is, and a doubt makes it 10 s anew
    self->unfit_s = HEXLOAD_REAL(3.0);
    self->calm_s = HEXLOAD_REAL(5.0);
    hexload_momentum_supervisor_alarm(self);
    TEST_ASSERT_EQUAL_DOUBLE(3.0, (double)self->unfit_s);
    TEST_ASSERT_EQUAL_DOUBLE(0.0, (double)self->wrong_s);
    hexload_momentum_supervisor_doubt(self);
    TEST_ASSERT_EQUAL_DOUBLE(10.0, (double)self->unfit_s);
    // AND no verdict is better than misfit for a second
    TEST_ASSERT_EQUAL_DOUBLE(1.0, (double)self->wrong_s);
    // AND another load begins anew, with half a second of credit on a machine that was believed
    static const double moved_s[4] = {-0.2, 0.0, 2.49, 2.5}, credit_s[4] = {-0.5, 0.0, 0.0, -0.5};
    for (int n = 0; n < 4; n++) {
        self->nis_mean = HEXLOAD_REAL(50.0);
        self->moved_s = (hexload_real_t)moved_s[n];
        hexload_momentum_supervisor_forget(self);
        TEST_ASSERT_EQUAL_DOUBLE(6.0, (double)self->nis_mean);
        TEST_ASSERT_EQUAL_DOUBLE(credit_s[n], (double)self->moved_s);
    }
    // AND the monitor's NIS are a leaky mean
    hexload_load_monitor_t monitor;
    hexload_load_monitor_init(&monitor);
    monitor.nis = HEXLOAD_REAL(26.0);
    bench.scene.config.momentum.nis_time_constant_s = HEXLOAD_REAL(0.1);
    hexload_momentum_supervisor_hear(self, &bench.scene.config, &monitor);
    TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(4, 6.0), 6.2, (double)self->nis_mean);
}

static void test_nothing_has_converged_before_the_fit_is_known(void) {
    // GIVEN an estimate of which one parameter has not converged, and that as a whole has or has not
    for (int n = 0; n < 16; n++) {
        bench_t bench;
        begin(&bench);
        const bool has_ticks = n & 1, has_blocks = n & 2, is_certain = n & 4, has_all = n & 8;
        bench.self.fit_ticks = has_ticks ? 100 : 99;
        bench.jackknife.has_concluded = has_blocks;
        bench.self.doubt = (hexload_real_t)(is_certain ? 1.049 : 1.051);
        bench.estimate.parameter_verdict[4] = HEXLOAD_VERDICT_NOT_EXCITED;
        bench.estimate.verdict = has_all ? HEXLOAD_VERDICT_CONVERGED : HEXLOAD_VERDICT_NOT_EXCITED;
        // WHEN a hundred innovations, the blocks and a body are not all there THEN what has converged is
        // converging, and what is worse stays
        hexload_momentum_supervisor_hold_back(&bench.self, &bench.jackknife, &bench.estimate);
        const hexload_verdict_t best =
            has_ticks && has_blocks && is_certain ? HEXLOAD_VERDICT_CONVERGED : HEXLOAD_VERDICT_CONVERGING;
        for (int k = 0; k < DIM; k++) {
            TEST_ASSERT_EQUAL_INT(k == 4 ? HEXLOAD_VERDICT_NOT_EXCITED : best,
                                  bench.estimate.parameter_verdict[k]);
        }
        TEST_ASSERT_EQUAL_INT(has_all ? best : HEXLOAD_VERDICT_NOT_EXCITED, bench.estimate.verdict);
    }
}

/// Whether a tick with these numbers, after which nothing else has happened, says that the machine does not
/// fit.
static bool is_unfit_at(double nis, double calm_lags, double pooled) {
    bench_t bench;
    begin(&bench);
    const hexload_real_t calm_s =
        (hexload_real_t)(calm_lags / 3.0) * three_lags_s(&bench.scene.config); // three of them to the bit
    bench.self.fit_nis = (hexload_real_t)nis;
    bench.filter.nis = (hexload_real_t)nis; // the leaky mean stays to the bit
    bench.self.calm_s = calm_s;
    bench.jackknife.pooled = (hexload_real_t)pooled;
    hexload_momentum_supervisor_watch(&bench.self, &bench.scene.config, &bench.filter, &bench.jackknife,
                                      &bench.residual_test, &bench.past);
    return bench.self.unfit_s > HEXLOAD_REAL(0.0);
}

static double moved_s_at(hexload_real_t speed_m_s) {
    bench_t bench;
    begin(&bench);
    bench.self.moved_s = HEXLOAD_REAL(0.0);
    bench.past.smooth.smooth_velocity_m_s[5] = speed_m_s;
    hexload_momentum_supervisor_watch(&bench.self, &bench.scene.config, &bench.filter, &bench.jackknife,
                                      &bench.residual_test, &bench.past);
    return (double)bench.self.moved_s;
}

static void test_what_is_at_its_limit_is_not_beyond_it(void) {
    // GIVEN a mean NIS of 12, three lags since an alarm, or blocks with nine times their variance
    // WHEN one of them is at its limit to the bit THEN the machine fits, and beyond it does not
    TEST_ASSERT_FALSE(is_unfit_at(12.0, 60.0, 0.0));
    TEST_ASSERT_TRUE(is_unfit_at(12.001, 60.0, 0.0));
    TEST_ASSERT_FALSE(is_unfit_at(13.0, 3.0, 0.0));
    TEST_ASSERT_TRUE(is_unfit_at(13.0, 3.001, 0.0));
    TEST_ASSERT_FALSE(is_unfit_at(6.0, 60.0, 9.0));
    TEST_ASSERT_TRUE(is_unfit_at(6.0, 60.0, 9.001));
    // AND 10 mm/s are rest
    TEST_ASSERT_EQUAL_DOUBLE(0.0, moved_s_at(HEXLOAD_REAL(0.01)));
    TEST_ASSERT_TRUE(moved_s_at(HEXLOAD_REAL(0.01001)) > 0.0);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_what_a_sample_shows_is_that_of_the_equations);
    RUN_TEST(test_verdicts_are_those_of_the_equations);
    RUN_TEST(test_fit_is_what_friction_motion_and_doubt_make_of_it);
    RUN_TEST(test_what_a_misfit_has_left_goes_only_as_the_motion_shows_more);
    RUN_TEST(test_alarms_doubts_and_other_loads_are_remembered);
    RUN_TEST(test_nothing_has_converged_before_the_fit_is_known);
    RUN_TEST(test_what_is_at_its_limit_is_not_beyond_it);
    return UNITY_END();
}
