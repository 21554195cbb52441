#include "momentum/oscillation_test.h"

#include "algebra/linalg.h"

#include <string.h>

/// Half seconds: that of a change of the load, and rounds of a pair that follow each other and a pair with
/// one between them.
enum { SHOCK, NEAR_FIRST, NEAR_SECOND, FAR_FIRST, FAR_PAUSE, FAR_SECOND };

/// Of a leaky sum that each of its pairs keeps: it goes back some ten of them.
#define KEPT HEXLOAD_REAL(0.9)

/// What a pair may have for its six innovations before it counts, and the sum of what counts that is more
/// than chance (residual_test.c). One pair may be a start of all legs at once: three are none.
#define GRANTED HEXLOAD_REAL(9.0)
#define LEAST_EXCESS HEXLOAD_REAL(60.0)
#define LEAST_PAIRS 3U

/// Of what lasts. Rigs of all kinds, on random, working and periodic motions, have been seen at 0.9 at most,
/// a tenth of a load that swings or sloshes on slow motion from 1.4 on; it may stop to, and is there.
#define LEAST_SHARE HEXLOAD_REAL(1.2)

void hexload_oscillation_test_init(hexload_oscillation_test_t* self) {
    *self = (hexload_oscillation_test_t){.step = SHOCK};
}

/// Squares of what the halves differ by, less what the constants may do: c.
static hexload_real_t square_of_swing(hexload_real_t shown[HEXLOAD_RIG_DIRECTIONS_MAX][6],
                                      hexload_real_t difference[6], hexload_real_t ticks) {
    hexload_real_t covariance[6][6]; // the lower triangle
    hexload_real_t square = HEXLOAD_REAL(0.0);
    for (int a = 0; a < 6; a++) {
        for (int b = 0; b <= a; b++) {
            hexload_real_t sum = (a == b) ? ticks : HEXLOAD_REAL(0.0);
            for (int n = 0; n < HEXLOAD_RIG_DIRECTIONS_MAX; n++) { // zeros beyond the configured ones
                sum = hexload_fma(shown[n][a], shown[n][b], sum);
            }
            covariance[a][b] = sum;
        }
    }
    hexload_cholesky6(covariance);
    hexload_whiten6(covariance, difference, 1);
    for (int a = 0; a < 6; a++) {
        square = hexload_fma(difference[a], difference[a], square);
    }
    return square;
}

/// What has been there is so until it has come to rest.
static bool swings(const hexload_oscillation_test_t* self, int lag) {
    const hexload_real_t share = self->is_there ? HEXLOAD_REAL(0.0) : LEAST_SHARE;
    return (self->pairs[lag] == LEAST_PAIRS) &&
           (self->swinging[lag] > hexload_max(LEAST_EXCESS, share * self->lasting[lag]));
}

HEXLOAD_RARE static void judge(hexload_oscillation_test_t* self, int lag, hexload_consider_t* consider,
                               const hexload_real_t second[6], hexload_real_t ticks) {
    hexload_real_t difference[6];
    hexload_real_t lasting = HEXLOAD_REAL(0.0);
    for (int a = 0; a < 6; a++) {
        const hexload_real_t both = self->first[a] + second[a];
        difference[a] = second[a] - self->first[a];
        lasting = hexload_fma(both, both, lasting);
    }
    const hexload_real_t excess = square_of_swing(consider->shown, difference, ticks) - GRANTED;
    self->swinging[lag] = hexload_max(HEXLOAD_REAL(0.0), hexload_fma(KEPT, self->swinging[lag], excess));
    self->lasting[lag] = hexload_fma(KEPT, self->lasting[lag], lasting / ticks);
    if (self->pairs[lag] < LEAST_PAIRS) {
        self->pairs[lag]++;
    }
    self->is_there = swings(self, 0) || swings(self, 1);
}

static void begin_pair(hexload_oscillation_test_t* self, hexload_consider_t* consider,
                       const hexload_real_t sum[6]) {
    memcpy(self->first, sum, sizeof self->first);
    for (int n = 0; n < HEXLOAD_RIG_DIRECTIONS_MAX; n++) {
        for (int a = 0; a < 6; a++) {
            consider->shown[n][a] = -consider->shown[n][a];
        }
    }
}

void hexload_oscillation_test_step(hexload_oscillation_test_t* self, hexload_consider_t* consider,
                                   const hexload_residual_test_t* residual_test,
                                   const hexload_real_t whitened[6]) {
    const uint32_t ticks = residual_test->ticks + 1U;
    hexload_real_t sum[6];
    for (int a = 0; a < 6; a++) {
        sum[a] = residual_test->sum[a] + whitened[a];
    }
    const bool is_first = (self->step == NEAR_FIRST) || (self->step == FAR_FIRST);
    const bool is_second = (self->step == NEAR_SECOND) || (self->step == FAR_SECOND);
    if (is_first) {
        begin_pair(self, consider, sum);
    }
    if (is_second) {
        judge(self, (self->step == NEAR_SECOND) ? 0 : 1, consider, sum,
              HEXLOAD_REAL(2.0) * (hexload_real_t)ticks);
    }
    if (is_second || (self->step == SHOCK)) {
        memset(consider->shown, 0, sizeof consider->shown);
    }
    consider->is_paused = (self->step == FAR_FIRST);
    self->step++;
    if (self->step > FAR_SECOND) {
        self->step = NEAR_FIRST;
    }
}
