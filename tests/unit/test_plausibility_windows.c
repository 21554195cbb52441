/// Windows of the plausibility stage, which is shown legs one by one: no pose holds them together.
#include "front_end/noise_estimator.h"
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
    hexload_noise_estimator_t noise;
    uint32_t tick;
    uint32_t gap_ticks;    ///< of every sample
    double amplitude_m[6]; ///< of sines of 1 Hz
    double gain[6];        ///< displacement over velocity's integral
    double lag_s;          ///< of velocities
    double phase_rad[6];   ///< of the sines
    double turned_rad[6];  ///< by which the velocity's is ahead of the displacement's
    double effective_m;    ///< measured sigma of displacements; 0: the stated one
    double jitter_m;       ///< by which displacements are off at the end of every other block
    double force_n;        ///< of each leg, straight up
    double share[6];       ///< of it, by leg
    uint32_t period[6];    ///< ticks after which a force changes, as noise does at each; 0: it stands still
    uint32_t at[6];        ///< tick of such a period at which it does
    bool is_repeated;      ///< every other sample is the one before
    hexload_input_fault_t fault;
} stage_t;

/// Legs of which `moving` move, by 0.1 m.
static stage_t stage_of(int moving) {
    stage_t stage;
    memset(&stage, 0, sizeof stage);
    stage.config = paper_machine();
    hexload_plausibility_init(&stage.self);
    hexload_noise_estimator_init(&stage.noise);
    stage.gap_ticks = 1;
    stage.force_n = weight_n;
    for (int leg = 0; leg < 6; leg++) {
        stage.motion.J[leg][2] = HEXLOAD_REAL(1.0);
        stage.phase_rad[leg] = leg;
        stage.share[leg] = 1.0;
        stage.period[leg] = 1;
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
    hexload_present_tick_t now = {.sample = sample,
                                  .motion = &stage->motion,
                                  .sensors = stage->config.sensors,
                                  .noise = &stage->noise,
                                  .gap_ticks = stage->tick == 0 ? 0 : stage->gap_ticks};
    hexload_estimate_t estimate = {.tick = 0};
    uint32_t health = 0;
    if (stage->effective_m > 0.0) {
        now.sensors.displacement_sigma_m = (hexload_real_t)stage->effective_m;
    }
    hexload_plausibility_step(&stage->self, &stage->config, sample, &now, HEXLOAD_REAL(0.0));
    hexload_plausibility_judge(&stage->self, 4, &estimate, &stage->fault, &health);
}

static hexload_real_t force_at(const stage_t* stage, int leg, uint32_t tick) {
    const uint32_t period = stage->period[leg];
    const uint32_t changes = period == 0 ? 0 : (tick + period - stage->at[leg]) / period;
    return (hexload_real_t)(stage->share[leg] * stage->force_n + 0.5 * (double)(changes % 4));
}

/// Of displacements: ways of 1 or -1 by the Thue-Morse sequence, in which there is no gain and no lag.
static double jitter_at(const hexload_plausibility_t* self) {
    int ones = 0;
    for (uint32_t bits = self->blocks; bits != 0; bits >>= 1) {
        ones += (int)(bits & 1u);
    }
    return self->blocks % 2 == 1 || self->ticks == 0 ? 0.0 : ones % 2 == 0 ? 1.0 : -1.0;
}

static void show(stage_t* stage, uint32_t samples) {
    const double w = 2.0 * 3.14159265358979;
    for (uint32_t n = 0; n < samples; n++) {
        hexload_leg_sample_t sample = {.tick = stage->tick};
        const uint32_t shown = stage->is_repeated ? stage->tick / 2 * 2 : stage->tick;
        const double t_s = 1e-3 * shown;
        for (int leg = 0; leg < 6; leg++) {
            const double a = stage->amplitude_m[leg], phase = stage->phase_rad[leg];
            const double off_m = stage->jitter_m * jitter_at(&stage->self);
            sample.displacement_m[leg] = (hexload_real_t)(a * sin(w * t_s + phase) + off_m);
            sample.velocity_m_s[leg] =
                (hexload_real_t)(a * w * cos(w * (t_s - stage->lag_s) + phase + stage->turned_rad[leg]) /
                                 stage->gain[leg]);
            sample.force_n[leg] = force_at(stage, leg, shown);
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
    const double gains[3][2] = {{0.975, 0.981}, {1.025, 1.009}, {1.025, 1.012}}; // of leg 2, of the others
    for (int n = 0; n < 3; n++) {
        stage_t stage = stage_of(6);
        set_gains(&stage, gains[n][1]);
        stage.gain[2] = gains[n][0];
        show(&stage, 8 * WINDOW_TICKS);
        if (n < 2) {
            check_fault(&stage, HEXLOAD_INPUT_VELOCITY_GAIN, 2);
        } else { // AND the clock when all are farther off
            check_fault(&stage, HEXLOAD_INPUT_CLOCK, 6);
        }
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
                sample.force_n[leg] = force_at(&stage, leg, stage.tick);
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

static void test_an_evaluation_takes_nine_ticks(void) {
    // GIVEN a window that is full WHEN it is evaluated THEN a tick is for each leg, and three for the rest
    stage_t stage = stage_of(6);
    while (stage.self.stage == 0) {
        show(&stage, 1);
    }
    for (uint8_t n = 1; n <= 9; n++) {
        TEST_ASSERT_EQUAL_UINT8(n, stage.self.stage);
        show(&stage, 1);
    }
    TEST_ASSERT_EQUAL_UINT8(0, stage.self.stage);
}

static void test_gaps_of_eight_ticks_are_bridged_and_longer_ones_begin_anew(void) {
    for (uint32_t gap = 7; gap <= 9; gap++) {
        stage_t stage = stage_of(6);
        show(&stage, 3);
        TEST_ASSERT_EQUAL_UINT8(2, stage.self.ticks);
        stage.gap_ticks = gap;
        show(&stage, 1);
        TEST_ASSERT_EQUAL_UINT8(gap <= 8 ? 2 + gap : 0, stage.self.ticks);
    }
}

static void test_a_sample_that_is_not_complete_begins_a_block_anew(void) {
    // GIVEN a block that has begun WHEN a sample waits for late channels THEN the next one begins another
    stage_t stage = stage_of(6);
    const hexload_leg_sample_t sample = {.tick = 3};
    const hexload_present_tick_t waiting = {.sensors = stage.config.sensors, .gap_ticks = 1};
    show(&stage, 3);
    hexload_plausibility_step(&stage.self, &stage.config, &sample, &waiting, HEXLOAD_REAL(0.0));
    TEST_ASSERT_FALSE(stage.self.has_begun);
    show(&stage, 1);
    TEST_ASSERT_TRUE(stage.self.has_begun);
    TEST_ASSERT_EQUAL_UINT8(0, stage.self.ticks);
}

static void test_forces_are_looked_at_where_little_has_weight(void) {
    // GIVEN a base with a twentieth of the earth's gravity, and legs that pull WHEN a window is over THEN
    // that is seen
    stage_t stage = stage_of(0);
    stage.config.gravity_m_s2 = HEXLOAD_REAL(0.5);
    stage.force_n = -weight_n;
    end_window(&stage);
    TEST_ASSERT_EQUAL_UINT8(HEXLOAD_INPUT_FORCES_NEGATED, stage.self.seen_cause);
}

static void test_one_sample_in_twenty_may_repeat_the_one_before(void) {
    // GIVEN one leg that moves, each in turn, a window in order, and then 25 or 26 samples in each of two
    // windows that repeat those before WHEN one is over THEN the latter are said to
    for (int n = 0; n < 12; n++) {
        const uint32_t repeated = n < 6 ? 25 : 26;
        stage_t stage = stage_of(0);
        stage.amplitude_m[n % 6] = 0.1; // which is fast enough in all but some ticks, when no sample repeats
        end_window(&stage);
        for (int window = 0; window < 2; window++) {
            stage.is_repeated = true;
            show(&stage, 2 * repeated);
            stage.is_repeated = false;
            TEST_ASSERT_EQUAL_UINT8(repeated, stage.self.repeated);
            end_window(&stage);
            check_fault(&stage, repeated < 26 ? HEXLOAD_INPUT_PLAUSIBLE : HEXLOAD_INPUT_ROWS_REPEATED, 6);
        }
    }
}

static void test_a_force_that_stands_still_is_named_at_its_leg(void) {
    // GIVEN a force that stands still while the legs move WHEN two windows have gone by THEN it is named
    for (int leg = 0; leg < 6; leg++) {
        stage_t stage = stage_of(6);
        stage.period[leg] = 0;
        end_window(&stage);
        check_fault(&stage, HEXLOAD_INPUT_PLAUSIBLE, 6);
        end_window(&stage);
        check_fault(&stage, HEXLOAD_INPUT_FORCE_STUCK, (uint32_t)leg);
        // AND WHEN it changes again THEN the next window does not show it
        stage.period[leg] = 1;
        end_window(&stage);
        TEST_ASSERT_EQUAL_UINT8(HEXLOAD_INPUT_PLAUSIBLE, stage.self.seen_cause);
    }
}

static void test_a_fault_that_is_nearly_gone_keeps_its_name_until_two_windows_give_another(void) {
    // GIVEN a gain of leg 2 that was mended so long ago that it is reported for two windows more
    stage_t stage = stage_of(6);
    stage.gain[2] = 1.05;
    while (stage.fault.cause == HEXLOAD_INPUT_PLAUSIBLE) {
        end_window(&stage);
    }
    stage.gain[2] = 1.0;
    while (stage.self.hold > 2) {
        end_window(&stage);
    }
    // WHEN its velocity has the other sign in one window and another leg's in the next one, each in blocks of
    // their own
    const double gains[] = {-1.0, 1.0}, turned_rad[] = {0.0, 1.6};
    for (int n = 0; n < 2; n++) {
        stage.self.turn = 2;
        stage.gain[2] = gains[n];
        stage.turned_rad[2] = turned_rad[n];
        stage.self.has_begun = false;
        end_window(&stage);
        TEST_ASSERT_EQUAL_UINT8(n + 1, stage.self.strikes);
        // THEN it is a gain still
        check_fault(&stage, HEXLOAD_INPUT_VELOCITY_GAIN, 2);
    }
    TEST_ASSERT_TRUE(stage.self.seen_cause != HEXLOAD_INPUT_VELOCITY_SIGN);
    TEST_ASSERT_TRUE(stage.self.seen_cause != HEXLOAD_INPUT_VELOCITY_GAIN);
}

static void test_a_force_stands_still_when_64_ticks_leave_it_and_three_others_change(void) {
    // GIVEN forces that change at a tick of a period of theirs WHEN a window is over, whose blocks end at
    // each sixteenth tick, THEN one stands still that has not changed for 64, while three have within three
    const struct {
        uint32_t period[6], at[6];
        uint32_t leg;
    } cases[] = {
        {{64, 1, 1, 1, 1, 1}, {1}, 6},  // 63 at most
        {{80, 1, 1, 1, 1, 1}, {16}, 0}, // 64
        {{0, 0, 0, 1, 1, 1}, {0}, 2},   // of several the last
        {{1, 1, 1, 0, 0, 0}, {0}, 5},
        {{1, 1, 0, 0, 0, 0}, {0}, 6},
        {{16, 16, 16, 0, 16, 16}, {13, 13, 13, 0, 13, 13}, 3},
        {{16, 16, 16, 0, 16, 16}, {12, 12, 12, 0, 12, 12}, 6},
    };
    for (size_t n = 0; n < sizeof cases / sizeof *cases; n++) {
        stage_t stage = stage_of(6);
        memcpy(stage.period, cases[n].period, sizeof stage.period);
        memcpy(stage.at, cases[n].at, sizeof stage.at);
        end_window(&stage);
        TEST_ASSERT_EQUAL_UINT8(cases[n].leg < 6 ? HEXLOAD_INPUT_FORCE_STUCK : HEXLOAD_INPUT_PLAUSIBLE,
                                stage.self.seen_cause);
        TEST_ASSERT_TRUE(cases[n].leg == 6 || stage.self.seen_leg == cases[n].leg);
    }
}

static void test_samples_may_repeat_while_no_leg_is_faster_than_ten_sigma(void) {
    // GIVEN a leg that is said to move by 1 % less or more than ten sigma, either way WHEN two samples are
    // the same THEN the second repeats the first if it is more: a sensor may show rest twice
    for (int n = 0; n < 24; n++) {
        stage_t stage = stage_of(0);
        const double sigmas = n < 12 ? 9.9 : 10.1, sign = n % 2 == 0 ? 1.0 : -1.0;
        hexload_leg_sample_t sample = {.tick = 0};
        sample.force_n[0] = HEXLOAD_REAL(700.0);
        sample.velocity_m_s[n / 2 % 6] = (hexload_real_t)(sign * sigmas * 1e-3);
        show_sample(&stage, &sample);
        stage.tick++;
        show_sample(&stage, &sample);
        TEST_ASSERT_EQUAL_UINT8(n < 12 ? 0 : 1, stage.self.repeated);
        // AND none does in which one displacement, or one force, is another
        sample.displacement_m[n % 6] += HEXLOAD_REAL(1e-5);
        stage.tick++;
        show_sample(&stage, &sample);
        sample.force_n[n % 6] += HEXLOAD_REAL(1.0);
        stage.tick++;
        show_sample(&stage, &sample);
        TEST_ASSERT_EQUAL_UINT8(n < 12 ? 0 : 1, stage.self.repeated);
    }
}

/// Sum of the squares of leg 0's ways over the blocks of a first window, about their mean.
static double motion_of(const stage_t* stage) {
    double sum = 0.0, squares = 0.0;
    for (int block = 0; block < 32; block++) {
        const double w = 2.0 * 3.14159265358979 * 0.016, a = stage->amplitude_m[0];
        const double way_m = a * (sin(w * (block + 1)) - sin(w * block));
        sum += way_m / 32.0;
        squares += way_m * way_m;
    }
    return squares - 32.0 * sum * sum;
}

static void test_what_velocities_leave_unexplained_counts_from_a_fiftieth_on(void) {
    // GIVEN ways of which a share is the displacement's alone, of a velocity in order, or of the other sign
    // WHEN they are looked at THEN up to 2 % it is no more than a displacement that its velocity does not
    // explain, and the sign of what leaves 5 % at most
    const struct {
        double share, gain;
        hexload_input_cause_t cause;
    } cases[] = {{0.017, 1.0, HEXLOAD_INPUT_VELOCITY_OTHER},
                 {0.025, 1.0, HEXLOAD_INPUT_VELOCITY_GAIN},
                 {0.042, -1.0, HEXLOAD_INPUT_VELOCITY_SIGN},
                 {0.062, -1.0, HEXLOAD_INPUT_VELOCITY_GAIN}};
    for (size_t n = 0; n < sizeof cases / sizeof *cases; n++) {
        stage_t stage = stage_of(1);
        stage.gain[0] = cases[n].gain;
        stage.jitter_m = sqrt(cases[n].share * motion_of(&stage) / 32.0);
        end_window(&stage);
        TEST_ASSERT_EQUAL_UINT8(cases[n].cause, stage.self.seen_cause);
    }
}

static void test_what_a_gain_and_a_lag_leave_counts_beyond_noise_and_a_hundredth_of_the_motion(void) {
    // GIVEN ways of which some is the displacement's alone, less or more than 1 % of the motion's amplitude
    // and three variances of noise, with sensors of the stated noise, or of less, as filtered ones look WHEN
    // they are looked at THEN it counts beyond
    for (int n = 0; n < 8; n++) {
        stage_t stage = stage_of(1);
        const bool is_more = n & 1, is_slow = n & 2;
        const double sigma_m = (double)stage.config.sensors.displacement_sigma_m, velocity_m = 1e-3 * 1e-3;
        stage.amplitude_m[0] = is_slow ? 0.02 : 0.1;
        stage.effective_m = n & 4 ? 0.1 * sigma_m : 0.0;
        const double noise = 32.0 * (2.0 * sigma_m * sigma_m + 16.0 * velocity_m * velocity_m);
        const double limit = 1e-4 * motion_of(&stage) + 3.0 * noise;
        stage.jitter_m = sqrt((is_more ? 1.2 : 0.9) * limit / 32.0);
        end_window(&stage);
        TEST_ASSERT_EQUAL_UINT8(is_more ? HEXLOAD_INPUT_VELOCITY_OTHER : HEXLOAD_INPUT_PLAUSIBLE,
                                stage.self.seen_cause);
    }
}

static void test_a_velocity_within_a_tenth_of_its_own_displacement_is_no_other_legs(void) {
    // GIVEN leg 2 that moves as leg 4 does, shows another velocity, and leg 4's is off by 8 or by 12 % WHEN
    // leg 2 is looked at THEN leg 4's velocity is taken for its own if it is not leg 4's
    for (int n = 0; n < 4; n++) {
        stage_t stage = stage_of(6);
        const bool is_off = n % 2 == 1;
        stage.self.turn = 2;
        stage.phase_rad[2] = stage.phase_rad[4];
        stage.turned_rad[2] = 1.6;
        stage.gain[4] = n < 2 ? (is_off ? 1.12 : 1.08) : (is_off ? 0.88 : 0.92);
        end_window(&stage);
        TEST_ASSERT_EQUAL_UINT8(2, stage.self.seen_leg);
        TEST_ASSERT_EQUAL_INT(is_off, stage.self.seen_cause == HEXLOAD_INPUT_VELOCITY_SWAPPED);
    }
}

static void test_a_dead_force_counts_when_a_twentieth_of_the_weight_is_out_of_balance(void) {
    // GIVEN two legs that lean against each other, of which one shows no force, so that sidewards its lean
    // times its force is missing, of the other five's weight WHEN it is looked at THEN it is said to be dead
    // from a twentieth on
    const double leans[] = {0.24, 0.26};
    for (int n = 0; n < 4; n++) {
        stage_t stage = stage_of(0);
        const int along = n / 2; // x or y
        stage.motion.J[0][along] = (hexload_real_t)leans[n % 2];
        stage.motion.J[1][along] = (hexload_real_t)-leans[n % 2];
        stage.share[0] = 0.0;
        end_window(&stage);
        TEST_ASSERT_EQUAL_UINT8(n % 2 == 0 ? HEXLOAD_INPUT_PLAUSIBLE : HEXLOAD_INPUT_FORCE_DEAD,
                                stage.self.seen_cause);
    }
}

static void test_a_fault_goes_after_ten_windows_in_which_any_leg_moves(void) {
    // GIVEN a fault of leg 0 that has been mended WHEN it alone moves on, so that most windows look at one
    // that rests, or all move by so little that none is screened THEN ten windows without the fault suffice
    for (int n = 0; n < 2; n++) {
        stage_t stage = stage_of(n == 0 ? 1 : 6);
        stage.config.sensors.velocity_sigma_m_s = HEXLOAD_REAL(0.005);
        stage.gain[0] = -1.0;
        while (stage.fault.cause == HEXLOAD_INPUT_PLAUSIBLE) {
            end_window(&stage);
        }
        check_fault(&stage, HEXLOAD_INPUT_VELOCITY_SIGN, 0);
        stage.gain[0] = 1.0;
        for (int leg = 0; leg < 6; leg++) {
            stage.amplitude_m[leg] = n == 0 ? stage.amplitude_m[leg] : 0.003;
        }
        stage.tick += 8;
        stage.gap_ticks = 9; // longer than what is bridged: no block has both in it
        show(&stage, 1);
        stage.tick -= 8;
        stage.gap_ticks = 1;
        for (int window = 0; window < 10; window++) {
            check_fault(&stage, HEXLOAD_INPUT_VELOCITY_SIGN, 0);
            end_window(&stage);
            TEST_ASSERT_EQUAL_UINT8(n == 0 ? 1 : 0, stage.self.moving);
        }
        check_fault(&stage, HEXLOAD_INPUT_PLAUSIBLE, 6);
    }
}

static void test_a_hundredth_of_the_motion_is_none(void) {
    // GIVEN displacements of 0.098 or 0.103 of their velocities' ways, or the other way round, squares below
    // and above a hundredth, or of 0.15, where a leg that rests leaves less unexplained WHEN they are looked
    // at THEN one stands still, or they are of different size
    const double gains[] = {0.098, 0.103, 1.0 / 0.098, 1.0 / 0.103, 0.15};
    const hexload_input_cause_t causes[] = {HEXLOAD_INPUT_DISPLACEMENT_STUCK, HEXLOAD_INPUT_VELOCITY_GAIN,
                                            HEXLOAD_INPUT_VELOCITY_STUCK, HEXLOAD_INPUT_VELOCITY_GAIN,
                                            HEXLOAD_INPUT_VELOCITY_GAIN};
    for (int n = 0; n < 5; n++) {
        stage_t stage = stage_of(1);
        stage.gain[0] = gains[n];
        end_window(&stage);
        end_window(&stage);
        check_fault(&stage, causes[n], 0);
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

static void test_a_block_of_poses_that_take_long_counts_once(void) {
    // GIVEN a window of which one block, the first or a later one, begins with 20 poses that take three steps
    // WHEN it is full THEN its mean of the forces upwards is theirs, to the half newton by which they change
    for (int n = 0; n < 2; n++) {
        stage_t stage = stage_of(6);
        while (n == 1 && stage.self.blocks < 3) {
            show(&stage, 1);
        }
        stage.motion.newton_steps = 3;
        show(&stage, 20);
        stage.motion.newton_steps = 2;
        while (stage.self.stage == 0) {
            show(&stage, 1);
        }
        TEST_ASSERT_DOUBLE_WITHIN(6.0, 6.0 * (weight_n + 0.75), (double)stage.self.wrench[3]);
    }
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

static void test_forces_whose_noise_is_another_units_are_quiet(void) {
    // GIVEN forces with a tenth of their noise, which is white WHEN four windows have gone by THEN they are
    // quiet, of all legs, and where they are light too, they are light: that is the more certain
    for (int n = 0; n < 2; n++) {
        stage_t stage = stage_of(6);
        stage.noise.ratio[2] = stage.noise.ratio[3] = HEXLOAD_REAL(0.01);
        stage.force_n = n == 0 ? weight_n : 0.1 * weight_n;
        for (int window = 0; window < 4; window++) {
            TEST_ASSERT_EQUAL_INT(HEXLOAD_INPUT_PLAUSIBLE, stage.fault.cause);
            end_window(&stage);
        }
        check_fault(&stage, n == 0 ? HEXLOAD_INPUT_FORCES_QUIET : HEXLOAD_INPUT_FORCES_LIGHT, 6);
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_one_gain_is_the_clocks_only_if_enough_legs_have_it);
    RUN_TEST(test_a_gain_near_that_of_the_others_is_its_legs_own_while_they_are_in_order);
    RUN_TEST(test_of_gain_and_lag_the_one_that_explains_more_is_named);
    RUN_TEST(test_a_large_gain_is_no_other_legs_velocity);
    RUN_TEST(test_what_is_too_small_or_too_alike_to_tell_says_nothing);
    RUN_TEST(test_an_evaluation_takes_nine_ticks);
    RUN_TEST(test_gaps_of_eight_ticks_are_bridged_and_longer_ones_begin_anew);
    RUN_TEST(test_a_sample_that_is_not_complete_begins_a_block_anew);
    RUN_TEST(test_forces_are_looked_at_where_little_has_weight);
    RUN_TEST(test_one_sample_in_twenty_may_repeat_the_one_before);
    RUN_TEST(test_a_force_that_stands_still_is_named_at_its_leg);
    RUN_TEST(test_a_force_stands_still_when_64_ticks_leave_it_and_three_others_change);
    RUN_TEST(test_samples_may_repeat_while_no_leg_is_faster_than_ten_sigma);
    RUN_TEST(test_what_velocities_leave_unexplained_counts_from_a_fiftieth_on);
    RUN_TEST(test_what_a_gain_and_a_lag_leave_counts_beyond_noise_and_a_hundredth_of_the_motion);
    RUN_TEST(test_a_velocity_within_a_tenth_of_its_own_displacement_is_no_other_legs);
    RUN_TEST(test_a_dead_force_counts_when_a_twentieth_of_the_weight_is_out_of_balance);
    RUN_TEST(test_a_fault_that_is_nearly_gone_keeps_its_name_until_two_windows_give_another);
    RUN_TEST(test_a_fault_goes_after_ten_windows_in_which_any_leg_moves);
    RUN_TEST(test_a_hundredth_of_the_motion_is_none);
    RUN_TEST(test_another_cause_begins_its_own_count);
    RUN_TEST(test_a_fault_of_forces_goes_at_rest_too);
    RUN_TEST(test_a_fault_gets_another_name_when_two_windows_give_it);
    RUN_TEST(test_work_waits_for_ticks_whose_poses_are_easy);
    RUN_TEST(test_a_block_of_poses_that_take_long_counts_once);
    RUN_TEST(test_gaps_during_the_evaluation_leave_no_block_too_long);
    RUN_TEST(test_a_lag_counts_from_two_ticks_on_and_a_gain_from_two_per_cent);
    RUN_TEST(test_the_acceleration_of_a_window_is_the_twists_change_over_31_blocks);
    RUN_TEST(test_at_the_start_no_leg_is_at_fault);
    RUN_TEST(test_every_leg_has_its_turn_while_all_are_in_order);
    RUN_TEST(test_forces_are_negated_from_half_the_platforms_weight_and_light_up_to_seven_tenths);
    RUN_TEST(test_forces_whose_noise_is_another_units_are_quiet);
    return UNITY_END();
}
