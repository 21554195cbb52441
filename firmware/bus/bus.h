/// @file bus.h
/// Frames of hexload.dbc to structs and back: the one place that saturates, checks and counts.
///
/// The codec that cantools generates from hexload.dbc packs bits; it neither saturates nor looks at NaN,
/// lengths, ticks or checksums. Everything here is reentrant, takes constant time and keeps no pointer.
///
/// Two profiles carry the same quantities. FD: one 64-byte leg sample per tick, three answer frames per tick.
/// Classic (8-byte frames, 1 Mbit/s): six leg frames per tick, one page of the answer at every second tick,
/// so that the load stays below 90 %. Commands, acknowledges, status and events are 8-byte frames in both.
#ifndef HEXLOAD_BUS_BUS_H
#define HEXLOAD_BUS_BUS_H

#include "hexload/hexload.h"

#include <stdbool.h>
#include <stdint.h>

HEXLOAD_DECLS_BEGIN

enum {
    HEXLOAD_BUS_FRAME_BYTES = 64,
    HEXLOAD_BUS_SAMPLE_FRAMES = 7,      ///< most frames of one leg sample: classic, tick frame + six legs
    HEXLOAD_BUS_ANSWER_FRAMES = 3,      ///< most frames of one answer: FD estimate, sigma, health
    HEXLOAD_BUS_ANSWER_PAGES = 13,      ///< classic pages of one answer of the paper's filter
    HEXLOAD_BUS_LOAD_ANSWER_PAGES = 26, ///< the same of the momentum filter
    HEXLOAD_BUS_ANSWER_PERIOD = 2,      ///< classic: a page goes out at each tick that is a multiple of this
    HEXLOAD_BUS_TICK_PERIOD = 16,       ///< classic: the whole tick precedes the legs at multiples of this
    HEXLOAD_BUS_CODE_TICKS = 16,        ///< of samples that have one code together, and of FD answers
    HEXLOAD_BUS_PAGE_CODE_TICKS = 64,   ///< of classic answers that have one code together
    HEXLOAD_BUS_STATUS_PAGES = 12,
    HEXLOAD_BUS_TIME_MARGIN_PAGE = 4, ///< the status page with time_margin_us
    HEXLOAD_BUS_SESSIONS = 4096,      ///< of one source
};

/// What a command tells of a configuration's checksum.
#define HEXLOAD_BUS_CONFIGURATION_MASK UINT32_C(0xFFFFFF)

typedef enum hexload_bus_profile {
    HEXLOAD_BUS_FD = 0,
    HEXLOAD_BUS_CLASSIC = 1,
} hexload_bus_profile_t;

/// One CAN data frame with an 11-bit identifier.
typedef struct hexload_bus_frame {
    uint32_t id;
    uint8_t data[HEXLOAD_BUS_FRAME_BYTES]; ///< beyond length: without meaning, and not written by an encoder
    uint8_t length;                        ///< 0..8, or an FD length: 12, 16, 20, 24, 32, 48, 64
    bool is_fd;                            ///< FD format with bit-rate switch
} hexload_bus_frame_t;

/// Result of decoding. Negative: the frame has an identifier of that kind and is refused.
typedef enum hexload_bus_status {
    HEXLOAD_BUS_OK = 0,
    HEXLOAD_BUS_OTHER = 1,       ///< a frame of another kind; not looked at
    HEXLOAD_BUS_PARTIAL = 2,     ///< taken; more frames are needed
    HEXLOAD_BUS_ERR_LENGTH = -1, ///< length or format is not the DBC's
    HEXLOAD_BUS_ERR_CRC = -2,
    HEXLOAD_BUS_ERR_VALUE = -3,   ///< a number is not finite, or a code the DBC does not know
    HEXLOAD_BUS_ERR_TICK = -4,    ///< a late or doubled frame: belongs to a tick that is over
    HEXLOAD_BUS_ERR_PROFILE = -5, ///< a leg sample or an answer of the other profile
    HEXLOAD_BUS_ERR_CONTRADICTION =
        -6, ///< the same once more with other numbers, or the tick goes back: two sources
    HEXLOAD_BUS_ERR_AUTHENTICATION = -7, ///< a command without the key's code
} hexload_bus_status_t;

/// Commands to the controller. Values are those of the DBC (checked when compiling).
typedef enum hexload_bus_command_kind {
    HEXLOAD_COMMAND_START = 1,          ///< argument: hexload_pacing_t
    HEXLOAD_COMMAND_STOP = 2,           ///< no argument
    HEXLOAD_COMMAND_RESET = 3,          ///< no argument: clears a fault, forgets the estimate
    HEXLOAD_COMMAND_SELECT_FILTER = 4,  ///< argument: hexload_kind_t
    HEXLOAD_COMMAND_SET_KNOWN_MASS = 5, ///< argument: load mass, kg
    HEXLOAD_COMMAND_CHALLENGE = 6,      ///< no argument: a controller with a key answers with its nonce
} hexload_bus_command_kind_t;

/// Who sets the pace after START: decides which time-outs hold.
typedef enum hexload_pacing {
    HEXLOAD_PACING_REAL_TIME = 0,    ///< samples come every tick_s by the clock
    HEXLOAD_PACING_LOCKSTEP = 1,     ///< the next sample comes when this one is answered
    HEXLOAD_PACING_CODES = 2,        ///< added to either: bus/sample_code.h
    HEXLOAD_PACING_ANSWER_CODES = 4, ///< likewise: bus/answer_code.h
} hexload_pacing_t;

/// Which parameters an answer has.
typedef enum hexload_bus_filter {
    HEXLOAD_FILTER_PAPER = 0,    ///< four, the load's mass known: of HEXLOAD_KIND_PAPER
    HEXLOAD_FILTER_MOMENTUM = 1, ///< all ten: of the other kinds
} hexload_bus_filter_t;

static inline hexload_bus_filter_t hexload_bus_filter_of(hexload_kind_t kind) {
    return kind == HEXLOAD_KIND_PAPER ? HEXLOAD_FILTER_PAPER : HEXLOAD_FILTER_MOMENTUM;
}

typedef enum hexload_bus_result {
    HEXLOAD_RESULT_DONE = 0,
    HEXLOAD_RESULT_UNKNOWN_COMMAND = 1,
    HEXLOAD_RESULT_WRONG_STATE = 2,         ///< e.g. START in FAULT: RESET first
    HEXLOAD_RESULT_BAD_ARGUMENT = 3,        ///< out of range
    HEXLOAD_RESULT_NOT_AVAILABLE = 4,       ///< this controller cannot do it
    HEXLOAD_RESULT_OTHER_CONFIGURATION = 5, ///< START by a source that works with another one
    HEXLOAD_RESULT_NOT_AUTHENTICATED = 6,   ///< without the code that the controller's key makes
} hexload_bus_result_t;

/// What kind of program commands.
typedef enum hexload_bus_source {
    HEXLOAD_SOURCE_UNKNOWN = 0,
    HEXLOAD_SOURCE_SIMULATOR = 1,
    HEXLOAD_SOURCE_MONITOR = 2,  ///< the live page
    HEXLOAD_SOURCE_OPERATOR = 3, ///< anybody else
} hexload_bus_source_t;

typedef struct hexload_bus_command {
    uint8_t kind;     ///< hexload_bus_command_kind_t, 0..15; an unknown one is acknowledged as such
    uint8_t source;   ///< hexload_bus_source_t, 0..15
    uint16_t session; ///< below HEXLOAD_BUS_SESSIONS, drawn when the program started
    uint8_t sequence; ///< one more than the command before; its low four bits return in the acknowledge
    float argument;   ///< finite; START, SELECT_FILTER: a whole number of 0..255
    uint32_t
        configuration; ///< START: hexload_app_configuration() that the source works with, 24 bits; 0: any
} hexload_bus_command_t;

typedef struct hexload_bus_acknowledge {
    uint8_t kind;
    uint8_t source; ///< of the command, and the next two
    uint16_t session;
    uint8_t sequence;
    uint8_t counter;        ///< of acknowledges; its low four bits go over the bus
    uint8_t result;         ///< hexload_bus_result_t
    uint8_t state;          ///< hexload_app_state_t after the command
    uint8_t fault;          ///< hexload_app_fault_t
    uint8_t profile;        ///< hexload_bus_profile_t that the controller speaks
    uint8_t known_mass_crc; ///< hexload_bus_known_mass_crc() of the mass in force
} hexload_bus_acknowledge_t;

/// Everything that the controller says about one sample.
typedef struct hexload_bus_answer {
    uint32_t tick;
    int8_t status;               ///< hexload_status_t of hexload_tick()
    uint8_t state;               ///< hexload_app_state_t
    uint8_t fault;               ///< hexload_app_fault_t
    uint8_t missing_legs;        ///< bit n: leg n + 1 was missing in the last incomplete sample of this run
    uint8_t filter;              ///< hexload_bus_filter_t: whose the estimate is
    uint16_t health;             ///< health bits, hexload_health_bit_t; classic: of the whole round
    hexload_input_fault_t input; ///< what the health bit INPUT_IMPLAUSIBLE means; classic answers have none
    uint32_t refused;            ///< samples refused since START
    hexload_estimate_t estimate; ///< the last one; its tick is not sent and reads 0
} hexload_bus_answer_t;

/// Event: load change.
typedef struct hexload_bus_load_change {
    uint32_t tick;         ///< of the sample at which it was detected
    uint16_t load_changes; ///< detected since START, this one included, saturating
} hexload_bus_load_change_t;

/// Slow status of the controller: one page per frame, 20 frames/s. Counters saturate.
typedef struct hexload_bus_controller_status {
    uint8_t version[3]; ///< of the firmware: major, minor, patch
    uint8_t counter;    ///< of pages; its low four bits go over the bus
    uint8_t profile;
    uint8_t state;
    uint8_t fault;
    uint32_t tick;               ///< of the last sample
    uint32_t overruns;           ///< 1 ms periods that the controller missed
    uint32_t stack_margin_bytes; ///< never used so far; 0: not measured
    int32_t time_margin_us;      ///< least time left in a period since the last such page; 0: not measured
    uint32_t samples_missing;    ///< ticks without an accepted sample since START
    uint32_t frames_refused;     ///< frames with a wrong length, checksum, tick or value; codes missed
    uint32_t samples_refused;
    uint16_t load_changes; ///< load changes detected since START
    hexload_input_fault_t
        input;              ///< what is wrong with the samples; on the page of load_changes, and excess_n
    float known_mass_kg;    ///< of the load, stated and in force; 0: none
    uint32_t configuration; ///< hexload_app_configuration() of what is in force
} hexload_bus_controller_status_t;

/// Writes the frames of a sample.
/// @param[out] frames in sending order.
/// @param[in,out] saturated incremented for each channel that was beyond the signal's range.
/// @return number of frames, 1..HEXLOAD_BUS_SAMPLE_FRAMES; HEXLOAD_BUS_ERR_VALUE: a channel is
///         infinite. One that is NaN, without a sensor or with one that has failed, arrives as NaN.
HEXLOAD_MUST_USE int hexload_bus_encode_sample(hexload_bus_profile_t profile,
                                               const hexload_leg_sample_t* sample,
                                               hexload_bus_frame_t frames[HEXLOAD_BUS_SAMPLE_FRAMES],
                                               uint32_t* saturated);

/// Classic pages of one answer of this filter.
static inline int hexload_bus_answer_pages(uint8_t filter) {
    return filter == HEXLOAD_FILTER_MOMENTUM ? HEXLOAD_BUS_LOAD_ANSWER_PAGES : HEXLOAD_BUS_ANSWER_PAGES;
}

/// Writes the frames of an answer: all (FD), or one page (classic).
/// @param page 0..hexload_bus_answer_pages(answer->filter) - 1, in sending order; FD does not look at it.
/// @return number of frames, 1..HEXLOAD_BUS_ANSWER_FRAMES; HEXLOAD_BUS_ERR_VALUE: a number is not finite.
HEXLOAD_MUST_USE int hexload_bus_encode_answer(hexload_bus_profile_t profile,
                                               const hexload_bus_answer_t* answer, int page,
                                               hexload_bus_frame_t frames[HEXLOAD_BUS_ANSWER_FRAMES]);

/// @return HEXLOAD_BUS_OK, or HEXLOAD_BUS_ERR_VALUE when the argument is not what its kind allows.
HEXLOAD_MUST_USE hexload_bus_status_t hexload_bus_encode_command(const hexload_bus_command_t* command,
                                                                 hexload_bus_frame_t* frame);
/// @return HEXLOAD_BUS_OK, _OTHER, _ERR_LENGTH, _ERR_CRC, _ERR_VALUE; the output changes with OK only.
///         Likewise below.
HEXLOAD_MUST_USE hexload_bus_status_t hexload_bus_decode_command(const hexload_bus_frame_t* frame,
                                                                 hexload_bus_command_t* command);

void hexload_bus_encode_acknowledge(const hexload_bus_acknowledge_t* acknowledge, hexload_bus_frame_t* frame);
HEXLOAD_MUST_USE hexload_bus_status_t hexload_bus_decode_acknowledge(const hexload_bus_frame_t* frame,
                                                                     hexload_bus_acknowledge_t* acknowledge);

/// @param page 0..HEXLOAD_BUS_STATUS_PAGES - 1
void hexload_bus_encode_status(const hexload_bus_controller_status_t* status, int page,
                               hexload_bus_frame_t* frame);
/// Puts one page into status; the other fields stay.
HEXLOAD_MUST_USE hexload_bus_status_t hexload_bus_decode_status(const hexload_bus_frame_t* frame,
                                                                hexload_bus_controller_status_t* status);

void hexload_bus_encode_load_change(const hexload_bus_load_change_t* change, hexload_bus_frame_t* frame);
HEXLOAD_MUST_USE hexload_bus_status_t hexload_bus_decode_load_change(const hexload_bus_frame_t* frame,
                                                                     hexload_bus_load_change_t* change);

/// What an acknowledge says of the known mass: 0 for none, else CRC-8 of its four bytes. Reentrant.
uint8_t hexload_bus_known_mass_crc(float known_mass_kg);

/// Whether only a controller sends frames with this identifier.
bool hexload_bus_is_from_controller(const hexload_bus_frame_t* frame);

/// Whether it is one of a controller's frames in length, format and checksum.
/// @return HEXLOAD_BUS_OK, _OTHER, _ERR_LENGTH or _ERR_CRC.
HEXLOAD_MUST_USE hexload_bus_status_t hexload_bus_check_controller(const hexload_bus_frame_t* frame);

/// Short names for messages, never NULL, static storage.
const char* hexload_bus_profile_name(hexload_bus_profile_t profile); ///< "fd", "classic"
const char* hexload_bus_status_name(hexload_bus_status_t status);    ///< e.g. "wrong checksum"
const char* hexload_bus_result_name(hexload_bus_result_t result);    ///< e.g. "wrong state"
const char* hexload_bus_filter_name(hexload_bus_filter_t filter);    ///< "paper", "momentum"

HEXLOAD_DECLS_END

#endif
