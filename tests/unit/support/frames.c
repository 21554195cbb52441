#include "frames.h"

#include <string.h>

hexload_leg_sample_t numbered_sample(uint32_t tick) {
    hexload_leg_sample_t sample = {.tick = tick};
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) { // 2048 ticks of 4e-6 m and 3e-4 m/s are within the range
        const double number = (double)(tick % 2048) * 8 + leg;
        sample.displacement_m[leg] = (hexload_real_t)(4e-6 * number);
        sample.velocity_m_s[leg] = (hexload_real_t)(-3e-4 * number);
        sample.force_n[leg] = (hexload_real_t)(1.0 * number);
    }
    return sample;
}

hexload_leg_sample_t random_sample(uint32_t tick, uint64_t* seed) {
    hexload_leg_sample_t sample = {.tick = tick};
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        sample.displacement_m[leg] = (hexload_real_t)(1.048 * uniform(seed));
        sample.velocity_m_s[leg] = (hexload_real_t)(4.914 * uniform(seed));
        sample.force_n[leg] = (hexload_real_t)(131070.0 * uniform(seed));
    }
    return sample;
}

int parameters_of(uint8_t filter) {
    return filter == HEXLOAD_FILTER_MOMENTUM ? 10 : 4;
}

hexload_bus_answer_t numbered_answer(uint8_t filter, uint32_t tick) {
    const hexload_real_t number = (hexload_real_t)(tick % 1000 + 1);
    hexload_bus_answer_t answer = {.tick = tick,
                                   .status = HEXLOAD_ERR_POSE,
                                   .state = 3,
                                   .fault = 2,
                                   .missing_legs = (uint8_t)(1 + tick % 63),
                                   .filter = filter,
                                   .health = (uint16_t)(1 + tick % 511),
                                   .refused = 7 * tick + 1};
    for (int k = 0; k < parameters_of(filter); k++) {
        answer.estimate.value[k] = number * (hexload_real_t)(k + 1);
        answer.estimate.sigma[k] = number / (hexload_real_t)(8 << k);
        answer.estimate.parameter_verdict[k] = (hexload_verdict_t)((k ^ 1) % 5);
    }
    answer.estimate.verdict = HEXLOAD_VERDICT_INCONSISTENT;
    answer.estimate.nis = number / 2;
    answer.estimate.nis_mean = number / 4;
    return answer;
}

void assert_same_answer(const hexload_bus_answer_t* expected, const hexload_bus_answer_t* found) {
    const hexload_estimate_t *e = &expected->estimate, *f = &found->estimate;
    TEST_ASSERT_EQUAL_UINT32(expected->tick, found->tick);
    TEST_ASSERT_EQUAL_INT8(expected->status, found->status);
    TEST_ASSERT_EQUAL_UINT8(expected->state, found->state);
    TEST_ASSERT_EQUAL_UINT8(expected->fault, found->fault);
    TEST_ASSERT_EQUAL_HEX8(expected->missing_legs, found->missing_legs);
    TEST_ASSERT_EQUAL_UINT8(expected->filter, found->filter);
    TEST_ASSERT_EQUAL_HEX16(expected->health, found->health);
    TEST_ASSERT_EQUAL_UINT32(expected->refused, found->refused);
    for (int k = 0; k < parameters_of(expected->filter); k++) {
        TEST_ASSERT_TRUE((float)e->value[k] == (float)f->value[k]);
        TEST_ASSERT_TRUE((float)e->sigma[k] == (float)f->sigma[k]);
        TEST_ASSERT_EQUAL_INT(e->parameter_verdict[k], f->parameter_verdict[k]);
    }
    TEST_ASSERT_EQUAL_INT(e->verdict, f->verdict);
    TEST_ASSERT_TRUE((float)e->nis == (float)f->nis);
    TEST_ASSERT_TRUE((float)e->nis_mean == (float)f->nis_mean);
}

int encode_sample(hexload_bus_profile_t profile, const hexload_leg_sample_t* sample,
                  hexload_bus_frame_t frames[HEXLOAD_BUS_SAMPLE_FRAMES]) {
    uint32_t saturated = 0;
    const int count = hexload_bus_encode_sample(profile, sample, frames, &saturated);
    TEST_ASSERT_GREATER_THAN_INT(0, count);
    TEST_ASSERT_EQUAL_UINT32(0, saturated);
    return count;
}

int encode_answer(hexload_bus_profile_t profile, const hexload_bus_answer_t* answer, int page,
                  hexload_bus_frame_t frames[HEXLOAD_BUS_ANSWER_FRAMES]) {
    const int count = hexload_bus_encode_answer(profile, answer, page, frames);
    TEST_ASSERT_GREATER_THAN_INT(0, count);
    return count;
}

/// A checksum bit by bit, from the standard's parameters.
static uint32_t crc32_by_bits(uint32_t crc, const uint8_t* bytes, size_t count) {
    for (size_t bit = 0; bit < 8 * count; bit++) {
        const uint32_t leaves = (crc ^ ((uint32_t)bytes[bit / 8] >> (bit % 8))) & 1u;
        crc = (crc >> 1) ^ (leaves != 0 ? 0xC8DF352Fu : 0); // 0xF4ACFB13, its bits reflected
    }
    return crc;
}

uint32_t crc32p4(const uint8_t* bytes, size_t count) {
    return ~crc32_by_bits(0xFFFFFFFFu, bytes, count);
}

static unsigned crc8_by_bits(unsigned crc, const uint8_t* bytes, size_t count) {
    for (size_t bit = 0; bit < 8 * count; bit++) {
        const unsigned leaves = ((crc >> 7) ^ ((unsigned)bytes[bit / 8] >> (7 - bit % 8))) & 1u;
        crc = ((crc << 1) & 0xFFu) ^ (leaves != 0 ? 0x2Fu : 0);
    }
    return crc;
}

uint8_t crc8h2f(const uint8_t* bytes, size_t count) {
    return (uint8_t)~crc8_by_bits(0xFFu, bytes, count);
}

void seal(hexload_bus_frame_t* frame) {
    const uint8_t id[4] = {(uint8_t)frame->id, (uint8_t)(frame->id >> 8), 0x4C, 0x48};
    if (frame->length > 8) {
        const size_t count = (size_t)frame->length - 4;
        const uint32_t crc = ~crc32_by_bits(crc32_by_bits(0xFFFFFFFFu, frame->data, count), id, 4);
        for (unsigned n = 0; n < 4; n++) {
            frame->data[count + n] = (uint8_t)(crc >> (8 * n));
        }
    } else if (frame->length > 1) {
        const uint8_t listed = (uint8_t)(frame->id ^ frame->id / 16);
        const unsigned data = crc8_by_bits(0xFFu, &frame->data[1], (size_t)frame->length - 1);
        frame->data[0] = (uint8_t)~crc8_by_bits(data, &listed, 1);
    }
}

static uint32_t random_below(uint32_t limit, uint64_t* seed) {
    return (uint32_t)((uniform(seed) + 1.0) / 2.0 * (double)limit * 0.999999);
}

hexload_bus_frame_t random_frame(uint64_t* seed) {
    static const uint32_t ids[] = {ID_COMMAND,
                                   ID_SAMPLE_TICK,
                                   ID_LEG_SAMPLE_FD,
                                   ID_LEG_SAMPLE_1,
                                   0x082,
                                   0x083,
                                   0x084,
                                   0x085,
                                   0x086,
                                   ID_LOAD_CHANGE,
                                   ID_ESTIMATE_FD,
                                   ID_SIGMA_FD,
                                   ID_HEALTH_FD,
                                   ID_ANSWER_PAGE,
                                   ID_LOAD_FD,
                                   ID_LOAD_SIGMA_FD,
                                   ID_ACKNOWLEDGE,
                                   ID_CONTROLLER_STATUS};
    static const uint8_t lengths[] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64};
    hexload_bus_frame_t frame = {.id = random_below(0x800, seed)};
    if (random_below(4, seed) != 0) {
        frame.id = ids[random_below(sizeof ids / sizeof ids[0], seed)];
    }
    frame.length = lengths[random_below(sizeof lengths, seed)];
    if (random_below(2, seed) != 0) {
        const bool is_long =
            frame.id == ID_LEG_SAMPLE_FD || frame.id == ID_LOAD_FD || frame.id == ID_LOAD_SIGMA_FD;
        frame.length = is_long                                                  ? 64
                       : frame.id == ID_SAMPLE_TICK                             ? 6
                       : frame.id >= ID_ESTIMATE_FD && frame.id <= ID_HEALTH_FD ? 32
                                                                                : 8;
    }
    frame.is_fd = frame.length > 8 || random_below(8, seed) == 0;
    for (int n = 0; n < HEXLOAD_BUS_FRAME_BYTES; n++) { // also beyond the length: nobody may look there
        frame.data[n] = (uint8_t)random_below(256, seed);
    }
    if (random_below(2, seed) != 0) {
        seal(&frame);
    }
    return frame;
}
