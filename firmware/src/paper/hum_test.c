#include "paper/hum_test.h"

#include "algebra/linalg.h"

#include <string.h>

/// Mains. In half a second there are whole periods of both, and a mains that is off by half a hertz loses a
/// fifth of its power.
static const hexload_real_t FREQUENCY_HZ[HEXLOAD_HUM_FREQUENCIES] = {HEXLOAD_REAL(50.0), HEXLOAD_REAL(60.0)};

#define BLOCK_S HEXLOAD_REAL(0.5)

/// As of the sums over half a second, with six numbers too (residual_test.c): what a block may have before it
/// counts, and the sum that is more than chance.
#define GRANTED HEXLOAD_REAL(9.0)
#define LEAST_EXCESS HEXLOAD_REAL(60.0)

/// Angle per tick up to which the polynomial below holds to 1e-6. Slower sampling hardly shows the hum.
#define LARGEST_ANGLE HEXLOAD_REAL(1.6)

void hexload_hum_test_begin(hexload_hum_test_t* self) {
    memset(self->sum, 0, sizeof self->sum);
    memset(self->last_sum, 0, sizeof self->last_sum);
    self->ticks = 0;
}

/// Of 0..LARGEST_ANGLE, by Taylor.
static hexload_real_t cosine(hexload_real_t angle) {
    static const hexload_real_t factor[] = {HEXLOAD_REAL(90.0), HEXLOAD_REAL(56.0), HEXLOAD_REAL(30.0),
                                            HEXLOAD_REAL(12.0), HEXLOAD_REAL(2.0)};
    hexload_real_t sum = HEXLOAD_REAL(1.0);
    for (int k = 0; k < 5; k++) {
        sum = HEXLOAD_REAL(1.0) - angle * angle / factor[k] * sum;
    }
    return sum;
}

void hexload_hum_test_init(hexload_hum_test_t* self, const hexload_config_t* config) {
    const hexload_real_t block_ticks = BLOCK_S / config->tick_s + HEXLOAD_REAL(0.5);
    memset(self, 0, sizeof *self);
    for (int n = 0; n < HEXLOAD_HUM_FREQUENCIES; n++) {
        const hexload_real_t angle = HEXLOAD_REAL(6.2831853071795865) * FREQUENCY_HZ[n] * config->tick_s;
        self->twice_cosine[n] = HEXLOAD_REAL(2.0) * cosine(hexload_min(angle, LARGEST_ANGLE));
        self->is_heard = angle <= LARGEST_ANGLE && config->sensors.half_window_ticks == 0;
    }
    self->factor = self->twice_cosine[0];
    self->block_ticks = (uint32_t)block_ticks;
    // the first block, which does not count, is half as long: blocks do not end in the ticks in which those
    // of the residual test do
    self->ticks = self->block_ticks / 2;
}

/// The first block has the start in it. The energy is that of the blocks between, too.
void hexload_hum_test_close(hexload_hum_test_t* self) {
    if (self->has_begun && self->is_heard) {
        hexload_real_t* excess = &self->excess[self->next];
        const hexload_real_t square = dot3(self->sum, self->sum) + dot3(self->last_sum, self->last_sum) -
                                      self->factor * dot3(self->sum, self->last_sum);
        const hexload_real_t nis = HEXLOAD_REAL(2.0) / (hexload_real_t)self->ticks * square;
        *excess = hexload_max(HEXLOAD_REAL(0.0), *excess + nis - GRANTED);
        self->energy = HEXLOAD_REAL(0.0);
        for (int n = 0; n < HEXLOAD_HUM_FREQUENCIES; n++) {
            self->energy += self->excess[n] > LEAST_EXCESS
                                ? (hexload_real_t)HEXLOAD_HUM_FREQUENCIES * self->excess[n]
                                : HEXLOAD_REAL(0.0);
        }
        self->hums = self->energy > HEXLOAD_REAL(0.0);
        self->next = (uint8_t)((self->next + 1U) % (uint32_t)HEXLOAD_HUM_FREQUENCIES);
        self->factor = self->twice_cosine[self->next];
    }
    self->has_begun = true;
    hexload_hum_test_begin(self);
}
