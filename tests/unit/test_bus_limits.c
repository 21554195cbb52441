/// Ends of counters, of codes and of time, of the bus and of the application on it.
#include "frames.h"
#include "motion.h"

#include "app/node.h"
#include "bus/answer_assembly.h"
#include "bus/answer_frames.h"
#include "bus/sample_assembly.h"
#include "bus/slcan.h"

#include <math.h>
#include <string.h>

void setUp(void) {}
void tearDown(void) {}

static void test_incomplete_samples_and_answers_are_counted_up_to_the_end(void) {
    for (uint32_t from = UINT32_MAX - 1; from != 0; from++) {
        // GIVEN counts at their end, or one before WHEN a sample and an answer stay without their last frame
        hexload_sample_assembly_t samples;
        hexload_answer_assembly_t answers;
        hexload_bus_frame_t frames[HEXLOAD_BUS_SAMPLE_FRAMES], parts[HEXLOAD_BUS_ANSWER_FRAMES];
        hexload_leg_sample_t sample = numbered_sample(16);
        hexload_bus_answer_t answer = numbered_answer(0, 16), whole;
        uint32_t tick;
        hexload_sample_assembly_init(&samples, HEXLOAD_BUS_CLASSIC);
        hexload_answer_assembly_init(&answers, HEXLOAD_BUS_FD);
        samples.incomplete = answers.incomplete = from;
        const int count = encode_sample(HEXLOAD_BUS_CLASSIC, &sample, frames);
        for (int n = 0; n < count - 1; n++) {
            TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_PARTIAL,
                                  hexload_sample_assembly_add(&samples, &frames[n], &sample));
        }
        (void)encode_answer(HEXLOAD_BUS_FD, &answer, 0, parts);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_PARTIAL,
                              hexload_answer_assembly_add(&answers, &parts[0], 16, &tick, &whole));
        hexload_sample_assembly_lose_tick(&samples);
        answer = numbered_answer(0, 17);
        (void)encode_answer(HEXLOAD_BUS_FD, &answer, 0, parts);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_PARTIAL,
                              hexload_answer_assembly_add(&answers, &parts[0], 17, &tick, &whole));
        // THEN they are counted, up to the end
        TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, samples.incomplete);
        TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, answers.incomplete);
    }
}

static void test_an_answer_that_is_joined_midway_is_given_up_for_the_next(void) {
    // GIVEN an assembly that has heard nothing WHEN the first frame that comes is a sigma, and then the rest
    hexload_answer_assembly_t answers;
    hexload_bus_frame_t parts[HEXLOAD_BUS_ANSWER_FRAMES];
    hexload_bus_answer_t answer = numbered_answer(0, 0), whole = {.tick = 9};
    uint32_t tick = 0;
    hexload_answer_assembly_init(&answers, HEXLOAD_BUS_FD);
    (void)encode_answer(HEXLOAD_BUS_FD, &answer, 0, parts);
    // THEN it makes no answer, also of tick 0, which an assembly that has heard nothing is at
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_PARTIAL,
                          hexload_answer_assembly_add(&answers, &parts[1], 0, &tick, &whole));
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_PARTIAL,
                          hexload_answer_assembly_add(&answers, &parts[2], 0, &tick, &whole));
    TEST_ASSERT_EQUAL_UINT32(9, whole.tick);
}

static void test_an_echo_has_every_channel_of_the_first(void) {
    // GIVEN a leg frame without a velocity sensor WHEN it comes again THEN it is late; with another number in
    // any one of its channels it contradicts the first, and so does one without the sensor that the first had
    hexload_leg_sample_t sample = numbered_sample(16), other;
    hexload_bus_frame_t frames[HEXLOAD_BUS_SAMPLE_FRAMES];
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        sample.velocity_m_s[leg] = (hexload_real_t)NAN;
    }
    for (int channel = 0; channel < 5; channel++) {
        hexload_sample_assembly_t assembly;
        hexload_leg_sample_t whole;
        sample.velocity_m_s[0] = channel == 4 ? HEXLOAD_REAL(0.25) : (hexload_real_t)NAN;
        hexload_sample_assembly_init(&assembly, HEXLOAD_BUS_CLASSIC);
        (void)encode_sample(HEXLOAD_BUS_CLASSIC, &sample, frames);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_PARTIAL,
                              hexload_sample_assembly_add(&assembly, &frames[0], &whole));
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_PARTIAL,
                              hexload_sample_assembly_add(&assembly, &frames[1], &whole));
        other = sample;
        other.displacement_m[0] += channel == 1 ? HEXLOAD_REAL(0.01) : HEXLOAD_REAL(0.0);
        other.velocity_m_s[0] = channel == 2 ? HEXLOAD_REAL(0.25) : (hexload_real_t)NAN;
        other.force_n[0] += channel == 3 ? HEXLOAD_REAL(100.0) : HEXLOAD_REAL(0.0);
        (void)encode_sample(HEXLOAD_BUS_CLASSIC, &other, frames);
        TEST_ASSERT_EQUAL_INT(channel == 0 ? HEXLOAD_BUS_ERR_TICK : HEXLOAD_BUS_ERR_CONTRADICTION,
                              hexload_sample_assembly_add(&assembly, &frames[1], &whole));
    }
    TEST_ASSERT_EQUAL_STRING("contradicts what came before",
                             hexload_bus_status_name(HEXLOAD_BUS_ERR_CONTRADICTION));
}

enum { INPUT_PAGE = 8, INPUT_BYTE = 5 }; ///< of a status, and in it; of HealthFd the byte is 22

static void test_codes_of_input_faults_beyond_those_there_are_name_nothing(void) {
    hexload_bus_frame_t page, health[HEXLOAD_BUS_ANSWER_FRAMES];
    const hexload_bus_answer_t zero = numbered_answer(0, 16);
    hexload_bus_controller_status_t status = {0};
    hexload_bus_encode_status(&status, INPUT_PAGE, &page);
    (void)encode_answer(HEXLOAD_BUS_FD, &zero, 0, health);
    for (int code = 0; code < 256; code++) {
        // GIVEN a code of cause and leg in a status or an answer WHEN it is read THEN its cause is one there
        // is, or none; its leg is 0..5, or none in particular
        const int cause = code < HEXLOAD_INPUT_CAUSES ? code : HEXLOAD_INPUT_CAUSES;
        const uint32_t leg = code >= 1 && code <= 6 ? (uint32_t)code - 1 : 6;
        hexload_bus_answer_t answer = {0};
        int part = 0;
        memset(&page.data[INPUT_BYTE], code, 2);
        memset(&health[2].data[22], code, 2);
        seal(&page);
        seal(&health[2]);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, hexload_bus_decode_status(&page, &status));
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, hexload_answer_decode_fd(&health[2], &part, &answer));
        TEST_ASSERT_EQUAL_INT(cause, status.input.cause);
        TEST_ASSERT_EQUAL_UINT32(leg, status.input.leg);
        TEST_ASSERT_EQUAL_INT(cause, answer.input.cause);
        TEST_ASSERT_EQUAL_UINT32(leg, answer.input.leg);
    }
}

static void test_the_code_of_a_leg_is_its_number_and_of_none_zero(void) {
    const uint32_t legs[9] = {0, 1, 2, 3, 4, 5, 6, 7, UINT32_MAX};
    for (uint8_t n = 0; n < 9; n++) {
        // GIVEN an input fault of a leg, or of none WHEN it is written THEN its code is 1..6, or 0
        const uint8_t code = n < 6 ? (uint8_t)(n + 1) : 0;
        const hexload_bus_controller_status_t status = {.input = {HEXLOAD_INPUT_FORCE_DEAD, legs[n], 0}};
        hexload_bus_answer_t answer = numbered_answer(0, 16);
        hexload_bus_frame_t page, health[HEXLOAD_BUS_ANSWER_FRAMES];
        answer.input = status.input;
        hexload_bus_encode_status(&status, INPUT_PAGE, &page);
        (void)encode_answer(HEXLOAD_BUS_FD, &answer, 0, health);
        TEST_ASSERT_EQUAL_UINT8(HEXLOAD_INPUT_FORCE_DEAD, page.data[INPUT_BYTE]);
        TEST_ASSERT_EQUAL_UINT8(code, page.data[INPUT_BYTE + 1]);
        TEST_ASSERT_EQUAL_UINT8(HEXLOAD_INPUT_FORCE_DEAD, health[2].data[22]);
        TEST_ASSERT_EQUAL_UINT8(code, health[2].data[23]);
    }
}

static void test_channels_that_were_cut_are_counted_up_to_the_end(void) {
    hexload_leg_sample_t sample = numbered_sample(17);
    hexload_bus_frame_t frames[HEXLOAD_BUS_SAMPLE_FRAMES];
    uint32_t saturated = UINT32_MAX - 1;
    sample.force_n[0] = sample.force_n[1] = sample.force_n[2] = HEXLOAD_REAL(1e30);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_LEGS,
                          hexload_bus_encode_sample(HEXLOAD_BUS_CLASSIC, &sample, frames, &saturated));
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, saturated);
}

static void test_an_adapters_time_that_is_no_number_is_no_frame(void) {
    static const char line[] = "t10021133G000\rt10021133000000\rt100211330000\r";
    hexload_slcan_t slcan;
    hexload_bus_frame_t frame;
    int frames = 0;
    hexload_slcan_init(&slcan);
    for (size_t n = 0; n < sizeof line - 1; n++) {
        frames += hexload_slcan_take(&slcan, line[n], &frame) ? 1 : 0;
    }
    TEST_ASSERT_EQUAL_INT(1, frames);
}

// The application.

static bool queue(void* context, const hexload_bus_frame_t* frame) {
    bool* is_free = (bool*)context;
    (void)frame;
    return *is_free;
}

static uint32_t now_us;

static uint32_t look_at_clock(void* context) {
    const uint32_t now = now_us;
    (void)context;
    now_us += UINT32_MAX / 2 + 2; // longer than half of what the clock can count
    return now;
}

static hexload_node_t active_node(hexload_kind_t kind, bool* is_free) {
    hexload_config_t config = paper_machine();
    const hexload_port_t port = {.context = is_free, .send = queue, .clock_us = look_at_clock};
    hexload_app_settings_t settings;
    static hexload_node_t node;
    config.kind = kind;
    hexload_app_settings_default(&settings);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_node_init(&node, &config, &settings, HEXLOAD_BUS_FD, &port));
    for (int n = 0; n < HEXLOAD_NODE_LISTEN_MS; n++) {
        hexload_node_period(&node, 1);
    }
    return node;
}

static void give(hexload_node_t* node, uint32_t tick) {
    const hexload_leg_sample_t sample = {.tick = tick};
    hexload_bus_frame_t frames[HEXLOAD_BUS_SAMPLE_FRAMES];
    (void)encode_sample(HEXLOAD_BUS_FD, &sample, frames);
    hexload_node_receive(node, &frames[0]);
}

static void test_a_period_that_took_half_the_clocks_time_leaves_less_than_nothing(void) {
    bool is_free = true;
    hexload_node_t node = active_node(HEXLOAD_KIND_PAPER, &is_free);
    give(&node, 0);
    TEST_ASSERT_EQUAL_INT32(-INT32_MAX, node.status.time_margin_us);
    // AND it stays until a status with it has been queued
    is_free = false;
    for (int n = 0; n < HEXLOAD_BUS_STATUS_PAGES * HEXLOAD_NODE_STATUS_PERIOD_MS; n++) {
        hexload_node_period(&node, 1);
    }
    TEST_ASSERT_EQUAL_INT32(-INT32_MAX, node.status.time_margin_us);
    is_free = true;
    for (int n = 0; n < HEXLOAD_BUS_STATUS_PAGES * HEXLOAD_NODE_STATUS_PERIOD_MS; n++) {
        hexload_node_period(&node, 1);
    }
    TEST_ASSERT_EQUAL_INT32(0, node.status.time_margin_us);
}

static void test_load_changes_are_told_up_to_the_end_of_their_code(void) {
    bool is_free = true;
    hexload_node_t node = active_node(HEXLOAD_KIND_MOMENTUM, &is_free);
    node.app.estimator.as.momentum.health.count[HEXLOAD_HEALTH_LOAD_CHANGED] = 70000;
    for (int n = 0; n < HEXLOAD_NODE_STATUS_PERIOD_MS; n++) {
        hexload_node_period(&node, 1);
    }
    TEST_ASSERT_EQUAL_UINT16(UINT16_MAX, node.status.load_changes);
}

static hexload_app_t running_app(hexload_config_t config) {
    hexload_app_settings_t settings;
    hexload_bus_acknowledge_t acknowledge;
    const hexload_bus_command_t start = {.kind = HEXLOAD_COMMAND_START};
    hexload_app_t app;
    hexload_app_settings_default(&settings);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_app_init(&app, &config, &settings));
    hexload_app_command(&app, &start, &acknowledge);
    TEST_ASSERT_EQUAL_UINT8(HEXLOAD_RESULT_DONE, acknowledge.result);
    return app;
}

static void test_a_changed_load_is_that_of_the_last_tick_only(void) {
    // GIVEN a load that has changed at tick 5, the last WHEN others are asked for THEN it has not
    hexload_config_t config = paper_machine();
    config.kind = HEXLOAD_KIND_MOMENTUM;
    hexload_app_t app = running_app(config);
    const hexload_leg_sample_t sample = {.tick = 5};
    hexload_bus_answer_t answer;
    hexload_app_sample(&app, &sample, &answer);
    app.estimator.as.momentum.health.bits |= 1u << HEXLOAD_HEALTH_LOAD_CHANGED;
    TEST_ASSERT_TRUE(hexload_app_has_load_changed(&app, 5));
    TEST_ASSERT_FALSE(hexload_app_has_load_changed(&app, 4));
}

static void test_jumps_that_do_not_follow_each_other_are_not_believed(void) {
    // GIVEN a run at tick 5 WHEN samples come from far ahead, each as far again from the one before
    hexload_app_t app = running_app(paper_machine());
    hexload_bus_answer_t answer;
    for (uint32_t n = 0; n < 5; n++) {
        const hexload_leg_sample_t sample = {.tick = 5 + n * (HEXLOAD_APP_FARTHEST_JUMP + 1)};
        hexload_app_sample(&app, &sample, &answer);
        // THEN each is the first of its own
        TEST_ASSERT_EQUAL_UINT32(5, app.last_tick);
        TEST_ASSERT_EQUAL_UINT32(n > 0 ? 1 : 0, app.jump_samples);
    }
}

static void test_a_prior_that_is_safe_in_part_is_ones_own(void) {
    for (int part = 0; part < 4; part++) {
        // GIVEN the safe prior but for one of its four numbers WHEN a mass is set THEN the prior stays
        hexload_config_t config = paper_machine();
        hexload_app_settings_t settings;
        hexload_bus_acknowledge_t acknowledge;
        const hexload_bus_command_t order = {.kind = HEXLOAD_COMMAND_SET_KNOWN_MASS, .argument = 320.5f};
        hexload_app_t app;
        hexload_paper_config_t* paper = &config.paper;
        hexload_real_t* const number =
            part < 3 ? &paper->prior_inertia_sigma_kg_m2[part] : &paper->prior_dz_sigma_m;
        *number *= HEXLOAD_REAL(0.5);
        hexload_app_settings_default(&settings);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_app_init(&app, &config, &settings));
        hexload_app_command(&app, &order, &acknowledge);
        TEST_ASSERT_EQUAL_UINT8(HEXLOAD_RESULT_DONE, acknowledge.result);
        TEST_ASSERT_TRUE(paper->prior_dz_sigma_m == app.config.paper.prior_dz_sigma_m);
        TEST_ASSERT_EQUAL_MEMORY(paper->prior_inertia_sigma_kg_m2, app.config.paper.prior_inertia_sigma_kg_m2,
                                 sizeof paper->prior_inertia_sigma_kg_m2);
    }
}

static void test_a_configurations_checksum_has_its_directions_to_the_last(void) {
    hexload_config_t config = paper_machine();
    config.rig.direction_count = 2;
    const uint32_t checksum = hexload_app_configuration(&config);
    config.rig.direction[1].platform_hinge_m[5][2] = HEXLOAD_REAL(1e-3);
    TEST_ASSERT_NOT_EQUAL(checksum, hexload_app_configuration(&config));
}

static void test_half_of_all_ticks_ahead_is_a_jump_and_more_is_the_past(void) {
    // GIVEN a run at tick 5 WHEN a sample comes from as far ahead as there is, or from one tick more
    for (uint32_t more = 0; more < 2; more++) {
        hexload_app_t app = running_app(paper_machine());
        hexload_bus_answer_t answer;
        hexload_leg_sample_t sample = {.tick = 5};
        hexload_app_sample(&app, &sample, &answer);
        sample.tick += UINT32_MAX / 2 + more;
        hexload_app_sample(&app, &sample, &answer);
        // THEN it is a jump, which others may follow, or just late
        TEST_ASSERT_EQUAL_UINT32(more == 0 ? 1 : 0, app.jump_samples);
        TEST_ASSERT_EQUAL_UINT32(5, app.last_tick);
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_incomplete_samples_and_answers_are_counted_up_to_the_end);
    RUN_TEST(test_an_answer_that_is_joined_midway_is_given_up_for_the_next);
    RUN_TEST(test_an_echo_has_every_channel_of_the_first);
    RUN_TEST(test_codes_of_input_faults_beyond_those_there_are_name_nothing);
    RUN_TEST(test_the_code_of_a_leg_is_its_number_and_of_none_zero);
    RUN_TEST(test_channels_that_were_cut_are_counted_up_to_the_end);
    RUN_TEST(test_an_adapters_time_that_is_no_number_is_no_frame);
    RUN_TEST(test_a_period_that_took_half_the_clocks_time_leaves_less_than_nothing);
    RUN_TEST(test_load_changes_are_told_up_to_the_end_of_their_code);
    RUN_TEST(test_a_changed_load_is_that_of_the_last_tick_only);
    RUN_TEST(test_jumps_that_do_not_follow_each_other_are_not_believed);
    RUN_TEST(test_a_prior_that_is_safe_in_part_is_ones_own);
    RUN_TEST(test_a_configurations_checksum_has_its_directions_to_the_last);
    RUN_TEST(test_half_of_all_ticks_ahead_is_a_jump_and_more_is_the_past);
    return UNITY_END();
}
