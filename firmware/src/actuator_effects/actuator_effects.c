#include "actuator_effects/actuator_effects.h"

#include "algebra/chi_square.h"
#include "algebra/leg_blocks.h"
#include "algebra/linalg.h"
#include "actuator_effects/actuator_effects_model.h"
#include "actuator_effects/gain_errors.h"
#include "momentum/load_monitor.h"
#include "momentum/momentum_model.h"

#include <string.h>

enum {
    LOAD = HEXLOAD_LOAD_DIM,
    KNOWN = HEXLOAD_MOMENTUM_STATES, ///< states of the momentum filter: theta, mu
    DIM = HEXLOAD_EFFECTS_DIM,
    TILT = HEXLOAD_EFFECT_TILT,
    COULOMB = HEXLOAD_EFFECT_COULOMB * HEXLOAD_LEGS,
    VISCOUS = HEXLOAD_EFFECT_VISCOUS * HEXLOAD_LEGS,
};

/// How far back the smoother's residual counts.
#define RESIDUAL_S HEXLOAD_REAL(2.0)

/// From the first sample of a load on, as long as it takes until another one that comes after it is detected:
/// the load monitor looks at a new load's samples when it has settled, as far from the filter's ticks.
enum { UNCERTAIN_LAGS = 2 };

/// Beyond the five sigmas that errors of ideal runs have been seen to reach.
#define DRIVEN_SIGMAS HEXLOAD_REAL(6.0)

/// 34 roundings in single precision.
#define ROUNDING HEXLOAD_REAL(4e-6)

/// A platform at rest gives no more information after that.
#define LONGEST_REST_S HEXLOAD_REAL(2.0)

static hexload_real_t prior_variance(const hexload_config_t* config, int i) {
    const hexload_actuator_effects_config_t* effects = &config->actuator_effects;
    const hexload_real_t sigma[HEXLOAD_EFFECT_KINDS] = {
        effects->prior_bias_sigma_n, effects->prior_coulomb_sigma_n, effects->prior_viscous_sigma_n_s_m};
    const hexload_real_t of_effect = i < TILT ? sigma[i / HEXLOAD_LEGS] : effects->prior_tilt_sigma_m_s2;
    return of_effect * of_effect;
}

void hexload_actuator_effects_init(hexload_actuator_effects_t* self, const hexload_config_t* config) {
    *self = (hexload_actuator_effects_t){.dispersion = HEXLOAD_REAL(1.0)};
    for (int i = 0; i < DIM; i++) {
        self->covariance[EFFECT_ROW(i) + KNOWN + i] = prior_variance(config, i);
    }
}

/// Speeds of so many ticks are in a smoother's speed that follows a transient.
#define TRANSIENT_WINDOW_TICKS (2u * HEXLOAD_TRANSIENT_TICKS + 1u)

/// What gravity's vector pulls at: m, and m p + R h about the fixed home point, of platform and load.
typedef hexload_real_t lever_t[4];

/// That at one sample, and what else its speeds say.
typedef struct rub {
    hexload_rub_t at;
    hexload_real_t slope_s_m[HEXLOAD_LEGS]; ///< s'(v)
    bool is_at_rest;                        ///< no speed stands out of the noise
} rub_t;

/// Variance of the smoother's speeds, whatever degrees it takes in.
static hexload_real_t speed_variance(const hexload_smoother_constants_t* smoother,
                                     const hexload_sensors_t* sensors) {
    hexload_real_t sum = HEXLOAD_REAL(0.0);
    for (int m = 0; m < 3; m++) {
        sum += HEXLOAD_REAL(1.0) / smoother->inverse_gain[m];
    }
    return sum * sensors->displacement_sigma_m * sensors->displacement_sigma_m;
}

/// @param origin_m of the platform's axes, from the point that moments are about.
static void find_lever(const hexload_momentum_filter_t* load, const hexload_motion_t* motion,
                       const hexload_real_t origin_m[3], lever_t lever) {
    hexload_real_t h[3];
    for (int k = 0; k < 3; k++) {
        h[k] = load->platform[HEXLOAD_LOAD_HX + k] + load->theta[HEXLOAD_LOAD_HX + k];
    }
    lever[0] = load->platform[HEXLOAD_LOAD_M] + load->theta[HEXLOAD_LOAD_M];
    for (int k = 0; k < 3; k++) {
        lever[1 + k] = hexload_fma(lever[0], origin_m[k], dot3(motion->R[k], h));
    }
}

/// out += what gravity's x and y make of the lever: [m g; lever x g].
static inline void add_tilt(const lever_t lever, hexload_real_t x, hexload_real_t y, hexload_real_t out[6]) {
    out[0] = hexload_fma(lever[0], x, out[0]);
    out[1] = hexload_fma(lever[0], y, out[1]);
    out[3] = hexload_fma(-lever[3], y, out[3]);
    out[4] = hexload_fma(lever[3], x, out[4]);
    out[5] = hexload_fma(lever[1], y, hexload_fma(-lever[2], x, out[5]));
}

/// What gravity's z loses as the vector turns: its length is known.
static hexload_real_t lost_m_s2(const hexload_actuator_effects_t* self, const hexload_config_t* config) {
    const hexload_real_t g = config->gravity_m_s2;
    const hexload_real_t aside =
        self->effect[TILT] * self->effect[TILT] + self->effect[TILT + 1] * self->effect[TILT + 1];
    return aside > HEXLOAD_REAL(0.0) && aside < g * g ? aside / (g + hexload_sqrt(g * g - aside))
                                                      : HEXLOAD_REAL(0.0);
}

static void find_rub(const hexload_momentum_filter_t* load, const hexload_config_t* config,
                     const hexload_delayed_tick_t* past, rub_t* rub) {
    hexload_real_t square = HEXLOAD_REAL(0.0);
    find_lever(load, &past->motion, past->motion.p_m, rub->at.lever);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        const hexload_real_t speed_m_s = past->smooth.smooth_velocity_m_s[leg];
        square += speed_m_s * speed_m_s;
        const friction_sign_t sign = friction_sign_of(speed_m_s, config->actuator_effects.friction_speed_m_s);
        hexload_momentum_of_push(&past->motion, leg, rub->at.push[leg]);
        rub->at.sign[leg] = sign.value;
        rub->slope_s_m[leg] = sign.slope_s_m;
        rub->at.speed_m_s[leg] = speed_m_s;
    }
    rub->is_at_rest = !(square > CHI_SQUARE_6_95 * speed_variance(past->smoother, past->sensors));
}

/// The impulse that the effects take: Jw [E, S, V] times minus the period, each on its mean over the period,
/// and the lever times the period. The product of the means is off the mean of the products by a quarter of
/// both changes' product.
static void make_impulse(const hexload_actuator_effects_t* self, const hexload_rub_t* now,
                         hexload_real_t dt_s, hexload_rub_t* impulse) {
    const hexload_real_t half = HEXLOAD_REAL(0.5);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        for (int k = 0; k < 6; k++) {
            impulse->push[leg][k] = -half * dt_s * (now->push[leg][k] + self->last.push[leg][k]);
        }
        impulse->sign[leg] = half * (now->sign[leg] + self->last.sign[leg]);
        impulse->speed_m_s[leg] = half * (now->speed_m_s[leg] + self->last.speed_m_s[leg]);
    }
    for (int k = 0; k < 4; k++) {
        impulse->lever[k] = half * dt_s * (now->lever[k] + self->last.lever[k]);
    }
}

/// [E, S, V] times a column: what a leg's three effects come to.
static inline hexload_real_t of_leg(const hexload_rub_t* impulse, int leg, const hexload_real_t x[DIM]) {
    return x[leg] + impulse->sign[leg] * x[COULOMB + leg] + impulse->speed_m_s[leg] * x[VISCOUS + leg];
}

/// A x of two columns, which share what is read of A.
HEXLOAD_APART static void find_impulses(const hexload_rub_t* impulse, hexload_real_t x[2][DIM],
                                        hexload_real_t change[2][6]) {
    hexload_real_t force[2][HEXLOAD_LEGS];
    HEXLOAD_UNROLL
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        force[0][leg] = of_leg(impulse, leg, x[0]);
        force[1][leg] = of_leg(impulse, leg, x[1]);
    }
    for (int k = 0; k < 6; k++) {
        hexload_real_t sum = HEXLOAD_REAL(0.0);
        hexload_real_t next_sum = HEXLOAD_REAL(0.0);
        HEXLOAD_UNROLL
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            const hexload_real_t push = impulse->push[leg][k];
            sum = hexload_fma(push, force[0][leg], sum);
            next_sum = hexload_fma(push, force[1][leg], next_sum);
        }
        change[0][k] = sum;
        change[1][k] = next_sum;
    }
    add_tilt(impulse->lever, x[0][TILT], x[0][TILT + 1], change[0]);
    add_tilt(impulse->lever, x[1][TILT], x[1][TILT + 1], change[1]);
}

/// Adds column b of a matrix and its transpose to a covariance of mu, lower triangle.
static void add_column(hexload_real_t covariance[6][6], int b, const hexload_real_t column[6]) {
    for (int a = 0; a < 6; a++) {
        covariance[a >= b ? a : b][a >= b ? b : a] += a == b ? HEXLOAD_REAL(2.0) * column[a] : column[a];
    }
}

/// Columns i and i + 1 of the effects' covariance among themselves.
static inline void read_columns(const hexload_actuator_effects_t* self, int i,
                                hexload_real_t column[2][DIM]) {
    const hexload_real_t* row = &self->covariance[EFFECT_ROW(i) + KNOWN];
    const hexload_real_t* next_row = &self->covariance[EFFECT_ROW(i + 1) + KNOWN];
    for (int j = 0; j <= i; j++) {
        column[0][j] = row[j];
        column[1][j] = next_row[j];
    }
    column[0][i + 1] = next_row[i];
    column[1][i + 1] = next_row[i + 1];
    const hexload_real_t* entry = &next_row[i];
    for (int j = i + 2; j < DIM; j++) {
        entry = &entry[KNOWN + j];
        column[0][j] = entry[0];
        column[1][j] = entry[1];
    }
}

/// mu+ = mu + A effect with A = [Jw [E, S, V], B].
static void move_momentum(const hexload_actuator_effects_t* self, hexload_momentum_filter_t* load,
                          const hexload_config_t* config, const hexload_rub_t* impulse) {
    const hexload_real_t lost = lost_m_s2(self, config);
    hexload_real_t* mu = load->momentum;
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        const hexload_real_t force_n = of_leg(impulse, leg, self->effect);
        for (int k = 0; k < 6; k++) {
            mu[k] = hexload_fma(impulse->push[leg][k], force_n, mu[k]);
        }
    }
    add_tilt(impulse->lever, self->effect[TILT], self->effect[TILT + 1], mu);
    mu[2] = hexload_fma(impulse->lever[0], lost, mu[2]);
    mu[3] = hexload_fma(impulse->lever[2], lost, mu[3]);
    mu[4] = hexload_fma(-impulse->lever[1], lost, mu[4]);
}

/// T's rows of mu for that.
static void move_errors(hexload_actuator_effects_t* self, hexload_consider_t* consider,
                        const hexload_config_t* config, const hexload_rub_t* impulse) {
    hexload_real_t(*rows)[DIM] = self->considered;
    hexload_real_t change[2][6];
    for (uint32_t n = 0; n < config->rig.direction_count; n += 2) { // zeros beyond the last
        find_impulses(impulse, &rows[n], change);
        for (int k = 0; k < 6; k++) {
            consider->momentum[n][k] += change[0][k];
            consider->momentum[n + 1][k] += change[1][k];
        }
    }
}

_Static_assert(HEXLOAD_RIG_DIRECTIONS_MAX % 2 == 0, "directions in pairs");

/// P_mt for that.
static void move_cross(const hexload_actuator_effects_t* self, hexload_momentum_filter_t* load,
                       const hexload_rub_t* impulse) {
    hexload_real_t column[2][DIM];
    hexload_real_t change[2][6];
    for (int j = 0; j < LOAD; j += 2) {
        const hexload_real_t* entry = &self->covariance[j];
        for (int i = 0; i < DIM; i++) {
            column[0][i] = entry[0];
            column[1][i] = entry[1];
            entry = &entry[KNOWN + i + 1];
        }
        find_impulses(impulse, column, change);
        for (int k = 0; k < 6; k++) {
            load->cross_cov[k][j] += change[0][k];
            load->cross_cov[k][j + 1] += change[1][k];
        }
    }
}

/// P_me and P_mm: with C the mean of P_me before and after, P_mm grows by A C^T + C A^T.
static void move_own(hexload_actuator_effects_t* self, hexload_momentum_filter_t* load,
                     const hexload_rub_t* impulse) {
    hexload_real_t column[2][DIM];
    hexload_real_t change[2][6];
    hexload_real_t mean[6][DIM];
    for (int i = 0; i < DIM; i += 2) {
        read_columns(self, i, column);
        find_impulses(impulse, column, change);
        for (int n = 0; n < 2; n++) {
            hexload_real_t* P_me = &self->covariance[EFFECT_ROW(i + n) + LOAD];
            for (int k = 0; k < 6; k++) {
                mean[k][i + n] = P_me[k] + HEXLOAD_REAL(0.5) * change[n][k];
                P_me[k] += change[n][k];
            }
        }
    }
    for (int b = 0; b < 6; b += 2) {
        find_impulses(impulse, &mean[b], change); // columns of A C^T
        add_column(load->momentum_cov, b, change[0]);
        add_column(load->momentum_cov, b + 1, change[1]);
    }
}

/// d mu / d (m, h) by the tilt alone, over a period, as what gravity's x and y make of platform axes: on P_x,
/// P_y they act through m; on H through four numbers each.
typedef struct tilted_pull {
    hexload_real_t x_m_s;
    hexload_real_t y_m_s;
    hexload_real_t height[LIFTED];  ///< p_z, R's third row
    hexload_real_t turning[LIFTED]; ///< y times p_x, R's first row, less x times p_y, R's second row
} tilted_pull_t;

static void find_tilted_pull(const hexload_actuator_effects_t* self, const hexload_motion_t* motion,
                             hexload_real_t dt_s, tilted_pull_t* tilted) {
    const hexload_real_t x = dt_s * self->effect[TILT];
    const hexload_real_t y = dt_s * self->effect[TILT + 1];
    tilted->x_m_s = x;
    tilted->y_m_s = y;
    tilted->height[0] = motion->p_m[2];
    tilted->turning[0] = y * motion->p_m[0] - x * motion->p_m[1];
    for (int k = 0; k < 3; k++) {
        tilted->height[1 + k] = motion->R[2][k];
        tilted->turning[1 + k] = y * motion->R[0][k] - x * motion->R[1][k];
    }
}

/// out += the tilt's part of d mu / d (m, h) times four numbers.
static inline void add_tilted(const tilted_pull_t* tilted, const hexload_real_t x[LIFTED],
                              hexload_real_t out[6]) {
    const hexload_real_t raised = dot4(tilted->height, x);
    out[0] = hexload_fma(tilted->x_m_s, x[0], out[0]);
    out[1] = hexload_fma(tilted->y_m_s, x[0], out[1]);
    out[3] = hexload_fma(-tilted->y_m_s, raised, out[3]);
    out[4] = hexload_fma(tilted->x_m_s, raised, out[4]);
    out[5] += dot4(tilted->turning, x);
}

/// P_mt and P_mm for what the tilt does to the load, which the momentum filter takes for one on a level base.
/// Without, the load's errors would pass for information on it as long as they are large.
HEXLOAD_APART static void tilt_load(hexload_momentum_filter_t* load, const tilted_pull_t* tilted) {
    hexload_real_t mean[6][LIFTED];
    for (int j = 0; j < LOAD; j++) {
        hexload_real_t change[6] = {0};
        add_tilted(tilted, load->load_cov[j], change);
        for (int k = 0; k < 6; k++) {
            if (j < LIFTED) {
                mean[k][j] = load->cross_cov[k][j] + HEXLOAD_REAL(0.5) * change[k];
            }
            load->cross_cov[k][j] += change[k];
        }
    }
    for (int b = 0; b < 6; b++) {
        hexload_real_t product[6] = {0}; // column b of G C^T
        add_tilted(tilted, mean[b], product);
        add_column(load->momentum_cov, b, product);
    }
}

/// P_me for mu+ = mu + Gbar theta, tilt included.
static void pull_covariance(hexload_actuator_effects_t* self, const hexload_momentum_filter_t* load,
                            const hexload_motion_t* motion, const tilted_pull_t* tilted,
                            hexload_real_t impulse_m_s) {
    hexload_real_t G[PULLED][LIFTED];
    hexload_momentum_input_t input; // of which the arms alone count
    for (int axis = 0; axis < 2; axis++) {
        input.arm[axis][0] = motion->p_m[axis];
        memcpy(&input.arm[axis][1], motion->R[axis], 3 * sizeof input.arm[axis][0]);
    }
    hexload_momentum_pull(&load->last_input, &input, impulse_m_s, G);
    for (int k = 0; k < LIFTED; k++) {
        G[1][k] -= tilted->y_m_s * tilted->height[k];
        G[2][k] += tilted->x_m_s * tilted->height[k];
    }
    for (int i = 0; i < DIM; i++) {
        hexload_real_t* row = &self->covariance[EFFECT_ROW(i)];
        row[LOAD] = hexload_fma(tilted->x_m_s, row[0], row[LOAD]);
        row[LOAD + 1] = hexload_fma(tilted->y_m_s, row[0], row[LOAD + 1]);
        row[LOAD + 2] += G[0][0] * row[0];
        row[LOAD + 3] += dot4(G[1], row);
        row[LOAD + 4] += dot4(G[2], row);
        row[LOAD + 5] += dot4(tilted->turning, row);
    }
}

/// How much faster than the smoother the legs move.
static void watch_residual(hexload_actuator_effects_t* self, const hexload_config_t* config,
                           const hexload_delayed_tick_t* past) {
    const hexload_smooth_sample_t* sample = &past->smooth;
    const hexload_real_t sigma_m_s = past->sensors->velocity_sigma_m_s;
    hexload_real_t sum = HEXLOAD_REAL(0.0);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        const hexload_real_t left_m_s = sample->sample.velocity_m_s[leg] - sample->smooth_velocity_m_s[leg];
        sum += left_m_s * left_m_s;
    }
    const hexload_real_t beyond = sum / (hexload_real_t)HEXLOAD_LEGS - sigma_m_s * sigma_m_s;
    self->ticks += (hexload_real_t)self->ticks * config->tick_s < RESIDUAL_S ? 1 : 0;
    self->residual_m2_s2 += (beyond - self->residual_m2_s2) / (hexload_real_t)self->ticks;
}

/// Near speed zero the smooth speed's error turns the sign: its noise, and what is too quick for the
/// smoother, such as the jerk when friction turns; and friction has another shape there, which is an error of
/// ln v0, as d s / d ln v0 = -v s'. All last for about the lag; noise of this strength adds up to the same
/// variance.
static void add_sign_noise(const hexload_actuator_effects_t* self, hexload_momentum_filter_t* load,
                           const hexload_config_t* config, const hexload_delayed_tick_t* past, rub_t* now,
                           hexload_real_t dt_s) {
    hexload_real_t variance[HEXLOAD_LEGS];
    const hexload_real_t error =
        speed_variance(past->smoother, past->sensors) + hexload_max(self->residual_m2_s2, HEXLOAD_REAL(0.0));
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        const hexload_real_t coulomb_n = self->effect[COULOMB + leg];
        const hexload_real_t square =
            coulomb_n * coulomb_n + effects_covariance(self, COULOMB + leg, COULOMB + leg);
        const hexload_real_t slope_s = dt_s * now->slope_s_m[leg];
        const hexload_real_t of_shape_m_s = config->actuator_effects.friction_shape * now->at.speed_m_s[leg];
        variance[leg] = (hexload_real_t)past->smoother->lag_ticks *
                        hexload_fma(of_shape_m_s, of_shape_m_s, error) * square * slope_s * slope_s;
    }
    hexload_momentum_add_noise(now->at.push, variance, load->momentum_cov);
}

/// As the momentum filter does for its parameters.
static void inflate_covariance(hexload_actuator_effects_t* self) {
    for (int i = 0; i < DIM; i++) {
        self->covariance[EFFECT_ROW(i) + KNOWN + i] *= HEXLOAD_COVARIANCE_INFLATION;
    }
}

/// L^-1 H P of two rows of the effects, with the sign of the momentum filter's U.
static void project_rows(hexload_momentum_update_t* left, const hexload_real_t* row,
                         const hexload_real_t* next_row, hexload_real_t u[2][6]) {
    hexload_real_t both[6][2];
    hexload_momentum_rows(left->Y, row, next_row, 0, 6, u);
    HEXLOAD_UNROLL
    for (int a = 0; a < 6; a++) {
        both[a][0] = row[LOAD + a] - u[0][a];
        both[a][1] = next_row[LOAD + a] - u[1][a];
    }
    hexload_whiten6(left->L, &both[0][0], 2);
    hexload_read_columns6(&both[0][0], 2, 0, u);
}

/// P_ee, and the effects themselves, of two rows.
static inline void correct_own(hexload_actuator_effects_t* self, int i, hexload_real_t u[DIM][6],
                               const hexload_real_t e[6]) {
    hexload_real_t* row = &self->covariance[EFFECT_ROW(i) + KNOWN];
    hexload_real_t* next_row = &self->covariance[EFFECT_ROW(i + 1) + KNOWN];
    hexload_real_t correction[2] = {HEXLOAD_REAL(0.0), HEXLOAD_REAL(0.0)};
    for (int a = 0; a < 6; a++) {
        correction[0] += u[i][a] * e[a];
        correction[1] += u[i + 1][a] * e[a];
    }
    self->effect[i] += correction[0];
    self->effect[i + 1] += correction[1];
    for (int j = 0; j <= i; j++) {
        row[j] -= dot6(u[i], u[j]);
        next_row[j] -= dot6(u[i + 1], u[j]);
    }
    next_row[i + 1] -= dot6(u[i + 1], u[i + 1]);
}

/// Rows of the effects: what the momentum filter's update of theta and mu says of them. While they are held,
/// what they have in common with theta and mu changes alone, as theta's and mu's own gain makes it.
static void correct(hexload_actuator_effects_t* self, hexload_consider_t* consider,
                    const hexload_config_t* config, hexload_momentum_update_t* left) {
    const bool is_held = self->held_ticks > 0;
    hexload_real_t u[DIM][6];
    for (int i = 0; i < DIM; i += 2) {
        hexload_real_t* row = &self->covariance[EFFECT_ROW(i)];
        hexload_real_t* next_row = &self->covariance[EFFECT_ROW(i + 1)];
        project_rows(left, row, next_row, &u[i]);
        hexload_downdate6(row, next_row, &u[i], &left->U.load[0][0], LOAD, LOAD);
        hexload_downdate6(&row[LOAD], &next_row[LOAD], &u[i], &left->U.momentum[0][0], 6, 6);
        if (!is_held) {
            correct_own(self, i, u, left->innovation);
        }
    }
    const int corrected = is_held ? 0 : DIM;
    for (uint32_t n = 0; n < config->rig.direction_count; n += 2) {
        hexload_real_t of_open[2][6];
        hexload_consider_follow(consider, config, n, left, of_open);
        for (int i = 0; i < corrected; i++) {
            self->considered[n][i] += dot6(u[i], of_open[0]);
            self->considered[n + 1][i] += dot6(u[i], of_open[1]);
        }
    }
}

/// T's time update by the constants of the rig that are no states.
HEXLOAD_APART static void move_considered(const hexload_momentum_filter_t* load, hexload_consider_t* consider,
                                          const hexload_config_t* config,
                                          const hexload_delayed_tick_t* past) {
    const hexload_actuator_effects_config_t* effects = &config->actuator_effects;
    hexload_rig_direction_t open = *hexload_consider_turn(consider, config);
    if (effects->prior_bias_sigma_n > HEXLOAD_REAL(0.0)) {
        memset(open.force_offset_n, 0, sizeof open.force_offset_n);
    }
    if (effects->prior_coulomb_sigma_n > HEXLOAD_REAL(0.0)) {
        memset(open.coulomb_n, 0, sizeof open.coulomb_n);
    }
    if (effects->prior_viscous_sigma_n_s_m > HEXLOAD_REAL(0.0)) {
        memset(open.viscous_n_s_m, 0, sizeof open.viscous_n_s_m);
    }
    if (effects->prior_tilt_sigma_m_s2 > HEXLOAD_REAL(0.0)) {
        memset(open.gravity_m_s2, 0, sizeof open.gravity_m_s2);
    }
    hexload_consider_move(consider, load, config, past, &open);
}

/// P_me of a momentum that has just been set to Y theta.
static void seed_covariance(hexload_actuator_effects_t* self, const hexload_momentum_filter_t* load,
                            const hexload_motion_t* motion) {
    hexload_real_t Y[6][LOAD];
    hexload_momentum_regressor(motion, load->smooth_twist, Y);
    for (int i = 0; i < DIM; i += 2) {
        hexload_real_t* row = &self->covariance[EFFECT_ROW(i)];
        hexload_real_t* next_row = &self->covariance[EFFECT_ROW(i + 1)];
        hexload_real_t product[2][6];
        hexload_momentum_rows(Y, row, next_row, 0, 6, product);
        memcpy(&row[LOAD], product[0], sizeof product[0]);
        memcpy(&next_row[LOAD], product[1], sizeof product[1]);
    }
}

/// Whether the platform has been at rest for so long that there is nothing more to be learnt.
static bool has_rested(hexload_actuator_effects_t* self, const hexload_config_t* config, bool is_at_rest) {
    if (is_at_rest) {
        self->rest_ticks++;
    } else { // one tick of noise that is followed is seen by its neighbours
        self->rest_ticks -=
            self->rest_ticks < TRANSIENT_WINDOW_TICKS ? self->rest_ticks : TRANSIENT_WINDOW_TICKS;
    }
    if ((hexload_real_t)self->rest_ticks * config->tick_s > LONGEST_REST_S) {
        self->rest_ticks--; // so that it does not wrap
        return true;
    }
    return false;
}

/// With what the rig leaves open.
static hexload_real_t total_variance(const hexload_actuator_effects_t* self, int i) {
    hexload_real_t variance = effects_covariance(self, i, i);
    for (int n = 0; n < HEXLOAD_RIG_DIRECTIONS_MAX; n++) { // zeros beyond the configured ones
        variance = hexload_fma(self->considered[n][i], self->considered[n][i], variance);
    }
    return variance;
}

/// One effect in each tick: is it as far off as commissioning has left it open?
static void compare_with_prior(hexload_actuator_effects_t* self, const hexload_config_t* config) {
    const int i = (int)self->compared;
    const hexload_real_t prior = prior_variance(config, i);
    if (prior > HEXLOAD_REAL(0.0)) {
        self->counted++;
        self->squares += self->effect[i] * self->effect[i] / (prior + total_variance(self, i));
    }
    self->compared++;
    if (self->compared == (uint32_t)DIM) {
        const hexload_real_t one = HEXLOAD_REAL(1.0); // more, that is as it should be
        self->dispersion = hexload_max(one, (self->squares + one) / ((hexload_real_t)self->counted + one));
        self->compared = 0;
        self->counted = 0;
        self->squares = HEXLOAD_REAL(0.0);
    }
}

bool hexload_actuator_effects_step(hexload_actuator_effects_t* self, hexload_momentum_filter_t* load,
                                   hexload_consider_t* consider, const hexload_config_t* config,
                                   const hexload_delayed_tick_t* past, hexload_momentum_update_t* update) {
    const hexload_real_t dt_s = config->tick_s * (hexload_real_t)past->smooth.gap_ticks;
    rub_t now = {.is_at_rest = false};
    hexload_rub_t impulse;
    tilted_pull_t tilted;
    find_rub(load, config, past, &now);
    if (has_rested(self, config, now.is_at_rest)) {
        load->nis = CHI_SQUARE_6_MEAN; // no innovation: the last one is not to count again and again
        return false;
    }
    watch_residual(self, config, past);
    if (config->rig.direction_count > 0) {
        move_considered(load, consider, config, past);
        compare_with_prior(self, config);
    }
    if (past->smooth.gap_ticks == 0) {
        hexload_momentum_filter_step(load, config, past, update);
        seed_covariance(self, load, &past->motion);
        hexload_consider_seed(consider, config, load, &past->motion);
    } else {
        make_impulse(self, &now.at, dt_s, &impulse);
        move_errors(self, consider, config, &impulse);
        move_momentum(self, load, config, &impulse);
        move_cross(self, load, &impulse);
        move_own(self, load, &impulse);
        find_tilted_pull(self, &past->motion, dt_s, &tilted);
        if (config->actuator_effects.prior_tilt_sigma_m_s2 > HEXLOAD_REAL(0.0)) {
            tilt_load(load, &tilted);
        }
        pull_covariance(self, load, &past->motion, &tilted, dt_s * config->gravity_m_s2);
        add_sign_noise(self, load, config, past, &now, dt_s);
        inflate_covariance(self);
        hexload_momentum_filter_step(load, config, past, update);
        correct(self, consider, config, update);
    }
    self->held_ticks -= self->held_ticks < past->smooth.gap_ticks ? self->held_ticks : past->smooth.gap_ticks;
    self->last = now.at;
    return true;
}

void hexload_actuator_effects_hold(hexload_actuator_effects_t* self, const hexload_config_t* config) {
    const uint32_t lags = 1U + UNCERTAIN_LAGS;
    self->held_ticks = (lags * config->momentum.lag_ticks) + config->sensors.half_window_ticks;
}

void hexload_actuator_effects_forget(hexload_actuator_effects_t* self) {
    self->rest_ticks = 0; // the next load is weighed at rest too
    hexload_gain_errors_forget(&self->gains);
    for (int i = 0; i < DIM; i++) {
        memset(&self->covariance[EFFECT_ROW(i)], 0, KNOWN * sizeof self->covariance[0]);
    }
}

/// Of a leg's friction at its last speed, and the square of its sigma, beside which rounding counts: known
/// together at one speed, both parts may be open. @return N^2, negative when it drives.
static hexload_real_t friction_n2(const hexload_actuator_effects_t* self, int leg,
                                  hexload_real_t* variance_n2) {
    const hexload_real_t s = self->last.sign[leg];
    const hexload_real_t v = self->last.speed_m_s[leg];
    const hexload_real_t force_n = (s * self->effect[COULOMB + leg]) + (v * self->effect[VISCOUS + leg]);
    const hexload_real_t apart_n2 = (s * s * effects_covariance(self, COULOMB + leg, COULOMB + leg)) +
                                    (v * v * effects_covariance(self, VISCOUS + leg, VISCOUS + leg));
    const hexload_real_t together_n2 = s * v * effects_covariance(self, VISCOUS + leg, COULOMB + leg);
    *variance_n2 = ((HEXLOAD_REAL(1.0) + ROUNDING) * apart_n2) + (HEXLOAD_REAL(2.0) * together_n2);
    return (force_n * v) < HEXLOAD_REAL(0.0) ? -(force_n * force_n) : (force_n * force_n);
}

bool hexload_actuator_effects_drive(const hexload_actuator_effects_t* self, const hexload_config_t* config) {
    bool is_driven = false;
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        hexload_real_t variance_n2;
        const hexload_real_t square_n2 = friction_n2(self, leg, &variance_n2);
        is_driven = is_driven || (square_n2 < (-DRIVEN_SIGMAS * DRIVEN_SIGMAS * variance_n2));
    }
    return is_driven && (config->rig.direction_count == 0);
}

bool hexload_actuator_effects_is_finite(const hexload_actuator_effects_t* self) {
    hexload_real_t sum = HEXLOAD_REAL(0.0); // a variance below zero becomes NaN here
    for (int i = 0; i < DIM; i++) {
        sum += self->effect[i] + hexload_sqrt(effects_covariance(self, i, i));
    }
    return isfinite(sum);
}

void hexload_actuator_effects_read(const hexload_actuator_effects_t* self, hexload_real_t value[DIM],
                                   hexload_real_t sigma[DIM]) {
    for (int i = 0; i < DIM; i++) {
        value[i] = self->effect[i];
        sigma[i] = hexload_sqrt(total_variance(self, i));
    }
}

/// Takes off what the base's tilt does to the sample. @param[out] variance_n2 of what is left of it.
static void level(const hexload_actuator_effects_t* self, const hexload_momentum_filter_t* load,
                  const hexload_config_t* config, const hexload_motion_t* motion,
                  hexload_leg_sample_t* sample, hexload_real_t variance_n2[HEXLOAD_LEGS]) {
    static const hexload_real_t origin_m[3] = {0};
    const hexload_real_t xx = effects_covariance(self, TILT, TILT);
    const hexload_real_t xy = effects_covariance(self, TILT + 1, TILT);
    const hexload_real_t yy = effects_covariance(self, TILT + 1, TILT + 1);
    const hexload_real_t lost = lost_m_s2(self, config);
    hexload_real_t columns[HEXLOAD_LEGS]
                          [6]; // of J^-1: a leg's force is its column times the wrench about O_A
    lever_t lever;
    find_lever(load, motion, origin_m, lever);
    hexload_leg_blocks_invert(motion->jacobian, columns);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        const hexload_real_t* c = columns[leg];
        const hexload_real_t x = lever[0] * c[0] + lever[3] * c[4] - lever[2] * c[5];
        const hexload_real_t y = lever[0] * c[1] - lever[3] * c[3] + lever[1] * c[5];
        const hexload_real_t z = lever[0] * c[2] + lever[2] * c[3] - lever[1] * c[4];
        sample->force_n[leg] += x * self->effect[TILT] + y * self->effect[TILT + 1] + z * lost;
        variance_n2[leg] = x * x * xx + HEXLOAD_REAL(2.0) * x * y * xy + y * y * yy;
    }
}

void hexload_actuator_effects_clean(const hexload_actuator_effects_t* self,
                                    const hexload_momentum_filter_t* load, const hexload_config_t* config,
                                    const hexload_motion_t* motion, hexload_leg_sample_t* sample,
                                    hexload_sensors_t* sensors) {
    const hexload_real_t memory_ticks = HEXLOAD_LOAD_MONITOR_MEMORY_S / config->tick_s;
    hexload_real_t of_tilt_n2[HEXLOAD_LEGS] = {0};
    hexload_real_t most = HEXLOAD_REAL(0.0);
    if (config->actuator_effects.prior_tilt_sigma_m_s2 > HEXLOAD_REAL(0.0)) {
        level(self, load, config, motion, sample, of_tilt_n2);
    }
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        const hexload_real_t speed_m_s = sample->velocity_m_s[leg];
        const friction_sign_t sign = friction_sign_of(speed_m_s, config->actuator_effects.friction_speed_m_s);
        const hexload_real_t weight[HEXLOAD_EFFECT_KINDS] = {HEXLOAD_REAL(1.0), sign.value, speed_m_s};
        const hexload_real_t slope_n_s_m =
            self->effect[COULOMB + leg] * sign.slope_s_m + self->effect[VISCOUS + leg];
        const hexload_real_t turning_n = slope_n_s_m * sensors->velocity_sigma_m_s;
        const hexload_real_t shape_n = config->actuator_effects.friction_shape * self->effect[COULOMB + leg] *
                                       sign.slope_s_m * speed_m_s;
        hexload_real_t lasting = hexload_fma(shape_n, shape_n, of_tilt_n2[leg]);
        hexload_real_t share[HEXLOAD_EFFECT_KINDS][HEXLOAD_EFFECT_KINDS];
        for (int i = 0; i < HEXLOAD_EFFECT_KINDS; i++) {
            const hexload_real_t* row = &self->covariance[EFFECT_ROW(i * HEXLOAD_LEGS + leg) + KNOWN];
            sample->force_n[leg] -= weight[i] * self->effect[i * HEXLOAD_LEGS + leg];
            for (int j = 0; j <= i; j++) {
                share[i][j] = weight[i] * weight[j] * row[j * HEXLOAD_LEGS + leg];
                share[j][i] = share[i][j];
            }
        }
        for (int i = 0; i < HEXLOAD_EFFECT_KINDS; i++) {
            lasting += share[i][0];
            lasting += share[i][1];
            lasting += share[i][2];
        }
        most = hexload_max(most, turning_n * turning_n + memory_ticks * lasting);
    }
    sensors->force_sigma_n = hexload_sqrt(sensors->force_sigma_n * sensors->force_sigma_n + most);
}
