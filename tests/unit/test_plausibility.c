#include "hexload/hexload.h"
#include "motion.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

void setUp(void) {}
void tearDown(void) {}

enum { SECOND = 1000, HISTORY = 64 };

static const body_t eccentric = {312.0, {-0.09, 0.13, 0.27}, {17.0, 21.0, 12.0, 2.0, -1.0, 1.5}};

/// A machine whose samples a test may change on their way to the estimator.
typedef struct bench {
    hexload_config_t config;
    hexload_t estimator;
    hexload_estimate_t estimate;
    hexload_status_t status;
    motion_t motion;
    uint64_t seed;
    uint32_t tick;
    hexload_leg_sample_t past[HISTORY]; ///< as measured; the newest first
    void (*change)(const struct bench* bench, hexload_leg_sample_t* sample);
} bench_t;

static void begin(bench_t* bench, hexload_config_t config, hexload_kind_t kind, motion_t motion) {
    memset(bench, 0, sizeof *bench);
    bench->config = config;
    bench->config.kind = kind;
    bench->config.paper.load_mass_kg = (hexload_real_t)eccentric.mass_kg;
    bench->motion = motion;
    bench->seed = 3;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_init(&bench->estimator, &bench->config));
}

static void run(bench_t* bench, uint32_t ticks) {
    const double home_m = 0.7982755108724783; // of the paper's machine
    for (uint32_t n = 0; n < ticks; n++) {
        hexload_leg_sample_t sample =
            perfect_sample(&bench->config, &eccentric, &bench->motion, home_m, bench->tick);
        add_noise(&bench->config, &bench->seed, &sample);
        memmove(&bench->past[1], &bench->past[0], sizeof bench->past - sizeof bench->past[0]);
        bench->past[0] = sample;
        if (bench->change != NULL) {
            bench->change(bench, &sample);
        }
        bench->status = hexload_tick(&bench->estimator, &bench->config, &sample, &bench->estimate);
        bench->tick++;
    }
}

static hexload_input_fault_t fault_of(const bench_t* bench) {
    return hexload_health(&bench->estimator)->input;
}

static motion_t brisk(void) {
    return random_motion(31, 0.05, 0.1);
}

/// Centimetres in seconds, as a machine is moved when it is set up.
static motion_t slow(void) {
    motion_t motion = random_motion(31, 0.02, 0.04);
    for (int k = 0; k < 6; k++) {
        motion.frequency_hz[k][0] = 0.3 + 0.03 * k;
        motion.frequency_hz[k][1] = 0.2 + 0.02 * k;
    }
    return motion;
}

static motion_t at_rest(void) {
    const motion_t motion = {.frequency_hz = {{1, 1}, {1, 1}, {1, 1}, {1, 1}, {1, 1}, {1, 1}}};
    return motion;
}

// What may be wrong, at the leg with index 2.

static void velocity_sign(const bench_t* bench, hexload_leg_sample_t* sample) {
    (void)bench;
    sample->velocity_m_s[2] = -sample->velocity_m_s[2];
}
static void displacement_sign(const bench_t* bench, hexload_leg_sample_t* sample) {
    (void)bench;
    sample->displacement_m[2] = -sample->displacement_m[2];
}
static void all_velocity_signs(const bench_t* bench, hexload_leg_sample_t* sample) {
    (void)bench;
    for (int leg = 0; leg < 6; leg++) {
        sample->velocity_m_s[leg] = -sample->velocity_m_s[leg];
    }
}
static void velocity_gain(const bench_t* bench, hexload_leg_sample_t* sample) {
    (void)bench;
    sample->velocity_m_s[2] *= HEXLOAD_REAL(1.04);
}
static void clock_wrong(const bench_t* bench, hexload_leg_sample_t* sample) {
    (void)bench;
    for (int leg = 0; leg < 6; leg++) {
        sample->velocity_m_s[leg] *= HEXLOAD_REAL(0.9);
    }
}
static void velocity_in_other_unit(const bench_t* bench, hexload_leg_sample_t* sample) {
    (void)bench;
    sample->velocity_m_s[2] *= HEXLOAD_REAL(0.001);
}
static void velocity_late(const bench_t* bench, hexload_leg_sample_t* sample) {
    sample->velocity_m_s[2] = bench->past[4].velocity_m_s[2];
}
static void all_velocities_late(const bench_t* bench, hexload_leg_sample_t* sample) {
    memcpy(sample->velocity_m_s, bench->past[4].velocity_m_s, sizeof sample->velocity_m_s);
}
static void velocities_swapped(const bench_t* bench, hexload_leg_sample_t* sample) {
    sample->velocity_m_s[2] = bench->past[0].velocity_m_s[5];
    sample->velocity_m_s[5] = bench->past[0].velocity_m_s[2];
}
static void velocity_stuck(const bench_t* bench, hexload_leg_sample_t* sample) {
    (void)bench;
    sample->velocity_m_s[2] = HEXLOAD_REAL(0.02);
}
static void displacement_stuck(const bench_t* bench, hexload_leg_sample_t* sample) {
    (void)bench;
    sample->displacement_m[2] = HEXLOAD_REAL(0.001);
}
static void velocity_saturated(const bench_t* bench, hexload_leg_sample_t* sample) {
    (void)bench;
    sample->velocity_m_s[2] =
        hexload_max(HEXLOAD_REAL(-0.05), hexload_min(HEXLOAD_REAL(0.05), sample->velocity_m_s[2]));
}
static void rows_doubled(const bench_t* bench, hexload_leg_sample_t* sample) {
    const uint32_t tick = sample->tick;
    *sample = bench->past[tick % 2];
    sample->tick = tick;
}
static void force_stuck(const bench_t* bench, hexload_leg_sample_t* sample) {
    (void)bench;
    sample->force_n[2] = HEXLOAD_REAL(700.0);
}
static void forces_negated(const bench_t* bench, hexload_leg_sample_t* sample) {
    (void)bench;
    for (int leg = 0; leg < 6; leg++) {
        sample->force_n[leg] = -sample->force_n[leg];
    }
}
static void forces_in_kilonewton(const bench_t* bench, hexload_leg_sample_t* sample) {
    (void)bench;
    for (int leg = 0; leg < 6; leg++) {
        sample->force_n[leg] *= HEXLOAD_REAL(0.001);
    }
}
static void forces_in_pounds(const bench_t* bench, hexload_leg_sample_t* sample) {
    (void)bench;
    for (int leg = 0; leg < 6; leg++) {
        sample->force_n[leg] *= HEXLOAD_REAL(0.2248);
    }
}
static void force_sign(const bench_t* bench, hexload_leg_sample_t* sample) {
    (void)bench;
    sample->force_n[2] = -sample->force_n[2];
}
static void force_dead(const bench_t* bench, hexload_leg_sample_t* sample) {
    (void)bench;
    sample->force_n[2] *= HEXLOAD_REAL(0.01);
}

static void rows_frozen_for_half_a_second(const bench_t* bench, hexload_leg_sample_t* sample) {
    static hexload_leg_sample_t kept;
    const uint32_t tick = sample->tick;
    (void)bench;
    kept = tick < 2 * SECOND ? *sample : kept;
    if (tick >= 2 * SECOND && tick < 2 * SECOND + SECOND / 2) {
        *sample = kept;
        sample->tick = tick;
    }
}

static void check_named(void (*change)(const bench_t*, hexload_leg_sample_t*), motion_t motion,
                        hexload_kind_t kind, hexload_input_cause_t cause, uint32_t leg, uint32_t within_s) {
    // GIVEN samples in which something is wrong WHEN so many seconds of motion have passed
    bench_t bench;
    begin(&bench, paper_machine(), kind, motion);
    bench.change = change;
    run(&bench, within_s * SECOND);
    // THEN cause and leg are named, the health bit is set, and no verdict is to be believed
    TEST_ASSERT_EQUAL_INT(cause, fault_of(&bench).cause);
    TEST_ASSERT_EQUAL_UINT32(leg, fault_of(&bench).leg);
    TEST_ASSERT_TRUE((hexload_health(&bench.estimator)->bits >> HEXLOAD_HEALTH_INPUT_IMPLAUSIBLE & 1u) != 0);
    TEST_ASSERT_GREATER_OR_EQUAL_INT(HEXLOAD_VERDICT_MISFIT, bench.estimate.verdict);
    TEST_ASSERT_GREATER_OR_EQUAL_INT(HEXLOAD_VERDICT_MISFIT, bench.estimate.parameter_verdict[0]);
}

static void test_what_contradicts_the_displacement_is_named(void) {
    static const struct {
        void (*change)(const bench_t*, hexload_leg_sample_t*);
        hexload_input_cause_t cause;
        uint32_t leg;
    } faults[] = {
        {velocity_sign, HEXLOAD_INPUT_VELOCITY_SIGN, 2},
        {displacement_sign, HEXLOAD_INPUT_VELOCITY_SIGN, 2},
        {all_velocity_signs, HEXLOAD_INPUT_VELOCITY_SIGN, 6},
        {velocity_gain, HEXLOAD_INPUT_VELOCITY_GAIN, 2},
        {clock_wrong, HEXLOAD_INPUT_CLOCK, 6},
        {velocity_in_other_unit, HEXLOAD_INPUT_VELOCITY_STUCK, 2},
        {velocity_late, HEXLOAD_INPUT_VELOCITY_LAG, 2},
        {velocity_stuck, HEXLOAD_INPUT_VELOCITY_STUCK, 2},
        {displacement_stuck, HEXLOAD_INPUT_DISPLACEMENT_STUCK, 2},
        {rows_doubled, HEXLOAD_INPUT_ROWS_REPEATED, 6},
        {force_stuck, HEXLOAD_INPUT_FORCE_STUCK, 2},
        {forces_negated, HEXLOAD_INPUT_FORCES_NEGATED, 6},
        {forces_in_kilonewton, HEXLOAD_INPUT_FORCES_LIGHT, 6},
        {forces_in_pounds, HEXLOAD_INPUT_FORCES_QUIET, 6},
    };
    // A leg's turn comes within six windows of 0.53 s, and two must show it: 4.2 s
    for (size_t n = 0; n < sizeof faults / sizeof faults[0]; n++) {
        check_named(faults[n].change, brisk(), HEXLOAD_KIND_PAPER, faults[n].cause, faults[n].leg, 5);
        check_named(faults[n].change, brisk(), HEXLOAD_KIND_MOMENTUM, faults[n].cause, faults[n].leg, 5);
    }
}

static void test_swapped_sensors_are_named_at_one_of_their_legs(void) {
    bench_t bench;
    begin(&bench, paper_machine(), HEXLOAD_KIND_PAPER, brisk());
    bench.change = velocities_swapped;
    run(&bench, 5 * SECOND);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_INPUT_VELOCITY_SWAPPED, fault_of(&bench).cause);
    TEST_ASSERT_TRUE(fault_of(&bench).leg == 2 || fault_of(&bench).leg == 5);
}

static void test_a_saturated_velocity_is_found_at_its_leg(void) {
    bench_t bench;
    begin(&bench, paper_machine(), HEXLOAD_KIND_PAPER, brisk());
    bench.change = velocity_saturated;
    run(&bench, 5 * SECOND);
    TEST_ASSERT_NOT_EQUAL(HEXLOAD_INPUT_PLAUSIBLE, fault_of(&bench).cause);
    TEST_ASSERT_EQUAL_UINT32(2, fault_of(&bench).leg);
}

static void test_a_force_that_does_not_hold_the_platform_is_named_while_it_moves_slowly_or_rests(void) {
    // A leg's turn comes within six windows of 0.53 s, and four must show it: 5.3 s
    check_named(force_sign, slow(), HEXLOAD_KIND_PAPER, HEXLOAD_INPUT_FORCE_SIGN, 2, 6);
    check_named(force_sign, at_rest(), HEXLOAD_KIND_MOMENTUM, HEXLOAD_INPUT_FORCE_SIGN, 2, 6);
    check_named(force_dead, slow(), HEXLOAD_KIND_MOMENTUM, HEXLOAD_INPUT_FORCE_DEAD, 2, 6);
}

/// No window of the run is found to contradict itself.
static void check_silent(bench_t* bench, uint32_t seconds) {
    for (uint32_t second = 0; second < seconds; second++) {
        run(bench, SECOND);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_INPUT_PLAUSIBLE, fault_of(bench).cause);
        TEST_ASSERT_EQUAL_UINT32(0,
                                 hexload_health(&bench->estimator)->count[HEXLOAD_HEALTH_INPUT_IMPLAUSIBLE]);
    }
}

/// Of each of four kinds of motion; the program's argument.
static uint64_t seeds = 6;

static void test_sensors_in_order_are_never_a_fault(void) {
    for (uint64_t seed = 0; seed < 4 * seeds; seed++) {
        bench_t bench;
        begin(&bench, paper_machine(), HEXLOAD_KIND_PAPER,
              seed % 4 == 0   ? paper_motion(0.01)
              : seed % 4 == 1 ? slow()
              : seed % 4 == 2 ? at_rest()
                              : random_motion(400 + seed, 0.05, 0.12));
        bench.seed = 900 + seed;
        check_silent(&bench, 8);
    }
}

static void ordinary_tolerances(const bench_t* bench, hexload_leg_sample_t* sample) {
    for (int leg = 0; leg < 6; leg++) {
        const hexload_real_t sign = leg % 2 == 0 ? HEXLOAD_REAL(1.0) : HEXLOAD_REAL(-1.0);
        sample->velocity_m_s[leg] =
            (HEXLOAD_REAL(1.0) + sign * HEXLOAD_REAL(0.01)) * bench->past[1].velocity_m_s[leg] +
            sign * HEXLOAD_REAL(0.002);
        sample->displacement_m[leg] *= HEXLOAD_REAL(1.0) - sign * HEXLOAD_REAL(0.002);
        sample->force_n[leg] = (HEXLOAD_REAL(1.0) + sign * HEXLOAD_REAL(0.01)) * sample->force_n[leg] +
                               sign * HEXLOAD_REAL(30.0);
    }
}

static void test_ordinary_tolerances_of_sensors_are_no_fault(void) {
    // GIVEN 1.2 % of gain, a tick of lag and offsets of 2 mm/s and 30 N WHEN the machine moves THEN nothing
    const motion_t motions[] = {brisk(), slow()};
    for (int n = 0; n < 2; n++) {
        bench_t bench;
        begin(&bench, paper_machine(), HEXLOAD_KIND_PAPER, motions[n]);
        bench.change = ordinary_tolerances;
        check_silent(&bench, 20);
    }
}

static void test_a_commissioned_delay_is_no_fault(void) {
    for (int kind = HEXLOAD_KIND_PAPER; kind <= HEXLOAD_KIND_MOMENTUM; kind++) {
        // GIVEN velocities that are 4 ms late WHEN the rig file says so THEN nothing is found
        bench_t bench;
        hexload_config_t config = paper_machine();
        config.rig.velocity_delay_s = HEXLOAD_REAL(0.004);
        begin(&bench, config, (hexload_kind_t)kind, brisk());
        bench.change = all_velocities_late;
        check_silent(&bench, 10);
        // AND WHEN it does not, that they are late
        begin(&bench, paper_machine(), (hexload_kind_t)kind, brisk());
        bench.change = all_velocities_late;
        run(&bench, 5 * SECOND);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_INPUT_VELOCITY_LAG, fault_of(&bench).cause);
    }
}

static void test_without_velocity_sensors_velocities_say_nothing(void) {
    bench_t bench;
    hexload_config_t config = paper_machine();
    hexload_config_set_no_velocity(&config);
    begin(&bench, config, HEXLOAD_KIND_MOMENTUM, brisk());
    bench.change = velocity_sign;
    check_silent(&bench, 8);
    // AND forces are looked at all the same
    bench.change = forces_negated;
    run(&bench, 5 * SECOND);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_INPUT_FORCES_NEGATED, fault_of(&bench).cause);
}

static void test_a_fault_stays_until_ten_windows_of_motion_show_none(void) {
    bench_t bench;
    begin(&bench, paper_machine(), HEXLOAD_KIND_PAPER, brisk());
    bench.change = velocity_sign;
    run(&bench, 5 * SECOND);
    // GIVEN a fault that has been mended WHEN 4 s have passed THEN it is still reported
    bench.change = NULL;
    run(&bench, 4 * SECOND);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_INPUT_VELOCITY_SIGN, fault_of(&bench).cause);
    // AND WHEN another 3 s have THEN it is not
    run(&bench, 3 * SECOND);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_INPUT_PLAUSIBLE, fault_of(&bench).cause);
    // GIVEN a fault WHEN the machine then rests THEN it stays, as nothing has shown that it is gone
    bench.change = velocity_sign;
    run(&bench, 5 * SECOND);
    bench.motion = at_rest();
    run(&bench, 20 * SECOND);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_INPUT_VELOCITY_SIGN, fault_of(&bench).cause);
}

static void lost_samples(const bench_t* bench, hexload_leg_sample_t* sample) {
    if (bench->tick % 50 >= 47) {
        sample->force_n[0] = sample->force_n[1] = NAN; // two: refused
    }
}

static void test_missing_samples_are_no_fault(void) {
    bench_t bench;
    begin(&bench, paper_machine(), HEXLOAD_KIND_PAPER, brisk());
    bench.change = lost_samples;
    check_silent(&bench, 10);
    TEST_ASSERT_TRUE(hexload_health(&bench.estimator)->refused > 0);
}

static void test_a_stated_mass_that_the_legs_do_not_carry_is_never_converged(void) {
    const double told_kg[] = {50.0, 200.0, 270.0, 291.0, 333.0, 400.0, 900.0};
    const motion_t motions[] = {paper_motion(0.01), at_rest(), slow()};
    for (size_t n = 0; n < sizeof told_kg / sizeof told_kg[0]; n++) {
        for (int m = 0; m < 3; m++) {
            // GIVEN a load of 312 kg, and the paper's filter that was told something else
            bench_t bench;
            hexload_config_t config = paper_machine();
            begin(&bench, config, HEXLOAD_KIND_PAPER, motions[m]);
            config = bench.config;
            config.paper.load_mass_kg = (hexload_real_t)told_kg[n];
            bench.config = config;
            TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_init(&bench.estimator, &bench.config));
            // WHEN it has estimated for a second THEN it says so, and by how many newtons; the mean of a
            // second of noise has 0.4 N, and the eccentric load's rotation some more
            run(&bench, SECOND);
            TEST_ASSERT_EQUAL_INT(HEXLOAD_INPUT_KNOWN_MASS, fault_of(&bench).cause);
            TEST_ASSERT_DOUBLE_WITHIN(20.0, (312.0 - told_kg[n]) * 9.81, (double)fault_of(&bench).excess_n);
            TEST_ASSERT_GREATER_OR_EQUAL_INT(HEXLOAD_VERDICT_MISFIT, bench.estimate.verdict);
            TEST_ASSERT_GREATER_OR_EQUAL_INT(HEXLOAD_VERDICT_MISFIT, bench.estimate.parameter_verdict[3]);
        }
    }
}

static void forces_light(const bench_t* bench, hexload_leg_sample_t* sample) {
    (void)bench;
    for (int leg = 0; leg < 6; leg++) {
        sample->force_n[leg] *= HEXLOAD_REAL(0.985);
    }
}

static void test_force_sensors_within_their_tolerance_are_no_wrong_mass(void) {
    // GIVEN forces that are 1.5 % too small, as sensors may be WHEN the machine moves or rests THEN nothing
    // is said of the mass
    const motion_t motions[] = {brisk(), slow(), at_rest()};
    for (int m = 0; m < 3; m++) {
        bench_t bench;
        begin(&bench, paper_machine(), HEXLOAD_KIND_PAPER, motions[m]);
        bench.change = forces_light;
        check_silent(&bench, 10);
    }
}

static void forces_of_a_third_less(const bench_t* bench, hexload_leg_sample_t* sample) {
    (void)bench;
    for (int leg = 0; leg < 6; leg++) {
        sample->force_n[leg] *= HEXLOAD_REAL(0.6666667);
    }
}

static void forces_in_kgf(const bench_t* bench, hexload_leg_sample_t* sample) {
    (void)bench;
    for (int leg = 0; leg < 6; leg++) {
        sample->force_n[leg] *= HEXLOAD_REAL(0.10197);
    }
}

static void test_forces_that_are_wrong_are_not_called_inconsistent(void) {
    // GIVEN a stated mass that is true WHEN one leg shows no force, or the opposite, or all come in kgf
    void (*const changes[])(const bench_t*, hexload_leg_sample_t*) = {force_dead, force_sign, forces_in_kgf};
    for (int n = 0; n < 3; n++) {
        bench_t bench;
        begin(&bench, paper_machine(), HEXLOAD_KIND_PAPER, slow());
        bench.change = changes[n];
        int contradicted = 0;
        for (int tick = 0; tick < 3 * SECOND; tick++) {
            run(&bench, 1);
            contradicted += fault_of(&bench).cause == HEXLOAD_INPUT_KNOWN_MASS ? 1 : 0;
            // THEN the verdict is that something contradicts, which they may be as well as the mass
            TEST_ASSERT_NOT_EQUAL(HEXLOAD_VERDICT_INCONSISTENT, bench.estimate.verdict);
        }
        TEST_ASSERT_TRUE(contradicted > 3 * SECOND / 2);
    }
}

static void test_a_load_that_is_exchanged_is_no_longer_the_told_one(void) {
    // GIVEN a stated mass that is true WHEN a third of all forces is gone THEN it is contradicted within 0.3
    // s
    bench_t bench;
    begin(&bench, paper_machine(), HEXLOAD_KIND_PAPER, slow());
    check_silent(&bench, 3);
    bench.change = forces_of_a_third_less;
    run(&bench, 300);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_INPUT_KNOWN_MASS, fault_of(&bench).cause);
    TEST_ASSERT_TRUE(fault_of(&bench).excess_n < HEXLOAD_REAL(0.0));
    // AND WHEN the load is the stated one again THEN it is believed after a few of the two seconds
    bench.change = NULL;
    run(&bench, 8 * SECOND);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_INPUT_PLAUSIBLE, fault_of(&bench).cause);
}

static void test_every_cause_has_words_of_its_own(void) {
    for (int a = 0; a <= HEXLOAD_INPUT_CAUSES; a++) {
        const char* words = hexload_input_fault_text((hexload_input_cause_t)a);
        for (int b = 0; b < a; b++) {
            TEST_ASSERT_NOT_EQUAL(0, strcmp(words, hexload_input_fault_text((hexload_input_cause_t)b)));
        }
        TEST_ASSERT_EQUAL_INT(a > 0 && a < HEXLOAD_INPUT_CAUSES,
                              strstr(words, ": check") != NULL || strstr(words, ": the source") != NULL);
    }
}

static void test_samples_that_wait_for_late_channels_begin_a_block_anew(void) {
    // GIVEN forces that count as 3 ms late, so that no sample is complete for some ticks after a missing one
    bench_t bench;
    hexload_config_t config = paper_machine();
    config.rig.force_delay_s = HEXLOAD_REAL(0.003);
    begin(&bench, config, HEXLOAD_KIND_MOMENTUM, brisk());
    bench.change = lost_samples;
    // WHEN some are refused THEN that is no fault of velocities
    check_silent(&bench, 3);
    TEST_ASSERT_TRUE(hexload_health(&bench.estimator)->refused > 0);
}

static void test_without_gravity_no_mass_is_wrong(void) {
    // GIVEN a base where nothing has weight, and legs that push with 100 N each WHEN two seconds pass THEN
    // nothing is said of the stated mass: the push may be an acceleration's
    hexload_config_t config = paper_machine();
    config.gravity_m_s2 = HEXLOAD_REAL(0.0);
    bench_t bench;
    begin(&bench, config, HEXLOAD_KIND_PAPER, at_rest());
    for (uint32_t tick = 0; tick < 2 * SECOND; tick++) {
        hexload_leg_sample_t sample = {.tick = tick};
        for (int leg = 0; leg < 6; leg++) {
            sample.force_n[leg] = (hexload_real_t)(100.0 + 5.0 * normal(&bench.seed));
        }
        TEST_ASSERT_EQUAL_INT(HEXLOAD_OK,
                              hexload_tick(&bench.estimator, &bench.config, &sample, &bench.estimate));
    }
    TEST_ASSERT_EQUAL_INT(HEXLOAD_INPUT_PLAUSIBLE, fault_of(&bench).cause);
}

static void test_what_frozen_rows_have_left_is_forgotten_when_the_source_is_in_order_again(void) {
    // GIVEN a momentum estimator of either kind whose source has shown the same sample for half a second
    const hexload_kind_t kinds[] = {HEXLOAD_KIND_MOMENTUM, HEXLOAD_KIND_MOMENTUM_EFFECTS};
    for (int n = 0; n < 2; n++) {
        bench_t bench;
        begin(&bench, paper_machine(), kinds[n], random_motion(31, 0.05, 0.1));
        bench.change = rows_frozen_for_half_a_second;
        run(&bench, 3 * SECOND);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_INPUT_ROWS_REPEATED, fault_of(&bench).cause);
        TEST_ASSERT_EQUAL_UINT32(0, hexload_health(&bench.estimator)->count[HEXLOAD_HEALTH_FILTER_RESTARTED]);
        // WHEN ten windows of 0.53 s have gone by without THEN it begins anew, once, and says so
        run(&bench, 7 * SECOND);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_INPUT_PLAUSIBLE, fault_of(&bench).cause);
        TEST_ASSERT_EQUAL_UINT32(1, hexload_health(&bench.estimator)->count[HEXLOAD_HEALTH_FILTER_RESTARTED]);
    }
}

int main(int argc, char** argv) {
    seeds = argc > 1 ? strtoull(argv[1], NULL, 10) : seeds;
    UNITY_BEGIN();
    RUN_TEST(test_what_frozen_rows_have_left_is_forgotten_when_the_source_is_in_order_again);
    RUN_TEST(test_swapped_sensors_are_named_at_one_of_their_legs);
    RUN_TEST(test_a_saturated_velocity_is_found_at_its_leg);
    RUN_TEST(test_a_force_that_does_not_hold_the_platform_is_named_while_it_moves_slowly_or_rests);
    RUN_TEST(test_ordinary_tolerances_of_sensors_are_no_fault);
    RUN_TEST(test_a_commissioned_delay_is_no_fault);
    RUN_TEST(test_without_velocity_sensors_velocities_say_nothing);
    RUN_TEST(test_a_fault_stays_until_ten_windows_of_motion_show_none);
    RUN_TEST(test_missing_samples_are_no_fault);
    RUN_TEST(test_a_stated_mass_that_the_legs_do_not_carry_is_never_converged);
    RUN_TEST(test_force_sensors_within_their_tolerance_are_no_wrong_mass);
    RUN_TEST(test_forces_that_are_wrong_are_not_called_inconsistent);
    RUN_TEST(test_a_load_that_is_exchanged_is_no_longer_the_told_one);
    RUN_TEST(test_every_cause_has_words_of_its_own);
    RUN_TEST(test_samples_that_wait_for_late_channels_begin_a_block_anew);
    RUN_TEST(test_without_gravity_no_mass_is_wrong);
    RUN_TEST(test_what_contradicts_the_displacement_is_named);
    RUN_TEST(test_sensors_in_order_are_never_a_fault);
    return UNITY_END();
}
