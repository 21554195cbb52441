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

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_velocities_at_a_lower_rate_that_are_held_are_found_after_sixteen_of_them);
    RUN_TEST(test_velocities_in_order_or_in_steps_are_not_held);
    RUN_TEST(test_a_sensor_that_stops_is_found_at_once);
    RUN_TEST(test_sensors_in_order_have_not_stopped);
    RUN_TEST(test_sensors_that_stand_still_together_say_that_the_machine_does);
    RUN_TEST(test_a_sensor_that_goes_on_again_counts_until_its_jump_is_forgotten);
    RUN_TEST(test_a_displacement_that_jumps_has_stopped);
    return UNITY_END();
}
