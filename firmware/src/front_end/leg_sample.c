#include "front_end/leg_sample.h"

#include "algebra/real.h"
#include "configuration/health.h"

#include <stdbool.h>
#include <string.h>

void hexload_leg_sample_init(hexload_leg_gate_t* self) {
    *self = (hexload_leg_gate_t){0};
}

/// |value| <= range; false for NaN.
static bool is_within(hexload_real_t value, hexload_real_t range) {
    return hexload_abs(value) <= range;
}

static bool is_within_ranges(const hexload_sensors_t* sensors, const hexload_leg_sample_t* sample) {
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        if (!is_within(sample->velocity_m_s[leg], sensors->velocity_range_m_s) ||
            !is_within(sample->force_n[leg], sensors->force_range_n)) {
            return false;
        }
    }
    return true;
}

/// Beyond the stroke, where a leg must still be one.
static bool has_legs(const hexload_geometry_t* geometry, const hexload_leg_sample_t* sample) {
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        if (!(sample->displacement_m[leg] > -geometry->home_leg_length_m[leg]) ||
            !isfinite(sample->displacement_m[leg])) {
            return false;
        }
    }
    return true;
}

static bool is_within_stroke(const hexload_geometry_t* geometry, const hexload_leg_sample_t* sample) {
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        if (!(sample->displacement_m[leg] >= geometry->stroke_min_m &&
              sample->displacement_m[leg] <= geometry->stroke_max_m)) { // also refuses NaN
            return false;
        }
    }
    return true;
}

/// Whether the legs can have come here in that time.
static bool is_within_reach(const hexload_leg_gate_t* self, const hexload_config_t* config,
                            const hexload_leg_sample_t* sample, uint32_t gap_ticks) {
    const hexload_sensors_t* sensors = &config->sensors;
    const hexload_real_t gap_s = config->tick_s * (hexload_real_t)gap_ticks;
    const hexload_real_t reach_m =
        hexload_fma(sensors->velocity_range_m_s, gap_s, HEXLOAD_REACH_SIGMAS * sensors->displacement_sigma_m);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        if (!is_within(sample->displacement_m[leg] - self->last_displacement_m[leg], reach_m)) {
            return false;
        }
    }
    return true;
}

hexload_status_t hexload_leg_sample_check(const hexload_leg_gate_t* self, const hexload_config_t* config,
                                          const hexload_leg_sample_t* sample, uint32_t* gap_ticks,
                                          uint32_t* health) {
    const bool is_in_stroke = is_within_stroke(&config->geometry, sample);
    if (!is_within_ranges(&config->sensors, sample) ||
        (!is_in_stroke && !has_legs(&config->geometry, sample))) {
        return HEXLOAD_ERR_SAMPLE;
    }
    *gap_ticks = 0;
    if (self->accepted > 0) {
        *gap_ticks = sample->tick - self->last_tick; // modulo 2^32: a counter that wraps goes on
        if (*gap_ticks == 0 || *gap_ticks > UINT32_MAX / 2) {
            return HEXLOAD_ERR_TICK;
        }
        if (!is_within_reach(self, config, sample, *gap_ticks)) {
            return HEXLOAD_ERR_SAMPLE;
        }
    }
    if (*gap_ticks > 1) {
        hexload_health_set(health, HEXLOAD_HEALTH_SAMPLE_MISSING);
    }
    if (!is_in_stroke) {
        hexload_health_set(health, HEXLOAD_HEALTH_LEG_OUT_OF_STROKE);
    }
    return HEXLOAD_OK;
}

void hexload_leg_sample_accept(hexload_leg_gate_t* self, const hexload_leg_sample_t* sample) {
    memcpy(self->last_displacement_m, sample->displacement_m, sizeof self->last_displacement_m);
    self->last_tick = sample->tick;
    if (self->accepted < UINT32_MAX) {
        self->accepted++;
    }
}
