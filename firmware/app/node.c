#include "app/node.h"

#include "app/saturate.h"

#include <stddef.h>

// The lasting memory of a node, its estimator included, on a controller: wider pointers take a little more.
_Static_assert(sizeof(hexload_node_t) <= (size_t)31 * 1024 || sizeof(void*) > (size_t)4 ||
                   HEXLOAD_LAG_TICKS_MAX > 82,
               "a node fits in 31 KiB");

// For functions with frames of their own: not parts of their caller, where these would lie on the stack while
// the estimator runs.
#if defined(__GNUC__)
#define APART __attribute__((noinline))
#else
#define APART
#endif

hexload_status_t hexload_node_init(hexload_node_t* self, const hexload_config_t* config,
                                   const hexload_app_settings_t* settings, hexload_bus_profile_t profile,
                                   const hexload_port_t* port) {
    const hexload_status_t status = hexload_app_init(&self->app, config, settings);
    if (status != HEXLOAD_OK) {
        return status;
    }
    self->port = *port;
    hexload_sample_assembly_init(&self->assembly, profile);
    self->answer = (hexload_bus_answer_t){0};
    self->status = (hexload_bus_controller_status_t){
        .version = {HEXLOAD_VERSION_MAJOR, HEXLOAD_VERSION_MINOR, HEXLOAD_VERSION_PATCH},
        .profile = (uint8_t)profile};
    self->age_ms = 0;
    self->clock_ms = 0;
    self->leg_silence_ms = 0;
    self->status_wait_ms = 0;
    self->send_failed = 0;
    self->health_seen = 0;
    self->answer_page = 0;
    self->status_page = 0;
    self->heard_controller = false;
    self->acknowledges = 0;
    self->command = (hexload_bus_command_t){0};
    self->challenge_wait_ms = HEXLOAD_NODE_CHALLENGE_MS;
    self->refusal_wait_ms = HEXLOAD_NODE_REFUSAL_MS;
    self->is_challenge_due = false;
    self->has_answer_codes = false;
    self->answer_code = (hexload_answer_code_t){0};
    const hexload_cipher_t cipher = {.context = port->context, .encrypt_block = port->aes128_encrypt_block};
    hexload_authentication_init(&self->authentication, &cipher, port->nonce_seed);
    self->strangers = (hexload_node_events_t){0};
    self->foreign = (hexload_node_events_t){0};
    self->late = (hexload_node_events_t){0};
    self->refused = (hexload_node_events_t){0};
    return HEXLOAD_OK;
}

bool hexload_node_is_active(const hexload_node_t* self) {
    return self->age_ms >= HEXLOAD_NODE_LISTEN_MS && !self->heard_controller;
}

/// Counts an event; those of more than a second ago are forgotten. @return how many there were.
static uint32_t note_event(const hexload_node_t* self, hexload_node_events_t* events) {
    if (self->clock_ms - events->since_ms >= HEXLOAD_NODE_MEMORY_MS) {
        *events = (hexload_node_events_t){.since_ms = self->clock_ms};
    }
    hexload_count(&events->count, 1);
    return events->count;
}

/// Whether there were at least so many in the last second or two.
static bool has_events(const hexload_node_t* self, const hexload_node_events_t* events, uint32_t least) {
    return events->count >= least && self->clock_ms - events->since_ms < 2u * HEXLOAD_NODE_MEMORY_MS;
}

static bool send(hexload_node_t* self, const hexload_bus_frame_t* frame) {
    const bool is_queued = self->port.send(self->port.context, frame);
    if (!is_queued) {
        hexload_count(&self->send_failed, 1);
    }
    return is_queued;
}

/// Takes the words about codes out of a START, unless the node has no key.
/// @return HEXLOAD_PACING_CODES and _ANSWER_CODES, or 0.
static uint32_t take_codes(const hexload_node_t* self, hexload_bus_command_t* command) {
    if (command->kind != (uint8_t)HEXLOAD_COMMAND_START ||
        !hexload_authentication_is_on(&self->authentication)) {
        return 0;
    }
    const uint32_t pacing = (uint32_t)command->argument; // the bus has a byte for it
    const uint32_t codes = pacing & ((uint32_t)HEXLOAD_PACING_CODES | (uint32_t)HEXLOAD_PACING_ANSWER_CODES);
    command->argument = (float)(pacing - codes);
    return codes;
}

static void begin_codes(hexload_node_t* self, uint32_t codes) {
    self->app.has_codes = (codes & (uint32_t)HEXLOAD_PACING_CODES) != 0u;
    self->has_answer_codes = (codes & (uint32_t)HEXLOAD_PACING_ANSWER_CODES) != 0u;
    self->is_proven = false;
    self->code_window = UINT32_MAX; // of no tick
    self->unproven = 0;
    hexload_sample_code_init(&self->code, &self->authentication.used);
    hexload_answer_code_init(&self->answer_code, self->assembly.profile, &self->authentication.used);
}

static APART void send_answer_code(hexload_node_t* self) {
    hexload_bus_frame_t frame;
    hexload_answer_code_encode(&self->answer_code, &self->authentication.cipher, &frame);
    (void)send(self, &frame);
}

/// Counts an answer's frames into their code, and sends that when it is due.
static APART void prove_answer(hexload_node_t* self, const hexload_bus_frame_t* frames, int count,
                               uint32_t tick) {
    for (int n = 0; n < count; n++) {
        hexload_answer_code_add(&self->answer_code, &self->authentication.cipher, &frames[n], n + 1 == count,
                                tick);
    }
    if (hexload_answer_code_is_due(&self->answer_code)) {
        send_answer_code(self);
    }
}

static APART void carry_out(hexload_node_t* self, hexload_bus_command_t* command) {
    const uint32_t codes = take_codes(self, command);
    hexload_bus_acknowledge_t acknowledge = {.profile = self->status.profile, .counter = self->acknowledges};
    hexload_bus_frame_t frame;
    self->acknowledges++;
    hexload_app_command(&self->app, command, &acknowledge);
    if (acknowledge.result == HEXLOAD_RESULT_DONE &&
        (command->kind == HEXLOAD_COMMAND_START || command->kind == HEXLOAD_COMMAND_RESET)) {
        hexload_sample_assembly_forgive(&self->assembly);
        begin_codes(self, codes);
        self->health_seen = 0;
    }
    if (command->kind == HEXLOAD_COMMAND_STOP && self->answer_code.has_frames) { // of the last answers
        send_answer_code(self);
    }
    self->answer_page = 0; // each run's answers begin with page 0, whatever was before it
    hexload_bus_encode_acknowledge(&acknowledge, &frame);
    (void)send(self, &frame);
}

/// Classic: the next page of the answer that is being sent; page 0 begins with this one, and has the health
/// bits of all samples since the one before. A change of fault does not wait for the round to end.
static int page_answer(hexload_node_t* self, const hexload_bus_answer_t* answer, hexload_bus_frame_t* frame) {
    if (answer->status == HEXLOAD_OK) {
        self->health_seen |= answer->health;
    }
    if (answer->tick % HEXLOAD_BUS_ANSWER_PERIOD != 0) {
        return 0;
    }
    if (self->answer_page == 0 || self->answer.fault != answer->fault) {
        self->answer = *answer;
        self->answer.health = self->health_seen;
        self->answer_page = 0;
        self->health_seen = 0;
    }
    self->answer.tick = answer->tick; // each page has the tick of the sample just processed
    const int count = hexload_bus_encode_answer(HEXLOAD_BUS_CLASSIC, &self->answer, self->answer_page, frame);
    self->answer_page = (uint8_t)((self->answer_page + 1) % hexload_bus_answer_pages(self->answer.filter));
    return count;
}

static APART void send_answer(hexload_node_t* self, const hexload_bus_answer_t* answer) {
    hexload_bus_frame_t frames[HEXLOAD_BUS_ANSWER_FRAMES];
    const int count = self->assembly.profile == HEXLOAD_BUS_CLASSIC
                          ? page_answer(self, answer, frames)
                          : hexload_bus_encode_answer(HEXLOAD_BUS_FD, answer, 0, frames);
    if (count < 0) { // a number that is not finite, which the estimator never gives
        hexload_count(&self->send_failed, 1);
    }
    for (int n = 0; n < count; n++) {
        (void)send(self, &frames[n]);
    }
    if (self->has_answer_codes) {
        prove_answer(self, frames, count, answer->tick);
    }
}

static int32_t period_us(const hexload_node_t* self) {
    return (int32_t)(self->app.config.tick_s * HEXLOAD_REAL(1e6) + HEXLOAD_REAL(0.5));
}

/// Remembers the least time that was left in a period. 0 stands for "not measured", so none left at all reads
/// -1.
static void note_time(hexload_node_t* self, uint32_t begin_us) {
    const uint32_t used_us = self->port.clock_us(self->port.context) - begin_us;
    const int32_t left_us = used_us < INT32_MAX ? period_us(self) - (int32_t)used_us : -INT32_MAX;
    if (self->status.time_margin_us == 0 || left_us < self->status.time_margin_us) {
        self->status.time_margin_us = left_us != 0 ? left_us : -1;
    }
}

/// Since START, saturating.
static uint16_t load_changes(const hexload_node_t* self) {
    const uint32_t count = hexload_app_health(&self->app)->count[HEXLOAD_HEALTH_LOAD_CHANGED];
    return count < UINT16_MAX ? (uint16_t)count : UINT16_MAX;
}

static APART void send_load_change(hexload_node_t* self) {
    const hexload_bus_load_change_t change = {.tick = self->app.change_tick,
                                              .load_changes = load_changes(self)};
    hexload_bus_frame_t frame;
    hexload_bus_encode_load_change(&change, &frame);
    (void)send(self, &frame);
}

/// Frames that the node did not take because others of their tick, or of later ones, had come before.
static void note_late(hexload_node_t* self, uint32_t frames) {
    uint32_t count = 0;
    for (uint32_t n = 0; n < frames; n++) {
        count = note_event(self, &self->late);
    }
    if (count >= (uint32_t)HEXLOAD_NODE_LATE_FRAMES) {
        hexload_app_set_fault(&self->app, HEXLOAD_FAULT_SECOND_SOURCE);
    }
}

/// Whether a sample comes after one that is of its tick or a later one, and was accepted: not so when a
/// source begins anew, which has nothing accepted in between.
static bool is_overtaken(const hexload_app_t* app, const hexload_bus_answer_t* answer) {
    return answer->status == HEXLOAD_ERR_TICK && app->refused_in_a_row == 1 &&
           app->last_tick - answer->tick <= UINT32_MAX / 2;
}

/// @return HEXLOAD_BUS_ERR_TICK for a sample that is not of the line of ticks that is followed. When it is
///         late the source may wait for the answer; when it is too far ahead it does not.
static hexload_bus_status_t process(hexload_node_t* self, const hexload_leg_sample_t* sample) {
    const bool has_clock = self->port.clock_us != NULL;
    const uint32_t begin_us = has_clock ? self->port.clock_us(self->port.context) : 0;
    hexload_bus_answer_t answer;
    hexload_app_sample(&self->app, sample, &answer);
    if (answer.status == HEXLOAD_OK && hexload_app_has_load_changed(&self->app, sample->tick)) {
        send_load_change(self);
    }
    if (is_overtaken(&self->app, &answer)) {
        note_late(self, HEXLOAD_LEGS);
    }
    const bool is_of_line = answer.status != HEXLOAD_ERR_TICK;
    if (!is_of_line && answer.tick - self->app.last_tick - 1u < UINT32_MAX / 2) {
        return HEXLOAD_BUS_ERR_TICK;
    }
    answer.missing_legs = self->assembly.missing_legs;
    if (has_events(self, &self->refused, HEXLOAD_NODE_MANY_REFUSED)) {
        answer.health |= (uint16_t)(1u << HEXLOAD_HEALTH_FRAMES_REFUSED);
    }
    send_answer(self, &answer);
    if (has_clock) {
        note_time(self, begin_us);
    }
    return is_of_line ? HEXLOAD_BUS_OK : HEXLOAD_BUS_ERR_TICK;
}

/// Counts a frame of a sample into the code. A run whose samples lack theirs for too long is not the source's
/// that started it.
static APART void prove(hexload_node_t* self, const hexload_bus_frame_t* frame, bool ends_tick,
                        uint32_t tick) {
    hexload_sample_code_add(&self->code, &self->authentication.cipher, frame, ends_tick, tick);
    if (ends_tick && tick / (uint32_t)HEXLOAD_BUS_CODE_TICKS != self->code_window) {
        self->code_window = tick / (uint32_t)HEXLOAD_BUS_CODE_TICKS;
        hexload_count(&self->unproven, 1);
        if (self->is_proven &&
            self->unproven > 1u) { // the window before lacks its code: as if all were refused
            self->refused = (hexload_node_events_t){self->clock_ms, HEXLOAD_NODE_MANY_REFUSED};
            hexload_count(&self->status.frames_refused, 1); // which stays when the remark is over
        }
        if (self->unproven > (uint32_t)HEXLOAD_NODE_UNPROVEN && hexload_app_is_running(&self->app)) {
            hexload_app_set_fault(&self->app, HEXLOAD_FAULT_NOT_AUTHENTICATED);
        }
    }
}

static hexload_bus_status_t take_sample_code(hexload_node_t* self, const hexload_bus_frame_t* frame) {
    const bool is_due = hexload_sample_code_is_due(&self->code);
    const hexload_bus_status_t status =
        hexload_sample_code_check(&self->code, &self->authentication.cipher, frame);
    if (status == HEXLOAD_BUS_OK) {
        self->unproven = 0;
        self->is_proven = true;
    } else if (status == HEXLOAD_BUS_ERR_AUTHENTICATION && is_due && self->is_proven &&
               hexload_app_is_running(&self->app)) { // of whole ticks: no accident does that
        hexload_app_set_fault(&self->app, HEXLOAD_FAULT_NOT_AUTHENTICATED);
    }
    return status;
}

static hexload_bus_status_t take_sample_frame(hexload_node_t* self, const hexload_bus_frame_t* frame) {
    hexload_leg_sample_t sample;
    const hexload_bus_status_t status = hexload_sample_assembly_add(&self->assembly, frame, &sample);
    if (status == HEXLOAD_BUS_OK && hexload_node_is_active(self) &&
        process(self, &sample) == HEXLOAD_BUS_ERR_TICK) {
        return HEXLOAD_BUS_ERR_TICK;
    }
    if (status == HEXLOAD_BUS_OK || status == HEXLOAD_BUS_PARTIAL) {
        self->leg_silence_ms = 0;
        if (self->app.has_codes) {
            prove(self, frame, status == HEXLOAD_BUS_OK, status == HEXLOAD_BUS_OK ? sample.tick : 0);
        }
    }
    if (status == HEXLOAD_BUS_ERR_PROFILE &&
        note_event(self, &self->foreign) >= (uint32_t)HEXLOAD_NODE_STRANGERS) {
        hexload_app_set_fault(&self->app, HEXLOAD_FAULT_WRONG_PROFILE);
    }
    if (status == HEXLOAD_BUS_ERR_CONTRADICTION && hexload_app_is_running(&self->app)) {
        hexload_app_set_fault(&self->app, HEXLOAD_FAULT_SECOND_SOURCE);
    } else if (status == HEXLOAD_BUS_ERR_TICK && hexload_app_is_running(&self->app) &&
               self->assembly.profile == HEXLOAD_BUS_CLASSIC) { // FD: an echo, which says nothing new
        note_late(self, 1);
    }
    return status;
}

/// A frame that only a controller sends: one alone may be anybody's mistake.
static hexload_bus_status_t hear_controller(hexload_node_t* self, const hexload_bus_frame_t* frame) {
    const hexload_bus_status_t status = hexload_bus_check_controller(frame);
    if (status == HEXLOAD_BUS_OK && note_event(self, &self->strangers) >= (uint32_t)HEXLOAD_NODE_STRANGERS) {
        if (self->age_ms < HEXLOAD_NODE_LISTEN_MS) {
            self->heard_controller = true;
        }
        hexload_app_set_fault(&self->app, HEXLOAD_FAULT_SECOND_CONTROLLER);
    }
    return status;
}

/// Whether a command has a new counter, or comes from another session than the last one.
static hexload_bus_status_t check_counter(const hexload_bus_command_t* last,
                                          const hexload_bus_command_t* command) {
    if (last->kind == 0 || command->source != last->source || command->session != last->session ||
        command->sequence != last->sequence) {
        return HEXLOAD_BUS_OK;
    }
    const bool is_echo = command->kind == last->kind && command->argument == last->argument &&
                         command->configuration == last->configuration;
    return is_echo ? HEXLOAD_BUS_ERR_TICK : HEXLOAD_BUS_ERR_CONTRADICTION;
}

static void send_challenge(hexload_node_t* self) {
    hexload_bus_frame_t frame;
    hexload_bus_encode_challenge(&self->authentication.nonce, &frame);
    self->challenge_wait_ms = 0;
    self->is_challenge_due = false;
    (void)send(self, &frame);
}

/// Says that a command lacks the key's code, not too often.
static APART void refuse(hexload_node_t* self, const hexload_bus_command_t* command) {
    if (self->refusal_wait_ms < (uint32_t)HEXLOAD_NODE_REFUSAL_MS) {
        return;
    }
    hexload_bus_acknowledge_t acknowledge = {.kind = command->kind,
                                             .source = command->source,
                                             .session = command->session,
                                             .sequence = command->sequence,
                                             .counter = self->acknowledges,
                                             .result = HEXLOAD_RESULT_NOT_AUTHENTICATED,
                                             .state = (uint8_t)self->app.state,
                                             .fault = (uint8_t)self->app.fault,
                                             .profile = self->status.profile};
    hexload_bus_frame_t frame;
    self->acknowledges++;
    self->refusal_wait_ms = 0;
    hexload_bus_encode_acknowledge(&acknowledge, &frame);
    (void)send(self, &frame);
}

/// A frame of a command to a controller with a key.
/// @param[out] command with HEXLOAD_BUS_OK.
static APART hexload_bus_status_t authenticate(hexload_node_t* self, const hexload_bus_frame_t* frame,
                                               hexload_bus_command_t* command) {
    const uint64_t nonces = self->authentication.nonces;
    hexload_bus_status_t status = hexload_bus_decode_command(frame, command);
    if (status == HEXLOAD_BUS_OK && command->kind == (uint8_t)HEXLOAD_COMMAND_CHALLENGE) {
        self->is_challenge_due = true;
        return HEXLOAD_BUS_PARTIAL;
    }
    status = hexload_authentication_take(&self->authentication, frame, command);
    if (self->authentication.nonces != nonces) { // before the acknowledge: who has that can go on
        send_challenge(self);
    }
    if (status == HEXLOAD_BUS_ERR_AUTHENTICATION && command->kind != 0u) {
        refuse(self, command);
    }
    return status;
}

static hexload_bus_status_t take_command(hexload_node_t* self, const hexload_bus_frame_t* frame) {
    hexload_bus_command_t command;
    hexload_bus_status_t status =
        hexload_authentication_is_on(&self->authentication) && hexload_node_is_active(self)
            ? authenticate(self, frame, &command)
            : hexload_bus_decode_command(frame, &command);
    if (status != HEXLOAD_BUS_OK || !hexload_node_is_active(self)) {
        return status;
    }
    status = check_counter(&self->command, &command);
    if (status == HEXLOAD_BUS_OK) {
        self->command = command;
        carry_out(self, &command);
    } else if (status == HEXLOAD_BUS_ERR_CONTRADICTION && hexload_app_is_running(&self->app)) {
        hexload_app_set_fault(&self->app, HEXLOAD_FAULT_SECOND_SOURCE);
    }
    return status;
}

static void count_refused(hexload_node_t* self) {
    hexload_count(&self->status.frames_refused, 1);
    (void)note_event(self, &self->refused);
}

void hexload_node_receive(hexload_node_t* self, const hexload_bus_frame_t* frame) {
    hexload_bus_status_t status = hear_controller(self, frame);
    if (status == HEXLOAD_BUS_OTHER) {
        status = take_command(self, frame);
    }
    if (status == HEXLOAD_BUS_OTHER && self->app.has_codes) {
        status = take_sample_code(self, frame);
    }
    if (status == HEXLOAD_BUS_OTHER) {
        status = take_sample_frame(self, frame);
    }
    if (status < 0) {
        count_refused(self);
    }
}

static void send_status(hexload_node_t* self) {
    hexload_bus_controller_status_t* status = &self->status;
    const int page = self->status_page;
    hexload_bus_frame_t frame;
    status->state = (uint8_t)self->app.state;
    status->fault = (uint8_t)self->app.fault;
    status->tick = self->app.last_tick;
    status->samples_missing = self->app.samples_missing;
    status->samples_refused = hexload_app_health(&self->app)->refused;
    status->load_changes = load_changes(self);
    status->input = hexload_app_health(&self->app)->input;
    status->configuration = self->app.configuration;
    status->known_mass_kg = (float)hexload_app_known_mass_kg(&self->app);
    if (self->port.stack_margin_bytes != NULL) {
        status->stack_margin_bytes = self->port.stack_margin_bytes(self->port.context);
    }
    hexload_bus_encode_status(status, page, &frame);
    status->counter++;
    if (send(self, &frame) && page == HEXLOAD_BUS_TIME_MARGIN_PAGE) {
        status->time_margin_us = 0;
    }
    self->status_page = (uint8_t)((page + 1) % HEXLOAD_BUS_STATUS_PAGES);
}

/// Of commands to a controller with a key: what does not wait any longer, and the challenge that was asked
/// for.
static void elapse_authentication(hexload_node_t* self, uint32_t periods) {
    hexload_bus_command_t command;
    hexload_count(&self->challenge_wait_ms, periods);
    hexload_count(&self->refusal_wait_ms, periods);
    if (hexload_authentication_elapse(&self->authentication, periods, &command)) {
        count_refused(self);
        refuse(self, &command);
    }
    if (self->is_challenge_due && self->challenge_wait_ms >= (uint32_t)HEXLOAD_NODE_CHALLENGE_MS) {
        send_challenge(self);
    }
}

/// Rounded up, and two at least, as a silence of one count may be none.
static uint32_t lost_after_ms(const hexload_node_t* self) {
    const int32_t silence_us = (int32_t)HEXLOAD_NODE_TICK_LOST * period_us(self);
    return (uint32_t)(2 + ((silence_us - 1001) / 1000));
}

void hexload_node_period(hexload_node_t* self, uint32_t periods) {
    if (periods == 0) {
        return;
    }
    hexload_count(&self->status.overruns, periods - 1);
    hexload_count(&self->age_ms, periods);
    self->clock_ms += periods;
    hexload_count(&self->leg_silence_ms, periods);
    hexload_count(&self->status_wait_ms, periods);
    hexload_app_elapse(&self->app, periods);
    if (hexload_authentication_is_on(&self->authentication)) {
        elapse_authentication(self, periods);
    }
    if (self->app.pacing == HEXLOAD_PACING_REAL_TIME && self->leg_silence_ms >= lost_after_ms(self)) {
        hexload_sample_assembly_lose_tick(&self->assembly);
    }
    if (self->status_wait_ms >= HEXLOAD_NODE_STATUS_PERIOD_MS && hexload_node_is_active(self)) {
        self->status_wait_ms = 0;
        send_status(self);
    }
}

void hexload_node_bus_state(hexload_node_t* self, bool is_up) {
    if (!is_up) {
        hexload_app_set_fault(&self->app, HEXLOAD_FAULT_BUS_DOWN);
        hexload_sample_assembly_lose_tick(&self->assembly);
    } else if (self->app.fault == HEXLOAD_FAULT_BUS_DOWN) {
        const hexload_bus_command_t reset = {.kind = HEXLOAD_COMMAND_RESET};
        hexload_bus_acknowledge_t unused;
        hexload_app_command(&self->app, &reset, &unused);
        hexload_sample_assembly_forgive(&self->assembly);
    }
}
