#include "momentum/frozen_channels.h"

#include "algebra/linalg.h"

#include <string.h>

enum {
    STILL_TICKS = 2, ///< for which a channel repeats its value
    MANY_TICKS = 9,
    FRESH_LEGS = 3, ///< whose channels have changed at the same tick
};

/// Of the difference of two displacements.
#define SLIP_SIGMAS HEXLOAD_REAL(7.0)

static void count_still(const hexload_real_t now[HEXLOAD_LEGS], const hexload_real_t last[HEXLOAD_LEGS],
                        uint8_t ticks[HEXLOAD_LEGS]) {
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        if (now[leg] != last[leg]) {
            ticks[leg] = 0;
        } else if (ticks[leg] < MANY_TICKS) {
            ticks[leg]++;
        }
    }
}

/// Whether one stands still while others change.
static bool is_one_still(const uint8_t ticks[HEXLOAD_LEGS]) {
    bool is_still = false;
    int fresh = 0;
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        is_still = is_still || ticks[leg] >= STILL_TICKS;
        fresh += ticks[leg] == 0 ? 1 : 0;
    }
    return is_still && fresh >= FRESH_LEGS;
}

void hexload_frozen_channels_step(hexload_frozen_channels_t* self, const hexload_config_t* config,
                                  const hexload_leg_sample_t* sample) {
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        const bool is_still = sample->displacement_m[leg] == self->last.displacement_m[leg];
        self->missed_m[leg] =
            is_still ? hexload_fma(config->tick_s, sample->velocity_m_s[leg], self->missed_m[leg])
                     : HEXLOAD_REAL(0.0);
    }
    count_still(sample->velocity_m_s, self->last.velocity_m_s, self->still_velocity_ticks);
    count_still(sample->force_n, self->last.force_n, self->still_force_ticks);
    self->last = *sample;
}

bool hexload_frozen_channels_are_there(const hexload_frozen_channels_t* self,
                                       const hexload_config_t* config) {
    const hexload_real_t most_m = SLIP_SIGMAS * config->sensors.displacement_sigma_m;
    bool is_any = is_one_still(self->still_velocity_ticks) || is_one_still(self->still_force_ticks);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        is_any = is_any || hexload_abs(self->missed_m[leg]) > most_m;
    }
    return is_any;
}
