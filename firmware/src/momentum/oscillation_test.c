#include "momentum/oscillation_test.h"

#include "algebra/linalg.h"

#include <string.h>

/// Of a leaky sum that a second keeps: it goes back some ten.
#define KEPT HEXLOAD_REAL(0.9)

/// What a pair may have for its six innovations before it counts, and the sum of what counts that is more
/// than chance (residual_test.c). One pair may be a start of all legs at once: three are none.
#define GRANTED HEXLOAD_REAL(9.0)
#define LEAST_EXCESS HEXLOAD_REAL(60.0)
#define LEAST_PAIRS 3U

/// Of what lasts. Rigs of all kinds, on random, working and periodic motions, have been seen at 1.2, a tenth
/// of a load that swings or sloshes on slow motion from 3 to 14.
#define LEAST_SHARE HEXLOAD_REAL(2.0)

void hexload_oscillation_test_init(hexload_oscillation_test_t* self) {
    *self = (hexload_oscillation_test_t){.half = 0};
}

/// Squares of what the halves differ by, less what the constants may do: c.
static hexload_real_t square_of_swing(hexload_real_t shown[HEXLOAD_RIG_DIRECTIONS_MAX][6],
                                      hexload_real_t difference[6], hexload_real_t ticks) {
    hexload_real_t covariance[6][6];
    hexload_real_t square = HEXLOAD_REAL(0.0);
    memset(covariance, 0, sizeof covariance);
    for (int a = 0; a < 6; a++) {
        covariance[a][a] = ticks;
        for (int n = 0; n < HEXLOAD_RIG_DIRECTIONS_MAX; n++) { // zeros beyond the configured ones
            for (int b = 0; b <= a; b++) {
                covariance[a][b] = hexload_fma(shown[n][a], shown[n][b], covariance[a][b]);
            }
        }
    }
    hexload_cholesky6(covariance);
    hexload_whiten6(covariance, difference, 1);
    for (int a = 0; a < 6; a++) {
        square = hexload_fma(difference[a], difference[a], square);
    }
    return square;
}

HEXLOAD_RARE static void judge(hexload_oscillation_test_t* self, hexload_consider_t* consider,
                               const hexload_real_t second[6], hexload_real_t ticks) {
    hexload_real_t difference[6];
    hexload_real_t lasting = HEXLOAD_REAL(0.0);
    for (int a = 0; a < 6; a++) {
        const hexload_real_t both = self->first[a] + second[a];
        difference[a] = second[a] - self->first[a];
        lasting = hexload_fma(both, both, lasting);
    }
    const hexload_real_t excess = square_of_swing(consider->shown, difference, ticks) - GRANTED;
    self->swinging = hexload_max(HEXLOAD_REAL(0.0), hexload_fma(KEPT, self->swinging, excess));
    self->lasting = hexload_fma(KEPT, self->lasting, lasting / ticks);
    if (self->pairs < LEAST_PAIRS) {
        self->pairs++;
    }
    self->is_there = (self->pairs == LEAST_PAIRS) &&
                     (self->swinging > hexload_max(LEAST_EXCESS, LEAST_SHARE * self->lasting));
}

static void turn(hexload_real_t shown[HEXLOAD_RIG_DIRECTIONS_MAX][6]) {
    for (int n = 0; n < HEXLOAD_RIG_DIRECTIONS_MAX; n++) {
        for (int a = 0; a < 6; a++) {
            shown[n][a] = -shown[n][a];
        }
    }
}

void hexload_oscillation_test_step(hexload_oscillation_test_t* self, hexload_consider_t* consider,
                                   const hexload_residual_test_t* residual_test,
                                   const hexload_real_t whitened[6]) {
    hexload_real_t sum[6];
    for (int a = 0; a < 6; a++) {
        sum[a] = residual_test->sum[a] + whitened[a];
    }
    if (self->half == 1U) {
        memcpy(self->first, sum, sizeof self->first);
        turn(consider->shown);
        self->half = 2;
    } else {
        if (self->half == 2U) {
            const uint32_t ticks = residual_test->ticks + 1U;
            judge(self, consider, sum, HEXLOAD_REAL(2.0) * (hexload_real_t)ticks);
        }
        memset(consider->shown, 0, sizeof consider->shown);
        self->half = 1;
    }
}
