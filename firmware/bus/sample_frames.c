#include "bus/sample_frames.h"

#include "bus/frame.h"

#include <hexload_dbc.h>
#include <math.h>

static const hexload_frame_layout_t fd_layout = {HEXLOAD_DBC_LEG_SAMPLE_FD_FRAME_ID,
                                                 HEXLOAD_DBC_LEG_SAMPLE_FD_LENGTH};
static const hexload_frame_layout_t tick_layout = {HEXLOAD_DBC_SAMPLE_TICK_FRAME_ID,
                                                   HEXLOAD_DBC_SAMPLE_TICK_LENGTH};

// The six leg frames differ in the identifier only: the codec of leg 1 serves all.
_Static_assert(HEXLOAD_DBC_LEG_SAMPLE6_FRAME_ID - HEXLOAD_DBC_LEG_SAMPLE1_FRAME_ID == HEXLOAD_LEGS - 1,
               "identifiers of the leg frames follow one another");
_Static_assert((int)HEXLOAD_DBC_LEG_SAMPLE_FD_LENGTH == (int)HEXLOAD_BUS_FRAME_BYTES,
               "the largest frame of the contract");

static hexload_frame_layout_t leg_layout(int leg) {
    const hexload_frame_layout_t layout = {HEXLOAD_DBC_LEG_SAMPLE1_FRAME_ID + (uint32_t)leg,
                                           HEXLOAD_DBC_LEG_SAMPLE1_LENGTH};
    return layout;
}

/// Steps and range of one profile's channels, in all legs alike. The range is symmetric: the one number that
/// it leaves unused says that there is no sensor, or that it has failed.
typedef struct scale {
    hexload_real_t displacement_m;
    hexload_real_t velocity_m_s;
    hexload_real_t force_n;
    int32_t largest_displacement; ///< steps
    int32_t largest_velocity;
    int32_t largest_force;
} scale_t;

typedef struct raw_legs {
    int32_t displacement[HEXLOAD_LEGS];
    int32_t velocity[HEXLOAD_LEGS];
    int32_t force[HEXLOAD_LEGS];
} raw_legs_t;

static scale_t fd_scale(void) {
    const scale_t scale = {.displacement_m =
                               (hexload_real_t)hexload_dbc_leg_sample_fd_displacement_1_decode(1),
                           .velocity_m_s = (hexload_real_t)hexload_dbc_leg_sample_fd_velocity_1_decode(1),
                           .force_n = (hexload_real_t)hexload_dbc_leg_sample_fd_force_1_decode(1),
                           .largest_displacement = (INT32_C(1) << 23) - 1,
                           .largest_velocity = (INT32_C(1) << 23) - 1,
                           .largest_force = (INT32_C(1) << 23) - 1};
    return scale;
}

static scale_t classic_scale(void) {
    const scale_t scale = {.displacement_m = (hexload_real_t)hexload_dbc_leg_sample1_displacement_decode(1),
                           .velocity_m_s = (hexload_real_t)hexload_dbc_leg_sample1_velocity_decode(1),
                           .force_n = (hexload_real_t)hexload_dbc_leg_sample1_force_decode(1),
                           .largest_displacement = (INT32_C(1) << 18) - 1,
                           .largest_velocity = (INT32_C(1) << 14) - 1,
                           .largest_force = (INT32_C(1) << 17) - 1};
    return scale;
}

/// The nearest number of steps; beyond the range its end, counted. NaN, of a leg without sensor, is the one
/// number of steps beyond the range.
static int32_t quantise(hexload_real_t value, hexload_real_t step, int32_t largest, uint32_t* saturated) {
    const hexload_real_t steps = value / step;
    const hexload_real_t half = HEXLOAD_REAL(0.5);
    const hexload_real_t limit = (hexload_real_t)largest + half;
    if (isnan(steps) != 0) {
        return -largest - 1;
    }
    if (steps >= limit || steps <= -limit) {
        *saturated += *saturated < UINT32_MAX ? 1u : 0u;
        return steps > 0 ? largest : -largest;
    }
    return (int32_t)(steps + (steps > 0 ? half : -half));
}

static raw_legs_t quantise_legs(const hexload_leg_sample_t* sample, const scale_t* scale,
                                uint32_t* saturated) {
    raw_legs_t raw;
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        raw.displacement[leg] = quantise(sample->displacement_m[leg], scale->displacement_m,
                                         scale->largest_displacement, saturated);
        raw.velocity[leg] =
            quantise(sample->velocity_m_s[leg], scale->velocity_m_s, scale->largest_velocity, saturated);
        raw.force[leg] = quantise(sample->force_n[leg], scale->force_n, scale->largest_force, saturated);
    }
    return raw;
}

static bool has_infinite(const hexload_leg_sample_t* sample) {
    bool is_infinite = false;
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        is_infinite = is_infinite || isinf(sample->displacement_m[leg]) || isinf(sample->velocity_m_s[leg]) ||
                      isinf(sample->force_n[leg]);
    }
    return is_infinite;
}

static int encode_fd(const hexload_leg_sample_t* sample, hexload_bus_frame_t* frame, uint32_t* saturated) {
    const scale_t scale = fd_scale();
    const raw_legs_t raw = quantise_legs(sample, &scale, saturated);
    const struct hexload_dbc_leg_sample_fd_t message = {
        .tick = sample->tick,
        .displacement_1 = raw.displacement[0],
        .displacement_2 = raw.displacement[1],
        .displacement_3 = raw.displacement[2],
        .displacement_4 = raw.displacement[3],
        .displacement_5 = raw.displacement[4],
        .displacement_6 = raw.displacement[5],
        .velocity_1 = raw.velocity[0],
        .velocity_2 = raw.velocity[1],
        .velocity_3 = raw.velocity[2],
        .velocity_4 = raw.velocity[3],
        .velocity_5 = raw.velocity[4],
        .velocity_6 = raw.velocity[5],
        .force_1 = raw.force[0],
        .force_2 = raw.force[1],
        .force_3 = raw.force[2],
        .force_4 = raw.force[3],
        .force_5 = raw.force[4],
        .force_6 = raw.force[5],
        .version = HEXLOAD_DBC_LEG_SAMPLE_FD_VERSION_V2_CHOICE,
    };
    hexload_frame_begin(frame, &fd_layout);
    (void)hexload_dbc_leg_sample_fd_pack(frame->data, &message, sizeof frame->data);
    hexload_frame_seal(frame, &fd_layout);
    return 1;
}

/// The counter of the frames with the whole tick.
static uint8_t tick_counter(uint32_t tick) {
    return hexload_frame_counter(tick / HEXLOAD_BUS_TICK_PERIOD);
}

static void encode_tick(uint32_t tick, hexload_bus_frame_t* frame) {
    const struct hexload_dbc_sample_tick_t message = {
        .counter = tick_counter(tick), .version = HEXLOAD_DBC_SAMPLE_TICK_VERSION_V2_CHOICE, .tick = tick};
    hexload_frame_begin(frame, &tick_layout);
    (void)hexload_dbc_sample_tick_pack(frame->data, &message, sizeof frame->data);
    hexload_frame_seal(frame, &tick_layout);
}

static int encode_classic(const hexload_leg_sample_t* sample, hexload_bus_frame_t* frames,
                          uint32_t* saturated) {
    const scale_t scale = classic_scale();
    const raw_legs_t raw = quantise_legs(sample, &scale, saturated);
    int count = 0;
    if (sample->tick % HEXLOAD_BUS_TICK_PERIOD == 0) {
        encode_tick(sample->tick, &frames[count++]);
    }
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        const struct hexload_dbc_leg_sample1_t message = {
            .displacement = raw.displacement[leg],
            .velocity = (int16_t)raw.velocity[leg],
            .force = raw.force[leg],
            .tick_low = (uint8_t)(sample->tick % HEXLOAD_BUS_TICK_PERIOD),
        };
        const hexload_frame_layout_t layout = leg_layout(leg);
        hexload_frame_begin(&frames[count], &layout);
        (void)hexload_dbc_leg_sample1_pack(frames[count].data, &message, sizeof frames[count].data);
        hexload_frame_seal(&frames[count], &layout);
        count++;
    }
    return count;
}

int hexload_bus_encode_sample(hexload_bus_profile_t profile, const hexload_leg_sample_t* sample,
                              hexload_bus_frame_t frames[HEXLOAD_BUS_SAMPLE_FRAMES], uint32_t* saturated) {
    if (has_infinite(sample)) {
        return HEXLOAD_BUS_ERR_VALUE;
    }
    return profile == HEXLOAD_BUS_FD ? encode_fd(sample, frames, saturated)
                                     : encode_classic(sample, frames, saturated);
}

/// NaN where a channel has no sensor.
static hexload_real_t or_none(bool is_in_range, float value) {
    return is_in_range ? (hexload_real_t)value : (hexload_real_t)NAN;
}

hexload_bus_status_t hexload_sample_decode_fd(const hexload_bus_frame_t* frame,
                                              hexload_leg_sample_t* sample) {
    const hexload_bus_status_t status = hexload_frame_check(frame, &fd_layout);
    if (status != HEXLOAD_BUS_OK) {
        return status;
    }
    struct hexload_dbc_leg_sample_fd_t m;
    (void)hexload_dbc_leg_sample_fd_unpack(&m, frame->data, sizeof frame->data);
    const raw_legs_t raw = {
        .displacement = {m.displacement_1, m.displacement_2, m.displacement_3, m.displacement_4,
                         m.displacement_5, m.displacement_6},
        .velocity = {m.velocity_1, m.velocity_2, m.velocity_3, m.velocity_4, m.velocity_5, m.velocity_6},
        .force = {m.force_1, m.force_2, m.force_3, m.force_4, m.force_5, m.force_6},
    };
    if (!hexload_dbc_leg_sample_fd_version_is_in_range(m.version)) {
        return HEXLOAD_BUS_ERR_VALUE;
    }
    sample->tick = m.tick;
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        sample->displacement_m[leg] =
            or_none(hexload_dbc_leg_sample_fd_displacement_1_is_in_range(raw.displacement[leg]),
                    hexload_dbc_leg_sample_fd_displacement_1_decode(raw.displacement[leg]));
        sample->velocity_m_s[leg] =
            or_none(hexload_dbc_leg_sample_fd_velocity_1_is_in_range(raw.velocity[leg]),
                    hexload_dbc_leg_sample_fd_velocity_1_decode(raw.velocity[leg]));
        sample->force_n[leg] = or_none(hexload_dbc_leg_sample_fd_force_1_is_in_range(raw.force[leg]),
                                       hexload_dbc_leg_sample_fd_force_1_decode(raw.force[leg]));
    }
    return HEXLOAD_BUS_OK;
}

hexload_bus_status_t hexload_sample_decode_tick(const hexload_bus_frame_t* frame, uint32_t* tick) {
    const hexload_bus_status_t status = hexload_frame_check(frame, &tick_layout);
    if (status != HEXLOAD_BUS_OK) {
        return status;
    }
    struct hexload_dbc_sample_tick_t message;
    (void)hexload_dbc_sample_tick_unpack(&message, frame->data, sizeof frame->data);
    if (message.tick % HEXLOAD_BUS_TICK_PERIOD != 0 || message.counter != tick_counter(message.tick) ||
        !hexload_dbc_sample_tick_version_is_in_range(message.version)) {
        return HEXLOAD_BUS_ERR_VALUE;
    }
    *tick = message.tick;
    return HEXLOAD_BUS_OK;
}

hexload_bus_status_t hexload_sample_decode_leg(const hexload_bus_frame_t* frame, hexload_leg_frame_t* leg) {
    const uint32_t number = frame->id - HEXLOAD_DBC_LEG_SAMPLE1_FRAME_ID; // other identifiers: far beyond
    if (number >= HEXLOAD_LEGS) {
        return HEXLOAD_BUS_OTHER;
    }
    const hexload_frame_layout_t layout = leg_layout((int)number);
    const hexload_bus_status_t status = hexload_frame_check(frame, &layout);
    if (status != HEXLOAD_BUS_OK) {
        return status;
    }
    struct hexload_dbc_leg_sample1_t message;
    (void)hexload_dbc_leg_sample1_unpack(&message, frame->data, sizeof frame->data);
    leg->leg = (int)number;
    leg->tick_low = message.tick_low;
    leg->displacement_m = or_none(hexload_dbc_leg_sample1_displacement_is_in_range(message.displacement),
                                  hexload_dbc_leg_sample1_displacement_decode(message.displacement));
    leg->velocity_m_s = or_none(hexload_dbc_leg_sample1_velocity_is_in_range(message.velocity),
                                hexload_dbc_leg_sample1_velocity_decode(message.velocity));
    leg->force_n = or_none(hexload_dbc_leg_sample1_force_is_in_range(message.force),
                           hexload_dbc_leg_sample1_force_decode(message.force));
    return HEXLOAD_BUS_OK;
}

/// Layout of the frame with this identifier among those of a profile's leg samples; false: none.
static bool find_layout(uint32_t id, hexload_bus_profile_t profile, hexload_frame_layout_t* layout) {
    if (profile == HEXLOAD_BUS_FD) {
        *layout = fd_layout;
    } else if (id == tick_layout.id) {
        *layout = tick_layout;
    } else if (id - HEXLOAD_DBC_LEG_SAMPLE1_FRAME_ID < HEXLOAD_LEGS) {
        *layout = leg_layout((int)(id - HEXLOAD_DBC_LEG_SAMPLE1_FRAME_ID));
    } else {
        return false;
    }
    return id == layout->id;
}

hexload_bus_status_t hexload_sample_check_profile(const hexload_bus_frame_t* frame,
                                                  hexload_bus_profile_t own_profile) {
    hexload_frame_layout_t layout;
    if (!find_layout(frame->id, own_profile == HEXLOAD_BUS_FD ? HEXLOAD_BUS_CLASSIC : HEXLOAD_BUS_FD,
                     &layout)) {
        return HEXLOAD_BUS_OTHER;
    }
    const hexload_bus_status_t status = hexload_frame_check(frame, &layout);
    return status == HEXLOAD_BUS_OK ? HEXLOAD_BUS_ERR_PROFILE : status;
}
