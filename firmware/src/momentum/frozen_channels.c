#include "momentum/frozen_channels.h"

#include "algebra/linalg.h"
#include "front_end/present_tick.h"

#include <string.h>

enum {
    STILL_TICKS = 2, ///< for which a channel repeats its value
    MANY_TICKS = 9,
    FRESH_LEGS = 3, ///< whose channels have changed at the same tick
    HELD_STEP = 8, ///< for each time that all velocities change after having stood still; one less for others
    HELD = 128,
};

/// Share of a mismatch in one tick that counts: more noise than stated and the steps of a converter are no
/// jumps.
#define JUMP_SHARE HEXLOAD_REAL(0.125)

/// A sensor that goes on again jumps, and that is in the load monitor's mean for four of its time constants.
#define FADING_S HEXLOAD_REAL(0.2)

/// Of the difference of two displacements, and of a jump.
#define SLIP_SIGMAS HEXLOAD_REAL(7.0)

/// @return whether one jumps: to nothing, as a sensor that loses contact, or, if `had_stopped`, from where it
/// has stood still for MANY_TICKS.
static bool count_still(const hexload_real_t now[HEXLOAD_LEGS], const hexload_real_t last[HEXLOAD_LEGS],
                        hexload_real_t sigma, bool had_stopped, uint8_t ticks[HEXLOAD_LEGS]) {
    bool has_jumped = false;
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        if (now[leg] != last[leg]) {
            const bool is_far = hexload_abs(now[leg] - last[leg]) > SLIP_SIGMAS * sigma;
            const bool is_dead = is_far && (now[leg] == HEXLOAD_REAL(0.0));
            has_jumped = has_jumped || is_dead || (is_far && had_stopped && (ticks[leg] >= MANY_TICKS));
            // one that dies reads nothing from then on, and that it repeats this will be too late
            ticks[leg] = is_dead ? STILL_TICKS : 0;
        } else if (ticks[leg] < MANY_TICKS) {
            ticks[leg]++;
        }
    }
    return has_jumped;
}

/// For how many ticks one has stood still while others change.
static HEXLOAD_RARE uint8_t one_still_ticks(const uint8_t ticks[HEXLOAD_LEGS]) {
    uint8_t most = 0;
    int fresh = 0;
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        most = ticks[leg] > most ? ticks[leg] : most;
        fresh += ticks[leg] == 0 ? 1 : 0;
    }
    return fresh >= FRESH_LEGS ? most : 0;
}

static bool is_any_off(const hexload_frozen_channels_t* self, const hexload_config_t* config) {
    const hexload_real_t most_m = SLIP_SIGMAS * config->sensors.displacement_sigma_m;
    bool is_off = false;
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        is_off = is_off || hexload_abs(self->missed_m[leg]) > most_m;
    }
    return is_off;
}

/// Whether the machine moves: at rest all displacements stand still that come in steps.
static HEXLOAD_RARE bool is_going(const hexload_frozen_channels_t* self, const hexload_leg_sample_t* sample) {
    int fresh = 0;
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        fresh += sample->displacement_m[leg] != self->last.displacement_m[leg] ? 1 : 0;
    }
    return (fresh >= FRESH_LEGS) || hexload_is_moving(sample->velocity_m_s);
}

/// By how much a displacement is behind its velocity: since it stands still, or a share of a jump. Of one
/// that is missing nothing is known.
static hexload_real_t missed(const hexload_frozen_channels_t* self, const hexload_leg_sample_t* sample,
                             int leg, hexload_real_t way_m) {
    const hexload_real_t nothing_m = HEXLOAD_REAL(0.0);
    const hexload_real_t moved_m = sample->displacement_m[leg] - self->last.displacement_m[leg];
    if (moved_m == nothing_m) {
        return is_going(self, sample) ? self->missed_m[leg] + way_m : nothing_m;
    }
    return isnan(moved_m) ? nothing_m : JUMP_SHARE * (way_m - moved_m);
}

void hexload_frozen_channels_step(hexload_frozen_channels_t* self, const hexload_config_t* config,
                                  const hexload_leg_sample_t* sample) {
    const hexload_real_t elapsed_s = config->tick_s * (hexload_real_t)(sample->tick - self->last.tick);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        self->missed_m[leg] = missed(self, sample, leg, elapsed_s * sample->velocity_m_s[leg]);
    }
    const bool had_stopped =
        self->still_ticks >= MANY_TICKS; // not the machine, whose channels stand still together
    const bool has_velocity_jumped =
        count_still(sample->velocity_m_s, self->last.velocity_m_s, config->sensors.velocity_sigma_m_s,
                    had_stopped, self->still_velocity_ticks);
    const bool has_force_jumped =
        count_still(sample->force_n, self->last.force_n, config->sensors.force_sigma_n, had_stopped,
                    self->still_force_ticks);
    const uint8_t velocity_ticks = one_still_ticks(self->still_velocity_ticks);
    const uint8_t force_ticks = one_still_ticks(self->still_force_ticks);
    self->still_ticks = velocity_ticks > force_ticks ? velocity_ticks : force_ticks;
    self->left_s -= config->tick_s;
    if (has_velocity_jumped || has_force_jumped || is_any_off(self, config)) {
        self->left_s = FADING_S;
    }
    self->last = *sample;
}

bool hexload_frozen_channels_are_held(hexload_frozen_channels_t* self) {
    int still = 0;
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        still += self->still_velocity_ticks[leg] > 0 ? 1 : 0;
    }
    const bool is_next = still == 0 && self->was_still;
    self->was_still = still == HEXLOAD_LEGS;
    if (is_next) {
        self->held = (uint8_t)(self->held + (self->held < UINT8_MAX - HELD_STEP ? HELD_STEP : 0));
    }
    if (!is_next && !self->was_still && self->held > 0) {
        self->held--;
    }
    return self->held >= HELD;
}

bool hexload_frozen_channels_are_there(const hexload_frozen_channels_t* self) {
    return self->left_s > HEXLOAD_REAL(0.0) || self->still_ticks >= STILL_TICKS;
}
