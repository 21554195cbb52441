/// @file frames.h
/// Frames for the tests of the bus: identifiers as the contract prints them, and ways to damage a frame.
#ifndef HEXLOAD_TEST_FRAMES_H
#define HEXLOAD_TEST_FRAMES_H

#include "machine.h"

#include "bus/bus.h"

// Written down from the contract, not taken from the generated codec.
enum {
    ID_COMMAND = 0x010,
    ID_COMMAND_MAC = 0x011,
    ID_SAMPLE_TICK = 0x07F,
    ID_LEG_SAMPLE_FD = 0x080,
    ID_LEG_SAMPLE_1 = 0x081,
    ID_SAMPLE_MAC = 0x087,
    ID_LOAD_CHANGE = 0x100,
    ID_ESTIMATE_FD = 0x101,
    ID_SIGMA_FD = 0x102,
    ID_HEALTH_FD = 0x103,
    ID_ANSWER_PAGE = 0x104,
    ID_LOAD_FD = 0x105,
    ID_LOAD_SIGMA_FD = 0x106,
    ID_ANSWER_MAC = 0x107,
    ID_ACKNOWLEDGE = 0x110,
    ID_CHALLENGE = 0x111,
    ID_CONTROLLER_STATUS = 0x120,
};

/// A sample whose channels say which tick and leg they are of, on the classic profile's steps.
hexload_leg_sample_t numbered_sample(uint32_t tick);

/// Random channels within the classic profile's ranges.
hexload_leg_sample_t random_sample(uint32_t tick, uint64_t* seed);

/// An answer of a filter whose every field, but the filter, differs from 0 and says which tick it is of.
hexload_bus_answer_t numbered_answer(uint8_t filter, uint32_t tick);

/// Parameters of a filter: 4 or 10.
int parameters_of(uint8_t filter);

/// Fails unless all that goes over the bus is equal.
void assert_same_answer(const hexload_bus_answer_t* expected, const hexload_bus_answer_t* found);

/// Encodes, and fails unless that gives frames.
int encode_sample(hexload_bus_profile_t profile, const hexload_leg_sample_t* sample,
                  hexload_bus_frame_t frames[HEXLOAD_BUS_SAMPLE_FRAMES]);
int encode_answer(hexload_bus_profile_t profile, const hexload_bus_answer_t* answer, int page,
                  hexload_bus_frame_t frames[HEXLOAD_BUS_ANSWER_FRAMES]);

/// Checksums bit by bit, from the parameters that the standard prints.
uint32_t crc32p4(const uint8_t* bytes, size_t count);
uint8_t crc8h2f(const uint8_t* bytes, size_t count);

/// Writes the checksum anew after a change: a long frame's into its end, a short one's into its first byte.
void seal(hexload_bus_frame_t* frame);

/// A random frame; often with an identifier and a length of the contract.
hexload_bus_frame_t random_frame(uint64_t* seed);

#endif
