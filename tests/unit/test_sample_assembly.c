#include "frames.h"

#include "bus/sample_assembly.h"

#include <string.h>

void setUp(void) {}
void tearDown(void) {}

/// Frames of one tick and the assembly that takes them.
typedef struct bench {
    hexload_sample_assembly_t assembly;
    hexload_leg_sample_t sample; ///< last whole one
} bench_t;

static bench_t started(hexload_bus_profile_t profile) {
    bench_t bench = {.sample = {.tick = 12345}};
    hexload_sample_assembly_init(&bench.assembly, profile);
    return bench;
}

static hexload_bus_status_t add(bench_t* bench, const hexload_bus_frame_t* frame) {
    return hexload_sample_assembly_add(&bench->assembly, frame, &bench->sample);
}

/// The classic frames of a tick; legs[n] is the frame of leg n + 1, whole_tick only set at multiples of 16.
typedef struct classic {
    hexload_bus_frame_t whole_tick;
    hexload_bus_frame_t legs[HEXLOAD_LEGS];
} classic_t;

static classic_t classic_frames(uint32_t tick) {
    const hexload_leg_sample_t sample = numbered_sample(tick);
    hexload_bus_frame_t frames[HEXLOAD_BUS_SAMPLE_FRAMES];
    classic_t result = {0};
    const int count = encode_sample(HEXLOAD_BUS_CLASSIC, &sample, frames);
    result.whole_tick = frames[0];
    memcpy(result.legs, &frames[count - HEXLOAD_LEGS], sizeof result.legs);
    return result;
}

/// All frames of a tick, in sending order; the status of the last.
static hexload_bus_status_t add_tick(bench_t* bench, uint32_t tick) {
    const classic_t frames = classic_frames(tick);
    hexload_bus_status_t status = HEXLOAD_BUS_PARTIAL;
    if (tick % HEXLOAD_BUS_TICK_PERIOD == 0) {
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_PARTIAL, add(bench, &frames.whole_tick));
    }
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_PARTIAL, status);
        status = add(bench, &frames.legs[leg]);
    }
    return status;
}

/// The leg frames of these ticks, without whole ones.
static void add_legs(bench_t* bench, uint32_t begin, uint32_t end) {
    for (uint32_t tick = begin; tick < end; tick++) {
        const classic_t frames = classic_frames(tick);
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            TEST_ASSERT_GREATER_OR_EQUAL_INT(0, add(bench, &frames.legs[leg]));
        }
    }
}

static void assert_sample(const bench_t* bench, uint32_t tick) {
    const hexload_leg_sample_t expected = numbered_sample(tick);
    TEST_ASSERT_EQUAL_UINT32(tick, bench->sample.tick);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) { // numbered samples lie on the steps
        TEST_ASSERT_DOUBLE_WITHIN(1e-7, (double)expected.displacement_m[leg],
                                  (double)bench->sample.displacement_m[leg]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-6, (double)expected.velocity_m_s[leg],
                                  (double)bench->sample.velocity_m_s[leg]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-3, (double)expected.force_n[leg], (double)bench->sample.force_n[leg]);
    }
}

static void test_an_fd_frame_is_a_sample(void) {
    bench_t bench = started(HEXLOAD_BUS_FD);
    for (uint32_t n = 0; n < 5; n++) {
        const hexload_leg_sample_t sample = numbered_sample(UINT32_MAX - 2 + n);
        hexload_bus_frame_t frame[HEXLOAD_BUS_SAMPLE_FRAMES];
        encode_sample(HEXLOAD_BUS_FD, &sample, frame);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, add(&bench, frame));
        assert_sample(&bench, sample.tick);
    }
}

static void test_a_damaged_fd_frame_is_refused_and_no_sample_comes_out(void) {
    const hexload_leg_sample_t sample = numbered_sample(9);
    hexload_bus_frame_t frame[HEXLOAD_BUS_SAMPLE_FRAMES];
    encode_sample(HEXLOAD_BUS_FD, &sample, frame);
    bench_t bench = started(HEXLOAD_BUS_FD);
    const bench_t before = bench;
    // each bit
    for (int bit = 0; bit < 512; bit++) {
        frame->data[bit / 8] ^= (uint8_t)(1u << (bit % 8));
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_CRC, add(&bench, frame));
        frame->data[bit / 8] ^= (uint8_t)(1u << (bit % 8));
    }
    // another version of the contract
    hexload_bus_frame_t other = *frame;
    other.data[58] = 1;
    seal(&other);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_VALUE, add(&bench, &other));
    // length and format
    other = *frame;
    other.length = 48;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_LENGTH, add(&bench, &other));
    other = *frame;
    other.is_fd = false;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_LENGTH, add(&bench, &other));
    TEST_ASSERT_EQUAL_MEMORY(&before.sample, &bench.sample, sizeof bench.sample);
}

static void test_six_leg_frames_make_a_sample_in_any_order(void) {
    uint64_t seed = 3;
    bench_t bench = started(HEXLOAD_BUS_CLASSIC);
    for (uint32_t tick = 0; tick < 200; tick++) {
        // GIVEN the frames of a tick, shuffled
        classic_t frames = classic_frames(tick);
        if (tick % HEXLOAD_BUS_TICK_PERIOD == 0) {
            TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_PARTIAL, add(&bench, &frames.whole_tick));
        }
        for (int last = HEXLOAD_LEGS - 1; last > 0; last--) {
            const int other = (int)((uniform(&seed) + 1.0) / 2.0 * 0.999999 * (last + 1));
            const hexload_bus_frame_t frame = frames.legs[last];
            frames.legs[last] = frames.legs[other];
            frames.legs[other] = frame;
        }
        // WHEN they come THEN the last one makes the sample
        for (int n = 0; n < HEXLOAD_LEGS; n++) {
            TEST_ASSERT_EQUAL_INT(n < HEXLOAD_LEGS - 1 ? HEXLOAD_BUS_PARTIAL : HEXLOAD_BUS_OK,
                                  add(&bench, &frames.legs[n]));
        }
        assert_sample(&bench, tick);
    }
    TEST_ASSERT_EQUAL_UINT32(0, bench.assembly.incomplete);
    TEST_ASSERT_EQUAL_HEX8(0, bench.assembly.missing_legs);
}

static void test_a_missing_frame_costs_its_sample_only(void) {
    for (int missing = 0; missing < HEXLOAD_LEGS; missing++) {
        bench_t bench = started(HEXLOAD_BUS_CLASSIC);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, add_tick(&bench, 16));
        // GIVEN a tick without one of its legs
        const classic_t frames = classic_frames(17);
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            if (leg != missing) {
                TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_PARTIAL, add(&bench, &frames.legs[leg]));
            }
        }
        // WHEN the next tick comes THEN it is whole, and the loss is reported
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, add_tick(&bench, 18));
        assert_sample(&bench, 18);
        TEST_ASSERT_EQUAL_UINT32(1, bench.assembly.incomplete);
        TEST_ASSERT_EQUAL_HEX8(1 << missing, bench.assembly.missing_legs);
    }
}

static void test_late_and_doubled_frames_are_refused_and_change_nothing(void) {
    bench_t bench = started(HEXLOAD_BUS_CLASSIC);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, add_tick(&bench, 32));
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, add_tick(&bench, 33));
    // GIVEN a tick that has begun
    const classic_t old = classic_frames(32), last = classic_frames(33), now = classic_frames(34);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_PARTIAL, add(&bench, &now.legs[0]));
    // WHEN frames of ticks that are over come, or one comes twice
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_TICK, add(&bench, &old.legs[leg]));
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_TICK, add(&bench, &last.legs[leg]));
    }
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_TICK, add(&bench, &now.legs[0]));
    // THEN the tick is put together as if they had not
    for (int leg = 1; leg < HEXLOAD_LEGS; leg++) {
        TEST_ASSERT_EQUAL_INT(leg < 5 ? HEXLOAD_BUS_PARTIAL : HEXLOAD_BUS_OK, add(&bench, &now.legs[leg]));
    }
    assert_sample(&bench, 34);
    // and a frame of the finished tick is refused too
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_TICK, add(&bench, &now.legs[3]));
    TEST_ASSERT_EQUAL_UINT32(0, bench.assembly.incomplete);
}

static void test_a_leg_that_comes_again_with_other_numbers_has_another_source(void) {
    // GIVEN a classic tick of which some legs have come, or all WHEN one comes again with a force a tenth
    // larger
    for (int legs = 1; legs <= HEXLOAD_LEGS; legs++) {
        bench_t bench = started(HEXLOAD_BUS_CLASSIC);
        const classic_t own = classic_frames(48);
        hexload_leg_sample_t forged = numbered_sample(48);
        hexload_bus_frame_t frames[HEXLOAD_BUS_SAMPLE_FRAMES];
        forged.force_n[0] *= HEXLOAD_REAL(1.1);
        encode_sample(HEXLOAD_BUS_CLASSIC, &forged, frames);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_PARTIAL, add(&bench, &own.whole_tick));
        for (int leg = 0; leg < legs; leg++) {
            TEST_ASSERT_EQUAL_INT(leg < 5 ? HEXLOAD_BUS_PARTIAL : HEXLOAD_BUS_OK,
                                  add(&bench, &own.legs[leg]));
        }
        // THEN it is told from an echo
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_CONTRADICTION, add(&bench, &frames[1]));
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_TICK, add(&bench, &own.legs[0]));
    }
    // and so is an FD sample, until a run begins anew
    bench_t fd = started(HEXLOAD_BUS_FD);
    hexload_leg_sample_t sample = numbered_sample(48);
    hexload_bus_frame_t frame[HEXLOAD_BUS_SAMPLE_FRAMES];
    for (int forged = 0; forged < 2; forged++) {
        encode_sample(HEXLOAD_BUS_FD, &sample, frame);
        TEST_ASSERT_EQUAL_INT(forged == 0 ? HEXLOAD_BUS_OK : HEXLOAD_BUS_ERR_CONTRADICTION,
                              add(&fd, &frame[0]));
        sample.force_n[3] += HEXLOAD_REAL(1.0);
    }
    hexload_sample_assembly_forgive(&fd.assembly);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, add(&fd, &frame[0]));
}

static void test_leg_frames_before_the_first_whole_tick_are_not_used(void) {
    bench_t bench = started(HEXLOAD_BUS_CLASSIC);
    for (uint32_t tick = 70; tick < 80; tick++) {
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_PARTIAL, add_tick(&bench, tick));
    }
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, add_tick(&bench, 80));
    assert_sample(&bench, 80);
    TEST_ASSERT_EQUAL_UINT32(0, bench.assembly.incomplete);
}

static void test_the_tick_goes_on_over_the_end_of_its_32_bits(void) {
    bench_t bench = started(HEXLOAD_BUS_CLASSIC);
    const uint32_t first = UINT32_MAX - 47; // a multiple of 16
    for (uint32_t n = 0; n < 96; n++) {
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, add_tick(&bench, first + n));
        assert_sample(&bench, first + n);
    }
}

static void test_without_the_frame_of_the_whole_tick_the_four_bits_go_round(void) {
    bench_t bench = started(HEXLOAD_BUS_CLASSIC);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, add_tick(&bench, 0));
    for (uint32_t tick = 1; tick < 64; tick++) {
        const classic_t frames = classic_frames(tick); // the whole tick of 16, 32, 48 gets lost
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            TEST_ASSERT_GREATER_OR_EQUAL_INT(0, add(&bench, &frames.legs[leg]));
        }
        assert_sample(&bench, tick);
    }
}

static void test_a_gap_of_up_to_eight_ticks_is_bridged(void) {
    for (uint32_t gap = 1; gap <= 8; gap++) {
        bench_t bench = started(HEXLOAD_BUS_CLASSIC);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, add_tick(&bench, 16));
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, add_tick(&bench, 17));
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, add_tick(&bench, 17 + gap));
        assert_sample(&bench, 17 + gap);
        TEST_ASSERT_EQUAL_UINT32(0, bench.assembly.incomplete); // nothing of those ticks had come
    }
}

static void test_after_the_tick_is_lost_the_next_whole_one_is_waited_for(void) {
    bench_t bench = started(HEXLOAD_BUS_CLASSIC);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, add_tick(&bench, 16));
    const classic_t begun = classic_frames(17);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_PARTIAL, add(&bench, &begun.legs[5]));
    // WHEN a silence makes the four bits ambiguous
    hexload_sample_assembly_lose_tick(&bench.assembly);
    // THEN what had begun is given up, and legs are of use again after the next whole tick
    TEST_ASSERT_EQUAL_UINT32(1, bench.assembly.incomplete);
    TEST_ASSERT_EQUAL_HEX8(0x1F, bench.assembly.missing_legs);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_PARTIAL, add_tick(&bench, 46));
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_PARTIAL, add_tick(&bench, 47));
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, add_tick(&bench, 48));
    assert_sample(&bench, 48);
    TEST_ASSERT_EQUAL_UINT32(1, bench.assembly.incomplete);
}

static void test_a_source_may_restart_at_any_tick_without_mixing(void) {
    const uint32_t restart[4] = {0, 32, 48, 4096}; // 32: the tick that the source was just sending
    for (int n = 0; n < 4; n++) {
        // GIVEN a source that stops in the middle of a tick
        bench_t bench = started(HEXLOAD_BUS_CLASSIC);
        const classic_t old = classic_frames(32);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_PARTIAL, add(&bench, &old.whole_tick));
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_PARTIAL, add(&bench, &old.legs[0]));
        // WHEN another one begins with START THEN the first sample is all of the new one, and none is missed
        hexload_sample_assembly_forgive(&bench.assembly);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, add_tick(&bench, restart[n]));
        assert_sample(&bench, restart[n]);
        TEST_ASSERT_EQUAL_UINT32(0, bench.assembly.incomplete);
        TEST_ASSERT_EQUAL_HEX8(0, bench.assembly.missing_legs);
    }
}

static void test_a_whole_tick_that_the_legs_do_not_count_is_believed_when_the_next_one_follows_it(void) {
    const uint32_t claims[4] = {0, 32 + 16, 64, 1u << 20};
    for (int n = 0; n < 4; n++) {
        bench_t bench = started(HEXLOAD_BUS_CLASSIC);
        for (uint32_t tick = 16; tick < 32 + 5; tick++) {
            TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, add_tick(&bench, tick));
        }
        // WHEN a false one comes, and comes again, once the next one that is due and once any other
        const hexload_bus_frame_t claim = classic_frames(claims[n]).whole_tick;
        const bool is_due = claims[n] == 48;
        for (int time = 0; time < 2; time++) {
            TEST_ASSERT_EQUAL_INT(is_due ? HEXLOAD_BUS_PARTIAL : HEXLOAD_BUS_ERR_TICK, add(&bench, &claim));
        }
        // THEN the legs go on counting
        for (uint32_t tick = 37; tick < 47; tick++) {
            TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, add_tick(&bench, tick));
            assert_sample(&bench, tick);
        }
        // WHEN the one that follows it comes THEN it counts: if it is ahead, after sixteen ticks of legs
        uint32_t last = claims[n] + 16;
        if (claims[n] > 48) {
            const hexload_bus_frame_t early = classic_frames(last).whole_tick;
            TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_TICK, add(&bench, &early));
            add_legs(&bench, 47, 47 + 16);
            last += 16;
        }
        const classic_t next = classic_frames(last);
        if (!is_due) { // and says that there are two sources, if it goes back
            TEST_ASSERT_EQUAL_INT(claims[n] < 32 ? HEXLOAD_BUS_ERR_CONTRADICTION : HEXLOAD_BUS_PARTIAL,
                                  add(&bench, &next.whole_tick));
            for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
                TEST_ASSERT_GREATER_OR_EQUAL_INT(0, add(&bench, &next.legs[leg]));
            }
            assert_sample(&bench, last);
        }
    }
    // AND one that is due comes in between: the claim is forgotten, however far the legs have counted since
    for (uint32_t end = 33; end <= 47; end += 14) {
        bench_t bench = started(HEXLOAD_BUS_CLASSIC);
        const classic_t claim = classic_frames(160), due = classic_frames(32), next = classic_frames(176);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, add_tick(&bench, 16));
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_TICK, add(&bench, &claim.whole_tick));
        add_legs(&bench, 17, 32);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_PARTIAL, add(&bench, &due.whole_tick));
        add_legs(&bench, 32, end);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_TICK, add(&bench, &next.whole_tick));
    }
}

static void test_a_whole_tick_that_was_believed_is_late_when_it_comes_again(void) {
    // GIVEN a source that goes on far ahead, of which the second whole tick is believed, and half a sample
    bench_t bench = started(HEXLOAD_BUS_CLASSIC);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, add_tick(&bench, 16));
    const classic_t first = classic_frames(160), second = classic_frames(176);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_TICK, add(&bench, &first.whole_tick));
    add_legs(&bench, 17, 17 + 16);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_PARTIAL, add(&bench, &second.whole_tick));
    for (int leg = 0; leg < 3; leg++) {
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_PARTIAL, add(&bench, &second.legs[leg]));
    }
    // WHEN its whole tick comes again THEN it is late, and the other half makes the sample
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_TICK, add(&bench, &second.whole_tick));
    for (int leg = 3; leg < HEXLOAD_LEGS; leg++) {
        TEST_ASSERT_EQUAL_INT(leg < 5 ? HEXLOAD_BUS_PARTIAL : HEXLOAD_BUS_OK, add(&bench, &second.legs[leg]));
    }
    assert_sample(&bench, 176);
}

static void test_an_echo_of_a_whole_tick_is_no_claim(void) {
    // GIVEN a whole tick that has come twice WHEN the next one comes late, after legs have counted beyond it
    bench_t bench = started(HEXLOAD_BUS_CLASSIC);
    const classic_t first = classic_frames(16), late = classic_frames(32);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, add_tick(&bench, 16));
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_TICK, add(&bench, &first.whole_tick));
    add_legs(&bench, 17, 40);
    // THEN it is late, and shows no other source
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_TICK, add(&bench, &late.whole_tick));
    add_legs(&bench, 40, 41);
    assert_sample(&bench, 40);
}

static void test_a_whole_tick_as_far_ahead_as_there_is_shows_no_other_source(void) {
    // GIVEN a source that goes on half of all ticks ahead WHEN its second whole tick comes THEN it is
    // believed
    bench_t bench = started(HEXLOAD_BUS_CLASSIC);
    const classic_t first = classic_frames(0x80000010), second = classic_frames(0x80000020);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, add_tick(&bench, 16));
    add_legs(&bench, 17, 18);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_TICK, add(&bench, &first.whole_tick));
    add_legs(&bench, 18, 34);
    TEST_ASSERT_EQUAL_UINT32(UINT32_MAX / 2, 0x80000020 - bench.sample.tick);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_PARTIAL, add(&bench, &second.whole_tick));
}

static void test_a_whole_tick_with_no_leg_after_it_counts_as_lost(void) {
    bench_t bench = started(HEXLOAD_BUS_CLASSIC);
    const classic_t empty = classic_frames(16);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_PARTIAL, add(&bench, &empty.whole_tick));
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, add_tick(&bench, 17));
    TEST_ASSERT_EQUAL_UINT32(1, bench.assembly.incomplete);
    TEST_ASSERT_EQUAL_HEX8(0x3F, bench.assembly.missing_legs);
}

static void test_classic_frames_with_a_wrong_length_format_or_number_are_refused(void) {
    bench_t bench = started(HEXLOAD_BUS_CLASSIC);
    classic_t frames = classic_frames(16);
    for (int length = 0; length <= HEXLOAD_BUS_FRAME_BYTES; length++) {
        hexload_bus_frame_t whole_tick = frames.whole_tick, leg = frames.legs[2];
        whole_tick.length = leg.length = (uint8_t)length;
        TEST_ASSERT_EQUAL_INT(length == 6 ? HEXLOAD_BUS_PARTIAL : HEXLOAD_BUS_ERR_LENGTH,
                              add(&bench, &whole_tick));
        if (length != 8) {
            TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_LENGTH, add(&bench, &leg));
        }
    }
    hexload_bus_frame_t wrong[3] = {frames.whole_tick, frames.whole_tick, frames.whole_tick};
    wrong[0].data[2] = 17;    // a whole tick that is no multiple of 16
    wrong[1].data[1] ^= 0x01; // another counter than that of the tick
    wrong[2].data[1] ^= 0x10; // another version of the contract
    for (int n = 0; n < 3; n++) {
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_CRC, add(&bench, &wrong[n]));
        seal(&wrong[n]);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_VALUE, add(&bench, &wrong[n]));
    }
    frames.legs[1].is_fd = true;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_LENGTH, add(&bench, &frames.legs[1]));
    TEST_ASSERT_EQUAL_HEX8(0, bench.assembly.legs);
}

static void test_samples_of_the_other_profile_are_distinguished_from_strange_frames(void) {
    const hexload_leg_sample_t sample = numbered_sample(16);
    hexload_bus_frame_t frames[HEXLOAD_BUS_SAMPLE_FRAMES];
    bench_t fd = started(HEXLOAD_BUS_FD), classic = started(HEXLOAD_BUS_CLASSIC);
    // a whole classic sample at an FD reader
    encode_sample(HEXLOAD_BUS_CLASSIC, &sample, frames);
    for (int n = 0; n < HEXLOAD_BUS_SAMPLE_FRAMES; n++) {
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_PROFILE, add(&fd, &frames[n]));
    }
    // an FD sample at a classic reader
    encode_sample(HEXLOAD_BUS_FD, &sample, frames);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_PROFILE, add(&classic, &frames[0]));
    // a damaged one is nobody's
    frames[0].data[9] ^= 1;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_CRC, add(&classic, &frames[0]));
    // somebody else's short frame with that identifier
    frames[0].length = 0;
    frames[0].is_fd = false;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_LENGTH, add(&classic, &frames[0]));
    // all other identifiers
    for (frames[0].id = 0; frames[0].id < 0x800; frames[0].id++) {
        if (frames[0].id < ID_SAMPLE_TICK || frames[0].id > 0x086) {
            TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OTHER, add(&fd, &frames[0]));
            TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OTHER, add(&classic, &frames[0]));
        }
    }
}

/// Whether a frame could be a source's: random_frame() seals half of its frames.
static bool is_leg_like(const hexload_bus_frame_t* frame) {
    return frame->id >= ID_SAMPLE_TICK && frame->id <= 0x086 && frame->id != ID_LEG_SAMPLE_FD &&
           !frame->is_fd && (frame->length == 6 || frame->length == 8);
}

static int add_and_check(bench_t* bench, const hexload_bus_frame_t* frame) {
    if (add(bench, frame) != HEXLOAD_BUS_OK) {
        return 0;
    }
    assert_sample(bench, bench->sample.tick);
    return 1;
}

static void test_among_losses_echoes_and_garbage_no_sample_mixes_ticks(void) {
    uint64_t seed = 7;
    bench_t bench = started(HEXLOAD_BUS_CLASSIC);
    int whole = 0;
    for (uint32_t tick = 0; tick < 20000; tick++) {
        const classic_t frames = classic_frames(tick);
        for (int n = -1; n < HEXLOAD_LEGS; n++) {
            // GIVEN a random frame of any identifier and length
            const hexload_bus_frame_t garbage = random_frame(&seed);
            if (!is_leg_like(&garbage)) {
                TEST_ASSERT_EQUAL_INT(0, add_and_check(&bench, &garbage));
            }
            // AND now and then one of the last seven ticks, once more
            if (uniform(&seed) > 0.9) {
                const classic_t echo = classic_frames(tick - 1 - (uint32_t)(3.49 * (uniform(&seed) + 1.0)));
                whole += add_and_check(&bench, &echo.legs[(int)(2.99 * (uniform(&seed) + 1.0))]);
            }
            // WHEN the source's own frame comes, unless it gets lost, THEN a sample that comes out is of one
            // tick
            if ((n >= 0 || tick % HEXLOAD_BUS_TICK_PERIOD == 0) && uniform(&seed) < 0.98) {
                whole += add_and_check(&bench, n < 0 ? &frames.whole_tick : &frames.legs[n]);
            }
        }
    }
    TEST_ASSERT_GREATER_THAN_INT(17000, whole); // 0.99^6 of 20000 is 18800
}

static void test_random_frames_alone_do_no_harm(void) {
    uint64_t seed = 8;
    bench_t fd = started(HEXLOAD_BUS_FD), classic = started(HEXLOAD_BUS_CLASSIC);
    for (int n = 0; n < 200000; n++) {
        const hexload_bus_frame_t frame = random_frame(&seed);
        hexload_bus_status_t status = add(&fd, &frame);
        TEST_ASSERT_TRUE(status >= HEXLOAD_BUS_ERR_CONTRADICTION && status <= HEXLOAD_BUS_PARTIAL);
        status = add(&classic, &frame);
        TEST_ASSERT_TRUE(status >= HEXLOAD_BUS_ERR_CONTRADICTION && status <= HEXLOAD_BUS_PARTIAL);
    }
}

static void test_two_whole_ticks_up_to_half_of_all_ahead_need_legs_that_count_on_between_them(void) {
    // GIVEN legs that count on from tick 16 WHEN two whole ticks in a row come from ahead, at once THEN none
    // is believed, however far it is
    const uint32_t ahead[] = {0x1000, 0x10000000, 0x60000000, 0x7FFFFF00};
    for (int n = 0; n < 4; n++) {
        bench_t bench = started(HEXLOAD_BUS_CLASSIC);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, add_tick(&bench, 16));
        for (uint32_t tick = 0; tick <= HEXLOAD_BUS_TICK_PERIOD; tick += HEXLOAD_BUS_TICK_PERIOD) {
            const classic_t far = classic_frames(16 + ahead[n] + tick);
            (void)!add(&bench, &far.whole_tick);
        }
        add_legs(&bench, 17, 18);
        assert_sample(&bench, 17);
    }
    // AND just as many as half of all are ahead
    bench_t bench = started(HEXLOAD_BUS_CLASSIC);
    const classic_t first = classic_frames(0x80000000), second = classic_frames(0x80000010);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, add_tick(&bench, 16));
    add_legs(&bench, 17, 18);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_TICK, add(&bench, &first.whole_tick));
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_TICK, add(&bench, &second.whole_tick));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_an_fd_frame_is_a_sample);
    RUN_TEST(test_a_damaged_fd_frame_is_refused_and_no_sample_comes_out);
    RUN_TEST(test_six_leg_frames_make_a_sample_in_any_order);
    RUN_TEST(test_a_missing_frame_costs_its_sample_only);
    RUN_TEST(test_late_and_doubled_frames_are_refused_and_change_nothing);
    RUN_TEST(test_a_leg_that_comes_again_with_other_numbers_has_another_source);
    RUN_TEST(test_leg_frames_before_the_first_whole_tick_are_not_used);
    RUN_TEST(test_the_tick_goes_on_over_the_end_of_its_32_bits);
    RUN_TEST(test_without_the_frame_of_the_whole_tick_the_four_bits_go_round);
    RUN_TEST(test_a_gap_of_up_to_eight_ticks_is_bridged);
    RUN_TEST(test_after_the_tick_is_lost_the_next_whole_one_is_waited_for);
    RUN_TEST(test_a_source_may_restart_at_any_tick_without_mixing);
    RUN_TEST(test_a_whole_tick_that_the_legs_do_not_count_is_believed_when_the_next_one_follows_it);
    RUN_TEST(test_a_whole_tick_that_was_believed_is_late_when_it_comes_again);
    RUN_TEST(test_an_echo_of_a_whole_tick_is_no_claim);
    RUN_TEST(test_a_whole_tick_as_far_ahead_as_there_is_shows_no_other_source);
    RUN_TEST(test_a_whole_tick_with_no_leg_after_it_counts_as_lost);
    RUN_TEST(test_classic_frames_with_a_wrong_length_format_or_number_are_refused);
    RUN_TEST(test_samples_of_the_other_profile_are_distinguished_from_strange_frames);
    RUN_TEST(test_among_losses_echoes_and_garbage_no_sample_mixes_ticks);
    RUN_TEST(test_random_frames_alone_do_no_harm);
    RUN_TEST(test_two_whole_ticks_up_to_half_of_all_ahead_need_legs_that_count_on_between_them);
    return UNITY_END();
}
