#include "ringing.h"

enum { NARROW_TICKS = 6 };

/// Of tick j to each side in the parabola's value at the middle: with sums over the window without it, n its
/// ticks, (S4 - S2 j^2) / (n S4 - S2^2), which is also the variance, at j = 0, in those of a tick.
#define WIDE(j) (HEXLOAD_REAL(0.09919286) - HEXLOAD_REAL(0.00106202) * HEXLOAD_REAL(j) * HEXLOAD_REAL(j))
#define NARROW(j) (HEXLOAD_REAL(0.21186441) - HEXLOAD_REAL(0.00847458) * HEXLOAD_REAL(j) * HEXLOAD_REAL(j))

#define WIDE_LIMIT HEXLOAD_REAL(22.46)
#define NARROW_LIMIT HEXLOAD_REAL(600.0)

static void keep_significant(const hexload_real_t seen_m_s[HEXLOAD_LEGS], hexload_real_t least_square,
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
}

void ringing_follow(const hexload_smoother_t* smoother, uint32_t place, hexload_real_t sigma_m_s,
                    hexload_real_t velocity_m_s[HEXLOAD_LEGS]) {
    static const hexload_real_t wide[HEXLOAD_RINGING_TICKS] = {WIDE(1.0), WIDE(2.0),  WIDE(3.0),  WIDE(4.0),
                                                               WIDE(5.0), WIDE(6.0),  WIDE(7.0),  WIDE(8.0),
                                                               WIDE(9.0), WIDE(10.0), WIDE(11.0), WIDE(12.0)};
    static const hexload_real_t narrow[NARROW_TICKS] = {NARROW(1.0), NARROW(2.0), NARROW(3.0),
                                                        NARROW(4.0), NARROW(5.0), NARROW(6.0)};
    const hexload_real_t variance = sigma_m_s * sigma_m_s;
    hexload_real_t seen_m_s[2][HEXLOAD_LEGS] = {{0}};
    uint32_t before = place;
    uint32_t after = place;
    for (int j = 0; j < HEXLOAD_RINGING_TICKS; j++) {
        before = (before == 0 ? HEXLOAD_DELAY_CAPACITY : before) - 1;
        after = after + 1 == HEXLOAD_DELAY_CAPACITY ? 0 : after + 1;
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            const hexload_real_t pair =
                smoother->velocity_m_s[before][leg] + smoother->velocity_m_s[after][leg];
            seen_m_s[0][leg] = hexload_fma(wide[j], pair, seen_m_s[0][leg]);
            if (j < NARROW_TICKS) {
                seen_m_s[1][leg] = hexload_fma(narrow[j], pair, seen_m_s[1][leg]);
            }
        }
    }
    keep_significant(seen_m_s[0], WIDE_LIMIT * WIDE(0.0) * variance, velocity_m_s);
    keep_significant(seen_m_s[1], NARROW_LIMIT * NARROW(0.0) * variance, velocity_m_s);
}
