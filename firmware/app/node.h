/// @file node.h
/// The application as a node on a CAN bus: frames in, frames out.
///
/// A port calls hexload_node_receive() for each received frame and hexload_node_period() every millisecond,
/// from one thread, frames first. A sample is processed when its last frame arrives: the answer does not wait
/// for the next period. One that comes twice or too far ahead is refused and not answered: no source waits
/// for that. A change of the load is sent as an event, before the answer to the sample at which it was
/// detected, and stays in the status. Frames that the node sent itself must not come back.
///
/// A command is carried out when its counter is not that of the same session's last one: a doubled frame is
/// refused, and one that says something else has another source. With a key in the port it must also have the
/// key's code, see app/authentication.h.
///
/// With a key its answers have codes too when START asks for them, see bus/answer_code.h.
///
/// A node that hears another controller while it listens stays silent until it is started anew: it neither
/// answers nor carries out commands. One that is active and hears another goes on answering and sending its
/// status, with the fault.
#ifndef HEXLOAD_APP_NODE_H
#define HEXLOAD_APP_NODE_H

#include "app/app.h"
#include "app/authentication.h"
#include "app/port.h"
#include "bus/answer_code.h"
#include "bus/sample_assembly.h"
#include "bus/sample_code.h"

HEXLOAD_DECLS_BEGIN

enum {
    HEXLOAD_NODE_LISTEN_MS = 250,       ///< silent after the start, to hear a controller that is there
    HEXLOAD_NODE_STATUS_PERIOD_MS = 50, ///< one status page
    HEXLOAD_NODE_TICK_LOST = 8,         ///< ticks in real time: a longer silence makes four bits ambiguous
    HEXLOAD_NODE_MEMORY_MS = 1000,      ///< for which what is not as it should be counts
    HEXLOAD_NODE_STRANGERS = 3,         ///< whole frames of a controller or of the other profile: a fault
    HEXLOAD_NODE_LATE_FRAMES = 60,      ///< late leg frames, ten samples' worth: another source is faster
    HEXLOAD_NODE_MANY_REFUSED = 10,     ///< frames: a health bit
    HEXLOAD_NODE_UNPROVEN = 4,          ///< times 16 ticks without a code that matches: a fault
    HEXLOAD_NODE_CHALLENGE_MS = 10,     ///< between the challenges that are asked for, at least
    HEXLOAD_NODE_REFUSAL_MS = 20,       ///< between acknowledges of commands that lack the key's code
};

/// Of one kind, since a time that is a second ago at most.
typedef struct hexload_node_events {
    uint32_t since_ms; ///< by the node's clock
    uint32_t count;
} hexload_node_events_t;

typedef struct hexload_node {
    hexload_app_t app;
    hexload_port_t port;
    hexload_sample_assembly_t assembly;
    hexload_bus_answer_t answer; ///< classic: the one whose pages are being sent
    hexload_bus_controller_status_t status;
    hexload_bus_command_t command; ///< the last one; kind 0: none so far
    hexload_authentication_t authentication;
    hexload_sample_code_t code;        ///< of the samples, when START has said that they have one
    hexload_answer_code_t answer_code; ///< of the answers, when START has asked for it
    uint32_t code_window;              ///< the last sample's tick / 16
    uint32_t unproven;                 ///< windows since the last one whose code matched
    uint32_t age_ms;                   ///< since the start, saturating
    uint32_t clock_ms;                 ///< the same, wrapping
    uint32_t leg_silence_ms;           ///< since the last frame of a sample, saturating
    uint32_t status_wait_ms;           ///< since the last status page
    uint32_t challenge_wait_ms;        ///< since the last challenge, saturating
    uint32_t refusal_wait_ms;        ///< since a command without the key's code was acknowledged, saturating
    uint32_t send_failed;            ///< frames that the port could not queue, saturating
    uint16_t health_seen;            ///< classic: bits of the samples since the last page with them
    hexload_node_events_t strangers; ///< frames of another controller
    hexload_node_events_t foreign;   ///< samples of the other profile
    hexload_node_events_t late;      ///< legs of ticks that are over
    hexload_node_events_t refused;   ///< frames, for whatever reason
    uint8_t answer_page;             ///< next one
    uint8_t status_page;             ///< next one
    uint8_t acknowledges;            ///< sent, wrapping
    bool heard_controller;           ///< while listening
    bool is_proven;                  ///< a code has matched since START
    bool has_answer_codes;           ///< answers have codes
    bool is_challenge_due;           ///< asked for, and not yet sent
} hexload_node_t;

/// @return as hexload_app_init().
HEXLOAD_MUST_USE hexload_status_t hexload_node_init(hexload_node_t* self, const hexload_config_t* config,
                                                    const hexload_app_settings_t* settings,
                                                    hexload_bus_profile_t profile,
                                                    const hexload_port_t* port);

/// One received frame: command, part of a sample, or a sign of a second controller. Worst case: the
/// estimator's tick and five frames sent.
void hexload_node_receive(hexload_node_t* self, const hexload_bus_frame_t* frame);

/// Periods of 1 ms that have passed since the last call: 1 when the port keeps its time; more are counted as
/// overruns.
void hexload_node_period(hexload_node_t* self, uint32_t periods);

/// The bus is down (sets FAULT_BUS_DOWN) or up again (clears that fault: RESET). May be called in every
/// period.
void hexload_node_bus_state(hexload_node_t* self, bool is_up);

/// Past the listening time, and no other controller was heard.
bool hexload_node_is_active(const hexload_node_t* self);

HEXLOAD_DECLS_END

#endif
