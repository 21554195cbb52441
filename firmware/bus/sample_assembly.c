#include "bus/sample_assembly.h"

#include "bus/sample_frames.h"

#include <math.h>
#include <string.h>

enum { ALL_LEGS = (1 << HEXLOAD_LEGS) - 1 };

/// Ticks that a leg frame may be ahead of the last one; the rest of the four-bit range is behind it.
enum { FARTHEST_AHEAD = HEXLOAD_BUS_TICK_PERIOD / 2 };

void hexload_sample_assembly_init(hexload_sample_assembly_t* self, hexload_bus_profile_t profile) {
    *self = (hexload_sample_assembly_t){.profile = profile, .legs = ALL_LEGS};
}

/// Ends the present tick: if legs are missing, the sample is given up.
static void end_tick(hexload_sample_assembly_t* self) {
    const bool is_reported = self->legs != ALL_LEGS && !self->is_forgiven;
    const uint8_t legs = self->legs;
    self->legs = ALL_LEGS;
    self->is_forgiven = false;
    if (!is_reported) {
        return;
    }
    self->missing_legs = (uint8_t)(ALL_LEGS & ~legs);
    if (self->incomplete < UINT32_MAX) {
        self->incomplete++;
    }
}

static void begin_tick(hexload_sample_assembly_t* self, uint32_t tick) {
    end_tick(self);
    self->sample.tick = tick;
    self->legs = 0;
}

void hexload_sample_assembly_lose_tick(hexload_sample_assembly_t* self) {
    end_tick(self);
    self->has_tick = false;
}

void hexload_sample_assembly_forgive(hexload_sample_assembly_t* self) {
    self->missing_legs = 0;
    self->is_forgiven = true;
    self->has_tick = self->has_tick && self->profile == HEXLOAD_BUS_CLASSIC;
}

/// Whether numbers are the same, or both are none.
static bool is_same(hexload_real_t a, hexload_real_t b) {
    return a == b || (isnan(a) && isnan(b));
}

/// Of a leg that has come already in this tick: an echo, or another source.
static hexload_bus_status_t refuse_doubled(const hexload_sample_assembly_t* self,
                                           const hexload_leg_frame_t* leg) {
    const bool is_echo = is_same(leg->displacement_m, self->sample.displacement_m[leg->leg]) &&
                         is_same(leg->velocity_m_s, self->sample.velocity_m_s[leg->leg]) &&
                         is_same(leg->force_n, self->sample.force_n[leg->leg]);
    return is_echo ? HEXLOAD_BUS_ERR_TICK : HEXLOAD_BUS_ERR_CONTRADICTION;
}

static hexload_bus_status_t add_leg(hexload_sample_assembly_t* self, const hexload_leg_frame_t* leg,
                                    hexload_leg_sample_t* sample) {
    if (!self->has_tick) {
        return HEXLOAD_BUS_PARTIAL;
    }
    const uint32_t ahead = (leg->tick_low - self->sample.tick) % HEXLOAD_BUS_TICK_PERIOD;
    const uint8_t bit = (uint8_t)(1u << leg->leg);
    if (ahead > FARTHEST_AHEAD) {
        return HEXLOAD_BUS_ERR_TICK;
    }
    if (ahead == 0 && (self->legs & bit) != 0) {
        return refuse_doubled(self, leg);
    }
    if (ahead > 0) {
        begin_tick(self, self->sample.tick + ahead);
    }
    self->legs = (uint8_t)(self->legs | bit);
    self->sample.displacement_m[leg->leg] = leg->displacement_m;
    self->sample.velocity_m_s[leg->leg] = leg->velocity_m_s;
    self->sample.force_n[leg->leg] = leg->force_n;
    if (self->legs != ALL_LEGS) {
        return HEXLOAD_BUS_PARTIAL;
    }
    sample->tick = self->sample.tick;
    memcpy(sample->displacement_m, self->sample.displacement_m, sizeof sample->displacement_m);
    memcpy(sample->velocity_m_s, self->sample.velocity_m_s, sizeof sample->velocity_m_s);
    memcpy(sample->force_n, self->sample.force_n, sizeof sample->force_n);
    return HEXLOAD_BUS_OK;
}

/// Whether a whole tick follows one that the legs did not count. When both are ahead, the legs must also have
/// counted on meanwhile as far as a source goes between two of them, which confirms them where it is.
static bool follows_claim(const hexload_sample_assembly_t* self, uint32_t tick) {
    const bool is_behind = tick - self->sample.tick > UINT32_MAX / 2;
    const uint16_t counted = (uint16_t)(self->sample.tick - self->claim_at);
    return self->has_claim && tick - self->claim == HEXLOAD_BUS_TICK_PERIOD &&
           (is_behind || counted >= (uint16_t)HEXLOAD_BUS_TICK_PERIOD);
}

static void make_claim(hexload_sample_assembly_t* self, uint32_t tick) {
    self->has_claim = true;
    self->claim = tick;
    self->claim_at = (uint16_t)self->sample.tick;
}

/// The whole tick is believed when nothing is known yet, or a run begins; then it only confirms what the
/// legs' four bits count, and another one is believed when the one that follows it comes too. If that is
/// behind, others have driven the count ahead of the source.
static hexload_bus_status_t add_whole_tick(hexload_sample_assembly_t* self, uint32_t tick) {
    const uint32_t ahead = tick - self->sample.tick;
    const bool is_known = self->has_tick && !self->is_forgiven;
    if (is_known && ahead > 0 && ahead <= HEXLOAD_BUS_TICK_PERIOD) {
        self->has_claim = false;
        return HEXLOAD_BUS_PARTIAL;
    }
    if (is_known && !follows_claim(self, tick)) {
        if (ahead != 0) {
            make_claim(self, tick);
        }
        return HEXLOAD_BUS_ERR_TICK;
    }
    self->has_claim = false;
    begin_tick(self, tick);
    self->has_tick = true;
    return is_known && ahead > UINT32_MAX / 2 ? HEXLOAD_BUS_ERR_CONTRADICTION : HEXLOAD_BUS_PARTIAL;
}

static hexload_bus_status_t add_classic(hexload_sample_assembly_t* self, const hexload_bus_frame_t* frame,
                                        hexload_leg_sample_t* sample) {
    hexload_leg_frame_t leg;
    hexload_bus_status_t status = hexload_sample_decode_leg(frame, &leg);
    if (status == HEXLOAD_BUS_OK) {
        return add_leg(self, &leg, sample);
    }
    if (status != HEXLOAD_BUS_OTHER) {
        return status;
    }
    uint32_t tick = 0;
    status = hexload_sample_decode_tick(frame, &tick);
    if (status != HEXLOAD_BUS_OK) {
        return status;
    }
    return add_whole_tick(self, tick);
}

/// The checksum of a frame tells whether a tick that comes twice has the same numbers.
static hexload_bus_status_t add_fd(hexload_sample_assembly_t* self, const hexload_bus_frame_t* frame,
                                   hexload_leg_sample_t* sample) {
    hexload_leg_sample_t found;
    uint32_t crc = 0;
    const hexload_bus_status_t status = hexload_sample_decode_fd(frame, &found);
    if (status != HEXLOAD_BUS_OK) {
        return status;
    }
    memcpy(&crc, &frame->data[HEXLOAD_BUS_FRAME_BYTES - sizeof crc], sizeof crc);
    if (self->has_tick && found.tick == self->sample.tick) {
        return crc == self->crc ? HEXLOAD_BUS_ERR_TICK : HEXLOAD_BUS_ERR_CONTRADICTION;
    }
    self->has_tick = true;
    self->sample.tick = found.tick;
    self->crc = crc;
    *sample = found;
    return HEXLOAD_BUS_OK;
}

hexload_bus_status_t hexload_sample_assembly_add(hexload_sample_assembly_t* self,
                                                 const hexload_bus_frame_t* frame,
                                                 hexload_leg_sample_t* sample) {
    const hexload_bus_status_t status =
        self->profile == HEXLOAD_BUS_FD ? add_fd(self, frame, sample) : add_classic(self, frame, sample);
    return status == HEXLOAD_BUS_OTHER ? hexload_sample_check_profile(frame, self->profile) : status;
}
