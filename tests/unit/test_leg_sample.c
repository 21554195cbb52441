#include "front_end/leg_sample.h"
#include "machine.h"

void setUp(void) {}
void tearDown(void) {}

static hexload_status_t check_after(uint32_t last_tick, const hexload_leg_sample_t* sample,
                                    uint32_t* gap_ticks, uint32_t* health) {
    const hexload_config_t config = paper_machine();
    const hexload_leg_sample_t last = {.tick = last_tick};
    hexload_leg_gate_t gate;
    hexload_leg_sample_init(&gate);
    hexload_leg_sample_accept(&gate, &last);
    *health = 0;
    return hexload_leg_sample_check(&gate, &config, sample, gap_ticks, health);
}

static void test_leg_sample_refuses_a_channel_that_is_not_finite(void) {
    const hexload_config_t config = paper_machine();
    hexload_leg_gate_t gate;
    hexload_leg_sample_init(&gate);
    for (int channel = 0; channel < 3; channel++) {
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            // GIVEN a sample with one NaN or infinity
            hexload_leg_sample_t sample = {0};
            hexload_real_t* channels[3] = {sample.displacement_m, sample.velocity_m_s, sample.force_n};
            channels[channel][leg] = leg % 2 == 0 ? (hexload_real_t)NAN : (hexload_real_t)INFINITY;
            // WHEN it is checked THEN it is refused
            uint32_t gap_ticks = 0, health = 0;
            TEST_ASSERT_EQUAL_INT(HEXLOAD_ERR_SAMPLE,
                                  hexload_leg_sample_check(&gate, &config, &sample, &gap_ticks, &health));
        }
    }
}

static void test_leg_sample_refuses_a_leg_without_length(void) {
    const hexload_config_t config = paper_machine();
    hexload_leg_gate_t gate;
    hexload_leg_sample_init(&gate);
    hexload_leg_sample_t sample = {0};
    sample.displacement_m[4] = HEXLOAD_REAL(-0.8742);
    uint32_t gap_ticks = 0, health = 0;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_ERR_SAMPLE,
                          hexload_leg_sample_check(&gate, &config, &sample, &gap_ticks, &health));
    sample.displacement_m[4] = -config.geometry.home_leg_length_m[4]; // no length at all
    TEST_ASSERT_EQUAL_INT(HEXLOAD_ERR_SAMPLE,
                          hexload_leg_sample_check(&gate, &config, &sample, &gap_ticks, &health));
}

static void test_leg_sample_refuses_what_no_sensor_of_the_machine_can_say(void) {
    const hexload_config_t config = paper_machine();
    hexload_leg_gate_t gate;
    uint32_t gap_ticks = 0, health = 0;
    hexload_leg_sample_init(&gate);
    hexload_leg_sample_t fast = {0}, strong = {0}, edge = {0};
    fast.velocity_m_s[1] = HEXLOAD_REAL(-10.1);
    strong.force_n[5] = HEXLOAD_REAL(1.01e6);
    edge.velocity_m_s[1] = HEXLOAD_REAL(-10.0);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_ERR_SAMPLE,
                          hexload_leg_sample_check(&gate, &config, &fast, &gap_ticks, &health));
    TEST_ASSERT_EQUAL_INT(HEXLOAD_ERR_SAMPLE,
                          hexload_leg_sample_check(&gate, &config, &strong, &gap_ticks, &health));
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_leg_sample_check(&gate, &config, &edge, &gap_ticks, &health));
}

static void test_leg_sample_says_when_a_leg_is_beyond_its_stroke(void) {
    const hexload_config_t config = paper_machine();
    hexload_leg_gate_t gate;
    hexload_leg_sample_t sample = {.tick = 8};
    uint32_t gap_ticks = 0, health = 0;
    hexload_leg_sample_init(&gate);
    const hexload_real_t beyond_m[2] = {HEXLOAD_REAL(0.31), HEXLOAD_REAL(-0.31)};
    for (int n = 0; n < 2; n++) {
        sample.displacement_m[2] = beyond_m[n];
        health = 0;
        TEST_ASSERT_EQUAL_INT(HEXLOAD_OK,
                              hexload_leg_sample_check(&gate, &config, &sample, &gap_ticks, &health));
        TEST_ASSERT_EQUAL_UINT32(1u << HEXLOAD_HEALTH_LEG_OUT_OF_STROKE, health);
        // and not at its end
        sample.displacement_m[2] = n == 0 ? config.geometry.stroke_max_m : config.geometry.stroke_min_m;
        health = 0;
        TEST_ASSERT_EQUAL_INT(HEXLOAD_OK,
                              hexload_leg_sample_check(&gate, &config, &sample, &gap_ticks, &health));
        TEST_ASSERT_EQUAL_UINT32(0, health);
    }
}

static void test_leg_sample_refuses_a_leg_that_has_moved_faster_than_its_range(void) {
    // GIVEN a machine whose legs are said to reach 10 m/s, and one sample at home
    hexload_leg_sample_t sample = {.tick = 8};
    uint32_t gap_ticks = 0, health = 0;
    // WHEN a leg is 11 mm away after a tick, as after a spike of its sensor THEN the sample is refused
    sample.displacement_m[4] = HEXLOAD_REAL(-0.011);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_ERR_SAMPLE, check_after(7, &sample, &gap_ticks, &health));
    // and taken when it had two ticks for that, or went 9.9 mm
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, check_after(6, &sample, &gap_ticks, &health));
    sample.displacement_m[4] = HEXLOAD_REAL(-0.0099);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, check_after(7, &sample, &gap_ticks, &health));
    // AND ten sigma of 20 um are granted beyond
    sample.displacement_m[4] = HEXLOAD_REAL(-0.01019);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, check_after(7, &sample, &gap_ticks, &health));
    sample.displacement_m[4] = HEXLOAD_REAL(-0.01021);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_ERR_SAMPLE, check_after(7, &sample, &gap_ticks, &health));
}

static void test_leg_sample_counts_the_ticks_since_the_last(void) {
    const hexload_leg_sample_t next = {.tick = 8}, late = {.tick = 12};
    uint32_t gap_ticks = 0, health = 0;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, check_after(7, &next, &gap_ticks, &health));
    TEST_ASSERT_EQUAL_UINT32(1, gap_ticks);
    TEST_ASSERT_EQUAL_UINT32(0, health);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, check_after(7, &late, &gap_ticks, &health));
    TEST_ASSERT_EQUAL_UINT32(5, gap_ticks);
    TEST_ASSERT_EQUAL_UINT32(1u << HEXLOAD_HEALTH_SAMPLE_MISSING, health);
}

static void test_leg_sample_refuses_time_that_stands_still_or_runs_backwards(void) {
    const hexload_leg_sample_t same = {.tick = 7}, earlier = {.tick = 6};
    uint32_t gap_ticks = 0, health = 0;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_ERR_TICK, check_after(7, &same, &gap_ticks, &health));
    TEST_ASSERT_EQUAL_INT(HEXLOAD_ERR_TICK, check_after(7, &earlier, &gap_ticks, &health));
}

static void test_leg_sample_goes_on_when_the_tick_counter_wraps(void) {
    const hexload_leg_sample_t wrapped = {.tick = 0};
    uint32_t gap_ticks = 0, health = 0;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, check_after(UINT32_MAX, &wrapped, &gap_ticks, &health));
    TEST_ASSERT_EQUAL_UINT32(1, gap_ticks);
}

static void test_first_leg_sample_may_have_any_tick(void) {
    const hexload_config_t config = paper_machine();
    hexload_leg_gate_t gate;
    hexload_leg_sample_init(&gate);
    const hexload_leg_sample_t sample = {.tick = 3000000000u};
    uint32_t gap_ticks = 99, health = 0;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_leg_sample_check(&gate, &config, &sample, &gap_ticks, &health));
    TEST_ASSERT_EQUAL_UINT32(0, gap_ticks);
}

static void test_the_count_of_accepted_samples_stays_at_its_end(void) {
    // GIVEN a gate after 2^32 - 1 samples WHEN one more is accepted THEN it is none that has seen no sample
    const hexload_leg_sample_t sample = {.tick = 7};
    hexload_leg_gate_t gate = {.last_tick = 6, .accepted = UINT32_MAX};
    hexload_leg_sample_accept(&gate, &sample);
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, gate.accepted);
    TEST_ASSERT_EQUAL_UINT32(7, gate.last_tick);
}

static void test_a_tick_is_later_up_to_half_of_what_a_counter_holds(void) {
    // GIVEN ticks that are later than the last by half of 2^32 at most, over the counter's end too, and by
    // one more, which is as well one of before WHEN they are checked THEN the first are a gap, the others
    // refused
    static const uint32_t lasts[] = {0, 5, UINT32_MAX - 1};
    for (size_t n = 0; n < sizeof lasts / sizeof *lasts; n++) {
        uint32_t gap_ticks = 0, health = 0;
        const hexload_leg_sample_t later = {.tick = lasts[n] + UINT32_MAX / 2};
        const hexload_leg_sample_t before = {.tick = lasts[n] + UINT32_MAX / 2 + 1};
        TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, check_after(lasts[n], &later, &gap_ticks, &health));
        TEST_ASSERT_EQUAL_UINT32(UINT32_MAX / 2, gap_ticks);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_ERR_TICK, check_after(lasts[n], &before, &gap_ticks, &health));
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_tick_is_later_up_to_half_of_what_a_counter_holds);
    RUN_TEST(test_leg_sample_refuses_a_channel_that_is_not_finite);
    RUN_TEST(test_leg_sample_refuses_a_leg_without_length);
    RUN_TEST(test_leg_sample_refuses_what_no_sensor_of_the_machine_can_say);
    RUN_TEST(test_leg_sample_says_when_a_leg_is_beyond_its_stroke);
    RUN_TEST(test_leg_sample_refuses_a_leg_that_has_moved_faster_than_its_range);
    RUN_TEST(test_leg_sample_counts_the_ticks_since_the_last);
    RUN_TEST(test_leg_sample_refuses_time_that_stands_still_or_runs_backwards);
    RUN_TEST(test_leg_sample_goes_on_when_the_tick_counter_wraps);
    RUN_TEST(test_first_leg_sample_may_have_any_tick);
    RUN_TEST(test_the_count_of_accepted_samples_stays_at_its_end);
    return UNITY_END();
}
