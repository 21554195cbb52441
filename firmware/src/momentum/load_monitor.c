#include "momentum/load_monitor.h"

#include "algebra/chi_square.h"
#include "algebra/linalg.h"
#include "front_end/lost_channels.h"
#include "momentum/leg_or_weight.h"
#include "momentum/momentum_model.h"
#include "rig/rig.h"

#include <string.h>

/// Twice the ideal: the leaky mean of 100 NIS has a sigma of 0.35, so noise alone does not reach it.
#define ALARM_NIS HEXLOAD_REAL(12.0)

/// Noise alone does not raise the mean so far, nine of its sigmas above the ideal.
#define CALM_NIS HEXLOAD_REAL(9.0)

/// From there to three times the ideal a jump takes that long at most; what takes longer grows with the
/// motion.
#define LONGEST_RISE_S HEXLOAD_REAL(0.03)

/// Of the weight, what errors of the machine may be of a load that is too new.
#define UNPROVEN_SHARE HEXLOAD_REAL(0.02)

/// Of the square of a missing wrench, what may be no weight where nothing accelerates.
#define OTHER_SHARE HEXLOAD_REAL(0.2)

/// Log of the odds of a weight against one leg's sensor, from which on it certainly is none, and what that
/// sensor explains at least of what is missing if it is it.
#define LEAST_ODDS HEXLOAD_REAL(6.0)
#define LEAST_EXPLAINED HEXLOAD_REAL(0.5)

/// What such a sensor leaves of what is missing at most, beside noise, 99.9 % of chi-square with 5 degrees of
/// freedom; and the weight of a load that turns, whose inertia is no part of it.
#define LEFT_BY_LEG HEXLOAD_REAL(0.01)
#define LEFT_BY_NOISE HEXLOAD_REAL(20.5)
#define LEFT_BY_WEIGHT HEXLOAD_REAL(0.1)

/// Of a load that is too new for the machine to have shown that it is its model: what its errors do not
/// reach.
#define UNPROVEN_NIS HEXLOAD_REAL(18.0)

/// One tick counts this much at most, and beyond it leaves mu as it is: a spike raises the mean by 2, once.
#define LARGEST_NIS HEXLOAD_REAL(120.0)

/// Rate of the leaky mean of whitened innovations, in which a wrong wrench adds up and noise does not: a
/// ramp of innovations is found nearly as soon as by its matched filter. Scaled, its square is chi-square
/// with 6 degrees of freedom, of which 5e-11 is beyond the alarm: a 5 ms mean is a new one 7e7 times in
/// 100 h. At ticks beyond 1 ms it is over five of them: of fewer no mean is nine times a square.
#define DRIFT_1_S HEXLOAD_REAL(200.0)
#define DRIFT_SHARE HEXLOAD_REAL(0.2)
#define ALARM_DRIFT HEXLOAD_REAL(60.0)

/// Of the innovations' squares of late, what their mean's must have: of noise, however large, it is once, of
/// a wrench that lasts, 9 times. By chance, of 6 normal numbers, 0.002 are beyond.
#define LASTING_DRIFT HEXLOAD_REAL(3.5)

/// Speeds from displacements err alike over a window. Of their variance that mean keeps this share for each
/// of half_window_ticks + 1, or more, times its own share of a tick (0.30 of 6 ticks at 1 ms); a mean NIS is
/// that of fewer, and three times the ideal is then as rare as twice.
#define LASTING_SHARE HEXLOAD_REAL(0.215)
#define LASTING_NIS HEXLOAD_REAL(18.0)

/// Time constant of the twist that an acceleration is taken from, and by which that is late: at 1 ms the
/// noise of it is sqrt(10) / 3 sigma / 5 ms.
#define LATE_S HEXLOAD_REAL(0.005)

enum { DIM = HEXLOAD_LOAD_DIM };

void hexload_load_monitor_init(hexload_load_monitor_t* self) {
    *self = (hexload_load_monitor_t){
        .nis = CHI_SQUARE_6_MEAN, .nis_mean = CHI_SQUARE_6_MEAN, .drift_nis = CHI_SQUARE_6_MEAN};
}

void hexload_load_monitor_restart(hexload_load_monitor_t* self) {
    const hexload_wrench_monitor_t wrench = self->wrench;
    const hexload_rig_slide_t slide = self->slide;
    hexload_load_monitor_init(self);
    self->wrench = wrench;
    self->slide = slide;
    hexload_wrench_monitor_restart(&self->wrench);
}

/// The covariance of mu of the measured twist.
HEXLOAD_RARE static void seed(hexload_load_monitor_t* self, const hexload_real_t body[DIM],
                              const hexload_present_tick_t* now) {
    const hexload_motion_t* motion = now->motion;
    const hexload_real_t sigma_m_s = now->sensors.velocity_sigma_m_s;
    hexload_real_t variance[HEXLOAD_LEGS];
    hexload_real_t columns[HEXLOAD_LEGS][6];
    memset(self->covariance, 0, sizeof self->covariance);
    hexload_momentum_of_leg_speeds(body, motion, columns);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        variance[leg] = sigma_m_s * sigma_m_s;
    }
    hexload_momentum_add_noise(columns, variance, self->covariance);
}

/// A force that jumps between two ticks is not a trapezoid: its second difference, beyond three sigma of
/// noise, counts as an error of a quarter of the jump.
static hexload_real_t force_variance(const hexload_load_monitor_t* self, hexload_real_t sigma_n, int leg,
                                     const hexload_real_t force_n[HEXLOAD_LEGS]) {
    const hexload_real_t variance = sigma_n * sigma_n;
    if (self->ticks < 2) {
        return variance;
    }
    const hexload_real_t jump_n =
        force_n[leg] - HEXLOAD_REAL(2.0) * self->last_force_n[0][leg] + self->last_force_n[1][leg];
    const hexload_real_t beyond = jump_n * jump_n - HEXLOAD_REAL(54.0) * variance; // 9 (1 + 4 + 1)
    return variance + hexload_max(HEXLOAD_REAL(0.0), beyond) / HEXLOAD_REAL(16.0);
}

/// Forces of the present, what the rig's own parameters make of them, and the momentum that goes with the
/// filter's parameters.
typedef struct push {
    hexload_momentum_input_t input;
    hexload_real_t force_n[HEXLOAD_LEGS];     ///< of the legs on the platform
    hexload_real_t variance_n2[HEXLOAD_LEGS]; ///< of what is not known of them
    hexload_real_t momentum[6];               ///< mu of the measured twist
    hexload_real_t momentum_of_change[6];     ///< what of it the parameters' change since the last tick is
    hexload_real_t impulse[6];                ///< of forces and weight since the last tick
    hexload_real_t variance_scale;            ///< by which the filter's variances are too small
} push_t;

/// By the legs' speeds of this tick and the acceleration of the one before.
static void find_push(hexload_load_monitor_t* self, const hexload_config_t* config,
                      const hexload_present_tick_t* now, push_t* push) {
    memcpy(push->force_n, now->sample->force_n, sizeof push->force_n);
    hexload_rig_compensate(&self->slide, config, now->sample->velocity_m_s, now->gap_ticks, push->force_n,
                           push->variance_n2);
    hexload_lost_channels_doubt(&now->lost, push->force_n, push->variance_n2);
    hexload_momentum_read_input(now->motion, push->force_n, &push->input);
    if (hexload_rig_has_leg_mass(config)) {
        hexload_real_t acceleration[6];
        hexload_real_t wrench[6];
        memcpy(acceleration, self->acceleration, sizeof acceleration);
        acceleration[2] -= config->gravity_m_s2;
        hexload_rig_leg_wrench(config, now->sample, now->motion, now->motion->twist, acceleration, wrench);
        hexload_momentum_take_off(now->motion, wrench, &push->input);
    }
}

static void find_impulse(const hexload_load_monitor_t* self, const hexload_config_t* config,
                         const hexload_real_t body[DIM], push_t* push) {
    const hexload_real_t dt_s = config->tick_s;
    hexload_real_t G[PULLED][LIFTED];
    memset(push->impulse, 0, sizeof push->impulse);
    hexload_momentum_pull(&self->last_input, &push->input, dt_s * config->gravity_m_s2, G);
    hexload_momentum_move(push->impulse, &self->last_input, &push->input, dt_s, G, body);
}

static void predict(hexload_load_monitor_t* self, const hexload_config_t* config,
                    const hexload_present_tick_t* now, const push_t* push) {
    const hexload_real_t dt_s = config->tick_s;
    hexload_real_t variance[HEXLOAD_LEGS];
    hexload_real_t columns[HEXLOAD_LEGS][6];
    for (int k = 0; k < 6; k++) {
        self->momentum[k] += push->impulse[k];
    }
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        hexload_momentum_of_push(now->motion, leg, columns[leg]);
        variance[leg] =
            dt_s * dt_s *
            (force_variance(self, now->sensors.force_sigma_n, leg, push->force_n) + push->variance_n2[leg]);
    }
    hexload_momentum_add_noise(columns, variance, self->covariance);
}

/// The acceleration, less gravity's, for the next tick: a speed that is wrong once shall not excuse itself.
/// From the twist, not from the forces, which of another load give another one.
static void follow_acceleration(hexload_load_monitor_t* self, const hexload_config_t* config,
                                const hexload_real_t twist[6]) {
    const hexload_real_t rate_1_s = HEXLOAD_REAL(1.0) / LATE_S;
    for (int k = 0; k < 6; k++) {
        self->acceleration[k] = rate_1_s * (twist[k] - self->late_twist[k]);
        self->late_twist[k] += config->tick_s * self->acceleration[k];
    }
    self->acceleration[2] += config->gravity_m_s2;
}

/// What the parameters' errors do to mu at this acceleration. They last, so over the memory they add up;
/// noise of this strength adds up to the same variance. The acceleration is late: a component of it that
/// passes zero has been, or already is, other than zero within that time, so its square is the mean over it.
static void add_unknown(hexload_load_monitor_t* self, const hexload_momentum_filter_t* filter,
                        const hexload_motion_t* motion, hexload_real_t dt_s) {
    hexload_real_t Y[6][DIM];
    hexload_real_t spread[6][6];
    hexload_momentum_regressor(motion, self->acceleration, Y);
    hexload_momentum_spread(filter, Y, spread);
    for (int a = 0; a < 6; a++) {
        for (int b = 0; b <= a; b++) {
            const hexload_real_t recent = self->unknown[a][b];
            self->unknown[a][b] = hexload_fma(dt_s / LATE_S, spread[a][b] - recent, recent);
            self->covariance[a][b] = hexload_fma(HEXLOAD_LOAD_MONITOR_MEMORY_S * dt_s, self->unknown[a][b],
                                                 self->covariance[a][b]);
        }
    }
}

/// @param scale of an innovation that is larger than what counts.
static void follow_drift(hexload_load_monitor_t* self, const hexload_real_t innovation[6], hexload_real_t nis,
                         hexload_real_t scale, hexload_real_t share) {
    for (int i = 0; i < 6; i++) {
        self->drift[i] += share * ((scale * innovation[i]) - self->drift[i]);
    }
    self->drift_nis += share * (nis - self->drift_nis);
}

/// The momentum of the measured twist. Returns the normalised innovation squared, bounded.
static hexload_real_t correct(hexload_load_monitor_t* self, const hexload_config_t* config,
                              const hexload_real_t body[DIM], const hexload_present_tick_t* now,
                              const hexload_real_t measured[6], hexload_real_t share) {
    const hexload_motion_t* motion = now->motion;
    const hexload_real_t sigma_m_s = now->sensors.velocity_sigma_m_s;
    hexload_real_t columns[HEXLOAD_LEGS][6];
    hexload_real_t variance[HEXLOAD_LEGS];
    hexload_real_t S[6][6];
    hexload_real_t U[6][6]; // S^-1/2 P
    hexload_real_t innovation[6];
    hexload_momentum_of_leg_speeds(body, motion, columns);
    memcpy(S, self->covariance, sizeof S);
    for (int i = 0; i < 6; i++) {
        variance[i] = sigma_m_s * sigma_m_s;
        innovation[i] = measured[i] - self->momentum[i];
        for (int j = 0; j < 6; j++) {
            U[i][j] = self->covariance[j <= i ? i : j][j <= i ? j : i];
        }
    }
    hexload_momentum_add_noise(columns, variance, S);
    hexload_cholesky6(S);
    hexload_whiten6(S, innovation, 1);
    const hexload_real_t square = dot6(innovation, innovation);
    const hexload_real_t nis = hexload_min(square, LARGEST_NIS);
    const bool is_spike = (nis == LARGEST_NIS) && (self->ticks == hexload_settling_ticks(config));
    follow_drift(self, innovation, nis, is_spike ? hexload_sqrt(nis / square) : HEXLOAD_REAL(1.0), share);
    if (is_spike) {
        return nis;
    }
    hexload_whiten6(S, &U[0][0], 6);
    for (int i = 0; i < 6; i += 2) {
        hexload_real_t u[2][6];
        hexload_read_columns6(&U[0][0], 6, i, u);
        self->momentum[i] += dot6(u[0], innovation);
        self->momentum[i + 1] += dot6(u[1], innovation);
        downdate6_twice(self->covariance[i], u, &U[0][0], 6, i + 2); // lower triangle, and one beside it
    }
    return nis;
}

/// Of the variance of an innovation, what its leaky mean of `share` a tick keeps.
static hexload_real_t kept_by_mean(const hexload_config_t* config, hexload_real_t share) {
    const hexload_real_t ticks = (hexload_real_t)config->sensors.half_window_ticks;
    const hexload_real_t alike = LASTING_SHARE * (ticks + HEXLOAD_REAL(1.0));
    return (config->sensors.half_window_ticks > 0U) ? (hexload_max(HEXLOAD_REAL(1.0), alike) * share)
                                                    : (share / (HEXLOAD_REAL(2.0) - share));
}

/// Innovations of late. Another load's last; those of noise that has grown point anywhere. With speeds from
/// displacements, which err alike over a window, the two are not told apart.
typedef struct recent {
    bool is_large;        ///< twice the ideal, and more
    bool is_lasting;      ///< their mean is larger than chance makes that of noise
    hexload_real_t drift; ///< |mean|^2, scaled to chi-square
} recent_t;

static recent_t look_back(const hexload_load_monitor_t* self, const hexload_config_t* config,
                          hexload_real_t share) {
    const bool has_window = config->sensors.half_window_ticks > 0U;
    const hexload_real_t drift = dot6(self->drift, self->drift) / kept_by_mean(config, share);
    return (recent_t){.is_large = self->drift_nis > ALARM_NIS,
                      .is_lasting = has_window || (drift >= (LASTING_DRIFT * self->drift_nis)),
                      .drift = drift};
}

static bool is_other_load(const hexload_load_monitor_t* self, const hexload_config_t* config,
                          hexload_fit_t fit, const recent_t* recent) {
    const hexload_real_t least_nis = (config->sensors.half_window_ticks > 0U) ? LASTING_NIS : ALARM_NIS;
    const bool is_large = (fit == HEXLOAD_FIT_UNPROVEN)
                              ? (self->nis_mean > UNPROVEN_NIS)
                              : ((self->nis_mean > least_nis) || (recent->drift > ALARM_DRIFT));
    return is_large && recent->is_lasting;
}

static void remember(hexload_load_monitor_t* self, const hexload_config_t* config, const push_t* push) {
    self->last_input = push->input;
    memcpy(self->last_force_n[1], self->last_force_n[0], sizeof self->last_force_n[1]);
    memcpy(self->last_force_n[0], push->force_n, sizeof self->last_force_n[0]);
    if (self->ticks < hexload_settling_ticks(config)) {
        self->ticks++;
        self->nis_mean = CHI_SQUARE_6_MEAN;
        self->drift_nis = CHI_SQUARE_6_MEAN;
        memset(self->drift, 0, sizeof self->drift);
    }
}

/// Takes over the filter's parameters: mu goes with them, as far as the platform moves.
static void follow_filter(hexload_load_monitor_t* self, const hexload_momentum_filter_t* filter,
                          const hexload_motion_t* motion, hexload_real_t body[DIM], push_t* push) {
    hexload_real_t change[DIM];
    for (int k = 0; k < DIM; k++) {
        change[k] = filter->theta[k] - self->theta[k];
        self->theta[k] = filter->theta[k];
        body[k] = filter->platform[k] + filter->theta[k];
    }
    hexload_momentum_of_body(change, motion, motion->twist, push->momentum_of_change);
    hexload_momentum_of_body(body, motion, motion->twist, push->momentum);
    for (int k = 0; k < 6; k++) {
        self->momentum[k] += push->momentum_of_change[k];
    }
}

/// Whether another wrench acts than the known load's, by the machine's own past.
static bool is_wrong_wrench(hexload_load_monitor_t* self, const hexload_config_t* config,
                            const hexload_momentum_filter_t* filter, hexload_fit_t fit,
                            const hexload_present_tick_t* now, const push_t* push) {
    const hexload_push_t seen = {.motion = now->motion,
                                 .momentum = push->momentum,
                                 .momentum_of_change = push->momentum_of_change,
                                 .impulse = push->impulse,
                                 .variance_n2 = push->variance_n2,
                                 .unknown = self->unknown,
                                 .unknown_scale = push->variance_scale,
                                 .is_moving = hexload_is_moving(now->sample->velocity_m_s)};
    if (now->gap_ticks != 1) {
        hexload_wrench_monitor_restart(&self->wrench);
    }
    return hexload_wrench_monitor_step(&self->wrench, config, filter, fit, &seen);
}

HEXLOAD_RARE bool hexload_load_monitor_is_weight(const hexload_load_monitor_t* self,
                                                 const hexload_config_t* config, hexload_fit_t fit) {
    const hexload_real_t* hinge_m = config->geometry.platform_hinge_m[0];
    const hexload_real_t* force = &self->wrench.lasting[0];
    const hexload_real_t* moment = &self->wrench.lasting[3];
    const hexload_real_t* pull = &self->acceleration[0];
    const hexload_real_t* turn = &self->acceleration[3];
    const hexload_real_t g_m_s2 = config->gravity_m_s2;
    const hexload_real_t lever_m2 = dot3(hinge_m, hinge_m);
    const hexload_real_t square = dot3(pull, pull);
    const hexload_real_t along = dot3(force, pull);
    const hexload_real_t about = dot3(moment, pull);
    const hexload_real_t whole = dot3(force, force) + dot3(moment, moment) / lever_m2;
    const hexload_real_t other = square * dot3(force, force) - along * along + about * about / lever_m2;
    const hexload_real_t inertial =
        square - g_m_s2 * (HEXLOAD_REAL(2.0) * pull[2] - g_m_s2) + lever_m2 * dot3(turn, turn);
    const hexload_real_t least_kg = UNPROVEN_SHARE * (config->platform.mass_kg + self->theta[HEXLOAD_LOAD_M]);
    return other <= whole * (OTHER_SHARE * square + inertial) &&
           (fit != HEXLOAD_FIT_UNPROVEN || whole > least_kg * least_kg * square);
}

bool hexload_load_monitor_is_one_leg(const hexload_load_monitor_t* self, const hexload_config_t* config,
                                     const hexload_momentum_filter_t* filter,
                                     const hexload_present_tick_t* now) {
    hexload_real_t body[DIM];
    hexload_momentum_filter_body(filter, body);
    const hexload_missing_t missing = {.wrench = self->wrench.lasting,
                                       .pull_m_s2 = self->acceleration,
                                       .body = body,
                                       .kept =
                                           kept_by_mean(config, config->tick_s / HEXLOAD_WRENCH_LASTING_S)};
    hexload_explained_t explained;
    hexload_explain_missing(config, now, &missing, &explained);
    const hexload_real_t whole = explained.whole;
    const bool is_turning_load =
        ((whole - explained.by_leg) > hexload_fma(LEFT_BY_LEG, whole, LEFT_BY_NOISE)) &&
        ((whole - explained.by_weight) < (LEFT_BY_WEIGHT * whole));
    return !is_turning_load && (explained.by_leg > (LEAST_EXPLAINED * whole)) &&
           ((explained.by_weight - explained.by_leg) < (HEXLOAD_REAL(2.0) * LEAST_ODDS));
}

bool hexload_load_monitor_is_late(const hexload_load_monitor_t* self) {
    return self->risen_s > LONGEST_RISE_S;
}

bool hexload_load_monitor_step(hexload_load_monitor_t* self, const hexload_config_t* config,
                               const hexload_momentum_filter_t* filter, hexload_real_t variance_scale,
                               hexload_fit_t fit, const hexload_present_tick_t* now) {
    hexload_real_t body[DIM];
    push_t push;
    self->risen_s = self->nis_mean > CALM_NIS ? self->risen_s + config->tick_s : HEXLOAD_REAL(0.0);
    find_push(self, config, now, &push);
    push.variance_scale = variance_scale;
    follow_filter(self, filter, now->motion, body, &push);
    find_impulse(self, config, body, &push);
    const hexload_real_t drift_share = hexload_min(DRIFT_1_S * config->tick_s, DRIFT_SHARE);
    if (self->ticks == 0 || now->gap_ticks != 1) {
        memcpy(self->momentum, push.momentum, sizeof self->momentum);
        seed(self, body, now);
        memcpy(self->late_twist, now->motion->twist, sizeof self->late_twist);
        self->nis = CHI_SQUARE_6_MEAN;
    } else {
        predict(self, config, now, &push);
        add_unknown(self, filter, now->motion, config->tick_s);
        self->nis = correct(self, config, body, now, push.momentum, drift_share);
        self->nis_mean += config->tick_s / HEXLOAD_LOAD_MONITOR_MEMORY_S * (self->nis - self->nis_mean);
    }
    bool is_wrong = is_wrong_wrench(self, config, filter, fit, now, &push);
    follow_acceleration(self, config, now->motion->twist);
    remember(self, config, &push);
    const recent_t recent = look_back(self, config, drift_share);
    const bool is_alarm = is_other_load(self, config, fit, &recent);
    is_wrong = is_wrong && (!recent.is_large || recent.is_lasting); // else noise makes y
    if (is_alarm && fit > HEXLOAD_FIT_NOISE && !is_wrong) {
        self->ticks = 0; // mu begins anew, as errors of the model have moved it
    }
    return fit <= HEXLOAD_FIT_NOISE ? is_alarm : is_wrong;
}
