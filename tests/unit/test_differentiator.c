#include "front_end/differentiator.h"
#include "momentum/smoother.h"
#include "motion.h"

#include <math.h>
#include <string.h>

void setUp(void) {}
void tearDown(void) {}

static const body_t eccentric = {312.0, {-0.09, 0.13, 0.27}, {17.0, 21.0, 12.0, 2.0, -1.0, 1.5}};
static const body_t on_axis = {500.0, {0.0, 0.0, 0.3}, {25.0, 28.0, 22.0, 0.0, 0.0, 0.0}};

static hexload_config_t without_velocity(hexload_kind_t kind) {
    hexload_config_t config = paper_machine();
    config.kind = kind;
    hexload_config_set_no_velocity(&config);
    hexload_config_set_momentum(&config);
    return config;
}

/// A random motion as sensors of displacement and force see it; the velocities are not numbers.
static hexload_leg_sample_t sample_at(const body_t* load, uint32_t tick, uint64_t* seed) {
    const hexload_config_t sensors = paper_machine();
    const motion_t motion = random_motion(7, 0.05, 0.1);
    hexload_leg_sample_t sample = perfect_sample(&sensors, load, &motion, 0.7982755, tick);
    add_noise(&sensors, seed, &sample);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        sample.velocity_m_s[leg] = (hexload_real_t)NAN;
    }
    return sample;
}

/// Speed of fourth degree less in time, each leg with one power and size; t in windows.
static double speed_of_leg(int leg, double t_s) {
    const double t = t_s / 0.006;
    return 0.1 * (1.0 + leg) * (leg < 4 ? pow(t, leg) : 1.0 + t + t * t + t * t * t);
}

static double displacement_of_leg(int leg, double t_s) {
    const double t = t_s / 0.006;
    const double power =
        leg < 4 ? pow(t, leg + 1) / (leg + 1) : t + t * t / 2.0 + t * t * t / 3.0 + t * t * t * t / 4.0;
    return 0.1 * (1.0 + leg) * 0.006 * power;
}

static void test_speed_and_force_pass_the_same_filter(void) {
    // GIVEN forces that are as the speeds, in newtons for metres per second, polynomials up to third degree
    const hexload_config_t config = without_velocity(HEXLOAD_KIND_MOMENTUM);
    const uint32_t half = config.sensors.half_window_ticks;
    hexload_differentiator_t differentiator;
    hexload_leg_sample_t middle = {0};
    bool has_come = false;
    hexload_differentiator_init(&differentiator);
    // WHEN a window of them has been taken
    for (uint32_t tick = 0; tick <= 2 * half; tick++) {
        const double t_s = 1e-3 * ((double)tick - (double)half);
        hexload_leg_sample_t sample = {.tick = 100 + tick};
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            sample.displacement_m[leg] = (hexload_real_t)displacement_of_leg(leg, t_s);
            sample.force_n[leg] = (hexload_real_t)speed_of_leg(leg, t_s);
        }
        TEST_ASSERT_FALSE(has_come);
        has_come = hexload_differentiator_step(&differentiator, &config, &sample, tick > 0, &middle);
    }
    // THEN speeds and forces of its middle are the same, and those of first degree the true ones
    TEST_ASSERT_TRUE(has_come);
    TEST_ASSERT_EQUAL_UINT32(100 + half, middle.tick);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        // twelve differences of displacements up to 8 mm, over 1 ms
        const double rounding = ROUNDINGS(24, 8e-3 / 1e-3 + 2.5);
        TEST_ASSERT_DOUBLE_WITHIN(rounding, (double)middle.force_n[leg], (double)middle.velocity_m_s[leg]);
    }
    TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(24, 8.0), 0.1, (double)middle.velocity_m_s[0]);
    TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(24, 8.0), 0.0, (double)middle.velocity_m_s[1]);
}

/// Weights of 2 half + 1 ticks by their equations: of a speed the line's slope; of the others a - c j^2 with
/// the sum 1 and the second moment S4 / (3 S2).
static void weights_of(int half, double tick_s, double* slope, double* share) {
    double n = 0.0, squares = 0.0, fourths = 0.0;
    for (int j = -half; j <= half; j++) {
        n += 1.0;
        squares += j * j;
        fourths += (double)(j * j) * (j * j);
    }
    const double moment = fourths / squares / 3.0;
    const double determinant = n * fourths - squares * squares;
    const double a = (fourths - squares * moment) / determinant;
    const double c = (squares - n * moment) / determinant;
    for (int j = -half; j <= half; j++) {
        slope[j + half] = j / (squares * tick_s);
        share[j + half] = a - c * j * j;
    }
}

static void test_a_window_gives_what_its_weights_make_of_it(void) {
    // GIVEN random displacements and forces, one leg that stands, and up to four samples missing
    enum { TICKS = 300, MOST = 2 * HEXLOAD_HALF_WINDOW_TICKS_MAX + 1 };
    static double displacement_m[TICKS][6], force_n[TICKS][6];
    static const uint32_t halves[] = {2, 3, 6, HEXLOAD_HALF_WINDOW_TICKS_MAX};
    uint64_t seed = 21;
    for (int size = 0; size < 4; size++) {
        hexload_config_t config = paper_machine();
        hexload_differentiator_t differentiator;
        hexload_leg_sample_t middle;
        double slope[MOST], share[MOST];
        const uint32_t half = halves[size];
        config.sensors.half_window_ticks = half;
        weights_of((int)half, (double)config.tick_s, slope, share);
        memset(&differentiator, 0xff, sizeof differentiator); // of an instance that was in use
        hexload_differentiator_init(&differentiator);
        for (uint32_t tick = 0, gap = 0; tick < TICKS; tick += gap) {
            hexload_leg_sample_t sample = {.tick = 1000 + tick};
            for (int leg = 0; leg < 6; leg++) {
                sample.displacement_m[leg] = (hexload_real_t)(leg == 4 ? 0.1 : 0.2 * uniform(&seed));
                sample.force_n[leg] = (hexload_real_t)(leg == 4 ? 700.0 : 2000.0 * uniform(&seed));
                for (uint32_t k = 0; k < (tick == 0 ? 1 : gap); k++) { // lines over a gap
                    const double part = tick == 0 ? 0.0 : (double)k / gap;
                    const uint32_t last = tick - gap;
                    displacement_m[tick - k][leg] =
                        (1.0 - part) * (double)sample.displacement_m[leg] + part * displacement_m[last][leg];
                    force_n[tick - k][leg] =
                        (1.0 - part) * (double)sample.force_n[leg] + part * force_n[last][leg];
                }
            }
            // WHEN samples come THEN those of a whole window give the sums of its ticks times their weights
            TEST_ASSERT_EQUAL_INT(tick >= 2 * half, hexload_differentiator_step(&differentiator, &config,
                                                                                &sample, gap, &middle));
            for (int leg = 0; leg < 6 && tick >= 2 * half; leg++) {
                double speed = 0.0, way = 0.0, force = 0.0;
                for (uint32_t j = 0; j <= 2 * half; j++) {
                    speed += slope[j] * displacement_m[tick - 2 * half + j][leg];
                    way += share[j] * displacement_m[tick - 2 * half + j][leg];
                    force += share[j] * force_n[tick - 2 * half + j][leg];
                }
                // each product errs by a rounding of 0.4 m, or 4 kN, and there are fewer than 40; the slopes
                // are 0.2 / tick at most and lines one rounding more
                TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(40, 0.4 * 0.2 / 1e-3), speed,
                                          (double)middle.velocity_m_s[leg]);
                TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(40, 0.4), way, (double)middle.displacement_m[leg]);
                TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(40, 4000.0), force, (double)middle.force_n[leg]);
            }
            if (tick >= 2 * half) {
                TEST_ASSERT_EQUAL_UINT32(1000 + tick - half, middle.tick);
                TEST_ASSERT_TRUE(middle.velocity_m_s[4] == HEXLOAD_REAL(0.0));
            }
            TEST_ASSERT_EQUAL_INT(tick >= 2 * half, differentiator.has_begun);
            gap = tick == 0 || uniform(&seed) > 0.7 ? 1 + (uint32_t)(4.999 * fabs(uniform(&seed))) : 1;
        }
        TEST_ASSERT_EQUAL_UINT32(HEXLOAD_DIFFERENTIATOR_TICKS, differentiator.stored); // as many as it has
    }
}

static void test_noise_of_the_speeds_is_as_configured(void) {
    // GIVEN legs at rest under white noise of 20 um
    const hexload_config_t config = without_velocity(HEXLOAD_KIND_MOMENTUM);
    hexload_differentiator_t differentiator;
    hexload_leg_sample_t middle;
    uint64_t seed = 3;
    double sum = 0.0;
    int count = 0;
    hexload_differentiator_init(&differentiator);
    for (uint32_t tick = 0; tick < 20000; tick++) {
        hexload_leg_sample_t sample = {.tick = tick};
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            sample.displacement_m[leg] = config.sensors.displacement_sigma_m * (hexload_real_t)normal(&seed);
        }
        if (hexload_differentiator_step(&differentiator, &config, &sample, tick > 0, &middle)) {
            for (int leg = 0; leg < HEXLOAD_LEGS; leg++, count++) {
                sum += (double)middle.velocity_m_s[leg] * (double)middle.velocity_m_s[leg];
            }
        }
    }
    // THEN the speeds have the configured sigma; one in some nine of 120,000 is independent: 0.6 %
    const double sigma_m_s = (double)config.sensors.velocity_sigma_m_s;
    TEST_ASSERT_DOUBLE_WITHIN(4.0 * 0.006 * sigma_m_s, sigma_m_s, sqrt(sum / count));
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 20e-6 / 1e-3 / sqrt(182.0), sigma_m_s); // 2 (1 + 4 + .. + 36)
}

static void test_noise_of_the_speeds_is_hardly_ever_followed(void) {
    // GIVEN legs at rest, and the smoother behind
    const hexload_config_t config = without_velocity(HEXLOAD_KIND_MOMENTUM);
    hexload_differentiator_t differentiator;
    hexload_smoother_t smoother;
    hexload_smooth_sample_t past;
    hexload_leg_sample_t middle;
    uint64_t seed = 9;
    int followed = 0;
    hexload_differentiator_init(&differentiator);
    hexload_smoother_init(&smoother, &config);
    // WHEN 4,000 speeds are asked for
    for (uint32_t tick = 0; tick < 4200; tick++) {
        hexload_leg_sample_t sample = {.tick = tick};
        hexload_real_t largest_m_s = HEXLOAD_REAL(0.0);
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            sample.displacement_m[leg] = config.sensors.displacement_sigma_m * (hexload_real_t)normal(&seed);
        }
        if (!hexload_differentiator_step(&differentiator, &config, &sample, tick > 0, &middle)) {
            continue;
        }
        const hexload_present_tick_t now = {.sample = &middle, .sensors = config.sensors, .gap_ticks = 1};
        (void)hexload_smoother_put(&smoother, &config, &now);
        if (hexload_smoother_take(&smoother, &config.sensors, &past)) {
            for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
                largest_m_s = hexload_max(largest_m_s, hexload_abs(past.smooth_velocity_m_s[leg]));
            }
        }
        followed += largest_m_s > HEXLOAD_REAL(0.2) * config.sensors.velocity_sigma_m_s;
    }
    // THEN at most one in a hundred lets something through: 0.1 % of windows, each 30 ticks long
    TEST_ASSERT_LESS_THAN_INT(40, followed);
}

/// Runs `ticks` of the motion. Returns how many load changes are reported; none may call the noise misstated.
static uint32_t run(const hexload_config_t* config, const body_t* load, uint32_t ticks,
                    hexload_estimate_t* estimate) {
    static hexload_t estimator;
    uint64_t seed = 5;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_init(&estimator, config));
    for (uint32_t tick = 0; tick < ticks; tick++) {
        const hexload_leg_sample_t sample = sample_at(load, tick, &seed);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_tick(&estimator, config, &sample, estimate));
        TEST_ASSERT_EQUAL_UINT32(tick, estimate->tick);
    }
    TEST_ASSERT_EQUAL_UINT32(0, hexload_health(&estimator)->count[HEXLOAD_HEALTH_NOISE_MISSTATED]);
    return hexload_health(&estimator)->count[HEXLOAD_HEALTH_LOAD_CHANGED];
}

static void test_every_kind_finds_the_load_without_velocity_sensors(void) {
    static const hexload_kind_t kinds[HEXLOAD_KINDS] = {HEXLOAD_KIND_PAPER, HEXLOAD_KIND_MOMENTUM,
                                                        HEXLOAD_KIND_MOMENTUM_EFFECTS};
    for (int n = 0; n < HEXLOAD_KINDS; n++) {
        // GIVEN six seconds of a motion, noise, and velocities that are not numbers
        const bool is_paper = kinds[n] == HEXLOAD_KIND_PAPER;
        const hexload_config_t config = without_velocity(kinds[n]);
        const body_t* load = is_paper ? &on_axis : &eccentric;
        hexload_estimate_t estimate;
        double truth[10];
        theta_of(load, truth);
        if (is_paper) {
            truth[0] = load->com_m[2];
            memcpy(&truth[1], load->inertia_com_kg_m2, 3 * sizeof truth[0]);
        }
        // WHEN the estimator has run over it THEN every parameter is within five of its sigmas
        TEST_ASSERT_EQUAL_UINT32(0, run(&config, load, 6000, &estimate));
        TEST_ASSERT_EQUAL_INT(HEXLOAD_VERDICT_CONVERGED, estimate.verdict);
        for (uint32_t k = 0; k < hexload_describe(kinds[n])->parameters; k++) {
            TEST_ASSERT_DOUBLE_WITHIN(5.0 * (double)estimate.sigma[k], truth[k], (double)estimate.value[k]);
        }
    }
}

static void test_velocities_are_ignored_to_the_bit(void) {
    const hexload_config_t config = without_velocity(HEXLOAD_KIND_MOMENTUM);
    static hexload_t without, with;
    hexload_estimate_t estimate[2];
    uint64_t seed = 5;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_init(&without, &config));
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_init(&with, &config));
    for (uint32_t tick = 0; tick < 500; tick++) {
        hexload_leg_sample_t sample = sample_at(&eccentric, tick, &seed);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_tick(&without, &config, &sample, &estimate[0]));
        memset(sample.velocity_m_s, 0, sizeof sample.velocity_m_s);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_tick(&with, &config, &sample, &estimate[1]));
        TEST_ASSERT_EQUAL_MEMORY(estimate[0].value, estimate[1].value, sizeof estimate[0].value);
        TEST_ASSERT_EQUAL_MEMORY(estimate[0].sigma, estimate[1].sigma, sizeof estimate[0].sigma);
    }
}

static void test_the_prior_is_read_until_a_window_is_complete(void) {
    const hexload_config_t config = without_velocity(HEXLOAD_KIND_MOMENTUM);
    hexload_estimate_t estimate, prior;
    static hexload_t estimator;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_init(&estimator, &config));
    hexload_read(&estimator, &prior);
    memset(&estimate, 0xff, sizeof estimate);
    run(&config, &eccentric, 2 * config.sensors.half_window_ticks, &estimate);
    TEST_ASSERT_EQUAL_MEMORY(prior.value, estimate.value, sizeof prior.value);
    TEST_ASSERT_EQUAL_MEMORY(prior.sigma, estimate.sigma, sizeof prior.sigma);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_VERDICT_NOT_EXCITED, estimate.verdict);
}

static void test_a_trace_before_a_window_is_complete_has_no_measurement(void) {
    const hexload_config_t config = without_velocity(HEXLOAD_KIND_PAPER);
    const uint32_t half = config.sensors.half_window_ticks;
    static hexload_t estimator;
    hexload_estimate_t estimate;
    hexload_trace_t trace;
    uint64_t seed = 5;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_init(&estimator, &config));
    for (uint32_t tick = 0; tick < 2 * half + 2; tick++) {
        const hexload_leg_sample_t sample = sample_at(&on_axis, tick, &seed);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_trace(&estimator, &config, &sample, &estimate, &trace));
        TEST_ASSERT_EQUAL_UINT32(3, trace.dimension);
        TEST_ASSERT_EQUAL_UINT32(tick, estimate.tick);
        TEST_ASSERT_EQUAL_INT(tick <= 2 * half ? HEXLOAD_GATE_NONE : HEXLOAD_GATE_ACCEPTED, trace.gate);
    }
    TEST_ASSERT_EQUAL_UINT32(half + 1, trace.tick); // of the measurement
}

static void test_samples_are_refused_and_counted_as_with_velocity_sensors(void) {
    static const hexload_kind_t kinds[HEXLOAD_KINDS] = {HEXLOAD_KIND_PAPER, HEXLOAD_KIND_MOMENTUM,
                                                        HEXLOAD_KIND_MOMENTUM_EFFECTS};
    for (int n = 0; n < HEXLOAD_KINDS; n++) {
        // GIVEN an estimator that has seen 200 samples
        const hexload_config_t config = without_velocity(kinds[n]);
        static hexload_t estimator;
        hexload_estimate_t estimate;
        uint64_t seed = 5;
        TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_init(&estimator, &config));
        for (uint32_t tick = 0; tick < 200; tick++) {
            const hexload_leg_sample_t sample = sample_at(&on_axis, tick, &seed);
            TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_tick(&estimator, &config, &sample, &estimate));
        }
        const hexload_estimate_t before = estimate;
        // WHEN samples come that are wrong, late or twice
        hexload_leg_sample_t twice = sample_at(&on_axis, 199, &seed), late = sample_at(&on_axis, 7, &seed);
        hexload_leg_sample_t broken = sample_at(&on_axis, 200, &seed), jump = broken, hollow = broken;
        broken.displacement_m[3] = (hexload_real_t)NAN;
        hollow.force_n[1] = (hexload_real_t)INFINITY;
        jump.displacement_m[0] += HEXLOAD_REAL(0.05);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_ERR_TICK, hexload_tick(&estimator, &config, &twice, &estimate));
        TEST_ASSERT_EQUAL_INT(HEXLOAD_ERR_TICK, hexload_tick(&estimator, &config, &late, &estimate));
        TEST_ASSERT_EQUAL_INT(HEXLOAD_ERR_SAMPLE, hexload_tick(&estimator, &config, &broken, &estimate));
        TEST_ASSERT_EQUAL_INT(HEXLOAD_ERR_SAMPLE, hexload_tick(&estimator, &config, &hollow, &estimate));
        TEST_ASSERT_EQUAL_INT(HEXLOAD_ERR_SAMPLE, hexload_tick(&estimator, &config, &jump, &estimate));
        // THEN they are counted and change nothing else
        TEST_ASSERT_EQUAL_UINT32(5, hexload_health(&estimator)->refused);
        TEST_ASSERT_EQUAL_MEMORY(&before, &estimate, sizeof before);
    }
}

/// Samples that come out of `ticks`, of which those from 100 on are missing.
static uint32_t come_out_with_gap(uint32_t missing, double* worst_m_s) {
    const hexload_config_t config = without_velocity(HEXLOAD_KIND_MOMENTUM);
    const hexload_config_t sensors = paper_machine();
    const motion_t motion = random_motion(7, 0.05, 0.1);
    hexload_differentiator_t differentiator;
    hexload_leg_sample_t middle;
    uint32_t out = 0;
    *worst_m_s = 0.0;
    hexload_differentiator_init(&differentiator);
    for (uint32_t tick = 0; tick < 200; tick++) {
        if (tick >= 100 && tick < 100 + missing) {
            continue;
        }
        const uint32_t gap = tick == 0 ? 0 : tick == 100 + missing ? missing + 1 : 1;
        const hexload_leg_sample_t sample = perfect_sample(&sensors, &eccentric, &motion, 0.7982755, tick);
        if (hexload_differentiator_step(&differentiator, &config, &sample, gap, &middle)) {
            const hexload_leg_sample_t then =
                perfect_sample(&sensors, &eccentric, &motion, 0.7982755, middle.tick);
            out++;
            for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
                const double off = (double)(middle.velocity_m_s[leg] - then.velocity_m_s[leg]);
                *worst_m_s = fmax(*worst_m_s, fabs(off));
            }
        }
    }
    return out;
}

static void test_four_missing_samples_are_bridged_and_more_begin_anew(void) {
    double without_gap_m_s, bridged_m_s, anew_m_s;
    const uint32_t whole = come_out_with_gap(0, &without_gap_m_s);
    TEST_ASSERT_EQUAL_UINT32(200 - 12, whole);
    // a line over 5 ms is off by 3 um / (m/s^2) at its middle: 12 um at 4 m/s^2, on a few of 13 ticks
    TEST_ASSERT_EQUAL_UINT32(whole - 4, come_out_with_gap(4, &bridged_m_s));
    TEST_ASSERT_TRUE(bridged_m_s < without_gap_m_s + 12e-6 * 18.0 / (182.0 * 1e-3));
    TEST_ASSERT_EQUAL_UINT32(whole - 5 - 12, come_out_with_gap(5, &anew_m_s));
    TEST_ASSERT_TRUE(anew_m_s <= without_gap_m_s);
}

static void test_a_load_that_drops_is_detected_within_20_ms(void) {
    // GIVEN an estimator that knows its load WHEN the load drops
    const hexload_config_t config = without_velocity(HEXLOAD_KIND_MOMENTUM);
    static const body_t none = {0};
    static hexload_t estimator;
    hexload_estimate_t estimate;
    uint64_t seed = 5;
    uint32_t detected = 0;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_init(&estimator, &config));
    for (uint32_t tick = 0; tick < 3500; tick++) {
        const hexload_leg_sample_t sample = sample_at(tick < 3000 ? &eccentric : &none, tick, &seed);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_tick(&estimator, &config, &sample, &estimate));
        if ((hexload_health(&estimator)->bits >> HEXLOAD_HEALTH_LOAD_CHANGED & 1u) != 0) {
            detected = tick;
        }
    }
    // THEN that is said once and soon
    TEST_ASSERT_EQUAL_UINT32(1, hexload_health(&estimator)->count[HEXLOAD_HEALTH_LOAD_CHANGED]);
    TEST_ASSERT_TRUE(detected >= 3000 && detected <= 3020);
}

static void test_noise_that_is_misstated_is_measured_before_the_filter(void) {
    // GIVEN sensors whose displacements are five times as noisy as stated
    hexload_config_t config = without_velocity(HEXLOAD_KIND_MOMENTUM);
    config.sensors.displacement_sigma_m = HEXLOAD_REAL(4e-6);
    hexload_config_set_no_velocity(&config);
    static hexload_t estimator;
    hexload_estimate_t estimate;
    uint64_t seed = 5;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_init(&estimator, &config));
    // WHEN a second has gone by
    for (uint32_t tick = 0; tick < 1000; tick++) {
        const hexload_leg_sample_t sample = sample_at(&eccentric, tick, &seed);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_tick(&estimator, &config, &sample, &estimate));
    }
    // THEN that is said, and innovations are no larger than noise makes them
    TEST_ASSERT_TRUE((hexload_health(&estimator)->bits >> HEXLOAD_HEALTH_NOISE_MISSTATED & 1u) != 0);
    TEST_ASSERT_TRUE(estimate.nis_mean < HEXLOAD_REAL(9.0));
}

static void test_the_window_goes_with_the_sampling_period(void) {
    hexload_config_t config = paper_machine();
    static const double tick_s[] = {1e-4, 5e-4, 1e-3, 6e-3 / 4.6, 6e-3 / 4.4, 2e-3, 5e-3};
    static const uint32_t half[] = {HEXLOAD_HALF_WINDOW_TICKS_MAX, 12, 6, 5, 4, 3, 2};
    for (int n = 0; n < 7; n++) {
        config.tick_s = (hexload_real_t)tick_s[n];
        hexload_config_set_no_velocity(&config);
        TEST_ASSERT_EQUAL_UINT32(half[n], config.sensors.half_window_ticks);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_config_check(&config, NULL));
    }
    const char* bad_field = NULL;
    config.sensors.half_window_ticks = 1;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_ERR_CONFIG, hexload_config_check(&config, &bad_field));
    TEST_ASSERT_EQUAL_STRING("sensors.half_window_ticks", bad_field);
    config.sensors.half_window_ticks = HEXLOAD_HALF_WINDOW_TICKS_MAX + 1;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_ERR_CONFIG, hexload_config_check(&config, &bad_field));
}

static void test_after_a_long_gap_the_estimate_stays_for_a_window(void) {
    // GIVEN an estimator that has seen 200 samples WHEN five are missing
    const hexload_config_t config = without_velocity(HEXLOAD_KIND_MOMENTUM);
    static hexload_t estimator;
    hexload_estimate_t estimate, before = {0};
    uint64_t seed = 5;
    uint32_t same = 0;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_init(&estimator, &config));
    for (uint32_t tick = 0; tick < 300; tick++) {
        const hexload_leg_sample_t sample = sample_at(&eccentric, tick, &seed);
        if (tick >= 200 && tick < 205) {
            continue;
        }
        TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_tick(&estimator, &config, &sample, &estimate));
        // THEN for a window of 13 ticks less its last one nothing changes but the tick
        TEST_ASSERT_EQUAL_UINT32(tick, estimate.tick);
        if (tick >= 205 && memcmp(before.value, estimate.value, sizeof before.value) == 0) {
            TEST_ASSERT_EQUAL_MEMORY(before.sigma, estimate.sigma, sizeof before.sigma);
            same++;
        }
        before = estimate;
    }
    TEST_ASSERT_GREATER_OR_EQUAL_UINT32(12, same);
}

static void test_a_lost_force_is_said_for_as_long_as_a_window_has_it(void) {
    static const hexload_kind_t kinds[2] = {HEXLOAD_KIND_PAPER, HEXLOAD_KIND_MOMENTUM};
    for (int n = 0; n < 2; n++) {
        // GIVEN a force that is missing at 20 ticks
        const hexload_config_t config = without_velocity(kinds[n]);
        const uint32_t bit = 1u << HEXLOAD_HEALTH_CHANNEL_LOST;
        static hexload_t estimator;
        hexload_estimate_t estimate;
        uint64_t seed = 5;
        TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_init(&estimator, &config));
        for (uint32_t tick = 0; tick < 400; tick++) {
            hexload_leg_sample_t sample = sample_at(&on_axis, tick, &seed);
            sample.force_n[2] = tick >= 200 && tick < 220 ? (hexload_real_t)NAN : sample.force_n[2];
            // WHEN they come THEN none is refused, and it is said at these and for a window of 12 more
            TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_tick(&estimator, &config, &sample, &estimate));
            const bool is_said = (hexload_health(&estimator)->bits & bit) != 0;
            TEST_ASSERT_EQUAL(tick >= 200 && tick < 220 + 12, is_said);
        }
        // AND a guess that is missing before a first window is complete is said too
        TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_init(&estimator, &config));
        hexload_leg_sample_t first = sample_at(&on_axis, 0, &seed);
        first.force_n[2] = (hexload_real_t)NAN;
        TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_tick(&estimator, &config, &first, &estimate));
        TEST_ASSERT_BITS_HIGH(bit, hexload_health(&estimator)->bits);
    }
}

static void test_legs_without_a_pose_are_refused_half_a_window_later(void) {
    for (int traced = 0; traced < 2; traced++) {
        // GIVEN one leg 0.8 m longer than all others, which no pose has
        hexload_config_t config = without_velocity(HEXLOAD_KIND_MOMENTUM);
        static hexload_t estimator;
        hexload_estimate_t estimate;
        hexload_trace_t trace;
        TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_init(&estimator, &config));
        for (uint32_t tick = 0; tick < 20; tick++) {
            hexload_leg_sample_t sample = {.tick = tick};
            sample.displacement_m[0] = HEXLOAD_REAL(0.8);
            // WHEN such samples come THEN nothing is known of it until a window of 13 is complete
            const hexload_status_t status =
                traced == 1 ? hexload_trace(&estimator, &config, &sample, &estimate, &trace)
                            : hexload_tick(&estimator, &config, &sample, &estimate);
            TEST_ASSERT_EQUAL(tick < 12, status == HEXLOAD_OK);
        }
        TEST_ASSERT_EQUAL_UINT32(8, hexload_health(&estimator)->refused);
        TEST_ASSERT_EQUAL_UINT32(11, estimate.tick);
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_speed_and_force_pass_the_same_filter);
    RUN_TEST(test_a_window_gives_what_its_weights_make_of_it);
    RUN_TEST(test_noise_of_the_speeds_is_as_configured);
    RUN_TEST(test_noise_of_the_speeds_is_hardly_ever_followed);
    RUN_TEST(test_every_kind_finds_the_load_without_velocity_sensors);
    RUN_TEST(test_velocities_are_ignored_to_the_bit);
    RUN_TEST(test_the_prior_is_read_until_a_window_is_complete);
    RUN_TEST(test_a_trace_before_a_window_is_complete_has_no_measurement);
    RUN_TEST(test_samples_are_refused_and_counted_as_with_velocity_sensors);
    RUN_TEST(test_four_missing_samples_are_bridged_and_more_begin_anew);
    RUN_TEST(test_a_load_that_drops_is_detected_within_20_ms);
    RUN_TEST(test_noise_that_is_misstated_is_measured_before_the_filter);
    RUN_TEST(test_the_window_goes_with_the_sampling_period);
    RUN_TEST(test_after_a_long_gap_the_estimate_stays_for_a_window);
    RUN_TEST(test_a_lost_force_is_said_for_as_long_as_a_window_has_it);
    RUN_TEST(test_legs_without_a_pose_are_refused_half_a_window_later);
    return UNITY_END();
}
