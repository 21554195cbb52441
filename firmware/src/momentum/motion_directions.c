#include "momentum/motion_directions.h"

#include "algebra/chi_square.h"
#include "algebra/linalg.h"

#include <string.h>

/// kappa: noise alone, of mean square 1, keeps a sixth of its amplitude. A motion loses 1.1 sigma at most.
#define KAPPA HEXLOAD_REAL(5.0)

/// A slope counts no more, so that float has room for kappa beside A: six roundings of 1e6 are 0.4.
#define LARGEST_SQUARE HEXLOAD_REAL(1e6)

/// A is a mean over all slopes at first, later over 128, eight ticks apart, as neighbours share their window.
enum { SLOPES = 128, TICKS_APART = 8 };

HEXLOAD_RARE void hexload_motion_directions_init(hexload_motion_directions_t* self) {
    memset(self, 0, sizeof *self);
    for (int i = 0; i < HEXLOAD_LEGS; i++) {
        self->factor[ROW(i) + i] = HEXLOAD_REAL(1.0);
    }
}

/// Of L L^T = A / kappa + E, diagonal inverted.
static void factor_row(hexload_motion_directions_t* self, uint32_t i) {
    hexload_real_t* row = &self->next_factor[ROW(i)];
    for (uint32_t j = 0; j <= i; j++) {
        hexload_real_t sum =
            self->spread[ROW(i) + j] / KAPPA + (i == j ? HEXLOAD_REAL(1.0) : HEXLOAD_REAL(0.0));
        for (uint32_t k = 0; k < j; k++) {
            sum = hexload_fma(-row[k], self->next_factor[ROW(j) + k], sum);
        }
        row[j] = i == j ? HEXLOAD_REAL(1.0) / hexload_sqrt(sum) : sum * self->next_factor[ROW(j) + j];
    }
}

static void take(hexload_motion_directions_t* self, const hexload_real_t slope_m_s[HEXLOAD_LEGS],
                 hexload_real_t inverse_sigma_s_m) {
    hexload_real_t c[HEXLOAD_LEGS];
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        c[leg] = slope_m_s[leg] * inverse_sigma_s_m;
    }
    self->slopes += self->slopes < SLOPES ? 1 : 0;
    const hexload_real_t share = HEXLOAD_REAL(1.0) / (hexload_real_t)self->slopes;
    const hexload_real_t square = dot6(c, c);
    const hexload_real_t weight = square > LARGEST_SQUARE ? share * LARGEST_SQUARE / square : share;
    for (int i = 0; i < HEXLOAD_LEGS; i++) {
        for (int j = 0; j <= i; j++) {
            self->spread[ROW(i) + j] += weight * c[i] * c[j] - share * self->spread[ROW(i) + j];
        }
    }
}

void hexload_motion_directions_learn(hexload_motion_directions_t* self,
                                     const hexload_real_t slope_m_s[HEXLOAD_LEGS],
                                     hexload_real_t inverse_sigma_s_m) {
    if (self->turn == 0) {
        take(self, slope_m_s, inverse_sigma_s_m);
    } else if (self->turn <= HEXLOAD_LEGS) {
        factor_row(self, self->turn - 1);
    } else {
        memcpy(self->factor, self->next_factor, sizeof self->factor);
    }
    self->turn = (self->turn + 1) % TICKS_APART;
}

void hexload_motion_directions_keep(const hexload_motion_directions_t* self,
                                    hexload_real_t inverse_variance_s2_m2,
                                    hexload_real_t slope_m_s[HEXLOAD_LEGS]) {
    hexload_real_t y[HEXLOAD_LEGS]; // L^-1 c, then L^-T L^-1 c: what W leaves out
    HEXLOAD_UNROLL
    for (int i = 0; i < HEXLOAD_LEGS; i++) {
        y[i] = slope_m_s[i];
        HEXLOAD_UNROLL
        for (int k = 0; k < i; k++) {
            y[i] = hexload_fma(-self->factor[ROW(i) + k], y[k], y[i]);
        }
        y[i] *= self->factor[ROW(i) + i];
    }
    HEXLOAD_UNROLL
    for (int i = HEXLOAD_LEGS - 1; i >= 0; i--) {
        HEXLOAD_UNROLL
        for (int k = i + 1; k < HEXLOAD_LEGS; k++) {
            y[i] = hexload_fma(-self->factor[ROW(k) + i], y[k], y[i]);
        }
        y[i] *= self->factor[ROW(i) + i];
    }
    const hexload_real_t left = HEXLOAD_REAL(1.0) - hexload_beyond_noise(dot6(y, y) * inverse_variance_s2_m2);
    for (int i = 0; i < HEXLOAD_LEGS; i++) {
        slope_m_s[i] = hexload_fma(-left, y[i], slope_m_s[i]);
    }
}
