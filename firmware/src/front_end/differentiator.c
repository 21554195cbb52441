#include "front_end/differentiator.h"

#include "algebra/real.h"

#include <string.h>

enum {
    TICKS = HEXLOAD_DIFFERENTIATOR_TICKS,
    LONGEST_GAP_TICKS = 5, ///< at 5 m/s^2 and 1 ms a line over it is 16 um off
};

HEXLOAD_RARE void hexload_config_set_no_velocity(hexload_config_t* config) {
    hexload_sensors_t* sensors = &config->sensors;
    const hexload_real_t ticks = HEXLOAD_REAL(0.006) / config->tick_s + HEXLOAD_REAL(0.5);
    const uint32_t most = HEXLOAD_HALF_WINDOW_TICKS_MAX;
    uint32_t half = 2;
    while (half < most && (hexload_real_t)(half + 1) <= ticks) {
        half++;
    }
    const hexload_real_t squares = (hexload_real_t)(half * (half + 1) * (2 * half + 1)) / HEXLOAD_REAL(3.0);
    sensors->half_window_ticks = half;
    sensors->velocity_sigma_m_s = sensors->displacement_sigma_m / (config->tick_s * hexload_sqrt(squares));
}

void hexload_differentiator_init(hexload_differentiator_t* self) {
    memset(self, 0, sizeof *self);
}

static void store(hexload_differentiator_t* self, const hexload_real_t displacement_m[HEXLOAD_LEGS],
                  const hexload_real_t force_n[HEXLOAD_LEGS]) {
    memcpy(self->displacement_m[self->next], displacement_m, sizeof self->displacement_m[0]);
    memcpy(self->force_n[self->next], force_n, sizeof self->force_n[0]);
    self->next = (self->next + 1) % TICKS;
    self->stored += self->stored < TICKS ? 1 : 0;
}

/// The place of so many ticks before the next.
static uint32_t ago(const hexload_differentiator_t* self, uint32_t ticks) {
    return (self->next + TICKS - ticks) % TICKS;
}

static void bridge(hexload_differentiator_t* self, const hexload_leg_sample_t* sample, uint32_t gap_ticks) {
    const uint32_t last = ago(self, 1);
    hexload_real_t displacement_m[HEXLOAD_LEGS];
    hexload_real_t force_n[HEXLOAD_LEGS];
    for (uint32_t tick = 1; tick < gap_ticks; tick++) {
        const hexload_real_t share = (hexload_real_t)tick / (hexload_real_t)gap_ticks;
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            const hexload_real_t from_m = self->displacement_m[last][leg];
            const hexload_real_t from_n = self->force_n[last][leg];
            displacement_m[leg] = hexload_fma(share, sample->displacement_m[leg] - from_m, from_m);
            force_n[leg] = hexload_fma(share, sample->force_n[leg] - from_n, from_n);
        }
        store(self, displacement_m, force_n);
    }
}

/// Weights of tick j of a window: j * slope_1_s for a speed, and for the others a - curvature * j^2, where a
/// makes the sum 1.
typedef struct weights {
    hexload_real_t slope_1_s;
    hexload_real_t curvature;
} weights_t;

/// With n ticks, n S2 and n S4 the sums of j^2 and j^4 over them: speeds of first and third degree in time
/// come out of both filters alike when the second moment of the other one's weights is S4 / (3 S2).
static weights_t find_weights(const hexload_config_t* config) {
    const hexload_real_t half = (hexload_real_t)config->sensors.half_window_ticks;
    const hexload_real_t n = HEXLOAD_REAL(2.0) * half + HEXLOAD_REAL(1.0);
    const hexload_real_t S2 = half * (half + HEXLOAD_REAL(1.0)) / HEXLOAD_REAL(3.0);
    const hexload_real_t ratio = (HEXLOAD_REAL(9.0) * S2 - HEXLOAD_REAL(1.0)) / HEXLOAD_REAL(5.0); // S4 / S2
    return (weights_t){
        .slope_1_s = HEXLOAD_REAL(1.0) / (n * S2 * config->tick_s),
        .curvature = (S2 - ratio / HEXLOAD_REAL(3.0)) / (n * S2 * (ratio - S2)),
    };
}

static void find_middle(const hexload_differentiator_t* self, const hexload_config_t* config,
                        hexload_leg_sample_t* middle) {
    const uint32_t half = config->sensors.half_window_ticks;
    const uint32_t centre = ago(self, half + 1);
    const weights_t weights = find_weights(config);
    const hexload_real_t n = (hexload_real_t)(2 * half + 1);
    const hexload_real_t mean_square = (hexload_real_t)(half * (half + 1)) / HEXLOAD_REAL(3.0);
    const hexload_real_t level = HEXLOAD_REAL(1.0) / n + weights.curvature * mean_square;
    const hexload_real_t* x = self->displacement_m[centre];
    const hexload_real_t* f = self->force_n[centre];
    memcpy(middle->displacement_m, x, sizeof middle->displacement_m);
    memcpy(middle->force_n, f, sizeof middle->force_n);
    memset(middle->velocity_m_s, 0, sizeof middle->velocity_m_s);
    for (uint32_t j = 1; j <= half; j++) {
        const uint32_t before = ago(self, half + 1 + j);
        const uint32_t after = ago(self, half + 1 - j);
        const hexload_real_t step = (hexload_real_t)j;
        const hexload_real_t share = level - weights.curvature * step * step;
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            const hexload_real_t from_m = self->displacement_m[before][leg] - x[leg];
            const hexload_real_t to_m = self->displacement_m[after][leg] - x[leg];
            const hexload_real_t beyond_n =
                (self->force_n[before][leg] - f[leg]) + (self->force_n[after][leg] - f[leg]);
            middle->velocity_m_s[leg] =
                hexload_fma(weights.slope_1_s * step, to_m - from_m, middle->velocity_m_s[leg]);
            middle->displacement_m[leg] = hexload_fma(share, from_m + to_m, middle->displacement_m[leg]);
            middle->force_n[leg] = hexload_fma(share, beyond_n, middle->force_n[leg]);
        }
    }
}

bool hexload_differentiator_step(hexload_differentiator_t* self, const hexload_config_t* config,
                                 const hexload_leg_sample_t* sample, uint32_t gap_ticks,
                                 hexload_leg_sample_t* middle) {
    if (gap_ticks > LONGEST_GAP_TICKS) {
        self->stored = 0;
    }
    if (self->stored > 0) {
        bridge(self, sample, gap_ticks);
    }
    store(self, sample->displacement_m, sample->force_n);
    if (self->stored <= 2 * config->sensors.half_window_ticks) {
        return false;
    }
    find_middle(self, config, middle);
    middle->tick = sample->tick - config->sensors.half_window_ticks;
    self->has_begun = true;
    return true;
}
