#include "machine.h"
#include "momentum/frozen_channels.h"

#include <math.h>

void setUp(void) {}
void tearDown(void) {}

enum { DISPLACEMENT, VELOCITY, FORCE, ALL };

/// Legs that move at 0.1 m/s and shake, with noise, for 100 ticks, then for some more
/// with a channel of leg 3 that has stopped, then with all again, 20 sigma further. @return whether it was
/// found at the last tick.
static bool show_again(int stopped, int more_ticks, double step_m, int again_ticks) {
    hexload_config_t config = paper_machine();
    hexload_frozen_channels_t frozen = {.missed_m = {HEXLOAD_REAL(0.0)}};
    hexload_leg_sample_t last = {.tick = 0};
    uint64_t seed = 3;
    for (int tick = 0; tick < 100 + more_ticks + again_ticks; tick++) {
        hexload_leg_sample_t sample = {.tick = (uint32_t)tick};
        const double later = tick < 100 + more_ticks ? 0.0 : 1.0;
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            const double noisy_m = 1e-4 * (double)tick + 2e-5 * normal(&seed);
            sample.displacement_m[leg] =
                (hexload_real_t)(step_m > 0.0 ? step_m * floor(noisy_m / step_m) : noisy_m);
            sample.velocity_m_s[leg] = (hexload_real_t)(0.1 + 0.02 * later + 1e-3 * normal(&seed));
            sample.force_n[leg] = (hexload_real_t)(1000.0 + 100.0 * later + 10.0 * normal(&seed));
        }
        if (tick >= 100 && tick < 100 + more_ticks) {
            sample.displacement_m[3] =
                stopped == DISPLACEMENT ? last.displacement_m[3] : sample.displacement_m[3];
            sample.velocity_m_s[3] = stopped == VELOCITY ? last.velocity_m_s[3] : sample.velocity_m_s[3];
            sample.force_n[3] = stopped == FORCE ? last.force_n[3] : sample.force_n[3];
        }
        hexload_frozen_channels_step(&frozen, &config, &sample);
        last = sample;
    }
    return hexload_frozen_channels_are_there(&frozen);
}

static bool show(int stopped, int more_ticks, double step_m) {
    return show_again(stopped, more_ticks, step_m, 0);
}

static void test_a_sensor_that_stops_is_found_at_once(void) {
    // GIVEN a displacement that stops at 0.1 m/s, 7 sigma of 20 um being 1.4 ticks, or a velocity or a force
    // that does WHEN two ticks have repeated it THEN it is found
    for (int stopped = DISPLACEMENT; stopped < ALL; stopped++) {
        TEST_ASSERT_TRUE(show(stopped, 2, 0.0));
    }
}

static void test_a_sensor_that_dies_is_found_with_its_first_zero(void) {
    // GIVEN a velocity or a force of leg 3 that is 7.1 or 6.9 sigma from zero, or from a value of that size
    const hexload_config_t config = paper_machine();
    for (int n = 0; n < 8; n++) {
        const bool is_force = n & 1, is_far = n & 2, is_dead = n & 4;
        const double sigma =
            (double)(is_force ? config.sensors.force_sigma_n : config.sensors.velocity_sigma_m_s);
        hexload_frozen_channels_t frozen = {.left_s = HEXLOAD_REAL(0.0)};
        hexload_leg_sample_t sample = {.tick = 1};
        hexload_real_t* channel = is_force ? sample.force_n : sample.velocity_m_s;
        hexload_real_t* last = is_force ? frozen.last.force_n : frozen.last.velocity_m_s;
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            channel[leg] = (hexload_real_t)((5.0 + leg) * sigma);
        }
        last[3] = (hexload_real_t)((is_far ? 7.1 : 6.9) * sigma) + (is_dead ? HEXLOAD_REAL(0.0) : channel[3]);
        channel[3] = is_dead ? HEXLOAD_REAL(0.0) : channel[3];
        // WHEN the next sample has it, and the other legs' change THEN it has stopped if that is zero and far
        hexload_frozen_channels_step(&frozen, &config, &sample);
        TEST_ASSERT_EQUAL_INT(is_far && is_dead, hexload_frozen_channels_are_there(&frozen));
        // AND a loose plug that makes contact again at once counts for 0.2 s, as that is a jump too
        TEST_ASSERT_DOUBLE_WITHIN(1e-6, is_far && is_dead ? 0.2 : -1e-3, (double)frozen.left_s);
    }
}

static void test_sensors_in_order_have_not_stopped(void) {
    // GIVEN sensors with noise, and an encoder in steps of 0.1 mm, which repeats its value at every other
    // tick WHEN some time goes by THEN none has stopped
    for (int ticks = 0; ticks < 100; ticks++) {
        TEST_ASSERT_FALSE(show(ALL, ticks, 0.0));
        TEST_ASSERT_FALSE(show(ALL, ticks, 1e-4));
    }
}

static void test_sensors_that_stand_still_together_say_that_the_machine_does(void) {
    for (int moving = 0; moving <= HEXLOAD_LEGS; moving++) {
        // GIVEN forces and velocities of which the first `moving` change, and the others do not
        const hexload_config_t config = paper_machine();
        hexload_frozen_channels_t frozen = {.missed_m = {HEXLOAD_REAL(0.0)}};
        for (uint32_t tick = 0; tick < 10; tick++) {
            hexload_leg_sample_t sample = {.tick = tick};
            for (int leg = 0; leg < moving; leg++) {
                sample.force_n[leg] = (hexload_real_t)(tick + 1);
                sample.velocity_m_s[leg] = HEXLOAD_REAL(1e-3) * (hexload_real_t)(tick + 1);
                sample.displacement_m[leg] = HEXLOAD_REAL(1e-6) * (hexload_real_t)tick;
            }
            hexload_frozen_channels_step(&frozen, &config, &sample);
        }
        // WHEN they are asked THEN one has stopped if three or more change while it does not
        TEST_ASSERT_EQUAL(moving >= 3 && moving < HEXLOAD_LEGS, hexload_frozen_channels_are_there(&frozen));
    }
}

static void test_a_sensor_that_goes_on_again_counts_until_its_jump_is_forgotten(void) {
    // GIVEN a sensor that has stood still for 20 ticks WHEN it goes on elsewhere THEN it
    // counts for 0.2 s, and no longer
    for (int stopped = DISPLACEMENT; stopped < ALL; stopped++) {
        TEST_ASSERT_TRUE(show_again(stopped, 20, 0.0, 1));
        TEST_ASSERT_TRUE(show_again(stopped, 20, 0.0, 190));
        TEST_ASSERT_FALSE(show_again(stopped, 20, 0.0, 210));
    }
    // AND one that has repeated its value twice, as chance does, does not count any more
    TEST_ASSERT_FALSE(show_again(VELOCITY, 2, 0.0, 1));
    TEST_ASSERT_FALSE(show_again(FORCE, 2, 0.0, 1));
}

static void test_steps_of_a_displacement_stand_still_at_rest(void) {
    // GIVEN legs at rest, displacements in steps that are larger than their noise, and a velocity whose zero
    // is off by a tenth of its noise, so that in 3 s it goes by more than 7 sigma
    const hexload_config_t config = paper_machine();
    hexload_frozen_channels_t frozen = {.missed_m = {HEXLOAD_REAL(0.0)}};
    uint64_t seed = 6;
    for (uint32_t tick = 0; tick < 3000; tick++) {
        hexload_leg_sample_t sample = {.tick = tick};
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            sample.displacement_m[leg] = (hexload_real_t)(1e-3 * round(leg + 0.02 * normal(&seed)));
            sample.velocity_m_s[leg] = (hexload_real_t)(1e-4 + 1e-3 * normal(&seed));
            sample.force_n[leg] = (hexload_real_t)(5.0 * normal(&seed));
        }
        // WHEN they stand THEN none has stopped, but for the first sample, before which all were zero
        hexload_frozen_channels_step(&frozen, &config, &sample);
        TEST_ASSERT_FALSE(tick > 200 && hexload_frozen_channels_are_there(&frozen));
    }
    // AND a displacement that is missing once and then stops while all move is found as any
    for (uint32_t tick = 3000; tick < 3010; tick++) {
        hexload_leg_sample_t sample = {.tick = tick};
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            sample.displacement_m[leg] = (hexload_real_t)(1e-3 * leg + 1e-4 * (tick - 2999));
            sample.velocity_m_s[leg] = HEXLOAD_REAL(0.1);
            sample.force_n[leg] = (hexload_real_t)(5.0 * normal(&seed));
        }
        sample.displacement_m[4] = tick == 3002 ? (hexload_real_t)NAN : HEXLOAD_REAL(4e-3);
        hexload_frozen_channels_step(&frozen, &config, &sample);
    }
    TEST_ASSERT_TRUE(hexload_frozen_channels_are_there(&frozen));
    TEST_ASSERT_FALSE(isnan(frozen.missed_m[4]));
}

static void test_a_displacement_that_jumps_has_stopped(void) {
    // GIVEN legs at rest, with three times the stated noise WHEN one jumps by 2 mm, 100 sigma of 20 um
    const hexload_config_t config = paper_machine();
    hexload_frozen_channels_t frozen = {.missed_m = {HEXLOAD_REAL(0.0)}};
    hexload_leg_sample_t sample = {.tick = 0};
    uint64_t seed = 5;
    for (uint32_t tick = 0; tick < 1000; tick++) {
        sample.tick = tick;
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            sample.displacement_m[leg] = (hexload_real_t)(6e-5 * normal(&seed));
            sample.velocity_m_s[leg] = (hexload_real_t)(1e-3 * normal(&seed));
            sample.force_n[leg] = (hexload_real_t)(5.0 * normal(&seed));
        }
        hexload_frozen_channels_step(&frozen, &config, &sample);
        TEST_ASSERT_FALSE(hexload_frozen_channels_are_there(&frozen));
    }
    sample.tick++;
    sample.displacement_m[2] += HEXLOAD_REAL(2e-3);
    hexload_frozen_channels_step(&frozen, &config, &sample);
    // THEN it is found at once
    TEST_ASSERT_TRUE(hexload_frozen_channels_are_there(&frozen));
}

/// Velocities of noise on 0.1 m/s, each held for `held` ticks and in steps of `step_m_s`, over `ticks`, after
/// `before` others that are held for two. @return the tick at which they counted as held for the first time
/// of those `ticks`, -1: never; `last`: whether they did at the last.
static int held_from(int before, int ticks, int held, double step_m_s, bool* last) {
    const hexload_config_t config = paper_machine();
    hexload_frozen_channels_t frozen = {.missed_m = {HEXLOAD_REAL(0.0)}};
    hexload_leg_sample_t sample = {.tick = 0};
    uint64_t seed = 9;
    int first = -1;
    for (int tick = -before; tick < ticks; tick++) {
        sample.tick++;
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            const double m_s = 0.1 + 1e-3 * normal(&seed);
            if (tick % (tick < 0 ? 2 : held) == 0) {
                sample.velocity_m_s[leg] =
                    (hexload_real_t)(step_m_s > 0.0 ? step_m_s * floor(m_s / step_m_s) : m_s);
            }
            sample.force_n[leg] = (hexload_real_t)(5.0 * normal(&seed));
        }
        hexload_frozen_channels_step(&frozen, &config, &sample);
        *last = hexload_frozen_channels_are_held(&frozen);
        first = tick >= 0 && first < 0 && *last ? tick : first;
    }
    return first;
}

static void test_velocities_at_a_lower_rate_that_are_held_are_found_after_sixteen_of_them(void) {
    bool last;
    // GIVEN velocities that change together every second, third or tenth tick, from tick 0 on
    for (int held = 2; held <= 10; held += held == 2 ? 1 : 7) {
        // WHEN the sixteenth change that follows a standstill has come THEN they are held
        TEST_ASSERT_EQUAL_INT(16 * held, held_from(0, 20 * held, held, 0.0, &last));
        TEST_ASSERT_TRUE(last);
    }
    // AND when they come at each tick again after a second THEN they are not, once what there was at most,
    // 248, has come down to below 128
    TEST_ASSERT_EQUAL_INT(0, held_from(1000, 121, 1, 0.0, &last));
    TEST_ASSERT_TRUE(last);
    (void)held_from(1000, 122, 1, 0.0, &last);
    TEST_ASSERT_FALSE(last);
}

static void test_velocities_in_order_or_in_steps_are_not_held(void) {
    bool last;
    // GIVEN velocities of each tick, with noise, or in steps of 1, 2, 3 and 5 sigma, or of one value
    const double steps_m_s[] = {0.0, 1e-3, 2e-3, 3e-3, 5e-3, 1.0};
    for (size_t k = 0; k < sizeof steps_m_s / sizeof *steps_m_s; k++) {
        // WHEN ten seconds go by THEN they never count as held
        TEST_ASSERT_EQUAL_INT(-1, held_from(0, 10000, 1, steps_m_s[k], &last));
    }
}

static void test_a_way_that_is_missed_is_summed_and_of_one_that_is_gone_an_eighth_counts(void) {
    // GIVEN legs with a speed, of which every other one repeats its displacement
    const hexload_config_t config = paper_machine();
    for (uint32_t gap = 1; gap <= 3; gap += 2) {
        hexload_frozen_channels_t frozen = {.last = {.tick = 10}};
        hexload_leg_sample_t sample = {.tick = 10 + gap};
        double expected_m[HEXLOAD_LEGS];
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            const double speed_m_s = 0.01 * (leg + 1), moved_m = leg % 2 == 0 ? 0.0 : 1e-3 * leg;
            const double way_m = (double)config.tick_s * gap * speed_m_s;
            frozen.missed_m[leg] = (hexload_real_t)(1e-5 * leg);
            frozen.last.displacement_m[leg] = HEXLOAD_REAL(0.25);
            sample.displacement_m[leg] = (hexload_real_t)(0.25 + moved_m);
            sample.velocity_m_s[leg] = (hexload_real_t)speed_m_s;
            expected_m[leg] = leg % 2 == 0 ? 1e-5 * leg + way_m : (way_m - moved_m) / 8.0;
        }
        // WHEN a sample comes after one tick or three THEN ways are those of the time that has gone by
        hexload_frozen_channels_step(&frozen, &config, &sample);
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(1, 0.25), expected_m[leg], (double)frozen.missed_m[leg]);
        }
        TEST_ASSERT_EQUAL_MEMORY(&sample, &frozen.last, sizeof sample);
    }
}

static void test_a_jump_is_seven_sigma_of_a_channel_that_has_stood_still_for_nine_ticks(void) {
    // GIVEN a velocity or a force that has repeated its value so often, alone or as the machine does
    const hexload_config_t config = paper_machine();
    for (int n = 0; n < 32; n++) {
        const bool is_force = n & 1, has_stood = n & 2, had_stopped = n & 4, is_far = n & 8;
        const double jump = (n & 16 ? -1.0 : 1.0) * (is_far ? 7.1 : 6.9);
        hexload_frozen_channels_t frozen = {.still_ticks = had_stopped ? 9 : 8, .left_s = HEXLOAD_REAL(0.05)};
        hexload_leg_sample_t sample = {.tick = 1};
        uint8_t* still_ticks = is_force ? frozen.still_force_ticks : frozen.still_velocity_ticks;
        hexload_real_t* channel = is_force ? sample.force_n : sample.velocity_m_s;
        still_ticks[0] = 9;
        still_ticks[3] = has_stood ? 9 : 8;
        channel[3] = (hexload_real_t)jump *
                     (is_force ? config.sensors.force_sigma_n : config.sensors.velocity_sigma_m_s);
        // WHEN it goes on THEN 0.2 s begin if all of it is so, and else what is left of them runs out
        hexload_frozen_channels_step(&frozen, &config, &sample);
        const double left_s = has_stood && had_stopped && is_far ? 0.2 : 0.05 - (double)config.tick_s;
        TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(2, 0.2), left_s, (double)frozen.left_s);
        // AND its count begins anew, and others go on up to nine
        TEST_ASSERT_EQUAL_UINT8(0, still_ticks[3]);
        TEST_ASSERT_EQUAL_UINT8(1, still_ticks[5]);
        TEST_ASSERT_EQUAL_UINT8(9, still_ticks[0]);
        TEST_ASSERT_EQUAL_UINT8(0, frozen.still_ticks);
    }
}

static void test_seven_sigma_of_a_missed_way_count_in_either_direction(void) {
    // GIVEN a leg whose displacement has missed a way while three others go on WHEN that is more than 7 sigma
    // THEN it counts for 0.2 s
    const hexload_config_t config = paper_machine();
    static const double sigmas[4] = {6.9, 7.1, -6.9, -7.1};
    for (int n = 0; n < 4; n++) {
        hexload_frozen_channels_t frozen = {.left_s = HEXLOAD_REAL(0.0)};
        const hexload_leg_sample_t sample = {.tick = 1, .displacement_m = {1e-9F, 1e-9F, 1e-9F}};
        frozen.missed_m[5] = (hexload_real_t)sigmas[n] * config.sensors.displacement_sigma_m;
        hexload_frozen_channels_step(&frozen, &config, &sample);
        TEST_ASSERT_EQUAL_INT(n % 2 == 1, hexload_frozen_channels_are_there(&frozen));
    }
}

static void test_a_kind_of_which_three_legs_change_has_the_longest_stop_of_the_others(void) {
    // GIVEN velocities and forces that have stood still for some ticks WHEN three legs of one kind change
    // THEN the longer of the stops of both counts, and from its second tick on
    const hexload_config_t config = paper_machine();
    for (uint8_t velocity_ticks = 0; velocity_ticks < 3; velocity_ticks++) {
        for (uint8_t force_ticks = 0; force_ticks < 3; force_ticks++) {
            hexload_frozen_channels_t frozen = {.left_s = HEXLOAD_REAL(0.0)};
            hexload_leg_sample_t sample = {.tick = 1};
            frozen.still_velocity_ticks[4] = velocity_ticks;
            frozen.still_force_ticks[1] = force_ticks;
            for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
                const bool has_velocity = leg < 3, has_force = leg >= 3;
                sample.velocity_m_s[leg] = has_velocity ? config.sensors.velocity_sigma_m_s : 0;
                sample.force_n[leg] = has_force ? config.sensors.force_sigma_n : 0;
            }
            hexload_frozen_channels_step(&frozen, &config, &sample);
            const int longest = 1 + (velocity_ticks > force_ticks ? velocity_ticks : force_ticks);
            TEST_ASSERT_EQUAL_INT(longest, frozen.still_ticks);
            TEST_ASSERT_EQUAL_INT(longest >= 2, hexload_frozen_channels_are_there(&frozen));
        }
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_velocities_at_a_lower_rate_that_are_held_are_found_after_sixteen_of_them);
    RUN_TEST(test_velocities_in_order_or_in_steps_are_not_held);
    RUN_TEST(test_a_sensor_that_stops_is_found_at_once);
    RUN_TEST(test_a_sensor_that_dies_is_found_with_its_first_zero);
    RUN_TEST(test_sensors_in_order_have_not_stopped);
    RUN_TEST(test_sensors_that_stand_still_together_say_that_the_machine_does);
    RUN_TEST(test_a_sensor_that_goes_on_again_counts_until_its_jump_is_forgotten);
    RUN_TEST(test_steps_of_a_displacement_stand_still_at_rest);
    RUN_TEST(test_a_displacement_that_jumps_has_stopped);
    RUN_TEST(test_a_way_that_is_missed_is_summed_and_of_one_that_is_gone_an_eighth_counts);
    RUN_TEST(test_a_jump_is_seven_sigma_of_a_channel_that_has_stood_still_for_nine_ticks);
    RUN_TEST(test_seven_sigma_of_a_missed_way_count_in_either_direction);
    RUN_TEST(test_a_kind_of_which_three_legs_change_has_the_longest_stop_of_the_others);
    return UNITY_END();
}
