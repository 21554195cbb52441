#include "front_end/lost_channels.h"

#include "algebra/real.h"
#include "configuration/health.h"

/// As long as a force may still be in a smoother, with what it spreads over its neighbours.
enum { DOUBT_TICKS = HEXLOAD_LAG_TICKS_MAX + HEXLOAD_RIG_DELAY_TICKS_MAX + 8 };

/// A velocity off by 0.1 mm/s has moved its leg by a millimetre then.
#define LONGEST_S HEXLOAD_REAL(10.0)

/// A guess is wrong for long: over the load monitor's memory of 5 ms white noise of so many times the
/// variance adds up to as much.
#define LASTING_TICKS HEXLOAD_REAL(10.0)

enum { NONE = -1, SEVERAL = -2 };

void hexload_lost_channels_init(hexload_lost_channels_t* self) {
    *self = (hexload_lost_channels_t){0};
}

/// A missing value is missing in their sum.
static bool is_whole(const hexload_leg_sample_t* sample) {
    hexload_real_t sum = HEXLOAD_REAL(0.0);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        sum += sample->displacement_m[leg] + sample->force_n[leg];
    }
    return !isnan(sum);
}

/// The leg whose value is missing, NONE or SEVERAL.
static int find_lost(const hexload_real_t value[HEXLOAD_LEGS]) {
    int lost = NONE;
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        if (isnan(value[leg]) != 0) {
            lost = lost == NONE ? leg : SEVERAL;
        }
    }
    return lost;
}

/// As long as what is made of a sample has a guess in it: without velocity sensors it is one of a window.
static uint32_t doubt_ticks(const hexload_config_t* config) {
    return DOUBT_TICKS + 2 * config->sensors.half_window_ticks;
}

bool hexload_lost_channels_lack_force(const hexload_lost_channels_t* self) {
    return self->force_ticks >= DOUBT_TICKS;
}

static hexload_real_t mean_of_others(const hexload_real_t force_n[HEXLOAD_LEGS], int lost) {
    hexload_real_t sum_n = HEXLOAD_REAL(0.0);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        sum_n += leg != lost ? force_n[leg] : HEXLOAD_REAL(0.0);
    }
    return sum_n / (hexload_real_t)(HEXLOAD_LEGS - 1);
}

/// Whether the legs are such that the one gap of a kind can be closed.
static bool can_mend(const hexload_lost_channels_t* self, const hexload_config_t* config,
                     const hexload_leg_gate_t* gate, int displacement, int force) {
    const bool is_long = config->tick_s * (hexload_real_t)self->displacement_ticks > LONGEST_S;
    const bool is_other_leg = self->force_ticks > 0 && force != (int)self->force_leg;
    const bool can_go_on = !is_long && gate->accepted > 0 && config->sensors.half_window_ticks == 0;
    return displacement != SEVERAL && force != SEVERAL && (displacement == NONE || can_go_on) &&
           (force == NONE || !is_other_leg);
}

const hexload_leg_sample_t*
hexload_lost_channels_mend(const hexload_lost_channels_t* self, const hexload_config_t* config,
                           const hexload_leg_gate_t* gate, const hexload_leg_sample_t* sample,
                           hexload_leg_sample_t* mended, hexload_lost_channels_t* next, uint32_t* health) {
    *next = *self;
    next->force_ticks -= self->force_ticks > 0 ? 1 : 0;
    next->displacement_ticks = 0;
    if (hexload_lost_channels_lack_force(next)) {
        hexload_health_set(health, HEXLOAD_HEALTH_CHANNEL_LOST);
    }
    if (is_whole(sample)) {
        return sample;
    }
    const int displacement = find_lost(sample->displacement_m);
    const int force = find_lost(sample->force_n);
    const uint32_t gap_ticks = sample->tick - gate->last_tick;
    if ((displacement == NONE && force == NONE) || !can_mend(self, config, gate, displacement, force)) {
        return sample;
    }
    *mended = *sample;
    if (displacement != NONE) {
        const hexload_real_t gap_s = config->tick_s * (hexload_real_t)gap_ticks;
        mended->displacement_m[displacement] =
            hexload_fma(gap_s, sample->velocity_m_s[displacement], gate->last_displacement_m[displacement]);
        next->displacement_ticks = self->displacement_ticks + gap_ticks;
    }
    if (force != NONE) {
        mended->force_n[force] = mean_of_others(sample->force_n, force);
        next->force_leg = (uint32_t)force;
        next->force_ticks = doubt_ticks(config);
    }
    hexload_health_set(health, HEXLOAD_HEALTH_CHANNEL_LOST);
    return mended;
}

void hexload_lost_channels_doubt(const hexload_lost_channels_t* self,
                                 const hexload_real_t force_n[HEXLOAD_LEGS],
                                 hexload_real_t variance_n2[HEXLOAD_LEGS]) {
    if (self->force_ticks == 0) {
        return;
    }
    hexload_real_t largest_n2 = HEXLOAD_REAL(0.0);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        largest_n2 = hexload_max(largest_n2, force_n[leg] * force_n[leg]);
    }
    variance_n2[self->force_leg] += LASTING_TICKS * largest_n2;
}
