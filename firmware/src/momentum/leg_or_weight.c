#include "momentum/leg_or_weight.h"

#include "algebra/linalg.h"
#include "momentum/momentum_model.h"
#include "momentum/wrench_monitor.h"

/// What is none explains nothing.
#define LEAST_SQUARE HEXLOAD_REAL(1e-20)

/// Wrenches about O_A, base axes: a newton of each leg, what is missing, and of another load's weight that of
/// a mass in O_A and what moves it to either side.
enum { MISSING = HEXLOAD_LEGS, WEIGHT, WEIGHTS = 3, WRENCHES = WEIGHT + WEIGHTS };

/// Part of y^T y that is along x.
static hexload_real_t square_along(const hexload_real_t y[HEXLOAD_LEGS],
                                   const hexload_real_t x[HEXLOAD_LEGS]) {
    const hexload_real_t along = dot6(y, x);
    return along * along / hexload_max(dot6(x, x), LEAST_SQUARE);
}

/// Part of y^T y that the rows together explain; they become orthogonal.
static hexload_real_t square_within(const hexload_real_t y[HEXLOAD_LEGS],
                                    hexload_real_t (*rows)[HEXLOAD_LEGS]) {
    hexload_real_t square = HEXLOAD_REAL(0.0);
    for (int n = 0; n < (int)WEIGHTS; n++) {
        for (int m = 0; m < n; m++) {
            const hexload_real_t of_other = hexload_max(dot6(rows[m], rows[m]), LEAST_SQUARE);
            const hexload_real_t share = dot6(rows[n], rows[m]) / of_other;
            for (int k = 0; k < (int)HEXLOAD_LEGS; k++) {
                rows[n][k] = hexload_fma(-share, rows[m][k], rows[n][k]);
            }
        }
        square += square_along(y, rows[n]);
    }
    return square;
}

/// L with M = L L^T, about O_A, as hexload_whiten6() takes it.
static void factor_inertia(const hexload_motion_t* motion, const hexload_real_t body[HEXLOAD_LOAD_DIM],
                           hexload_real_t L[6][6]) {
    for (int k = 0; k < 6; k++) {
        hexload_real_t twist[6] = {0};
        twist[k] = HEXLOAD_REAL(1.0);
        hexload_momentum_of_body(body, motion, twist, L[k]);
        hexload_momentum_move_point(motion, L[k], L[k]);
    }
    hexload_cholesky6(L);
}

/// Columns are the wrenches.
static void find_wrenches(const hexload_motion_t* motion, const hexload_missing_t* missing,
                          hexload_real_t X[6][WRENCHES]) {
    const hexload_real_t zero = HEXLOAD_REAL(0.0);
    const hexload_real_t* s = missing->pull_m_s2;
    const hexload_real_t weights[6][WEIGHTS] = {{s[0], zero, zero}, {s[1], zero, zero},  {s[2], zero, zero},
                                                {zero, zero, s[2]}, {zero, -s[2], zero}, {zero, s[1], -s[0]}};
    for (int k = 0; k < 6; k++) {
        for (int leg = 0; leg < (int)HEXLOAD_LEGS; leg++) {
            X[k][leg] = motion->J[leg][k];
        }
        X[k][MISSING] = missing->wrench[k];
        for (int n = 0; n < (int)WEIGHTS; n++) {
            X[k][(int)WEIGHT + n] = weights[k][n];
        }
    }
}

/// What each wrench does to the legs, J M^-1 X, of whitened columns; rows are wrenches, the first six P.
static void accelerate(hexload_real_t X[6][WRENCHES], hexload_real_t legs[WRENCHES][HEXLOAD_LEGS]) {
    for (int n = 0; n < (int)WRENCHES; n++) {
        const hexload_real_t x[6] = {X[0][n], X[1][n], X[2][n], X[3][n], X[4][n], X[5][n]};
        for (int leg = 0; leg < (int)HEXLOAD_LEGS; leg++) {
            hexload_real_t sum = x[0] * X[0][leg];
            HEXLOAD_UNROLL
            for (int k = 1; k < 6; k++) {
                sum = hexload_fma(x[k], X[k][leg], sum);
            }
            legs[n][leg] = sum;
        }
    }
}

/// s^2 of a leg. @param of_forces |P|^2.
static hexload_real_t noise_variance(const hexload_config_t* config, const hexload_sensors_t* sensors,
                                     hexload_real_t kept, hexload_real_t of_forces) {
    const hexload_real_t rate_m_s2 = sensors->velocity_sigma_m_s / HEXLOAD_WRENCH_MEMORY_S;
    const hexload_real_t averaged =
        config->tick_s / ((HEXLOAD_REAL(2.0) * HEXLOAD_WRENCH_MEMORY_S) - config->tick_s);
    const hexload_real_t per_leg = averaged * of_forces / (hexload_real_t)HEXLOAD_LEGS;
    return (kept * rate_m_s2 * rate_m_s2) + (per_leg * sensors->force_sigma_n * sensors->force_sigma_n);
}

void hexload_explain_missing(const hexload_config_t* config, const hexload_present_tick_t* now,
                             const hexload_missing_t* missing, hexload_explained_t* explained) {
    hexload_real_t L[6][6];
    hexload_real_t X[6][WRENCHES];
    hexload_real_t legs[WRENCHES][HEXLOAD_LEGS];
    hexload_real_t of_forces = HEXLOAD_REAL(0.0);
    hexload_real_t by_leg = HEXLOAD_REAL(0.0);
    factor_inertia(now->motion, missing->body, L);
    find_wrenches(now->motion, missing, X);
    hexload_whiten6(L, &X[0][0], WRENCHES);
    accelerate(X, legs);
    const hexload_real_t* y = legs[MISSING];
    for (int leg = 0; leg < (int)HEXLOAD_LEGS; leg++) {
        of_forces += dot6(legs[leg], legs[leg]);
        by_leg = hexload_max(by_leg, hexload_max(y[leg] * y[leg], square_along(y, legs[leg])));
    }
    const hexload_real_t variance = noise_variance(config, &now->sensors, missing->kept, of_forces);
    explained->whole = dot6(y, y) / variance;
    explained->by_leg = by_leg / variance;
    explained->by_weight = square_within(y, &legs[WEIGHT]) / variance;
}
