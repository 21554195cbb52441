#include "frames.h"
#include "motion.h"

#include "app/node.h"
#include "bus/answer_assembly.h"
#include "bus/answer_frames.h"

#include <stdio.h>
#include <string.h>

void setUp(void) {}
void tearDown(void) {}

enum { LOG_FRAMES = 4096 };

/// A port that remembers what was sent, with a clock that advances by the same step at each look.
typedef struct machine {
    hexload_bus_frame_t sent[LOG_FRAMES];
    int count;
    bool is_full;
    uint32_t now_us;
    uint32_t step_us;
    uint32_t stack_bytes;
} machine_t;

static machine_t machine;
static hexload_node_t node;
static bool is_heavy;    ///< the samples are those of another load
static uint8_t sequence; ///< of the last command

static bool log_frame(void* context, const hexload_bus_frame_t* frame) {
    machine_t* self = (machine_t*)context;
    if (self->is_full) {
        return false;
    }
    TEST_ASSERT_LESS_THAN_INT(LOG_FRAMES, self->count);
    self->sent[self->count++] = *frame;
    return true;
}

static uint32_t look_at_clock(void* context) {
    machine_t* self = (machine_t*)context;
    self->now_us += self->step_us;
    return self->now_us;
}

static uint32_t measure_stack(void* context) {
    const machine_t* self = (const machine_t*)context;
    return self->stack_bytes;
}

static void begin_listening(hexload_bus_profile_t profile) {
    const hexload_config_t config = paper_machine();
    const hexload_port_t port = {.context = &machine,
                                 .send = log_frame,
                                 .clock_us = look_at_clock,
                                 .stack_margin_bytes = measure_stack};
    hexload_app_settings_t settings;
    hexload_app_settings_default(&settings);
    is_heavy = false;
    machine = (machine_t){.now_us = UINT32_MAX - 1000, .step_us = 300, .stack_bytes = 4321};
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_node_init(&node, &config, &settings, profile, &port));
}

static void pass(uint32_t periods) {
    for (uint32_t n = 0; n < periods; n++) {
        hexload_node_period(&node, 1);
    }
}

static void begin_active(hexload_bus_profile_t profile) {
    begin_listening(profile);
    pass(HEXLOAD_NODE_LISTEN_MS);
    TEST_ASSERT_TRUE(hexload_node_is_active(&node));
    machine.count = 0;
}

static void give_command(const hexload_bus_command_t* order) {
    hexload_bus_frame_t frame;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, hexload_bus_encode_command(order, &frame));
    hexload_node_receive(&node, &frame);
}

static void command(uint8_t kind, float argument) {
    const hexload_bus_command_t order = {.kind = kind,
                                         .source = HEXLOAD_SOURCE_OPERATOR,
                                         .session = 1234,
                                         .sequence = ++sequence,
                                         .argument = argument};
    give_command(&order);
}

static void begin_run(hexload_bus_profile_t profile, hexload_pacing_t pacing) {
    begin_active(profile);
    command(HEXLOAD_COMMAND_START, (float)pacing);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_APP_ARMED, node.app.state);
    machine.count = 0;
}

static double home_height_m(void) {
    const hexload_app_t* app = &node.app;
    return (double)(app->config.kind == HEXLOAD_KIND_MOMENTUM ? app->estimator.as.momentum.kinematics
                                                              : app->estimator.as.paper.kinematics)
        .home_height_m;
}

static hexload_leg_sample_t sample_at(uint32_t tick) {
    static const body_t load = {500.0, {0.0, 0.0, 0.3}, {25.0, 25.0, 25.0, 0.0, 0.0, 0.0}};
    static const body_t heavier = {800.0, {0.05, 0.0, 0.3}, {40.0, 40.0, 40.0, 0.0, 0.0, 0.0}};
    const motion_t motion = paper_motion(0.02);
    return perfect_sample(&node.app.config, is_heavy ? &heavier : &load, &motion, home_height_m(), tick);
}

/// The frames of a tick; `lost`: this one does not arrive, -1 all do.
static void give_without(hexload_bus_profile_t profile, uint32_t tick, int lost) {
    const hexload_leg_sample_t sample = sample_at(tick);
    hexload_bus_frame_t frames[HEXLOAD_BUS_SAMPLE_FRAMES];
    const int count = encode_sample(profile, &sample, frames);
    for (int n = 0; n < count; n++) {
        if (n != lost) {
            hexload_node_receive(&node, &frames[n]);
        }
    }
}

static void give(hexload_bus_profile_t profile, uint32_t tick) {
    give_without(profile, tick, -1);
}

/// Puts together the last answer among the frames sent so far; returns how many there were.
static int read_answers(hexload_bus_profile_t profile, uint32_t near_tick, hexload_bus_answer_t* answer) {
    hexload_answer_assembly_t assembly;
    uint32_t answered_tick = 0;
    int count = 0;
    hexload_answer_assembly_init(&assembly, profile);
    for (int n = 0; n < machine.count; n++) {
        count += hexload_answer_assembly_add(&assembly, &machine.sent[n], near_tick, &answered_tick,
                                             answer) == HEXLOAD_BUS_OK;
    }
    return count;
}

/// The status as a monitor that heard a whole round of pages knows it.
static hexload_bus_controller_status_t read_status(void) {
    hexload_bus_controller_status_t status = {0};
    machine.count = 0;
    for (int page = 0; page < HEXLOAD_BUS_STATUS_PAGES; page++) {
        pass(HEXLOAD_NODE_STATUS_PERIOD_MS);
    }
    for (int n = 0; n < machine.count; n++) {
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, hexload_bus_decode_status(&machine.sent[n], &status));
    }
    return status;
}

static hexload_bus_acknowledge_t last_acknowledge(void) {
    hexload_bus_acknowledge_t acknowledge = {0};
    TEST_ASSERT_GREATER_THAN_INT(0, machine.count);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK,
                          hexload_bus_decode_acknowledge(&machine.sent[machine.count - 1], &acknowledge));
    return acknowledge;
}

static void test_init_refuses_a_bad_configuration_and_leaves_the_instance_alone(void) {
    hexload_config_t config = paper_machine();
    const hexload_port_t port = {.send = log_frame};
    hexload_app_settings_t settings;
    hexload_node_t before;
    hexload_app_settings_default(&settings);
    config.tick_s = HEXLOAD_REAL(1.0);
    memset(&node, 0x5A, sizeof node);
    memcpy(&before, &node, sizeof before);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_ERR_CONFIG,
                          hexload_node_init(&node, &config, &settings, HEXLOAD_BUS_FD, &port));
    TEST_ASSERT_EQUAL_MEMORY(&before, &node, sizeof before);
}

static void test_a_listening_node_sends_nothing_and_does_nothing(void) {
    begin_listening(HEXLOAD_BUS_FD);
    for (uint32_t ms = 0; ms < HEXLOAD_NODE_LISTEN_MS; ms++) {
        TEST_ASSERT_FALSE(hexload_node_is_active(&node));
        command(HEXLOAD_COMMAND_START, 0.0f);
        give(HEXLOAD_BUS_FD, ms);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_APP_IDLE, node.app.state);
        TEST_ASSERT_EQUAL_INT(0, machine.count);
        pass(1);
    }
    TEST_ASSERT_TRUE(hexload_node_is_active(&node));
    command(HEXLOAD_COMMAND_START, 0.0f);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_APP_ARMED, node.app.state);
}

/// One of each of the frames that a controller sends, whole.
enum { CONTROLLERS_FRAMES = 9 };
static void controllers_frames(hexload_bus_frame_t frames[CONTROLLERS_FRAMES]) {
    const hexload_bus_answer_t paper = {.tick = 3};
    const hexload_bus_answer_t momentum = {.tick = 3, .filter = HEXLOAD_FILTER_MOMENTUM};
    const hexload_bus_load_change_t change = {.tick = 3};
    const hexload_bus_acknowledge_t acknowledge = {.kind = HEXLOAD_COMMAND_STOP};
    const hexload_bus_controller_status_t status = {.profile = HEXLOAD_BUS_FD};
    TEST_ASSERT_EQUAL_INT(3, hexload_bus_encode_answer(HEXLOAD_BUS_FD, &momentum, 0, &frames[0]));
    TEST_ASSERT_EQUAL_INT(3, hexload_bus_encode_answer(HEXLOAD_BUS_FD, &paper, 0, &frames[2]));
    TEST_ASSERT_EQUAL_INT(1, hexload_bus_encode_answer(HEXLOAD_BUS_CLASSIC, &paper, 0, &frames[5]));
    hexload_bus_encode_load_change(&change, &frames[6]);
    hexload_bus_encode_acknowledge(&acknowledge, &frames[7]);
    hexload_bus_encode_status(&status, 0, &frames[8]);
}

static void hear(const hexload_bus_frame_t* frame, int times) {
    for (int n = 0; n < times; n++) {
        hexload_node_receive(&node, frame);
    }
}

static void test_a_node_that_hears_a_controller_while_listening_stays_silent(void) {
    hexload_bus_frame_t frames[CONTROLLERS_FRAMES];
    controllers_frames(frames);
    for (int n = 0; n < CONTROLLERS_FRAMES; n++) {
        begin_listening(HEXLOAD_BUS_FD);
        pass(HEXLOAD_NODE_LISTEN_MS - 1);
        hear(&frames[n], HEXLOAD_NODE_STRANGERS);
        for (uint32_t tick = 0; tick < 2 * HEXLOAD_NODE_LISTEN_MS; tick++) {
            command(HEXLOAD_COMMAND_RESET, 0.0f);
            give(HEXLOAD_BUS_FD, tick);
            pass(1);
        }
        TEST_ASSERT_FALSE(hexload_node_is_active(&node));
        TEST_ASSERT_EQUAL_INT(HEXLOAD_FAULT_SECOND_CONTROLLER, node.app.fault);
        TEST_ASSERT_EQUAL_INT(0, machine.count);
    }
}

static void test_an_active_node_that_hears_another_controller_says_so(void) {
    begin_run(HEXLOAD_BUS_FD, HEXLOAD_PACING_REAL_TIME);
    give(HEXLOAD_BUS_FD, 0);
    hexload_bus_frame_t frames[CONTROLLERS_FRAMES];
    controllers_frames(frames);
    hear(&frames[4], HEXLOAD_NODE_STRANGERS);
    // THEN samples are answered with the fault, and the status reports it
    hexload_bus_answer_t answer;
    machine.count = 0;
    give(HEXLOAD_BUS_FD, 1);
    TEST_ASSERT_EQUAL_INT(1, read_answers(HEXLOAD_BUS_FD, 1, &answer));
    TEST_ASSERT_EQUAL_UINT8(HEXLOAD_APP_FAULT, answer.state);
    TEST_ASSERT_EQUAL_UINT8(HEXLOAD_FAULT_SECOND_CONTROLLER, answer.fault);
    TEST_ASSERT_EQUAL_UINT8(HEXLOAD_FAULT_SECOND_CONTROLLER, read_status().fault);
    // and RESET helps once the other one is gone
    command(HEXLOAD_COMMAND_RESET, 0.0f);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_APP_IDLE, node.app.state);
}

static void test_a_command_is_acknowledged_with_state_and_profile(void) {
    for (int profile = 0; profile < 2; profile++) {
        begin_active((hexload_bus_profile_t)profile);
        command(HEXLOAD_COMMAND_START, 1.0f);
        hexload_bus_acknowledge_t acknowledge = last_acknowledge();
        TEST_ASSERT_EQUAL_INT(1, machine.count);
        TEST_ASSERT_EQUAL_UINT8(HEXLOAD_COMMAND_START, acknowledge.kind);
        TEST_ASSERT_EQUAL_UINT8(HEXLOAD_SOURCE_OPERATOR, acknowledge.source);
        TEST_ASSERT_EQUAL_UINT16(1234, acknowledge.session);
        TEST_ASSERT_EQUAL_UINT8(sequence % 16, acknowledge.sequence);
        TEST_ASSERT_EQUAL_UINT8(0, acknowledge.counter);
        TEST_ASSERT_EQUAL_UINT8(HEXLOAD_RESULT_DONE, acknowledge.result);
        TEST_ASSERT_EQUAL_UINT8(HEXLOAD_APP_ARMED, acknowledge.state);
        TEST_ASSERT_EQUAL_UINT8(profile, acknowledge.profile);
        command(15, 0.0f);
        acknowledge = last_acknowledge();
        TEST_ASSERT_EQUAL_UINT8(1, acknowledge.counter);
        TEST_ASSERT_EQUAL_UINT8(HEXLOAD_RESULT_UNKNOWN_COMMAND, acknowledge.result);
        TEST_ASSERT_EQUAL_UINT32(0, node.status.frames_refused);
    }
}

static void test_a_nodes_first_command_is_carried_out_whatever_its_counter(void) {
    // GIVEN nodes that have had no command WHEN one comes whose every field is 0 that can be THEN it is no
    // echo
    for (uint8_t kind = HEXLOAD_COMMAND_START; kind <= HEXLOAD_COMMAND_SET_KNOWN_MASS; kind++) {
        const hexload_bus_command_t order = {.kind = kind};
        begin_active(HEXLOAD_BUS_FD);
        give_command(&order);
        TEST_ASSERT_EQUAL_INT(1, machine.count);
        TEST_ASSERT_EQUAL_UINT8(kind, last_acknowledge().kind);
        TEST_ASSERT_EQUAL_UINT32(0, node.status.frames_refused);
    }
}

static void test_a_damaged_command_is_counted_and_neither_carried_out_nor_acknowledged(void) {
    begin_active(HEXLOAD_BUS_FD);
    const hexload_bus_command_t start = {.kind = HEXLOAD_COMMAND_START};
    hexload_bus_frame_t frame;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, hexload_bus_encode_command(&start, &frame));
    frame.data[2] ^= 1;
    hexload_node_receive(&node, &frame);
    TEST_ASSERT_EQUAL_INT(0, machine.count);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_APP_IDLE, node.app.state);
    TEST_ASSERT_EQUAL_UINT32(1, read_status().frames_refused);
}

static void test_a_command_that_comes_twice_is_carried_out_once(void) {
    // GIVEN a command that has been carried out WHEN its frame comes again, also after one of another session
    const hexload_bus_command_t start = {.kind = HEXLOAD_COMMAND_START, .session = 7, .sequence = 3};
    begin_active(HEXLOAD_BUS_FD);
    give_command(&start);
    give_command(&start);
    // THEN it is refused and counted, and no second acknowledge says that the state is wrong
    TEST_ASSERT_EQUAL_INT(1, machine.count);
    TEST_ASSERT_EQUAL_UINT32(1, node.status.frames_refused);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_APP_ARMED, node.app.state);
    // AND the same counter with another session is another command
    hexload_bus_command_t other = start;
    other.session = 8;
    give_command(&other);
    TEST_ASSERT_EQUAL_UINT8(HEXLOAD_RESULT_WRONG_STATE, last_acknowledge().result);
    TEST_ASSERT_EQUAL_UINT16(8, last_acknowledge().session);
    // AND with another content it has another source: a fault of a run
    other.kind = HEXLOAD_COMMAND_STOP;
    give_command(&other);
    TEST_ASSERT_EQUAL_INT(2, machine.count);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_FAULT_SECOND_SOURCE, node.app.fault);
    // while the next one is carried out
    other.kind = HEXLOAD_COMMAND_RESET;
    other.sequence++;
    give_command(&other);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_APP_IDLE, node.app.state);
    // and in another state it only counts
    other.kind = HEXLOAD_COMMAND_STOP;
    give_command(&other);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_FAULT_NONE, node.app.fault);
    TEST_ASSERT_EQUAL_UINT32(3, node.status.frames_refused);
}

static void test_a_counter_that_comes_again_with_any_other_content_has_another_source(void) {
    for (int field = 0; field < 3; field++) {
        // GIVEN a command of a run that has been carried out
        hexload_bus_command_t order = {.kind = HEXLOAD_COMMAND_START, .session = 7, .sequence = 3};
        begin_active(HEXLOAD_BUS_FD);
        give_command(&order);
        order.kind = HEXLOAD_COMMAND_SET_KNOWN_MASS;
        order.argument = 500.0f;
        order.sequence = 4;
        give_command(&order);
        const int acknowledged = machine.count;
        // WHEN its counter comes again, as it was or with another kind or argument
        order.kind = field == 1 ? HEXLOAD_COMMAND_SELECT_FILTER : order.kind;
        order.argument = field == 1 ? 1.0f : (field == 2 ? 501.0f : order.argument);
        give_command(&order);
        // THEN it is not carried out, and what is no echo is a second source
        TEST_ASSERT_EQUAL_INT(acknowledged, machine.count);
        TEST_ASSERT_EQUAL_INT(field == 0 ? HEXLOAD_FAULT_NONE : HEXLOAD_FAULT_SECOND_SOURCE, node.app.fault);
    }
    // AND a START with the last one's counter and another configuration is no echo either
    hexload_bus_command_t start = {.kind = HEXLOAD_COMMAND_START, .session = 7, .sequence = 3};
    begin_active(HEXLOAD_BUS_FD);
    give_command(&start);
    start.configuration = 1u;
    give_command(&start);
    TEST_ASSERT_EQUAL_INT(1, machine.count);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_FAULT_SECOND_SOURCE, node.app.fault);
}

static void test_a_source_with_another_configuration_cannot_start(void) {
    begin_active(HEXLOAD_BUS_CLASSIC);
    const uint32_t own = read_status().configuration;
    for (uint32_t n = 0; n < 5; n++) {
        // GIVEN sources that work with another configuration, by the lowest or the highest bit that the bus
        // tells, the same, the same but for what the bus does not tell, and with one that they do not tell
        const uint32_t stated[5] = {own ^ 1u, own ^ 0x800000u, own, own ^ 0xFF000000u, 0};
        const hexload_bus_command_t start = {.kind = HEXLOAD_COMMAND_START,
                                             .session = 7,
                                             .sequence = (uint8_t)(n + 1),
                                             .configuration = stated[n]};
        // WHEN they start the controller THEN only the first two are refused
        command(HEXLOAD_COMMAND_RESET, 0.0f);
        machine.count = 0;
        give_command(&start);
        TEST_ASSERT_EQUAL_UINT8(n < 2 ? HEXLOAD_RESULT_OTHER_CONFIGURATION : HEXLOAD_RESULT_DONE,
                                last_acknowledge().result);
        TEST_ASSERT_EQUAL_INT(n < 2 ? HEXLOAD_APP_IDLE : HEXLOAD_APP_ARMED, node.app.state);
    }
    // AND a mass that was stated makes it another one, until RESET
    const hexload_bus_command_t start = {
        .kind = HEXLOAD_COMMAND_START, .session = 7, .sequence = 6, .configuration = own};
    command(HEXLOAD_COMMAND_RESET, 0.0f);
    command(HEXLOAD_COMMAND_SET_KNOWN_MASS, 499.0f);
    give_command(&start);
    TEST_ASSERT_EQUAL_UINT8(HEXLOAD_RESULT_OTHER_CONFIGURATION, last_acknowledge().result);
}

static void test_each_fd_sample_is_answered_at_once(void) {
    begin_run(HEXLOAD_BUS_FD, HEXLOAD_PACING_LOCKSTEP);
    for (uint32_t tick = 7; tick < 300; tick++) {
        hexload_bus_answer_t answer;
        machine.count = 0;
        give(HEXLOAD_BUS_FD, tick);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ANSWER_FRAMES, machine.count);
        TEST_ASSERT_EQUAL_INT(1, read_answers(HEXLOAD_BUS_FD, tick, &answer));
        TEST_ASSERT_EQUAL_UINT32(tick, answer.tick);
        TEST_ASSERT_EQUAL_UINT8(node.app.state, answer.state);
        TEST_ASSERT_TRUE(node.app.estimate.tick == tick);
        TEST_ASSERT_TRUE((float)node.app.estimate.value[HEXLOAD_PAPER_DZ] ==
                         (float)answer.estimate.value[HEXLOAD_PAPER_DZ]);
    }
}

static void test_classic_samples_are_answered_with_one_page_at_every_second_tick(void) {
    begin_run(HEXLOAD_BUS_CLASSIC, HEXLOAD_PACING_LOCKSTEP);
    hexload_bus_answer_t answer;
    hexload_estimate_t at_first_page = {0};
    for (uint32_t tick = 0; tick < 52; tick++) {
        machine.count = tick == 26 ? 0 : machine.count;
        const int before = machine.count;
        give(HEXLOAD_BUS_CLASSIC, tick);
        TEST_ASSERT_EQUAL_INT(tick % 2 == 0, machine.count - before);
        at_first_page = tick == 26 ? node.app.estimate : at_first_page;
    }
    TEST_ASSERT_EQUAL_INT(1, read_answers(HEXLOAD_BUS_CLASSIC, 51, &answer));
    TEST_ASSERT_EQUAL_UINT32(26, answer.tick);
    for (int k = 0; k < HEXLOAD_PAPER_DIM; k++) {
        TEST_ASSERT_TRUE((float)at_first_page.value[k] == (float)answer.estimate.value[k]);
        TEST_ASSERT_TRUE((float)at_first_page.sigma[k] == (float)answer.estimate.sigma[k]);
    }
    TEST_ASSERT_EQUAL_UINT32(0, node.send_failed); // the ticks without a page are none
}

static void test_each_run_begins_its_classic_answers_with_page_zero(void) {
    // GIVEN a run that ended in the middle of a round of pages
    hexload_bus_answer_t answer;
    begin_run(HEXLOAD_BUS_CLASSIC, HEXLOAD_PACING_LOCKSTEP);
    for (uint32_t tick = 0; tick < 5; tick++) {
        give(HEXLOAD_BUS_CLASSIC, tick);
    }
    // WHEN a second run begins
    command(HEXLOAD_COMMAND_RESET, 0.0f);
    command(HEXLOAD_COMMAND_START, (float)HEXLOAD_PACING_LOCKSTEP);
    machine.count = 0;
    for (uint32_t tick = 0; tick < HEXLOAD_BUS_ANSWER_PAGES * HEXLOAD_BUS_ANSWER_PERIOD; tick++) {
        give(HEXLOAD_BUS_CLASSIC, tick);
    }
    // THEN its first round of pages is a whole answer, to its first sample
    TEST_ASSERT_EQUAL_INT(1, read_answers(HEXLOAD_BUS_CLASSIC, 0, &answer));
    TEST_ASSERT_EQUAL_UINT32(0, answer.tick);
}

/// A run with the momentum filter.
static void begin_momentum_run(hexload_bus_profile_t profile) {
    begin_active(profile);
    command(HEXLOAD_COMMAND_SELECT_FILTER, (float)HEXLOAD_FILTER_MOMENTUM);
    command(HEXLOAD_COMMAND_START, (float)HEXLOAD_PACING_LOCKSTEP);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_APP_ARMED, node.app.state);
    machine.count = 0;
}

static void assert_ten_of(const hexload_estimate_t* expected, const hexload_bus_answer_t* answer) {
    TEST_ASSERT_EQUAL_UINT8(HEXLOAD_FILTER_MOMENTUM, answer->filter);
    for (int k = 0; k < HEXLOAD_LOAD_DIM; k++) {
        TEST_ASSERT_TRUE((float)expected->value[k] == (float)answer->estimate.value[k]);
        TEST_ASSERT_TRUE((float)expected->sigma[k] == (float)answer->estimate.sigma[k]);
        TEST_ASSERT_EQUAL_INT(expected->parameter_verdict[k], answer->estimate.parameter_verdict[k]);
    }
    TEST_ASSERT_EQUAL_INT(expected->verdict, answer->estimate.verdict);
}

static void test_the_momentum_filter_answers_each_fd_sample_with_all_ten(void) {
    begin_momentum_run(HEXLOAD_BUS_FD);
    for (uint32_t tick = 0; tick < 300; tick++) {
        hexload_bus_answer_t answer;
        machine.count = 0;
        give(HEXLOAD_BUS_FD, tick);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ANSWER_FRAMES, machine.count);
        TEST_ASSERT_EQUAL_INT(1, read_answers(HEXLOAD_BUS_FD, tick, &answer));
        TEST_ASSERT_EQUAL_UINT32(tick, answer.tick);
        assert_ten_of(&node.app.estimate, &answer);
    }
    TEST_ASSERT_TRUE(node.app.estimate.value[HEXLOAD_LOAD_M] > HEXLOAD_REAL(100.0));
}

static void test_a_force_sensor_that_fails_reaches_the_estimator_as_lost(void) {
    for (int profile = HEXLOAD_BUS_CLASSIC; profile <= HEXLOAD_BUS_FD; profile++) {
        // GIVEN a run on either bus WHEN leg 3 has no force any more, then no displacement
        begin_momentum_run((hexload_bus_profile_t)profile);
        for (uint32_t tick = 0; tick < 400; tick++) {
            hexload_leg_sample_t sample = sample_at(tick);
            hexload_bus_frame_t frames[HEXLOAD_BUS_SAMPLE_FRAMES];
            hexload_real_t* lost = tick < 300 ? &sample.force_n[2] : &sample.displacement_m[2];
            *lost = tick < 200 ? *lost : (hexload_real_t)NAN;
            const int count = encode_sample((hexload_bus_profile_t)profile, &sample, frames);
            for (int n = 0; n < count; n++) {
                hexload_node_receive(&node, &frames[n]);
            }
            // THEN five go on, AND the health says that one is lost
            TEST_ASSERT_EQUAL(tick >= 200,
                              (hexload_app_health(&node.app)->bits >> HEXLOAD_HEALTH_CHANNEL_LOST & 1u) != 0);
        }
        TEST_ASSERT_EQUAL_UINT32(399, node.app.estimate.tick);
        TEST_ASSERT_DOUBLE_WITHIN(25.0, 500.0, (double)node.app.estimate.value[HEXLOAD_LOAD_M]);
    }
}

static void test_the_momentum_filter_answers_classic_samples_with_rounds_of_26_pages(void) {
    begin_momentum_run(HEXLOAD_BUS_CLASSIC);
    hexload_estimate_t at_first_page = {0};
    for (uint32_t tick = 0; tick < 5 * 52; tick++) {
        machine.count = tick == 4 * 52 ? 0 : machine.count;
        const int before = machine.count;
        give(HEXLOAD_BUS_CLASSIC, tick);
        TEST_ASSERT_EQUAL_INT(tick % 2 == 0, machine.count - before);
        at_first_page = tick == 4 * 52 ? node.app.estimate : at_first_page;
    }
    hexload_bus_answer_t answer;
    TEST_ASSERT_EQUAL_INT(1, read_answers(HEXLOAD_BUS_CLASSIC, 5 * 52 - 1, &answer));
    TEST_ASSERT_EQUAL_UINT32(4 * 52, answer.tick);
    assert_ten_of(&at_first_page, &answer);
}

static void test_a_changed_load_is_an_event_before_the_answer_and_stays_in_the_status(void) {
    for (int profile = 0; profile < 2; profile++) {
        // GIVEN a load that has been identified
        const hexload_bus_profile_t own = (hexload_bus_profile_t)profile;
        begin_momentum_run(own);
        uint32_t tick = 0;
        for (; tick < 1041; tick++) { // an odd tick, which no classic page answers
            machine.count = 0;
            give(own, tick);
        }
        TEST_ASSERT_EQUAL_UINT16(0, read_status().load_changes);
        // WHEN it is another one
        is_heavy = true;
        hexload_bus_load_change_t change = {0};
        hexload_bus_status_t found = HEXLOAD_BUS_OTHER;
        for (; tick < 1060 && found == HEXLOAD_BUS_OTHER; tick++) {
            machine.count = 0;
            give(own, tick);
            found = machine.count > 0 ? hexload_bus_decode_load_change(&machine.sent[0], &change) : found;
        }
        // THEN the first frame that is sent then is the event, once, and the status goes on to report it
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, found);
        TEST_ASSERT_EQUAL_UINT32(tick - 1, change.tick);
        TEST_ASSERT_EQUAL_UINT16(1, change.load_changes);
        machine.count = 0;
        for (const uint32_t end = tick + 60; tick < end; tick++) {
            give(own, tick);
        }
        for (int n = 0; n < machine.count; n++) {
            TEST_ASSERT_NOT_EQUAL(ID_LOAD_CHANGE, machine.sent[n].id);
        }
        TEST_ASSERT_EQUAL_UINT16(1, read_status().load_changes);
        command(HEXLOAD_COMMAND_RESET, 0.0f);
        TEST_ASSERT_EQUAL_UINT16(0, read_status().load_changes);
    }
}

static void test_a_round_of_pages_reports_the_health_of_all_samples_since_the_one_before(void) {
    // GIVEN classic runs of either filter, in which one tick is missing, wherever in the round it is
    const uint32_t missing_bit = 1u << HEXLOAD_HEALTH_SAMPLE_MISSING;
    for (uint8_t filter = HEXLOAD_FILTER_PAPER; filter <= HEXLOAD_FILTER_MOMENTUM; filter++) {
        const uint32_t ticks = HEXLOAD_BUS_ANSWER_PERIOD * (uint32_t)hexload_bus_answer_pages(filter);
        for (uint32_t missing = 1; missing < ticks; missing++) {
            begin_active(HEXLOAD_BUS_CLASSIC);
            command(HEXLOAD_COMMAND_SELECT_FILTER, (float)filter);
            command(HEXLOAD_COMMAND_START, (float)HEXLOAD_PACING_LOCKSTEP);
            machine.count = 0;
            for (uint32_t tick = 0; tick < 4 * ticks; tick++) {
                if (tick != missing) {
                    give(HEXLOAD_BUS_CLASSIC, tick);
                }
            }
            // WHEN its answers are read THEN one of them reports it
            hexload_answer_assembly_t assembly;
            int told = 0;
            hexload_answer_assembly_init(&assembly, HEXLOAD_BUS_CLASSIC);
            for (int n = 0; n < machine.count; n++) {
                hexload_bus_answer_t answer = {0};
                uint32_t answered_tick = 0;
                told += hexload_answer_assembly_add(&assembly, &machine.sent[n], 2 * ticks, &answered_tick,
                                                    &answer) == HEXLOAD_BUS_OK &&
                        (answer.health & missing_bit) != 0;
            }
            TEST_ASSERT_EQUAL_INT(1, told);
        }
    }
}

static void test_the_first_page_has_just_the_health_of_the_samples_since_the_one_before_it(void) {
    // GIVEN a classic run that was stopped with a missing sample not yet told, and one after it
    begin_run(HEXLOAD_BUS_CLASSIC, HEXLOAD_PACING_LOCKSTEP);
    for (uint32_t tick = 0; tick < 40; tick++) {
        give_without(HEXLOAD_BUS_CLASSIC, tick, tick == 35 ? 3 : -1);
    }
    TEST_ASSERT_BITS_HIGH(1u << HEXLOAD_HEALTH_SAMPLE_MISSING, node.health_seen);
    command(HEXLOAD_COMMAND_STOP, 0.0f);
    command(HEXLOAD_COMMAND_START, (float)HEXLOAD_PACING_LOCKSTEP);
    const uint32_t round = HEXLOAD_BUS_ANSWER_PERIOD * HEXLOAD_BUS_ANSWER_PAGES;
    uint32_t seen = 0;
    for (uint32_t tick = 0; tick < 5 * round; tick++) {
        // WHEN a first page is sent THEN it has these bits
        machine.count = 0;
        give(HEXLOAD_BUS_CLASSIC, tick);
        seen |= hexload_app_health(&node.app)->bits;
        if (tick % round == 0) {
            hexload_bus_answer_t answer = {0};
            int page = -1;
            uint16_t tick_low = 0;
            TEST_ASSERT_EQUAL_INT(1, machine.count);
            TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK,
                                  hexload_answer_decode_page(&machine.sent[0], &page, &tick_low, &answer));
            TEST_ASSERT_EQUAL_INT(0, page);
            TEST_ASSERT_EQUAL_HEX16(seen, answer.health);
            seen = 0;
        }
    }
}

static void test_a_round_of_pages_leaves_out_the_health_of_samples_that_were_refused(void) {
    // GIVEN a classic run in which a sample has been missing, and a round of pages that has told it
    const uint32_t missing_bit = 1u << HEXLOAD_HEALTH_SAMPLE_MISSING;
    begin_run(HEXLOAD_BUS_CLASSIC, HEXLOAD_PACING_LOCKSTEP);
    for (uint32_t tick = 0; tick < 65; tick++) {
        give(HEXLOAD_BUS_CLASSIC, tick);
    }
    give(HEXLOAD_BUS_CLASSIC, 67);
    TEST_ASSERT_BITS(missing_bit, missing_bit, node.health_seen);
    node.health_seen = 0;
    // WHEN the next sample is refused, and an answer has the health of the one before
    hexload_leg_sample_t sample = sample_at(69);
    hexload_bus_frame_t frames[HEXLOAD_BUS_SAMPLE_FRAMES];
    sample.displacement_m[0] = HEXLOAD_REAL(1.0); // no leg is that long
    for (int n = 0, count = encode_sample(HEXLOAD_BUS_CLASSIC, &sample, frames); n < count; n++) {
        hexload_node_receive(&node, &frames[n]);
    }
    // THEN what that one had is not told twice
    TEST_ASSERT_EQUAL_UINT32(1, hexload_app_health(&node.app)->refused);
    TEST_ASSERT_EQUAL_HEX16(0, node.health_seen);
}

static void test_an_answer_that_is_no_number_is_not_sent_and_is_counted(void) {
    // GIVEN a node whose memory has been damaged: its estimate is no number WHEN a sample comes
    for (int p = 0; p < 2; p++) {
        const hexload_bus_profile_t profile = p == 0 ? HEXLOAD_BUS_FD : HEXLOAD_BUS_CLASSIC;
        begin_active(profile);
        node.app.estimate.value[0] = (hexload_real_t)NAN;
        give(profile, 16);
        // THEN it sends no answer, and its status says that something could not be sent
        TEST_ASSERT_EQUAL_INT(0, machine.count);
        TEST_ASSERT_EQUAL_UINT32(1, node.send_failed);
    }
}

static void test_idle_and_fault_answer_samples_too(void) {
    for (int state = 0; state < 2; state++) {
        begin_active(HEXLOAD_BUS_FD);
        hexload_bus_answer_t answer;
        hexload_app_set_fault(&node.app, state == 0 ? HEXLOAD_FAULT_NONE : HEXLOAD_FAULT_SAMPLES_REFUSED);
        give(HEXLOAD_BUS_FD, 3);
        TEST_ASSERT_EQUAL_INT(1, read_answers(HEXLOAD_BUS_FD, 3, &answer));
        TEST_ASSERT_EQUAL_UINT8(state == 0 ? HEXLOAD_APP_IDLE : HEXLOAD_APP_FAULT, answer.state);
    }
}

static void test_start_among_flowing_classic_samples_estimates_from_the_next_tick(void) {
    begin_active(HEXLOAD_BUS_CLASSIC);
    for (uint32_t tick = 16; tick < 37; tick++) {
        give(HEXLOAD_BUS_CLASSIC, tick);
        pass(1);
    }
    command(HEXLOAD_COMMAND_START, HEXLOAD_PACING_REAL_TIME);
    give(HEXLOAD_BUS_CLASSIC, 37);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_APP_ESTIMATING, node.app.state);
    TEST_ASSERT_EQUAL_UINT32(37, node.app.estimate.tick);
}

static void test_a_lost_leg_frame_shows_in_answer_health_and_status(void) {
    begin_run(HEXLOAD_BUS_CLASSIC, HEXLOAD_PACING_REAL_TIME);
    for (uint32_t tick = 0; tick < 26 + 26; tick++) {
        machine.count = tick == 26 ? 0 : machine.count;
        give_without(HEXLOAD_BUS_CLASSIC, tick, tick == 25 ? 3 : -1); // leg 4 of tick 25
        pass(1);
    }
    hexload_bus_answer_t answer;
    TEST_ASSERT_EQUAL_INT(1, read_answers(HEXLOAD_BUS_CLASSIC, 51, &answer));
    TEST_ASSERT_EQUAL_UINT32(26, answer.tick);
    TEST_ASSERT_EQUAL_HEX8(0x08, answer.missing_legs);
    TEST_ASSERT_BITS_HIGH(1u << HEXLOAD_HEALTH_SAMPLE_MISSING, answer.health);
    TEST_ASSERT_EQUAL_UINT32(1, read_status().samples_missing);
}

static void test_start_and_reset_forget_which_legs_were_missing(void) {
    for (int lost_tick = 24; lost_tick < 26; lost_tick++) { // followed by a whole one, or the last
        for (int is_start = 0; is_start < 2; is_start++) {
            // GIVEN a run that missed leg 4 once
            begin_run(HEXLOAD_BUS_CLASSIC, HEXLOAD_PACING_LOCKSTEP);
            for (uint32_t tick = 0; tick < 26; tick++) {
                give_without(HEXLOAD_BUS_CLASSIC, tick, (int)tick == lost_tick ? 3 : -1);
            }
            // WHEN it is stopped and started again, or reset, and the source begins anew
            command(is_start != 0 ? HEXLOAD_COMMAND_STOP : HEXLOAD_COMMAND_RESET, 0.0f);
            if (is_start != 0) {
                command(HEXLOAD_COMMAND_START, (float)HEXLOAD_PACING_LOCKSTEP);
            }
            machine.count = 0;
            for (uint32_t tick = 0; tick < 26; tick++) {
                give(HEXLOAD_BUS_CLASSIC, tick);
            }
            // THEN its first whole answer knows of no missing leg
            hexload_bus_answer_t answer;
            TEST_ASSERT_EQUAL_INT(1, read_answers(HEXLOAD_BUS_CLASSIC, 25, &answer));
            TEST_ASSERT_EQUAL_UINT32(0, answer.tick);
            TEST_ASSERT_EQUAL_HEX8(0, answer.missing_legs);
        }
    }
}

static void test_a_change_of_fault_does_not_wait_for_the_round_of_pages_to_end(void) {
    begin_run(HEXLOAD_BUS_CLASSIC, HEXLOAD_PACING_REAL_TIME);
    for (uint32_t tick = 0; tick < 10; tick++) {
        give(HEXLOAD_BUS_CLASSIC, tick);
    }
    hexload_app_set_fault(&node.app, HEXLOAD_FAULT_SAMPLES_REFUSED);
    machine.count = 0;
    give(HEXLOAD_BUS_CLASSIC, 10);
    TEST_ASSERT_EQUAL_INT(1, machine.count);
    TEST_ASSERT_EQUAL_UINT8(0, machine.sent[0].data[3] >> 2); // page 0
    TEST_ASSERT_EQUAL_UINT8(HEXLOAD_FAULT_SAMPLES_REFUSED, machine.sent[0].data[7] & 0x0F);
}

static void test_a_strangers_frame_or_two_are_counted_and_stop_nothing(void) {
    hexload_bus_frame_t frames[CONTROLLERS_FRAMES];
    controllers_frames(frames);
    for (int n = 0; n < CONTROLLERS_FRAMES; n++) {
        // GIVEN a run WHEN a controller's identifier comes with another length, or with a wrong checksum, a
        // hundred times
        begin_run(HEXLOAD_BUS_FD, HEXLOAD_PACING_LOCKSTEP);
        hexload_bus_frame_t damaged = frames[n];
        damaged.data[damaged.length - 1] ^= 0x10;
        hear(&damaged, 100);
        damaged = frames[n];
        damaged.length = (uint8_t)(damaged.length / 2);
        hear(&damaged, 100);
        // or whole ones come twice in a second, again and again
        for (int second = 0; second < 5; second++) {
            hear(&frames[n], HEXLOAD_NODE_STRANGERS - 1);
            pass(HEXLOAD_NODE_MEMORY_MS);
        }
        // THEN it goes on, and counts what it refused
        TEST_ASSERT_EQUAL_INT(HEXLOAD_APP_ARMED, node.app.state);
        TEST_ASSERT_EQUAL_UINT32(200, node.status.frames_refused);
    }
    for (int profile = 0; profile < 2; profile++) {
        // and so does a run with two frames of the other profile
        begin_run((hexload_bus_profile_t)profile, HEXLOAD_PACING_LOCKSTEP);
        const hexload_leg_sample_t sample = sample_at(3);
        hexload_bus_frame_t others[HEXLOAD_BUS_SAMPLE_FRAMES];
        encode_sample((hexload_bus_profile_t)(1 - profile), &sample, others);
        hear(&others[0], HEXLOAD_NODE_STRANGERS - 1);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_APP_ARMED, node.app.state);
    }
}

/// Forces that are a tenth too large, in all frames of a tick.
static void give_forged(hexload_bus_profile_t profile, uint32_t tick) {
    hexload_leg_sample_t sample = sample_at(tick);
    hexload_bus_frame_t frames[HEXLOAD_BUS_SAMPLE_FRAMES];
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        sample.force_n[leg] *= HEXLOAD_REAL(1.1);
    }
    const int count = encode_sample(profile, &sample, frames);
    for (int n = count > HEXLOAD_LEGS ? 1 : 0; n < count; n++) {
        hexload_node_receive(&node, &frames[n]);
    }
}

static void test_forged_samples_beside_the_sources_own_are_a_fault(void) {
    for (int profile = 0; profile < 2; profile++) {
        for (uint32_t early = 0; early < 5; early++) {
            // GIVEN a run WHEN somebody else sends samples, in the same tick or ticks before the source
            const hexload_bus_profile_t own = (hexload_bus_profile_t)profile;
            begin_run(own, HEXLOAD_PACING_LOCKSTEP);
            uint32_t tick = 0;
            for (; tick < 50; tick++) {
                give(own, tick);
            }
            for (; tick < 65 && node.app.state != HEXLOAD_APP_FAULT; tick++) {
                give_forged(own, tick + early);
                give(own, tick);
            }
            // THEN that is a fault: at once in the same tick, else within 15 ticks
            TEST_ASSERT_EQUAL_INT(HEXLOAD_FAULT_SECOND_SOURCE, node.app.fault);
            TEST_ASSERT_TRUE(early > 0 || tick == 51);
        }
    }
}

static void test_a_forged_tick_under_a_repeated_whole_tick_is_a_fault(void) {
    for (int is_early = 0; is_early < 2; is_early++) {
        // GIVEN a classic run WHEN somebody sends SampleTick and six legs of his own before the source's, or
        // after
        begin_run(HEXLOAD_BUS_CLASSIC, HEXLOAD_PACING_LOCKSTEP);
        uint32_t tick = 0;
        for (; tick < 48; tick++) {
            give(HEXLOAD_BUS_CLASSIC, tick);
        }
        const hexload_leg_sample_t sample = sample_at(tick);
        hexload_bus_frame_t own[HEXLOAD_BUS_SAMPLE_FRAMES];
        encode_sample(HEXLOAD_BUS_CLASSIC, &sample, own);
        if (is_early == 0) {
            give(HEXLOAD_BUS_CLASSIC, tick);
        }
        hexload_node_receive(&node, &own[0]);
        give_forged(HEXLOAD_BUS_CLASSIC, tick);
        if (is_early != 0) {
            give(HEXLOAD_BUS_CLASSIC, tick);
        }
        // THEN the whole tick does not begin anew what has come, and the second leg shows two sources
        TEST_ASSERT_EQUAL_INT(HEXLOAD_FAULT_SECOND_SOURCE, node.app.fault);
    }
}

enum { ATTACKS = 300, ATTACKED_TICKS = 140 };

/// A number of 0 .. limit - 1.
static uint32_t draw(uint32_t limit, uint64_t* seed) {
    return (uint32_t)((uniform(seed) + 1.0) / 2.0 * 0.999999 * (double)limit);
}

/// What a forger who keeps the contract may send around this tick: whole samples or single legs of it, of
/// later and of earlier ones, with other forces, or the whole tick of another time.
static void forge(uint32_t tick, uint64_t* seed) {
    const uint32_t shift = draw(24, seed);
    hexload_leg_sample_t sample = sample_at(tick + shift - 12);
    hexload_bus_frame_t frames[HEXLOAD_BUS_SAMPLE_FRAMES];
    const double share = 1.0 + 0.5 * uniform(seed);
    if (draw(4, seed) == 0) {
        sample.tick = 16 * draw(tick / 16 + (draw(2, seed) == 0 ? 8 : 1u << 24), seed);
        encode_sample(HEXLOAD_BUS_CLASSIC, &sample, frames);
        hexload_node_receive(&node, &frames[0]);
        return;
    }
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        sample.force_n[leg] *= (hexload_real_t)share;
    }
    const int count = encode_sample(HEXLOAD_BUS_CLASSIC, &sample, frames);
    const int only = draw(2, seed) == 0 ? (int)draw((uint32_t)count, seed) : -1;
    for (int n = 0; n < count; n++) {
        if (only < 0 || n == only) {
            hexload_node_receive(&node, &frames[n]);
        }
    }
}

/// A classic run that is attacked now and then from its fiftieth to its hundredth tick; `attacks`: at so many
/// of a hundred ticks.
static void run_attacked(uint32_t attacks, uint64_t* seed) {
    begin_run(HEXLOAD_BUS_CLASSIC, HEXLOAD_PACING_LOCKSTEP);
    for (uint32_t tick = 0; tick < ATTACKED_TICKS; tick++) {
        const bool is_attacked = tick >= 50 && tick < 100 && attacks > 0 && draw(100, seed) < attacks;
        const bool is_first = draw(2, seed) == 0;
        if (is_attacked && is_first) {
            forge(tick, seed);
        }
        give(HEXLOAD_BUS_CLASSIC, tick);
        if (is_attacked && !is_first) {
            forge(tick, seed);
        }
        machine.count = 0;
    }
}

static void test_forged_classic_samples_move_no_estimate_by_a_sigma_without_a_fault(void) {
    // GIVEN the estimate of an undisturbed run
    uint64_t seed = 16;
    run_attacked(0, &seed);
    const hexload_estimate_t undisturbed = node.app.estimate;
    int faults = 0;
    for (int n = 0; n < ATTACKS; n++) {
        // WHEN somebody forges frames in runs like it, once or again and again
        run_attacked(n % 3 == 0 ? 2 : n % 3 == 1 ? 10 : 50, &seed);
        faults += node.app.fault != HEXLOAD_FAULT_NONE;
        // THEN there is a fault, or the estimate is that of the undisturbed run within a sigma
        for (int k = 0; k < HEXLOAD_PAPER_DIM && node.app.fault == HEXLOAD_FAULT_NONE; k++) {
            TEST_ASSERT_DOUBLE_WITHIN((double)undisturbed.sigma[k], (double)undisturbed.value[k],
                                      (double)node.app.estimate.value[k]);
        }
    }
    TEST_ASSERT_GREATER_THAN_INT(ATTACKS / 2, faults);
    TEST_ASSERT_LESS_THAN_INT(ATTACKS, faults);
}

static void test_one_false_tick_does_not_stop_the_run(void) {
    for (int profile = 0; profile < 2; profile++) {
        // GIVEN a run WHEN one sample, or one SampleTick, comes that is far ahead
        const hexload_bus_profile_t own = (hexload_bus_profile_t)profile;
        begin_run(own, HEXLOAD_PACING_LOCKSTEP);
        for (uint32_t tick = 0; tick < 200; tick++) {
            if (tick == 103) {
                const hexload_leg_sample_t far = sample_at(1u << 20);
                hexload_bus_frame_t frames[HEXLOAD_BUS_SAMPLE_FRAMES];
                encode_sample(own, &far, frames);
                hexload_node_receive(&node, &frames[0]);
            }
            give(own, tick);
        }
        // THEN the run goes on with the source's ticks
        TEST_ASSERT_EQUAL_UINT32(199, node.app.last_tick);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_FAULT_NONE, node.app.fault);
    }
}

static void test_a_source_that_goes_on_far_ahead_is_followed_when_it_is_silent_where_it_was(void) {
    const uint32_t half_ms[2] = {50, 5000}; // of the silence that is a fault
    for (int pacing = 0; pacing < 2; pacing++) {
        // GIVEN a source that has been silent for less than half the time-out
        begin_run(HEXLOAD_BUS_FD, (hexload_pacing_t)pacing);
        give(HEXLOAD_BUS_FD, 5);
        pass(half_ms[pacing] - 1);
        machine.count = 0;
        // WHEN samples come from far ahead THEN none is followed, and none answered
        uint32_t tick = 100000;
        for (uint32_t n = 0; n < 3 * HEXLOAD_APP_JUMP_SAMPLES; n++) {
            give(HEXLOAD_BUS_FD, tick++);
        }
        TEST_ASSERT_EQUAL_UINT32(5, node.app.last_tick);
        TEST_ASSERT_EQUAL_UINT16(HEXLOAD_APP_JUMP_SAMPLES, node.app.jump_samples);
        TEST_ASSERT_EQUAL_INT(0, machine.count);
        // WHEN it is silent for longer THEN the line that goes on is followed
        pass(1);
        give(HEXLOAD_BUS_FD, tick);
        TEST_ASSERT_EQUAL_UINT32(tick, node.app.last_tick);
        // AND a gap that is no jump is none
        give(HEXLOAD_BUS_FD, tick + HEXLOAD_APP_FARTHEST_JUMP);
        TEST_ASSERT_EQUAL_UINT32(tick + HEXLOAD_APP_FARTHEST_JUMP, node.app.last_tick);
    }
}

static void test_too_few_that_follow_one_another_are_not_followed_however_silent_the_source(void) {
    // GIVEN a source that is silent for longer than half the time-out WHEN samples come from far ahead
    begin_run(HEXLOAD_BUS_FD, HEXLOAD_PACING_REAL_TIME);
    give(HEXLOAD_BUS_FD, 5);
    pass(60);
    for (uint32_t n = 0; n < HEXLOAD_APP_JUMP_SAMPLES; n++) {
        // THEN the twentieth is followed
        TEST_ASSERT_EQUAL_UINT32(5, node.app.last_tick);
        give(HEXLOAD_BUS_FD, 100000 + n);
    }
    TEST_ASSERT_EQUAL_UINT32(100000 + HEXLOAD_APP_JUMP_SAMPLES - 1, node.app.last_tick);
}

static void test_the_line_that_is_followed_stays_so_beside_a_flood_from_far_ahead(void) {
    for (int profile = 0; profile < 2; profile++) {
        // GIVEN a run beside which somebody sends, in each ms, more samples than are allowed to be refused in
        // a row; classic: the whole tick of another time and of the next
        const hexload_bus_profile_t own = (hexload_bus_profile_t)profile;
        uint32_t far = 1u << 20;
        begin_run(own, HEXLOAD_PACING_REAL_TIME);
        for (uint32_t tick = 0; tick < 300; tick++) {
            give(own, tick);
            pass(1);
            machine.count = 0;
            for (uint32_t n = 0; n < 150 && tick % 16 == 7; n++, far += own == HEXLOAD_BUS_FD ? 1 : 16) {
                hexload_bus_frame_t frames[HEXLOAD_BUS_SAMPLE_FRAMES];
                const hexload_leg_sample_t sample = sample_at(far);
                encode_sample(own, &sample, frames);
                hexload_node_receive(&node, &frames[0]);
            }
            // THEN none of these is answered
            TEST_ASSERT_EQUAL_INT(0, machine.count);
        }
        // AND the source's line goes on; classic: 60 whole ticks in a second are too many to be accidents
        const bool is_fd = own == HEXLOAD_BUS_FD;
        TEST_ASSERT_EQUAL_UINT32(is_fd ? 299 : 7, node.app.last_tick);
        TEST_ASSERT_EQUAL_INT(is_fd ? HEXLOAD_FAULT_NONE : HEXLOAD_FAULT_SECOND_SOURCE, node.app.fault);
    }
}

static void test_a_sample_that_comes_again_and_again_is_refused_and_not_answered(void) {
    // GIVEN a run WHEN a sample comes a thousand times more THEN it goes on, with a remark
    begin_run(HEXLOAD_BUS_FD, HEXLOAD_PACING_REAL_TIME);
    give(HEXLOAD_BUS_FD, 5);
    machine.count = 0;
    for (int n = 0; n < 1000; n++) {
        give(HEXLOAD_BUS_FD, 5);
    }
    TEST_ASSERT_EQUAL_INT(0, machine.count);
    give(HEXLOAD_BUS_FD, 6);
    hexload_bus_answer_t answer;
    TEST_ASSERT_EQUAL_INT(1, read_answers(HEXLOAD_BUS_FD, 6, &answer));
    TEST_ASSERT_EQUAL_UINT8(HEXLOAD_FAULT_NONE, answer.fault);
    TEST_ASSERT_BITS_HIGH(1u << HEXLOAD_HEALTH_FRAMES_REFUSED, answer.health);
}

static void test_samples_far_ahead_are_not_answered_and_late_ones_are_as_such(void) {
    // GIVEN a run in lockstep WHEN a sample comes that is farther ahead than is followed, up to half of all
    // ticks, or late THEN the source of a late one, which may wait for it, hears that, and it is counted
    static const struct {
        uint32_t ahead;
        bool is_late;
    } cases[] = {{HEXLOAD_APP_FARTHEST_JUMP + 1, false},
                 {UINT32_MAX / 2, false},
                 {UINT32_MAX / 2 + 2, true},
                 {UINT32_MAX / 3 * 2, true},
                 {UINT32_MAX - 4, true},
                 {UINT32_MAX, true}};
    for (size_t n = 0; n < sizeof cases / sizeof cases[0]; n++) {
        const uint32_t last = 104;
        begin_run(HEXLOAD_BUS_FD, HEXLOAD_PACING_LOCKSTEP);
        give(HEXLOAD_BUS_FD, last);
        machine.count = 0;
        give(HEXLOAD_BUS_FD, last + cases[n].ahead);
        hexload_bus_answer_t answer = {.status = HEXLOAD_OK};
        TEST_ASSERT_EQUAL_INT(cases[n].is_late, read_answers(HEXLOAD_BUS_FD, last, &answer));
        TEST_ASSERT_EQUAL_INT8(cases[n].is_late ? HEXLOAD_ERR_TICK : HEXLOAD_OK, answer.status);
        TEST_ASSERT_EQUAL_UINT32(cases[n].is_late ? HEXLOAD_LEGS : 0, node.late.count);
        TEST_ASSERT_EQUAL_UINT32(1, node.status.frames_refused);
    }
    // AND one that is just as far ahead as behind is answered, too
    begin_run(HEXLOAD_BUS_FD, HEXLOAD_PACING_LOCKSTEP);
    give(HEXLOAD_BUS_FD, 104);
    machine.count = 0;
    give(HEXLOAD_BUS_FD, 104 + UINT32_MAX / 2 + 1);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ANSWER_FRAMES, machine.count);
}

static void test_sixty_late_leg_frames_of_a_second_are_another_source(void) {
    // GIVEN a classic run WHEN legs of a tick that is over come again THEN the sixtieth is a fault
    begin_run(HEXLOAD_BUS_CLASSIC, HEXLOAD_PACING_LOCKSTEP);
    for (uint32_t tick = 0; tick < 5; tick++) {
        give(HEXLOAD_BUS_CLASSIC, tick);
    }
    const hexload_leg_sample_t late = sample_at(3);
    hexload_bus_frame_t frames[HEXLOAD_BUS_SAMPLE_FRAMES];
    encode_sample(HEXLOAD_BUS_CLASSIC, &late, frames);
    hear(&frames[2], HEXLOAD_NODE_LATE_FRAMES - 1);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_FAULT_NONE, node.app.fault);
    hear(&frames[2], 1);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_FAULT_SECOND_SOURCE, node.app.fault);
}

static void test_samples_far_ahead_are_not_late_ones(void) {
    // GIVEN a run with one late sample WHEN many come from far ahead THEN there are not ten late ones
    begin_run(HEXLOAD_BUS_FD, HEXLOAD_PACING_REAL_TIME);
    give(HEXLOAD_BUS_FD, 5);
    give(HEXLOAD_BUS_FD, 6);
    give(HEXLOAD_BUS_FD, 5);
    TEST_ASSERT_EQUAL_UINT32(HEXLOAD_LEGS, node.late.count);
    for (uint32_t n = 0; n < 15; n++) {
        give(HEXLOAD_BUS_FD, 100000 + n);
    }
    TEST_ASSERT_EQUAL_UINT32(HEXLOAD_LEGS, node.late.count);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_FAULT_NONE, node.app.fault);
}

static void test_a_forged_sample_that_hides_behind_one_far_ahead_is_a_fault(void) {
    // GIVEN a run WHEN each of the source's samples comes after a forged one of its tick and one far ahead
    begin_run(HEXLOAD_BUS_FD, HEXLOAD_PACING_REAL_TIME);
    for (uint32_t tick = 0; tick < 10; tick++) {
        TEST_ASSERT_EQUAL_INT(HEXLOAD_FAULT_NONE, node.app.fault);
        give_forged(HEXLOAD_BUS_FD, tick);
        give(HEXLOAD_BUS_FD, tick + (1u << 20));
        give(HEXLOAD_BUS_FD, tick);
    }
    // THEN ten such samples are two sources
    TEST_ASSERT_EQUAL_INT(HEXLOAD_FAULT_SECOND_SOURCE, node.app.fault);
}

static void test_many_refused_frames_are_a_health_bit_for_a_second_or_two(void) {
    hexload_bus_answer_t answer;
    hexload_bus_frame_t garbage = {.id = ID_LEG_SAMPLE_FD, .length = 64, .is_fd = true};
    const uint16_t bit = 1u << HEXLOAD_HEALTH_FRAMES_REFUSED;
    for (uint32_t n = 0; n < 6; n++) {
        const uint32_t tick = n % 3;
        if (tick == 0) { // a run that begins at once, or minutes later
            begin_run(HEXLOAD_BUS_FD, HEXLOAD_PACING_LOCKSTEP);
            hexload_node_period(&node, 1 + 100000 * n);
        }
        // GIVEN nine refused frames, ten, and ten two seconds ago
        hear(&garbage, tick == 0 ? HEXLOAD_NODE_MANY_REFUSED - 1 : tick == 1 ? 1 : 0);
        pass(tick == 2 ? 2 * HEXLOAD_NODE_MEMORY_MS : 0);
        node.app.state = HEXLOAD_APP_ARMED; // silence is not of interest
        machine.count = 0;
        give(HEXLOAD_BUS_FD, tick);
        TEST_ASSERT_EQUAL_INT(1, read_answers(HEXLOAD_BUS_FD, tick, &answer));
        TEST_ASSERT_EQUAL_HEX16(tick == 1 ? bit : 0, answer.health & bit);
    }
}

static void test_samples_of_the_other_profile_are_a_fault(void) {
    for (int profile = 0; profile < 2; profile++) {
        const hexload_bus_profile_t own = (hexload_bus_profile_t)profile,
                                    other = (hexload_bus_profile_t)(1 - profile);
        begin_active(own);
        for (uint32_t tick = 3; tick < 3 + HEXLOAD_NODE_STRANGERS; tick++) {
            give(other, tick);
        }
        TEST_ASSERT_EQUAL_INT(HEXLOAD_FAULT_WRONG_PROFILE, node.app.fault);
        TEST_ASSERT_EQUAL_UINT8(HEXLOAD_FAULT_WRONG_PROFILE, read_status().fault);
    }
}

static void test_status_pages_go_out_one_by_one_every_fifty_milliseconds(void) {
    begin_active(HEXLOAD_BUS_FD);
    for (int n = 0; n < 3 * HEXLOAD_BUS_STATUS_PAGES; n++) {
        pass(HEXLOAD_NODE_STATUS_PERIOD_MS - 1);
        TEST_ASSERT_EQUAL_INT(n, machine.count);
        pass(1);
        TEST_ASSERT_EQUAL_INT(n + 1, machine.count);
        TEST_ASSERT_EQUAL_HEX32(ID_CONTROLLER_STATUS, machine.sent[n].id);
        TEST_ASSERT_EQUAL_UINT8((n + (machine.sent[0].data[1] >> 4)) % HEXLOAD_BUS_STATUS_PAGES,
                                machine.sent[n].data[1] >> 4);
        TEST_ASSERT_EQUAL_UINT8((n + machine.sent[0].data[1]) & 0x0F, machine.sent[n].data[1] & 0x0F);
    }
}

static void test_the_status_reports_version_tick_and_counters(void) {
    begin_run(HEXLOAD_BUS_FD, HEXLOAD_PACING_LOCKSTEP);
    give(HEXLOAD_BUS_FD, 100);
    give(HEXLOAD_BUS_FD, 104);
    give(HEXLOAD_BUS_FD, 104); // an echo
    give(HEXLOAD_BUS_FD, 103); // late
    hexload_node_period(&node, 0);
    hexload_node_period(&node, 4); // three periods missed
    const hexload_bus_controller_status_t status = read_status();
    char version[16];
    (void)snprintf(version, sizeof version, "%d.%d.%d", status.version[0], status.version[1],
                   status.version[2]);
    TEST_ASSERT_EQUAL_STRING(HEXLOAD_VERSION, version);
    TEST_ASSERT_EQUAL_UINT8(HEXLOAD_BUS_FD, status.profile);
    TEST_ASSERT_EQUAL_UINT8(HEXLOAD_APP_ESTIMATING, status.state);
    TEST_ASSERT_EQUAL_UINT32(104, status.tick);
    TEST_ASSERT_EQUAL_UINT32(3, status.overruns);
    TEST_ASSERT_EQUAL_UINT32(4321, status.stack_margin_bytes);
    TEST_ASSERT_EQUAL_UINT32(3, status.samples_missing);
    TEST_ASSERT_EQUAL_UINT32(1, status.samples_refused);
    TEST_ASSERT_EQUAL_UINT32(2, status.frames_refused);
}

static void test_mass_in_force_and_configuration_are_told_and_what_contradicts_the_mass(void) {
    // GIVEN a controller that is told the mass of another load
    begin_active(HEXLOAD_BUS_FD);
    const uint32_t configured = read_status().configuration;
    machine.count = 0;
    command(HEXLOAD_COMMAND_SET_KNOWN_MASS, 400.0f);
    TEST_ASSERT_EQUAL_HEX8(hexload_bus_known_mass_crc(400.0f), last_acknowledge().known_mass_crc);
    command(HEXLOAD_COMMAND_START, (float)HEXLOAD_PACING_LOCKSTEP);
    // WHEN it has estimated for a while
    for (uint32_t tick = 0; tick < 1000; tick++) {
        machine.count = 0;
        give(HEXLOAD_BUS_FD, tick);
    }
    // THEN its answer is misfit, and the status says why, by how much, and what is in force
    hexload_bus_answer_t answer;
    TEST_ASSERT_EQUAL_INT(1, read_answers(HEXLOAD_BUS_FD, 999, &answer));
    TEST_ASSERT_EQUAL_INT(HEXLOAD_VERDICT_MISFIT, answer.estimate.verdict);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_INPUT_KNOWN_MASS, answer.input.cause);
    const hexload_bus_controller_status_t status = read_status();
    TEST_ASSERT_EQUAL_INT(HEXLOAD_INPUT_KNOWN_MASS, status.input.cause);
    TEST_ASSERT_DOUBLE_WITHIN(10.0, 981.0, (double)status.input.excess_n);
    TEST_ASSERT_TRUE(status.known_mass_kg == 400.0f);
    TEST_ASSERT_NOT_EQUAL(configured, status.configuration);
    // WHEN it is reset THEN the configured mass is in force
    machine.count = 0;
    command(HEXLOAD_COMMAND_RESET, 0.0f);
    TEST_ASSERT_EQUAL_HEX8(hexload_bus_known_mass_crc(500.0f), last_acknowledge().known_mass_crc);
    TEST_ASSERT_EQUAL_HEX32(configured, read_status().configuration);
    TEST_ASSERT_TRUE(read_status().known_mass_kg == 500.0f);
}

static void test_counters_stay_at_their_largest_value(void) {
    begin_run(HEXLOAD_BUS_FD, HEXLOAD_PACING_LOCKSTEP);
    for (uint32_t n = 0; n < 4; n++) {
        node.app.silence_ms = 0; // only the counters are of interest
        hexload_node_period(&node, n == 0 ? 9000 : UINT32_MAX / 2);
        node.app.state = n == 0 ? HEXLOAD_APP_ARMED : HEXLOAD_APP_ESTIMATING;
        give(HEXLOAD_BUS_FD, n * HEXLOAD_APP_FARTHEST_JUMP);
        node.app.samples_missing = n == 0 ? UINT32_MAX - 10 : node.app.samples_missing;
    }
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, node.status.overruns);
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX, node.app.samples_missing);
    TEST_ASSERT_TRUE(hexload_node_is_active(&node)); // the age, too
}

static void test_the_time_margin_is_the_least_since_it_was_last_reported(void) {
    begin_run(HEXLOAD_BUS_FD, HEXLOAD_PACING_LOCKSTEP);
    machine.step_us = 300;
    give(HEXLOAD_BUS_FD, 0);
    machine.step_us = 800;
    give(HEXLOAD_BUS_FD, 1);
    machine.step_us = 400;
    give(HEXLOAD_BUS_FD, 2);
    TEST_ASSERT_EQUAL_INT32(200, read_status().time_margin_us);
    TEST_ASSERT_EQUAL_INT32(0, read_status().time_margin_us); // nothing measured since
    machine.step_us = 1700; // more than the period, and the clock wraps on the way
    machine.now_us = UINT32_MAX - 2000;
    give(HEXLOAD_BUS_FD, 3);
    TEST_ASSERT_EQUAL_INT32(-700, read_status().time_margin_us);
    machine.step_us = 1000; // none left; 0 would read "not measured"
    give(HEXLOAD_BUS_FD, 4);
    TEST_ASSERT_EQUAL_INT32(-1, read_status().time_margin_us);
}

static void test_the_time_margin_is_that_of_the_nearest_whole_period(void) {
    const double period_us[2] = {333.3, 333.7};
    for (int n = 0; n < 2; n++) {
        begin_active(HEXLOAD_BUS_FD);
        node.app.config.tick_s = (hexload_real_t)(1e-6 * period_us[n]);
        machine.step_us = 300;
        give(HEXLOAD_BUS_FD, 0);
        TEST_ASSERT_EQUAL_INT32(n == 0 ? 33 : 34, node.status.time_margin_us);
    }
}

static void test_a_port_without_clock_and_stack_measure_will_do(void) {
    const hexload_config_t config = paper_machine();
    const hexload_port_t port = {.context = &machine, .send = log_frame};
    hexload_app_settings_t settings;
    hexload_app_settings_default(&settings);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_node_init(&node, &config, &settings, HEXLOAD_BUS_FD, &port));
    pass(HEXLOAD_NODE_LISTEN_MS);
    give(HEXLOAD_BUS_FD, 0);
    const hexload_bus_controller_status_t status = read_status();
    TEST_ASSERT_EQUAL_INT32(0, status.time_margin_us);
    TEST_ASSERT_EQUAL_UINT32(0, status.stack_margin_bytes);
}

static void test_frames_that_cannot_be_queued_are_counted_and_work_goes_on(void) {
    begin_run(HEXLOAD_BUS_FD, HEXLOAD_PACING_REAL_TIME);
    machine.is_full = true;
    give(HEXLOAD_BUS_FD, 0);
    command(HEXLOAD_COMMAND_SELECT_FILTER, 0.0f);
    TEST_ASSERT_EQUAL_UINT32(4, node.send_failed);
    machine.is_full = false;
    give(HEXLOAD_BUS_FD, 1);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ANSWER_FRAMES, machine.count);
    TEST_ASSERT_EQUAL_UINT32(1, node.app.estimate.tick);
}

static void test_after_eight_silent_milliseconds_classic_waits_for_the_whole_tick(void) {
    // seven: the four bits are still unambiguous
    begin_run(HEXLOAD_BUS_CLASSIC, HEXLOAD_PACING_REAL_TIME);
    give(HEXLOAD_BUS_CLASSIC, 16);
    pass(HEXLOAD_NODE_TICK_LOST - 1);
    give(HEXLOAD_BUS_CLASSIC, 23);
    TEST_ASSERT_EQUAL_UINT32(23, node.app.last_tick);
    // eight: the next samples are not used until the whole tick comes
    pass(HEXLOAD_NODE_TICK_LOST);
    give(HEXLOAD_BUS_CLASSIC, 31);
    TEST_ASSERT_EQUAL_UINT32(23, node.app.last_tick);
    give(HEXLOAD_BUS_CLASSIC, 32);
    TEST_ASSERT_EQUAL_UINT32(32, node.app.last_tick);
}

static void test_in_lockstep_silence_does_not_lose_the_tick(void) {
    begin_run(HEXLOAD_BUS_CLASSIC, HEXLOAD_PACING_LOCKSTEP);
    give(HEXLOAD_BUS_CLASSIC, 16);
    pass(5000);
    give(HEXLOAD_BUS_CLASSIC, 17);
    TEST_ASSERT_EQUAL_UINT32(17, node.app.last_tick);
}

static void test_a_silent_source_is_a_fault_that_the_status_reports(void) {
    begin_run(HEXLOAD_BUS_FD, HEXLOAD_PACING_REAL_TIME);
    give(HEXLOAD_BUS_FD, 0);
    pass(99);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_APP_ESTIMATING, node.app.state);
    pass(1);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_APP_FAULT, node.app.state);
    TEST_ASSERT_EQUAL_UINT8(HEXLOAD_FAULT_SAMPLE_TIMEOUT, read_status().fault);
}

static void test_a_bus_that_goes_down_and_up_leads_over_fault_to_idle(void) {
    begin_run(HEXLOAD_BUS_CLASSIC, HEXLOAD_PACING_REAL_TIME);
    give(HEXLOAD_BUS_CLASSIC, 16);
    hexload_node_bus_state(&node, true); // nothing changes while it is up
    TEST_ASSERT_EQUAL_INT(HEXLOAD_APP_ESTIMATING, node.app.state);
    hexload_node_bus_state(&node, false);
    hexload_node_bus_state(&node, false);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_FAULT_BUS_DOWN, node.app.fault);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_APP_FAULT, node.app.state);
    hexload_node_bus_state(&node, true);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_APP_IDLE, node.app.state);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_FAULT_NONE, node.app.fault);
    // the source may have gone on meanwhile: legs are of use after the next whole tick
    command(HEXLOAD_COMMAND_START, HEXLOAD_PACING_REAL_TIME);
    give(HEXLOAD_BUS_CLASSIC, 19);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_APP_ARMED, node.app.state);
    give(HEXLOAD_BUS_CLASSIC, 32);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_APP_ESTIMATING, node.app.state);
}

static void test_a_bus_that_comes_up_again_has_missed_no_leg(void) {
    // GIVEN a tick of which legs have come when the bus goes down WHEN it comes up THEN none is missing
    begin_run(HEXLOAD_BUS_CLASSIC, HEXLOAD_PACING_REAL_TIME);
    give_without(HEXLOAD_BUS_CLASSIC, 16, 3);
    hexload_node_bus_state(&node, false);
    TEST_ASSERT_EQUAL_HEX8(0x04, node.assembly.missing_legs);
    hexload_node_bus_state(&node, true);
    TEST_ASSERT_EQUAL_HEX8(0, node.assembly.missing_legs);
}

static void test_a_bus_that_comes_up_clears_no_other_fault(void) {
    begin_active(HEXLOAD_BUS_FD);
    hexload_app_set_fault(&node.app, HEXLOAD_FAULT_WRONG_PROFILE);
    hexload_node_bus_state(&node, false);
    hexload_node_bus_state(&node, true);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_FAULT_WRONG_PROFILE, node.app.fault);
}

static void test_random_frames_do_no_harm(void) {
    uint64_t seed = 11;
    for (int profile = 0; profile < 2; profile++) {
        begin_active((hexload_bus_profile_t)profile);
        for (int n = 0; n < 100000; n++) {
            const hexload_bus_frame_t frame = random_frame(&seed);
            hexload_node_receive(&node, &frame);
            pass(n % 4 == 0);
            machine.count = 0;
            TEST_ASSERT_TRUE(node.app.state <= HEXLOAD_APP_FAULT);
            TEST_ASSERT_EQUAL_INT(node.app.state == HEXLOAD_APP_FAULT, node.app.fault != HEXLOAD_FAULT_NONE);
        }
        // whatever came: RESET and START make it work again
        command(HEXLOAD_COMMAND_RESET, 0.0f);
        command(HEXLOAD_COMMAND_SET_KNOWN_MASS, 500.0f);
        command(HEXLOAD_COMMAND_START, HEXLOAD_PACING_REAL_TIME);
        give((hexload_bus_profile_t)profile, 16);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_APP_ESTIMATING, node.app.state);
    }
}

/// Members that a start sets to zero, but for what the application and the estimator keep; of structures,
/// which are set as a whole, the first.
#define FOR_ALL_ZERO(DO)                                                                                     \
    DO(answer.tick)                                                                                          \
    DO(status.time_margin_us)                                                                                \
    DO(command.kind)                                                                                         \
    DO(age_ms)                                                                                               \
    DO(clock_ms)                                                                                             \
    DO(leg_silence_ms)                                                                                       \
    DO(status_wait_ms)                                                                                       \
    DO(send_failed)                                                                                          \
    DO(health_seen)                                                                                          \
    DO(strangers.since_ms)                                                                                   \
    DO(foreign.since_ms)                                                                                     \
    DO(late.since_ms)                                                                                        \
    DO(refused.since_ms)                                                                                     \
    DO(answer_page)                                                                                          \
    DO(status_page)                                                                                          \
    DO(acknowledges)                                                                                         \
    DO(heard_controller)                                                                                     \
    DO(has_answer_codes)                                                                                     \
    DO(answer_code.has_frames)                                                                               \
    DO(is_challenge_due)
#define ASSERT_ZERO_MEMBER(member) TEST_ASSERT_TRUE_MESSAGE(node.member == 0, #member);

static void test_a_start_leaves_nothing_of_what_memory_held(void) {
    // GIVEN memory of ones, as after a reset that keeps it WHEN a node starts in it THEN nothing has been
    // counted yet, and the first challenge and the first refusal need not wait
    memset(&node, 1, sizeof node);
    begin_listening(HEXLOAD_BUS_FD);
    FOR_ALL_ZERO(ASSERT_ZERO_MEMBER)
    TEST_ASSERT_EQUAL_UINT32(HEXLOAD_NODE_CHALLENGE_MS, node.challenge_wait_ms);
    TEST_ASSERT_EQUAL_UINT32(HEXLOAD_NODE_REFUSAL_MS, node.refusal_wait_ms);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_init_refuses_a_bad_configuration_and_leaves_the_instance_alone);
    RUN_TEST(test_a_listening_node_sends_nothing_and_does_nothing);
    RUN_TEST(test_a_node_that_hears_a_controller_while_listening_stays_silent);
    RUN_TEST(test_an_active_node_that_hears_another_controller_says_so);
    RUN_TEST(test_a_command_is_acknowledged_with_state_and_profile);
    RUN_TEST(test_a_nodes_first_command_is_carried_out_whatever_its_counter);
    RUN_TEST(test_a_damaged_command_is_counted_and_neither_carried_out_nor_acknowledged);
    RUN_TEST(test_a_command_that_comes_twice_is_carried_out_once);
    RUN_TEST(test_a_counter_that_comes_again_with_any_other_content_has_another_source);
    RUN_TEST(test_a_source_with_another_configuration_cannot_start);
    RUN_TEST(test_each_fd_sample_is_answered_at_once);
    RUN_TEST(test_classic_samples_are_answered_with_one_page_at_every_second_tick);
    RUN_TEST(test_each_run_begins_its_classic_answers_with_page_zero);
    RUN_TEST(test_the_momentum_filter_answers_each_fd_sample_with_all_ten);
    RUN_TEST(test_a_force_sensor_that_fails_reaches_the_estimator_as_lost);
    RUN_TEST(test_the_momentum_filter_answers_classic_samples_with_rounds_of_26_pages);
    RUN_TEST(test_a_changed_load_is_an_event_before_the_answer_and_stays_in_the_status);
    RUN_TEST(test_a_round_of_pages_reports_the_health_of_all_samples_since_the_one_before);
    RUN_TEST(test_the_first_page_has_just_the_health_of_the_samples_since_the_one_before_it);
    RUN_TEST(test_a_round_of_pages_leaves_out_the_health_of_samples_that_were_refused);
    RUN_TEST(test_an_answer_that_is_no_number_is_not_sent_and_is_counted);
    RUN_TEST(test_idle_and_fault_answer_samples_too);
    RUN_TEST(test_start_among_flowing_classic_samples_estimates_from_the_next_tick);
    RUN_TEST(test_a_lost_leg_frame_shows_in_answer_health_and_status);
    RUN_TEST(test_start_and_reset_forget_which_legs_were_missing);
    RUN_TEST(test_a_change_of_fault_does_not_wait_for_the_round_of_pages_to_end);
    RUN_TEST(test_a_strangers_frame_or_two_are_counted_and_stop_nothing);
    RUN_TEST(test_forged_samples_beside_the_sources_own_are_a_fault);
    RUN_TEST(test_a_forged_tick_under_a_repeated_whole_tick_is_a_fault);
    RUN_TEST(test_forged_classic_samples_move_no_estimate_by_a_sigma_without_a_fault);
    RUN_TEST(test_one_false_tick_does_not_stop_the_run);
    RUN_TEST(test_a_source_that_goes_on_far_ahead_is_followed_when_it_is_silent_where_it_was);
    RUN_TEST(test_too_few_that_follow_one_another_are_not_followed_however_silent_the_source);
    RUN_TEST(test_the_line_that_is_followed_stays_so_beside_a_flood_from_far_ahead);
    RUN_TEST(test_a_sample_that_comes_again_and_again_is_refused_and_not_answered);
    RUN_TEST(test_samples_far_ahead_are_not_answered_and_late_ones_are_as_such);
    RUN_TEST(test_sixty_late_leg_frames_of_a_second_are_another_source);
    RUN_TEST(test_samples_far_ahead_are_not_late_ones);
    RUN_TEST(test_a_forged_sample_that_hides_behind_one_far_ahead_is_a_fault);
    RUN_TEST(test_many_refused_frames_are_a_health_bit_for_a_second_or_two);
    RUN_TEST(test_samples_of_the_other_profile_are_a_fault);
    RUN_TEST(test_status_pages_go_out_one_by_one_every_fifty_milliseconds);
    RUN_TEST(test_the_status_reports_version_tick_and_counters);
    RUN_TEST(test_mass_in_force_and_configuration_are_told_and_what_contradicts_the_mass);
    RUN_TEST(test_counters_stay_at_their_largest_value);
    RUN_TEST(test_the_time_margin_is_the_least_since_it_was_last_reported);
    RUN_TEST(test_the_time_margin_is_that_of_the_nearest_whole_period);
    RUN_TEST(test_a_port_without_clock_and_stack_measure_will_do);
    RUN_TEST(test_frames_that_cannot_be_queued_are_counted_and_work_goes_on);
    RUN_TEST(test_after_eight_silent_milliseconds_classic_waits_for_the_whole_tick);
    RUN_TEST(test_in_lockstep_silence_does_not_lose_the_tick);
    RUN_TEST(test_a_silent_source_is_a_fault_that_the_status_reports);
    RUN_TEST(test_a_bus_that_goes_down_and_up_leads_over_fault_to_idle);
    RUN_TEST(test_a_bus_that_comes_up_again_has_missed_no_leg);
    RUN_TEST(test_a_bus_that_comes_up_clears_no_other_fault);
    RUN_TEST(test_random_frames_do_no_harm);
    RUN_TEST(test_a_start_leaves_nothing_of_what_memory_held);
    return UNITY_END();
}
