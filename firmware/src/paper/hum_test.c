#include "paper/hum_test.h"

#include "algebra/linalg.h"

#include <string.h>

enum { AXES = HEXLOAD_PAPER_MEASUREMENTS };

/// Mains. In half a second there are whole periods of both, and a mains that is off by half a hertz loses a
/// fifth of its power.
static const hexload_real_t FREQUENCY_HZ[HEXLOAD_HUM_FREQUENCIES] = {HEXLOAD_REAL(50.0), HEXLOAD_REAL(60.0)};

#define BLOCK_S HEXLOAD_REAL(0.5)

/// As of the sums over half a second, with six numbers too (residual_test.c): what a block may have before it
/// counts, and the sum that is more than chance.
#define GRANTED HEXLOAD_REAL(9.0)
#define LEAST_EXCESS HEXLOAD_REAL(60.0)

/// Angle per tick up to which the polynomials below hold to 1e-6. Slower sampling hardly shows the hum.
#define LARGEST_TURN HEXLOAD_REAL(1.6)

static void begin_block(hexload_hum_test_t* self) {
    memset(self->sum, 0, sizeof self->sum);
    self->phase[0] = HEXLOAD_REAL(1.0);
    self->phase[1] = HEXLOAD_REAL(0.0);
    self->ticks = 0;
}

/// Cosine and sine of an angle of 0..LARGEST_TURN, by Taylor.
static void turn_by(hexload_real_t angle, hexload_real_t turn[2]) {
    static const hexload_real_t factor[] = {HEXLOAD_REAL(90.0), HEXLOAD_REAL(56.0), HEXLOAD_REAL(30.0),
                                            HEXLOAD_REAL(12.0), HEXLOAD_REAL(2.0)};
    static const hexload_real_t sine_factor[] = {HEXLOAD_REAL(110.0), HEXLOAD_REAL(72.0), HEXLOAD_REAL(42.0),
                                                 HEXLOAD_REAL(20.0), HEXLOAD_REAL(6.0)};
    const hexload_real_t square = angle * angle;
    turn[0] = HEXLOAD_REAL(1.0);
    turn[1] = HEXLOAD_REAL(1.0);
    for (int k = 0; k < 5; k++) {
        turn[0] = HEXLOAD_REAL(1.0) - square / factor[k] * turn[0];
        turn[1] = HEXLOAD_REAL(1.0) - square / sine_factor[k] * turn[1];
    }
    turn[1] *= angle;
}

void hexload_hum_test_init(hexload_hum_test_t* self, const hexload_config_t* config) {
    memset(self, 0, sizeof *self);
    for (int n = 0; n < HEXLOAD_HUM_FREQUENCIES; n++) {
        const hexload_real_t angle = HEXLOAD_REAL(6.2831853071795865) * FREQUENCY_HZ[n] * config->tick_s;
        turn_by(hexload_min(angle, LARGEST_TURN), self->turn[n]);
        self->is_heard = angle <= LARGEST_TURN;
    }
    begin_block(self);
    // the first block, which does not count, is half as long: blocks do not end in the ticks in which those
    // of the residual test do
    self->ticks = (uint32_t)(HEXLOAD_REAL(0.5) * BLOCK_S / config->tick_s);
}

/// A whole block. The first one has the start in it. The energy is that of the blocks between, too.
static void close_block(hexload_hum_test_t* self) {
    if (self->has_begun) {
        hexload_real_t* excess = &self->excess[self->next];
        const hexload_real_t square = dot3(self->sum[0], self->sum[0]) + dot3(self->sum[1], self->sum[1]);
        const hexload_real_t nis = HEXLOAD_REAL(2.0) / (hexload_real_t)self->ticks * square;
        *excess = hexload_max(HEXLOAD_REAL(0.0), *excess + nis - GRANTED);
        self->energy = HEXLOAD_REAL(0.0);
        for (int n = 0; n < HEXLOAD_HUM_FREQUENCIES; n++) {
            self->energy += self->excess[n] > LEAST_EXCESS
                                ? (hexload_real_t)HEXLOAD_HUM_FREQUENCIES * self->excess[n]
                                : HEXLOAD_REAL(0.0);
        }
        self->next = (uint8_t)((self->next + 1U) % (uint32_t)HEXLOAD_HUM_FREQUENCIES);
    }
    self->has_begun = true;
    begin_block(self);
}

void hexload_hum_test_step(hexload_hum_test_t* self, const hexload_config_t* config, uint32_t gap_ticks,
                           const hexload_real_t whitened[HEXLOAD_PAPER_MEASUREMENTS]) {
    if (gap_ticks != 1) {
        begin_block(self);
    }
    if (!self->is_heard) {
        return;
    }
    const hexload_real_t* turn = self->turn[self->next];
    const hexload_real_t cosine = self->phase[0];
    const hexload_real_t sine = self->phase[1];
    HEXLOAD_UNROLL
    for (int k = 0; k < AXES; k++) {
        self->sum[0][k] = hexload_fma(cosine, whitened[k], self->sum[0][k]);
        self->sum[1][k] = hexload_fma(sine, whitened[k], self->sum[1][k]);
    }
    self->phase[0] = cosine * turn[0] - sine * turn[1];
    self->phase[1] = cosine * turn[1] + sine * turn[0];
    self->ticks++;
    if ((hexload_real_t)self->ticks * config->tick_s >= BLOCK_S) {
        close_block(self);
    }
}
