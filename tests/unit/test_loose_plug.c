#include "momentum/loose_plug.h"
#include "motion.h"

#include <math.h>

void setUp(void) {}
void tearDown(void) {}

/// At 50 mm at tick 4.
static hexload_leg_gate_t gate_before(void) {
    hexload_leg_gate_t gate = {.last_tick = 4, .accepted = 1};
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        gate.last_displacement_m[leg] = HEXLOAD_REAL(0.05);
    }
    return gate;
}

/// There at tick 5, but for one leg, with its speed.
static hexload_leg_sample_t shown(int leg, double displacement_m, double velocity_m_s) {
    hexload_leg_sample_t sample = {.tick = 5};
    for (int other = 0; other < HEXLOAD_LEGS; other++) {
        sample.displacement_m[other] = HEXLOAD_REAL(0.05);
    }
    sample.displacement_m[leg] = (hexload_real_t)displacement_m;
    sample.velocity_m_s[leg] = (hexload_real_t)velocity_m_s;
    return sample;
}

/// Whether the displacement of `leg` goes on with its velocity, and nothing else changes. `before`: ticks for
/// which it has.
static bool is_bridged(const hexload_config_t* config, const hexload_leg_sample_t* sample, int leg,
                       uint32_t before) {
    const hexload_leg_gate_t gate = gate_before();
    const hexload_lost_channels_t lost = {.displacement_ticks = before};
    hexload_lost_channels_t next = {.displacement_ticks = 0};
    hexload_leg_sample_t bridged;
    uint32_t health = 0;
    if (hexload_loose_plug_bridge(&lost, config, &gate, sample, &bridged, &next, &health) == sample) {
        TEST_ASSERT_EQUAL_UINT32(0, health);
        TEST_ASSERT_EQUAL_UINT32(0, next.displacement_ticks);
        return false;
    }
    const double gap_s = (double)config->tick_s * (sample->tick - gate.last_tick);
    TEST_ASSERT_FLOAT_WITHIN(1e-7F, (float)(0.05 + gap_s * (double)sample->velocity_m_s[leg]),
                             (float)bridged.displacement_m[leg]);
    TEST_ASSERT_EQUAL_UINT32(before + sample->tick - gate.last_tick, next.displacement_ticks);
    TEST_ASSERT_EQUAL_UINT32(1u << HEXLOAD_HEALTH_CHANNEL_LOST, health);
    bridged.displacement_m[leg] = sample->displacement_m[leg];
    TEST_ASSERT_EQUAL_MEMORY(sample, &bridged, sizeof bridged);
    return true;
}

static void test_a_displacement_that_jumps_alone_is_missing(void) {
    // GIVEN legs at 50 mm, sensors of 20 um: 1.2 mm in a tick are what a wrong velocity may leave
    const hexload_config_t config = paper_machine();
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        // WHEN one jumps by less THEN it goes on as it is, by more THEN it is missing
        hexload_leg_sample_t sample = shown(leg, 0.0511, 0.0);
        TEST_ASSERT_FALSE(is_bridged(&config, &sample, leg, 0));
        sample = shown(leg, 0.0487, 0.0);
        TEST_ASSERT_TRUE(is_bridged(&config, &sample, leg, 0));
        // AND what its leg's speed explains is no jump, nor what five ticks do
        sample = shown(leg, 0.0487, -0.2);
        TEST_ASSERT_FALSE(is_bridged(&config, &sample, leg, 0));
        sample = shown(leg, 0.0483, -0.2);
        TEST_ASSERT_TRUE(is_bridged(&config, &sample, leg, 0));
        sample = shown(leg, 0.0487, 0.0);
        sample.tick = 9;
        TEST_ASSERT_FALSE(is_bridged(&config, &sample, leg, 0));
        sample.displacement_m[leg] = HEXLOAD_REAL(0.0447);
        TEST_ASSERT_TRUE(is_bridged(&config, &sample, leg, 0));
        // AND one that jumps with another is none
        sample.displacement_m[(leg + 1) % HEXLOAD_LEGS] = HEXLOAD_REAL(0.0);
        TEST_ASSERT_FALSE(is_bridged(&config, &sample, leg, 0));
    }
}

static void test_a_zero_that_has_moved_counts_after_a_tenth_of_a_second(void) {
    // GIVEN a displacement that has jumped, at a tick of which 64 are 0.1 s WHEN it stays there THEN it is
    // missing for 64 ticks
    hexload_config_t config = paper_machine();
    const hexload_leg_sample_t sample = shown(3, 0.0, 0.0);
    config.tick_s = HEXLOAD_REAL(0.1) / HEXLOAD_REAL(64.0);
    TEST_ASSERT_TRUE(is_bridged(&config, &sample, 3, 63));
    TEST_ASSERT_FALSE(is_bridged(&config, &sample, 3, 64));
}

static void test_displacements_that_speeds_are_made_of_do_not_jump(void) {
    // GIVEN legs without velocity sensors WHEN a displacement jumps THEN it goes on as it is
    hexload_config_t config = paper_machine();
    const hexload_leg_sample_t sample = shown(3, 0.0, 0.0);
    config.sensors.half_window_ticks = 1;
    TEST_ASSERT_FALSE(is_bridged(&config, &sample, 3, 0));
}

static void test_the_first_sample_has_not_jumped(void) {
    // GIVEN no sample before WHEN one leg is far from where the others are THEN that is where it is
    const hexload_config_t config = paper_machine();
    const hexload_leg_gate_t gate = {.accepted = 0};
    const hexload_lost_channels_t lost = {0};
    const hexload_leg_sample_t sample = shown(2, 0.2, 0.0);
    hexload_lost_channels_t next = {0};
    hexload_leg_sample_t bridged;
    uint32_t health = 0;
    TEST_ASSERT_EQUAL_PTR(
        &sample, hexload_loose_plug_bridge(&lost, &config, &gate, &sample, &bridged, &next, &health));
}

static void test_beside_a_displacement_that_is_missing_none_is_bridged(void) {
    // GIVEN a displacement that has been made of its velocity WHEN another one jumps THEN that is too much
    const hexload_config_t config = paper_machine();
    const hexload_leg_gate_t gate = gate_before();
    const hexload_lost_channels_t lost = {0};
    const hexload_leg_sample_t sample = shown(2, 0.2, 0.0);
    hexload_lost_channels_t next = {.displacement_ticks = 1};
    hexload_leg_sample_t bridged;
    uint32_t health = 0;
    TEST_ASSERT_EQUAL_PTR(
        &sample, hexload_loose_plug_bridge(&lost, &config, &gate, &sample, &bridged, &next, &health));
    TEST_ASSERT_EQUAL_UINT32(1, next.displacement_ticks);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_displacement_that_jumps_alone_is_missing);
    RUN_TEST(test_a_zero_that_has_moved_counts_after_a_tenth_of_a_second);
    RUN_TEST(test_displacements_that_speeds_are_made_of_do_not_jump);
    RUN_TEST(test_the_first_sample_has_not_jumped);
    RUN_TEST(test_beside_a_displacement_that_is_missing_none_is_bridged);
    return UNITY_END();
}
