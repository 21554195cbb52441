#include "frames.h"
#include "motion.h"

#include "app/app.h"

#include <stddef.h>
#include <string.h>

void setUp(void) {}
void tearDown(void) {}

static const body_t paper_load = {500.0, {0.0, 0.0, 0.3}, {25.0, 25.0, 25.0, 0.0, 0.0, 0.0}};

static hexload_app_t idle_app(void) {
    const hexload_config_t config = paper_machine();
    hexload_app_settings_t settings;
    hexload_app_t app;
    hexload_app_settings_default(&settings);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_app_init(&app, &config, &settings));
    return app;
}

static hexload_bus_result_t command(hexload_app_t* app, uint8_t kind, float argument) {
    const hexload_bus_command_t order = {
        .kind = kind, .sequence = (uint8_t)(kind + 100), .argument = argument};
    hexload_bus_acknowledge_t acknowledge = {0};
    hexload_app_command(app, &order, &acknowledge);
    TEST_ASSERT_EQUAL_UINT8(kind, acknowledge.kind);
    TEST_ASSERT_EQUAL_UINT8(kind + 100, acknowledge.sequence);
    TEST_ASSERT_EQUAL_UINT8(app->state, acknowledge.state);
    TEST_ASSERT_EQUAL_UINT8(app->fault, acknowledge.fault);
    return (hexload_bus_result_t)acknowledge.result;
}

static double home_height_m(const hexload_app_t* app) {
    return (double)(app->config.kind == HEXLOAD_KIND_MOMENTUM ? app->estimator.as.momentum.kinematics
                                                              : app->estimator.as.paper.kinematics)
        .home_height_m;
}

static hexload_leg_sample_t sample_at(const hexload_app_t* app, uint32_t tick) {
    const motion_t motion = paper_motion(0.02);
    return perfect_sample(&app->config, &paper_load, &motion, home_height_m(app), tick);
}

static hexload_bus_answer_t give(hexload_app_t* app, uint32_t tick) {
    const hexload_leg_sample_t sample = sample_at(app, tick);
    hexload_bus_answer_t answer = {0};
    hexload_app_sample(app, &sample, &answer);
    return answer;
}

static hexload_bus_answer_t give_bad(hexload_app_t* app, uint32_t tick) {
    hexload_leg_sample_t sample = sample_at(app, tick);
    hexload_bus_answer_t answer = {0};
    sample.force_n[2] = HEXLOAD_REAL(2e8);
    hexload_app_sample(app, &sample, &answer);
    return answer;
}

/// An application in the wanted state, with three samples behind it if it runs.
static hexload_app_t app_in(hexload_app_state_t state) {
    hexload_app_t app = idle_app();
    if (state == HEXLOAD_APP_IDLE) {
        return app;
    }
    TEST_ASSERT_EQUAL_INT(HEXLOAD_RESULT_DONE,
                          command(&app, HEXLOAD_COMMAND_START, HEXLOAD_PACING_REAL_TIME));
    if (state == HEXLOAD_APP_CONVERGED) { // any sigma below its prior will do
        app.config.paper.converged_relative_sigma = HEXLOAD_REAL(1.0);
    }
    for (uint32_t tick = 0; state != HEXLOAD_APP_ARMED && app.state != state && tick < 2000; tick++) {
        (void)give(&app, tick);
        if (state == HEXLOAD_APP_FAULT) {
            hexload_app_set_fault(&app, HEXLOAD_FAULT_BUS_DOWN);
        }
    }
    TEST_ASSERT_EQUAL_INT(state, app.state);
    return app;
}

static void test_init_refuses_what_is_out_of_range_and_leaves_the_instance_alone(void) {
    const hexload_config_t good = paper_machine();
    hexload_config_t bad = good;
    hexload_app_settings_t settings[9];
    hexload_app_t app, before;
    for (int n = 0; n < 9; n++) {
        hexload_app_settings_default(&settings[n]);
    }
    settings[1].sample_timeout_ms = 4;
    settings[2].sample_timeout_ms = 60001;
    settings[3].lockstep_timeout_ms = 4;
    settings[4].lockstep_timeout_ms = 600001;
    settings[5].refused_limit = 0;
    settings[6].sample_timeout_ms = 5;
    settings[7].lockstep_timeout_ms = 600000;
    bad.tick_s = HEXLOAD_REAL(0.0);
    memset(&app, 0x5A, sizeof app);
    memcpy(&before, &app, sizeof before);
    for (int n = 0; n < 6; n++) {
        TEST_ASSERT_EQUAL_INT(HEXLOAD_ERR_CONFIG,
                              hexload_app_init(&app, n == 0 ? &bad : &good, &settings[n]));
        TEST_ASSERT_EQUAL_MEMORY(&before, &app, sizeof before);
    }
    bad = good;
    bad.kind = HEXLOAD_KINDS;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_ERR_CONFIG, hexload_app_init(&app, &bad, &settings[8]));
    TEST_ASSERT_EQUAL_MEMORY(&before, &app, sizeof before);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_app_init(&app, &good, &settings[6]));
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_app_init(&app, &good, &settings[7]));
}

static void test_an_idle_application_answers_samples_and_estimates_nothing(void) {
    hexload_app_t app = idle_app();
    const hexload_bus_answer_t answer = give(&app, 77);
    TEST_ASSERT_EQUAL_UINT32(77, answer.tick);
    TEST_ASSERT_EQUAL_UINT8(HEXLOAD_APP_IDLE, answer.state);
    TEST_ASSERT_EQUAL_INT8(HEXLOAD_OK, answer.status);
    TEST_ASSERT_EQUAL_UINT32(0, app.estimator.as.paper.leg_gate.accepted);
    // the answer is what is known before the first sample: the prior
    TEST_ASSERT_EQUAL_INT(HEXLOAD_VERDICT_NOT_EXCITED, answer.estimate.verdict);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_VERDICT_NOT_EXCITED, answer.estimate.parameter_verdict[HEXLOAD_PAPER_IZZ]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 0.0, (double)answer.estimate.value[HEXLOAD_PAPER_DZ]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 0.31622777, (double)answer.estimate.sigma[HEXLOAD_PAPER_DZ]);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 3.0, (double)answer.estimate.nis_mean);
}

static void test_start_first_sample_and_verdict_lead_through_the_states(void) {
    hexload_app_t app = idle_app();
    TEST_ASSERT_EQUAL_INT(HEXLOAD_APP_IDLE, app.state);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_RESULT_DONE, command(&app, HEXLOAD_COMMAND_START, HEXLOAD_PACING_LOCKSTEP));
    TEST_ASSERT_EQUAL_INT(HEXLOAD_APP_ARMED, app.state);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_PACING_LOCKSTEP, app.pacing);
    TEST_ASSERT_EQUAL_UINT8(HEXLOAD_APP_ESTIMATING, give(&app, 0).state);
    // GIVEN a limit that every sigma is soon below
    app.config.paper.converged_relative_sigma = HEXLOAD_REAL(1.0);
    uint32_t tick = 1;
    while (app.state == HEXLOAD_APP_ESTIMATING && tick < 2000) {
        const hexload_bus_answer_t answer = give(&app, tick++);
        const bool has_converged = answer.estimate.verdict == HEXLOAD_VERDICT_CONVERGED;
        TEST_ASSERT_EQUAL_UINT8(has_converged ? HEXLOAD_APP_CONVERGED : HEXLOAD_APP_ESTIMATING, answer.state);
    }
    TEST_ASSERT_EQUAL_INT(HEXLOAD_APP_CONVERGED, app.state);
    // WHEN the verdict is another again THEN the state is too
    app.config.paper.converged_relative_sigma = HEXLOAD_REAL(1e-6);
    TEST_ASSERT_EQUAL_UINT8(HEXLOAD_APP_ESTIMATING, give(&app, tick).state);
}

static void test_a_refused_first_sample_leaves_the_application_armed(void) {
    hexload_app_t app = app_in(HEXLOAD_APP_ARMED);
    const hexload_bus_answer_t answer = give_bad(&app, 5);
    TEST_ASSERT_EQUAL_UINT8(HEXLOAD_APP_ARMED, answer.state);
    TEST_ASSERT_EQUAL_INT8(HEXLOAD_ERR_SAMPLE, answer.status);
    TEST_ASSERT_EQUAL_UINT32(1, answer.refused);
    TEST_ASSERT_EQUAL_UINT8(HEXLOAD_APP_ESTIMATING, give(&app, 6).state);
}

static void test_the_application_estimates_what_the_estimator_alone_does(void) {
    hexload_app_t app = app_in(HEXLOAD_APP_ARMED);
    hexload_paper_t alone;
    hexload_estimate_t estimate;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_paper_init(&alone, &app.config));
    for (uint32_t tick = 10; tick < 200; tick++) {
        const hexload_leg_sample_t sample = sample_at(&app, tick);
        const hexload_bus_answer_t answer = give(&app, tick);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_paper_tick(&alone, &app.config, &sample, &estimate));
        TEST_ASSERT_EQUAL_MEMORY(estimate.value, answer.estimate.value, sizeof estimate.value);
        TEST_ASSERT_EQUAL_MEMORY(estimate.sigma, answer.estimate.sigma, sizeof estimate.sigma);
        TEST_ASSERT_EQUAL_HEX16(alone.health.bits, answer.health);
        TEST_ASSERT_EQUAL_INT8(HEXLOAD_OK, answer.status);
    }
}

static void test_start_is_for_the_idle_state_and_known_pacings_only(void) {
    for (int state = HEXLOAD_APP_ARMED; state <= HEXLOAD_APP_FAULT; state++) {
        hexload_app_t app = app_in((hexload_app_state_t)state);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_RESULT_WRONG_STATE, command(&app, HEXLOAD_COMMAND_START, 0.0f));
        TEST_ASSERT_EQUAL_INT(state, app.state);
    }
    const float wrong[4] = {2.0f, 0.5f, -1.0f, 1e30f};
    for (int n = 0; n < 4; n++) {
        hexload_app_t app = idle_app();
        TEST_ASSERT_EQUAL_INT(HEXLOAD_RESULT_BAD_ARGUMENT, command(&app, HEXLOAD_COMMAND_START, wrong[n]));
        TEST_ASSERT_EQUAL_INT(HEXLOAD_APP_IDLE, app.state);
    }
}

static void test_stop_keeps_the_estimate_and_start_begins_afresh(void) {
    hexload_app_t app = app_in(HEXLOAD_APP_ARMED);
    for (uint32_t tick = 500; tick < 600; tick++) {
        (void)give(&app, tick);
    }
    const hexload_estimate_t last = app.estimate;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_RESULT_DONE, command(&app, HEXLOAD_COMMAND_STOP, 0.0f));
    TEST_ASSERT_EQUAL_INT(HEXLOAD_APP_IDLE, app.state);
    const hexload_bus_answer_t answer = give(&app, 600);
    TEST_ASSERT_EQUAL_MEMORY(last.value, answer.estimate.value, sizeof last.value);
    TEST_ASSERT_EQUAL_UINT32(599, app.estimate.tick);
    // a source that counts from 0 again is accepted after START, and nothing of the first run is left
    TEST_ASSERT_EQUAL_INT(HEXLOAD_RESULT_DONE, command(&app, HEXLOAD_COMMAND_START, 0.0f));
    hexload_app_t fresh = app_in(HEXLOAD_APP_ARMED);
    for (uint32_t tick = 0; tick < 50; tick++) {
        const hexload_bus_answer_t again = give(&app, tick), first = give(&fresh, tick);
        TEST_ASSERT_EQUAL_MEMORY(first.estimate.value, again.estimate.value, sizeof first.estimate.value);
        TEST_ASSERT_EQUAL_INT8(HEXLOAD_OK, again.status);
    }
    TEST_ASSERT_EQUAL_UINT32(0, app.samples_missing);
}

static void test_stop_is_refused_in_fault_only(void) {
    for (int state = HEXLOAD_APP_IDLE; state <= HEXLOAD_APP_FAULT; state++) {
        hexload_app_t app = app_in((hexload_app_state_t)state);
        const bool is_fault = state == HEXLOAD_APP_FAULT;
        TEST_ASSERT_EQUAL_INT(is_fault ? HEXLOAD_RESULT_WRONG_STATE : HEXLOAD_RESULT_DONE,
                              command(&app, HEXLOAD_COMMAND_STOP, 0.0f));
        TEST_ASSERT_EQUAL_INT(is_fault ? HEXLOAD_APP_FAULT : HEXLOAD_APP_IDLE, app.state);
    }
}

static void test_reset_leads_to_idle_from_anywhere_and_forgets(void) {
    for (int state = HEXLOAD_APP_IDLE; state <= HEXLOAD_APP_FAULT; state++) {
        hexload_app_t app = app_in((hexload_app_state_t)state);
        (void)give_bad(&app, 4000);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_RESULT_DONE, command(&app, HEXLOAD_COMMAND_RESET, 0.0f));
        TEST_ASSERT_EQUAL_INT(HEXLOAD_APP_IDLE, app.state);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_FAULT_NONE, app.fault);
        const hexload_app_t fresh = idle_app();
        const hexload_bus_answer_t answer = give(&app, 3);
        TEST_ASSERT_EQUAL_MEMORY(fresh.estimate.sigma, answer.estimate.sigma, sizeof answer.estimate.sigma);
        TEST_ASSERT_EQUAL_MEMORY(fresh.estimate.value, answer.estimate.value, sizeof answer.estimate.value);
        TEST_ASSERT_EQUAL_UINT32(0, answer.refused);
    }
}

static void test_filters_are_selected_in_idle_and_only_those_there_are(void) {
    hexload_app_t app = idle_app();
    TEST_ASSERT_EQUAL_INT(HEXLOAD_KIND_PAPER, app.config.kind);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_RESULT_DONE, command(&app, HEXLOAD_COMMAND_SELECT_FILTER, 0.0f));
    TEST_ASSERT_EQUAL_INT(HEXLOAD_RESULT_DONE, command(&app, HEXLOAD_COMMAND_SELECT_FILTER, 1.0f));
    TEST_ASSERT_EQUAL_INT(HEXLOAD_KIND_MOMENTUM, app.config.kind);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_RESULT_DONE, command(&app, HEXLOAD_COMMAND_SELECT_FILTER, 2.0f));
    TEST_ASSERT_EQUAL_INT(HEXLOAD_KIND_MOMENTUM_EFFECTS, app.config.kind);
    const float bad[] = {0.5f, 3.0f, -1.0f, INFINITY, NAN};
    for (int n = 0; n < 5; n++) {
        TEST_ASSERT_EQUAL_INT(HEXLOAD_RESULT_BAD_ARGUMENT,
                              command(&app, HEXLOAD_COMMAND_SELECT_FILTER, bad[n]));
    }
    TEST_ASSERT_EQUAL_INT(HEXLOAD_KIND_MOMENTUM_EFFECTS, app.config.kind);
    for (int state = HEXLOAD_APP_ARMED; state <= HEXLOAD_APP_FAULT; state++) {
        app = app_in((hexload_app_state_t)state);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_RESULT_WRONG_STATE, command(&app, HEXLOAD_COMMAND_SELECT_FILTER, 1.0f));
        TEST_ASSERT_EQUAL_INT(HEXLOAD_KIND_PAPER, app.config.kind);
    }
}

static void test_another_filter_forgets_the_estimate_and_the_same_one_keeps_it(void) {
    // GIVEN an application that has estimated and was stopped
    hexload_app_t app = app_in(HEXLOAD_APP_ESTIMATING);
    const hexload_estimate_t last = app.estimate;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_RESULT_DONE, command(&app, HEXLOAD_COMMAND_STOP, 0.0f));
    // WHEN the same filter is selected THEN the estimate stays
    TEST_ASSERT_EQUAL_INT(HEXLOAD_RESULT_DONE, command(&app, HEXLOAD_COMMAND_SELECT_FILTER, 0.0f));
    TEST_ASSERT_EQUAL_MEMORY(last.value, app.estimate.value, sizeof last.value);
    // WHEN the other one is THEN answers have its prior, of all ten
    TEST_ASSERT_EQUAL_INT(HEXLOAD_RESULT_DONE, command(&app, HEXLOAD_COMMAND_SELECT_FILTER, 1.0f));
    const hexload_bus_answer_t answer = give(&app, 3);
    TEST_ASSERT_EQUAL_UINT8(HEXLOAD_FILTER_MOMENTUM, answer.filter);
    TEST_ASSERT_EQUAL_UINT8(HEXLOAD_APP_IDLE, answer.state);
    TEST_ASSERT_EQUAL_UINT32(0, answer.refused);
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 6.0, (double)answer.estimate.nis_mean);
    for (int k = 0; k < HEXLOAD_LOAD_DIM; k++) {
        TEST_ASSERT_TRUE(answer.estimate.value[k] == HEXLOAD_REAL(0.0));
        TEST_ASSERT_TRUE(answer.estimate.sigma[k] > HEXLOAD_REAL(1.0));
        TEST_ASSERT_EQUAL_INT(HEXLOAD_VERDICT_NOT_EXCITED, answer.estimate.parameter_verdict[k]);
    }
}

/// An application that has just been started with the momentum filter.
static hexload_app_t momentum_app(void) {
    hexload_config_t config = paper_machine();
    hexload_app_settings_t settings;
    hexload_app_t app;
    hexload_app_settings_default(&settings);
    config.kind = HEXLOAD_KIND_MOMENTUM;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_app_init(&app, &config, &settings));
    TEST_ASSERT_EQUAL_INT(HEXLOAD_RESULT_DONE, command(&app, HEXLOAD_COMMAND_START, 1.0f));
    return app;
}

static void test_the_application_estimates_what_the_momentum_estimator_alone_does(void) {
    // GIVEN an application configured for it, and one that was selected on the bus
    hexload_app_t configured = momentum_app(), told = idle_app();
    TEST_ASSERT_EQUAL_INT(HEXLOAD_RESULT_DONE, command(&told, HEXLOAD_COMMAND_SELECT_FILTER, 1.0f));
    TEST_ASSERT_EQUAL_INT(HEXLOAD_RESULT_DONE, command(&told, HEXLOAD_COMMAND_START, 1.0f));
    static hexload_momentum_t alone;
    hexload_estimate_t estimate;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_momentum_init(&alone, &told.config));
    // WHEN all three get the same samples THEN they say the same
    for (uint32_t tick = 10; tick < 600; tick++) {
        const hexload_leg_sample_t sample = sample_at(&told, tick);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_momentum_tick(&alone, &told.config, &sample, &estimate));
        hexload_app_t* const apps[2] = {&configured, &told};
        for (int n = 0; n < 2; n++) {
            const hexload_bus_answer_t answer = give(apps[n], tick);
            TEST_ASSERT_EQUAL_MEMORY(estimate.value, answer.estimate.value, sizeof estimate.value);
            TEST_ASSERT_EQUAL_MEMORY(estimate.sigma, answer.estimate.sigma, sizeof estimate.sigma);
            TEST_ASSERT_EQUAL_HEX16(alone.health.bits, answer.health);
            TEST_ASSERT_EQUAL_UINT8(HEXLOAD_FILTER_MOMENTUM, answer.filter);
            TEST_ASSERT_EQUAL_INT8(HEXLOAD_OK, answer.status);
        }
    }
    // and it has been a filter that had something to say
    TEST_ASSERT_TRUE(estimate.value[HEXLOAD_LOAD_M] > HEXLOAD_REAL(100.0));
}

static void test_the_tick_of_a_changed_load_is_kept(void) {
    // GIVEN an application that has identified a load WHEN the load is suddenly another
    static const body_t heavier = {800.0, {0.05, 0.0, 0.3}, {40.0, 40.0, 40.0, 0.0, 0.0, 0.0}};
    const motion_t motion = paper_motion(0.02);
    hexload_app_t app = momentum_app();
    hexload_bus_answer_t answer = {0};
    uint32_t tick = 0;
    for (; tick < 1000; tick++) {
        answer = give(&app, tick);
    }
    TEST_ASSERT_EQUAL_UINT32(0, hexload_app_health(&app)->count[HEXLOAD_HEALTH_LOAD_CHANGED]);
    while ((answer.health >> HEXLOAD_HEALTH_LOAD_CHANGED & 1u) == 0 && tick < 1100) {
        const hexload_leg_sample_t sample =
            perfect_sample(&app.config, &heavier, &motion, home_height_m(&app), tick++);
        hexload_app_sample(&app, &sample, &answer);
    }
    // THEN that is detected within ten ticks, reported in the health of that tick, and remembered
    TEST_ASSERT_LESS_OR_EQUAL_UINT32(1010, tick);
    TEST_ASSERT_EQUAL_UINT32(answer.tick, app.change_tick);
    TEST_ASSERT_EQUAL_UINT32(1, hexload_app_health(&app)->count[HEXLOAD_HEALTH_LOAD_CHANGED]);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_RESULT_DONE, command(&app, HEXLOAD_COMMAND_RESET, 0.0f));
    TEST_ASSERT_EQUAL_UINT32(0, app.change_tick);
}

static void test_a_known_mass_takes_the_safe_prior_along(void) {
    hexload_app_t app = idle_app();
    hexload_config_t expected = app.config;
    hexload_config_set_known_mass(&expected, HEXLOAD_REAL(320.5));
    hexload_config_set_prior(&expected, HEXLOAD_PRIOR_SAFE);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_RESULT_DONE, command(&app, HEXLOAD_COMMAND_SET_KNOWN_MASS, 320.5f));
    TEST_ASSERT_EQUAL_MEMORY(&expected, &app.config, sizeof expected);
    TEST_ASSERT_TRUE(app.config.paper.load_mass_kg == HEXLOAD_REAL(320.5));
    TEST_ASSERT_TRUE(app.config.momentum.prior_mass_kg == HEXLOAD_REAL(320.5));
    TEST_ASSERT_DOUBLE_WITHIN(1e-6, 0.3205, (double)app.config.momentum.prior_mass_sigma_kg);
    // START uses it
    TEST_ASSERT_EQUAL_INT(HEXLOAD_RESULT_DONE, command(&app, HEXLOAD_COMMAND_START, 0.0f));
    TEST_ASSERT_DOUBLE_WITHIN(1e-3, 320.5 * 0.04472136,
                              (double)give(&app, 0).estimate.sigma[HEXLOAD_PAPER_IXX]);
}

static void test_reset_restores_the_configured_mass_and_its_prior(void) {
    hexload_app_t app = idle_app();
    const hexload_config_t configured = app.config;
    const uint32_t checksum = hexload_app_configuration(&app.config);
    // GIVEN a mass that was set WHEN the status is looked at THEN it is in force, and in the checksum
    TEST_ASSERT_EQUAL_INT(HEXLOAD_RESULT_DONE, command(&app, HEXLOAD_COMMAND_SET_KNOWN_MASS, 900.0f));
    TEST_ASSERT_TRUE(hexload_app_known_mass_kg(&app) == HEXLOAD_REAL(900.0));
    TEST_ASSERT_NOT_EQUAL(checksum, hexload_app_configuration(&app.config));
    // WHEN a run has come and gone THEN it is still in force; WHEN RESET comes THEN the configured one is
    TEST_ASSERT_EQUAL_INT(HEXLOAD_RESULT_DONE, command(&app, HEXLOAD_COMMAND_START, 0.0f));
    TEST_ASSERT_EQUAL_INT(HEXLOAD_RESULT_DONE, command(&app, HEXLOAD_COMMAND_STOP, 0.0f));
    TEST_ASSERT_TRUE(hexload_app_known_mass_kg(&app) == HEXLOAD_REAL(900.0));
    TEST_ASSERT_EQUAL_INT(HEXLOAD_RESULT_DONE, command(&app, HEXLOAD_COMMAND_RESET, 0.0f));
    TEST_ASSERT_EQUAL_MEMORY(&configured, &app.config, sizeof configured);
    TEST_ASSERT_EQUAL_HEX32(checksum, hexload_app_configuration(&app.config));
}

static void test_a_configuration_has_its_checksum_whatever_the_kind(void) {
    hexload_config_t config = paper_machine();
    const uint32_t checksum = hexload_app_configuration(&config);
    config.kind = HEXLOAD_KIND_MOMENTUM_EFFECTS;
    TEST_ASSERT_EQUAL_HEX32(checksum, hexload_app_configuration(&config));
    config.rig.leg_tilt_kg_m = HEXLOAD_REAL(0.5);
    TEST_ASSERT_NOT_EQUAL(checksum, hexload_app_configuration(&config));
    config.rig.leg_tilt_kg_m = HEXLOAD_REAL(0.0);
    config.rig.direction[0].force_gain[0] = HEXLOAD_REAL(0.1); // does not count yet
    TEST_ASSERT_EQUAL_HEX32(checksum, hexload_app_configuration(&config));
    config.rig.direction_count = 1;
    TEST_ASSERT_NOT_EQUAL(checksum, hexload_app_configuration(&config));
}

static void test_the_checksum_of_a_configuration_is_that_of_its_bytes_from_the_tick_on(void) {
    // GIVEN a configuration with some directions WHEN its checksum is computed THEN it is that of its bytes,
    // from tick_s to the last direction that counts, and an application starts with it
    for (uint32_t directions = 0; directions <= HEXLOAD_RIG_DIRECTIONS_MAX; directions++) {
        hexload_config_t config = paper_machine();
        hexload_app_settings_t settings;
        hexload_app_t app;
        config.rig.direction_count = directions;
        const uint8_t* begin = (const uint8_t*)&config.tick_s;
        const uint8_t* end =
            (const uint8_t*)config.rig.direction + directions * sizeof config.rig.direction[0];
        const uint32_t expected = crc32p4(begin, (size_t)(end - begin));
        TEST_ASSERT_EQUAL_HEX32(expected, hexload_app_configuration(&config));
        hexload_app_settings_default(&settings);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_app_init(&app, &config, &settings));
        TEST_ASSERT_EQUAL_HEX32(expected, app.configuration);
    }
}

static void assert_nothing_counted(const hexload_app_t* app) {
    TEST_ASSERT_EQUAL_INT(HEXLOAD_FAULT_NONE, app->fault);
    TEST_ASSERT_EQUAL_UINT32(0, app->silence_ms);
    TEST_ASSERT_EQUAL_UINT32(0, app->refused_in_a_row);
    TEST_ASSERT_EQUAL_UINT32(0, app->samples_missing);
    TEST_ASSERT_EQUAL_UINT32(0, app->last_tick);
    TEST_ASSERT_EQUAL_UINT16(0, app->jump_samples);
    TEST_ASSERT_EQUAL_UINT32(0, app->change_tick);
    TEST_ASSERT_FALSE(app->has_codes);
}

static hexload_app_t app_in_used_memory(void) {
    const hexload_config_t config = paper_machine();
    hexload_app_settings_t settings;
    hexload_app_t app;
    hexload_app_settings_default(&settings);
    memset(&app, 0xFF, sizeof app);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_app_init(&app, &config, &settings));
    return app;
}

static void test_each_run_begins_with_counters_of_zero(void) {
    // GIVEN memory that was used before WHEN an application begins in it THEN nothing has been counted
    hexload_app_t app = app_in_used_memory();
    TEST_ASSERT_EQUAL_INT(HEXLOAD_APP_IDLE, app.state);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_PACING_REAL_TIME, app.pacing);
    assert_nothing_counted(&app);
    // AND WHEN a run of missing, refused and far samples, after a silence, is followed by another THEN that
    // one has counted nothing
    (void)command(&app, HEXLOAD_COMMAND_START, HEXLOAD_PACING_REAL_TIME);
    (void)give(&app, 3);
    (void)give(&app, 7);
    (void)give_bad(&app, 8);
    hexload_app_elapse(&app, 50);
    (void)give(&app, 5000);
    TEST_ASSERT_EQUAL_UINT16(1, app.jump_samples);
    (void)command(&app, HEXLOAD_COMMAND_STOP, 0.0f);
    (void)command(&app, HEXLOAD_COMMAND_START, HEXLOAD_PACING_REAL_TIME);
    assert_nothing_counted(&app);
}

static void test_as_many_refused_samples_as_allowed_end_in_fault_also_without_a_first_good_one(void) {
    hexload_app_t app = app_in(HEXLOAD_APP_ARMED);
    for (uint32_t n = 0; n < 99; n++) {
        TEST_ASSERT_EQUAL_UINT8(HEXLOAD_APP_ARMED, give_bad(&app, n).state);
    }
    TEST_ASSERT_EQUAL_UINT8(HEXLOAD_FAULT_SAMPLES_REFUSED, give_bad(&app, 99).fault);
}

static void test_a_known_mass_leaves_a_prior_of_ones_own_alone(void) {
    hexload_config_t config = paper_machine();
    hexload_app_settings_t settings;
    hexload_app_t app;
    hexload_config_set_prior(&config, HEXLOAD_PRIOR_PRINTED);
    hexload_app_settings_default(&settings);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_app_init(&app, &config, &settings));
    TEST_ASSERT_EQUAL_INT(HEXLOAD_RESULT_DONE, command(&app, HEXLOAD_COMMAND_SET_KNOWN_MASS, 320.5f));
    config.paper.load_mass_kg = HEXLOAD_REAL(320.5);
    TEST_ASSERT_EQUAL_MEMORY(&config.paper, &app.config.paper, sizeof config.paper);
}

static void test_an_impossible_mass_or_state_changes_nothing(void) {
    const float wrong[4] = {0.0f, -5.0f, 1.1e6f, 1e30f};
    hexload_app_t app = idle_app();
    const hexload_config_t before = app.config;
    for (int n = 0; n < 4; n++) {
        TEST_ASSERT_EQUAL_INT(HEXLOAD_RESULT_BAD_ARGUMENT,
                              command(&app, HEXLOAD_COMMAND_SET_KNOWN_MASS, wrong[n]));
        TEST_ASSERT_EQUAL_MEMORY(&before, &app.config, sizeof before);
    }
    for (int state = HEXLOAD_APP_ARMED; state <= HEXLOAD_APP_FAULT; state++) {
        app = app_in((hexload_app_state_t)state);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_RESULT_WRONG_STATE,
                              command(&app, HEXLOAD_COMMAND_SET_KNOWN_MASS, 300.0f));
        TEST_ASSERT_TRUE(app.config.paper.load_mass_kg == HEXLOAD_REAL(500.0));
    }
}

static void test_an_unknown_command_is_acknowledged_as_such(void) {
    for (int kind = 0; kind < 256; kind++) {
        if (kind < HEXLOAD_COMMAND_START || kind > HEXLOAD_COMMAND_SET_KNOWN_MASS) {
            hexload_app_t app = idle_app();
            TEST_ASSERT_EQUAL_INT(HEXLOAD_RESULT_UNKNOWN_COMMAND, command(&app, (uint8_t)kind, 0.0f));
        }
    }
}

static void test_a_silent_source_ends_in_fault_after_the_limit_of_the_pacing(void) {
    const uint32_t limit_ms[2] = {100, 10000}; // real time, lockstep
    for (int pacing = 0; pacing < 2; pacing++) {
        hexload_app_t app = idle_app();
        (void)command(&app, HEXLOAD_COMMAND_START, (float)pacing);
        (void)give(&app, 0);
        for (uint32_t ms = 1; ms < limit_ms[pacing]; ms++) {
            hexload_app_elapse(&app, 1);
        }
        TEST_ASSERT_EQUAL_INT(HEXLOAD_APP_ESTIMATING, app.state);
        (void)give(&app, 1); // the silence begins anew
        hexload_app_elapse(&app, limit_ms[pacing] - 1);
        (void)give_bad(&app, 2); // also with a sample that is refused: the source is not silent
        hexload_app_elapse(&app, limit_ms[pacing] - 1);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_APP_ESTIMATING, app.state);
        hexload_app_elapse(&app, 1);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_APP_FAULT, app.state);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_FAULT_SAMPLE_TIMEOUT, app.fault);
    }
}

static void test_a_converged_application_times_out_too_the_others_wait(void) {
    for (int state = HEXLOAD_APP_IDLE; state <= HEXLOAD_APP_CONVERGED; state++) {
        hexload_app_t app = app_in((hexload_app_state_t)state);
        hexload_app_elapse(&app, UINT32_MAX);
        hexload_app_elapse(&app, UINT32_MAX); // the silence saturates
        const bool waits = state == HEXLOAD_APP_IDLE || state == HEXLOAD_APP_ARMED;
        TEST_ASSERT_EQUAL_INT(waits ? (hexload_app_state_t)state : HEXLOAD_APP_FAULT, app.state);
    }
}

static void test_as_many_refused_samples_in_a_row_as_allowed_end_in_fault(void) {
    hexload_app_t app = app_in(HEXLOAD_APP_ARMED);
    (void)give(&app, 0);
    for (uint32_t n = 0; n < 99; n++) {
        TEST_ASSERT_EQUAL_UINT8(HEXLOAD_APP_ESTIMATING, give_bad(&app, 1 + n).state);
    }
    (void)give(&app, 100); // one good sample in between: the row is broken
    for (uint32_t n = 0; n < 99; n++) {
        TEST_ASSERT_EQUAL_UINT8(HEXLOAD_APP_ESTIMATING, give_bad(&app, 101 + n).state);
    }
    const hexload_bus_answer_t last = give_bad(&app, 200);
    TEST_ASSERT_EQUAL_UINT8(HEXLOAD_APP_FAULT, last.state);
    TEST_ASSERT_EQUAL_UINT8(HEXLOAD_FAULT_SAMPLES_REFUSED, last.fault);
    TEST_ASSERT_EQUAL_UINT32(199, last.refused);
}

static void test_as_many_late_samples_in_a_row_are_of_another_source(void) {
    hexload_app_t app = app_in(HEXLOAD_APP_ARMED);
    (void)give(&app, 100);
    for (uint32_t n = 0; n < 99; n++) {
        TEST_ASSERT_EQUAL_UINT8(HEXLOAD_APP_ESTIMATING, give(&app, 100 - n).state);
    }
    const hexload_bus_answer_t last = give(&app, 1);
    TEST_ASSERT_EQUAL_UINT8(HEXLOAD_FAULT_SECOND_SOURCE, last.fault);
    TEST_ASSERT_EQUAL_INT8(HEXLOAD_ERR_TICK, last.status);
}

static void test_without_a_node_samples_have_no_codes_and_a_silent_source_may_go_on_far_ahead(void) {
    // GIVEN an application in memory that was used before WHEN its source goes on far ahead after a silence
    hexload_app_t app = app_in_used_memory();
    (void)command(&app, HEXLOAD_COMMAND_START, HEXLOAD_PACING_REAL_TIME);
    (void)give(&app, 0);
    hexload_app_elapse(&app, app.settings.sample_timeout_ms / 2);
    for (uint32_t n = 1; n <= HEXLOAD_APP_JUMP_SAMPLES; n++) {
        TEST_ASSERT_EQUAL_UINT32(0, app.last_tick);
        (void)give(&app, 5000 + n);
    }
    // THEN it is followed
    TEST_ASSERT_EQUAL_UINT32(5000 + HEXLOAD_APP_JUMP_SAMPLES, app.last_tick);
}

/// What app.h says of samples, silence and faults.
typedef struct expected {
    bool is_idle, is_armed, is_fault, has_codes;
    hexload_app_fault_t fault;
    uint32_t last, jump_tick, jumps, silence_ms, limit_ms, refused, missing;
} expected_t;

enum { LARGEST_STEP = 0x7FFFFFFF, REFUSED_LIMIT = 4 };

static void expect_fault(expected_t* expected, hexload_app_fault_t fault) {
    expected->is_fault = true;
    expected->is_armed = false;
    expected->fault = fault;
}

/// @return whether the estimator takes the sample, or nothing runs.
static bool expect_sample(expected_t* expected, uint32_t tick, bool is_bad) {
    const uint32_t ahead = tick - expected->last;
    const bool is_late = !expected->is_armed && (ahead == 0 || ahead > (uint32_t)LARGEST_STEP);
    if (expected->is_idle || expected->is_fault) {
        return true;
    }
    if (!expected->is_armed && ahead > 1000 && !is_late) {
        const uint32_t step = tick - expected->jump_tick;
        const bool follows = expected->jumps > 0 && step >= 1 && step <= 20;
        expected->jumps = follows ? expected->jumps + 1 : 1;
        expected->jump_tick = tick;
        if (expected->has_codes || expected->silence_ms < expected->limit_ms / 2 || expected->jumps < 20) {
            return false;
        }
    }
    expected->silence_ms = 0;
    if (is_bad || is_late) {
        expected->refused++;
        if (expected->refused == REFUSED_LIMIT) {
            expect_fault(expected, is_late ? HEXLOAD_FAULT_SECOND_SOURCE : HEXLOAD_FAULT_SAMPLES_REFUSED);
        }
        return false;
    }
    expected->missing += expected->is_armed ? 0 : ahead - 1;
    expected->last = tick;
    expected->is_armed = false;
    expected->refused = 0;
    expected->jumps = 0;
    return true;
}

static void expect_silence(expected_t* expected, uint32_t ms) {
    if (expected->is_idle || expected->is_armed || expected->is_fault) {
        return;
    }
    expected->silence_ms += ms;
    if (expected->silence_ms >= expected->limit_ms) {
        expect_fault(expected, HEXLOAD_FAULT_SAMPLE_TIMEOUT);
    }
}

/// To idle from a fault, or else, and on to a start.
static void start_anew(hexload_app_t* app, expected_t* expected, bool is_lockstep) {
    const uint8_t to_idle = expected->is_fault ? HEXLOAD_COMMAND_RESET : HEXLOAD_COMMAND_STOP;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_RESULT_DONE, command(app, to_idle, 0.0f));
    TEST_ASSERT_EQUAL_INT(HEXLOAD_APP_IDLE, app->state);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_RESULT_DONE,
                          command(app, HEXLOAD_COMMAND_START, is_lockstep ? 1.0f : 0.0f));
    *expected = (expected_t){.is_armed = true, .limit_ms = is_lockstep ? 201 : 101};
}

/// Often the next, or the next of a row far ahead, else somewhere near a limit of what is late or far.
static uint32_t some_tick(const expected_t* expected, uint64_t* seed) {
    const int kind = (int)(50.0 + 50.0 * uniform(seed));
    const uint32_t some = (uint32_t)(11.0 + 11.0 * uniform(seed)); // 0 to 21
    if (kind < 97 && expected->jumps > 0) {
        return expected->jump_tick + (some > 0 && kind > 0 ? 1 + some % 3 : 20 + some);
    }
    return expected->last + (kind < 84   ? 1 + some % 3
                             : kind < 90 ? 991 + some
                             : kind < 96 ? 5000 + some
                             : kind < 98 ? (uint32_t)LARGEST_STEP - 10 + some
                                         : 5 - some);
}

static void assert_expected(const expected_t* expected, const hexload_app_t* app) {
    TEST_ASSERT_EQUAL_INT(expected->is_fault, app->state == HEXLOAD_APP_FAULT);
    TEST_ASSERT_EQUAL_INT(expected->is_armed, app->state == HEXLOAD_APP_ARMED);
    TEST_ASSERT_EQUAL_INT(expected->is_idle, app->state == HEXLOAD_APP_IDLE);
    TEST_ASSERT_EQUAL_INT(expected->fault, app->fault);
    TEST_ASSERT_EQUAL_UINT32(expected->last, app->last_tick);
    TEST_ASSERT_EQUAL_UINT32(expected->missing, app->samples_missing);
}

static void test_samples_silence_and_faults_are_those_of_the_header_in_any_order(void) {
    // GIVEN an application with short limits and a platform that stands
    uint64_t seed = 91;
    const hexload_config_t config = paper_machine();
    const hexload_app_settings_t settings = {
        .sample_timeout_ms = 101, .lockstep_timeout_ms = 201, .refused_limit = REFUSED_LIMIT};
    hexload_app_t app;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_app_init(&app, &config, &settings));
    const hexload_leg_sample_t rest = sample_at(&app, 0);
    expected_t expected = {.is_idle = true};
    int faults[8] = {0}, followed = 0, starts = 0;
    for (int n = 0; n < 40000; n++) {
        // WHEN samples, some of them bad, late or far ahead, silence and commands come in any order
        const double dice = uniform(&seed);
        if (expected.is_fault || expected.is_idle || dice > 0.995) {
            faults[expected.fault]++;
            start_anew(&app, &expected, starts % 2 == 1);
            expected.has_codes = app.has_codes = starts % 5 == 4; // as a node sets them
            starts++;
        } else if (dice > 0.85) {
            const uint32_t ms = (uint32_t)(26.0 + 25.0 * uniform(&seed));
            hexload_app_elapse(&app, ms);
            expect_silence(&expected, ms);
        } else {
            hexload_leg_sample_t sample = rest;
            hexload_bus_answer_t answer = {0};
            sample.tick = some_tick(&expected, &seed);
            const bool is_late = sample.tick - expected.last - 1 >= (uint32_t)LARGEST_STEP;
            const bool is_bad = dice > 0.60 && !is_late;
            const bool is_far = expected.jumps > 0;
            sample.force_n[2] = is_bad ? HEXLOAD_REAL(2e8) : sample.force_n[2];
            hexload_app_sample(&app, &sample, &answer);
            const bool is_taken = expect_sample(&expected, sample.tick, is_bad);
            followed += is_taken && is_far && expected.missing >= 1000;
            // THEN state, fault, last tick and missing ticks are as the header says, and the sample is
            // answered
            TEST_ASSERT_EQUAL_INT(is_taken, answer.status == HEXLOAD_OK);
            TEST_ASSERT_EQUAL_UINT32(sample.tick, answer.tick);
            TEST_ASSERT_EQUAL_UINT8(app.state, answer.state);
            TEST_ASSERT_EQUAL_UINT8(expected.fault, answer.fault);
        }
        assert_expected(&expected, &app);
    }
    TEST_ASSERT_GREATER_THAN_INT(10, followed);
    TEST_ASSERT_GREATER_THAN_INT(10, faults[HEXLOAD_FAULT_SAMPLE_TIMEOUT]);
    TEST_ASSERT_GREATER_THAN_INT(10, faults[HEXLOAD_FAULT_SAMPLES_REFUSED]);
    TEST_ASSERT_GREATER_THAN_INT(10, faults[HEXLOAD_FAULT_SECOND_SOURCE]);
}

static void test_missing_ticks_are_counted_and_reported_by_the_health_of_the_sample_after(void) {
    const uint16_t missing = 1u << HEXLOAD_HEALTH_SAMPLE_MISSING;
    hexload_app_t app = app_in(HEXLOAD_APP_ARMED);
    TEST_ASSERT_EQUAL_HEX16(0, give(&app, 40).health & missing); // the first has none before it
    TEST_ASSERT_EQUAL_HEX16(0, give(&app, 41).health & missing);
    TEST_ASSERT_EQUAL_HEX16(missing, give(&app, 45).health & missing);
    TEST_ASSERT_EQUAL_HEX16(0, give(&app, 46).health & missing);
    TEST_ASSERT_EQUAL_UINT32(3, app.samples_missing);
    (void)give_bad(&app, 47); // no whole sample of that tick either
    TEST_ASSERT_EQUAL_HEX16(missing, give(&app, 48).health & missing);
    TEST_ASSERT_EQUAL_UINT32(4, app.samples_missing);
    TEST_ASSERT_EQUAL_UINT32(48, app.last_tick);
}

static void test_the_first_fault_stays_until_reset_and_samples_are_answered_with_it(void) {
    hexload_app_t app = app_in(HEXLOAD_APP_ESTIMATING);
    const hexload_estimate_t last = app.estimate;
    hexload_app_set_fault(&app, HEXLOAD_FAULT_NONE);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_APP_ESTIMATING, app.state);
    hexload_app_set_fault(&app, HEXLOAD_FAULT_WRONG_PROFILE);
    hexload_app_set_fault(&app, HEXLOAD_FAULT_SECOND_CONTROLLER);
    const hexload_bus_answer_t answer = give(&app, 50);
    TEST_ASSERT_EQUAL_UINT32(50, answer.tick);
    TEST_ASSERT_EQUAL_UINT8(HEXLOAD_APP_FAULT, answer.state);
    TEST_ASSERT_EQUAL_UINT8(HEXLOAD_FAULT_WRONG_PROFILE, answer.fault);
    TEST_ASSERT_EQUAL_MEMORY(last.value, answer.estimate.value, sizeof last.value);
    TEST_ASSERT_EQUAL_UINT32(last.tick, app.estimate.tick);
}

static void test_every_state_and_fault_has_a_name_of_its_own(void) {
    for (int n = 0; n <= HEXLOAD_APP_FAULT; n++) {
        for (int m = 0; m < n; m++) {
            TEST_ASSERT_NOT_EQUAL(0, strcmp(hexload_app_state_name((hexload_app_state_t)n),
                                            hexload_app_state_name((hexload_app_state_t)m)));
        }
    }
    for (int n = 0; n <= HEXLOAD_FAULT_NOT_AUTHENTICATED; n++) {
        for (int m = 0; m < n; m++) {
            TEST_ASSERT_NOT_EQUAL(0, strcmp(hexload_app_fault_name((hexload_app_fault_t)n),
                                            hexload_app_fault_name((hexload_app_fault_t)m)));
        }
    }
    TEST_ASSERT_EQUAL_STRING("unknown state", hexload_app_state_name((hexload_app_state_t)99));
    TEST_ASSERT_EQUAL_STRING("unknown fault", hexload_app_fault_name((hexload_app_fault_t)99));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_init_refuses_what_is_out_of_range_and_leaves_the_instance_alone);
    RUN_TEST(test_an_idle_application_answers_samples_and_estimates_nothing);
    RUN_TEST(test_start_first_sample_and_verdict_lead_through_the_states);
    RUN_TEST(test_a_refused_first_sample_leaves_the_application_armed);
    RUN_TEST(test_the_application_estimates_what_the_estimator_alone_does);
    RUN_TEST(test_start_is_for_the_idle_state_and_known_pacings_only);
    RUN_TEST(test_stop_keeps_the_estimate_and_start_begins_afresh);
    RUN_TEST(test_stop_is_refused_in_fault_only);
    RUN_TEST(test_reset_leads_to_idle_from_anywhere_and_forgets);
    RUN_TEST(test_filters_are_selected_in_idle_and_only_those_there_are);
    RUN_TEST(test_another_filter_forgets_the_estimate_and_the_same_one_keeps_it);
    RUN_TEST(test_the_application_estimates_what_the_momentum_estimator_alone_does);
    RUN_TEST(test_the_tick_of_a_changed_load_is_kept);
    RUN_TEST(test_a_known_mass_takes_the_safe_prior_along);
    RUN_TEST(test_reset_restores_the_configured_mass_and_its_prior);
    RUN_TEST(test_a_configuration_has_its_checksum_whatever_the_kind);
    RUN_TEST(test_the_checksum_of_a_configuration_is_that_of_its_bytes_from_the_tick_on);
    RUN_TEST(test_each_run_begins_with_counters_of_zero);
    RUN_TEST(test_as_many_refused_samples_as_allowed_end_in_fault_also_without_a_first_good_one);
    RUN_TEST(test_a_known_mass_leaves_a_prior_of_ones_own_alone);
    RUN_TEST(test_an_impossible_mass_or_state_changes_nothing);
    RUN_TEST(test_an_unknown_command_is_acknowledged_as_such);
    RUN_TEST(test_a_silent_source_ends_in_fault_after_the_limit_of_the_pacing);
    RUN_TEST(test_a_converged_application_times_out_too_the_others_wait);
    RUN_TEST(test_as_many_refused_samples_in_a_row_as_allowed_end_in_fault);
    RUN_TEST(test_as_many_late_samples_in_a_row_are_of_another_source);
    RUN_TEST(test_without_a_node_samples_have_no_codes_and_a_silent_source_may_go_on_far_ahead);
    RUN_TEST(test_samples_silence_and_faults_are_those_of_the_header_in_any_order);
    RUN_TEST(test_missing_ticks_are_counted_and_reported_by_the_health_of_the_sample_after);
    RUN_TEST(test_the_first_fault_stays_until_reset_and_samples_are_answered_with_it);
    RUN_TEST(test_every_state_and_fault_has_a_name_of_its_own);
    return UNITY_END();
}
