#include "bus/answer_assembly.h"

#include "bus/answer_frames.h"

static uint32_t all_of(int parts) {
    return (UINT32_C(1) << parts) - 1;
}

static uint32_t all_parts(const hexload_answer_assembly_t* self) {
    return all_of(self->profile == HEXLOAD_BUS_FD ? HEXLOAD_BUS_ANSWER_FRAMES
                                                  : hexload_bus_answer_pages(self->answer.filter));
}

/// Farther apart, a whole round of pages may have been lost between two pages that seem to follow one
/// another.
static uint32_t longest_page_step_ticks(uint8_t filter) {
    return (uint32_t)hexload_bus_answer_pages(filter) * HEXLOAD_BUS_ANSWER_PERIOD;
}

void hexload_answer_assembly_init(hexload_answer_assembly_t* self, hexload_bus_profile_t profile) {
    *self = (hexload_answer_assembly_t){.profile = profile, .answer = {.input = {.leg = HEXLOAD_LEGS}}};
}

/// Gives up an answer that has begun and is not whole.
static void give_up(hexload_answer_assembly_t* self) {
    if (self->parts != 0 && self->parts != all_parts(self) && self->incomplete < UINT32_MAX) {
        self->incomplete++;
    }
    self->parts = 0;
}

static hexload_bus_status_t add_fd(hexload_answer_assembly_t* self, const hexload_bus_frame_t* frame,
                                   uint32_t* answered_tick, hexload_bus_answer_t* answer) {
    hexload_bus_answer_t next = self->answer;
    int part = 0;
    const hexload_bus_status_t status = hexload_answer_decode_fd(frame, &part, &next);
    if (status != HEXLOAD_BUS_OK) {
        return status;
    }
    const uint32_t bit = UINT32_C(1) << part;
    const uint32_t ahead = next.tick - self->answer.tick;
    const bool is_doubled = ahead == 0 && (self->parts & bit) != 0;
    // an estimate begins an answer anew, also of an earlier tick: the source of samples may have restarted
    const bool begins_anew = part == HEXLOAD_ANSWER_ESTIMATE && (is_doubled || ahead != 0);
    if (!begins_anew && self->parts != 0 && (is_doubled || ahead > UINT32_MAX / 2)) {
        return HEXLOAD_BUS_ERR_TICK;
    }
    if (!begins_anew && self->parts != 0 && ahead == 0 && next.filter != self->answer.filter) {
        return HEXLOAD_BUS_ERR_VALUE; // one answer is one filter's
    }
    if (begins_anew || ahead != 0) {
        give_up(self);
    }
    self->answer = next;
    self->parts |= bit;
    *answered_tick = next.tick;
    if (self->parts != all_parts(self)) {
        return HEXLOAD_BUS_PARTIAL;
    }
    *answer = self->answer; // what still comes of this tick is late
    return HEXLOAD_BUS_OK;
}

/// The tick with these low 14 bits that is nearest to near_tick.
static uint32_t whole_tick(uint16_t tick_low, uint32_t near_tick) {
    const uint32_t half = HEXLOAD_ANSWER_TICKS / 2;
    const uint32_t ahead = (tick_low - near_tick + half) % HEXLOAD_ANSWER_TICKS; // the distance plus half
    return near_tick + ahead - half;
}

static hexload_bus_status_t add_page(hexload_answer_assembly_t* self, const hexload_bus_frame_t* frame,
                                     uint32_t near_tick, uint32_t* answered_tick,
                                     hexload_bus_answer_t* answer) {
    hexload_bus_answer_t next = self->answer;
    int page = 0;
    uint16_t tick_low = 0;
    const hexload_bus_status_t status = hexload_answer_decode_page(frame, &page, &tick_low, &next);
    if (status != HEXLOAD_BUS_OK) {
        return status;
    }
    const uint32_t tick = whole_tick(tick_low, near_tick);
    const uint32_t ahead = tick - self->page_tick;
    if (page == 0) {
        give_up(self);
        next.tick = tick;
    } else if (self->parts != 0 && (ahead == 0 || ahead > UINT32_MAX / 2)) {
        return HEXLOAD_BUS_ERR_TICK;
    } else if (page < 0 || self->parts != all_of(page) || ahead > longest_page_step_ticks(next.filter)) {
        give_up(self); // pages were lost: wait for the next page 0
        *answered_tick = tick;
        return HEXLOAD_BUS_PARTIAL;
    }
    self->answer = next;
    self->page_tick = tick;
    self->parts |= UINT32_C(1) << page;
    *answered_tick = tick;
    if (self->parts != all_parts(self)) {
        return HEXLOAD_BUS_PARTIAL;
    }
    *answer = self->answer;
    return HEXLOAD_BUS_OK;
}

hexload_bus_status_t hexload_answer_assembly_add(hexload_answer_assembly_t* self,
                                                 const hexload_bus_frame_t* frame, uint32_t near_tick,
                                                 uint32_t* answered_tick, hexload_bus_answer_t* answer) {
    const hexload_bus_status_t status = self->profile == HEXLOAD_BUS_FD
                                            ? add_fd(self, frame, answered_tick, answer)
                                            : add_page(self, frame, near_tick, answered_tick, answer);
    return status == HEXLOAD_BUS_OTHER ? hexload_answer_check_profile(frame, self->profile) : status;
}
