// The CAN driver of the port zynqmp_r5, on registers that are plain memory, and both layouts of its FIFO
// words.
#include "can.h"
#include "message_words.h"

#include <string.h>

#include <unity.h>

enum { SRR = 0, SR = 6, ISR = 7, ICR = 9, TXFIFO = 12, RXFIFO = 20, REGISTERS = 40 };
enum {
    ENABLED = 2,
    IN_RESET = 1,
    TX_FULL = 1 << 10,
    RX_OVERFLOW = 1 << 6,
    RX_NOT_EMPTY = 1 << 7,
    BUS_OFF = 1 << 9
};

static uint32_t registers[REGISTERS];
static can_t can;

void setUp(void) {
    memset(registers, 0, sizeof registers);
    can_start(&can, registers);
}

void tearDown(void) {}

static hexload_bus_frame_t page(uint8_t length) {
    return (hexload_bus_frame_t){.id = 0x104, .length = length, .data = {1, 2, 3, 4, 5, 6, 7, 8}};
}

typedef struct layout {
    void (*pack)(const hexload_bus_frame_t* frame, message_words_t* words);
    bool (*unpack)(const message_words_t* words, hexload_bus_frame_t* frame);
    message_words_t expected; // of page(8)
    uint32_t extended;
    uint32_t remote;
} layout_t;

static const layout_t layouts[] = {
    {message_words_pack_silicon,
     message_words_unpack_silicon,
     {0x104u << 21, 8u << 28, {0x01020304, 0x05060708}},
     1u << 19,
     1u << 20},
    {message_words_pack_emulated,
     message_words_unpack_emulated,
     {0x104, 8u << 28, {0x04030201, 0x08070605}},
     1u << 31,
     1u << 30},
};
enum { LAYOUTS = sizeof layouts / sizeof layouts[0] };

static void test_words_are_those_of_the_manual(void) {
    // GIVEN a frame of eight bytes WHEN it is packed THEN each word is as the layout's source says
    const hexload_bus_frame_t frame = page(8);
    for (int n = 0; n < LAYOUTS; n++) {
        message_words_t words;
        layouts[n].pack(&frame, &words);
        TEST_ASSERT_EQUAL_HEX32(layouts[n].expected.id, words.id);
        TEST_ASSERT_EQUAL_HEX32(layouts[n].expected.dlc, words.dlc);
        TEST_ASSERT_EQUAL_HEX32_ARRAY(layouts[n].expected.data, words.data, 2);
    }
}

static void test_a_frame_of_each_length_comes_back(void) {
    // GIVEN frames of each length, and whatever was in memory before
    for (uint8_t length = 0; length <= 8; length++) {
        hexload_bus_frame_t frame = page(length);
        memset(&frame.data[length], 0, sizeof frame.data - length);
        for (int n = 0; n < LAYOUTS; n++) {
            message_words_t words;
            hexload_bus_frame_t found;
            memset(&found, 0xEE, sizeof found);
            // WHEN they are packed and unpacked, with a time stamp beside the length THEN they are the same
            layouts[n].pack(&frame, &words);
            words.dlc |= 0xBEEF;
            TEST_ASSERT_TRUE(layouts[n].unpack(&words, &found));
            TEST_ASSERT_EQUAL_HEX32(frame.id, found.id);
            TEST_ASSERT_FALSE(found.is_fd);
            TEST_ASSERT_EQUAL_UINT8(length, found.length);
            TEST_ASSERT_EQUAL_HEX8_ARRAY(frame.data, found.data, sizeof frame.data);
        }
    }
}

static void test_extended_and_remote_frames_are_none_of_ours(void) {
    for (int n = 0; n < LAYOUTS; n++) {
        message_words_t words = layouts[n].expected;
        hexload_bus_frame_t unused;
        words.id |= layouts[n].extended;
        TEST_ASSERT_FALSE(layouts[n].unpack(&words, &unused));
        words.id = layouts[n].expected.id | layouts[n].remote;
        TEST_ASSERT_FALSE(layouts[n].unpack(&words, &unused));
    }
}

static void test_lengths_beyond_eight_mean_eight(void) {
    for (int n = 0; n < LAYOUTS; n++) {
        message_words_t words = layouts[n].expected;
        hexload_bus_frame_t found;
        words.dlc = 15u << 28;
        TEST_ASSERT_TRUE(layouts[n].unpack(&words, &found));
        TEST_ASSERT_EQUAL_UINT8(8, found.length);
    }
}

static void test_a_frame_that_is_sent_is_in_the_fifo(void) {
    const hexload_bus_frame_t frame = page(8);
    TEST_ASSERT_EQUAL_HEX32(ENABLED, registers[SRR]);
    TEST_ASSERT_TRUE(can_send(&can, &frame));
    TEST_ASSERT_EQUAL_HEX32(layouts[0].expected.id, registers[TXFIFO]);
    TEST_ASSERT_EQUAL_HEX32(layouts[0].expected.data[1], registers[TXFIFO + 3]);
}

static void test_nothing_is_sent_when_the_fifo_is_full_or_the_frame_is_fd(void) {
    // GIVEN a full FIFO, or an FD frame WHEN it is sent THEN it is refused and no word is written
    hexload_bus_frame_t frame = page(8);
    registers[SR] = TX_FULL;
    TEST_ASSERT_FALSE(can_send(&can, &frame));
    registers[SR] = 0;
    frame.is_fd = true;
    TEST_ASSERT_FALSE(can_send(&can, &frame));
    TEST_ASSERT_EQUAL_HEX32(0, registers[TXFIFO]);
}

static void put_in_fifo(uint32_t id_bits) {
    registers[RXFIFO] = layouts[0].expected.id | id_bits;
    registers[RXFIFO + 1] = layouts[0].expected.dlc;
    registers[RXFIFO + 2] = layouts[0].expected.data[0];
    registers[RXFIFO + 3] = layouts[0].expected.data[1];
    registers[ISR] = RX_NOT_EMPTY;
}

static void test_a_received_frame_is_taken_out(void) {
    hexload_bus_frame_t found;
    registers[ICR] = 0;
    TEST_ASSERT_FALSE(can_receive(&can, &found));
    put_in_fifo(0);
    TEST_ASSERT_TRUE(can_receive(&can, &found));
    TEST_ASSERT_EQUAL_HEX32(0x104, found.id);
    TEST_ASSERT_EQUAL_HEX8(8, found.data[7]);
    TEST_ASSERT_EQUAL_HEX32(RX_NOT_EMPTY, registers[ICR]);
}

static void test_extended_frames_without_end_do_not_hold_up_the_program(void) {
    hexload_bus_frame_t unused;
    put_in_fifo(layouts[0].extended);
    TEST_ASSERT_FALSE(can_receive(&can, &unused));
}

static void test_an_overflow_is_reported_once(void) {
    registers[ISR] = RX_OVERFLOW;
    TEST_ASSERT_TRUE(can_take_overflow(&can));
    TEST_ASSERT_EQUAL_HEX32(RX_OVERFLOW, registers[ICR]);
    registers[ISR] = 0; // as the controller does
    TEST_ASSERT_FALSE(can_take_overflow(&can));
}

static void test_bus_off_ends_in_a_new_start_after_a_rest(void) {
    // GIVEN a controller on the bus WHEN it goes bus-off THEN it is reset, and neither sends nor receives
    hexload_bus_frame_t frame = page(8);
    TEST_ASSERT_TRUE(can_check_bus(&can, 1));
    put_in_fifo(0);
    registers[ISR] |= BUS_OFF;
    TEST_ASSERT_FALSE(can_check_bus(&can, 1));
    TEST_ASSERT_EQUAL_HEX32(IN_RESET, registers[SRR]);
    TEST_ASSERT_FALSE(can_send(&can, &frame));
    TEST_ASSERT_FALSE(can_receive(&can, &frame));
    // WHEN the rest is over THEN it is on the bus again
    registers[ISR] = 0; // of the reset
    TEST_ASSERT_FALSE(can_check_bus(&can, CAN_BUS_OFF_MS - 1));
    TEST_ASSERT_EQUAL_HEX32(IN_RESET, registers[SRR]);
    TEST_ASSERT_TRUE(can_check_bus(&can, 1));
    TEST_ASSERT_EQUAL_HEX32(ENABLED, registers[SRR]);
    TEST_ASSERT_TRUE(can_send(&can, &frame));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_words_are_those_of_the_manual);
    RUN_TEST(test_a_frame_of_each_length_comes_back);
    RUN_TEST(test_extended_and_remote_frames_are_none_of_ours);
    RUN_TEST(test_lengths_beyond_eight_mean_eight);
    RUN_TEST(test_a_frame_that_is_sent_is_in_the_fifo);
    RUN_TEST(test_nothing_is_sent_when_the_fifo_is_full_or_the_frame_is_fd);
    RUN_TEST(test_a_received_frame_is_taken_out);
    RUN_TEST(test_extended_frames_without_end_do_not_hold_up_the_program);
    RUN_TEST(test_an_overflow_is_reported_once);
    RUN_TEST(test_bus_off_ends_in_a_new_start_after_a_rest);
    return UNITY_END();
}
