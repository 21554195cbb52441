#include "hexload/hexload.h"
#include "front_end/kinematics.h"
#include "momentum_tick.h"
#include "motion.h"

#include <math.h>
#include <string.h>

void setUp(void) {}
void tearDown(void) {}

static const body_t eccentric = {312.0, {-0.09, 0.13, 0.27}, {17.0, 21.0, 12.0, 2.0, -1.0, 1.5}};
static const body_t on_axis = {
    500.0, {0.0, 0.0, 0.27}, {17.0, 21.0, 12.0, 0.0, 0.0, 0.0}}; // the paper's kind
static const hexload_kind_t kinds[HEXLOAD_KINDS] = {HEXLOAD_KIND_PAPER, HEXLOAD_KIND_MOMENTUM,
                                                    HEXLOAD_KIND_MOMENTUM_EFFECTS};

static hexload_config_t config_of(hexload_kind_t kind) {
    hexload_config_t config = paper_machine();
    config.kind = kind;
    return config;
}

/// A sample of a random motion with the stated noise.
static hexload_leg_sample_t sample_at(const hexload_config_t* config, uint32_t tick, uint64_t* seed) {
    const motion_t motion = random_motion(7, 0.05, 0.1);
    hexload_kinematics_t kinematics;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_kinematics_init(&kinematics, config));
    const body_t* load = config->kind == HEXLOAD_KIND_PAPER ? &on_axis : &eccentric;
    hexload_leg_sample_t sample =
        perfect_sample(config, load, &motion, (double)kinematics.home_height_m, tick);
    add_noise(config, seed, &sample);
    return sample;
}

static void test_every_kind_is_described_by_names_and_units(void) {
    static const uint32_t parameters[HEXLOAD_KINDS] = {4, 10, 10};
    static const uint32_t effects[HEXLOAD_KINDS] = {0, 0, 20};
    static const uint32_t measurements[HEXLOAD_KINDS] = {3, 6, 6};
    static const char* const names[HEXLOAD_KINDS] = {"paper", "momentum", "momentum_effects"};
    for (int n = 0; n < HEXLOAD_KINDS; n++) {
        const hexload_descriptor_t* descriptor = hexload_describe(kinds[n]);
        TEST_ASSERT_EQUAL_STRING(names[n], descriptor->name);
        TEST_ASSERT_EQUAL_UINT32(parameters[n], descriptor->parameters);
        TEST_ASSERT_EQUAL_UINT32(effects[n], descriptor->effects);
        TEST_ASSERT_EQUAL_UINT32(measurements[n], descriptor->measurements);
        for (uint32_t k = 0; k < parameters[n] + effects[n]; k++) {
            TEST_ASSERT_TRUE(strlen(descriptor->unknown[k].name) > 0);
            TEST_ASSERT_TRUE(strlen(descriptor->unknown[k].unit) > 0);
        }
    }
    TEST_ASSERT_EQUAL_STRING("kg", hexload_describe(HEXLOAD_KIND_MOMENTUM)->unknown[HEXLOAD_LOAD_M].unit);
    TEST_ASSERT_EQUAL_STRING("viscous6", hexload_describe(HEXLOAD_KIND_MOMENTUM_EFFECTS)->unknown[27].name);
    TEST_ASSERT_NULL(hexload_describe(HEXLOAD_KINDS));
}

static void test_a_kind_that_there_is_not_is_refused_and_named(void) {
    hexload_config_t config = config_of(HEXLOAD_KINDS);
    const char* bad_field = NULL;
    static hexload_t estimator;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_ERR_CONFIG, hexload_init(&estimator, &config));
    TEST_ASSERT_EQUAL_INT(HEXLOAD_ERR_CONFIG, hexload_config_check(&config, &bad_field));
    TEST_ASSERT_EQUAL_STRING("kind", bad_field);
}

static void test_before_the_first_sample_the_prior_is_read(void) {
    for (int n = 0; n < HEXLOAD_KINDS; n++) {
        const hexload_config_t config = config_of(kinds[n]);
        static hexload_t estimator;
        hexload_estimate_t estimate;
        hexload_real_t covariance[HEXLOAD_COVARIANCES_MAX];
        TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_init(&estimator, &config));
        hexload_read(&estimator, &estimate);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_VERDICT_NOT_EXCITED, estimate.verdict);
        TEST_ASSERT_EQUAL_UINT32(0, hexload_health(&estimator)->refused);
        // the covariance is diagonal, with the sigmas that are read, and as long as the unknowns say
        const hexload_descriptor_t* descriptor = hexload_describe(kinds[n]);
        const uint32_t unknowns = descriptor->parameters + descriptor->effects;
        TEST_ASSERT_EQUAL_UINT32(unknowns * (unknowns + 1) / 2, hexload_covariance(&estimator, covariance));
        for (uint32_t i = 0, entry = 0; i < unknowns; i++) {
            for (uint32_t j = 0; j <= i; j++, entry++) {
                if (i != j) {
                    TEST_ASSERT_TRUE(covariance[entry] == HEXLOAD_REAL(0.0));
                } else if (i < descriptor->parameters) {
                    const double sigma = (double)estimate.sigma[i];
                    TEST_ASSERT_DOUBLE_WITHIN(1e-6 * sigma * sigma, sigma * sigma, (double)covariance[entry]);
                }
            }
        }
    }
}

static const hexload_residual_test_t* residual_test_of(const hexload_t* estimator) {
    switch (estimator->kind) {
    case HEXLOAD_KIND_PAPER:
        return &estimator->as.paper.residual_test;
    case HEXLOAD_KIND_MOMENTUM:
        return &estimator->as.momentum.residual_test;
    default:
        return &estimator->as.momentum_effects.momentum.residual_test;
    }
}

/// 1,500 ticks of motion through the interface, with a trace of each, and through the estimator itself.
static void run_traced(hexload_kind_t kind, double* innovation_ratio, double* nis_mean) {
    const hexload_config_t config = config_of(kind);
    const uint32_t dimension = hexload_describe(kind)->measurements;
    static hexload_t traced, plain;
    hexload_estimate_t estimate, expected;
    hexload_trace_t trace;
    uint64_t seed = 3;
    uint32_t updates = 0;
    *innovation_ratio = 0.0;
    *nis_mean = 0.0;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_init(&traced, &config));
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_init(&plain, &config));
    for (uint32_t tick = 0; tick < 1500; tick++) {
        const hexload_leg_sample_t sample = sample_at(&config, tick, &seed);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_tick(&plain, &config, &sample, &expected));
        TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_trace(&traced, &config, &sample, &estimate, &trace));
        TEST_ASSERT_EQUAL_MEMORY(expected.value, estimate.value, sizeof estimate.value);
        TEST_ASSERT_EQUAL_UINT32(dimension, trace.dimension);
        TEST_ASSERT_EQUAL_DOUBLE((double)residual_test_of(&traced)->nis, (double)trace.sum_nis);
        TEST_ASSERT_EQUAL_DOUBLE((double)residual_test_of(&traced)->nis_mean, (double)trace.sum_nis_mean);
        if (trace.gate == HEXLOAD_GATE_ACCEPTED && tick >= 1000) {
            updates++;
            *nis_mean += (double)trace.nis;
            for (uint32_t k = 0; k < dimension; k++) {
                const double e = (double)trace.innovation[k];
                *innovation_ratio += e * e / (double)trace.variance[k] / (double)dimension;
            }
        }
    }
    TEST_ASSERT_TRUE(updates > 450);
    TEST_ASSERT_TRUE(trace.sum_nis !=
                     (hexload_real_t)dimension); // the ideal, before half a second has gone by
    *innovation_ratio /= updates;
    *nis_mean /= updates;
}

static void test_a_traced_innovation_is_the_factor_times_the_whitened_one(void) {
    // GIVEN a filter's update, which has L with its diagonal inverted, and L^-1 e WHEN the same sample is
    // traced THEN the trace has e = L L^-1 e, and the diagonal of L L^T; without an update it says that there
    // was none
    const hexload_config_t config = config_of(HEXLOAD_KIND_MOMENTUM);
    static hexload_t traced;
    static hexload_momentum_t plain;
    hexload_estimate_t estimate;
    hexload_trace_t trace;
    uint64_t seed = 4;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_init(&traced, &config));
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_momentum_init(&plain, &config));
    for (uint32_t tick = 0; tick < 300; tick++) {
        const hexload_leg_sample_t sample = sample_at(&config, tick, &seed);
        hexload_momentum_update_t update = {.L = {{HEXLOAD_REAL(0.0)}}};
        TEST_ASSERT_EQUAL_INT(HEXLOAD_OK,
                              hexload_momentum_run(&plain, &config, NULL, &sample, &estimate, &update));
        TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_trace(&traced, &config, &sample, &estimate, &trace));
        TEST_ASSERT_EQUAL_INT(update.L[0][0] == HEXLOAD_REAL(0.0) ? HEXLOAD_GATE_NONE : HEXLOAD_GATE_ACCEPTED,
                              trace.gate);
        for (int i = 0; i < 6 && tick > 200 && trace.gate == HEXLOAD_GATE_ACCEPTED; i++) {
            double e = 0.0, variance = 0.0, size = 0.0;
            for (int k = 0; k <= i; k++) {
                const double L = k == i ? 1.0 / (double)update.L[i][i] : (double)update.L[i][k];
                e += L * (double)update.innovation[k];
                size += fabs(L * (double)update.innovation[k]);
                variance += L * L;
            }
            TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(10, size), e, (double)trace.innovation[i]);
            TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(10, variance), variance, (double)trace.variance[i]);
        }
    }
}

static void test_momentum_goes_on_over_three_ticks_and_begins_anew_after_four(void) {
    // GIVEN a smoother that bridges ten ticks WHEN a sample comes three ticks after the one before, or four
    // THEN every tick after it has an update, or one has none
    for (uint32_t gap_ticks = 3; gap_ticks <= 4; gap_ticks++) {
        hexload_config_t config = config_of(HEXLOAD_KIND_MOMENTUM);
        static hexload_t traced;
        hexload_estimate_t estimate;
        hexload_trace_t trace;
        uint64_t seed = 4;
        uint32_t without = 0;
        config.momentum.longest_gap_ticks = 10;
        TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_init(&traced, &config));
        for (uint32_t n = 0; n < 600; n++) {
            const hexload_leg_sample_t sample = sample_at(&config, n < 300 ? n : n - 1 + gap_ticks, &seed);
            TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_trace(&traced, &config, &sample, &estimate, &trace));
            without += n >= 300 && trace.gate == HEXLOAD_GATE_NONE ? 1 : 0;
        }
        TEST_ASSERT_EQUAL_UINT32(gap_ticks - 3, without);
    }
}

static void test_a_trace_leaves_the_estimate_and_its_innovations_have_the_variance_it_gives(void) {
    // GIVEN samples with the stated noise WHEN they are traced THEN estimates are those of a tick without,
    // the sums of half a second are those of the residual test, and squares of innovations over their
    // variances have a mean of 1. The mean of 500 ticks of six (three) correlated chi-squares has a sigma of
    // at most sqrt(2 / 500) = 0.063; four of them are allowed
    for (int n = 0; n < HEXLOAD_KINDS; n++) {
        const double dimension = (double)hexload_describe(kinds[n])->measurements;
        double ratio, nis;
        run_traced(kinds[n], &ratio, &nis);
        TEST_ASSERT_DOUBLE_WITHIN(0.25, 1.0, ratio);
        TEST_ASSERT_DOUBLE_WITHIN(0.25 * dimension, dimension, nis);
    }
}

static void test_a_gated_innovation_of_the_papers_estimator_is_traced_as_rejected(void) {
    const hexload_config_t config = config_of(HEXLOAD_KIND_PAPER);
    static hexload_t estimator;
    hexload_estimate_t estimate;
    hexload_trace_t trace;
    const hexload_leg_sample_t still = {.tick = 0};
    hexload_leg_sample_t next = {.tick = 1};
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_init(&estimator, &config));
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_trace(&estimator, &config, &still, &estimate, &trace));
    TEST_ASSERT_EQUAL_INT(HEXLOAD_GATE_NONE, trace.gate);
    // WHEN a leg's speed is wrong by 400 of its sigmas THEN the update is rejected, and the trace says by
    // what
    next.velocity_m_s[0] = HEXLOAD_REAL(0.4);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_trace(&estimator, &config, &next, &estimate, &trace));
    TEST_ASSERT_EQUAL_INT(HEXLOAD_GATE_REJECTED, trace.gate);
    TEST_ASSERT_TRUE(trace.nis > config.paper.gate_nis);
    // WHEN a sample is refused THEN the trace stays as it was
    const hexload_trace_t before = trace;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_ERR_TICK, hexload_trace(&estimator, &config, &next, &estimate, &trace));
    TEST_ASSERT_EQUAL_MEMORY(&before, &trace, sizeof trace);
    TEST_ASSERT_EQUAL_UINT32(1, hexload_health(&estimator)->refused);
}

static void test_only_the_estimator_of_actuator_effects_has_effects(void) {
    hexload_estimate_t estimate = {0};
    for (int n = 0; n < HEXLOAD_KINDS; n++) {
        const hexload_config_t config = config_of(kinds[n]);
        static hexload_t estimator;
        hexload_effects_estimate_t effects = {.fastest_leg_m_s = HEXLOAD_REAL(-1.0)};
        const bool has_effects = kinds[n] == HEXLOAD_KIND_MOMENTUM_EFFECTS;
        TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_init(&estimator, &config));
        TEST_ASSERT_EQUAL(has_effects, hexload_read_effects(&estimator, &estimate, &effects));
        TEST_ASSERT_EQUAL(has_effects, effects.fastest_leg_m_s == HEXLOAD_REAL(0.0));
    }
}

static void test_a_machine_without_a_home_pose_is_refused_by_every_kind(void) {
    for (int n = 0; n < HEXLOAD_KINDS; n++) {
        // GIVEN legs too short to reach the platform, or an empty platform without a mass
        static hexload_t estimator, before;
        hexload_config_t short_legs = config_of(kinds[n]), weightless = config_of(kinds[n]);
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            short_legs.geometry.home_leg_length_m[leg] = HEXLOAD_REAL(0.2); // hinges are 0.36 m apart
        }
        short_legs.geometry.stroke_min_m = HEXLOAD_REAL(-0.1);
        weightless.platform.mass_kg = HEXLOAD_REAL(0.0);
        memset(&estimator, 0x5A, sizeof estimator);
        memcpy(&before, &estimator, sizeof before);
        // WHEN an estimator is started THEN it is refused, for what it is, and nothing has changed
        TEST_ASSERT_EQUAL_INT(HEXLOAD_ERR_POSE, hexload_init(&estimator, &short_legs));
        TEST_ASSERT_EQUAL_INT(HEXLOAD_ERR_CONFIG, hexload_init(&estimator, &weightless));
        TEST_ASSERT_EQUAL_MEMORY(&before, &estimator, sizeof before);
    }
}

static void test_an_instance_that_is_of_no_kind_does_nothing(void) {
    static const unsigned damaged[] = {HEXLOAD_KINDS, 99};
    for (int n = 0; n < 2; n++) {
        // GIVEN an estimator whose kind a fault of memory has changed, or that was to be none
        hexload_config_t config = config_of(HEXLOAD_KIND_MOMENTUM);
        static hexload_t estimator;
        hexload_estimate_t estimate = {.tick = 17};
        hexload_trace_t trace = {.tick = 18};
        hexload_effects_estimate_t effects;
        const hexload_leg_sample_t sample = {.tick = 1};
        TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_init(&estimator, &config));
        estimator.kind = config.kind = (hexload_kind_t)damaged[n];
        // WHEN it is used THEN it refuses, and hands nothing out
        TEST_ASSERT_EQUAL_INT(HEXLOAD_ERR_CONFIG, hexload_tick(&estimator, &config, &sample, &estimate));
        TEST_ASSERT_EQUAL_INT(HEXLOAD_ERR_CONFIG,
                              hexload_trace(&estimator, &config, &sample, &estimate, &trace));
        TEST_ASSERT_FALSE(hexload_read_effects(&estimator, &estimate, &effects));
        TEST_ASSERT_NOT_NULL(hexload_health(&estimator));
        TEST_ASSERT_EQUAL_INT(HEXLOAD_ERR_CONFIG, hexload_init(&estimator, &config));
        TEST_ASSERT_EQUAL_UINT32(17, estimate.tick);
        TEST_ASSERT_EQUAL_UINT32(18, trace.tick);
    }
}

static void test_a_refused_sample_leaves_a_trace_as_it_was(void) {
    for (int n = 0; n < 2 * HEXLOAD_KINDS; n++) {
        // GIVEN an estimator of each kind, with velocity sensors and without
        hexload_config_t config = config_of(kinds[n / 2]);
        static hexload_t estimator;
        hexload_estimate_t estimate;
        hexload_trace_t trace = {.tick = 18};
        const hexload_leg_sample_t sample = {.tick = 1};
        if (n % 2 == 1) {
            hexload_config_set_no_velocity(&config);
        }
        TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_init(&estimator, &config));
        TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_trace(&estimator, &config, &sample, &estimate, &trace));
        const hexload_trace_t before = trace;
        // WHEN a sample comes twice THEN it is refused, and the trace stays
        TEST_ASSERT_EQUAL_INT(HEXLOAD_ERR_TICK,
                              hexload_trace(&estimator, &config, &sample, &estimate, &trace));
        TEST_ASSERT_EQUAL_MEMORY(&before, &trace, sizeof before);
        TEST_ASSERT_EQUAL_UINT32(1, hexload_health(&estimator)->refused);
    }
}

/// The covariance's diagonal against the sigmas that are read, in parts of these.
static double worst_diagonal(const hexload_t* estimator, const hexload_estimate_t* estimate,
                             const hexload_effects_estimate_t* effects) {
    const hexload_descriptor_t* descriptor = hexload_describe(estimator->kind);
    hexload_real_t covariance[HEXLOAD_COVARIANCES_MAX];
    double worst = 0.0;
    const uint32_t written = hexload_covariance(estimator, covariance);
    TEST_ASSERT_LESS_OR_EQUAL_UINT32(HEXLOAD_COVARIANCES_MAX, written);
    for (uint32_t i = 0; i < descriptor->parameters + descriptor->effects; i++) {
        const double sigma = i < descriptor->parameters ? (double)estimate->sigma[i]
                                                        : (double)effects->sigma[i - descriptor->parameters];
        const double variance = (double)covariance[i * (i + 1) / 2 + i];
        worst = fmax(worst, fabs(variance - sigma * sigma) / (sigma * sigma + 1e-30));
    }
    return worst;
}

static void test_the_covariance_has_the_sigmas_of_the_estimate_on_its_diagonal(void) {
    for (int n = 0; n < HEXLOAD_KINDS; n++) {
        // GIVEN an estimator with all that widens a sigma: tolerances, an open constant, blocks of a run
        hexload_config_t config = config_of(kinds[n]);
        static hexload_t estimator;
        hexload_estimate_t estimate;
        hexload_effects_estimate_t effects = {.fastest_leg_m_s = HEXLOAD_REAL(0.0)};
        uint64_t seed = 3;
        config.actuator_effects.prior_tilt_sigma_m_s2 = HEXLOAD_REAL(0.05);
        config.rig.direction_count = 1;
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            config.rig.direction[0].force_gain[leg] = HEXLOAD_REAL(0.002);
        }
        TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_init(&estimator, &config));
        // WHEN it has run for a second
        for (uint32_t tick = 0; tick < 1000; tick++) {
            const hexload_leg_sample_t sample = sample_at(&config, tick, &seed);
            TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_tick(&estimator, &config, &sample, &estimate));
        }
        (void)hexload_read_effects(&estimator, &estimate, &effects);
        // THEN the diagonal is the sigmas' squares, to some roundings
        TEST_ASSERT_TRUE(worst_diagonal(&estimator, &estimate, &effects) < ROUNDINGS(100, 1.0));
        // AND what is read between ticks is what the tick has said, but for what only a tick widens
        hexload_estimate_t read;
        hexload_read(&estimator, &read);
        TEST_ASSERT_EQUAL_MEMORY(estimate.value, read.value, sizeof read.value);
        TEST_ASSERT_TRUE(read.nis == estimate.nis && read.nis_mean == estimate.nis_mean);
    }
}

static void test_what_judges_widen_is_in_the_covariance_too(void) {
    for (int n = 0; n < HEXLOAD_KINDS; n++) {
        for (int constants = 0; constants < 2; constants++) {
            // GIVEN an estimator, with and without an open constant, and forces that have jumped for a while
            hexload_config_t config = config_of(kinds[n]);
            static hexload_t estimator;
            hexload_estimate_t estimate;
            hexload_effects_estimate_t effects = {.fastest_leg_m_s = HEXLOAD_REAL(0.0)};
            uint64_t seed = 3;
            double largest = 0.0, worst = 0.0;
            config.rig.direction_count = (uint8_t)constants;
            config.rig.direction[0].force_gain[2] = HEXLOAD_REAL(0.002);
            TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_init(&estimator, &config));
            for (uint32_t tick = 0; tick < 4000; tick++) {
                hexload_leg_sample_t sample = sample_at(&config, tick, &seed);
                sample.force_n[1] += tick > 1000 && tick < 2500 ? HEXLOAD_REAL(60.0) : HEXLOAD_REAL(0.0);
                TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_tick(&estimator, &config, &sample, &estimate));
                // WHEN any tick is looked at THEN the diagonal is the sigmas' squares, to some roundings
                if (tick % 100 == 99) {
                    (void)hexload_read_effects(&estimator, &estimate, &effects);
                    worst = fmax(worst, worst_diagonal(&estimator, &estimate, &effects));
                    largest = fmax(largest, (double)(estimate.sigma[0] / estimate.own_sigma[0]));
                }
            }
            printf("%d, %d constants: sigma up to %.1f of the filter's own, diagonal off by %.1g\n", n,
                   constants, largest, worst);
            TEST_ASSERT_TRUE(largest > 1.2);
            TEST_ASSERT_TRUE(worst < ROUNDINGS(100, 1.0));
        }
    }
}

static void test_what_a_rig_has_shown_of_its_constants_is_in_the_covariance(void) {
    // GIVEN an estimator of actuator effects with two open constants that have moved its states
    hexload_config_t config = config_of(HEXLOAD_KIND_MOMENTUM_EFFECTS);
    static hexload_t estimator;
    hexload_real_t before[HEXLOAD_COVARIANCES_MAX], after[HEXLOAD_COVARIANCES_MAX];
    uint64_t seed = 5;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_init(&estimator, &config));
    hexload_momentum_effects_t* self = &estimator.as.momentum_effects;
    for (int n = 0; n < 2; n++) {
        for (int k = 0; k < HEXLOAD_LOAD_DIM; k++) {
            self->momentum.consider.load[n][k] = (hexload_real_t)uniform(&seed);
        }
        for (int i = 0; i < HEXLOAD_EFFECTS_DIM; i++) {
            self->effects.filter.considered[n][i] = (hexload_real_t)uniform(&seed);
        }
    }
    (void)hexload_covariance(&estimator, before);
    // WHEN the rig has shown four times the variance that they have THEN the load's part of it is four times
    // as large, what it has in common with the effects twice, and that of the effects as it was
    self->effects.filter.dispersion = HEXLOAD_REAL(4.0);
    (void)hexload_covariance(&estimator, after);
    for (int i = 0; i < HEXLOAD_LOAD_DIM + HEXLOAD_EFFECTS_DIM; i++) {
        for (int j = 0; j <= i; j++) {
            double of_rig = 0.0;
            for (int n = 0; n < 2; n++) {
                const hexload_real_t* load = self->momentum.consider.load[n];
                const hexload_real_t* effects = self->effects.filter.considered[n];
                const double row =
                    i < HEXLOAD_LOAD_DIM ? (double)load[i] : (double)effects[i - HEXLOAD_LOAD_DIM];
                const double column =
                    j < HEXLOAD_LOAD_DIM ? (double)load[j] : (double)effects[j - HEXLOAD_LOAD_DIM];
                of_rig += row * column;
            }
            const double more = i < HEXLOAD_LOAD_DIM ? 3.0 : (j < HEXLOAD_LOAD_DIM ? 1.0 : 0.0);
            const int entry = i * (i + 1) / 2 + j;
            const double size = fabs((double)before[entry]) + fabs((double)after[entry]) + 1.0;
            TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(8, size), more * of_rig,
                                      (double)after[entry] - (double)before[entry]);
        }
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_every_kind_is_described_by_names_and_units);
    RUN_TEST(test_a_kind_that_there_is_not_is_refused_and_named);
    RUN_TEST(test_before_the_first_sample_the_prior_is_read);
    RUN_TEST(test_a_traced_innovation_is_the_factor_times_the_whitened_one);
    RUN_TEST(test_momentum_goes_on_over_three_ticks_and_begins_anew_after_four);
    RUN_TEST(test_a_trace_leaves_the_estimate_and_its_innovations_have_the_variance_it_gives);
    RUN_TEST(test_a_gated_innovation_of_the_papers_estimator_is_traced_as_rejected);
    RUN_TEST(test_only_the_estimator_of_actuator_effects_has_effects);
    RUN_TEST(test_a_machine_without_a_home_pose_is_refused_by_every_kind);
    RUN_TEST(test_an_instance_that_is_of_no_kind_does_nothing);
    RUN_TEST(test_a_refused_sample_leaves_a_trace_as_it_was);
    RUN_TEST(test_the_covariance_has_the_sigmas_of_the_estimate_on_its_diagonal);
    RUN_TEST(test_what_judges_widen_is_in_the_covariance_too);
    RUN_TEST(test_what_a_rig_has_shown_of_its_constants_is_in_the_covariance);
    return UNITY_END();
}
