#include "momentum/transient.h"

#include "algebra/chi_square.h"
#include "algebra/linalg.h"
#include "momentum/speed_noise.h"

#include <string.h>

enum { PARTS = 3 };
enum { LONGEST_LAGS = 4 }; ///< that a transient lasts

/// Weights of the ticks j before and after in the middle value of the polynomial of degree two that fits the
/// 24 ticks best, and in what that of degree four adds to it, and that of degree six. The three are
/// orthogonal: the noise of one says nothing of another's. At j = 0 that is the variance of the part, in
/// those of a tick.
#define SQUARE(j) (HEXLOAD_REAL(j) * HEXLOAD_REAL(j))
#define OF_TWO(j) (HEXLOAD_REAL(9.919286321e-2) - SQUARE(j) * HEXLOAD_REAL(1.062022090e-3))
#define OF_FOUR(j)                                                                                           \
    (HEXLOAD_REAL(6.589525109e-2) -                                                                          \
     SQUARE(j) * (HEXLOAD_REAL(3.935648898e-3) - SQUARE(j) * HEXLOAD_REAL(2.911264653e-5)))
#define OF_SIX(j)                                                                                            \
    (HEXLOAD_REAL(7.602676390e-2) -                                                                          \
     SQUARE(j) * (HEXLOAD_REAL(9.284790042e-3) -                                                             \
                  SQUARE(j) * (HEXLOAD_REAL(1.772035375e-4) - SQUARE(j) * HEXLOAD_REAL(8.365908896e-7))))
static const hexload_real_t weight[PARTS][HEXLOAD_TRANSIENT_TICKS + 1] = {
    {OF_TWO(0.0), OF_TWO(1.0), OF_TWO(2.0), OF_TWO(3.0), OF_TWO(4.0), OF_TWO(5.0), OF_TWO(6.0), OF_TWO(7.0),
     OF_TWO(8.0), OF_TWO(9.0), OF_TWO(10.0), OF_TWO(11.0), OF_TWO(12.0)},
    {OF_FOUR(0.0), OF_FOUR(1.0), OF_FOUR(2.0), OF_FOUR(3.0), OF_FOUR(4.0), OF_FOUR(5.0), OF_FOUR(6.0),
     OF_FOUR(7.0), OF_FOUR(8.0), OF_FOUR(9.0), OF_FOUR(10.0), OF_FOUR(11.0), OF_FOUR(12.0)},
    {OF_SIX(0.0), OF_SIX(1.0), OF_SIX(2.0), OF_SIX(3.0), OF_SIX(4.0), OF_SIX(5.0), OF_SIX(6.0), OF_SIX(7.0),
     OF_SIX(8.0), OF_SIX(9.0), OF_SIX(10.0), OF_SIX(11.0), OF_SIX(12.0)}};

/// What each degree adds, the first to the speeds that there are. @return whether none of the ticks around is
/// left out.
static bool read_parts(const hexload_smoother_t* smoother, uint32_t place,
                       const hexload_real_t velocity_m_s[HEXLOAD_LEGS],
                       hexload_real_t part_m_s[PARTS][HEXLOAD_LEGS]) {
    bool is_whole = true;
    uint32_t before = place;
    uint32_t after = place;
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        part_m_s[0][leg] = -velocity_m_s[leg];
        part_m_s[1][leg] = HEXLOAD_REAL(0.0);
        part_m_s[2][leg] = HEXLOAD_REAL(0.0);
    }
    for (int j = 1; j <= HEXLOAD_TRANSIENT_TICKS; j++) {
        before = (before == 0 ? HEXLOAD_DELAY_CAPACITY : before) - 1;
        after = after + 1 == HEXLOAD_DELAY_CAPACITY ? 0 : after + 1;
        const hexload_real_t* before_m_s = smoother->velocity_m_s[before];
        const hexload_real_t* after_m_s = smoother->velocity_m_s[after];
        is_whole = is_whole && !hexload_smoother_leaves_out(smoother, before) &&
                   !hexload_smoother_leaves_out(smoother, after);
        HEXLOAD_UNROLL
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            const hexload_real_t pair_m_s = before_m_s[leg] + after_m_s[leg];
            part_m_s[0][leg] = hexload_fma(weight[0][j], pair_m_s, part_m_s[0][leg]);
            part_m_s[1][leg] = hexload_fma(weight[1][j], pair_m_s, part_m_s[1][leg]);
            part_m_s[2][leg] = hexload_fma(weight[2][j], pair_m_s, part_m_s[2][leg]);
        }
    }
    return is_whole;
}

/// @return whether anything is.
static bool keep_significant(const hexload_real_t part_m_s[HEXLOAD_LEGS], hexload_real_t least_square,
                             hexload_real_t velocity_m_s[HEXLOAD_LEGS]) {
    const hexload_real_t square = dot6(part_m_s, part_m_s);
    if (square > least_square) {
        const hexload_real_t share = HEXLOAD_REAL(1.0) - least_square / square;
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            velocity_m_s[leg] = hexload_fma(share, part_m_s[leg], velocity_m_s[leg]);
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
    hexload_real_t part_m_s[PARTS][HEXLOAD_LEGS];
    hexload_real_t with_m_s[HEXLOAD_LEGS];
    bool is_transient = false;
    const hexload_real_t least_m2_s2 = CHI_SQUARE_6_999 * hexload_speed_noise(smoother, place, sigma_m_s);
    const bool is_whole = read_parts(smoother, place, velocity_m_s, part_m_s);
    memcpy(with_m_s, velocity_m_s, sizeof with_m_s);
    for (int k = 0; k < PARTS; k++) {
        if (is_whole && keep_significant(part_m_s[k], weight[k][0] * least_m2_s2, with_m_s)) {
            is_transient = true;
        }
    }
    if (!lasts(smoother, is_transient) && is_transient) {
        memcpy(velocity_m_s, with_m_s, sizeof with_m_s);
    }
}
