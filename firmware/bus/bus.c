#include "bus/bus.h"

#include "bus/crc.h"
#include "bus/frame.h"

#include <hexload_dbc.h>
#include <math.h>
#include <stddef.h>
#include <string.h>

// Codes of the DBC are those of the header. The application checks its own.
_Static_assert((int)HEXLOAD_DBC_COMMAND_COMMAND_START_CHOICE == HEXLOAD_COMMAND_START &&
                   (int)HEXLOAD_DBC_COMMAND_COMMAND_STOP_CHOICE == HEXLOAD_COMMAND_STOP &&
                   (int)HEXLOAD_DBC_COMMAND_COMMAND_RESET_CHOICE == HEXLOAD_COMMAND_RESET &&
                   (int)HEXLOAD_DBC_COMMAND_COMMAND_SELECT_FILTER_CHOICE == HEXLOAD_COMMAND_SELECT_FILTER &&
                   (int)HEXLOAD_DBC_COMMAND_COMMAND_SET_KNOWN_MASS_CHOICE == HEXLOAD_COMMAND_SET_KNOWN_MASS &&
                   (int)HEXLOAD_DBC_COMMAND_COMMAND_CHALLENGE_CHOICE == HEXLOAD_COMMAND_CHALLENGE,
               "commands of the DBC");
_Static_assert((int)HEXLOAD_DBC_ACKNOWLEDGE_RESULT_DONE_CHOICE == HEXLOAD_RESULT_DONE &&
                   (int)HEXLOAD_DBC_ACKNOWLEDGE_RESULT_UNKNOWN_COMMAND_CHOICE ==
                       HEXLOAD_RESULT_UNKNOWN_COMMAND &&
                   (int)HEXLOAD_DBC_ACKNOWLEDGE_RESULT_WRONG_STATE_CHOICE == HEXLOAD_RESULT_WRONG_STATE &&
                   (int)HEXLOAD_DBC_ACKNOWLEDGE_RESULT_BAD_ARGUMENT_CHOICE == HEXLOAD_RESULT_BAD_ARGUMENT &&
                   (int)HEXLOAD_DBC_ACKNOWLEDGE_RESULT_NOT_AVAILABLE_CHOICE == HEXLOAD_RESULT_NOT_AVAILABLE &&
                   (int)HEXLOAD_DBC_ACKNOWLEDGE_RESULT_OTHER_CONFIGURATION_CHOICE ==
                       HEXLOAD_RESULT_OTHER_CONFIGURATION &&
                   (int)HEXLOAD_DBC_ACKNOWLEDGE_RESULT_NOT_AUTHENTICATED_CHOICE ==
                       HEXLOAD_RESULT_NOT_AUTHENTICATED,
               "results of the DBC");
_Static_assert((int)HEXLOAD_DBC_COMMAND_SOURCE_UNKNOWN_CHOICE == HEXLOAD_SOURCE_UNKNOWN &&
                   (int)HEXLOAD_DBC_COMMAND_SOURCE_SIMULATOR_CHOICE == HEXLOAD_SOURCE_SIMULATOR &&
                   (int)HEXLOAD_DBC_COMMAND_SOURCE_MONITOR_CHOICE == HEXLOAD_SOURCE_MONITOR &&
                   (int)HEXLOAD_DBC_COMMAND_SOURCE_OPERATOR_CHOICE == HEXLOAD_SOURCE_OPERATOR,
               "sources of the DBC");
_Static_assert((int)HEXLOAD_DBC_ACKNOWLEDGE_PROFILE_FD_CHOICE == HEXLOAD_BUS_FD &&
                   (int)HEXLOAD_DBC_ACKNOWLEDGE_PROFILE_CLASSIC_CHOICE == HEXLOAD_BUS_CLASSIC,
               "profiles of the DBC");
_Static_assert((int)HEXLOAD_DBC_CONTROLLER_STATUS_PROFILE_FD_CHOICE == HEXLOAD_BUS_FD &&
                   (int)HEXLOAD_DBC_CONTROLLER_STATUS_PROFILE_CLASSIC_CHOICE == HEXLOAD_BUS_CLASSIC,
               "profiles of the DBC");

static const hexload_frame_layout_t command_layout = {HEXLOAD_DBC_COMMAND_FRAME_ID,
                                                      HEXLOAD_DBC_COMMAND_LENGTH};
static const hexload_frame_layout_t acknowledge_layout = {HEXLOAD_DBC_ACKNOWLEDGE_FRAME_ID,
                                                          HEXLOAD_DBC_ACKNOWLEDGE_LENGTH};
static const hexload_frame_layout_t status_layout = {HEXLOAD_DBC_CONTROLLER_STATUS_FRAME_ID,
                                                     HEXLOAD_DBC_CONTROLLER_STATUS_LENGTH};
static const hexload_frame_layout_t load_change_layout = {HEXLOAD_DBC_LOAD_CHANGE_FRAME_ID,
                                                          HEXLOAD_DBC_LOAD_CHANGE_LENGTH};

enum {
    PAGE_VERSION = HEXLOAD_DBC_CONTROLLER_STATUS_PAGE_VERSION_CHOICE,
    PAGE_TICK = HEXLOAD_DBC_CONTROLLER_STATUS_PAGE_TICK_CHOICE,
    PAGE_OVERRUNS = HEXLOAD_DBC_CONTROLLER_STATUS_PAGE_OVERRUNS_CHOICE,
    PAGE_STACK_MARGIN = HEXLOAD_DBC_CONTROLLER_STATUS_PAGE_STACK_MARGIN_CHOICE,
    PAGE_TIME_MARGIN = HEXLOAD_DBC_CONTROLLER_STATUS_PAGE_TIME_MARGIN_CHOICE,
    PAGE_SAMPLES_MISSING = HEXLOAD_DBC_CONTROLLER_STATUS_PAGE_SAMPLES_MISSING_CHOICE,
    PAGE_FRAMES_REFUSED = HEXLOAD_DBC_CONTROLLER_STATUS_PAGE_FRAMES_REFUSED_CHOICE,
    PAGE_SAMPLES_REFUSED = HEXLOAD_DBC_CONTROLLER_STATUS_PAGE_SAMPLES_REFUSED_CHOICE,
    PAGE_LOAD_CHANGES = HEXLOAD_DBC_CONTROLLER_STATUS_PAGE_LOAD_CHANGES_CHOICE,
    PAGE_KNOWN_MASS = HEXLOAD_DBC_CONTROLLER_STATUS_PAGE_KNOWN_MASS_CHOICE,
    PAGE_CONFIGURATION = HEXLOAD_DBC_CONTROLLER_STATUS_PAGE_CONFIGURATION_CHOICE,
    PAGE_EXCESS_FORCE = HEXLOAD_DBC_CONTROLLER_STATUS_PAGE_EXCESS_FORCE_CHOICE,
};
_Static_assert((int)PAGE_EXCESS_FORCE == HEXLOAD_BUS_STATUS_PAGES - 1 &&
                   (int)PAGE_TIME_MARGIN == HEXLOAD_BUS_TIME_MARGIN_PAGE,
               "pages of the DBC");

/// An argument that the bus carries as a code.
static bool is_code(float argument) {
    return argument >= 0.0f && argument <= (float)UINT8_MAX && argument == (float)(uint8_t)argument;
}

hexload_bus_status_t hexload_bus_encode_command(const hexload_bus_command_t* command,
                                                hexload_bus_frame_t* frame) {
    const bool has_code =
        command->kind == HEXLOAD_COMMAND_START || command->kind == HEXLOAD_COMMAND_SELECT_FILTER;
    if (!isfinite(command->argument) || (has_code && !is_code(command->argument))) {
        return HEXLOAD_BUS_ERR_VALUE;
    }
    const uint8_t code = has_code ? (uint8_t)command->argument : 0;
    const struct hexload_dbc_command_t message = {
        .counter = hexload_frame_counter(command->sequence),
        .command = command->kind,
        .source = command->source,
        .session = command->session,
        .pacing = code,
        .configuration = command->configuration & HEXLOAD_BUS_CONFIGURATION_MASK,
        .estimator = code,
        .known_mass = command->argument,
    };
    hexload_frame_begin(frame, &command_layout);
    (void)hexload_dbc_command_pack(frame->data, &message, sizeof frame->data);
    hexload_frame_seal(frame, &command_layout);
    return HEXLOAD_BUS_OK;
}

/// 0 of a command that has none.
static float argument_of(const struct hexload_dbc_command_t* message) {
    switch (message->command) {
    case HEXLOAD_COMMAND_START:
        return (float)message->pacing;
    case HEXLOAD_COMMAND_SELECT_FILTER:
        return (float)message->estimator;
    case HEXLOAD_COMMAND_SET_KNOWN_MASS:
        return message->known_mass;
    default:
        return 0.0f;
    }
}

hexload_bus_status_t hexload_bus_decode_command(const hexload_bus_frame_t* frame,
                                                hexload_bus_command_t* command) {
    const hexload_bus_status_t status = hexload_frame_check(frame, &command_layout);
    if (status != HEXLOAD_BUS_OK) {
        return status;
    }
    struct hexload_dbc_command_t message = {0};
    (void)hexload_dbc_command_unpack(&message, frame->data, sizeof frame->data);
    if (!isfinite(message.known_mass) || !hexload_dbc_command_known_mass_is_in_range(message.known_mass)) {
        return HEXLOAD_BUS_ERR_VALUE;
    }
    *command = (hexload_bus_command_t){
        .kind = message.command,
        .source = message.source,
        .session = message.session,
        .sequence = message.counter,
        .argument = argument_of(&message),
        .configuration = message.configuration,
    };
    return HEXLOAD_BUS_OK;
}

void hexload_bus_encode_acknowledge(const hexload_bus_acknowledge_t* acknowledge,
                                    hexload_bus_frame_t* frame) {
    const struct hexload_dbc_acknowledge_t message = {
        .counter = hexload_frame_counter(acknowledge->counter),
        .command = acknowledge->kind,
        .source = acknowledge->source,
        .session = acknowledge->session,
        .sequence = acknowledge->sequence,
        .result = acknowledge->result,
        .state = acknowledge->state,
        .fault = acknowledge->fault,
        .profile = acknowledge->profile,
        .known_mass_crc = acknowledge->known_mass_crc,
    };
    hexload_frame_begin(frame, &acknowledge_layout);
    (void)hexload_dbc_acknowledge_pack(frame->data, &message, sizeof frame->data);
    hexload_frame_seal(frame, &acknowledge_layout);
}

hexload_bus_status_t hexload_bus_decode_acknowledge(const hexload_bus_frame_t* frame,
                                                    hexload_bus_acknowledge_t* acknowledge) {
    const hexload_bus_status_t status = hexload_frame_check(frame, &acknowledge_layout);
    if (status != HEXLOAD_BUS_OK) {
        return status;
    }
    struct hexload_dbc_acknowledge_t message;
    (void)hexload_dbc_acknowledge_unpack(&message, frame->data, sizeof frame->data);
    if (!hexload_dbc_acknowledge_result_is_in_range(message.result) ||
        !hexload_dbc_acknowledge_state_is_in_range(message.state) ||
        !hexload_dbc_acknowledge_fault_is_in_range(message.fault) ||
        !hexload_dbc_acknowledge_profile_is_in_range(message.profile)) {
        return HEXLOAD_BUS_ERR_VALUE;
    }
    *acknowledge = (hexload_bus_acknowledge_t){
        .kind = message.command,
        .source = message.source,
        .session = message.session,
        .sequence = message.sequence,
        .counter = message.counter,
        .result = message.result,
        .state = message.state,
        .fault = message.fault,
        .profile = message.profile,
        .known_mass_crc = message.known_mass_crc,
    };
    return HEXLOAD_BUS_OK;
}

/// The codec writes the signals of the page alone.
void hexload_bus_encode_status(const hexload_bus_controller_status_t* status, int page,
                               hexload_bus_frame_t* frame) {
    const struct hexload_dbc_controller_status_t message = {
        .counter = hexload_frame_counter(status->counter),
        .page = (uint8_t)page,
        .state = status->state,
        .fault = status->fault,
        .version_major = status->version[0],
        .version_minor = status->version[1],
        .version_patch = status->version[2],
        .profile = status->profile,
        .tick = status->tick,
        .overruns = status->overruns,
        .stack_margin = status->stack_margin_bytes,
        .time_margin = status->time_margin_us,
        .samples_missing = status->samples_missing,
        .frames_refused = status->frames_refused,
        .samples_refused = status->samples_refused,
        .load_changes = status->load_changes,
        .input_cause = (uint8_t)status->input.cause,
        .input_leg = hexload_frame_leg_code(&status->input),
        .known_mass = status->known_mass_kg,
        .configuration = status->configuration,
        .excess_force = (float)status->input.excess_n,
    };
    hexload_frame_begin(frame, &status_layout);
    (void)hexload_dbc_controller_status_pack(frame->data, &message, sizeof frame->data);
    hexload_frame_seal(frame, &status_layout);
}

static void take_status_page(const struct hexload_dbc_controller_status_t* message,
                             hexload_bus_controller_status_t* status) {
    switch (message->page) {
    case PAGE_VERSION:
        status->version[0] = message->version_major;
        status->version[1] = message->version_minor;
        status->version[2] = message->version_patch;
        status->profile = message->profile;
        break;
    case PAGE_TICK:
        status->tick = message->tick;
        break;
    case PAGE_OVERRUNS:
        status->overruns = message->overruns;
        break;
    case PAGE_STACK_MARGIN:
        status->stack_margin_bytes = message->stack_margin;
        break;
    case PAGE_TIME_MARGIN:
        status->time_margin_us = message->time_margin;
        break;
    case PAGE_SAMPLES_MISSING:
        status->samples_missing = message->samples_missing;
        break;
    case PAGE_FRAMES_REFUSED:
        status->frames_refused = message->frames_refused;
        break;
    case PAGE_SAMPLES_REFUSED:
        status->samples_refused = message->samples_refused;
        break;
    case PAGE_LOAD_CHANGES:
        status->load_changes = message->load_changes;
        status->input.cause = hexload_frame_input_cause(message->input_cause);
        status->input.leg = hexload_frame_input_leg(message->input_leg);
        break;
    case PAGE_KNOWN_MASS:
        status->known_mass_kg = message->known_mass;
        break;
    case PAGE_CONFIGURATION:
        status->configuration = message->configuration;
        break;
    default:
        status->input.excess_n = (hexload_real_t)message->excess_force;
        break;
    }
}

hexload_bus_status_t hexload_bus_decode_status(const hexload_bus_frame_t* frame,
                                               hexload_bus_controller_status_t* status) {
    const hexload_bus_status_t check = hexload_frame_check(frame, &status_layout);
    if (check != HEXLOAD_BUS_OK) {
        return check;
    }
    struct hexload_dbc_controller_status_t message = {0};
    (void)hexload_dbc_controller_status_unpack(&message, frame->data, sizeof frame->data);
    if (!hexload_dbc_controller_status_page_is_in_range(message.page) ||
        !hexload_dbc_controller_status_state_is_in_range(message.state) ||
        !hexload_dbc_controller_status_fault_is_in_range(message.fault) ||
        !hexload_dbc_controller_status_profile_is_in_range(message.profile) ||
        !hexload_dbc_controller_status_known_mass_is_in_range(message.known_mass) ||
        !isfinite(message.excess_force)) {
        return HEXLOAD_BUS_ERR_VALUE;
    }
    status->counter = message.counter;
    status->state = message.state;
    status->fault = message.fault;
    take_status_page(&message, status);
    return HEXLOAD_BUS_OK;
}

void hexload_bus_encode_load_change(const hexload_bus_load_change_t* change, hexload_bus_frame_t* frame) {
    const struct hexload_dbc_load_change_t message = {.counter = hexload_frame_counter(change->load_changes),
                                                      .tick = change->tick,
                                                      .load_changes = change->load_changes};
    hexload_frame_begin(frame, &load_change_layout);
    (void)hexload_dbc_load_change_pack(frame->data, &message, sizeof frame->data);
    hexload_frame_seal(frame, &load_change_layout);
}

hexload_bus_status_t hexload_bus_decode_load_change(const hexload_bus_frame_t* frame,
                                                    hexload_bus_load_change_t* change) {
    const hexload_bus_status_t status = hexload_frame_check(frame, &load_change_layout);
    if (status != HEXLOAD_BUS_OK) {
        return status;
    }
    struct hexload_dbc_load_change_t message;
    (void)hexload_dbc_load_change_unpack(&message, frame->data, sizeof frame->data);
    if (message.counter != hexload_frame_counter(message.load_changes)) {
        return HEXLOAD_BUS_ERR_VALUE;
    }
    *change = (hexload_bus_load_change_t){.tick = message.tick, .load_changes = message.load_changes};
    return HEXLOAD_BUS_OK;
}

uint8_t hexload_bus_known_mass_crc(float known_mass_kg) {
    uint8_t bytes[sizeof known_mass_kg];
    memcpy(bytes, &known_mass_kg, sizeof bytes);
    return known_mass_kg > 0.0f ? hexload_crc8(0, bytes, sizeof bytes) : 0;
}

#define LAYOUT(message)                                                                                      \
    { HEXLOAD_DBC_##message##_FRAME_ID, HEXLOAD_DBC_##message##_LENGTH }

/// All that a controller sends.
static const hexload_frame_layout_t controller_layouts[] = {
    LAYOUT(LOAD_CHANGE),   LAYOUT(ESTIMATE_FD), LAYOUT(SIGMA_FD),
    LAYOUT(HEALTH_FD),     LAYOUT(ANSWER_PAGE), LAYOUT(LOAD_FD),
    LAYOUT(LOAD_SIGMA_FD), LAYOUT(ACKNOWLEDGE), LAYOUT(CONTROLLER_STATUS),
};

static const hexload_frame_layout_t* controller_layout(uint32_t id) {
    const size_t count = sizeof controller_layouts / sizeof controller_layouts[0];
    for (size_t n = 0; n < count && id >= controller_layouts[0].id; n++) { // samples and commands are below
        if (controller_layouts[n].id == id) {
            return &controller_layouts[n];
        }
    }
    return NULL;
}

bool hexload_bus_is_from_controller(const hexload_bus_frame_t* frame) {
    return controller_layout(frame->id) != NULL;
}

hexload_bus_status_t hexload_bus_check_controller(const hexload_bus_frame_t* frame) {
    const hexload_frame_layout_t* layout = controller_layout(frame->id);
    return layout != NULL ? hexload_frame_check(frame, layout) : HEXLOAD_BUS_OTHER;
}

const char* hexload_bus_profile_name(hexload_bus_profile_t profile) {
    switch (profile) {
    case HEXLOAD_BUS_FD:
        return "fd";
    case HEXLOAD_BUS_CLASSIC:
        return "classic";
    default:
        return "unknown profile";
    }
}

const char* hexload_bus_status_name(hexload_bus_status_t status) {
    switch (status) {
    case HEXLOAD_BUS_OK:
        return "ok";
    case HEXLOAD_BUS_OTHER:
        return "frame of another kind";
    case HEXLOAD_BUS_PARTIAL:
        return "more frames needed";
    case HEXLOAD_BUS_ERR_LENGTH:
        return "wrong length or format";
    case HEXLOAD_BUS_ERR_CRC:
        return "wrong checksum";
    case HEXLOAD_BUS_ERR_VALUE:
        return "value not usable";
    case HEXLOAD_BUS_ERR_TICK:
        return "late or doubled frame";
    case HEXLOAD_BUS_ERR_PROFILE:
        return "frame of the other profile";
    case HEXLOAD_BUS_ERR_CONTRADICTION:
        return "contradicts what came before";
    case HEXLOAD_BUS_ERR_AUTHENTICATION:
        return "not authenticated";
    default:
        return "unknown status";
    }
}

const char* hexload_bus_result_name(hexload_bus_result_t result) {
    switch (result) {
    case HEXLOAD_RESULT_DONE:
        return "done";
    case HEXLOAD_RESULT_UNKNOWN_COMMAND:
        return "unknown command";
    case HEXLOAD_RESULT_WRONG_STATE:
        return "wrong state";
    case HEXLOAD_RESULT_BAD_ARGUMENT:
        return "bad argument";
    case HEXLOAD_RESULT_NOT_AVAILABLE:
        return "not available";
    case HEXLOAD_RESULT_OTHER_CONFIGURATION:
        return "other configuration";
    case HEXLOAD_RESULT_NOT_AUTHENTICATED:
        return "not authenticated";
    default:
        return "unknown result";
    }
}

const char* hexload_bus_filter_name(hexload_bus_filter_t filter) {
    switch (filter) {
    case HEXLOAD_FILTER_PAPER:
        return "paper";
    case HEXLOAD_FILTER_MOMENTUM:
        return "momentum";
    default:
        return "unknown filter";
    }
}
