#include "momentum/wrench_monitor.h"
#include "algebra/linalg.h"
#include "front_end/present_tick.h"
#include "momentum/momentum_model.h"
#include "textbook.h"

#include <math.h>
#include <string.h>

void setUp(void) {}
void tearDown(void) {}

enum { DIM = HEXLOAD_LOAD_DIM, PARTS = HEXLOAD_WRENCH_PARTS, BINS = HEXLOAD_WRENCH_BINS };

/// Ticks of 4 ms: the memories of 10 s are 2500 of them.
static const double tick_s = 0.004;

/// y of a wrench about the home point: F_z, M_x and M_y about O_A.
static void parts_of(const hexload_motion_t* motion, double T[PARTS][6]) {
    const double x = (double)motion->p_m[0], y = (double)motion->p_m[1], z = (double)motion->p_m[2];
    const double rows[PARTS][6] = {{0, 0, 1, 0, 0, 0}, {0, z, -y, 1, 0, 0}, {-z, 0, x, 0, 1, 0}};
    memcpy(T, rows, sizeof rows);
}

/// What the monitor is given at one tick.
typedef struct tick {
    hexload_momentum_filter_t filter;
    hexload_motion_t motion;
    bool is_moving;
    hexload_real_t momentum[6], change[6], impulse[6], variance_n2[HEXLOAD_LEGS], unknown[6][6],
        unknown_scale;
    hexload_fit_t fit;
    double body[DIM];
} tick_t;

static hexload_push_t push_of(tick_t* tick) {
    return (hexload_push_t){.motion = &tick->motion,
                            .momentum = tick->momentum,
                            .momentum_of_change = tick->change,
                            .impulse = tick->impulse,
                            .variance_n2 = tick->variance_n2,
                            .unknown = tick->unknown,
                            .unknown_scale = tick->unknown_scale,
                            .is_moving = tick->is_moving};
}

/// Wrench that is missing, about O_A: rate of mu, without the parameters' change, less legs and gravity.
static void missing_wrench(const hexload_wrench_monitor_t* self, const tick_t* tick, double missing[6]) {
    double rate[6], moved[3];
    for (int a = 0; a < 6; a++) {
        rate[a] = ((double)tick->momentum[a] - (double)tick->change[a] - (double)self->last_momentum[a] -
                   (double)tick->impulse[a]) /
                  tick_s;
    }
    const double p[3] = {(double)tick->motion.p_m[0], (double)tick->motion.p_m[1],
                         (double)tick->motion.p_m[2]};
    cross(p, rate, moved);
    for (int k = 0; k < 3; k++) {
        missing[k] = rate[k];
        missing[3 + k] = rate[3 + k] - moved[k];
    }
}

/// Of y y^T, what theta's errors and legs of unknown friction make of it. A friction that is known to 0.3 of
/// itself errs like white noise of 50 ms; here all of it may be wrong, and half of the square counts.
static void open_now(const tick_t* tick, double open[PARTS][PARTS]) {
    double T[PARTS][6], U[6][6], TU[PARTS][6];
    parts_of(&tick->motion, T);
    for (int a = 0; a < 6; a++) {
        for (int b = 0; b < 6; b++) {
            U[a][b] =
                (double)tick->unknown_scale * (double)(b <= a ? tick->unknown[a][b] : tick->unknown[b][a]);
        }
    }
    times_transposed(&T[0][0], &U[0][0], PARTS, 6, 6, &TU[0][0]);
    times_transposed(&TU[0][0], &T[0][0], PARTS, PARTS, 6, &open[0][0]);
    const double whole = 0.5 / (0.05 / tick_s * 0.3 * 0.3);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        for (int i = 0; i < PARTS; i++) {
            for (int j = 0; j < PARTS; j++) {
                open[i][j] += whole * (double)tick->variance_n2[leg] * (double)tick->motion.J[leg][2 + i] *
                              (double)tick->motion.J[leg][2 + j];
            }
        }
    }
}

/// S: of what is open, of the past and of a share of the weight.
static void spread_of(const hexload_wrench_monitor_t* self, const hexload_config_t* config,
                      const tick_t* tick, double share, double S[PARTS][PARTS]) {
    const hexload_real_t* a = config->geometry.platform_hinge_m[0];
    const double lever_m2 =
        (double)a[0] * (double)a[0] + (double)a[1] * (double)a[1] + (double)a[2] * (double)a[2];
    const double least_n2 = pow(share * (double)config->gravity_m_s2 * tick->body[0], 2.0);
    for (int i = 0; i < PARTS; i++) {
        for (int j = 0; j < PARTS; j++) {
            const int at = i >= j ? ROW(i) + j : ROW(j) + i;
            S[i][j] = (double)self->open[at] + (double)self->mean_square[at];
        }
        S[i][i] += i == 0 ? least_n2 : least_n2 * lever_m2;
    }
}

/// y^T S^-1 y.
static double distance_of(const hexload_wrench_monitor_t* self, const hexload_config_t* config,
                          const tick_t* tick, double share) {
    double S[PARTS][PARTS], inverse[PARTS][PARTS], sum = 0.0;
    spread_of(self, config, tick, share, S);
    invert(&S[0][0], PARTS, &inverse[0][0]);
    for (int i = 0; i < PARTS; i++) {
        for (int j = 0; j < PARTS; j++) {
            sum += (double)self->residual[2 + i] * inverse[i][j] * (double)self->residual[2 + j];
        }
    }
    return sum;
}

/// C and the largest square of late: means of 50 ms, which count 200 ms after they were filled. Of y counts
/// the share of its variance that is not open.
static void learn(hexload_wrench_monitor_t* self, const hexload_config_t* config, const tick_t* tick) {
    double S[PARTS][PARTS], y[PARTS];
    spread_of(self, config, tick, 0.005, S);
    for (int i = 0; i < PARTS; i++) {
        y[i] = (double)self->residual[2 + i] * sqrt(1.0 - (double)self->open[ROW(i) + i] / S[i][i]);
        for (int j = 0; j <= i; j++) {
            self->filling[ROW(i) + j] += (hexload_real_t)(tick_s / 0.05 * y[i] * y[j]);
        }
    }
    self->filled_s += (hexload_real_t)tick_s;
    if (self->filled_s < HEXLOAD_REAL(0.05)) {
        return;
    }
    const uint32_t at = self->next_bin;
    if (self->bins == BINS) {
        self->motion_s = (hexload_real_t)fmin((double)self->motion_s + 0.05, 10.0);
        self->peak =
            (hexload_real_t)fmax((double)self->bin_peak[at], (1.0 - 0.05 / 10.0) * (double)self->peak);
        for (int k = 0; k < HEXLOAD_WRENCH_SQUARES; k++) {
            const double share = 0.05 / (double)self->motion_s;
            self->mean_square[k] = (hexload_real_t)((1.0 - share) * (double)self->mean_square[k] +
                                                    share * (double)self->bin[at][k]);
        }
    }
    memcpy(self->bin[at], self->filling, sizeof self->filling);
    memset(self->filling, 0, sizeof self->filling);
    self->bin_peak[at] = self->filling_peak;
    self->filling_peak = HEXLOAD_REAL(0.0);
    self->next_bin = (uint8_t)(at == BINS - 1 ? 0 : at + 1);
    self->bins = (uint8_t)(self->bins == BINS ? self->bins : self->bins + 1);
    self->filled_s = HEXLOAD_REAL(0.0);
}

typedef struct verdict {
    bool is_wrong;
    bool is_close; ///< rounding decides
} verdict_t;

static bool near(double value, double limit) {
    return fabs(value - limit) < 1e-3 * limit;
}

static void assert_same(const char* what, const hexload_real_t* expected, const hexload_real_t* found,
                        int count, double least, double roundings) {
    double scale = least;
    for (int k = 0; k < count; k++) {
        scale = fmax(scale, fabs((double)expected[k]));
    }
    for (int k = 0; k < count; k++) {
        TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(ROUNDINGS(roundings, scale), (double)expected[k], (double)found[k],
                                          what);
    }
}

/// The monitor as wrench_monitor.h describes it, from the state that it has. What it found of the wrench is
/// compared, and then taken for what follows from it, so that roundings do not grow.
static verdict_t expect(hexload_wrench_monitor_t* self, const hexload_config_t* config, const tick_t* tick,
                        const hexload_wrench_monitor_t* found) {
    verdict_t verdict = {false, false};
    double missing[6], open[PARTS][PARTS];
    self->ticks++;
    if (self->ticks == 1) {
        memcpy(self->last_momentum, tick->momentum, sizeof self->last_momentum);
        return verdict;
    }
    missing_wrench(self, tick, missing);
    open_now(tick, open);
    memcpy(self->last_momentum, tick->momentum, sizeof self->last_momentum);
    for (int k = 0; k < 6; k++) {
        self->residual[k] += (hexload_real_t)(tick_s / 0.02 * (missing[k] - (double)self->residual[k]));
        self->lasting[k] +=
            (hexload_real_t)(tick_s / 0.005 * ((double)self->residual[k] - (double)self->lasting[k]));
    }
    for (int i = 0; i < PARTS; i++) {
        for (int j = 0; j <= i; j++) {
            hexload_real_t* mean = &self->open[ROW(i) + j];
            *mean += (hexload_real_t)(tick_s / 0.02 * (open[i][j] - (double)*mean));
        }
    }
    // a rate of momenta of 2000 N s has a rounding of them in each tick
    assert_same("residual", self->residual, found->residual, 6, 2000.0 / tick_s / 100.0, 2e3);
    assert_same("lasting", self->lasting, found->lasting, 6, 2000.0 / tick_s / 100.0, 2e3);
    assert_same("open", self->open, found->open, 6, 0.0, 2e3);
    memcpy(self->residual, found->residual, sizeof self->residual);
    memcpy(self->lasting, found->lasting, sizeof self->lasting);
    memcpy(self->open, found->open, sizeof self->open);
    const bool is_settled = self->ticks > HEXLOAD_LAG_TICKS_MAX * 5 / 4 &&
                            (tick->fit != HEXLOAD_FIT_NONE || self->ticks * tick_s > 2.0 + 1e-9);
    double now = 0.0;
    if (is_settled && (tick->fit == HEXLOAD_FIT_NONE || tick->fit == HEXLOAD_FIT_FRICTION)) {
        now = distance_of(self, config, tick, 0.005);
        const double square =
            fmin(now, (double)self->last_square); // one tick alone is a speed that is wrong once
        self->filling_peak = (hexload_real_t)fmax((double)self->filling_peak, square);
        if (self->motion_s >= HEXLOAD_REAL(4.0)) {
            const double limit = fmax(50.0, 2.0 * (double)self->peak);
            verdict.is_wrong = square > limit;
            verdict.is_close = near(square, limit);
        } else {
            // the least share fades from 5 to 0.5 % of the weight; peaks are in units of the latter
            const double share = 0.05 - 0.045 * (double)self->motion_s / 4.0;
            const double early = distance_of(self, config, tick, share);
            const double limit = fmax(50.0, 2.0 * (double)self->peak * pow(0.005 / share, 2.0));
            const bool rests = self->motion_s <= HEXLOAD_REAL(0.0) && !tick->is_moving;
            verdict.is_wrong = (config->rig.direction_count > 0 || rests) && early > limit && square > 50.0;
            verdict.is_close = near(early, limit) || near(square, 50.0);
        }
    }
    self->last_square = (hexload_real_t)now;
    if (tick->is_moving) {
        learn(self, config, tick);
    }
    return verdict;
}

/// Random inputs, of which the missing wrench is as large as `size_n`.
static void make_tick(tick_t* tick, const hexload_wrench_monitor_t* self, uint64_t* seed, double size_n,
                      bool is_moving) {
    double sigma[6], unknown[6][6];
    for (int k = 0; k < DIM; k++) {
        tick->filter.theta[k] =
            (hexload_real_t)(k == 0 ? 300.0 + 100.0 * uniform(seed) : 10.0 * uniform(seed));
        tick->body[k] = (double)(tick->filter.platform[k] + tick->filter.theta[k]);
    }
    tick->is_moving = is_moving;
    for (int a = 0; a < 6; a++) {
        sigma[a] = 15.0;
        tick->impulse[a] = (hexload_real_t)(tick_s * 200.0 * uniform(seed));
        tick->change[a] = (hexload_real_t)uniform(seed);
        tick->momentum[a] = self->last_momentum[a] + tick->change[a] + tick->impulse[a] +
                            (hexload_real_t)(tick_s * size_n * uniform(seed));
    }
    random_covariance(seed, 6, sigma, &unknown[0][0]);
    tick->unknown_scale = (hexload_real_t)(1.5 + 0.5 * uniform(seed));
    for (int a = 0; a < 6; a++) {
        tick->variance_n2[a] = (hexload_real_t)(100.0 * (1.0 + uniform(seed)));
        for (int b = 0; b < 6; b++) { // above the diagonal nothing counts
            tick->unknown[a][b] = b <= a ? (hexload_real_t)unknown[a][b] : HEXLOAD_REAL(1e9);
        }
    }
}

static void test_monitor_is_that_of_the_equations_at_every_tick(void) {
    // GIVEN thirty seconds of random wrenches in which calm and bursts take turns, poses, loads and fits,
    // rests, changes of the load, and a machine that is commissioned or not
    scene_t scene[2];
    scene_at(&scene[0], 100);
    scene_at(&scene[1], 230);
    int wrong = 0, early = 0, closes = 0;
    for (uint32_t machine = 0; machine < 2; machine++) {
        hexload_config_t config = scene[0].config;
        hexload_wrench_monitor_t monitor;
        uint64_t seed = 21 + machine;
        tick_t tick;
        memset(&tick, 0, sizeof tick);
        config.tick_s = (hexload_real_t)tick_s;
        config.rig.direction_count = machine;
        config.geometry.platform_hinge_m[0][2] += HEXLOAD_REAL(0.4); // the lever, unlike the other hinges
        hexload_momentum_filter_init(&tick.filter, &config);
        hexload_wrench_monitor_init(&monitor);
        for (uint32_t n = 0; n < 7500; n++) {
            const bool is_burst = n % 37 > 30;
            tick.motion = scene[n % 2].motion;
            tick.fit = (hexload_fit_t)((n / 900 + 2) % 4);
            make_tick(&tick, &monitor, &seed, is_burst ? 1600.0 * (1 + n / 37 % 12) : 150.0, n % 1000 <= 960);
            if (n % 1900 == 1899) {
                hexload_wrench_monitor_restart(&monitor);
            }
            if (n % 50 == 0) { // as if the bursts before had been long ago
                monitor.peak = (hexload_real_t)(30.0 * (1.0 + uniform(&seed)));
                monitor.filling_peak = HEXLOAD_REAL(0.0);
                memset(monitor.bin_peak, 0, sizeof monitor.bin_peak);
            }
            if (n % 1500 == 700) { // and as if little motion had been seen
                monitor.motion_s = HEXLOAD_REAL(3.5);
            }
            hexload_wrench_monitor_t expected = monitor;
            const hexload_push_t push = push_of(&tick);
            // WHEN the monitor takes a tick
            const bool is_wrong =
                hexload_wrench_monitor_step(&monitor, &config, &tick.filter, tick.fit, &push);
            const verdict_t verdict = expect(&expected, &config, &tick, &monitor);
            // THEN its state is what the equations make of the one before
            assert_same("mean_square", expected.mean_square, monitor.mean_square, 6, 0.0, 2e3);
            assert_same("filling", expected.filling, monitor.filling, 6, 100.0, 2e3);
            assert_same("bin", expected.bin[0], monitor.bin[0], BINS * 6, 100.0, 2e3);
            // squares by an inverse of a matrix whose condition is 1e3 and more
            assert_same("bin_peak", expected.bin_peak, monitor.bin_peak, BINS, 1.0, 1e4);
            assert_same("filling_peak", &expected.filling_peak, &monitor.filling_peak, 1, 1.0, 1e4);
            assert_same("peak", &expected.peak, &monitor.peak, 1, 1.0, 1e4);
            assert_same("motion_s", &expected.motion_s, &monitor.motion_s, 1, 1.0, 2e3);
            assert_same("filled_s", &expected.filled_s, &monitor.filled_s, 1, 1.0, 2e3);
            assert_same("last_momentum", expected.last_momentum, monitor.last_momentum, 6, 0.0, 2e3);
            TEST_ASSERT_EQUAL_UINT32(expected.ticks, monitor.ticks);
            TEST_ASSERT_EQUAL_UINT32(expected.bins, monitor.bins);
            TEST_ASSERT_EQUAL_UINT32(expected.next_bin, monitor.next_bin);
            // AND so is its answer
            if (!verdict.is_close) {
                TEST_ASSERT_EQUAL_INT(verdict.is_wrong, is_wrong);
            }
            closes += verdict.is_close;
            wrong += verdict.is_wrong;
            early += verdict.is_wrong && monitor.motion_s < HEXLOAD_REAL(4.0);
        }
    }
    TEST_ASSERT_LESS_THAN_INT(100, closes);
    TEST_ASSERT_GREATER_THAN_INT(50, wrong);
    TEST_ASSERT_GREATER_THAN_INT(10, early);
}

static void test_a_restart_keeps_what_the_machine_is_like(void) {
    // GIVEN a monitor all of whose state is something WHEN the load is another one THEN only what was seen of
    // the load is gone
    hexload_wrench_monitor_t monitor, before;
    memset(&monitor, 0x3b, sizeof monitor);
    before = monitor;
    hexload_wrench_monitor_restart(&monitor);
    TEST_ASSERT_EQUAL_MEMORY(before.open, monitor.open, sizeof before.open);
    TEST_ASSERT_EQUAL_MEMORY(before.mean_square, monitor.mean_square, sizeof before.mean_square);
    TEST_ASSERT_EQUAL_MEMORY(before.bin, monitor.bin, sizeof before.bin);
    TEST_ASSERT_EQUAL_MEMORY(&before.peak, &monitor.peak, sizeof before.peak);
    TEST_ASSERT_EQUAL_MEMORY(&before.motion_s, &monitor.motion_s, sizeof before.motion_s);
    for (int k = 0; k < 6; k++) {
        TEST_ASSERT_EQUAL_DOUBLE(0.0, (double)monitor.residual[k]);
        TEST_ASSERT_EQUAL_DOUBLE(0.0, (double)monitor.lasting[k]);
        TEST_ASSERT_EQUAL_DOUBLE(0.0, (double)monitor.filling[k]);
    }
    TEST_ASSERT_EQUAL_DOUBLE(0.0, (double)monitor.filling_peak);
    TEST_ASSERT_EQUAL_DOUBLE(0.0, (double)monitor.filled_s);
    TEST_ASSERT_EQUAL_UINT32(0, monitor.bins);
    TEST_ASSERT_EQUAL_UINT32(0, monitor.ticks);
    // AND at the start nothing is known
    hexload_wrench_monitor_init(&monitor);
    memset(&before, 0, sizeof before);
    TEST_ASSERT_EQUAL_MEMORY(&before, &monitor, sizeof before);
}

/// A settled monitor of a machine with friction, and a tick at rest.
static void make_settled(scene_t* scene, tick_t* tick, hexload_wrench_monitor_t* monitor) {
    memset(tick, 0, sizeof *tick);
    scene_at(scene, 100);
    hexload_momentum_filter_init(&tick->filter, &scene->config);
    tick->motion = scene->motion;
    memset(tick->motion.twist, 0, sizeof tick->motion.twist);
    tick->unknown_scale = HEXLOAD_REAL(1.0);
    hexload_wrench_monitor_init(monitor);
    monitor->ticks = 1000;
}

static void test_each_leg_alone_shows_that_the_platform_moves(void) {
    // GIVEN a motion of which one leg moves, at 1 % below 10 mm/s or above, either way THEN it moves if above
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        for (int n = 0; n < 4; n++) {
            hexload_real_t velocity_m_s[HEXLOAD_LEGS] = {HEXLOAD_REAL(0.0)};
            velocity_m_s[leg] = (n & 1 ? HEXLOAD_REAL(0.0101) : HEXLOAD_REAL(0.0099)) *
                                (n & 2 ? HEXLOAD_REAL(1.0) : HEXLOAD_REAL(-1.0));
            TEST_ASSERT_EQUAL_INT(n & 1, hexload_is_moving(velocity_m_s));
        }
    }
}

static void test_only_motion_shows_what_the_machine_is_like(void) {
    for (int is_moving = 0; is_moving < 2; is_moving++) {
        // GIVEN a machine that moves or rests WHEN the monitor sees it THEN the tick counts in its past, or
        // does not
        scene_t scene;
        tick_t tick;
        hexload_wrench_monitor_t monitor;
        make_settled(&scene, &tick, &monitor);
        tick.is_moving = is_moving;
        const hexload_push_t push = push_of(&tick);
        TEST_ASSERT_FALSE(
            hexload_wrench_monitor_step(&monitor, &scene.config, &tick.filter, HEXLOAD_FIT_NOISE, &push));
        TEST_ASSERT_EQUAL_INT(is_moving, monitor.filled_s > HEXLOAD_REAL(0.0));
    }
}

static void test_a_bin_is_fifty_milliseconds_of_motion(void) {
    // GIVEN a tick of 4 ms, of which twelve are 48 ms WHEN the platform moves THEN each thirteenth closes a
    // bin
    scene_t scene;
    tick_t tick;
    hexload_wrench_monitor_t monitor;
    make_settled(&scene, &tick, &monitor);
    scene.config.tick_s = HEXLOAD_REAL(0.004);
    tick.is_moving = true;
    for (uint32_t n = 1; n <= 39; n++) {
        const hexload_push_t push = push_of(&tick);
        TEST_ASSERT_FALSE(
            hexload_wrench_monitor_step(&monitor, &scene.config, &tick.filter, HEXLOAD_FIT_NOISE, &push));
        TEST_ASSERT_EQUAL_UINT32(n / 13, monitor.bins);
    }
}

/// A commissioned machine, of which y is F_z alone.
static void make_commissioned(scene_t* scene, tick_t* tick, hexload_wrench_monitor_t* monitor) {
    make_settled(scene, tick, monitor);
    scene->config.rig.direction_count = 1;
    tick->filter.theta[0] = HEXLOAD_REAL(400.0);
    for (int k = 0; k < DIM; k++) {
        tick->body[k] = (double)(tick->filter.platform[k] + tick->filter.theta[k]);
    }
}

static double share_of_weight_n(const scene_t* scene, const tick_t* tick, double share) {
    return share * (double)scene->config.gravity_m_s2 * tick->body[0];
}

/// Ticks in which that share of the weight is missing.
static bool is_wrong_within(scene_t* scene, tick_t* tick, hexload_wrench_monitor_t* monitor, double share,
                            int ticks) {
    double moment[3];
    const double p[3] = {(double)tick->motion.p_m[0], (double)tick->motion.p_m[1],
                         (double)tick->motion.p_m[2]};
    const double force[3] = {0.0, 0.0, share_of_weight_n(scene, tick, share)};
    cross(p, force, moment);
    for (int k = 0; k < 3; k++) { // of a platform at rest, by which mu would move
        tick->impulse[k] = scene->config.tick_s * (hexload_real_t)force[k];
        tick->impulse[3 + k] = scene->config.tick_s * (hexload_real_t)moment[k];
    }
    bool is_wrong = false;
    for (int n = 0; n < ticks; n++) {
        const hexload_push_t push = push_of(tick);
        is_wrong = hexload_wrench_monitor_step(monitor, &scene->config, &tick->filter, HEXLOAD_FIT_FRICTION,
                                               &push) ||
                   is_wrong;
    }
    return is_wrong;
}

/// Whether y of this share of the weight is a wrong wrench after `motion_s` of a commissioned machine.
static bool is_wrong_share(double share, double motion_s) {
    scene_t scene;
    tick_t tick;
    hexload_wrench_monitor_t monitor;
    make_commissioned(&scene, &tick, &monitor);
    monitor.motion_s = (hexload_real_t)motion_s;
    return is_wrong_within(&scene, &tick, &monitor, share, 200);
}

static void test_the_more_motion_is_known_the_smaller_a_load_is_told_of_a_commissioned_machine(void) {
    // GIVEN a machine that is commissioned WHEN a wrench is missing THEN sqrt(50) of the least share of the
    // weight is the limit: it fades from 5 % to 0.5 % over 4 s of motion
    for (int n = 0; n <= 8; n++) {
        const double motion_s = 0.5 * n;
        const double limit = sqrt(50.0) * (0.05 - 0.045 * motion_s / 4.0);
        TEST_ASSERT_FALSE(is_wrong_share(0.98 * limit, motion_s));
        TEST_ASSERT_TRUE(is_wrong_share(1.02 * limit, motion_s));
    }
}

static void test_an_error_that_was_open_hides_no_load_afterwards(void) {
    // GIVEN a commissioned machine that has moved for 12 s with 3 % of the weight missing, one way or the
    // other, of which in one case just that was open and in the other nothing
    bool is_told[2];
    for (int is_open = 0; is_open < 2; is_open++) {
        scene_t scene;
        tick_t tick;
        hexload_wrench_monitor_t monitor;
        make_commissioned(&scene, &tick, &monitor);
        tick.is_moving = true;
        tick.unknown[2][2] = (hexload_real_t)pow(is_open * share_of_weight_n(&scene, &tick, 0.03), 2.0);
        for (int n = 0; n < 60; n++) {
            is_wrong_within(&scene, &tick, &monitor, n % 2 == 0 ? 0.03 : -0.03, 200);
        }
        // WHEN it goes on with nothing open, and then 12 % of the weight come
        memset(tick.unknown, 0, sizeof tick.unknown);
        TEST_ASSERT_FALSE(is_wrong_within(&scene, &tick, &monitor, 0.0, 200));
        is_told[is_open] = is_wrong_within(&scene, &tick, &monitor, 0.12, 100);
    }
    // THEN they are beyond sqrt(50) times what the machine has shown of its own only where it is not all of
    // it: 1.3 % of the weight (c = 9 (c + 0.25) / (c + 9.25), and the least 0.25), or 3 %
    TEST_ASSERT_TRUE(is_told[1]);
    TEST_ASSERT_FALSE(is_told[0]);
}

static void test_a_covariance_that_is_none_reports_nothing(void) {
    // GIVEN a monitor whose covariance rounding has broken WHEN it is asked THEN no wrench is wrong, and none
    // counts as large
    scene_t scene;
    tick_t tick;
    hexload_wrench_monitor_t monitor;
    make_settled(&scene, &tick, &monitor);
    monitor.motion_s = HEXLOAD_REAL(10.0);
    monitor.open[0] = HEXLOAD_REAL(-1e9);
    const hexload_push_t push = push_of(&tick);
    TEST_ASSERT_FALSE(
        hexload_wrench_monitor_step(&monitor, &scene.config, &tick.filter, HEXLOAD_FIT_FRICTION, &push));
    TEST_ASSERT_EQUAL_DOUBLE(0.0, (double)monitor.filling_peak);
}

static void test_ticks_do_not_wrap(void) {
    // GIVEN a monitor that has run for longer than it counts WHEN it goes on THEN its count stays, and it
    // goes on
    scene_t scene;
    tick_t tick;
    hexload_wrench_monitor_t monitor;
    make_settled(&scene, &tick, &monitor);
    monitor.ticks = UINT16_MAX - 2;
    const hexload_push_t push = push_of(&tick);
    for (int n = 0; n < 3; n++) {
        TEST_ASSERT_FALSE(
            hexload_wrench_monitor_step(&monitor, &scene.config, &tick.filter, HEXLOAD_FIT_NOISE, &push));
        TEST_ASSERT_EQUAL_UINT16(UINT16_MAX - 1, monitor.ticks);
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_monitor_is_that_of_the_equations_at_every_tick);
    RUN_TEST(test_a_restart_keeps_what_the_machine_is_like);
    RUN_TEST(test_each_leg_alone_shows_that_the_platform_moves);
    RUN_TEST(test_only_motion_shows_what_the_machine_is_like);
    RUN_TEST(test_a_bin_is_fifty_milliseconds_of_motion);
    RUN_TEST(test_the_more_motion_is_known_the_smaller_a_load_is_told_of_a_commissioned_machine);
    RUN_TEST(test_an_error_that_was_open_hides_no_load_afterwards);
    RUN_TEST(test_a_covariance_that_is_none_reports_nothing);
    RUN_TEST(test_ticks_do_not_wrap);
    return UNITY_END();
}
