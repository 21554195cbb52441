#include "front_end/noise_estimator.h"

#include "algebra/real.h"
#include "configuration/health.h"

#include <stdbool.h>
#include <string.h>

#define TIME_CONSTANT_S HEXLOAD_REAL(1.0)

/// A stated sigma within a fifth of the measured one is kept; of fewer ticks than these what is further off.
#define BELIEVED_EXCESS HEXLOAD_REAL(0.44)
#define PROOF_TICKS HEXLOAD_REAL(100.0)

/// Measured ones are used between a quarter and ten times the stated.
#define LEAST_RATIO HEXLOAD_REAL(0.0625)
#define MOST_RATIO HEXLOAD_REAL(100.0)

/// One leg counts at most three sigma, so that a shock is not taken for noise.
#define LARGEST_SQUARE HEXLOAD_REAL(9.0)

enum { DISPLACEMENT, VELOCITY, FORCE };

void hexload_noise_estimator_init(hexload_noise_estimator_t* self) {
    *self = (hexload_noise_estimator_t){.ratio = {HEXLOAD_REAL(1.0), HEXLOAD_REAL(1.0), HEXLOAD_REAL(1.0)}};
}

/// Mean square over the legs of the third difference, in stated variances.
static hexload_real_t mean_square(const hexload_noise_estimator_t* self, uint32_t kind,
                                  const hexload_real_t now[HEXLOAD_LEGS], hexload_real_t sigma) {
    const uint32_t oldest = self->oldest;
    const hexload_real_t* third = self->last[kind][oldest];
    const hexload_real_t* second = self->last[kind][oldest == HEXLOAD_NOISE_HISTORY - 1 ? 0 : oldest + 1];
    const hexload_real_t* first = self->last[kind][oldest == 0 ? HEXLOAD_NOISE_HISTORY - 1 : oldest - 1];
    const hexload_real_t stated = HEXLOAD_REAL(20.0) * sigma * sigma; // 1 + 9 + 9 + 1
    const hexload_real_t most = LARGEST_SQUARE * hexload_max(self->ratio[kind], HEXLOAD_REAL(1.0)) * stated;
    hexload_real_t sum = HEXLOAD_REAL(0.0);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        const hexload_real_t difference =
            now[leg] - third[leg] + HEXLOAD_REAL(3.0) * (second[leg] - first[leg]);
        sum += hexload_min(difference * difference, most);
    }
    return sum / ((hexload_real_t)HEXLOAD_LEGS * stated);
}

static void measure(hexload_noise_estimator_t* self, const hexload_config_t* config,
                    const hexload_real_t* const now[HEXLOAD_NOISE_KINDS]) {
    const hexload_sensors_t* stated = &config->sensors;
    const hexload_real_t sigma[HEXLOAD_NOISE_KINDS] = {stated->displacement_sigma_m,
                                                       stated->velocity_sigma_m_s, stated->force_sigma_n};
    const hexload_real_t memory = TIME_CONSTANT_S / config->tick_s;
    const uint32_t kind = self->turn;
    self->ticks += (hexload_real_t)self->ticks < memory ? 1 : 0;
    const hexload_real_t weight =
        hexload_min(HEXLOAD_REAL(1.0), (hexload_real_t)HEXLOAD_NOISE_KINDS / (hexload_real_t)self->ticks);
    self->ratio[kind] += weight * (mean_square(self, kind, now[kind], sigma[kind]) - self->ratio[kind]);
    self->turn = kind == FORCE ? DISPLACEMENT : kind + 1;
}

void hexload_noise_estimator_step(hexload_noise_estimator_t* self, const hexload_config_t* config,
                                  const hexload_leg_sample_t* sample, uint32_t gap_ticks) {
    const hexload_real_t* const now[HEXLOAD_NOISE_KINDS] = {sample->displacement_m, sample->velocity_m_s,
                                                            sample->force_n};
    if (gap_ticks != 1) {
        self->history = 0; // differences over a gap are motion
    }
    if (self->history == HEXLOAD_NOISE_HISTORY) {
        measure(self, config, now);
    } else {
        self->history++;
    }
    for (int kind = 0; kind < HEXLOAD_NOISE_KINDS; kind++) {
        memcpy(self->last[kind][self->oldest], now[kind], sizeof self->last[kind][self->oldest]);
    }
    self->oldest = self->oldest == HEXLOAD_NOISE_HISTORY - 1 ? 0 : self->oldest + 1;
}

/// Of a late channel a low-pass has taken the top of the band, where third differences look, and left what
/// counts: it has the stated sigma at least.
/// @param most of a ratio that may be chance or a fifth of a sigma
static hexload_real_t believed(hexload_real_t sigma, hexload_real_t ratio, hexload_real_t most,
                               hexload_real_t delay_s, uint32_t* health) {
    const bool is_less = ((ratio * most) < HEXLOAD_REAL(1.0)) && (delay_s <= HEXLOAD_REAL(0.0));
    if ((ratio <= most) && !is_less) {
        return sigma;
    }
    hexload_health_set(health, HEXLOAD_HEALTH_NOISE_MISSTATED);
    return sigma * hexload_sqrt(hexload_min(hexload_max(ratio, LEAST_RATIO), MOST_RATIO));
}

void hexload_noise_estimator_read(const hexload_noise_estimator_t* self, const hexload_config_t* config,
                                  hexload_sensors_t* sensors, uint32_t* health) {
    const hexload_sensors_t* stated = &config->sensors;
    const uint32_t of_speeds = stated->half_window_ticks > 0 ? DISPLACEMENT : VELOCITY;
    const hexload_real_t ticks =
        hexload_max(hexload_min((hexload_real_t)self->ticks, PROOF_TICKS), HEXLOAD_REAL(1.0));
    const hexload_real_t most = HEXLOAD_REAL(1.0) + (BELIEVED_EXCESS * PROOF_TICKS / ticks);
    *sensors = *stated;
    sensors->displacement_sigma_m =
        believed(stated->displacement_sigma_m, self->ratio[DISPLACEMENT], most, HEXLOAD_REAL(0.0), health);
    sensors->velocity_sigma_m_s = believed(stated->velocity_sigma_m_s, self->ratio[of_speeds], most,
                                           config->rig.velocity_delay_s, health);
    sensors->force_sigma_n =
        believed(stated->force_sigma_n, self->ratio[FORCE], most, config->rig.force_delay_s, health);
}
