#include "momentum/load_monitor.h"
#include "front_end/lost_channels.h"
#include "momentum/leg_or_weight.h"
#include "momentum/momentum_model.h"
#include "rig/rig.h"
#include "textbook.h"

#include <math.h>
#include <string.h>

void setUp(void) {}
void tearDown(void) {}

enum { DIM = HEXLOAD_LOAD_DIM };

static uint16_t settling_ticks(const hexload_config_t* config) {
    return (uint16_t)(config->momentum.lag_ticks * 5 / 4);
}

#define AS_FILTER HEXLOAD_REAL(1.0) ///< variances are those of the filter

typedef struct bench {
    scene_t scene[2]; ///< this tick's and the last one's
    hexload_momentum_filter_t filter;
    hexload_load_monitor_t monitor;
    hexload_present_tick_t now;
} bench_t;

static void turn_to(bench_t* bench, int at) {
    bench->now.motion = &bench->scene[at].motion;
    bench->now.sample = &bench->scene[at].sample;
}

/// A filter with theta and covariance, and a monitor that has settled.
static void begin(bench_t* bench, uint64_t* seed) {
    static const double sigma[DIM] = {10, 3, 4, 2, 1, 2, 3, 0.5, 1, 2};
    double P[DIM][DIM];
    memset(bench, 0, sizeof *bench);
    scene_at(&bench->scene[0], 150);
    scene_at(&bench->scene[1], 240);
    hexload_momentum_filter_init(&bench->filter, &bench->scene[0].config);
    random_covariance(seed, DIM, sigma, &P[0][0]);
    for (int i = 0; i < DIM; i++) {
        bench->filter.theta[i] = (hexload_real_t)(i == 0 ? 400.0 : 20.0 * uniform(seed));
        for (int j = 0; j < DIM; j++) {
            bench->filter.load_cov[i][j] = (hexload_real_t)P[i][j];
        }
    }
    hexload_load_monitor_init(&bench->monitor);
    bench->now.sensors = bench->scene[0].config.sensors;
    bench->now.gap_ticks = 1;
    turn_to(bench, 0);
}

/// A symmetric matrix of which the lower triangle counts.
static void read_lower(hexload_real_t covariance[6][6], double full[6][6]) {
    for (int a = 0; a < 6; a++) {
        for (int b = 0; b < 6; b++) {
            full[a][b] = (double)(b <= a ? covariance[a][b] : covariance[b][a]);
        }
    }
}

/// L with A = L L^T.
static void factor_of(double A[6][6], double L[6][6]) {
    memset(L, 0, 36 * sizeof L[0][0]);
    for (int i = 0; i < 6; i++) {
        for (int j = 0; j <= i; j++) {
            double sum = A[i][j];
            for (int k = 0; k < j; k++) {
                sum -= L[i][k] * L[j][k];
            }
            L[i][j] = i == j ? sqrt(sum) : sum / L[j][j];
        }
    }
}

typedef struct expected {
    double momentum[6], covariance[6][6], unknown[6][6], drift[6], acceleration[6], late_twist[6];
    double nis, nis_mean, drift_nis, risen_s;
    hexload_real_t force_n[HEXLOAD_LEGS];
    hexload_momentum_input_t input;
} expected_t;

/// Forces on the platform, without friction and what the legs' mass takes, which have tests of their own.
static void find_forces(const bench_t* bench, const hexload_config_t* config, expected_t* expected,
                        hexload_real_t variance_n2[HEXLOAD_LEGS]) {
    hexload_rig_slide_t slide = bench->monitor.slide;
    hexload_real_t acceleration[6], wrench[6];
    memcpy(expected->force_n, bench->now.sample->force_n, sizeof expected->force_n);
    hexload_rig_compensate(&slide, config, bench->now.sample->velocity_m_s, bench->now.gap_ticks,
                           expected->force_n, variance_n2);
    hexload_lost_channels_doubt(&bench->now.lost, expected->force_n, variance_n2);
    hexload_momentum_read_input(bench->now.motion, expected->force_n, &expected->input);
    memcpy(acceleration, bench->monitor.acceleration, sizeof acceleration);
    acceleration[2] -= config->gravity_m_s2; // the monitor's is less gravity's
    hexload_rig_leg_wrench(config, bench->now.sample, bench->now.motion, bench->now.motion->twist,
                           acceleration, wrench);
    hexload_momentum_take_off(bench->now.motion, wrench, &expected->input);
}

/// mu and its covariance moved on by a tick; the noise of forces, of jumps that no trapezoid follows, and
/// what the parameters' errors have made of late of the acceleration of the tick before.
static void predict(const bench_t* bench, const hexload_config_t* config, const double body[DIM],
                    const hexload_real_t variance_n2[HEXLOAD_LEGS], expected_t* expected) {
    const hexload_load_monitor_t* self = &bench->monitor;
    const double dt_s = (double)config->tick_s, g = (double)config->gravity_m_s2;
    const hexload_momentum_input_t* input[2] = {&self->last_input, &expected->input};
    double Jw[6][6], variance[6], Y[6][10], P[10][10], YP[6][10], spread[6][6], acceleration[6];
    for (int at = 0; at < 2; at++) {
        double pull[6] = {0, 0, -g * body[0], 0, 0, 0};
        for (int k = 0; k < 4; k++) {
            pull[3] -= g * (double)input[at]->arm[1][k] * body[k];
            pull[4] += g * (double)input[at]->arm[0][k] * body[k];
        }
        for (int a = 0; a < 6; a++) {
            expected->momentum[a] += 0.5 * dt_s * ((double)input[at]->wrench[a] + pull[a]);
        }
    }
    pushes_of(bench->now.motion, Jw);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        const double noise = pow((double)bench->now.sensors.force_sigma_n, 2.0);
        const double jump = (double)expected->force_n[leg] - 2.0 * (double)self->last_force_n[0][leg] +
                            (double)self->last_force_n[1][leg];
        const double beyond = self->ticks < 2 ? 0.0 : fmax(0.0, jump * jump - 9.0 * 6.0 * noise);
        variance[leg] = dt_s * dt_s * (noise + beyond / 16.0 + (double)variance_n2[leg]);
    }
    add_noise_of(Jw, variance, expected->covariance);
    for (int k = 0; k < 6; k++) {
        acceleration[k] = (double)self->acceleration[k];
    }
    for (int i = 0; i < DIM; i++) {
        for (int j = 0; j < DIM; j++) {
            P[i][j] = (double)bench->filter.load_cov[i][j];
        }
    }
    regressor_of(bench->now.motion, acceleration, Y);
    times_transposed(&Y[0][0], &P[0][0], 6, DIM, DIM, &YP[0][0]);
    times_transposed(&YP[0][0], &Y[0][0], 6, 6, DIM, &spread[0][0]);
    for (int a = 0; a < 6; a++) {
        for (int b = 0; b < 6; b++) {
            expected->unknown[a][b] += dt_s / 0.005 * (spread[a][b] - expected->unknown[a][b]);
            expected->covariance[a][b] += 0.05 * dt_s * expected->unknown[a][b];
        }
    }
}

/// K = P S^-1, of the momentum that the measured twist has.
static void correct(const bench_t* bench, const hexload_config_t* config, const double body[DIM],
                    const double measured[6], expected_t* expected) {
    const hexload_load_monitor_t* self = &bench->monitor;
    double columns[6][6], variance[6], S[6][6], L[6][6], inverse[6][6], K[6][6], e[6], white[6] = {0};
    momenta_of_legs(bench->now.motion, body, columns);
    memcpy(S, expected->covariance, sizeof S);
    for (int a = 0; a < 6; a++) {
        variance[a] = pow((double)bench->now.sensors.velocity_sigma_m_s, 2.0);
        e[a] = measured[a] - expected->momentum[a];
    }
    add_noise_of(columns, variance, S);
    factor_of(S, L);
    expected->nis = 0.0;
    for (int a = 0; a < 6; a++) {
        white[a] = e[a];
        for (int b = 0; b < a; b++) {
            white[a] -= L[a][b] * white[b];
        }
        white[a] /= L[a][a];
        expected->nis += white[a] * white[a];
    }
    const double square = expected->nis;
    const bool is_spike = square >= 120.0 && self->ticks == settling_ticks(config);
    expected->nis = fmin(square, 120.0);
    const double share = 200.0 * (double)config->tick_s;
    const double counted = is_spike ? sqrt(120.0 / square) : 1.0; // of a spike as much as one tick counts
    for (int a = 0; a < 6; a++) {
        expected->drift[a] += share * (counted * white[a] - expected->drift[a]);
    }
    expected->drift_nis += share * (expected->nis - expected->drift_nis);
    if (is_spike) {
        return;
    }
    invert(&S[0][0], 6, &inverse[0][0]);
    times_transposed(&expected->covariance[0][0], &inverse[0][0], 6, 6, 6, &K[0][0]);
    double less[6][6];
    times_transposed(&K[0][0], &expected->covariance[0][0], 6, 6, 6, &less[0][0]);
    for (int a = 0; a < 6; a++) {
        for (int b = 0; b < 6; b++) {
            expected->momentum[a] += K[a][b] * e[b];
            expected->covariance[a][b] -= less[a][b];
        }
    }
}

/// The monitor of the next tick as its equations say.
static void expect(bench_t* bench, const hexload_config_t* config, expected_t* expected) {
    hexload_load_monitor_t* self = &bench->monitor;
    const hexload_motion_t* motion = bench->now.motion;
    const double dt_s = (double)config->tick_s;
    double twist[6], change[DIM], body[DIM], of_change[6], measured[6];
    hexload_real_t variance_n2[HEXLOAD_LEGS] = {0};
    find_forces(bench, config, expected, variance_n2);
    for (int k = 0; k < DIM; k++) {
        change[k] = (double)bench->filter.theta[k] - (double)self->theta[k];
        body[k] = (double)bench->filter.platform[k] + (double)bench->filter.theta[k];
    }
    for (int k = 0; k < 6; k++) {
        twist[k] = (double)motion->twist[k];
    }
    momentum_of(motion, twist, change, of_change);
    momentum_of(motion, twist, body, measured);
    for (int k = 0; k < 6; k++) {
        expected->momentum[k] = (double)self->momentum[k] + of_change[k];
        expected->drift[k] = (double)self->drift[k];
        expected->late_twist[k] = (double)self->late_twist[k];
    }
    read_lower(self->covariance, expected->covariance);
    read_lower(self->unknown, expected->unknown);
    expected->risen_s = self->nis_mean > HEXLOAD_REAL(9.0) ? (double)self->risen_s + dt_s : 0.0;
    expected->nis_mean = (double)self->nis_mean;
    expected->drift_nis = (double)self->drift_nis;
    if (self->ticks == 0 || bench->now.gap_ticks != 1) {
        double columns[6][6], variance[6];
        momenta_of_legs(motion, body, columns);
        memset(expected->covariance, 0, sizeof expected->covariance);
        memcpy(expected->momentum, measured, sizeof measured);
        memcpy(expected->late_twist, twist, sizeof twist);
        for (int leg = 0; leg < 6; leg++) {
            variance[leg] = pow((double)bench->now.sensors.velocity_sigma_m_s, 2.0);
        }
        add_noise_of(columns, variance, expected->covariance);
        expected->nis = 6.0;
    } else {
        predict(bench, config, body, variance_n2, expected);
        correct(bench, config, body, measured, expected);
        expected->nis_mean += dt_s / 0.05 * (expected->nis - expected->nis_mean);
    }
    for (int k = 0; k < 6; k++) {
        expected->acceleration[k] = (twist[k] - expected->late_twist[k]) / 0.005;
        expected->late_twist[k] += dt_s * expected->acceleration[k];
    }
    expected->acceleration[2] += (double)config->gravity_m_s2;
    if (self->ticks < settling_ticks(config)) {
        expected->nis_mean = 6.0;
        expected->drift_nis = 6.0;
        memset(expected->drift, 0, sizeof expected->drift);
    }
}

static void assert_same(const expected_t* expected, const hexload_load_monitor_t* found) {
    // roundings of momenta of 2000 N s, in sigmas that are as small as 0.1 N s, and of rates of the twist
    const double momentum = ROUNDINGS(40, 2000.0), in_sigmas = 20.0 * momentum;
    double P[6][6], unknown[6][6];
    hexload_load_monitor_t copy = *found;
    read_lower(copy.covariance, P);
    read_lower(copy.unknown, unknown);
    for (int a = 0; a < 6; a++) {
        TEST_ASSERT_DOUBLE_WITHIN(momentum, expected->momentum[a], (double)found->momentum[a]);
        TEST_ASSERT_DOUBLE_WITHIN(in_sigmas, expected->drift[a], (double)found->drift[a]);
        TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(40, 2.0 / 0.005), expected->acceleration[a],
                                  (double)found->acceleration[a]);
        TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(8, 2.0), expected->late_twist[a], (double)found->late_twist[a]);
        for (int b = 0; b < 6; b++) {
            TEST_ASSERT_DOUBLE_WITHIN(
                ROUNDINGS(5000, sqrt(expected->covariance[a][a] * expected->covariance[b][b])),
                expected->covariance[a][b], P[a][b]);
            TEST_ASSERT_DOUBLE_WITHIN(
                ROUNDINGS(5000, sqrt(expected->unknown[a][a] * expected->unknown[b][b])),
                expected->unknown[a][b], unknown[a][b]);
        }
    }
    TEST_ASSERT_DOUBLE_WITHIN(in_sigmas * (1.0 + sqrt(expected->nis)), expected->nis, (double)found->nis);
    TEST_ASSERT_DOUBLE_WITHIN(in_sigmas * 10.0, expected->nis_mean, (double)found->nis_mean);
    TEST_ASSERT_DOUBLE_WITHIN(in_sigmas * 10.0, expected->drift_nis, (double)found->drift_nis);
    TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(4, 1.0), expected->risen_s, (double)found->risen_s);
    TEST_ASSERT_EQUAL_MEMORY(expected->force_n, found->last_force_n[0], sizeof expected->force_n);
    for (int a = 0; a < 6; a++) {
        TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(8, 1e4), (double)expected->input.wrench[a],
                                  (double)found->last_input.wrench[a]);
    }
    TEST_ASSERT_EQUAL_MEMORY(expected->input.arm, found->last_input.arm, sizeof expected->input.arm);
}

/// Sensors' values of the next tick: those of the scene, noise, jumps, a change of the estimate now and then.
static void make_tick(bench_t* bench, uint32_t n, uint64_t* seed) {
    scene_t* scene = &bench->scene[n % 2];
    const bool jumps = n % 13 == 7 || n == 1; // as soon as there is a past, too
    turn_to(bench, (int)(n % 2));
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        scene->sample.force_n[leg] = (hexload_real_t)(1500.0 + (jumps ? 900.0 : 20.0) * uniform(seed));
        scene->sample.velocity_m_s[leg] = (hexload_real_t)(0.1 * uniform(seed));
    }
    for (int k = 0; k < 6; k++) {
        scene->motion.twist[k] = (hexload_real_t)((double)bench->monitor.late_twist[k] +
                                                  0.02 * uniform(seed) + (k == 2 ? 0.01 : 0.0));
    }
    for (int k = 0; k < DIM && n % 7 == 3; k++) {
        bench->filter.theta[k] += (hexload_real_t)(k == 0 ? 5.0 * uniform(seed) : 0.5 * uniform(seed));
    }
    bench->now.gap_ticks = n % 97 == 96 ? 2 : 1;
    bench->now.lost.force_ticks = n % 29 == 5;
    bench->now.lost.force_leg = n % 6;
}

static void test_monitor_is_that_of_the_equations_at_every_tick(void) {
    // GIVEN six hundred ticks of forces and speeds, with noise, jumps, gaps, estimates that change, on
    // machines with and without friction and legs of a mass
    for (int machine = 0; machine < 2; machine++) {
        uint64_t seed = 31;
        bench_t bench;
        begin(&bench, &seed);
        hexload_config_t config = bench.scene[0].config;
        bench.now.sensors.velocity_sigma_m_s = HEXLOAD_REAL(0.01);
        bench.now.sensors.force_sigma_n = HEXLOAD_REAL(120.0); // jumps are up to some 20 of it
        config.rig.leg_inertia_kg_m2 = (hexload_real_t)(20.0 * machine);
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            config.rig.coulomb_n[leg] = (hexload_real_t)(50.0 * machine);
            config.rig.stribeck_speed_m_s = HEXLOAD_REAL(0.01);
            config.rig.reversal_speed_m_s = HEXLOAD_REAL(0.01);
        }
        for (uint32_t n = 0; n < 600; n++) {
            expected_t expected;
            make_tick(&bench, n, &seed);
            expect(&bench, &config, &expected);
            const uint32_t ticks = bench.monitor.ticks;
            // WHEN the monitor takes a tick THEN it is what the equations make of the one before
            const bool is_alarm = hexload_load_monitor_step(&bench.monitor, &config, &bench.filter, AS_FILTER,
                                                            HEXLOAD_FIT_NOISE, &bench.now);
            assert_same(&expected, &bench.monitor);
            TEST_ASSERT_EQUAL_UINT32(ticks < settling_ticks(&config) ? ticks + 1 : ticks,
                                     bench.monitor.ticks);
            double square = 0.0;
            for (int k = 0; k < 6; k++) {
                square += expected.drift[k] * expected.drift[k];
            }
            // AND 12 of a mean NIS and 60 of the drift's chi-square are another load where innovations last
            const double share = 200.0 * (double)config.tick_s;
            const double drift = square * (2.0 - share) / share;
            TEST_ASSERT_EQUAL_INT(
                (expected.nis_mean > 12.0 || drift > 60.0) && drift >= 3.5 * expected.drift_nis, is_alarm);
        }
    }
}

static void test_forces_that_do_not_jump_have_the_noise_of_their_sensors_alone(void) {
    // GIVEN sensors of 0.1 N that have shown the same for three ticks, a load that is known, speeds that tell
    // nothing WHEN the next tick comes after a momentum that was known THEN its covariance is that of these
    // forces over a tick
    uint64_t seed = 32;
    bench_t bench;
    double Jw[6][6], variance[6], expected[6][6] = {{0}}, found[6][6];
    begin(&bench, &seed);
    const hexload_config_t* config = &bench.scene[0].config;
    memset(bench.filter.load_cov, 0, sizeof bench.filter.load_cov);
    bench.now.sensors.force_sigma_n = HEXLOAD_REAL(0.1);
    bench.now.sensors.velocity_sigma_m_s = HEXLOAD_REAL(1e3);
    for (int tick = 0; tick < 4; tick++) {
        memset(bench.monitor.covariance, 0, sizeof bench.monitor.covariance);
        TEST_ASSERT_FALSE(hexload_load_monitor_step(&bench.monitor, config, &bench.filter, AS_FILTER,
                                                    HEXLOAD_FIT_NOISE, &bench.now));
    }
    pushes_of(bench.now.motion, Jw);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        variance[leg] = pow((double)config->tick_s * 0.1, 2.0);
    }
    add_noise_of(Jw, variance, expected);
    read_lower(bench.monitor.covariance, found);
    for (int a = 0; a < 6; a++) { // 6 terms, and a correction that leaves it
        for (int b = 0; b < 6; b++) {
            TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(40, sqrt(expected[a][a] * expected[b][b])), expected[a][b],
                                      found[a][b]);
        }
    }
}

/// Answer of a settled monitor to a tick after a gap, which leaves means as they are.
static bool is_other_load(bench_t* bench, const hexload_config_t* config, hexload_fit_t fit, double nis_mean,
                          double drift_square) {
    bench->now.gap_ticks = 2;
    bench->monitor.ticks = settling_ticks(config);
    bench->monitor.nis_mean = (hexload_real_t)nis_mean;
    bench->monitor.drift_nis = HEXLOAD_REAL(0.0); // all of it lasts
    for (int k = 0; k < 6; k++) {
        bench->monitor.drift[k] = (hexload_real_t)sqrt(drift_square / 6.0);
    }
    return hexload_load_monitor_step(&bench->monitor, config, &bench->filter, AS_FILTER, fit, &bench->now);
}

static void test_limits_are_those_of_the_equations(void) {
    // GIVEN a tick of 1 ms, of which the drift's mean takes a fifth: 60 of chi-square are 60 * 0.2 / 1.8
    static const struct {
        hexload_fit_t fit;
        uint32_t half_window_ticks;
        double nis, drift;
    } cases[] = {
        {HEXLOAD_FIT_NOISE, 0, 12.0, 60.0 * 0.2 / 1.8},  {HEXLOAD_FIT_UNPROVEN, 0, 18.0, 1e9},
        {HEXLOAD_FIT_NOISE, 1, 18.0, 60.0 * 0.2},        {HEXLOAD_FIT_NOISE, 3, 18.0, 60.0 * 0.2},
        {HEXLOAD_FIT_NOISE, 5, 18.0, 60.0 * 0.2 * 1.29}, {HEXLOAD_FIT_UNPROVEN, 5, 18.0, 1e9},
        {HEXLOAD_FIT_NOISE, 9, 18.0, 60.0 * 0.2 * 2.15},
    };
    uint64_t seed = 32;
    bench_t bench;
    begin(&bench, &seed);
    for (size_t n = 0; n < sizeof cases / sizeof cases[0]; n++) {
        hexload_config_t config = bench.scene[0].config;
        config.sensors.half_window_ticks = cases[n].half_window_ticks;
        // WHEN a mean is 0.1 % below its limit, or above THEN it is no other load, or one
        TEST_ASSERT_FALSE(is_other_load(&bench, &config, cases[n].fit, 0.999 * cases[n].nis, 0.0));
        TEST_ASSERT_TRUE(is_other_load(&bench, &config, cases[n].fit, 1.001 * cases[n].nis, 0.0));
        TEST_ASSERT_FALSE(is_other_load(&bench, &config, cases[n].fit, 6.0, 0.999 * cases[n].drift));
        TEST_ASSERT_EQUAL_INT(cases[n].drift < 1e9,
                              is_other_load(&bench, &config, cases[n].fit, 6.0, 1.001 * cases[n].drift));
    }
}

static void test_large_innovations_that_point_anywhere_are_no_other_load(void) {
    // GIVEN a mean NIS far above its limit, of innovations whose mean's square, 1.8 / 0.2 of it chi-square,
    // is 3.5 of their own squares WHEN it is 0.1 % less, or more THEN it is noise that has grown, or another
    // load
    uint64_t seed = 38;
    bench_t bench;
    begin(&bench, &seed);
    hexload_config_t config = bench.scene[0].config;
    for (int n = 0; n < 8; n++) {
        const bool is_lasting = n & 1, has_window = n & 2;
        const hexload_fit_t fit = n & 4 ? HEXLOAD_FIT_NOISE : HEXLOAD_FIT_UNPROVEN;
        const double drift = 40.0 * 0.2 / 1.8;
        config.sensors.half_window_ticks = has_window ? 3 : 0;
        (void)is_other_load(&bench, &config, fit, 50.0, drift);
        bench.monitor.ticks = settling_ticks(&config);
        bench.monitor.drift_nis = (hexload_real_t)(40.0 / 3.5 * (is_lasting ? 0.999 : 1.001));
        // AND with speeds from displacements, which err alike for a while, it is one in either case
        TEST_ASSERT_EQUAL_INT(
            is_lasting || has_window,
            hexload_load_monitor_step(&bench.monitor, &config, &bench.filter, AS_FILTER, fit, &bench.now));
    }
}

static void test_a_wrench_that_lasts_is_another_load_at_every_tick(void) {
    // GIVEN ticks from 0.1 to 5 ms, and an innovation that is the same for so long that its mean is itself
    static const double ticks_s[] = {1e-4, 5e-4, 1e-3, 2e-3, 4e-3, 5e-3};
    uint64_t seed = 42;
    bench_t bench;
    begin(&bench, &seed);
    hexload_config_t config = bench.scene[0].config;
    bench.now.sensors.velocity_sigma_m_s = HEXLOAD_REAL(1e3); // so that the tick's own is none
    for (size_t n = 0; n < sizeof ticks_s / sizeof ticks_s[0]; n++) {
        config.tick_s = (hexload_real_t)ticks_s[n];
        bench.now.gap_ticks = 1;
        bench.monitor.ticks = settling_ticks(&config);
        bench.monitor.nis_mean = HEXLOAD_REAL(60.0);
        bench.monitor.drift_nis = HEXLOAD_REAL(60.0);
        for (int k = 0; k < 6; k++) {
            bench.monitor.drift[k] = (hexload_real_t)sqrt(60.0 / 6.0);
        }
        // WHEN the next tick comes THEN it is another load's
        TEST_ASSERT_TRUE(hexload_load_monitor_step(&bench.monitor, &config, &bench.filter, AS_FILTER,
                                                   HEXLOAD_FIT_NOISE, &bench.now));
    }
}

static void test_noise_that_has_grown_is_no_wrong_wrench_either(void) {
    // GIVEN a rig with friction, a wrench far beyond what it has shown, speeds that tell nothing, so that a
    // tick leaves 0.8 of the innovations' means WHEN their squares are above or below twice the ideal,
    // and 3.5 times them above or below the square of their mean
    uint64_t seed = 41;
    bench_t bench;
    begin(&bench, &seed);
    hexload_config_t config = bench.scene[0].config;
    bench.now.sensors.velocity_sigma_m_s = HEXLOAD_REAL(1e3);
    for (int n = 0; n < 8; n++) {
        const bool is_large = n & 1, is_lasting = n & 2, has_window = n & 4;
        const double nis = 12.0 * (is_large ? 1.001 : 0.999);
        const double drift = 3.5 * nis * (is_lasting ? 1.001 : 0.999) * 0.2 / 1.8;
        config.sensors.half_window_ticks = has_window ? 3 : 0;
        bench.now.gap_ticks = 1;
        bench.monitor.ticks = settling_ticks(&config);
        bench.monitor.drift_nis = (hexload_real_t)(nis / 0.8);
        for (int k = 0; k < 6; k++) {
            bench.monitor.drift[k] = (hexload_real_t)(sqrt(drift / 6.0) / 0.8);
            bench.monitor.wrench.residual[k] = HEXLOAD_REAL(1e6);
        }
        bench.monitor.wrench.ticks = settling_ticks(&config);
        bench.monitor.wrench.motion_s = HEXLOAD_REAL(10.0);
        bench.monitor.wrench.last_square = HEXLOAD_REAL(1e9);
        // THEN it is noise where they are large and do not last; with speeds from displacements, which err
        // alike for a while, that cannot be said
        TEST_ASSERT_EQUAL_INT(!is_large || is_lasting || has_window,
                              hexload_load_monitor_step(&bench.monitor, &config, &bench.filter, AS_FILTER,
                                                        HEXLOAD_FIT_FRICTION, &bench.now));
    }
}

static void test_a_leg_is_it_where_it_explains_half_and_a_weight_is_not_certainly_likelier(void) {
    // GIVEN wrenches of a leg's force and a weight in all shares WHEN they are held against each other THEN
    // it is a leg's where that explains more than half, and a weight is no more than e^6 times as likely; but
    // where the leg leaves more than noise and a hundredth, and a weight less than a tenth, that is a load's
    uint64_t seed = 39;
    bench_t bench;
    int legs = 0, not_half = 0, certain = 0, turning = 0;
    begin(&bench, &seed);
    const hexload_config_t* config = &bench.scene[0].config;
    const hexload_motion_t* motion = bench.now.motion;
    bench.monitor.acceleration[2] = config->gravity_m_s2;
    for (int trial = 0; trial < 2000; trial++) {
        hexload_real_t body[DIM];
        hexload_explained_t explained;
        const double leg_n = 30.0 * uniform(&seed), weight_n = 30.0 * uniform(&seed);
        for (int k = 0; k < 6; k++) {
            const double other = (k < 3 ? 4.0 : 12.0) * uniform(&seed) + (k == 2 ? weight_n : 0.0);
            bench.monitor.wrench.lasting[k] =
                (hexload_real_t)(leg_n * (double)motion->J[trial % 6][k] + other);
        }
        hexload_momentum_filter_body(&bench.filter, body);
        const hexload_missing_t missing = {.wrench = bench.monitor.wrench.lasting,
                                           .pull_m_s2 = bench.monitor.acceleration,
                                           .body = body,
                                           .kept = (hexload_real_t)(0.2 / 1.8)};
        hexload_explain_missing(config, &bench.now, &missing, &explained);
        const double half = 0.5 * (double)explained.whole;
        const double odds = 0.5 * ((double)explained.by_weight - (double)explained.by_leg);
        const double whole = (double)explained.whole, beyond_noise = whole - (double)explained.by_leg - 20.5;
        const double by_no_weight = 1.0 - (double)explained.by_weight / whole;
        if (fabs((double)explained.by_leg / half - 1.0) < 1e-3 || fabs(odds - 6.0) < 1e-2 ||
            fabs(beyond_noise / whole - 0.01) < 1e-3 || fabs(by_no_weight - 0.1) < 1e-3) {
            continue; // rounding decides
        }
        const bool has_half = (double)explained.by_leg > half, is_certain = odds > 6.0;
        const bool is_turning = beyond_noise > 0.01 * whole && by_no_weight < 0.1;
        const bool is_leg = has_half && !is_certain && !is_turning;
        legs += is_leg;
        not_half += !has_half && !is_certain;
        certain += has_half && is_certain;
        turning += has_half && !is_certain && is_turning;
        TEST_ASSERT_EQUAL_INT(
            is_leg, hexload_load_monitor_is_one_leg(&bench.monitor, config, &bench.filter, &bench.now));
    }
    TEST_ASSERT_TRUE(legs > 20 && not_half > 20 && certain > 20 &&
                     turning > 20); // each of them has been asked for
}

static void test_on_a_machine_that_is_not_its_model_momentum_begins_anew(void) {
    // GIVEN a mean far above its limit WHEN only noise is expected THEN it is another load
    uint64_t seed = 33;
    bench_t bench;
    begin(&bench, &seed);
    const hexload_config_t config = bench.scene[0].config;
    TEST_ASSERT_TRUE(is_other_load(&bench, &config, HEXLOAD_FIT_NOISE, 50.0, 0.0));
    TEST_ASSERT_EQUAL_UINT32(settling_ticks(&config), bench.monitor.ticks);
    TEST_ASSERT_TRUE(is_other_load(&bench, &config, HEXLOAD_FIT_UNPROVEN, 50.0, 0.0));
    TEST_ASSERT_EQUAL_UINT32(settling_ticks(&config), bench.monitor.ticks);
    // WHEN friction is known to a tolerance, or nothing fits THEN it is none, as no wrench is wrong, and mu
    // begins anew
    for (int fit = HEXLOAD_FIT_FRICTION; fit <= HEXLOAD_FIT_NONE; fit++) {
        TEST_ASSERT_FALSE(is_other_load(&bench, &config, (hexload_fit_t)fit, 50.0, 0.0));
        TEST_ASSERT_EQUAL_UINT32(0, bench.monitor.ticks);
        TEST_ASSERT_FALSE(is_other_load(&bench, &config, (hexload_fit_t)fit, 6.0, 0.0));
        TEST_ASSERT_EQUAL_UINT32(settling_ticks(&config), bench.monitor.ticks);
    }
}

static void test_wrench_monitor_hears_every_tick_and_a_gap_restarts_it(void) {
    // GIVEN a monitor with a past WHEN ticks come THEN the wrench monitor counts them, and a gap begins anew
    uint64_t seed = 34;
    bench_t bench;
    begin(&bench, &seed);
    for (uint32_t n = 0; n < 5; n++) {
        turn_to(&bench, (int)(n % 2));
        (void)!hexload_load_monitor_step(&bench.monitor, &bench.scene[0].config, &bench.filter, AS_FILTER,
                                         HEXLOAD_FIT_NOISE, &bench.now);
        TEST_ASSERT_EQUAL_UINT32(n + 1, bench.monitor.wrench.ticks);
    }
    bench.now.gap_ticks = 2;
    (void)!hexload_load_monitor_step(&bench.monitor, &bench.scene[0].config, &bench.filter, AS_FILTER,
                                     HEXLOAD_FIT_NOISE, &bench.now);
    TEST_ASSERT_EQUAL_UINT32(1, bench.monitor.wrench.ticks);
    // AND another load restarts all but what the machine is like
    bench.monitor.wrench.peak = HEXLOAD_REAL(5.0);
    bench.monitor.slide.share[3] = HEXLOAD_REAL(0.5);
    bench.monitor.nis_mean = HEXLOAD_REAL(70.0);
    hexload_load_monitor_restart(&bench.monitor);
    TEST_ASSERT_EQUAL_DOUBLE(5.0, (double)bench.monitor.wrench.peak);
    TEST_ASSERT_EQUAL_DOUBLE(0.5, (double)bench.monitor.slide.share[3]);
    TEST_ASSERT_EQUAL_DOUBLE(6.0, (double)bench.monitor.nis_mean);
    TEST_ASSERT_EQUAL_DOUBLE(6.0, (double)bench.monitor.nis);
    TEST_ASSERT_EQUAL_UINT32(0, bench.monitor.ticks);
    TEST_ASSERT_EQUAL_UINT32(0, bench.monitor.wrench.ticks);
}

static void test_what_the_filter_does_not_know_is_open_as_often_as_it_is_too_sure(void) {
    // GIVEN two monitors with one past, and a filter whose variances are too small by 9 for one of them
    uint64_t seed = 35;
    bench_t bench[2];
    begin(&bench[0], &seed);
    turn_to(&bench[0], 0);
    bench[1] = bench[0];
    // WHEN they take ticks THEN 9 times as much of the wrench is open there
    for (int n = 0; n < 5; n++) {
        for (int k = 0; k < 2; k++) {
            turn_to(&bench[k], n % 2);
            (void)!hexload_load_monitor_step(&bench[k].monitor, &bench[k].scene[0].config, &bench[k].filter,
                                             k == 0 ? AS_FILTER : HEXLOAD_REAL(9.0), HEXLOAD_FIT_NOISE,
                                             &bench[k].now);
        }
    }
    for (int k = 0; k < HEXLOAD_WRENCH_SQUARES; k++) {
        const double once = (double)bench[0].monitor.wrench.open[k];
        TEST_ASSERT_DOUBLE_WITHIN(1e-5 * fabs(9.0 * once) + 1e-9, 9.0 * once,
                                  (double)bench[1].monitor.wrench.open[k]);
    }
    TEST_ASSERT_TRUE(bench[0].monitor.wrench.open[0] > HEXLOAD_REAL(0.0));
}

static void test_a_rise_of_more_than_thirty_milliseconds_is_late(void) {
    hexload_load_monitor_t monitor;
    hexload_load_monitor_init(&monitor);
    monitor.risen_s = HEXLOAD_REAL(0.0299);
    TEST_ASSERT_FALSE(hexload_load_monitor_is_late(&monitor));
    monitor.risen_s = HEXLOAD_REAL(0.0301);
    TEST_ASSERT_TRUE(hexload_load_monitor_is_late(&monitor));
}

static double dot(const double a[3], const double b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static void test_a_weight_is_a_force_along_the_pull_and_a_moment_across_it(void) {
    // GIVEN wrenches and accelerations in all directions, and a platform's hinges as the lever
    hexload_config_t config = crooked_machine();
    uint64_t seed = 35;
    int weights = 0, judged = 0, light = 0;
    config.geometry.platform_hinge_m[0][2] += HEXLOAD_REAL(0.3);
    double lever[3];
    for (int k = 0; k < 3; k++) {
        lever[k] = (double)config.geometry.platform_hinge_m[0][k];
    }
    const double lever_m2 = dot(lever, lever);
    for (int trial = 0; trial < 4000; trial++) {
        hexload_load_monitor_t monitor;
        double force[3], moment[3], pull[3], turn[3], across[3], moves[3];
        hexload_load_monitor_init(&monitor);
        monitor.theta[0] = (hexload_real_t)(300.0 + 200.0 * uniform(&seed));
        const double mass_kg = (double)config.platform.mass_kg + (double)monitor.theta[0];
        const double size_kg = mass_kg * 0.02 * pow(10.0, uniform(&seed)),
                     side = pow(10.0, uniform(&seed)) * 0.2;
        for (int k = 0; k < 3; k++) {
            monitor.acceleration[k] = (hexload_real_t)((k == 2 ? 9.81 : 0.0) + 2.0 * uniform(&seed));
            monitor.acceleration[3 + k] = (hexload_real_t)(3.0 * uniform(&seed));
            pull[k] = (double)monitor.acceleration[k];
            turn[k] = (double)monitor.acceleration[3 + k];
            monitor.wrench.lasting[k] = (hexload_real_t)(size_kg * (pull[k] + 9.81 * side * uniform(&seed)));
            monitor.wrench.lasting[3 + k] = (hexload_real_t)(size_kg * 9.81 * 0.5 * side * uniform(&seed));
            force[k] = (double)monitor.wrench.lasting[k];
            moment[k] = (double)monitor.wrench.lasting[3 + k];
            moves[k] = pull[k] - (k == 2 ? (double)config.gravity_m_s2 : 0.0);
        }
        // WHEN the part that is no weight is compared with a fifth of the whole and what inertia makes of it
        cross(force, pull, across);
        const double whole = dot(force, force) + dot(moment, moment) / lever_m2;
        const double other = dot(across, across) + pow(dot(moment, pull), 2.0) / lever_m2;
        const double limit = whole * (0.2 * dot(pull, pull) + dot(moves, moves) + lever_m2 * dot(turn, turn));
        const double least = pow(0.02 * mass_kg, 2.0) * dot(pull, pull);
        if (fabs(other / limit - 1.0) < 1e-3 || fabs(whole / least - 1.0) < 1e-3) {
            continue;
        }
        // THEN it is a weight when that is not more, and of a load that is new 2 % of all that is carried
        const bool is_weight = other < limit;
        judged++;
        weights += is_weight;
        light += is_weight && whole < least;
        TEST_ASSERT_EQUAL_INT(is_weight,
                              hexload_load_monitor_is_weight(&monitor, &config, HEXLOAD_FIT_NOISE));
        TEST_ASSERT_EQUAL_INT(is_weight && whole > least,
                              hexload_load_monitor_is_weight(&monitor, &config, HEXLOAD_FIT_UNPROVEN));
    }
    TEST_ASSERT_GREATER_THAN_INT(500, weights);
    TEST_ASSERT_GREATER_THAN_INT(500, judged - weights);
    TEST_ASSERT_GREATER_THAN_INT(100, light);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_monitor_is_that_of_the_equations_at_every_tick);
    RUN_TEST(test_forces_that_do_not_jump_have_the_noise_of_their_sensors_alone);
    RUN_TEST(test_limits_are_those_of_the_equations);
    RUN_TEST(test_large_innovations_that_point_anywhere_are_no_other_load);
    RUN_TEST(test_a_wrench_that_lasts_is_another_load_at_every_tick);
    RUN_TEST(test_noise_that_has_grown_is_no_wrong_wrench_either);
    RUN_TEST(test_a_leg_is_it_where_it_explains_half_and_a_weight_is_not_certainly_likelier);
    RUN_TEST(test_on_a_machine_that_is_not_its_model_momentum_begins_anew);
    RUN_TEST(test_wrench_monitor_hears_every_tick_and_a_gap_restarts_it);
    RUN_TEST(test_what_the_filter_does_not_know_is_open_as_often_as_it_is_too_sure);
    RUN_TEST(test_a_rise_of_more_than_thirty_milliseconds_is_late);
    RUN_TEST(test_a_weight_is_a_force_along_the_pull_and_a_moment_across_it);
    return UNITY_END();
}
