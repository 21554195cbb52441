#include "hexload/noise_meter.h"

#include <stdbool.h>
#include <string.h>

#define TIME_CONSTANT_S HEXLOAD_REAL(1.0)

/// Before, a ratio may be off by a fifth.
enum { FEWEST_TICKS = 100 };

/// A stated sigma within a fifth of the measured one is believed.
#define BELIEVED_RATIO HEXLOAD_REAL(1.44)

/// Measured ones are believed between a quarter and ten times the stated.
#define LEAST_RATIO HEXLOAD_REAL(0.0625)
#define MOST_RATIO HEXLOAD_REAL(100.0)

/// One leg counts at most five sigma, so that a shock is not taken for noise.
#define LARGEST_SQUARE HEXLOAD_REAL(25.0)

void hexload_noise_meter_init(hexload_noise_meter_t* self) {
    const hexload_real_t as_stated = HEXLOAD_REAL(1.0);
    *self = (hexload_noise_meter_t){
        .displacement_ratio = as_stated, .velocity_ratio = as_stated, .force_ratio = as_stated};
}

/// Mean square over the legs, in stated variances.
static hexload_real_t mean_square(hexload_real_t last[HEXLOAD_NOISE_HISTORY][HEXLOAD_LEGS],
                                  const hexload_real_t now[HEXLOAD_LEGS], hexload_real_t sigma,
                                  hexload_real_t ratio) {
    const hexload_real_t scale = HEXLOAD_REAL(1.0) / (HEXLOAD_REAL(20.0) * sigma * sigma); // 1 + 9 + 9 + 1
    const hexload_real_t most = LARGEST_SQUARE * hexload_max(ratio, HEXLOAD_REAL(1.0));
    hexload_real_t sum = HEXLOAD_REAL(0.0);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        const hexload_real_t difference =
            now[leg] - last[2][leg] + HEXLOAD_REAL(3.0) * (last[1][leg] - last[0][leg]);
        sum += hexload_min(scale * difference * difference, most);
    }
    return sum / (hexload_real_t)HEXLOAD_LEGS;
}

static void remember(hexload_real_t last[HEXLOAD_NOISE_HISTORY][HEXLOAD_LEGS],
                     const hexload_real_t now[HEXLOAD_LEGS]) {
    memcpy(last[2], last[1], sizeof last[2]);
    memcpy(last[1], last[0], sizeof last[1]);
    memcpy(last[0], now, sizeof last[0]);
}

static void measure(hexload_real_t last[HEXLOAD_NOISE_HISTORY][HEXLOAD_LEGS],
                    const hexload_real_t now[HEXLOAD_LEGS], hexload_real_t sigma, hexload_real_t weight,
                    hexload_real_t* ratio) {
    *ratio += weight * (mean_square(last, now, sigma, *ratio) - *ratio);
}

void hexload_noise_meter_step(hexload_noise_meter_t* self, const hexload_config_t* config,
                              const hexload_leg_sample_t* sample, uint32_t gap_ticks) {
    const hexload_sensors_t* stated = &config->sensors;
    const hexload_real_t memory = TIME_CONSTANT_S / config->tick_s;
    if (gap_ticks != 1) {
        self->history = 0; // differences over a gap are motion
    }
    if (self->history == HEXLOAD_NOISE_HISTORY) {
        self->ticks += (hexload_real_t)self->ticks < memory ? 1 : 0;
        const hexload_real_t weight = HEXLOAD_REAL(1.0) / (hexload_real_t)self->ticks;
        measure(self->last_displacement_m, sample->displacement_m, stated->displacement_sigma_m, weight,
                &self->displacement_ratio);
        measure(self->last_velocity_m_s, sample->velocity_m_s, stated->velocity_sigma_m_s, weight,
                &self->velocity_ratio);
        measure(self->last_force_n, sample->force_n, stated->force_sigma_n, weight, &self->force_ratio);
    } else {
        self->history++;
    }
    remember(self->last_displacement_m, sample->displacement_m);
    remember(self->last_velocity_m_s, sample->velocity_m_s);
    remember(self->last_force_n, sample->force_n);
}

static hexload_real_t believed(const hexload_noise_meter_t* self, hexload_real_t sigma, hexload_real_t ratio,
                               uint32_t* health) {
    const bool is_near = ratio <= BELIEVED_RATIO && ratio * BELIEVED_RATIO >= HEXLOAD_REAL(1.0);
    if (self->ticks < FEWEST_TICKS || is_near) {
        return sigma;
    }
    hexload_health_set(health, HEXLOAD_HEALTH_NOISE_MISSTATED);
    return sigma * hexload_sqrt(hexload_min(hexload_max(ratio, LEAST_RATIO), MOST_RATIO));
}

void hexload_noise_meter_read(const hexload_noise_meter_t* self, const hexload_sensors_t* stated,
                              hexload_sensors_t* sensors, uint32_t* health) {
    *sensors = *stated;
    sensors->displacement_sigma_m =
        believed(self, stated->displacement_sigma_m, self->displacement_ratio, health);
    sensors->velocity_sigma_m_s = believed(self, stated->velocity_sigma_m_s, self->velocity_ratio, health);
    sensors->force_sigma_n = believed(self, stated->force_sigma_n, self->force_ratio, health);
}
