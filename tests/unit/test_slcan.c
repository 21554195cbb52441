#include "frames.h"

#include "bus/slcan.h"

#include <stddef.h>
#include <string.h>

void setUp(void) {}
void tearDown(void) {}

/// The lines that a text gives, each a frame or a count.
typedef struct reading {
    hexload_slcan_t slcan;
    hexload_bus_frame_t frame; ///< last
    int frames;
} reading_t;

static void read_bytes(reading_t* reading, const char* bytes, size_t count) {
    for (size_t n = 0; n < count; n++) {
        reading->frames += hexload_slcan_take(&reading->slcan, bytes[n], &reading->frame) ? 1 : 0;
    }
}

static reading_t read_text(const char* text) {
    reading_t reading = {0};
    hexload_slcan_init(&reading.slcan);
    read_bytes(&reading, text, strlen(text));
    return reading;
}

static void assert_counts(const reading_t* reading, int frames, uint32_t passed_over, uint32_t dropped,
                          uint32_t refusals) {
    TEST_ASSERT_EQUAL_INT(frames, reading->frames);
    TEST_ASSERT_EQUAL_UINT32(passed_over, reading->slcan.passed_over);
    TEST_ASSERT_EQUAL_UINT32(dropped, reading->slcan.dropped);
    TEST_ASSERT_EQUAL_UINT32(refusals, reading->slcan.refusals);
}

static void assert_same_frame(const hexload_bus_frame_t* expected, const hexload_bus_frame_t* found) {
    TEST_ASSERT_EQUAL_HEX32(expected->id, found->id);
    TEST_ASSERT_EQUAL(expected->is_fd, found->is_fd);
    TEST_ASSERT_EQUAL_UINT8(expected->length, found->length);
    for (int n = 0; n < expected->length; n++) {
        TEST_ASSERT_EQUAL_HEX8(expected->data[n], found->data[n]);
    }
}

/// A frame that the format can carry.
static hexload_bus_frame_t classic_frame(uint64_t* seed) {
    hexload_bus_frame_t frame = {.id = (uint32_t)((uniform(seed) + 1.0) * 1023.5),
                                 .length = (uint8_t)((uniform(seed) + 1.0) * 4.49)};
    for (int n = 0; n < frame.length; n++) {
        frame.data[n] = (uint8_t)((uniform(seed) + 1.0) * 127.9);
    }
    return frame;
}

static void test_a_frame_is_written_as_in_the_manual(void) {
    // GIVEN the manual's example, and a frame with all digits WHEN they are written
    const hexload_bus_frame_t frames[] = {
        {.id = 0x100, .length = 2, .data = {0x11, 0x33}},
        {.id = 0x7AB, .length = 8, .data = {0x01, 0x23, 0x45, 0x67, 0x89, 0xAB, 0xCD, 0xEF}},
        {.id = 0, .length = 0},
        {.id = 0x7FF, .length = 0},
    };
    const char* const texts[] = {"t10021133\r", "t7AB80123456789ABCDEF\r", "t0000\r", "t7FF0\r"};
    for (int n = 0; n < 4; n++) {
        char text[HEXLOAD_SLCAN_FRAME_BYTES + 1] = {0};
        // THEN the text is the manual's, and is read as that frame
        TEST_ASSERT_EQUAL_INT((int)strlen(texts[n]), hexload_slcan_encode(&frames[n], text));
        TEST_ASSERT_EQUAL_STRING(texts[n], text);
        const reading_t reading = read_text(texts[n]);
        assert_counts(&reading, 1, 0, 0, 0);
        assert_same_frame(&frames[n], &reading.frame);
    }
}

static void test_every_frame_comes_back(void) {
    // GIVEN random frames of all lengths
    uint64_t seed = 4;
    uint32_t lengths = 0;
    hexload_slcan_t slcan;
    hexload_slcan_init(&slcan);
    for (int n = 0; n < 2000; n++) {
        const hexload_bus_frame_t frame = classic_frame(&seed);
        char text[HEXLOAD_SLCAN_FRAME_BYTES];
        const int count = hexload_slcan_encode(&frame, text);
        // WHEN one is written and read THEN the last byte gives it, and none before does
        for (int k = 0; k < count; k++) {
            hexload_bus_frame_t found = {.id = 0xFFF};
            TEST_ASSERT_EQUAL(k == count - 1, hexload_slcan_take(&slcan, text[k], &found));
            if (k == count - 1) {
                assert_same_frame(&frame, &found);
            } else {
                TEST_ASSERT_EQUAL_HEX32(0xFFF, found.id);
            }
        }
        lengths |= 1U << frame.length;
    }
    TEST_ASSERT_EQUAL_HEX32(0x1FF, lengths);
    TEST_ASSERT_EQUAL_UINT32(0, slcan.passed_over + slcan.dropped + slcan.refusals);
}

static void test_a_frame_that_the_format_cannot_carry_is_refused(void) {
    // GIVEN an FD frame, one that is too long, and one whose identifier is WHEN they are written
    const hexload_bus_frame_t fd = {.id = 1, .is_fd = true, .length = 8};
    const hexload_bus_frame_t longer = {.id = 1, .length = 9};
    const hexload_bus_frame_t extended = {.id = 0x800, .length = 8};
    char text[HEXLOAD_SLCAN_FRAME_BYTES] = "unchanged";
    // THEN they are refused, and nothing is written
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_LENGTH, hexload_slcan_encode(&fd, text));
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_LENGTH, hexload_slcan_encode(&longer, text));
    TEST_ASSERT_EQUAL_INT(HEXLOAD_BUS_ERR_VALUE, hexload_slcan_encode(&extended, text));
    TEST_ASSERT_EQUAL_STRING("unchanged", text);
}

static void test_small_digits_and_an_adapters_time_are_read(void) {
    // GIVEN a frame in small digits, and one with the milliseconds that an adapter appends WHEN they are read
    const hexload_bus_frame_t frame = {.id = 0x7AB, .length = 2, .data = {0xCD, 0xEF}};
    const reading_t small = read_text("t7ab2cdef\r");
    const reading_t timed = read_text("t7AB2CDEF5A0b\r");
    // THEN they are the frame
    assert_counts(&small, 1, 0, 0, 0);
    assert_same_frame(&frame, &small.frame);
    assert_counts(&timed, 1, 0, 0, 0);
    assert_same_frame(&frame, &timed.frame);
    // AND so is the longest line that there is: eight bytes and a time
    const hexload_bus_frame_t whole = {.id = 0x7AB, .length = 8, .data = {1, 2, 3, 4, 5, 6, 7, 8}};
    const reading_t longest = read_text("t7AB801020304050607085A0b\r");
    assert_counts(&longest, 1, 0, 0, 0);
    assert_same_frame(&whole, &longest.frame);
}

static void test_lines_without_a_frame_of_ours_are_passed_over(void) {
    // GIVEN commands, answers to them, extended, remote and FD frames, the longest that there is WHEN they
    // are read
    char longest[160] = "B1FFFFFFFF";
    memset(&longest[10], '5', 128);
    longest[138] = '\r';
    const char* const lines[] = {
        "\r",           "O\r",     "C\r",         "L\r",  "S8\r", "s031C\r",          "V1013\r",
        "N1234\r",      "F00\r",   "Z1\r",        "z\r",  "Y2\r", "T1234567821133\r", "r1002\r",
        "R123456780\r", "d1009\r", "b10021133\r", longest};
    for (size_t n = 0; n < sizeof lines / sizeof lines[0]; n++) {
        const reading_t reading = read_text(lines[n]);
        // THEN they are passed over
        assert_counts(&reading, 0, 1, 0, 0);
    }
    // and the next line is read, which a bell does not prevent either
    const reading_t after = read_text("C\rS8\rO\r\r\at10021133\r\r");
    assert_counts(&after, 1, 5, 0, 1);
}

static void test_garbage_is_dropped_and_the_next_line_is_read(void) {
    // GIVEN lines that are damaged in one way each
    const char* const lines[] = {
        "t\r",
        "t100\r",
        "t1002113\r",
        "t100211333\r",
        "t10021g33\r",
        "t8002ABCD\r",
        "tx002ABCD\r",
        "t1009\r",
        "t100A\r",
        "t10021133123\r",
        "t1002113312345\r",
        "t10021133123x\r",
        "t10080011223344556677889900\r",
        "t1009112233445566778899\r",
        "?\r",
        "\n\r",
        "0100\r",
        "\x80t10021133\r",
        "t100\a",
        "t\a",
    };
    for (size_t n = 0; n < sizeof lines / sizeof lines[0]; n++) {
        // WHEN one is read, and a good line after it
        reading_t reading = read_text(lines[n]);
        TEST_ASSERT_EQUAL_INT_MESSAGE(0, reading.frames, lines[n]);
        TEST_ASSERT_EQUAL_UINT32_MESSAGE(1, reading.slcan.dropped, lines[n]);
        TEST_ASSERT_EQUAL_UINT32_MESSAGE(0, reading.slcan.passed_over, lines[n]);
        // THEN it is counted, and the next one is a frame
        read_bytes(&reading, "t10021133\r", 10);
        TEST_ASSERT_EQUAL_INT_MESSAGE(1, reading.frames, lines[n]);
    }
    // A zero byte is no letter either.
    reading_t zero = read_text("");
    read_bytes(&zero, "\0\r", 2);
    assert_counts(&zero, 0, 0, 1, 0);
}

static void test_a_line_without_end_is_dropped_once(void) {
    // GIVEN a frame's beginning that goes on for longer than any counter of a line holds
    reading_t reading = read_text("t1008");
    for (int n = 0; n < 70000; n++) {
        read_bytes(&reading, "0", 1);
    }
    assert_counts(&reading, 0, 0, 0, 0);
    // WHEN it ends THEN it is dropped, and the next line is read
    read_bytes(&reading, "\rt10021133\r", 11);
    assert_counts(&reading, 1, 0, 1, 0);
}

static void test_nothing_is_written_behind_the_longest_line(void) {
    // GIVEN a line that is full WHEN it goes on THEN the memory behind it stays as it is
    reading_t reading = read_text("t100800112233445566770123");
    TEST_ASSERT_EQUAL_UINT8(HEXLOAD_SLCAN_LINE_BYTES, reading.slcan.length);
    uint8_t* behind = (uint8_t*)&reading.slcan + offsetof(hexload_slcan_t, line) + HEXLOAD_SLCAN_LINE_BYTES;
    *behind = 0x5A;
    read_bytes(&reading, "4", 1);
    TEST_ASSERT_EQUAL_HEX8(0x5A, *behind);
}

static void test_random_bytes_give_no_frame_that_could_not_be_sent(void) {
    // GIVEN bytes that are random, and often of the format's alphabet
    static const char alphabet[] = "ttt000000001122357AF\r\r\r\aTr";
    uint64_t seed = 11;
    reading_t reading = read_text("");
    uint32_t ends = 0;
    for (int n = 0; n < 2000000; n++) {
        const double number = uniform(&seed);
        const char byte = number < -0.98
                              ? (char)(uint8_t)((uniform(&seed) + 1.0) * 127.9)
                              : alphabet[(size_t)((uniform(&seed) + 1.0) * 0.4999 * (sizeof alphabet - 1))];
        const int before = reading.frames;
        // WHEN they are read
        read_bytes(&reading, &byte, 1);
        ends += byte == '\r' ? 1U : 0U;
        if (reading.frames > before) {
            // THEN each frame is one that can be written
            char text[HEXLOAD_SLCAN_FRAME_BYTES];
            TEST_ASSERT_GREATER_OR_EQUAL_INT(6, hexload_slcan_encode(&reading.frame, text));
        }
    }
    // and each end of a line is accounted for: a bell ends one as well, of which the dropped ones are counted
    // twice
    TEST_ASSERT_GREATER_THAN_INT(20, reading.frames);
    const uint32_t told = (uint32_t)reading.frames + reading.slcan.passed_over + reading.slcan.dropped;
    TEST_ASSERT_GREATER_OR_EQUAL_UINT32(ends, told);
    TEST_ASSERT_LESS_OR_EQUAL_UINT32(ends + reading.slcan.refusals, told);
    read_bytes(&reading, "\rt10021133\r", 11);
    TEST_ASSERT_EQUAL_HEX32(0x100, reading.frame.id);
    TEST_ASSERT_EQUAL_UINT8(2, reading.frame.length);
}

static void test_counters_stay_at_their_end(void) {
    // GIVEN counters at their end WHEN there is more to count THEN they stay there
    reading_t reading = read_text("");
    reading.slcan.passed_over = UINT32_MAX;
    reading.slcan.dropped = UINT32_MAX;
    reading.slcan.refusals = UINT32_MAX;
    read_bytes(&reading, "O\r?\r\a", 5);
    assert_counts(&reading, 0, UINT32_MAX, UINT32_MAX, UINT32_MAX);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_frame_is_written_as_in_the_manual);
    RUN_TEST(test_every_frame_comes_back);
    RUN_TEST(test_a_frame_that_the_format_cannot_carry_is_refused);
    RUN_TEST(test_small_digits_and_an_adapters_time_are_read);
    RUN_TEST(test_lines_without_a_frame_of_ours_are_passed_over);
    RUN_TEST(test_garbage_is_dropped_and_the_next_line_is_read);
    RUN_TEST(test_a_line_without_end_is_dropped_once);
    RUN_TEST(test_nothing_is_written_behind_the_longest_line);
    RUN_TEST(test_random_bytes_give_no_frame_that_could_not_be_sent);
    RUN_TEST(test_counters_stay_at_their_end);
    return UNITY_END();
}
