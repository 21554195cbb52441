#include "front_end/residual_test.h"

#include "algebra/real.h"

#include <string.h>

/// A block is looked at before its end in one of eight ticks, which are not those in which plausibility ends
/// its blocks of sixteen.
enum { LOOK_TICKS = 8, LOOK_PHASE = 2 };

/// Share of a block in the mean, which goes back 5 s.
#define SHARE HEXLOAD_REAL(0.1)

/// What a block may have for each of its innovations before it counts, and the sum of what counts that is
/// more than chance: of ideal innovations that sum exceeds x with a probability of exp(-0.29 x) (Wald), 2e-8.
#define GRANTED_SHARE HEXLOAD_REAL(1.5)
#define LEAST_EXCESS HEXLOAD_REAL(60.0)

void hexload_residual_test_init(hexload_residual_test_t* self, uint32_t dimension) {
    const hexload_real_t ideal = (hexload_real_t)dimension;
    *self = (hexload_residual_test_t){
        .dimension = (uint8_t)dimension, .nis = ideal, .nis_mean = ideal, .factor = HEXLOAD_REAL(1.0)};
}

static hexload_real_t square_of_sum(const hexload_residual_test_t* self) {
    hexload_real_t square = self->sum[0] * self->sum[0];
    for (uint32_t k = 1; k < self->dimension; k++) {
        square = hexload_fma(self->sum[k], self->sum[k], square);
    }
    return square;
}

/// What a block whose sum is already so large will have shown, if nothing but noise of mean zero follows: a
/// mismatch that is certain need not wait for its end. Of sums of symmetric noise the largest on the way
/// exceeds a limit at most twice as often as the last one (Levy's inequality).
static void look_ahead(hexload_residual_test_t* self, hexload_real_t share_of_tick) {
    const hexload_real_t excess = hexload_fma(share_of_tick, square_of_sum(self), self->excess) -
                                  GRANTED_SHARE * (hexload_real_t)self->dimension;
    if (self->has_begun && excess > LEAST_EXCESS) {
        self->factor = hexload_max(self->factor, hexload_sqrt(HEXLOAD_REAL(1.0) + excess));
    }
}

/// A whole block of this load. The first one has the shock of the change in it.
static void close_block(hexload_residual_test_t* self, bool is_considered) {
    if (self->has_begun) {
        self->nis = square_of_sum(self) / (hexload_real_t)self->ticks;
        self->nis_mean += SHARE * (self->nis - self->nis_mean);
        self->excess = hexload_max(HEXLOAD_REAL(0.0), self->excess + self->nis -
                                                          GRANTED_SHARE * (hexload_real_t)self->dimension);
        const bool is_mismatch = self->excess > LEAST_EXCESS && !is_considered;
        self->factor = is_mismatch ? hexload_sqrt(HEXLOAD_REAL(1.0) + self->excess) : HEXLOAD_REAL(1.0);
    }
    memset(self->sum, 0, sizeof self->sum);
    self->ticks = 0;
    self->has_begun = true;
}

hexload_real_t hexload_residual_test_factor(const hexload_residual_test_t* self, bool is_considered) {
    const hexload_real_t dispersion =
        is_considered ? self->nis_mean / (hexload_real_t)self->dimension : HEXLOAD_REAL(1.0);
    return hexload_max(self->factor, hexload_sqrt(hexload_max(HEXLOAD_REAL(1.0), dispersion)));
}

void hexload_residual_test_step(hexload_residual_test_t* self, const hexload_config_t* config,
                                const hexload_real_t* whitened, bool is_considered) {
    const bool is_last = hexload_residual_test_ends(self, config);
    for (uint32_t k = 0; k < self->dimension; k++) {
        self->sum[k] += whitened[k];
    }
    self->ticks++;
    if (is_last) {
        close_block(self, is_considered);
    } else if (!is_considered && self->ticks % LOOK_TICKS == LOOK_PHASE) {
        look_ahead(self, config->tick_s / HEXLOAD_RESIDUAL_BLOCK_S);
    }
}
