#include "front_end/lost_channels.h"
#include "hexload/momentum.h"
#include "motion.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

void setUp(void) {}
void tearDown(void) {}

enum { DIM = HEXLOAD_LOAD_DIM, LOST_LEG = 2, RUNS = 30 };

static const body_t eccentric = {312.0, {-0.09, 0.13, 0.27}, {17.0, 21.0, 12.0, 2.0, -1.0, 1.5}};

/// What is missing of a run's samples, from a tick on.
typedef enum gap { GAP_NONE, GAP_FORCE, GAP_DISPLACEMENT, GAP_LOOSE } gap_t;

/// The last sample that was accepted.
static hexload_leg_gate_t gate_at(uint32_t tick, hexload_real_t displacement_m) {
    hexload_leg_gate_t gate = {.last_tick = tick, .accepted = 1};
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        gate.last_displacement_m[leg] = displacement_m;
    }
    return gate;
}

static void test_a_whole_sample_goes_on_as_it_is(void) {
    // GIVEN a sample without gaps WHEN it is mended THEN it is the same, and no bit is set
    const hexload_config_t config = paper_machine();
    const hexload_leg_gate_t gate = gate_at(4, HEXLOAD_REAL(0.0));
    const hexload_leg_sample_t sample = {.tick = 5};
    hexload_leg_sample_t mended;
    hexload_lost_channels_t lost, next;
    uint32_t health = 0;
    hexload_lost_channels_init(&lost);
    TEST_ASSERT_EQUAL_PTR(
        &sample, hexload_lost_channels_mend(&lost, &config, &gate, &sample, &mended, &next, &health));
    TEST_ASSERT_EQUAL_UINT32(0, health);
    TEST_ASSERT_EQUAL_UINT32(0, next.force_ticks);
}

static void test_a_lost_force_is_the_mean_of_the_others_and_as_uncertain_as_the_largest(void) {
    // GIVEN a sample without the force of one leg WHEN it is mended
    const hexload_config_t config = paper_machine();
    const hexload_leg_gate_t gate = gate_at(4, HEXLOAD_REAL(0.0));
    const hexload_leg_sample_t sample = {.tick = 5,
                                         .force_n = {100, 200, (hexload_real_t)NAN, -300, 400, 500}};
    hexload_leg_sample_t mended;
    hexload_lost_channels_t lost, next;
    hexload_real_t variance_n2[HEXLOAD_LEGS] = {0};
    uint32_t health = 0;
    hexload_lost_channels_init(&lost);
    TEST_ASSERT_EQUAL_PTR(
        &mended, hexload_lost_channels_mend(&lost, &config, &gate, &sample, &mended, &next, &health));
    hexload_lost_channels_doubt(&next, mended.force_n, variance_n2);
    // THEN it is the mean of the other five, with the variance of the largest over 10 ticks, of that leg
    // alone
    TEST_ASSERT_EQUAL_FLOAT(180.0F, (float)mended.force_n[LOST_LEG]);
    TEST_ASSERT_EQUAL_FLOAT(10.0F * 250000.0F, (float)variance_n2[LOST_LEG]);
    TEST_ASSERT_EQUAL_FLOAT(0.0F, (float)variance_n2[0]);
    TEST_ASSERT_EQUAL_UINT32(1u << HEXLOAD_HEALTH_CHANNEL_LOST, health);
    // AND of legs that carry next to nothing it is as small
    const hexload_real_t slack_n[HEXLOAD_LEGS] = {0, HEXLOAD_REAL(0.25), 0, HEXLOAD_REAL(-0.5), 0, 0};
    variance_n2[LOST_LEG] = HEXLOAD_REAL(0.0);
    hexload_lost_channels_doubt(&next, slack_n, variance_n2);
    TEST_ASSERT_EQUAL_FLOAT(2.5F, (float)variance_n2[LOST_LEG]);
}

static void test_a_guess_stays_one_until_it_has_left_the_smoother(void) {
    // GIVEN a force that was lost once WHEN whole samples follow
    const hexload_config_t config = paper_machine();
    const hexload_leg_gate_t gate = gate_at(4, HEXLOAD_REAL(0.0));
    hexload_leg_sample_t sample = {.tick = 5}, mended;
    hexload_lost_channels_t lost, next;
    uint32_t health = 0, ticks = 0;
    hexload_lost_channels_init(&lost);
    sample.force_n[LOST_LEG] = (hexload_real_t)NAN;
    (void)hexload_lost_channels_mend(&lost, &config, &gate, &sample, &mended, &lost, &health);
    sample.force_n[LOST_LEG] = HEXLOAD_REAL(1.0);
    while (lost.force_ticks > 0) {
        // THEN a gap of another leg is too much meanwhile
        hexload_leg_sample_t other = sample;
        other.force_n[LOST_LEG + 1] = (hexload_real_t)NAN;
        TEST_ASSERT_EQUAL_PTR(
            &other, hexload_lost_channels_mend(&lost, &config, &gate, &other, &mended, &next, &health));
        (void)hexload_lost_channels_mend(&lost, &config, &gate, &sample, &mended, &lost, &health);
        ticks++;
    }
    // AND the variance lasts longer than any lag and any delay
    TEST_ASSERT_GREATER_THAN_UINT32(HEXLOAD_LAG_TICKS_MAX + HEXLOAD_RIG_DELAY_TICKS_MAX, ticks);
}

static void test_a_lost_displacement_goes_on_with_its_velocity_for_ten_seconds(void) {
    // GIVEN a leg at 50 mm that moves by 0.2 m/s, and whose displacement is missing
    hexload_config_t config = paper_machine();
    hexload_leg_gate_t gate = gate_at(4, HEXLOAD_REAL(0.05));
    hexload_leg_sample_t sample = {.tick = 7}, mended;
    hexload_lost_channels_t lost, next;
    uint32_t health = 0;
    hexload_lost_channels_init(&lost);
    sample.displacement_m[LOST_LEG] = (hexload_real_t)NAN;
    sample.velocity_m_s[LOST_LEG] = HEXLOAD_REAL(0.2);
    // WHEN three ticks have passed THEN it is 0.6 mm farther
    TEST_ASSERT_EQUAL_PTR(
        &mended, hexload_lost_channels_mend(&lost, &config, &gate, &sample, &mended, &next, &health));
    TEST_ASSERT_FLOAT_WITHIN(1e-7F, 0.0506F, (float)mended.displacement_m[LOST_LEG]);
    TEST_ASSERT_EQUAL_UINT32(3, next.displacement_ticks);
    // AND when it is there again, the time of a later gap begins anew
    hexload_leg_sample_t whole = sample;
    whole.displacement_m[LOST_LEG] = HEXLOAD_REAL(0.05);
    (void)hexload_lost_channels_mend(&next, &config, &gate, &whole, &mended, &lost, &health);
    TEST_ASSERT_EQUAL_UINT32(0, lost.displacement_ticks);
    // AND after 10 s it is carried on no longer, nor before a first sample
    config.tick_s = HEXLOAD_REAL(1.0) / HEXLOAD_REAL(1024.0);
    lost.displacement_ticks = 10240;
    TEST_ASSERT_EQUAL_PTR(
        &mended, hexload_lost_channels_mend(&lost, &config, &gate, &sample, &mended, &next, &health));
    lost.displacement_ticks = 10241;
    TEST_ASSERT_EQUAL_PTR(
        &sample, hexload_lost_channels_mend(&lost, &config, &gate, &sample, &mended, &next, &health));
    hexload_lost_channels_init(&lost);
    gate.accepted = 0;
    TEST_ASSERT_EQUAL_PTR(
        &sample, hexload_lost_channels_mend(&lost, &config, &gate, &sample, &mended, &next, &health));
}

static void test_two_lost_channels_of_a_kind_are_too_many(void) {
    const hexload_config_t config = paper_machine();
    const hexload_leg_gate_t gate = gate_at(4, HEXLOAD_REAL(0.0));
    for (int kind = 0; kind < 2; kind++) {
        // GIVEN a sample without the forces, or displacements, of two legs WHEN it is to be mended
        hexload_leg_sample_t sample = {.tick = 5}, mended;
        hexload_real_t* channels = kind == 0 ? sample.force_n : sample.displacement_m;
        hexload_lost_channels_t lost, next;
        uint32_t health = 0;
        hexload_lost_channels_init(&lost);
        channels[1] = channels[4] = (hexload_real_t)NAN;
        // THEN it stays as it is
        TEST_ASSERT_EQUAL_PTR(
            &sample, hexload_lost_channels_mend(&lost, &config, &gate, &sample, &mended, &next, &health));
        TEST_ASSERT_EQUAL_UINT32(0, health);
    }
}

/// Runs an estimator; `gap` opens at from_tick.
static void run(uint64_t seed, gap_t gap, uint32_t from_tick, uint32_t ticks, hexload_momentum_t* estimator,
                hexload_estimate_t* estimate) {
    const hexload_config_t config = crooked_machine();
    const motion_t motion = random_motion(300 + seed, 0.05, 0.12);
    uint64_t noise = 400 + seed;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_momentum_init(estimator, &config));
    for (uint32_t tick = 0; tick < ticks; tick++) {
        hexload_leg_sample_t sample =
            perfect_sample(&config, &eccentric, &motion, (double)estimator->kinematics.home_height_m, tick);
        add_noise(&config, &noise, &sample);
        if (gap == GAP_FORCE && tick >= from_tick) {
            sample.force_n[LOST_LEG] = (hexload_real_t)NAN;
        } else if (gap == GAP_DISPLACEMENT && tick >= from_tick) {
            sample.displacement_m[LOST_LEG] = (hexload_real_t)NAN;
        } else if (gap == GAP_LOOSE && tick >= from_tick && tick % 300 < 50) {
            sample.displacement_m[LOST_LEG] = HEXLOAD_REAL(-0.25);
        }
        TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_momentum_tick(estimator, &config, &sample, estimate));
    }
    TEST_ASSERT_EQUAL_UINT32(0, estimator->health.count[HEXLOAD_HEALTH_LOAD_CHANGED]);
    TEST_ASSERT_EQUAL_UINT32(0, estimator->health.refused);
}

/// Of a parameter's error: in sigmas, squared, the mean of ten; and the mean sigma over that of `whole`.
typedef struct score {
    double square;
    double sigma_ratio;
} score_t;

static score_t score_of(const hexload_estimate_t* estimate, const hexload_estimate_t* whole) {
    double theta[DIM];
    score_t score = {0.0, 0.0};
    theta_of(&eccentric, theta);
    for (int k = 0; k < DIM; k++) {
        const double error = ((double)estimate->value[k] - theta[k]) / (double)estimate->sigma[k];
        score.square += error * error / DIM;
        score.sigma_ratio += (double)estimate->sigma[k] / (double)whole->sigma[k] / DIM;
    }
    return score;
}

/// What run() finds of a whole log; computed when it is asked for the first time.
static const hexload_estimate_t* whole_run(uint64_t n) {
    static hexload_estimate_t estimates[RUNS];
    static int is_known[RUNS];
    if (!is_known[n]) {
        hexload_momentum_t estimator;
        run(n, GAP_NONE, 0, 3000, &estimator, &estimates[n]);
        is_known[n] = 1;
    }
    return &estimates[n];
}

static void lose(const char* what, gap_t gap, uint32_t from_tick, double most_square) {
    score_t mean = {0.0, 0.0};
    for (uint64_t n = 0; n < RUNS; n++) {
        hexload_momentum_t estimator;
        hexload_estimate_t estimate;
        run(n, gap, from_tick, 3000, &estimator, &estimate);
        const score_t score = score_of(&estimate, whole_run(n));
        mean.square += score.square / RUNS;
        mean.sigma_ratio += score.sigma_ratio / RUNS;
        TEST_ASSERT_EQUAL_INT(HEXLOAD_VERDICT_CONVERGED, estimate.verdict);
        TEST_ASSERT_EQUAL_UINT32(3000 - from_tick, estimator.health.count[HEXLOAD_HEALTH_CHANNEL_LOST]);
    }
    printf("%s: errors %.2f sigmas rms, sigmas %.2f times those of six legs\n", what, sqrt(mean.square),
           mean.sigma_ratio);
    TEST_ASSERT_TRUE_MESSAGE(mean.square < most_square, what);
}

static void test_five_forces_identify_the_load_with_larger_sigmas(void) {
    // GIVEN violent motions of a general machine, WHEN one force is missing from the start, or after a second
    // THEN errors are of the size of the sigmas: a mean of 300 squares is 1 within 3.3 sqrt(2 / 300), and ten
    // of a run go together: 3.3 sqrt(2 / 30)
    lose("force lost at the start", GAP_FORCE, 0, 1.85);
    lose("force lost after 1 s", GAP_FORCE, 1000, 1.85);
}

static void test_a_displacement_is_bridged(void) {
    lose("displacement lost after 1 s", GAP_DISPLACEMENT, 1000, 1.85);
}

static void test_a_loose_plug_leaves_nothing_in_the_estimate(void) {
    // GIVEN a displacement that reads the end of its range for 50 ms, three times a second after the first
    double square = 0.0;
    for (uint64_t n = 0; n < RUNS; n++) {
        hexload_momentum_t estimator;
        hexload_estimate_t estimate;
        // WHEN the load is identified THEN no change of it is reported, and no sample refused (run())
        run(n, GAP_LOOSE, 1000, 3000, &estimator, &estimate);
        square += score_of(&estimate, whole_run(n)).square / RUNS;
        TEST_ASSERT_EQUAL_INT(HEXLOAD_VERDICT_CONVERGED, estimate.verdict);
        TEST_ASSERT_GREATER_THAN_UINT32(200, estimator.health.count[HEXLOAD_HEALTH_CHANNEL_LOST]);
    }
    // AND errors are of the size of the sigmas, as when the channel is missing
    TEST_ASSERT_TRUE(square < 1.85);
}

static void test_a_force_may_be_missing_from_the_first_sample_on(void) {
    // GIVEN no sample before, and one without a force WHEN it is to be mended THEN the other forces are
    // enough; a displacement would need the one before
    const hexload_config_t config = paper_machine();
    const hexload_leg_gate_t gate = {.accepted = 0};
    hexload_leg_sample_t sample = {.tick = 5}, mended;
    hexload_lost_channels_t lost, next;
    uint32_t health = 0;
    hexload_lost_channels_init(&lost);
    sample.force_n[LOST_LEG] = (hexload_real_t)NAN;
    TEST_ASSERT_EQUAL_PTR(
        &mended, hexload_lost_channels_mend(&lost, &config, &gate, &sample, &mended, &next, &health));
}

static void test_a_displacement_may_be_missing_beside_a_force_in_doubt(void) {
    // GIVEN a force that has been a guess of late WHEN the displacement of another leg is missing THEN it is
    // mended: no two channels of a kind are
    const hexload_config_t config = paper_machine();
    const hexload_leg_gate_t gate = gate_at(4, HEXLOAD_REAL(0.01));
    const hexload_lost_channels_t lost = {.force_ticks = 7, .force_leg = LOST_LEG};
    hexload_leg_sample_t sample = {.tick = 5}, mended;
    hexload_lost_channels_t next;
    uint32_t health = 0;
    sample.displacement_m[LOST_LEG + 1] = (hexload_real_t)NAN;
    TEST_ASSERT_EQUAL_PTR(
        &mended, hexload_lost_channels_mend(&lost, &config, &gate, &sample, &mended, &next, &health));
    TEST_ASSERT_TRUE(mended.displacement_m[LOST_LEG + 1] == HEXLOAD_REAL(0.01));
    TEST_ASSERT_EQUAL_UINT32(6, next.force_ticks);
    // AND when that leg's force is missing with it there are two
    sample.force_n[LOST_LEG + 1] = (hexload_real_t)NAN;
    TEST_ASSERT_EQUAL_PTR(
        &sample, hexload_lost_channels_mend(&lost, &config, &gate, &sample, &mended, &next, &health));
}

static void test_channels_that_are_not_finite_are_not_missing(void) {
    // GIVEN two forces without bounds, of opposite signs, so that their sum is no number WHEN the sample is
    // to be mended THEN it stays as it is, for the check to refuse it
    const hexload_config_t config = paper_machine();
    const hexload_leg_gate_t gate = gate_at(4, HEXLOAD_REAL(0.0));
    hexload_leg_sample_t sample = {.tick = 5}, mended;
    hexload_lost_channels_t lost, next;
    uint32_t health = 0;
    hexload_lost_channels_init(&lost);
    sample.force_n[0] = (hexload_real_t)INFINITY;
    sample.force_n[1] = (hexload_real_t)-INFINITY;
    TEST_ASSERT_EQUAL_PTR(
        &sample, hexload_lost_channels_mend(&lost, &config, &gate, &sample, &mended, &next, &health));
    TEST_ASSERT_EQUAL_UINT32(0, health);
}

static void test_without_velocity_sensors_a_guess_is_reported_for_a_window(void) {
    // GIVEN speeds from a window of 2 x 6 ticks, and a force that was lost once
    hexload_config_t config = paper_machine();
    config.sensors.half_window_ticks = 6;
    const hexload_leg_gate_t gate = gate_at(4, HEXLOAD_REAL(0.0));
    hexload_leg_sample_t sample = {.tick = 5}, mended;
    hexload_lost_channels_t lost;
    uint32_t health = 0, ticks = 0;
    hexload_lost_channels_init(&lost);
    sample.force_n[LOST_LEG] = (hexload_real_t)NAN;
    (void)hexload_lost_channels_mend(&lost, &config, &gate, &sample, &mended, &lost, &health);
    // WHEN whole samples follow THEN it is said for as long as what the estimator is given has it in it: a
    // window, of which the first is the sample itself
    sample.force_n[LOST_LEG] = HEXLOAD_REAL(1.0);
    for (int n = 0; n < 30; n++) {
        health = 0;
        (void)hexload_lost_channels_mend(&lost, &config, &gate, &sample, &mended, &lost, &health);
        ticks += health == 1u << HEXLOAD_HEALTH_CHANNEL_LOST ? 1 : 0;
    }
    TEST_ASSERT_EQUAL_UINT32(12, ticks);
    // AND no displacement is bridged: speeds are made of displacements
    sample.displacement_m[LOST_LEG] = (hexload_real_t)NAN;
    TEST_ASSERT_EQUAL_PTR(
        &sample, hexload_lost_channels_mend(&lost, &config, &gate, &sample, &mended, &lost, &health));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_whole_sample_goes_on_as_it_is);
    RUN_TEST(test_a_lost_force_is_the_mean_of_the_others_and_as_uncertain_as_the_largest);
    RUN_TEST(test_a_guess_stays_one_until_it_has_left_the_smoother);
    RUN_TEST(test_a_lost_displacement_goes_on_with_its_velocity_for_ten_seconds);
    RUN_TEST(test_two_lost_channels_of_a_kind_are_too_many);
    RUN_TEST(test_a_force_may_be_missing_from_the_first_sample_on);
    RUN_TEST(test_a_displacement_may_be_missing_beside_a_force_in_doubt);
    RUN_TEST(test_channels_that_are_not_finite_are_not_missing);
    RUN_TEST(test_without_velocity_sensors_a_guess_is_reported_for_a_window);
    RUN_TEST(test_five_forces_identify_the_load_with_larger_sigmas);
    RUN_TEST(test_a_displacement_is_bridged);
    RUN_TEST(test_a_loose_plug_leaves_nothing_in_the_estimate);
    return UNITY_END();
}
