#include "momentum/residual_test.h"

#include "algebra/chi_square.h"
#include "algebra/linalg.h"

#include <stdbool.h>
#include <string.h>

/// Of a sum: long against the noise, short against a motion.
#define BLOCK_S HEXLOAD_REAL(0.5)

/// Share of a block in the mean, which goes back 5 s.
#define SHARE HEXLOAD_REAL(0.1)

/// What a block may have before it counts, and the sum of what counts that is more than chance: of ideal
/// innovations that sum exceeds x with a probability of exp(-0.29 x) (Wald), 2e-8.
#define GRANTED_NIS HEXLOAD_REAL(9.0)
#define LEAST_EXCESS HEXLOAD_REAL(60.0)

void hexload_residual_test_init(hexload_residual_test_t* self) {
    *self = (hexload_residual_test_t){
        .nis = CHI_SQUARE_6_MEAN, .nis_mean = CHI_SQUARE_6_MEAN, .factor = HEXLOAD_REAL(1.0)};
}

/// A whole block of this load. The first one has the shock of the change in it.
static void close_block(hexload_residual_test_t* self, const hexload_config_t* config) {
    if (self->has_begun) {
        self->nis = dot6(self->sum, self->sum) / (hexload_real_t)self->ticks;
        self->nis_mean += SHARE * (self->nis - self->nis_mean);
        self->excess = hexload_max(HEXLOAD_REAL(0.0), self->excess + self->nis - GRANTED_NIS);
        const bool is_mismatch = self->excess > LEAST_EXCESS && config->rig.direction_count == 0;
        self->factor = is_mismatch ? hexload_sqrt(HEXLOAD_REAL(1.0) + self->excess) : HEXLOAD_REAL(1.0);
    }
    memset(self->sum, 0, sizeof self->sum);
    self->ticks = 0;
    self->has_begun = true;
}

void hexload_residual_test_step(hexload_residual_test_t* self, const hexload_config_t* config,
                                const hexload_momentum_update_t* update) {
    for (int k = 0; k < 6; k++) {
        self->sum[k] += update->innovation[k];
    }
    self->ticks++;
    if ((hexload_real_t)self->ticks * config->tick_s >= BLOCK_S) {
        close_block(self, config);
    }
}
