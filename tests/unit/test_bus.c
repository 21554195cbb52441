#include "frames.h"

#include "bus/crc.h"
#include "bus/sample_assembly.h"

#include <string.h>

void setUp(void) {}
void tearDown(void) {}

/// Steps and ranges that the contract promises.
typedef struct promise {
    hexload_bus_profile_t profile;
    double step[3]; ///< displacement m, velocity m/s, force N
    int32_t largest[3];
} promise_t;

static const promise_t promises[2] = {
    {HEXLOAD_BUS_FD, {0.5e-6, 2e-6, 0.125}, {8388607, 8388607, 8388607}},
    {HEXLOAD_BUS_CLASSIC, {4e-6, 300e-6, 1.0}, {262143, 16383, 131071}},
};

static hexload_real_t* channel(hexload_leg_sample_t* sample, int quantity) {
    return quantity == 0 ? sample->displacement_m : quantity == 1 ? sample->velocity_m_s : sample->force_n;
}

/// Over the bus and back. The tick is a multiple of HEXLOAD_BUS_TICK_PERIOD.
static hexload_leg_sample_t carry(hexload_bus_profile_t profile, const hexload_leg_sample_t* sample,
                                  uint32_t* saturated) {
    hexload_bus_frame_t frames[HEXLOAD_BUS_SAMPLE_FRAMES];
    hexload_sample_assembly_t assembly;
    hexload_leg_sample_t found = {0};
    hexload_bus_status_t status = HEXLOAD_BUS_PARTIAL;
    const int count = hexload_bus_encode_sample(profile, sample, frames, saturated);
    hexload_sample_assembly_init(&assembly, profile);
    for (int n = 0; n < count; n++) {
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_PARTIAL, status);
        status = hexload_sample_assembly_add(&assembly, &frames[n], &found);
    }
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, status);
    TEST_ASSERT_EQUAL_UINT32(sample->tick, found.tick);
    return found;
}

/// Half a step; the step as float32 is off by 3e-8, quotient, product and the value itself round once each.
static double largest_error(const promise_t* promise, int quantity, double value) {
    return 0.5 * promise->step[quantity] + 4 * 1.1920929e-7 * fabs(value);
}

static void test_checksums_have_the_check_values_of_the_catalogue(void) {
    const uint8_t digits[9] = {'1', '2', '3', '4', '5', '6', '7', '8', '9'};
    TEST_ASSERT_EQUAL_HEX8(0xDF, hexload_crc8(0, digits, sizeof digits));
    TEST_ASSERT_EQUAL_HEX32(0x1697D06A, hexload_crc32(0, digits, sizeof digits));
    // and go on from those of the bytes before
    TEST_ASSERT_EQUAL_HEX8(0xDF, hexload_crc8(hexload_crc8(0, digits, 4), &digits[4], 5));
    TEST_ASSERT_EQUAL_HEX32(0x1697D06A, hexload_crc32(hexload_crc32(0, digits, 4), &digits[4], 5));
}

static void test_checksums_by_tables_are_those_by_bits(void) {
    // GIVEN frames of all lengths at all alignments, with each byte value at each place of four
    uint8_t bytes[1024 + 67];
    for (size_t n = 0; n < sizeof bytes; n++) {
        bytes[n] = (uint8_t)(37 * n + n / 256); // 37 and 256 have no common divisor
    }
    for (size_t first = 0; first < 1024; first++) {
        // WHEN their checksums are computed THEN the tables have left out or mistaken no entry
        const size_t count = first % 68;
        TEST_ASSERT_EQUAL_HEX32(crc32p4(&bytes[first], count), hexload_crc32(0, &bytes[first], count));
        TEST_ASSERT_EQUAL_HEX8(crc8h2f(&bytes[first], count), hexload_crc8(0, &bytes[first], count));
    }
}

static void test_a_sample_comes_back_within_half_a_step(void) {
    for (int p = 0; p < 2; p++) {
        const promise_t* promise = &promises[p];
        uint64_t seed = 1;
        for (int n = 0; n < 20000; n++) {
            // GIVEN random values over the whole range, and both ends of it
            hexload_leg_sample_t sample = {.tick = (uint32_t)n * HEXLOAD_BUS_TICK_PERIOD};
            for (int k = 0; k < 3 * HEXLOAD_LEGS; k++) {
                const double part = n == 0 ? 1.0 : n == 1 ? -1.0 : uniform(&seed);
                channel(&sample, k / HEXLOAD_LEGS)[k % HEXLOAD_LEGS] =
                    (hexload_real_t)(part * promise->largest[k / HEXLOAD_LEGS] *
                                     promise->step[k / HEXLOAD_LEGS]);
            }
            // WHEN they go over the bus
            uint32_t saturated = 0;
            hexload_leg_sample_t found = carry(promise->profile, &sample, &saturated);
            // THEN none is farther off than half a step
            TEST_ASSERT_EQUAL_UINT32(0, saturated);
            for (int k = 0; k < 3 * HEXLOAD_LEGS; k++) {
                const int quantity = k / HEXLOAD_LEGS;
                const double sent = (double)channel(&sample, quantity)[k % HEXLOAD_LEGS];
                const double got = (double)channel(&found, quantity)[k % HEXLOAD_LEGS];
                TEST_ASSERT_DOUBLE_WITHIN(largest_error(promise, quantity, sent), sent, got);
            }
        }
    }
}

static void test_rounding_is_to_the_nearest_step_on_both_sides_of_zero(void) {
    for (int p = 0; p < 2; p++) {
        for (int quantity = 0; quantity < 3; quantity++) {
            const double step = promises[p].step[quantity];
            const double sent[4] = {10.49, 10.51, -10.49, -10.51}, nearest[4] = {10, 11, -10, -11};
            hexload_leg_sample_t sample = {0};
            uint32_t saturated = 0;
            for (int leg = 0; leg < 4; leg++) {
                channel(&sample, quantity)[leg] = (hexload_real_t)(sent[leg] * step);
            }
            hexload_leg_sample_t found = carry(promises[p].profile, &sample, &saturated);
            for (int leg = 0; leg < 4; leg++) {
                TEST_ASSERT_DOUBLE_WITHIN(1e-3 * step, nearest[leg] * step,
                                          (double)channel(&found, quantity)[leg]);
            }
        }
    }
}

static void test_a_channel_beyond_the_range_arrives_as_its_end_and_is_counted(void) {
    const double beyond[] = {1.001, 2.0, 1e6, 1e30};
    for (int p = 0; p < 2; p++) {
        for (int k = 0; k < 3 * HEXLOAD_LEGS; k++) {
            const int quantity = k / HEXLOAD_LEGS, leg = k % HEXLOAD_LEGS;
            const double end = promises[p].largest[quantity] * promises[p].step[quantity];
            for (int n = 0; n < 8; n++) {
                const double sign = n < 4 ? 1.0 : -1.0;
                hexload_leg_sample_t sample = {0};
                uint32_t saturated = 5;
                channel(&sample, quantity)[leg] = (hexload_real_t)(sign * beyond[n % 4] * end);
                hexload_leg_sample_t found = carry(promises[p].profile, &sample, &saturated);
                TEST_ASSERT_EQUAL_UINT32(6, saturated);
                TEST_ASSERT_DOUBLE_WITHIN(4 * 1.1920929e-7 * end, sign * end,
                                          (double)channel(&found, quantity)[leg]);
            }
        }
    }
}

static void test_half_a_step_beyond_the_range_is_cut_and_counted_too(void) {
    // GIVEN a force that lies half a step beyond an end, which floats have without rounding WHEN it is sent
    for (int p = 0; p < 2; p++) {
        const double end_n = promises[p].largest[2] * promises[p].step[2];
        for (int sign = -1; sign <= 1; sign += 2) {
            hexload_leg_sample_t sample = {0};
            uint32_t saturated = 0;
            sample.force_n[4] = (hexload_real_t)(sign * (end_n + 0.5 * promises[p].step[2]));
            const hexload_leg_sample_t found = carry(promises[p].profile, &sample, &saturated);
            // THEN the end arrives
            TEST_ASSERT_EQUAL_UINT32(1, saturated);
            TEST_ASSERT_EQUAL_DOUBLE(sign * end_n, (double)found.force_n[4]);
        }
    }
}

static void test_a_channel_that_is_infinite_is_not_sent(void) {
    const hexload_real_t wrong[2] = {(hexload_real_t)INFINITY, -(hexload_real_t)INFINITY};
    for (int p = 0; p < 2; p++) {
        for (int k = 0; k < 2 * 3 * HEXLOAD_LEGS; k++) {
            hexload_leg_sample_t sample = {0};
            hexload_bus_frame_t frames[HEXLOAD_BUS_SAMPLE_FRAMES];
            uint32_t saturated = 0;
            channel(&sample, k / 2 % 3)[k / 6] = wrong[k % 2];
            TEST_ASSERT_EQUAL_INT(
                HEXLOAD_BUS_ERR_VALUE,
                hexload_bus_encode_sample(promises[p].profile, &sample, frames, &saturated));
            TEST_ASSERT_EQUAL_UINT32(0, saturated);
        }
    }
}

static void test_frames_have_identifier_format_and_length_of_the_contract(void) {
    const hexload_leg_sample_t sample = numbered_sample(32);
    hexload_bus_frame_t frames[HEXLOAD_BUS_SAMPLE_FRAMES];
    // FD
    TEST_ASSERT_EQUAL_INT(1, encode_sample(HEXLOAD_BUS_FD, &sample, frames));
    TEST_ASSERT_EQUAL_HEX32(ID_LEG_SAMPLE_FD, frames[0].id);
    TEST_ASSERT_EQUAL_UINT8(64, frames[0].length);
    TEST_ASSERT_TRUE(frames[0].is_fd);
    static const uint32_t ids[2][3] = {{ID_ESTIMATE_FD, ID_SIGMA_FD, ID_HEALTH_FD},
                                       {ID_LOAD_FD, ID_LOAD_SIGMA_FD, ID_HEALTH_FD}};
    for (uint8_t filter = HEXLOAD_FILTER_PAPER; filter <= HEXLOAD_FILTER_MOMENTUM; filter++) {
        const hexload_bus_answer_t answer = numbered_answer(filter, 16);
        TEST_ASSERT_EQUAL_INT(3, encode_answer(HEXLOAD_BUS_FD, &answer, 0, frames));
        for (int n = 0; n < 3; n++) {
            TEST_ASSERT_EQUAL_HEX32(ids[filter][n], frames[n].id);
            TEST_ASSERT_EQUAL_UINT8(filter == HEXLOAD_FILTER_MOMENTUM && n < 2 ? 64 : 32, frames[n].length);
            TEST_ASSERT_TRUE(frames[n].is_fd);
        }
    }
    // Classic: the whole tick first, then the legs
    TEST_ASSERT_EQUAL_INT(7, encode_sample(HEXLOAD_BUS_CLASSIC, &sample, frames));
    TEST_ASSERT_EQUAL_HEX32(ID_SAMPLE_TICK, frames[0].id);
    TEST_ASSERT_EQUAL_UINT8(6, frames[0].length);
    for (uint32_t leg = 0; leg < HEXLOAD_LEGS; leg++) {
        TEST_ASSERT_EQUAL_HEX32(ID_LEG_SAMPLE_1 + leg, frames[1 + leg].id);
        TEST_ASSERT_EQUAL_UINT8(8, frames[1 + leg].length);
        TEST_ASSERT_FALSE(frames[1 + leg].is_fd);
    }
    // and the pages of an answer, by their codes
    static const uint8_t codes[2][26] = {{0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12},
                                         {0,  13, 14, 15, 16, 17, 18, 19, 20, 21, 22, 23, 24,
                                          25, 26, 27, 28, 29, 30, 31, 32, 9,  10, 11, 12, 33}};
    for (uint8_t filter = HEXLOAD_FILTER_PAPER; filter <= HEXLOAD_FILTER_MOMENTUM; filter++) {
        const hexload_bus_answer_t answer = numbered_answer(filter, 32);
        TEST_ASSERT_EQUAL_INT(filter == HEXLOAD_FILTER_MOMENTUM ? 26 : 13, hexload_bus_answer_pages(filter));
        for (int page = 0; page < hexload_bus_answer_pages(filter); page++) {
            TEST_ASSERT_EQUAL_INT(1, encode_answer(HEXLOAD_BUS_CLASSIC, &answer, page, frames));
            TEST_ASSERT_EQUAL_HEX32(ID_ANSWER_PAGE, frames[0].id);
            TEST_ASSERT_EQUAL_UINT8(8, frames[0].length);
            TEST_ASSERT_FALSE(frames[0].is_fd);
            TEST_ASSERT_EQUAL_UINT8(codes[filter][page], frames[0].data[3] >> 2);
            TEST_ASSERT_EQUAL_UINT8(0, frames[0].data[1] & 0x0F); // tick 32: sixteen pages after tick 0
        }
    }
}

static void test_counters_go_up_by_one_from_page_to_page_and_from_whole_tick_to_whole_tick(void) {
    for (uint32_t n = 0; n < 40; n++) {
        const hexload_bus_answer_t answer = numbered_answer(HEXLOAD_FILTER_PAPER, 2 * n);
        const hexload_leg_sample_t sample = numbered_sample(16 * n);
        hexload_bus_frame_t frames[HEXLOAD_BUS_SAMPLE_FRAMES];
        (void)encode_answer(HEXLOAD_BUS_CLASSIC, &answer, (int)(n % 13), frames);
        TEST_ASSERT_EQUAL_UINT8(n % 16, frames[0].data[1] & 0x0F);
        (void)encode_sample(HEXLOAD_BUS_CLASSIC, &sample, frames);
        TEST_ASSERT_EQUAL_UINT8(n % 16, frames[0].data[1] & 0x0F);
    }
}

static void test_the_whole_tick_is_sent_at_multiples_of_sixteen_only(void) {
    for (uint32_t tick = 0; tick < 64; tick++) {
        const hexload_leg_sample_t sample = numbered_sample(tick);
        hexload_bus_frame_t frames[HEXLOAD_BUS_SAMPLE_FRAMES];
        TEST_ASSERT_EQUAL_INT(tick % 16 == 0 ? 7 : 6, encode_sample(HEXLOAD_BUS_CLASSIC, &sample, frames));
    }
}

static void test_a_velocity_without_sensor_arrives_as_no_number(void) {
    for (int p = 0; p < 2; p++) {
        // GIVEN a sample of legs of which only the third has a velocity sensor WHEN it is sent
        hexload_leg_sample_t sample = {.tick = 16};
        uint32_t saturated = 0;
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            sample.velocity_m_s[leg] = leg == 2 ? HEXLOAD_REAL(0.5) : (hexload_real_t)NAN;
        }
        const hexload_leg_sample_t found = carry(promises[p].profile, &sample, &saturated);
        // THEN the others' velocities are no numbers, and all else is as it was
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            TEST_ASSERT_EQUAL(leg != 2, isnan(found.velocity_m_s[leg]));
            TEST_ASSERT_TRUE(found.displacement_m[leg] == HEXLOAD_REAL(0.0));
        }
        TEST_ASSERT_DOUBLE_WITHIN(3e-4, 0.5, (double)found.velocity_m_s[2]);
    }
}

static void test_a_lost_channel_arrives_as_lost_and_all_others_as_they_were(void) {
    for (int p = 0; p < 2; p++) {
        for (int lost = 0; lost < 3 * HEXLOAD_LEGS; lost++) {
            // GIVEN a sample of which one channel has no sensor, or one that has failed WHEN it is sent
            const hexload_leg_sample_t whole = numbered_sample(16);
            hexload_leg_sample_t sample = whole;
            uint32_t saturated = 0;
            channel(&sample, lost % 3)[lost / 3] = (hexload_real_t)NAN;
            hexload_leg_sample_t found = carry(promises[p].profile, &sample, &saturated);
            hexload_leg_sample_t of_whole = carry(promises[p].profile, &whole, &saturated);
            // THEN that one is no number, and each other one is what it is without the loss
            TEST_ASSERT_EQUAL_UINT32(0, saturated);
            for (int k = 0; k < 3 * HEXLOAD_LEGS; k++) {
                const hexload_real_t value = channel(&found, k % 3)[k / 3];
                TEST_ASSERT_EQUAL(k == lost, isnan(value) != 0);
                TEST_ASSERT_TRUE(k == lost || value == channel(&of_whole, k % 3)[k / 3]);
            }
        }
    }
}

static void test_an_answer_that_is_not_finite_is_not_sent(void) {
    for (uint8_t filter = HEXLOAD_FILTER_PAPER; filter <= HEXLOAD_FILTER_MOMENTUM; filter++) {
        const int parameters = parameters_of(filter);
        for (int n = 0; n < 2 * parameters + 2; n++) {
            hexload_bus_answer_t answer = numbered_answer(filter, 1);
            hexload_bus_frame_t frames[HEXLOAD_BUS_ANSWER_FRAMES];
            hexload_estimate_t* estimate = &answer.estimate;
            hexload_real_t* const wrong = n < parameters       ? &estimate->value[n]
                                          : n < 2 * parameters ? &estimate->sigma[n - parameters]
                                          : n % 2 == 0         ? &estimate->nis
                                                               : &estimate->nis_mean;
            *wrong = (hexload_real_t)NAN;
            TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_VALUE,
                                  hexload_bus_encode_answer(HEXLOAD_BUS_FD, &answer, 0, frames));
            TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_VALUE,
                                  hexload_bus_encode_answer(HEXLOAD_BUS_CLASSIC, &answer, 0, frames));
        }
    }
}

static hexload_bus_frame_t command_frame(uint8_t kind, float argument) {
    const hexload_bus_command_t command = {.kind = kind,
                                           .source = HEXLOAD_SOURCE_OPERATOR,
                                           .session = 4095,
                                           .sequence = 17,
                                           .argument = argument,
                                           .configuration = 0x12345678};
    hexload_bus_frame_t frame;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, hexload_bus_encode_command(&command, &frame));
    return frame;
}

static void test_a_command_comes_back_also_an_unknown_one(void) {
    const float argument[16] = {0, 1, 0, 0, 2, -3.25f}; // by kind
    for (int kind = 0; kind < 16; kind++) {
        const hexload_bus_frame_t frame = command_frame((uint8_t)kind, argument[kind]);
        hexload_bus_command_t found = {0};
        TEST_ASSERT_EQUAL_HEX32(ID_COMMAND, frame.id);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, hexload_bus_decode_command(&frame, &found));
        TEST_ASSERT_EQUAL_UINT8(kind, found.kind);
        TEST_ASSERT_EQUAL_UINT8(HEXLOAD_SOURCE_OPERATOR, found.source);
        TEST_ASSERT_EQUAL_UINT16(4095, found.session);
        TEST_ASSERT_EQUAL_UINT8(17 % 16, found.sequence);
        TEST_ASSERT_TRUE(found.argument == argument[kind]);
        TEST_ASSERT_EQUAL_HEX32(kind == HEXLOAD_COMMAND_START ? 0x345678 : 0, found.configuration);
    }
}

static void test_a_command_argument_that_the_contract_has_not_is_refused(void) {
    const hexload_bus_command_t command = {.kind = HEXLOAD_COMMAND_SET_KNOWN_MASS, .argument = NAN};
    hexload_bus_frame_t frame;
    hexload_bus_command_t found = {.kind = 99};
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_VALUE, hexload_bus_encode_command(&command, &frame));
    const hexload_bus_command_t codes[3] = {{.kind = HEXLOAD_COMMAND_START, .argument = 0.5f},
                                            {.kind = HEXLOAD_COMMAND_SELECT_FILTER, .argument = -1.0f},
                                            {.kind = HEXLOAD_COMMAND_SELECT_FILTER, .argument = 256.0f}};
    for (int n = 0; n < 3; n++) {
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_VALUE, hexload_bus_encode_command(&codes[n], &frame));
    }
    const float wrong[] = {-INFINITY, 1.000001e6f, -1.000001e6f}; // the DBC's range is +-1e6
    for (int n = 0; n < 3; n++) {
        frame = command_frame(HEXLOAD_COMMAND_SET_KNOWN_MASS, 500.0f);
        memcpy(&frame.data[4], &wrong[n], sizeof wrong[n]);
        seal(&frame);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_VALUE, hexload_bus_decode_command(&frame, &found));
        TEST_ASSERT_EQUAL_UINT8(99, found.kind);
    }
}

static void test_the_largest_code_of_a_byte_is_an_argument_too(void) {
    const uint8_t kinds[2] = {HEXLOAD_COMMAND_START, HEXLOAD_COMMAND_SELECT_FILTER};
    for (int n = 0; n < 2; n++) {
        const hexload_bus_frame_t frame = command_frame(kinds[n], 255.0f);
        hexload_bus_command_t found = {0};
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, hexload_bus_decode_command(&frame, &found));
        TEST_ASSERT_TRUE(found.argument == 255.0f);
    }
}

static void test_the_checksum_of_a_known_mass_is_that_of_its_four_bytes_and_of_none_zero(void) {
    // GIVEN masses as IEEE 754 has them WHEN their checksums are computed THEN they are those of the bytes,
    // the lowest first
    const struct {
        float mass_kg;
        uint8_t bytes[4];
    } known[3] = {{0.5f, {0x00, 0x00, 0x00, 0x3F}},
                  {1.0f, {0x00, 0x00, 0x80, 0x3F}},
                  {400.5f, {0x00, 0x40, 0xC8, 0x43}}};
    for (int n = 0; n < 3; n++) {
        TEST_ASSERT_EQUAL_HEX8(crc8h2f(known[n].bytes, 4), hexload_bus_known_mass_crc(known[n].mass_kg));
    }
    // AND of what is no mass 0
    const float none[3] = {0.0f, -400.5f, NAN};
    for (int n = 0; n < 3; n++) {
        TEST_ASSERT_EQUAL_HEX8(0, hexload_bus_known_mass_crc(none[n]));
    }
}

static const hexload_bus_acknowledge_t some_acknowledge = {.kind = 14,
                                                           .source = 3,
                                                           .session = 4000,
                                                           .sequence = 3,
                                                           .counter = 9,
                                                           .result = 4,
                                                           .state = 4,
                                                           .fault = 5,
                                                           .profile = 1,
                                                           .known_mass_crc = 77};

static void test_an_acknowledge_comes_back(void) {
    hexload_bus_frame_t frame;
    hexload_bus_acknowledge_t found = {0};
    hexload_bus_encode_acknowledge(&some_acknowledge, &frame);
    TEST_ASSERT_EQUAL_HEX32(ID_ACKNOWLEDGE, frame.id);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, hexload_bus_decode_acknowledge(&frame, &found));
    TEST_ASSERT_EQUAL_MEMORY(&some_acknowledge, &found, sizeof found);
}

static void test_an_acknowledge_with_an_unknown_code_is_refused(void) {
    const hexload_bus_acknowledge_t unknown[4] = {
        {.result = 7}, {.state = 5, .kind = 1}, {.fault = 8}, {.profile = 2}};
    for (int n = 0; n < 4; n++) {
        hexload_bus_frame_t frame;
        hexload_bus_acknowledge_t found = some_acknowledge;
        hexload_bus_encode_acknowledge(&unknown[n], &frame);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_VALUE, hexload_bus_decode_acknowledge(&frame, &found));
        TEST_ASSERT_EQUAL_MEMORY(&some_acknowledge, &found, sizeof found);
    }
}

static const hexload_bus_controller_status_t some_status = {
    .version = {1, 2, 3},
    .counter = 11,
    .profile = 1,
    .state = 4,
    .fault = 5,
    .tick = 0xFFFFFFF0u,
    .overruns = 7,
    .stack_margin_bytes = 8000,
    .time_margin_us = -250,
    .samples_missing = 9,
    .frames_refused = 0xFFFFFFFFu,
    .samples_refused = 11,
    .load_changes = 65535,
    .input = {HEXLOAD_INPUT_FORCE_DEAD, 5, HEXLOAD_REAL(-490.5)},
    .known_mass_kg = 430.5f,
    .configuration = 0xCBF43926u,
};

static void assert_same_status(const hexload_bus_controller_status_t* expected,
                               const hexload_bus_controller_status_t* found) {
    TEST_ASSERT_EQUAL_UINT8_ARRAY(expected->version, found->version, 3);
    TEST_ASSERT_EQUAL_UINT8(expected->counter, found->counter);
    TEST_ASSERT_EQUAL_UINT8(expected->profile, found->profile);
    TEST_ASSERT_EQUAL_UINT8(expected->state, found->state);
    TEST_ASSERT_EQUAL_UINT8(expected->fault, found->fault);
    TEST_ASSERT_EQUAL_UINT32(expected->tick, found->tick);
    TEST_ASSERT_EQUAL_UINT32(expected->overruns, found->overruns);
    TEST_ASSERT_EQUAL_UINT32(expected->stack_margin_bytes, found->stack_margin_bytes);
    TEST_ASSERT_EQUAL_INT32(expected->time_margin_us, found->time_margin_us);
    TEST_ASSERT_EQUAL_UINT32(expected->samples_missing, found->samples_missing);
    TEST_ASSERT_EQUAL_UINT32(expected->frames_refused, found->frames_refused);
    TEST_ASSERT_EQUAL_UINT32(expected->samples_refused, found->samples_refused);
    TEST_ASSERT_EQUAL_UINT16(expected->load_changes, found->load_changes);
    TEST_ASSERT_EQUAL_INT(expected->input.cause, found->input.cause);
    TEST_ASSERT_EQUAL_UINT32(expected->input.leg, found->input.leg);
    TEST_ASSERT_TRUE(expected->input.excess_n == found->input.excess_n);
    TEST_ASSERT_TRUE(expected->known_mass_kg == found->known_mass_kg);
    TEST_ASSERT_EQUAL_HEX32(expected->configuration, found->configuration);
}

static void test_status_pages_put_together_are_the_status(void) {
    hexload_bus_controller_status_t found = {0};
    for (int page = 0; page < HEXLOAD_BUS_STATUS_PAGES; page++) {
        hexload_bus_frame_t frame;
        hexload_bus_encode_status(&some_status, page, &frame);
        TEST_ASSERT_EQUAL_HEX32(ID_CONTROLLER_STATUS, frame.id);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, hexload_bus_decode_status(&frame, &found));
        // state and fault are in every page
        TEST_ASSERT_EQUAL_UINT8(4, found.state);
        TEST_ASSERT_EQUAL_UINT8(5, found.fault);
    }
    assert_same_status(&some_status, &found);
}

static void test_a_status_page_changes_its_own_fields_only(void) {
    const hexload_bus_controller_status_t zero = {0};
    for (int page = 0; page < HEXLOAD_BUS_STATUS_PAGES; page++) {
        hexload_bus_frame_t frame;
        hexload_bus_controller_status_t found = some_status;
        hexload_bus_encode_status(&zero, page, &frame);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, hexload_bus_decode_status(&frame, &found));
        // THEN the other pages of what was found, put over zero, and this one of some_status are all of it
        hexload_bus_controller_status_t rest = {0};
        for (int other = 0; other < HEXLOAD_BUS_STATUS_PAGES; other++) {
            hexload_bus_encode_status(other == page ? &some_status : &found, other, &frame);
            TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, hexload_bus_decode_status(&frame, &rest));
        }
        rest.counter = some_status.counter; // with state and fault in each page
        rest.state = some_status.state;
        rest.fault = some_status.fault;
        assert_same_status(&some_status, &rest);
    }
}

static void test_a_status_with_an_unknown_code_or_a_number_out_of_range_is_refused(void) {
    const hexload_bus_controller_status_t wrong[5] = {{.state = 5},
                                                      {.fault = 8},
                                                      {.profile = 2},
                                                      {.known_mass_kg = -1.0f},
                                                      {.input.excess_n = (hexload_real_t)INFINITY}};
    const int pages[6] = {0, 0, 0, 9, 11, HEXLOAD_BUS_STATUS_PAGES};
    for (int n = 0; n < 6; n++) {
        hexload_bus_frame_t frame;
        hexload_bus_controller_status_t found = some_status;
        hexload_bus_encode_status(n < 5 ? &wrong[n] : &some_status, pages[n], &frame);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_VALUE, hexload_bus_decode_status(&frame, &found));
        assert_same_status(&some_status, &found);
    }
}

static const hexload_bus_load_change_t some_change = {.tick = 0xFFFFFFF1u, .load_changes = 65531};

static void test_a_load_change_comes_back(void) {
    hexload_bus_frame_t frame;
    hexload_bus_load_change_t found = {0};
    hexload_bus_encode_load_change(&some_change, &frame);
    TEST_ASSERT_EQUAL_HEX32(ID_LOAD_CHANGE, frame.id);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, hexload_bus_decode_load_change(&frame, &found));
    TEST_ASSERT_EQUAL_UINT32(some_change.tick, found.tick);
    TEST_ASSERT_EQUAL_UINT16(some_change.load_changes, found.load_changes);
}

/// Decodes as what the identifier says it is.
static hexload_bus_status_t decode(const hexload_bus_frame_t* frame) {
    hexload_bus_command_t command;
    hexload_bus_acknowledge_t acknowledge;
    hexload_bus_load_change_t change;
    hexload_bus_controller_status_t status;
    switch (frame->id) {
    case ID_COMMAND:
        return hexload_bus_decode_command(frame, &command);
    case ID_ACKNOWLEDGE:
        return hexload_bus_decode_acknowledge(frame, &acknowledge);
    case ID_LOAD_CHANGE:
        return hexload_bus_decode_load_change(frame, &change);
    default:
        return hexload_bus_decode_status(frame, &status);
    }
}

static void test_a_load_change_with_another_counter_than_its_count_is_refused(void) {
    hexload_bus_frame_t frame;
    hexload_bus_load_change_t found = {0};
    hexload_bus_encode_load_change(&some_change, &frame);
    frame.data[1] ^= 1;
    seal(&frame);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_VALUE, hexload_bus_decode_load_change(&frame, &found));
}

enum { SLOW_FRAMES = 4 };

static void sealed_frames(hexload_bus_frame_t frames[SLOW_FRAMES]) {
    frames[0] = command_frame(HEXLOAD_COMMAND_START, 1.0f);
    hexload_bus_encode_acknowledge(&some_acknowledge, &frames[1]);
    hexload_bus_encode_status(&some_status, 4, &frames[2]);
    hexload_bus_encode_load_change(&some_change, &frames[3]);
}

static void test_each_flipped_bit_is_detected(void) {
    hexload_bus_frame_t frames[SLOW_FRAMES];
    sealed_frames(frames);
    for (int n = 0; n < SLOW_FRAMES; n++) {
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, decode(&frames[n]));
        for (int bit = 0; bit < 64; bit++) {
            frames[n].data[bit / 8] ^= (uint8_t)(1u << (bit % 8));
            TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_CRC, decode(&frames[n]));
            frames[n].data[bit / 8] ^= (uint8_t)(1u << (bit % 8));
        }
    }
}

static void test_a_frame_under_another_ones_identifier_has_a_wrong_checksum(void) {
    // GIVEN a frame of each kind, whole WHEN it comes under the identifier of another of its length
    hexload_bus_frame_t frames[SLOW_FRAMES + 2 * HEXLOAD_BUS_ANSWER_FRAMES + HEXLOAD_LEGS];
    const hexload_bus_answer_t answer = numbered_answer(HEXLOAD_FILTER_PAPER, 16);
    const hexload_bus_answer_t load = numbered_answer(HEXLOAD_FILTER_MOMENTUM, 16);
    const hexload_leg_sample_t sample = numbered_sample(17);
    sealed_frames(frames);
    int count = SLOW_FRAMES;
    count += encode_answer(HEXLOAD_BUS_FD, &answer, 0, &frames[count]);
    count += encode_answer(HEXLOAD_BUS_FD, &load, 0, &frames[count]);
    count += encode_sample(HEXLOAD_BUS_CLASSIC, &sample, &frames[count]);
    for (int n = 0; n < count; n++) {
        for (int other = 0; other < count; other++) {
            if (frames[other].length != frames[n].length) {
                continue;
            }
            hexload_bus_frame_t frame = frames[n];
            frame.id = frames[other].id;
            seal(&frame);
            const bool is_same = memcmp(frame.data, frames[n].data, frame.length) == 0;
            // THEN its checksum is not that one's: the Data ID is counted in
            TEST_ASSERT_EQUAL(frame.id == frames[n].id, is_same);
        }
    }
}

static void test_another_length_or_format_is_refused(void) {
    hexload_bus_frame_t frames[SLOW_FRAMES];
    sealed_frames(frames);
    for (int n = 0; n < SLOW_FRAMES; n++) {
        for (int length = 0; length <= HEXLOAD_BUS_FRAME_BYTES; length++) {
            hexload_bus_frame_t frame = frames[n];
            frame.length = (uint8_t)length;
            TEST_ASSERT_EQUAL_INT(length == 8 ? HEXLOAD_BUS_OK : HEXLOAD_BUS_ERR_LENGTH, decode(&frame));
        }
        frames[n].is_fd = true;
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_LENGTH, decode(&frames[n]));
    }
}

static void test_decoders_pass_over_every_other_identifier(void) {
    hexload_bus_frame_t frame = command_frame(HEXLOAD_COMMAND_START, 0.0f);
    hexload_bus_command_t command;
    hexload_bus_acknowledge_t acknowledge;
    hexload_bus_controller_status_t status;
    hexload_bus_load_change_t change;
    for (frame.id = 0; frame.id < 0x800; frame.id++) {
        TEST_ASSERT_EQUAL_INT(frame.id != ID_COMMAND,
                              hexload_bus_decode_command(&frame, &command) == HEXLOAD_BUS_OTHER);
        TEST_ASSERT_EQUAL_INT(frame.id != ID_ACKNOWLEDGE,
                              hexload_bus_decode_acknowledge(&frame, &acknowledge) == HEXLOAD_BUS_OTHER);
        TEST_ASSERT_EQUAL_INT(frame.id != ID_CONTROLLER_STATUS,
                              hexload_bus_decode_status(&frame, &status) == HEXLOAD_BUS_OTHER);
        TEST_ASSERT_EQUAL_INT(frame.id != ID_LOAD_CHANGE,
                              hexload_bus_decode_load_change(&frame, &change) == HEXLOAD_BUS_OTHER);
    }
}

static void test_only_a_controllers_identifiers_are_a_controllers(void) {
    hexload_bus_frame_t frame = {0};
    for (frame.id = 0; frame.id < 0x800; frame.id++) {
        const bool is_expected =
            (frame.id >= 0x100 && frame.id <= 0x106) || frame.id == 0x110 || frame.id == 0x120;
        TEST_ASSERT_EQUAL_INT(is_expected, hexload_bus_is_from_controller(&frame));
    }
}

static void test_every_code_has_a_name_of_its_own(void) {
    const char* const fallback[4] = {hexload_bus_status_name((hexload_bus_status_t)99),
                                     hexload_bus_result_name((hexload_bus_result_t)99),
                                     hexload_bus_profile_name((hexload_bus_profile_t)99),
                                     hexload_bus_filter_name((hexload_bus_filter_t)99)};
    const char* names[4][10] = {{0}};
    for (int n = 0; n < 10; n++) {
        names[0][n] = hexload_bus_status_name((hexload_bus_status_t)(n - 7));
        names[1][n] = n < 7 ? hexload_bus_result_name((hexload_bus_result_t)n) : NULL;
        names[2][n] = n < 2 ? hexload_bus_profile_name((hexload_bus_profile_t)n) : NULL;
        names[3][n] = n < 2 ? hexload_bus_filter_name((hexload_bus_filter_t)n) : NULL;
    }
    for (int kind = 0; kind < 4; kind++) {
        for (int n = 0; n < 10 && names[kind][n] != NULL; n++) {
            TEST_ASSERT_NOT_EQUAL(0, strcmp(names[kind][n], fallback[kind]));
            for (int m = 0; m < n; m++) {
                TEST_ASSERT_NOT_EQUAL(0, strcmp(names[kind][n], names[kind][m]));
            }
        }
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_checksums_have_the_check_values_of_the_catalogue);
    RUN_TEST(test_checksums_by_tables_are_those_by_bits);
    RUN_TEST(test_a_sample_comes_back_within_half_a_step);
    RUN_TEST(test_rounding_is_to_the_nearest_step_on_both_sides_of_zero);
    RUN_TEST(test_a_channel_beyond_the_range_arrives_as_its_end_and_is_counted);
    RUN_TEST(test_half_a_step_beyond_the_range_is_cut_and_counted_too);
    RUN_TEST(test_a_channel_that_is_infinite_is_not_sent);
    RUN_TEST(test_frames_have_identifier_format_and_length_of_the_contract);
    RUN_TEST(test_counters_go_up_by_one_from_page_to_page_and_from_whole_tick_to_whole_tick);
    RUN_TEST(test_the_whole_tick_is_sent_at_multiples_of_sixteen_only);
    RUN_TEST(test_a_velocity_without_sensor_arrives_as_no_number);
    RUN_TEST(test_a_lost_channel_arrives_as_lost_and_all_others_as_they_were);
    RUN_TEST(test_an_answer_that_is_not_finite_is_not_sent);
    RUN_TEST(test_a_command_comes_back_also_an_unknown_one);
    RUN_TEST(test_a_command_argument_that_the_contract_has_not_is_refused);
    RUN_TEST(test_the_largest_code_of_a_byte_is_an_argument_too);
    RUN_TEST(test_the_checksum_of_a_known_mass_is_that_of_its_four_bytes_and_of_none_zero);
    RUN_TEST(test_an_acknowledge_comes_back);
    RUN_TEST(test_an_acknowledge_with_an_unknown_code_is_refused);
    RUN_TEST(test_status_pages_put_together_are_the_status);
    RUN_TEST(test_a_status_page_changes_its_own_fields_only);
    RUN_TEST(test_a_status_with_an_unknown_code_or_a_number_out_of_range_is_refused);
    RUN_TEST(test_a_load_change_comes_back);
    RUN_TEST(test_a_load_change_with_another_counter_than_its_count_is_refused);
    RUN_TEST(test_each_flipped_bit_is_detected);
    RUN_TEST(test_a_frame_under_another_ones_identifier_has_a_wrong_checksum);
    RUN_TEST(test_another_length_or_format_is_refused);
    RUN_TEST(test_decoders_pass_over_every_other_identifier);
    RUN_TEST(test_only_a_controllers_identifiers_are_a_controllers);
    RUN_TEST(test_every_code_has_a_name_of_its_own);
    return UNITY_END();
}
