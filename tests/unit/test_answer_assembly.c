#include "frames.h"

#include "bus/answer_assembly.h"
#include "bus/answer_frames.h"

#include <math.h>
#include <string.h>

void setUp(void) {}
void tearDown(void) {}

/// All tests run with the answers of either.
static uint8_t filter;

static int pages(void) {
    return hexload_bus_answer_pages(filter);
}

/// Ticks of a round of pages.
static uint32_t round_ticks(void) {
    return HEXLOAD_BUS_ANSWER_PERIOD * (uint32_t)pages();
}

typedef struct bench {
    hexload_answer_assembly_t assembly;
    hexload_bus_answer_t answer; ///< last whole one
    uint32_t answered_tick;
    uint32_t near_tick;
} bench_t;

static bench_t started(hexload_bus_profile_t profile) {
    bench_t bench = {.answer = {.tick = 12345}, .answered_tick = 54321};
    hexload_answer_assembly_init(&bench.assembly, profile);
    return bench;
}

static hexload_bus_status_t add(bench_t* bench, const hexload_bus_frame_t* frame) {
    return hexload_answer_assembly_add(&bench->assembly, frame, bench->near_tick, &bench->answered_tick,
                                       &bench->answer);
}

enum { ESTIMATE, SIGMA, HEALTH };

typedef struct fd {
    hexload_bus_frame_t part[HEXLOAD_BUS_ANSWER_FRAMES];
} fd_t;

static fd_t fd_frames(uint32_t tick) {
    const hexload_bus_answer_t answer = numbered_answer(filter, tick);
    fd_t frames;
    encode_answer(HEXLOAD_BUS_FD, &answer, 0, frames.part);
    return frames;
}

static void assert_answer(const bench_t* bench, uint32_t tick) {
    const hexload_bus_answer_t expected = numbered_answer(filter, tick);
    assert_same_answer(&expected, &bench->answer);
}

/// All three frames; the status of the last.
static hexload_bus_status_t add_fd_answer(bench_t* bench, uint32_t tick) {
    const fd_t frames = fd_frames(tick);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_PARTIAL, add(bench, &frames.part[ESTIMATE]));
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_PARTIAL, add(bench, &frames.part[SIGMA]));
    return add(bench, &frames.part[HEALTH]);
}

/// Page `page` of the answer that began at first_tick, sent two ticks per page later.
static hexload_bus_frame_t page_frame(uint32_t first_tick, int page) {
    hexload_bus_frame_t frames[HEXLOAD_BUS_ANSWER_FRAMES];
    hexload_bus_answer_t answer = numbered_answer(filter, first_tick);
    answer.tick += HEXLOAD_BUS_ANSWER_PERIOD * (uint32_t)page;
    encode_answer(HEXLOAD_BUS_CLASSIC, &answer, page, frames);
    return frames[0];
}

/// Pages first .. last; the status of the last.
static hexload_bus_status_t add_pages(bench_t* bench, uint32_t first_tick, int first, int last) {
    hexload_bus_status_t status = HEXLOAD_BUS_PARTIAL;
    for (int page = first; page <= last; page++) {
        const hexload_bus_frame_t frame = page_frame(first_tick, page);
        const uint32_t tick = first_tick + HEXLOAD_BUS_ANSWER_PERIOD * (uint32_t)page;
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_PARTIAL, status);
        bench->near_tick = tick + 1; // the next sample is out already
        status = add(bench, &frame);
        TEST_ASSERT_EQUAL_UINT32(tick, bench->answered_tick);
    }
    return status;
}

static void test_estimate_sigma_and_health_of_a_tick_make_an_answer(void) {
    bench_t bench = started(HEXLOAD_BUS_FD);
    for (uint32_t n = 0; n < 20; n++) {
        const uint32_t tick = UINT32_MAX - 9 + n;
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, add_fd_answer(&bench, tick));
        TEST_ASSERT_EQUAL_UINT32(tick, bench.answered_tick);
        assert_answer(&bench, tick);
    }
    TEST_ASSERT_EQUAL_UINT32(0, bench.assembly.incomplete);
}

static void test_an_fd_answer_without_one_of_its_frames_is_given_up(void) {
    for (int missing = ESTIMATE; missing <= HEALTH; missing++) {
        bench_t bench = started(HEXLOAD_BUS_FD);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, add_fd_answer(&bench, 4));
        const fd_t frames = fd_frames(5);
        for (int part = ESTIMATE; part <= HEALTH; part++) {
            if (part != missing) {
                TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_PARTIAL, add(&bench, &frames.part[part]));
                TEST_ASSERT_EQUAL_UINT32(5, bench.answered_tick); // lockstep goes on
            }
        }
        assert_answer(&bench, 4);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, add_fd_answer(&bench, 6));
        assert_answer(&bench, 6);
        TEST_ASSERT_EQUAL_UINT32(1, bench.assembly.incomplete);
    }
}

static void test_the_frames_of_an_fd_answer_come_in_any_order(void) {
    static const int orders[6][3] = {{ESTIMATE, SIGMA, HEALTH}, {ESTIMATE, HEALTH, SIGMA},
                                     {SIGMA, ESTIMATE, HEALTH}, {SIGMA, HEALTH, ESTIMATE},
                                     {HEALTH, ESTIMATE, SIGMA}, {HEALTH, SIGMA, ESTIMATE}};
    bench_t bench = started(HEXLOAD_BUS_FD);
    for (uint32_t n = 0; n < 6; n++) {
        // GIVEN the frames of an answer WHEN they come in this order THEN the last of them makes it whole
        const fd_t frames = fd_frames(n);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_PARTIAL, add(&bench, &frames.part[orders[n][0]]));
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_PARTIAL, add(&bench, &frames.part[orders[n][1]]));
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, add(&bench, &frames.part[orders[n][2]]));
        assert_answer(&bench, n);
    }
    TEST_ASSERT_EQUAL_UINT32(0, bench.assembly.incomplete);
}

static void test_late_and_doubled_fd_frames_are_refused(void) {
    bench_t bench = started(HEXLOAD_BUS_FD);
    const fd_t old = fd_frames(7), now = fd_frames(8);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, add_fd_answer(&bench, 7));
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_TICK, add(&bench, &old.part[SIGMA]));
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_TICK, add(&bench, &old.part[HEALTH]));
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_PARTIAL, add(&bench, &now.part[ESTIMATE]));
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_TICK, add(&bench, &old.part[SIGMA]));
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_TICK, add(&bench, &old.part[HEALTH]));
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_PARTIAL, add(&bench, &now.part[SIGMA]));
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_TICK, add(&bench, &now.part[SIGMA]));
    TEST_ASSERT_EQUAL_UINT32(8, bench.answered_tick);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, add(&bench, &now.part[HEALTH]));
    assert_answer(&bench, 8);
    TEST_ASSERT_EQUAL_UINT32(0, bench.assembly.incomplete);
}

static void test_half_of_all_ticks_are_ahead_and_half_are_late(void) {
    // GIVEN an answer that has begun at tick 8 WHEN a part of a tick comes that is nearly half of 2^32 ahead
    // THEN it begins another one; beyond half it is late
    for (int is_late = 0; is_late < 2; is_late++) {
        bench_t bench = started(HEXLOAD_BUS_FD);
        const fd_t now = fd_frames(8), other = fd_frames(8 + UINT32_MAX / 2 + (uint32_t)is_late);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_PARTIAL, add(&bench, &now.part[ESTIMATE]));
        TEST_ASSERT_EQUAL_INT(is_late ? HEXLOAD_BUS_ERR_TICK : HEXLOAD_BUS_PARTIAL,
                              add(&bench, &other.part[SIGMA]));
        TEST_ASSERT_EQUAL_UINT32(!is_late, bench.assembly.incomplete);
    }
}

static void test_fd_answers_begin_anew_when_the_source_of_samples_restarts(void) {
    const uint32_t restart[3] = {0, 1000, 5000}; // 1000: the tick that was just being answered
    for (int n = 0; n < 3; n++) {
        bench_t bench = started(HEXLOAD_BUS_FD);
        const fd_t old = fd_frames(1000);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_PARTIAL, add(&bench, &old.part[ESTIMATE]));
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_PARTIAL, add(&bench, &old.part[SIGMA]));
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, add_fd_answer(&bench, restart[n]));
        assert_answer(&bench, restart[n]);
        TEST_ASSERT_EQUAL_UINT32(1, bench.assembly.incomplete);
    }
}

static void test_a_round_of_pages_makes_an_answer_of_the_tick_of_the_first(void) {
    bench_t bench = started(HEXLOAD_BUS_CLASSIC);
    // over the end of 14 and of 32 bits
    const uint32_t ticks = round_ticks();
    for (uint32_t first_tick = UINT32_MAX - ticks * 3000 + 1; first_tick != ticks * 10; first_tick += ticks) {
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, add_pages(&bench, first_tick, 0, pages() - 1));
        assert_answer(&bench, first_tick);
    }
    TEST_ASSERT_EQUAL_UINT32(0, bench.assembly.incomplete);
}

static void test_the_fourteen_bits_of_a_page_are_completed_with_the_nearest_tick(void) {
    const struct {
        uint32_t near, sent;
    } cases[] = {{0x0001FFFE, 0x00020002}, {0x00020002, 0x0001FFFE}, {0x00011FFE, 0x00010000},
                 {0x00010000, 0x00011FFE}, {0x00000002, 0xFFFFFFFE}, {0xFFFFFFFE, 0x00000002}};
    for (int n = 0; n < 6; n++) {
        bench_t bench = started(HEXLOAD_BUS_CLASSIC);
        const hexload_bus_frame_t frame = page_frame(cases[n].sent, 0);
        bench.near_tick = cases[n].near;
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_PARTIAL, add(&bench, &frame));
        TEST_ASSERT_EQUAL_HEX32(cases[n].sent, bench.answered_tick);
    }
}

static void test_pages_before_the_first_page_0_answer_samples_but_make_no_answer(void) {
    bench_t bench = started(HEXLOAD_BUS_CLASSIC);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_PARTIAL, add_pages(&bench, 100, 5, pages() - 1));
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, add_pages(&bench, 200, 0, pages() - 1));
    assert_answer(&bench, 200);
    TEST_ASSERT_EQUAL_UINT32(0, bench.assembly.incomplete);
}

static void test_a_lost_page_costs_its_answer_only(void) {
    for (int missing = 0; missing < pages(); missing++) {
        bench_t bench = started(HEXLOAD_BUS_CLASSIC);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, add_pages(&bench, 0, 0, pages() - 1));
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_PARTIAL, add_pages(&bench, round_ticks(), 0, missing - 1));
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_PARTIAL,
                              add_pages(&bench, round_ticks(), missing + 1, pages() - 1));
        assert_answer(&bench, 0);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, add_pages(&bench, 2 * round_ticks(), 0, pages() - 1));
        assert_answer(&bench, 2 * round_ticks());
        // page 0 missing: nothing had begun
        TEST_ASSERT_EQUAL_UINT32(missing > 0, bench.assembly.incomplete);
    }
}

static void test_a_whole_lost_round_does_not_join_two_answers(void) {
    // GIVEN an answer whose first half has come
    bench_t bench = started(HEXLOAD_BUS_CLASSIC);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_PARTIAL, add_pages(&bench, 0, 0, 5));
    // WHEN as many pages are lost as one answer has, and the seventh of the next answer follows
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_PARTIAL, add_pages(&bench, round_ticks(), 6, pages() - 1));
    // THEN no answer comes out of the two halves
    TEST_ASSERT_EQUAL_UINT32(12345, bench.answer.tick);
    TEST_ASSERT_EQUAL_UINT32(1, bench.assembly.incomplete);
}

static void test_pages_belong_together_for_as_long_as_a_round_takes(void) {
    for (uint32_t late = 0; late <= HEXLOAD_BUS_ANSWER_PERIOD; late += HEXLOAD_BUS_ANSWER_PERIOD) {
        // GIVEN the first page of an answer WHEN the second comes as many ticks later as a round takes THEN
        // they belong together; of later ones that is not known
        bench_t bench = started(HEXLOAD_BUS_CLASSIC);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_PARTIAL, add_pages(&bench, 0, 0, 0));
        const uint32_t first_tick = round_ticks() - HEXLOAD_BUS_ANSWER_PERIOD + late;
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_PARTIAL, add_pages(&bench, first_tick, 1, 1));
        TEST_ASSERT_EQUAL_UINT32(late == 0 ? 3 : 0, bench.assembly.parts);
        TEST_ASSERT_EQUAL_UINT32(late != 0, bench.assembly.incomplete);
    }
}

static void test_late_and_doubled_pages_are_refused(void) {
    bench_t bench = started(HEXLOAD_BUS_CLASSIC);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_PARTIAL, add_pages(&bench, 0, 0, 6));
    for (int page = 1; page <= 6; page++) {
        const hexload_bus_frame_t again = page_frame(0, page);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_TICK, add(&bench, &again));
    }
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, add_pages(&bench, 0, 7, pages() - 1));
    assert_answer(&bench, 0);
    const hexload_bus_frame_t last = page_frame(0, pages() - 1);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_TICK, add(&bench, &last));
    TEST_ASSERT_EQUAL_UINT32(0, bench.assembly.incomplete);
}

static void test_pages_are_ahead_by_one_tick_to_half_of_all(void) {
    // GIVEN the first page of an answer WHEN the next one comes so many ticks ahead THEN it is late when
    // these are none or more than half of all, and otherwise lost ones are between them
    static const struct {
        uint32_t ahead;
        hexload_bus_status_t expected;
    } cases[] = {{0, HEXLOAD_BUS_ERR_TICK},
                 {UINT32_MAX / 2, HEXLOAD_BUS_PARTIAL},
                 {UINT32_MAX / 2 + 1, HEXLOAD_BUS_ERR_TICK}};
    for (size_t n = 0; n < sizeof cases / sizeof cases[0]; n++) {
        bench_t bench = started(HEXLOAD_BUS_CLASSIC);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_PARTIAL, add_pages(&bench, 100, 0, 0));
        bench.near_tick = 100 + cases[n].ahead;
        const hexload_bus_frame_t page = page_frame(bench.near_tick - HEXLOAD_BUS_ANSWER_PERIOD, 1);
        TEST_ASSERT_EQUAL_INT(cases[n].expected, add(&bench, &page));
        TEST_ASSERT_EQUAL_UINT32(cases[n].expected == HEXLOAD_BUS_PARTIAL, bench.assembly.incomplete);
    }
    // AND none is late when no answer has begun
    bench_t bench = started(HEXLOAD_BUS_CLASSIC);
    const hexload_bus_frame_t page = page_frame(0u - HEXLOAD_BUS_ANSWER_PERIOD, 1); // of tick 0
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_PARTIAL, add(&bench, &page));
}

static void test_a_page_0_begins_anew_at_any_time(void) {
    bench_t bench = started(HEXLOAD_BUS_CLASSIC);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_PARTIAL, add_pages(&bench, 500, 0, 8));
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, add_pages(&bench, 0, 0, pages() - 1));
    assert_answer(&bench, 0);
    TEST_ASSERT_EQUAL_UINT32(1, bench.assembly.incomplete);
}

static void test_each_flipped_bit_of_an_answer_is_detected(void) {
    bench_t fd = started(HEXLOAD_BUS_FD), classic = started(HEXLOAD_BUS_CLASSIC);
    fd_t frames = fd_frames(3);
    for (int part = ESTIMATE; part <= HEALTH; part++) {
        hexload_bus_frame_t* frame = &frames.part[part];
        for (int bit = 0; bit < frame->length * 8; bit++) {
            frame->data[bit / 8] ^= (uint8_t)(1u << (bit % 8));
            TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_CRC, add(&fd, frame));
            frame->data[bit / 8] ^= (uint8_t)(1u << (bit % 8));
        }
    }
    for (int page = 0; page < pages(); page++) {
        hexload_bus_frame_t frame = page_frame(0, page);
        for (int bit = 0; bit < 64; bit++) {
            frame.data[bit / 8] ^= (uint8_t)(1u << (bit % 8));
            TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_CRC, add(&classic, &frame));
            frame.data[bit / 8] ^= (uint8_t)(1u << (bit % 8));
        }
    }
    TEST_ASSERT_EQUAL_HEX32(0, fd.assembly.parts | classic.assembly.parts);
}

/// Overwrites bytes, seals, and expects the frame to be refused for its value.
static void assert_refused(bench_t* bench, hexload_bus_frame_t frame, int first, int count, uint32_t value) {
    for (int n = 0; n < count; n++) {
        frame.data[first + n] = (uint8_t)(value >> (8 * n));
    }
    seal(&frame);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_VALUE, add(bench, &frame));
}

static void test_unknown_codes_and_numbers_that_are_not_finite_are_refused(void) {
    bench_t fd = started(HEXLOAD_BUS_FD), classic = started(HEXLOAD_BUS_CLASSIC);
    const fd_t frames = fd_frames(3);
    const uint32_t nan_bits = 0x7FC00000u, infinity_bits = 0xFF800000u;
    const int parameters = parameters_of(filter);
    for (int part = ESTIMATE; part <= SIGMA; part++) {
        for (int number = 0; number <= parameters; number++) { // and the NIS after them
            assert_refused(&fd, frames.part[part], 8 + 4 * number, 4, nan_bits);
            assert_refused(&fd, frames.part[part], 8 + 4 * number, 4, infinity_bits);
        }
    }
    const uint32_t beyond[4] = {1, 5, 8, 5}; // status, state, fault, verdict
    for (int code = 0; code < 4 + parameters; code++) {
        assert_refused(&fd, frames.part[HEALTH], 4 + code, 1, code < 4 ? beyond[code] : 5);
    }
    assert_refused(&fd, frames.part[HEALTH], 19, 1, 2);        // filter
    assert_refused(&classic, page_frame(0, 0), 3, 1, 34 << 2); // page
    assert_refused(&classic, page_frame(0, 0), 1, 1, 0x01);    // counter
    assert_refused(&classic, page_frame(0, 0), 6, 1, 0x05);    // state
    assert_refused(&classic, page_frame(0, 0), 6, 1, 0x50);    // verdict
    assert_refused(&classic, page_frame(0, 0), 7, 1, 0x08);    // fault
    assert_refused(&classic, page_frame(0, 0), 7, 1, 0x20);    // filter
    for (int page = 1; page <= 2 * parameters + 2; page++) {   // values, sigmas, NIS and its mean
        assert_refused(&classic, page_frame(0, page), 4, 4, nan_bits);
    }
    const int verdicts = filter == HEXLOAD_FILTER_MOMENTUM ? 25 : 11;
    const int bits = filter == HEXLOAD_FILTER_MOMENTUM ? 3 : 4; // of each
    for (int n = 0; n < parameters; n++) {
        assert_refused(&classic, page_frame(0, verdicts), 4, 4, UINT32_C(5) << (bits * n));
    }
    assert_refused(&classic, page_frame(0, 2 * parameters + 3), 6, 1, 0xFA); // status -6
    TEST_ASSERT_EQUAL_HEX32(0, fd.assembly.parts | classic.assembly.parts);
}

/// With -1 for the number at a place.
static hexload_bus_status_t add_minus_one(hexload_bus_frame_t frame, int first) {
    bench_t bench = started(frame.is_fd ? HEXLOAD_BUS_FD : HEXLOAD_BUS_CLASSIC);
    const uint8_t minus_one[4] = {0x00, 0x00, 0x80, 0xBF};
    memcpy(&frame.data[first], minus_one, sizeof minus_one);
    seal(&frame);
    return add(&bench, &frame);
}

static void test_sigmas_nis_and_the_papers_inertias_are_refused_below_zero(void) {
    const fd_t frames = fd_frames(3);
    const int parameters = parameters_of(filter);
    const int signed_count = filter == HEXLOAD_FILTER_MOMENTUM ? 10 : 1; // the paper's height alone
    for (int k = 0; k <= parameters; k++) {                              // and the NIS after them
        // GIVEN an answer WHEN one of its numbers is -1 THEN it is refused, unless it may be
        const hexload_bus_status_t expected = k < signed_count ? HEXLOAD_BUS_PARTIAL : HEXLOAD_BUS_ERR_VALUE;
        TEST_ASSERT_EQUAL_INT(expected, add_minus_one(frames.part[ESTIMATE], 8 + 4 * k));
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_VALUE, add_minus_one(frames.part[SIGMA], 8 + 4 * k));
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_VALUE, add_minus_one(page_frame(0, parameters + 1 + k), 4));
        if (k < parameters) {
            TEST_ASSERT_EQUAL_INT(expected, add_minus_one(page_frame(0, 1 + k), 4));
        }
    }
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_VALUE, add_minus_one(page_frame(0, 2 * parameters + 2), 4));
}

static void test_answers_of_the_other_profile_are_distinguished_from_strange_frames(void) {
    bench_t fd = started(HEXLOAD_BUS_FD), classic = started(HEXLOAD_BUS_CLASSIC);
    fd_t frames = fd_frames(3);
    hexload_bus_frame_t page = page_frame(0, 3);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_PROFILE, add(&fd, &page));
    page.length = 7;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_LENGTH, add(&fd, &page));
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_LENGTH, add(&classic, &page));
    for (int part = ESTIMATE; part <= HEALTH; part++) {
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_PROFILE, add(&classic, &frames.part[part]));
        frames.part[part].data[9] ^= 1; // a damaged one is nobody's
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_CRC, add(&classic, &frames.part[part]));
        frames.part[part].length = 24; // none of the answer's frames has that
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_LENGTH, add(&classic, &frames.part[part]));
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_LENGTH, add(&fd, &frames.part[part]));
    }
    for (page.id = 0; page.id < 0x800; page.id++) {
        if (page.id < ID_ESTIMATE_FD || page.id > ID_LOAD_SIGMA_FD) {
            TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OTHER, add(&fd, &page));
            TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OTHER, add(&classic, &page));
        }
    }
}

static void test_among_losses_and_garbage_no_answer_mixes_ticks(void) {
    uint64_t seed = 5;
    bench_t fd = started(HEXLOAD_BUS_FD), classic = started(HEXLOAD_BUS_CLASSIC);
    const uint32_t ticks = round_ticks(), rounds = 800;
    int whole[2] = {0};
    for (uint32_t tick = 0; tick < ticks * rounds; tick++) {
        // GIVEN random frames, sealed or not; one that a controller might have sent would need a forger
        hexload_bus_frame_t garbage = random_frame(&seed);
        if (garbage.id < ID_ESTIMATE_FD || garbage.id > ID_LOAD_SIGMA_FD || garbage.length % 8 != 0) {
            TEST_ASSERT_NOT_EQUAL(HEXLOAD_BUS_OK, add(&fd, &garbage));
            TEST_ASSERT_NOT_EQUAL(HEXLOAD_BUS_OK, add(&classic, &garbage));
        }
        fd.near_tick = classic.near_tick = tick;
        // WHEN frames get lost now and then THEN every answer that comes out is of one tick
        const fd_t frames = fd_frames(tick);
        for (int part = ESTIMATE; part <= HEALTH; part++) {
            if (uniform(&seed) < 0.95 && add(&fd, &frames.part[part]) == HEXLOAD_BUS_OK) {
                assert_answer(&fd, tick);
                whole[0]++;
            }
        }
        if (tick % HEXLOAD_BUS_ANSWER_PERIOD == 0 && uniform(&seed) < 0.95) {
            const hexload_bus_frame_t page = page_frame(tick - tick % ticks, (int)(tick % ticks / 2));
            if (add(&classic, &page) == HEXLOAD_BUS_OK) {
                assert_answer(&classic, tick - tick % ticks);
                whole[1]++;
            }
        }
    }
    // uniform() is below 0.95 in 97.5 % of all cases; five sigmas less than expected of both
    const double fd_expected = pow(0.975, 3) * ticks * rounds, page_expected = pow(0.975, pages()) * rounds;
    TEST_ASSERT_GREATER_THAN_INT((int)(fd_expected - 5 * sqrt(fd_expected)), whole[0]);
    TEST_ASSERT_GREATER_THAN_INT((int)(page_expected - 5 * sqrt(page_expected)), whole[1]);
}

static void test_frames_of_two_filters_make_no_answer(void) {
    // GIVEN frames of one tick, of either filter
    bench_t bench = started(HEXLOAD_BUS_FD);
    const fd_t own = fd_frames(8);
    const hexload_bus_answer_t answer = numbered_answer((uint8_t)(1 - filter), 8);
    fd_t others;
    encode_answer(HEXLOAD_BUS_FD, &answer, 0, others.part);
    // WHEN they are mixed THEN those of the filter that did not begin are refused
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_PARTIAL, add(&bench, &own.part[ESTIMATE]));
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_VALUE, add(&bench, &others.part[SIGMA]));
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_VALUE, add(&bench, &others.part[HEALTH]));
    // and the others still make their answer
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_PARTIAL, add(&bench, &own.part[SIGMA]));
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, add(&bench, &own.part[HEALTH]));
    assert_answer(&bench, 8);
}

static void test_a_page_of_the_other_filters_round_ends_the_answer(void) {
    bench_t bench = started(HEXLOAD_BUS_CLASSIC);
    hexload_bus_answer_t answer = numbered_answer((uint8_t)(1 - filter), 0);
    hexload_bus_frame_t frames[HEXLOAD_BUS_ANSWER_FRAMES];
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_PARTIAL, add_pages(&bench, 0, 0, 1));
    answer.tick = 4;
    encode_answer(HEXLOAD_BUS_CLASSIC, &answer, 2, frames);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_PARTIAL, add(&bench, &frames[0]));
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_PARTIAL, add_pages(&bench, 2, 2, pages() - 1));
    TEST_ASSERT_EQUAL_UINT32(12345, bench.answer.tick);
    TEST_ASSERT_EQUAL_UINT32(1, bench.assembly.incomplete);
}

static void test_a_page_has_its_place_in_the_rounds_of_its_filter_and_none_in_others(void) {
    // GIVEN an answer of a filter and the pages of either filter's round WHEN one is read THEN its place is
    // that in the round; of pages that the answer's rounds have not, -1
    for (int place = 1; place < pages(); place++) {
        for (int other = 0; other < 2; other++) {
            const hexload_bus_frame_t frame = page_frame(0, place);
            hexload_bus_answer_t answer = {.filter = other ? (uint8_t)(1 - filter) : filter};
            int found = 99;
            uint16_t tick_low = 0;
            TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK,
                                  hexload_answer_decode_page(&frame, &found, &tick_low, &answer));
            TEST_ASSERT_EQUAL_UINT16(HEXLOAD_BUS_ANSWER_PERIOD * place, tick_low);
            const int nis = pages() - (filter == HEXLOAD_FILTER_MOMENTUM ? 5 : 4); // and the three after it
            const bool is_shared = place >= nis && place < nis + 4;
            const int place_in_other = place - nis + (filter == HEXLOAD_FILTER_MOMENTUM ? 9 : 21);
            TEST_ASSERT_EQUAL_INT(other == 0 ? place : is_shared ? place_in_other : -1, found);
        }
    }
}

static void test_a_page_of_the_other_filters_round_after_a_whole_answer_costs_nothing(void) {
    // GIVEN a whole answer WHEN a page comes that only the other filter's rounds have, and the next round
    bench_t bench = started(HEXLOAD_BUS_CLASSIC);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, add_pages(&bench, 0, 0, pages() - 1));
    const uint32_t next_tick = round_ticks();
    filter = (uint8_t)(1 - filter);
    const hexload_bus_frame_t page = page_frame(next_tick, 1);
    filter = (uint8_t)(1 - filter);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_PARTIAL, add(&bench, &page));
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, add_pages(&bench, 200, 0, pages() - 1));
    // THEN no answer was given up
    assert_answer(&bench, 200);
    TEST_ASSERT_EQUAL_UINT32(0, bench.assembly.incomplete);
}

static void test_answers_of_the_two_filters_may_follow_one_another(void) {
    bench_t fd = started(HEXLOAD_BUS_FD), classic = started(HEXLOAD_BUS_CLASSIC);
    for (uint32_t tick = 0; tick < 300; tick += 100) {
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, add_fd_answer(&fd, tick));
        assert_answer(&fd, tick);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_OK, add_pages(&classic, tick, 0, pages() - 1));
        assert_answer(&classic, tick);
        filter = (uint8_t)(1 - filter);
    }
    filter = (uint8_t)(1 - filter); // as it was
    TEST_ASSERT_EQUAL_UINT32(0, fd.assembly.incomplete + classic.assembly.incomplete);
}

int main(void) {
    UNITY_BEGIN();
    for (filter = HEXLOAD_FILTER_PAPER; filter <= HEXLOAD_FILTER_MOMENTUM; filter++) {
        RUN_TEST(test_estimate_sigma_and_health_of_a_tick_make_an_answer);
        RUN_TEST(test_an_fd_answer_without_one_of_its_frames_is_given_up);
        RUN_TEST(test_the_frames_of_an_fd_answer_come_in_any_order);
        RUN_TEST(test_late_and_doubled_fd_frames_are_refused);
        RUN_TEST(test_half_of_all_ticks_are_ahead_and_half_are_late);
        RUN_TEST(test_fd_answers_begin_anew_when_the_source_of_samples_restarts);
        RUN_TEST(test_a_round_of_pages_makes_an_answer_of_the_tick_of_the_first);
        RUN_TEST(test_the_fourteen_bits_of_a_page_are_completed_with_the_nearest_tick);
        RUN_TEST(test_pages_before_the_first_page_0_answer_samples_but_make_no_answer);
        RUN_TEST(test_a_lost_page_costs_its_answer_only);
        RUN_TEST(test_a_whole_lost_round_does_not_join_two_answers);
        RUN_TEST(test_pages_belong_together_for_as_long_as_a_round_takes);
        RUN_TEST(test_late_and_doubled_pages_are_refused);
        RUN_TEST(test_pages_are_ahead_by_one_tick_to_half_of_all);
        RUN_TEST(test_a_page_0_begins_anew_at_any_time);
        RUN_TEST(test_each_flipped_bit_of_an_answer_is_detected);
        RUN_TEST(test_unknown_codes_and_numbers_that_are_not_finite_are_refused);
        RUN_TEST(test_sigmas_nis_and_the_papers_inertias_are_refused_below_zero);
        RUN_TEST(test_answers_of_the_other_profile_are_distinguished_from_strange_frames);
        RUN_TEST(test_among_losses_and_garbage_no_answer_mixes_ticks);
        RUN_TEST(test_frames_of_two_filters_make_no_answer);
        RUN_TEST(test_a_page_of_the_other_filters_round_ends_the_answer);
        RUN_TEST(test_a_page_has_its_place_in_the_rounds_of_its_filter_and_none_in_others);
        RUN_TEST(test_a_page_of_the_other_filters_round_after_a_whole_answer_costs_nothing);
        RUN_TEST(test_answers_of_the_two_filters_may_follow_one_another);
    }
    return UNITY_END();
}
