#include "hexload/leg_sample.h"

#include <stdbool.h>

void hexload_leg_sample_init(hexload_leg_gate_t* self) {
    self->last_tick = 0;
    self->accepted = 0;
}

/// |value| <= range; false for NaN.
static bool is_within(hexload_real_t value, hexload_real_t range) {
    return hexload_abs(value) <= range;
}

static bool is_usable(const hexload_config_t* config, const hexload_leg_sample_t* sample) {
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        const hexload_real_t home_m = config->geometry.home_leg_length_m[leg];
        if (!(sample->displacement_m[leg] > -home_m) || !isfinite(sample->displacement_m[leg]) ||
            !is_within(sample->velocity_m_s[leg], config->sensors.velocity_range_m_s) ||
            !is_within(sample->force_n[leg], config->sensors.force_range_n)) {
            return false;
        }
    }
    return true;
}

static bool is_within_stroke(const hexload_geometry_t* geometry, const hexload_leg_sample_t* sample) {
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        if (sample->displacement_m[leg] < geometry->stroke_min_m ||
            sample->displacement_m[leg] > geometry->stroke_max_m) {
            return false;
        }
    }
    return true;
}

hexload_status_t hexload_leg_sample_check(const hexload_leg_gate_t* self, const hexload_config_t* config,
                                          const hexload_leg_sample_t* sample, uint32_t* gap_ticks,
                                          uint32_t* health) {
    if (!is_usable(config, sample)) {
        return HEXLOAD_ERR_SAMPLE;
    }
    *gap_ticks = 0;
    if (self->accepted > 0) {
        *gap_ticks = sample->tick - self->last_tick; // modulo 2^32: a counter that wraps goes on
        if (*gap_ticks == 0 || *gap_ticks > UINT32_MAX / 2) {
            return HEXLOAD_ERR_TICK;
        }
    }
    if (*gap_ticks > 1) {
        hexload_health_set(health, HEXLOAD_HEALTH_SAMPLE_MISSING);
    }
    if (!is_within_stroke(&config->geometry, sample)) {
        hexload_health_set(health, HEXLOAD_HEALTH_LEG_OUT_OF_STROKE);
    }
    return HEXLOAD_OK;
}

void hexload_leg_sample_accept(hexload_leg_gate_t* self, const hexload_leg_sample_t* sample) {
    self->last_tick = sample->tick;
    if (self->accepted < UINT32_MAX) {
        self->accepted++;
    }
}
