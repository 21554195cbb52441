/// Windows of the plausibility stage, which is shown legs one by one: no pose holds them together.
#include "front_end/plausibility.h"
#include "machine.h"

#include <math.h>
#include <string.h>

void setUp(void) {}
void tearDown(void) {}

enum { WINDOW_TICKS = 32 * 16 + 9 }; ///< 32 blocks, and a stage of the evaluation at each of nine ticks

static const double weight_n = (100.0 + 312.0) * 9.81 / 6.0; ///< on each leg

typedef struct stage {
    hexload_config_t config;
    hexload_plausibility_t self;
    hexload_motion_t motion;
    uint32_t tick;
    uint32_t gap_ticks;    ///< of every sample
    double amplitude_m[6]; ///< of sines of 1 Hz
    double gain[6];        ///< displacement over velocity's integral
    double lag_s;          ///< of velocities
    double force_n;        ///< of each leg, straight up
    bool is_repeated;      ///< every other sample is the one before
    hexload_input_fault_t fault;
} stage_t;

/// Legs of which `moving` move, by 0.1 m.
static stage_t stage_of(int moving) {
    stage_t stage;
    memset(&stage, 0, sizeof stage);
    stage.config = paper_machine();
    hexload_plausibility_init(&stage.self);
    stage.gap_ticks = 1;
    stage.force_n = weight_n;
    for (int leg = 0; leg < 6; leg++) {
        stage.motion.J[leg][2] = HEXLOAD_REAL(1.0);
        stage.amplitude_m[leg] = leg < moving ? 0.1 : 0.0;
        stage.gain[leg] = 1.0;
    }
    return stage;
}

static void set_gains(stage_t* stage, double gain) {
    for (int leg = 0; leg < 6; leg++) {
        stage->gain[leg] = gain;
    }
}

static void show_sample(stage_t* stage, const hexload_leg_sample_t* sample) {
    const hexload_present_tick_t now = {.sample = sample,
                                        .motion = &stage->motion,
                                        .sensors = stage->config.sensors,
                                        .gap_ticks = stage->tick == 0 ? 0 : stage->gap_ticks};
    hexload_estimate_t estimate = {.tick = 0};
    uint32_t health = 0;
    hexload_plausibility_step(&stage->self, &stage->config, sample, &now, HEXLOAD_REAL(0.0));
    hexload_plausibility_judge(&stage->self, 4, &estimate, &stage->fault, &health);
}

static hexload_real_t force_at(const stage_t* stage, uint32_t tick) { // changes at every tick, as noise does
    return (hexload_real_t)(stage->force_n + 0.5 * (double)(tick % 4));
}

static void show(stage_t* stage, uint32_t samples) {
    const double w = 2.0 * 3.14159265358979;
    for (uint32_t n = 0; n < samples; n++) {
        hexload_leg_sample_t sample = {.tick = stage->tick};
        const uint32_t shown = stage->is_repeated ? stage->tick / 2 * 2 : stage->tick;
        const double t_s = 1e-3 * shown;
        for (int leg = 0; leg < 6; leg++) {
            const double a = stage->amplitude_m[leg];
            sample.displacement_m[leg] = (hexload_real_t)(a * sin(w * t_s + leg));
            sample.velocity_m_s[leg] =
                (hexload_real_t)(a * w * cos(w * (t_s - stage->lag_s) + leg) / stage->gain[leg]);
            sample.force_n[leg] = force_at(stage, shown);
        }
        show_sample(stage, &sample);
        stage->tick += stage->gap_ticks;
    }
}

static void check_fault(const stage_t* stage, hexload_input_cause_t cause, uint32_t leg) {
    TEST_ASSERT_EQUAL_INT(cause, stage->fault.cause);
    TEST_ASSERT_EQUAL_UINT32(leg, stage->fault.leg);
}

static void test_one_gain_is_the_clocks_only_if_enough_legs_have_it(void) {
    // GIVEN one gain of all legs, of 5 % WHEN four or more move THEN it is the clock's; of three it is one
    // leg's
    for (int legs = 3; legs <= 6; legs++) {
        stage_t stage = stage_of(legs);
        set_gains(&stage, 0.95);
        show(&stage, 4 * WINDOW_TICKS);
        TEST_ASSERT_EQUAL_INT(legs < 4 ? HEXLOAD_INPUT_VELOCITY_GAIN : HEXLOAD_INPUT_CLOCK,
                              stage.fault.cause);
        TEST_ASSERT_EQUAL(legs < 4, stage.fault.leg < 6);
    }
}

static void test_a_gain_near_that_of_the_others_is_its_legs_own_while_they_are_in_order(void) {
    // GIVEN gains within 2 % of each other, of which the largest is within 2 % of one, or the least within
    // 1 %, and that of leg 2 is not WHEN they are looked at THEN that leg is named, not the clock
    const double gains[2][2] = {{0.975, 0.981}, {1.025, 1.009}}; // of leg 2, of the others
    for (int n = 0; n < 2; n++) {
        stage_t stage = stage_of(6);
        set_gains(&stage, gains[n][1]);
        stage.gain[2] = gains[n][0];
        show(&stage, 8 * WINDOW_TICKS);
        check_fault(&stage, HEXLOAD_INPUT_VELOCITY_GAIN, 2);
    }
}

static void test_of_gain_and_lag_the_one_that_explains_more_is_named(void) {
    // GIVEN a gain of 2.5 %, and a lag of 10 ms, which at 1 Hz is 2 pi 0.01 = 6.3 %, or one of 3 ms, 1.9 %
    // WHEN they are looked at THEN it is a lag, or a gain
    const double lag_s[2] = {0.010, 0.003};
    for (int n = 0; n < 2; n++) {
        stage_t stage = stage_of(1);
        stage.lag_s = lag_s[n];
        stage.gain[0] = 1.025;
        show(&stage, 8 * WINDOW_TICKS);
        check_fault(&stage, n == 0 ? HEXLOAD_INPUT_VELOCITY_LAG : HEXLOAD_INPUT_VELOCITY_GAIN, 0);
    }
}

static void test_a_large_gain_is_no_other_legs_velocity(void) {
    // GIVEN a velocity 18 % too large, which leaves less than a twentieth unexplained WHEN it is looked at
    // THEN it is a gain: no other leg and no other sign leaves half as much
    stage_t stage = stage_of(6);
    stage.gain[2] = 1.0 / 1.18;
    show(&stage, 8 * WINDOW_TICKS);
    check_fault(&stage, HEXLOAD_INPUT_VELOCITY_GAIN, 2);
}

static void test_what_is_too_small_or_too_alike_to_tell_says_nothing(void) {
    for (int n = 0; n < 2; n++) {
        // GIVEN 31 ways of 58.3 um without a velocity, twice their noise of sqrt(2 20^2 + 16) um, so that all
        // of it may be noise; or a velocity that grows by 8 % in each block, of which way and change are
        // alike
        stage_t stage = stage_of(6);
        for (uint32_t count = 0; count < WINDOW_TICKS + 1; count++) {
            hexload_leg_sample_t sample = {.tick = stage.tick};
            const double t_s = 1e-3 * (stage.self.stage == 0 ? 16 * stage.self.blocks + stage.self.ticks : 0);
            const double way_m = stage.self.blocks % 2 == 0 ? 58.3e-6 : 0.0;
            for (int leg = 0; leg < 6; leg++) {
                sample.displacement_m[leg] = (hexload_real_t)(n == 0 ? way_m : 0.01 * exp(t_s / 0.2));
                sample.velocity_m_s[leg] = (hexload_real_t)(n == 0 ? 0.0 : 0.05 * exp(t_s / 0.2));
                sample.force_n[leg] = force_at(&stage, stage.tick);
            }
            show_sample(&stage, &sample);
            stage.tick++;
            // WHEN they are looked at THEN nothing is wrong, and nothing could have been shown
            TEST_ASSERT_EQUAL_INT(HEXLOAD_INPUT_PLAUSIBLE, stage.fault.cause);
            TEST_ASSERT_FALSE(stage.self.could_show);
        }
        TEST_ASSERT_TRUE(stage.self.has_moved);
    }
}

/// Fills the rest of a window and evaluates it.
static void end_window(stage_t* stage) {
    while (stage->self.stage == 0) {
        show(stage, 1);
    }
    while (stage->self.stage != 0) {
        show(stage, 1);
    }
}

static void check_count(stage_t* stage, hexload_input_cause_t cause, uint8_t strikes) {
    end_window(stage);
    TEST_ASSERT_EQUAL_UINT8(cause, stage->self.seen_cause);
    TEST_ASSERT_EQUAL_UINT8(strikes, stage->self.strikes);
}

static void test_another_cause_begins_its_own_count(void) {
    // GIVEN three windows of a wrong clock, which has no leg, WHEN the legs then pull for three, and carry
    // too little for two THEN each begins at one: four windows of forces must say the same
    stage_t stage = stage_of(6);
    set_gains(&stage, 0.95);
    for (uint8_t n = 1; n <= 3; n++) {
        check_count(&stage, HEXLOAD_INPUT_CLOCK, n);
    }
    set_gains(&stage, 1.0);
    stage.force_n = -weight_n;
    for (uint8_t n = 1; n <= 3; n++) {
        check_count(&stage, HEXLOAD_INPUT_FORCES_NEGATED, n);
    }
    stage.force_n = 0.1 * weight_n;
    check_count(&stage, HEXLOAD_INPUT_FORCES_LIGHT, 1);
    check_count(&stage, HEXLOAD_INPUT_FORCES_LIGHT, 2);
    // AND a window without takes one back
    stage.force_n = weight_n;
    check_count(&stage, HEXLOAD_INPUT_FORCES_LIGHT, 1);
    check_count(&stage, HEXLOAD_INPUT_PLAUSIBLE, 0);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_INPUT_CLOCK, stage.fault.cause); // for ten windows
}

static void test_a_fault_of_forces_goes_at_rest_too(void) {
    // GIVEN legs that pull, at rest WHEN four windows have shown it THEN it is said
    stage_t stage = stage_of(0);
    stage.force_n = -weight_n;
    for (int n = 0; n < 4; n++) {
        TEST_ASSERT_EQUAL_INT(HEXLOAD_INPUT_PLAUSIBLE, stage.fault.cause);
        end_window(&stage);
    }
    check_fault(&stage, HEXLOAD_INPUT_FORCES_NEGATED, 6);
    // AND WHEN they push THEN it is gone after ten windows: forces show it at rest
    stage.force_n = weight_n;
    for (int n = 0; n < 10; n++) {
        check_fault(&stage, HEXLOAD_INPUT_FORCES_NEGATED, 6);
        end_window(&stage);
    }
    TEST_ASSERT_EQUAL_INT(HEXLOAD_INPUT_PLAUSIBLE, stage.fault.cause);
}

static void test_a_fault_gets_another_name_when_two_windows_give_it(void) {
    // GIVEN a gain of leg 2 that is reported
    stage_t stage = stage_of(6);
    stage.gain[2] = 1.05;
    for (int n = 0; n < 8; n++) {
        end_window(&stage);
    }
    check_fault(&stage, HEXLOAD_INPUT_VELOCITY_GAIN, 2);
    // WHEN its velocity has the other sign THEN one window leaves the name, and the next one gives it that
    stage.gain[2] = -1.0;
    stage.gap_ticks = 9; // longer than what is bridged: no block has both in it
    show(&stage, 1);
    stage.gap_ticks = 1;
    end_window(&stage);
    TEST_ASSERT_EQUAL_UINT8(HEXLOAD_INPUT_VELOCITY_SIGN, stage.self.seen_cause);
    check_fault(&stage, HEXLOAD_INPUT_VELOCITY_GAIN, 2);
    end_window(&stage);
    check_fault(&stage, HEXLOAD_INPUT_VELOCITY_SIGN, 2);
    // AND WHEN it is leg 4's instead THEN that is named, at its turn, as soon as two windows say so
    stage.gain[2] = 1.0;
    stage.gain[4] = -1.0;
    for (int n = 0; n < 7; n++) {
        end_window(&stage);
    }
    check_fault(&stage, HEXLOAD_INPUT_VELOCITY_SIGN, 4);
    // AND samples that repeat those before are a fact, which one window tells
    stage.is_repeated = true;
    end_window(&stage);
    check_fault(&stage, HEXLOAD_INPUT_ROWS_REPEATED, 6);
}

static void test_work_waits_for_ticks_whose_poses_are_easy(void) {
    // GIVEN a window that is full WHEN poses take three steps or more THEN its evaluation waits
    stage_t stage = stage_of(6);
    stage.gain[2] = 1.05;
    while (stage.self.stage != 3) {
        show(&stage, 1);
    }
    stage.motion.newton_steps = 3;
    show(&stage, 40);
    TEST_ASSERT_EQUAL_UINT8(3, stage.self.stage);
    // AND goes on with those of two, and finds what is wrong
    stage.motion.newton_steps = 2;
    show(&stage, 1);
    TEST_ASSERT_EQUAL_UINT8(4, stage.self.stage);
    show(&stage, 8 * WINDOW_TICKS);
    check_fault(&stage, HEXLOAD_INPUT_VELOCITY_GAIN, 2);
}

static void test_gaps_during_the_evaluation_leave_no_block_too_long(void) {
    const uint8_t stages[2] = {4, 9}; // at which gaps of 8 and 6 have made 16 ticks
    for (int n = 0; n < 2; n++) {
        // GIVEN a window that is being evaluated, with gaps in it
        stage_t stage = stage_of(6);
        while (stage.self.stage == 0) {
            show(&stage, 1);
        }
        while (stage.self.stage != 0) {
            const bool is_long = stage.self.stage == stages[n];
            stage.gap_ticks = is_long ? 8 : stage.self.stage == 3 && n == 0 ? 6 : 1;
            show(&stage, 1);
        }
        stage.gap_ticks = 1;
        // WHEN it goes on THEN no block counts more than its ticks and a gap, and nothing is found
        for (uint32_t tick = 0; tick < 8 * WINDOW_TICKS; tick++) {
            show(&stage, 1);
            TEST_ASSERT_LESS_OR_EQUAL_UINT8(24, stage.self.ticks);
        }
        TEST_ASSERT_EQUAL_INT(HEXLOAD_INPUT_PLAUSIBLE, stage.fault.cause);
    }
}

static void test_a_lag_counts_from_two_ticks_on_and_a_gain_from_two_per_cent(void) {
    // GIVEN a lag, or a gain, a quarter above or below what sensors in order have WHEN it is looked at THEN
    // it is named, or not
    const double lag_s[4] = {0.0025, 0.0015, 0.0, 0.0}, gain[4] = {1.0, 1.0, 1.025, 1.015};
    const hexload_input_cause_t causes[4] = {HEXLOAD_INPUT_VELOCITY_LAG, HEXLOAD_INPUT_PLAUSIBLE,
                                             HEXLOAD_INPUT_VELOCITY_GAIN, HEXLOAD_INPUT_PLAUSIBLE};
    for (int n = 0; n < 4; n++) {
        stage_t stage = stage_of(1);
        stage.lag_s = lag_s[n];
        stage.gain[0] = gain[n];
        show(&stage, 8 * WINDOW_TICKS);
        TEST_ASSERT_EQUAL_INT(causes[n], stage.fault.cause);
    }
}

static void test_the_acceleration_of_a_window_is_the_twists_change_over_31_blocks(void) {
    // GIVEN a platform that speeds up by 2 m/s^2 WHEN a window is full THEN that is its acceleration: from
    // the eighth tick of its first block to that of its last
    stage_t stage = stage_of(6);
    while (stage.self.stage == 0) {
        stage.motion.twist[1] = (hexload_real_t)(2e-3 * stage.tick);
        show(&stage, 1);
    }
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, 2.0, (double)stage.self.acceleration[1]);
}

static void test_at_the_start_no_leg_is_at_fault(void) {
    // GIVEN a stage that has just started WHEN its first sample is judged THEN nothing is wrong with no leg
    stage_t stage = stage_of(6);
    show(&stage, 1);
    check_fault(&stage, HEXLOAD_INPUT_PLAUSIBLE, 6);
}

static void test_every_leg_has_its_turn_while_all_are_in_order(void) {
    // GIVEN six legs that move and are in order WHEN six windows go by THEN each has been looked at once
    stage_t stage = stage_of(6);
    uint32_t seen = 0;
    for (int window = 0; window < 6; window++) {
        const uint32_t turn = stage.self.turn;
        TEST_ASSERT_EQUAL_HEX32(0, seen & 1u << turn);
        seen |= 1u << turn;
        while (stage.self.turn == turn && stage.tick < 6 * WINDOW_TICKS) {
            show(&stage, 1);
        }
    }
    TEST_ASSERT_EQUAL_HEX32(0x3F, seen);
}

static void test_forces_are_negated_from_half_the_platforms_weight_and_light_up_to_seven_tenths(void) {
    // GIVEN legs whose forces are together a share of the platform's weight, with a sign WHEN it rests THEN
    // they are negated below -1/2, light below 0.7, and plausible above
    const double shares[] = {-1.0, -0.52, -0.48, -0.05, 0.0, 0.05, 0.68, 0.72};
    const hexload_input_cause_t causes[] = {HEXLOAD_INPUT_FORCES_NEGATED, HEXLOAD_INPUT_FORCES_NEGATED,
                                            HEXLOAD_INPUT_FORCES_LIGHT,   HEXLOAD_INPUT_FORCES_LIGHT,
                                            HEXLOAD_INPUT_FORCES_LIGHT,   HEXLOAD_INPUT_FORCES_LIGHT,
                                            HEXLOAD_INPUT_FORCES_LIGHT,   HEXLOAD_INPUT_PLAUSIBLE};
    for (int n = 0; n < 8; n++) {
        stage_t stage = stage_of(0);
        const double own_n = (double)(stage.config.platform.mass_kg * stage.config.gravity_m_s2);
        stage.force_n = shares[n] * own_n / 6.0;
        show(&stage, 6 * WINDOW_TICKS);
        check_fault(&stage, causes[n], 6);
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_one_gain_is_the_clocks_only_if_enough_legs_have_it);
    RUN_TEST(test_a_gain_near_that_of_the_others_is_its_legs_own_while_they_are_in_order);
    RUN_TEST(test_of_gain_and_lag_the_one_that_explains_more_is_named);
    RUN_TEST(test_a_large_gain_is_no_other_legs_velocity);
    RUN_TEST(test_what_is_too_small_or_too_alike_to_tell_says_nothing);
    RUN_TEST(test_another_cause_begins_its_own_count);
    RUN_TEST(test_a_fault_of_forces_goes_at_rest_too);
    RUN_TEST(test_a_fault_gets_another_name_when_two_windows_give_it);
    RUN_TEST(test_work_waits_for_ticks_whose_poses_are_easy);
    RUN_TEST(test_gaps_during_the_evaluation_leave_no_block_too_long);
    RUN_TEST(test_a_lag_counts_from_two_ticks_on_and_a_gain_from_two_per_cent);
    RUN_TEST(test_the_acceleration_of_a_window_is_the_twists_change_over_31_blocks);
    RUN_TEST(test_at_the_start_no_leg_is_at_fault);
    RUN_TEST(test_every_leg_has_its_turn_while_all_are_in_order);
    RUN_TEST(test_forces_are_negated_from_half_the_platforms_weight_and_light_up_to_seven_tenths);
    return UNITY_END();
}
