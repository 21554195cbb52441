#include "front_end/noise_estimator.h"

#include "algebra/real.h"
#include "configuration/health.h"

#include <stdbool.h>
#include <string.h>

#define TIME_CONSTANT_S HEXLOAD_REAL(1.0)

/// Before, a ratio may be off by a fifth.
enum { FEWEST_TICKS = 100 };

/// A stated sigma within a fifth of the measured one is kept.
#define BELIEVED_RATIO HEXLOAD_REAL(1.44)

/// Measured ones are used between a quarter and ten times the stated.
#define LEAST_RATIO HEXLOAD_REAL(0.0625)
#define MOST_RATIO HEXLOAD_REAL(100.0)

/// One leg counts at most five sigma, so that a shock is not taken for noise.
#define LARGEST_SQUARE HEXLOAD_REAL(25.0)

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
    const hexload_real_t scale = HEXLOAD_REAL(1.0) / (HEXLOAD_REAL(20.0) * sigma * sigma); // 1 + 9 + 9 + 1
    const hexload_real_t most = LARGEST_SQUARE * hexload_max(self->ratio[kind], HEXLOAD_REAL(1.0));
    hexload_real_t sum = HEXLOAD_REAL(0.0);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        const hexload_real_t difference =
            now[leg] - third[leg] + HEXLOAD_REAL(3.0) * (second[leg] - first[leg]);
        sum += hexload_min(scale * difference * difference, most);
    }
    return sum / (hexload_real_t)HEXLOAD_LEGS;
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

static hexload_real_t believed(const hexload_noise_estimator_t* self, hexload_real_t sigma,
                               hexload_real_t ratio, uint32_t* health) {
    const bool is_near = ratio <= BELIEVED_RATIO && ratio * BELIEVED_RATIO >= HEXLOAD_REAL(1.0);
    if (self->ticks < FEWEST_TICKS || is_near) {
        return sigma;
    }
    hexload_health_set(health, HEXLOAD_HEALTH_NOISE_MISSTATED);
    return sigma * hexload_sqrt(hexload_min(hexload_max(ratio, LEAST_RATIO), MOST_RATIO));
}

void hexload_noise_estimator_read(const hexload_noise_estimator_t* self, const hexload_sensors_t* stated,
                                  hexload_sensors_t* sensors, uint32_t* health) {
    const uint32_t of_speeds = stated->half_window_ticks > 0 ? DISPLACEMENT : VELOCITY;
    *sensors = *stated;
    sensors->displacement_sigma_m =
        believed(self, stated->displacement_sigma_m, self->ratio[DISPLACEMENT], health);
    sensors->velocity_sigma_m_s = believed(self, stated->velocity_sigma_m_s, self->ratio[of_speeds], health);
    sensors->force_sigma_n = believed(self, stated->force_sigma_n, self->ratio[FORCE], health);
}
