#include "actuator_effects/actuator_effects.h"

#include "algebra/chi_square.h"
#include "algebra/linalg.h"
#include "actuator_effects/actuator_effects_model.h"
#include "momentum/momentum_model.h"

#include <string.h>

enum {
    LOAD = HEXLOAD_LOAD_DIM,
    KNOWN = HEXLOAD_MOMENTUM_STATES, ///< states of the momentum filter: theta, mu
    DIM = HEXLOAD_EFFECTS_DIM,
    COULOMB = HEXLOAD_EFFECT_COULOMB * HEXLOAD_LEGS,
    VISCOUS = HEXLOAD_EFFECT_VISCOUS * HEXLOAD_LEGS,
};

/// How far back the smoother's residual counts.
#define RESIDUAL_S HEXLOAD_REAL(2.0)

/// A platform at rest has told all it can by then.
#define LONGEST_REST_S HEXLOAD_REAL(2.0)

_Static_assert(DIM == (int)HEXLOAD_EFFECT_KINDS * HEXLOAD_LEGS, "each leg has each effect");

void hexload_actuator_effects_init(hexload_actuator_effects_t* self, const hexload_config_t* config) {
    const hexload_actuator_effects_config_t* effects = &config->actuator_effects;
    const hexload_real_t sigma[HEXLOAD_EFFECT_KINDS] = {
        effects->prior_bias_sigma_n, effects->prior_coulomb_sigma_n, effects->prior_viscous_sigma_n_s_m};
    *self = (hexload_actuator_effects_t){.effect = {HEXLOAD_REAL(0.0)}};
    for (int i = 0; i < DIM; i++) {
        self->covariance[EFFECT_ROW(i) + KNOWN + i] = sigma[i / HEXLOAD_LEGS] * sigma[i / HEXLOAD_LEGS];
    }
}

/// Speeds of so many ticks are in a smoother's speed that follows ringing.
#define TRANSIENT_WINDOW_TICKS (2u * HEXLOAD_TRANSIENT_TICKS + 1u)

/// How the legs push and what their friction goes with, at one sample or on the mean over a period.
typedef struct rub {
    hexload_real_t push[HEXLOAD_LEGS][6]; ///< Jw, leg by leg
    hexload_real_t sign[HEXLOAD_LEGS];    ///< s(v)
    hexload_real_t speed_m_s[HEXLOAD_LEGS];
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

static void find_rub(const hexload_config_t* config, const hexload_delayed_tick_t* past, rub_t* rub) {
    hexload_real_t square = HEXLOAD_REAL(0.0);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        const hexload_real_t speed_m_s = past->smooth.smooth_velocity_m_s[leg];
        square += speed_m_s * speed_m_s;
        const friction_sign_t sign = friction_sign_of(speed_m_s, config->actuator_effects.friction_speed_m_s);
        hexload_momentum_of_push(&past->motion, leg, rub->push[leg]);
        rub->sign[leg] = sign.value;
        rub->slope_s_m[leg] = sign.slope_s_m;
        rub->speed_m_s[leg] = speed_m_s;
    }
    rub->is_at_rest = !(square > CHI_SQUARE_6_95 * speed_variance(past->smoother, past->sensors));
}

static void remember(hexload_actuator_effects_t* self, rub_t* rub) {
    memcpy(self->last_push, rub->push, sizeof self->last_push);
    memcpy(self->last_sign, rub->sign, sizeof self->last_sign);
    memcpy(self->last_speed_m_s, rub->speed_m_s, sizeof self->last_speed_m_s);
}

/// The impulse that the effects take: Jw [E, S, V] times minus the period, each on its mean over the period.
/// The product of the means is off the mean of the products by a quarter of both changes' product.
static void make_impulse(const hexload_actuator_effects_t* self, const rub_t* now, hexload_real_t dt_s,
                         rub_t* impulse) {
    const hexload_real_t half = HEXLOAD_REAL(0.5);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        for (int k = 0; k < 6; k++) {
            impulse->push[leg][k] = -half * dt_s * (now->push[leg][k] + self->last_push[leg][k]);
        }
        impulse->sign[leg] = half * (now->sign[leg] + self->last_sign[leg]);
        impulse->speed_m_s[leg] = half * (now->speed_m_s[leg] + self->last_speed_m_s[leg]);
    }
}

/// [E, S, V] times eighteen numbers: what a leg's three effects come to.
static inline hexload_real_t of_leg(const rub_t* impulse, int leg, const hexload_real_t x[DIM]) {
    return x[leg] + impulse->sign[leg] * x[COULOMB + leg] + impulse->speed_m_s[leg] * x[VISCOUS + leg];
}

/// out += Jw x.
static inline void add_push(const rub_t* impulse, const hexload_real_t x[HEXLOAD_LEGS],
                            hexload_real_t out[6]) {
    HEXLOAD_UNROLL
    for (int k = 0; k < 6; k++) {
        HEXLOAD_UNROLL
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            out[k] = hexload_fma(impulse->push[leg][k], x[leg], out[k]);
        }
    }
}

/// out += A x.
static inline void add_impulse(const rub_t* impulse, const hexload_real_t x[DIM], hexload_real_t out[6]) {
    hexload_real_t force[HEXLOAD_LEGS];
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        force[leg] = of_leg(impulse, leg, x);
    }
    add_push(impulse, force, out);
}

static void read_column(const hexload_actuator_effects_t* self, int j, hexload_real_t column[DIM]) {
    for (int i = 0; i < DIM; i++) {
        column[i] = effects_covariance(self, i, j);
    }
}

/// mu+ = mu + A effect with A = Jw [E, S, V]. With C the mean of P_me before and after, P_mm grows by
/// A C^T + C A^T.
static void take_impulse(hexload_actuator_effects_t* self, hexload_momentum_filter_t* load,
                         const rub_t* impulse) {
    hexload_real_t column[DIM];
    hexload_real_t mean[6][DIM];
    add_impulse(impulse, self->effect, load->momentum);
    for (int j = 0; j < LOAD; j++) {
        hexload_real_t change[6] = {0};
        for (int i = 0; i < DIM; i++) {
            column[i] = self->covariance[EFFECT_ROW(i) + j];
        }
        add_impulse(impulse, column, change);
        for (int k = 0; k < 6; k++) {
            load->cross_cov[k][j] += change[k];
        }
    }
    for (int i = 0; i < DIM; i++) {
        hexload_real_t* P_me = &self->covariance[EFFECT_ROW(i) + LOAD];
        hexload_real_t change[6] = {0};
        read_column(self, i, column);
        add_impulse(impulse, column, change);
        for (int k = 0; k < 6; k++) {
            mean[k][i] = P_me[k] + HEXLOAD_REAL(0.5) * change[k];
            P_me[k] += change[k];
        }
    }
    for (int b = 0; b < 6; b++) {
        hexload_real_t product[6] = {0}; // column b of A C^T
        add_impulse(impulse, mean[b], product);
        for (int a = 0; a < 6; a++) {
            load->momentum_cov[a >= b ? a : b][a >= b ? b : a] +=
                a == b ? HEXLOAD_REAL(2.0) * product[a] : product[a];
        }
    }
}

/// P_me for mu+ = mu + Gbar theta.
static void pull_covariance(hexload_actuator_effects_t* self, const hexload_momentum_filter_t* load,
                            const hexload_config_t* config, const hexload_delayed_tick_t* past,
                            hexload_real_t dt_s) {
    hexload_real_t G[PULLED][LIFTED];
    hexload_momentum_input_t input;
    hexload_momentum_read_input(&past->motion, past->smooth.sample.force_n, &input);
    hexload_momentum_pull(&load->last_input, &input, dt_s * config->gravity_m_s2, G);
    for (int i = 0; i < DIM; i++) {
        hexload_real_t* row = &self->covariance[EFFECT_ROW(i)];
        for (int a = 0; a < PULLED; a++) {
            row[LOAD + FIRST_PULLED + a] +=
                hexload_fma(G[a][3], row[3],
                            hexload_fma(G[a][2], row[2], hexload_fma(G[a][1], row[1], G[a][0] * row[0])));
        }
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
/// smoother, such as the jerk when friction turns. Both last for about the lag; noise of this strength adds
/// up to the same variance.
static void add_sign_noise(const hexload_actuator_effects_t* self, hexload_momentum_filter_t* load,
                           const hexload_delayed_tick_t* past, rub_t* now, hexload_real_t dt_s) {
    hexload_real_t variance[HEXLOAD_LEGS];
    const hexload_real_t error =
        speed_variance(past->smoother, past->sensors) + hexload_max(self->residual_m2_s2, HEXLOAD_REAL(0.0));
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        const hexload_real_t coulomb_n = self->effect[COULOMB + leg];
        const hexload_real_t square =
            coulomb_n * coulomb_n + effects_covariance(self, COULOMB + leg, COULOMB + leg);
        const hexload_real_t slope_s = dt_s * now->slope_s_m[leg];
        variance[leg] = (hexload_real_t)past->smoother->lag_ticks * error * square * slope_s * slope_s;
    }
    hexload_momentum_add_noise(now->push, variance, load->momentum_cov);
}

/// As the momentum filter does for its parameters.
static void inflate_covariance(hexload_actuator_effects_t* self) {
    for (int i = 0; i < DIM; i++) {
        self->covariance[EFFECT_ROW(i) + KNOWN + i] *= HEXLOAD_COVARIANCE_INFLATION;
    }
}

/// Rows of the effects: what the momentum filter's update of theta and mu tells about them.
static void correct(hexload_actuator_effects_t* self, hexload_momentum_update_t* left) {
    hexload_real_t(*L)[6] = left->L;
    const hexload_real_t* e = left->innovation;
    hexload_real_t u[DIM][6];
    for (int i = 0; i < DIM; i++) {
        hexload_real_t* row = &self->covariance[EFFECT_ROW(i)];
        hexload_real_t correction = HEXLOAD_REAL(0.0);
        for (int a = 0; a < 6; a++) {
            hexload_real_t sum = row[LOAD + a] - momentum_times_row(left->Y[a], row, a < 3);
            for (int k = 0; k < a; k++) {
                sum = hexload_fma(-L[a][k], u[i][k], sum);
            }
            u[i][a] = sum * L[a][a];
            correction += u[i][a] * e[a];
        }
        self->effect[i] += correction;
        downdate6(row, u[i], &left->U.load[0][0], LOAD, LOAD);
        downdate6(&row[LOAD], u[i], &left->U.momentum[0][0], 6, 6);
        for (int j = 0; j <= i; j++) {
            row[KNOWN + j] -= dot6(u[i], u[j]);
        }
    }
}

/// P_me of a momentum that has just been set to Y theta.
static void seed_covariance(hexload_actuator_effects_t* self, const hexload_momentum_filter_t* load,
                            const hexload_motion_t* motion) {
    hexload_real_t Y[6][LOAD];
    hexload_momentum_regressor(motion, load->smooth_twist, Y);
    for (int i = 0; i < DIM; i++) {
        hexload_real_t* row = &self->covariance[EFFECT_ROW(i)];
        for (int a = 0; a < 6; a++) {
            row[LOAD + a] = momentum_times_row(Y[a], row, a < 3);
        }
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

bool hexload_actuator_effects_step(hexload_actuator_effects_t* self, hexload_momentum_filter_t* load,
                                   const hexload_config_t* config, const hexload_delayed_tick_t* past,
                                   hexload_momentum_update_t* update) {
    const hexload_real_t dt_s = config->tick_s * (hexload_real_t)past->smooth.gap_ticks;
    rub_t now = {.is_at_rest = false};
    rub_t impulse;
    find_rub(config, past, &now);
    if (has_rested(self, config, now.is_at_rest)) {
        return false;
    }
    watch_residual(self, config, past);
    if (past->smooth.gap_ticks == 0) {
        hexload_momentum_filter_step(load, config, past, update);
        seed_covariance(self, load, &past->motion);
    } else {
        make_impulse(self, &now, dt_s, &impulse);
        take_impulse(self, load, &impulse);
        pull_covariance(self, load, config, past, dt_s);
        add_sign_noise(self, load, past, &now, dt_s);
        inflate_covariance(self);
        hexload_momentum_filter_step(load, config, past, update);
        correct(self, update);
    }
    remember(self, &now);
    return true;
}

void hexload_actuator_effects_forget(hexload_actuator_effects_t* self) {
    for (int i = 0; i < DIM; i++) {
        memset(&self->covariance[EFFECT_ROW(i)], 0, KNOWN * sizeof self->covariance[0]);
    }
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
        sigma[i] = hexload_sqrt(effects_covariance(self, i, i));
    }
}

void hexload_actuator_effects_clean(const hexload_actuator_effects_t* self, const hexload_config_t* config,
                                    hexload_real_t memory_s, hexload_leg_sample_t* sample,
                                    hexload_sensors_t* sensors) {
    const hexload_real_t memory_ticks = memory_s / config->tick_s;
    hexload_real_t most = HEXLOAD_REAL(0.0);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        const hexload_real_t speed_m_s = sample->velocity_m_s[leg];
        const friction_sign_t sign = friction_sign_of(speed_m_s, config->actuator_effects.friction_speed_m_s);
        const hexload_real_t weight[HEXLOAD_EFFECT_KINDS] = {HEXLOAD_REAL(1.0), sign.value, speed_m_s};
        const hexload_real_t slope_n_s_m =
            self->effect[COULOMB + leg] * sign.slope_s_m + self->effect[VISCOUS + leg];
        const hexload_real_t turning_n = slope_n_s_m * sensors->velocity_sigma_m_s;
        hexload_real_t lasting = HEXLOAD_REAL(0.0);
        for (int i = 0; i < HEXLOAD_EFFECT_KINDS; i++) {
            sample->force_n[leg] -= weight[i] * self->effect[i * HEXLOAD_LEGS + leg];
            for (int j = 0; j < HEXLOAD_EFFECT_KINDS; j++) {
                lasting += weight[i] * weight[j] *
                           effects_covariance(self, i * HEXLOAD_LEGS + leg, j * HEXLOAD_LEGS + leg);
            }
        }
        most = hexload_max(most, turning_n * turning_n + memory_ticks * lasting);
    }
    sensors->force_sigma_n = hexload_sqrt(sensors->force_sigma_n * sensors->force_sigma_n + most);
}
