#include "momentum/transient.h"

#include "algebra/chi_square.h"
#include "algebra/real.h"

#include <string.h>

/// Weights of tick j on either side in a parabola's value at the middle: with sums over the window without
/// it, n its ticks, (S4 - S2 j^2) / (n S4 - S2^2). At j = 0 that is the variance of the value, in those of a
/// tick.
#define WIDE(j) (HEXLOAD_REAL(0.09919286) - HEXLOAD_REAL(0.00106202) * HEXLOAD_REAL(j) * HEXLOAD_REAL(j))
#define NARROW(j) (HEXLOAD_REAL(0.21186441) - HEXLOAD_REAL(0.00847458) * HEXLOAD_REAL(j) * HEXLOAD_REAL(j))

/// Ten sigma in each leg.
#define NARROW_LIMIT HEXLOAD_REAL(600.0)

enum { LONGEST_LAGS = 4 }; ///< that a transient lasts

static hexload_real_t distance_square(const hexload_real_t a[HEXLOAD_LEGS],
                                      const hexload_real_t b[HEXLOAD_LEGS]) {
    hexload_real_t square = HEXLOAD_REAL(0.0);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        square = hexload_fma(a[leg] - b[leg], a[leg] - b[leg], square);
    }
    return square;
}

/// @return whether anything is.
static bool keep_significant(const hexload_real_t seen_m_s[HEXLOAD_LEGS], hexload_real_t least_square,
                             hexload_real_t velocity_m_s[HEXLOAD_LEGS]) {
    hexload_real_t beyond_m_s[HEXLOAD_LEGS];
    hexload_real_t square = HEXLOAD_REAL(0.0);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        beyond_m_s[leg] = seen_m_s[leg] - velocity_m_s[leg];
        square = hexload_fma(beyond_m_s[leg], beyond_m_s[leg], square);
    }
    if (square > least_square) {
        const hexload_real_t share = HEXLOAD_REAL(1.0) - least_square / square;
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            velocity_m_s[leg] = hexload_fma(share, beyond_m_s[leg], velocity_m_s[leg]);
        }
    }
    return square > least_square;
}

/// Counts the ticks of transients up and others down. @return whether there have been so many of late that it
/// is none, but a servo that rings: the noise of such speeds in the directions that it does not move would in
/// time count as information on them.
static bool lasts(hexload_smoother_t* smoother, bool is_transient) {
    const uint32_t longest = LONGEST_LAGS * smoother->constants.lag_ticks;
    if (is_transient) {
        smoother->transient_ticks += smoother->transient_ticks < 2 * longest ? 1 : 0;
    } else {
        smoother->transient_ticks -= smoother->transient_ticks > 0 ? 1 : 0;
    }
    return smoother->transient_ticks > longest;
}

void hexload_transient_follow(hexload_smoother_t* smoother, uint32_t place, hexload_real_t sigma_m_s,
                              hexload_real_t velocity_m_s[HEXLOAD_LEGS]) {
    static const hexload_real_t wide[HEXLOAD_TRANSIENT_TICKS] = {
        WIDE(1.0), WIDE(2.0), WIDE(3.0), WIDE(4.0),  WIDE(5.0),  WIDE(6.0),
        WIDE(7.0), WIDE(8.0), WIDE(9.0), WIDE(10.0), WIDE(11.0), WIDE(12.0)};
    static const hexload_real_t narrow[HEXLOAD_TRANSIENT_TICKS] = {NARROW(1.0), NARROW(2.0), NARROW(3.0),
                                                                   NARROW(4.0), NARROW(5.0), NARROW(6.0)};
    const hexload_real_t variance = sigma_m_s * sigma_m_s;
    hexload_real_t by_wide_m_s[HEXLOAD_LEGS] = {0};
    hexload_real_t by_narrow_m_s[HEXLOAD_LEGS] = {0};
    bool is_whole = true;
    uint32_t before = place;
    uint32_t after = place;
    for (int j = 0; j < HEXLOAD_TRANSIENT_TICKS; j++) {
        before = (before == 0 ? HEXLOAD_DELAY_CAPACITY : before) - 1;
        after = after + 1 == HEXLOAD_DELAY_CAPACITY ? 0 : after + 1;
        const hexload_real_t* before_m_s = smoother->velocity_m_s[before];
        const hexload_real_t* after_m_s = smoother->velocity_m_s[after];
        is_whole = is_whole && !hexload_smoother_leaves_out(smoother, before) &&
                   !hexload_smoother_leaves_out(smoother, after);
        HEXLOAD_UNROLL
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            const hexload_real_t pair_m_s = before_m_s[leg] + after_m_s[leg];
            by_wide_m_s[leg] = hexload_fma(wide[j], pair_m_s, by_wide_m_s[leg]);
            by_narrow_m_s[leg] = hexload_fma(narrow[j], pair_m_s, by_narrow_m_s[leg]);
        }
    }
    // until the window is full there is nothing else that follows a motion's start
    const bool has_window = smoother->entered > 2 * smoother->constants.lag_ticks;
    const hexload_real_t narrow_limit = has_window ? NARROW_LIMIT : CHI_SQUARE_6_999;
    // what is faster than the wide one comes out of it as nothing, or turned round
    const bool is_wide =
        distance_square(by_narrow_m_s, by_wide_m_s) < distance_square(by_wide_m_s, velocity_m_s);
    hexload_real_t with_m_s[HEXLOAD_LEGS];
    bool is_transient = false;
    memcpy(with_m_s, velocity_m_s, sizeof with_m_s);
    if (is_whole && is_wide) {
        is_transient = keep_significant(by_wide_m_s, CHI_SQUARE_6_999 * WIDE(0.0) * variance, with_m_s);
    }
    if (is_whole && keep_significant(by_narrow_m_s, narrow_limit * NARROW(0.0) * variance, with_m_s)) {
        is_transient = true;
    }
    if (!lasts(smoother, is_transient) && is_transient) {
        memcpy(velocity_m_s, with_m_s, sizeof with_m_s);
    }
}
