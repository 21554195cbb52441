#include "front_end/plausibility.h"

#include "algebra/linalg.h"
#include "configuration/health.h"
#include "front_end/noise_estimator.h"

#include <string.h>

enum {
    FORCES_TICKS = 8, ///< of a block, at which its forces are taken: not all work in one tick
    BLOCK_TICKS = 2 * FORCES_TICKS,
    BLOCKS = 32,            ///< in a window
    LONGEST_GAP_TICKS = 8,  ///< that the integral of a velocity bridges
    MOVING_LEGS = 4,        ///< that must have one gain before it is the clock's
    REPEATED_SAMPLES = 26,  ///< one in twenty: a sensor's converter may be late once
    STUCK_TICKS = 64,       ///< of a force; noise passes the steps of any converter before
    FRESH_TICKS = 4,        ///< within which other forces have changed
    FRESH_LEGS = 3,         ///< so many others
    MOTION_STRIKES = 2,     ///< windows in a row
    FORCE_STRIKES = 4,      ///< friction and a tilted base look like other forces for a while
    HOLD = 10,              ///< windows
    USUAL_NEWTON_STEPS = 2, ///< of a pose that follows another
    NO_LEG = HEXLOAD_LEGS,
};

/// Stages of the evaluation after a window's end: one for each leg, and then.
enum {
    SCREEN_END = HEXLOAD_LEGS,
    LOOK = SCREEN_END + 1,
    BALANCE = SCREEN_END + 2,
    CONCLUDE = SCREEN_END + 3,
};

#define N ((hexload_real_t)BLOCKS)

/// Beyond noise: two-sided, 5.7e-7. As a square.
#define SIGMAS_SQUARE HEXLOAD_REAL(25.0)

/// What sensors in order do, in gain; of the lag so many ticks.
#define GAIN_FLOOR HEXLOAD_REAL(0.02)
#define LAG_FLOOR_TICKS HEXLOAD_REAL(2.0)

/// Variances of ways against those of their noise: of a leg that moves enough to look at, or to screen; of
/// what noise leaves unexplained at most, which spreads by a quarter; of a channel that does not move.
#define MOVING_VARIANCES HEXLOAD_REAL(4.0)
#define SCREENED_VARIANCES HEXLOAD_REAL(400.0)
#define NOISE_VARIANCES HEXLOAD_REAL(4.0)
#define STILL_VARIANCES HEXLOAD_REAL(2.0)

/// And of what noise leaves of a displacement that its velocity, a gain and a lag explain.
#define SCATTER_VARIANCES HEXLOAD_REAL(3.0)

/// Shares of the motion: of what a sensor in order leaves unexplained at most, of what one leaves that
/// belongs there, of a channel that does not move; of what is common to two channels of one motion.
#define UNEXPLAINED HEXLOAD_REAL(0.02)
#define EXPLAINED HEXLOAD_REAL(0.05)
#define STILL HEXLOAD_REAL(0.01)
#define SCATTERED HEXLOAD_REAL(1e-4) ///< by a gain and a lag, 1 % in amplitude
#define COMMON HEXLOAD_REAL(0.8)

/// Error of gain up to which a velocity certainly is its own displacement's.
#define IN_PLACE HEXLOAD_REAL(0.1)

/// A leg is fast enough to change its displacement at every tick.
#define MOVING_SIGMAS HEXLOAD_REAL(10.0)

/// Shares of the empty platform's weight below which forces are not what holds it; of the weight that is out
/// of balance, squared; of the mean force, that a dead sensor shows; of the imbalance that its cause leaves,
/// squared.
#define LIGHT HEXLOAD_REAL(0.7)
#define NEGATED HEXLOAD_REAL(-0.5)
#define IMBALANCE_SQUARE HEXLOAD_REAL(0.0025)
#define DEAD HEXLOAD_REAL(0.05)
#define LEFT_OF_IMBALANCE HEXLOAD_REAL(0.15)

void hexload_plausibility_init(hexload_plausibility_t* self) {
    memset(self, 0, sizeof *self);
    self->fault.leg = NO_LEG;
    self->stuck_force = NO_LEG;
}

static hexload_real_t square(hexload_real_t x) {
    return x * x;
}

static uint8_t count_up(uint8_t count) {
    return (uint8_t)(count + (count < UINT8_MAX ? 1 : 0));
}

/// Whether a leg is fast enough to change its displacement at every tick.
static bool is_moving(const hexload_config_t* config, const hexload_leg_sample_t* sample) {
    hexload_real_t fastest_m_s = HEXLOAD_REAL(0.0);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        fastest_m_s = hexload_max(hexload_abs(sample->velocity_m_s[leg]), fastest_m_s);
    }
    return fastest_m_s > MOVING_SIGMAS * config->sensors.velocity_sigma_m_s;
}

/// Counts the ticks for which each force has stood still, and samples that repeat the one before.
static void watch_repeats(hexload_plausibility_t* self, const hexload_config_t* config,
                          const hexload_leg_sample_t* sample) {
    bool is_repeated = true;
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        const bool has_changed = sample->force_n[leg] != self->last_force_n[leg];
        self->run[leg] = has_changed ? 0 : count_up(self->run[leg]);
        is_repeated = is_repeated && !has_changed;
    }
    for (int leg = 0; leg < HEXLOAD_LEGS && is_repeated; leg++) {
        is_repeated = sample->displacement_m[leg] == self->last_displacement_m[leg];
    }
    if (is_repeated && is_moving(config, sample)) {
        self->repeated = count_up(self->repeated);
    }
    memcpy(self->last_force_n, sample->force_n, sizeof self->last_force_n);
    memcpy(self->last_displacement_m, sample->displacement_m, sizeof self->last_displacement_m);
}

/// Forces that stand still while enough others change.
static void note_stuck_forces(hexload_plausibility_t* self) {
    int fresh = 0;
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        fresh += self->run[leg] < FRESH_TICKS ? 1 : 0;
    }
    for (uint32_t leg = 0; leg < (uint32_t)HEXLOAD_LEGS; leg++) {
        if (fresh >= FRESH_LEGS && self->run[leg] >= STUCK_TICKS) {
            self->stuck_force = (uint8_t)leg;
        }
    }
}

static void begin_block(hexload_plausibility_t* self, const hexload_leg_sample_t* sample) {
    memcpy(self->begin_m, sample->displacement_m, sizeof self->begin_m);
    memcpy(self->begin_m_s, sample->velocity_m_s, sizeof self->begin_m_s);
    memset(self->velocities, 0, sizeof self->velocities);
    self->ticks = 0;
    self->has_forces = false;
    self->has_begun = true;
}

static void add_look(hexload_plausibility_look_t* look, hexload_real_t shown_m, hexload_real_t own_m,
                     hexload_real_t change_m_s, const hexload_real_t integral_m[HEXLOAD_LEGS]) {
    const hexload_real_t jump_m_s = change_m_s - look->last_change_m_s;
    look->shown_m2 = hexload_fma(shown_m, shown_m, look->shown_m2);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        look->cross_m2[leg] = hexload_fma(shown_m, integral_m[leg], look->cross_m2[leg]);
    }
    look->change_m_s += change_m_s;
    look->change_m2_s2 = hexload_fma(change_m_s, change_m_s, look->change_m2_s2);
    look->change_shown_m2_s = hexload_fma(change_m_s, shown_m, look->change_shown_m2_s);
    look->change_integral_m2_s = hexload_fma(change_m_s, own_m, look->change_integral_m2_s);
    look->jump_m2_s2 = hexload_fma(jump_m_s, jump_m_s, look->jump_m2_s2);
    look->last_change_m_s = change_m_s;
}

/// The legs' wrench at a tick of each block, by the trapezoidal rule over the window, as the twist's change
/// is; and the part of the leg that is looked at.
static void add_forces(hexload_plausibility_t* self, const hexload_config_t* config,
                       const hexload_present_tick_t* now) {
    static const uint8_t COLUMNS[4] = {0, 1, 5, 2};
    const hexload_motion_t* motion = now->motion;
    const bool is_first = self->blocks == 0;
    const bool is_last = self->blocks == BLOCKS - 1;
    const hexload_real_t weight =
        (is_first || is_last ? HEXLOAD_REAL(0.5) : HEXLOAD_REAL(1.0)) / (hexload_real_t)(BLOCKS - 1);
    for (int n = 0; n < HEXLOAD_LEGS; n++) {
        const hexload_real_t force_n = weight * now->sample->force_n[n];
        const bool is_own = n == (int)self->turn;
        self->look.force_n += is_own ? force_n : HEXLOAD_REAL(0.0);
        for (int k = 0; k < 4; k++) {
            const hexload_real_t part = motion->J[n][COLUMNS[k]] * force_n;
            self->wrench[k] += part;
            self->look.wrench[k] += is_own ? part : HEXLOAD_REAL(0.0);
        }
    }
    self->has_forces = true;
    const hexload_real_t since_s = config->tick_s * (hexload_real_t)((BLOCKS - 1) * BLOCK_TICKS);
    for (int k = 0; k < 3; k++) {
        if (is_first) {
            self->acceleration[k] = motion->twist[k];
        } else if (is_last) {
            self->acceleration[k] = (motion->twist[k] - self->acceleration[k]) / since_s;
        }
    }
}

/// Sums up a block.
static void close_block(hexload_plausibility_t* self, const hexload_config_t* config,
                        const hexload_present_tick_t* now) {
    hexload_real_t shown_m[HEXLOAD_LEGS];
    hexload_real_t integral_m[HEXLOAD_LEGS];
    hexload_real_t change_m_s[HEXLOAD_LEGS];
    for (int n = 0; n < HEXLOAD_LEGS; n++) {
        hexload_plausibility_leg_t* leg = &self->sum[n];
        shown_m[n] = now->sample->displacement_m[n] - self->begin_m[n];
        change_m_s[n] = now->sample->velocity_m_s[n] - self->begin_m_s[n];
        integral_m[n] = config->tick_s * (self->velocities[n] - HEXLOAD_REAL(0.5) * change_m_s[n]);
        leg->shown_m += shown_m[n];
        leg->integral_m += integral_m[n];
        leg->product_m2 = hexload_fma(shown_m[n], integral_m[n], leg->product_m2);
        leg->integral_m2 = hexload_fma(integral_m[n], integral_m[n], leg->integral_m2);
    }
    add_look(&self->look, shown_m[self->turn], integral_m[self->turn], change_m_s[self->turn], integral_m);
    self->blocks++;
    self->stage = self->blocks == BLOCKS ? 1 : 0;
}

/// A sum of products about the means of their factors.
static hexload_real_t about_means(hexload_real_t products, hexload_real_t a, hexload_real_t b) {
    return hexload_fma(HEXLOAD_REAL(-1.0) / N * a, b, products);
}

/// Variance of the way of a block by velocity.
static hexload_real_t integral_noise_m2(const hexload_config_t* config, const hexload_sensors_t* sensors) {
    return (hexload_real_t)BLOCK_TICKS * square(config->tick_s * sensors->velocity_sigma_m_s);
}

/// Gain of a leg's displacement against its velocity, without lag.
static void screen(hexload_plausibility_t* self, const hexload_config_t* config,
                   const hexload_sensors_t* sensors, int n) {
    const hexload_plausibility_leg_t* leg = &self->sum[n];
    const hexload_real_t noise_m2 = integral_noise_m2(config, sensors);
    const hexload_real_t motion_m2 =
        about_means(leg->integral_m2, leg->integral_m, leg->integral_m) - N * noise_m2;
    if (n == 0) {
        self->moving = 0;
        self->largest_error = GAIN_FLOOR;
        self->worst = NO_LEG;
    }
    if (!(motion_m2 > N * SCREENED_VARIANCES * noise_m2)) {
        return;
    }
    const hexload_real_t gain = about_means(leg->product_m2, leg->shown_m, leg->integral_m) / motion_m2;
    const hexload_real_t error = hexload_abs(gain - HEXLOAD_REAL(1.0));
    self->least_gain = self->moving == 0 ? gain : hexload_min(gain, self->least_gain);
    self->largest_gain = self->moving == 0 ? gain : hexload_max(gain, self->largest_gain);
    if (error > self->largest_error) {
        self->largest_error = error;
        self->worst = (uint8_t)n;
    }
    self->moving++;
}

/// Sums of squares and products about their means, of the leg that is looked at.
typedef struct moments {
    hexload_real_t shown;           ///< of ways by displacement, m^2
    hexload_real_t integral;        ///< of those by velocity
    hexload_real_t product;         ///< of both
    hexload_real_t change;          ///< of the velocity's changes, m^2/s^2
    hexload_real_t change_shown;    ///< m^2/s
    hexload_real_t change_integral; ///< m^2/s
} moments_t;

static moments_t moments_of(const hexload_plausibility_t* self) {
    const hexload_plausibility_leg_t* leg = &self->sum[self->turn];
    const hexload_plausibility_look_t* look = &self->look;
    const moments_t moments = {
        .shown = about_means(look->shown_m2, leg->shown_m, leg->shown_m),
        .integral = about_means(leg->integral_m2, leg->integral_m, leg->integral_m),
        .product = about_means(leg->product_m2, leg->shown_m, leg->integral_m),
        .change = about_means(look->change_m2_s2, look->change_m_s, look->change_m_s),
        .change_shown = about_means(look->change_shown_m2_s, look->change_m_s, leg->shown_m),
        .change_integral = about_means(look->change_integral_m2_s, look->change_m_s, leg->integral_m),
    };
    return moments;
}

/// Whether all legs that move have one gain, which is off.
static bool is_common(const hexload_plausibility_t* self) {
    const hexload_real_t size = hexload_abs(self->largest_gain);
    return self->moving >= MOVING_LEGS && self->largest_gain - self->least_gain < GAIN_FLOOR * size &&
           hexload_abs(self->largest_gain - HEXLOAD_REAL(1.0)) > GAIN_FLOOR &&
           hexload_abs(self->least_gain - HEXLOAD_REAL(1.0)) > HEXLOAD_REAL(0.5) * GAIN_FLOOR;
}

/// Displacement = gain x velocity's integral + lag x velocity's change.
typedef struct regression {
    hexload_real_t integral; ///< sums of squares of both regressors without their noise, m^2, m^2/s^2
    hexload_real_t change;
    hexload_real_t gain_error;
    hexload_real_t gain_variance;
    hexload_real_t lag_s;
    hexload_real_t lag_variance_s2;
    hexload_real_t left_m2; ///< what both leave of the displacement
    bool has_lag;           ///< the speed changes enough to tell it
} regression_t;

/// By least squares (P1). Errors have the variances of a displacement's noise, which enters two blocks with
/// opposite signs and so meets the changes of the weights from block to block (at most the sum of both
/// regressors'), and of the integral's. @return whether it can be solved.
static bool regress(const hexload_plausibility_t* self, const hexload_config_t* config,
                    const hexload_sensors_t* sensors, const moments_t* found, regression_t* out) {
    const hexload_real_t noise_m2 = integral_noise_m2(config, sensors);
    const hexload_real_t edge_m2 = square(sensors->displacement_sigma_m);
    const hexload_real_t block_s = (hexload_real_t)BLOCK_TICKS * config->tick_s;
    const hexload_real_t change_noise = HEXLOAD_REAL(2.0) * N * square(sensors->velocity_sigma_m_s);
    const hexload_real_t integral = found->integral - N * noise_m2;
    const hexload_real_t change = found->change - change_noise;
    const bool has_lag = change > MOVING_VARIANCES * change_noise;
    const hexload_real_t mixed = has_lag ? found->change_integral : HEXLOAD_REAL(0.0);
    const hexload_real_t determinant = integral * change - square(mixed);
    // a change of zero or less makes the determinant so
    if (!(integral > HEXLOAD_REAL(0.0)) || !(determinant > STILL * integral * change)) {
        return false;
    }
    const hexload_real_t rough_integral = block_s * hexload_sqrt(found->change);
    const hexload_real_t rough_change = hexload_sqrt(self->look.jump_m2_s2);
    const hexload_real_t gain_edge = change * rough_integral + hexload_abs(mixed) * rough_change;
    const hexload_real_t lag_edge = integral * rough_change + hexload_abs(mixed) * rough_integral;
    const hexload_real_t gain_end = HEXLOAD_REAL(4.0) / N * change * determinant;
    const hexload_real_t gain = (found->product * change - found->change_shown * mixed) / determinant;
    out->integral = integral;
    out->change = change;
    out->has_lag = has_lag;
    out->gain_error = gain - HEXLOAD_REAL(1.0);
    out->gain_variance =
        (edge_m2 * (square(gain_edge) + gain_end) + noise_m2 * change * determinant) / square(determinant);
    out->lag_s = (found->change_shown * integral - found->product * mixed) / determinant;
    out->lag_variance_s2 =
        (edge_m2 * square(lag_edge) + noise_m2 * integral * determinant) / square(determinant);
    out->left_m2 = found->shown - gain * found->product -
                   (has_lag ? out->lag_s * found->change_shown : HEXLOAD_REAL(0.0));
    return true;
}

/// Of two that are significant, what explains more is the cause.
static hexload_input_cause_t find_gain_or_lag(const regression_t* fit, hexload_real_t tick_s) {
    const bool is_gain = hexload_abs(fit->gain_error) > GAIN_FLOOR &&
                         square(fit->gain_error) > SIGMAS_SQUARE * fit->gain_variance;
    const bool is_lag = fit->has_lag && hexload_abs(fit->lag_s) > LAG_FLOOR_TICKS * tick_s &&
                        square(fit->lag_s) > SIGMAS_SQUARE * fit->lag_variance_s2;
    if (is_lag && !(is_gain && square(fit->gain_error) * fit->integral > square(fit->lag_s) * fit->change)) {
        return HEXLOAD_INPUT_VELOCITY_LAG;
    }
    return is_gain ? HEXLOAD_INPUT_VELOCITY_GAIN : HEXLOAD_INPUT_PLAUSIBLE;
}

/// Whether twice the least fault would have been significant.
static bool is_sharp(const regression_t* fit, hexload_real_t tick_s) {
    const hexload_real_t quarter = SIGMAS_SQUARE / HEXLOAD_REAL(4.0);
    return quarter * fit->gain_variance < square(GAIN_FLOOR) &&
           (!fit->has_lag || quarter * fit->lag_variance_s2 < square(LAG_FLOOR_TICKS * tick_s));
}

/// The leg whose velocity, with either sign, leaves least of the displacement unexplained; of others those
/// that are not their own displacement's.
static hexload_real_t find_best(const hexload_plausibility_t* self, const moments_t* found, int* best) {
    const hexload_plausibility_leg_t* own = &self->sum[self->turn];
    hexload_real_t least = found->shown + found->integral;
    for (int n = 0; n < HEXLOAD_LEGS; n++) {
        const hexload_plausibility_leg_t* leg = &self->sum[n];
        const hexload_real_t integral = about_means(leg->integral_m2, leg->integral_m, leg->integral_m);
        const hexload_real_t in_place = about_means(leg->product_m2, leg->shown_m, leg->integral_m);
        const hexload_real_t product = about_means(self->look.cross_m2[n], own->shown_m, leg->integral_m);
        const hexload_real_t left = found->shown + integral - HEXLOAD_REAL(2.0) * hexload_abs(product);
        if (left < least && hexload_abs(in_place - integral) > IN_PLACE * integral) {
            least = left;
            *best = n;
        }
    }
    return least;
}

/// A velocity that is not its displacement's derivative. @param left_m2 what it leaves unexplained.
static hexload_input_cause_t find_contradiction(const hexload_plausibility_t* self, const moments_t* found,
                                                hexload_real_t noise_m2, hexload_real_t left_m2) {
    const hexload_real_t motion_m2 = hexload_max(found->shown, found->integral);
    int best = self->turn;
    const hexload_real_t least_m2 = find_best(self, found, &best);
    if (found->integral < STILL * found->shown) {
        return HEXLOAD_INPUT_VELOCITY_STUCK;
    }
    if (found->shown < STILL * found->integral + STILL_VARIANCES * noise_m2) {
        return HEXLOAD_INPUT_DISPLACEMENT_STUCK;
    }
    // Half of what its own velocity leaves is left by another leg's, or by its own with the other sign.
    if (least_m2 < EXPLAINED * motion_m2 + STILL_VARIANCES * noise_m2 &&
        least_m2 < HEXLOAD_REAL(0.5) * left_m2) {
        return best != self->turn ? HEXLOAD_INPUT_VELOCITY_SWAPPED : HEXLOAD_INPUT_VELOCITY_SIGN;
    }
    return square(found->product) > COMMON * found->shown * found->integral ? HEXLOAD_INPUT_VELOCITY_GAIN
                                                                            : HEXLOAD_INPUT_VELOCITY_OTHER;
}

/// Whether a velocity, a gain and a lag leave more of a displacement than noise does and sensors in order do.
/// Of a channel that is filtered the effective sigma lacks what of its noise is slow: the stated one counts
/// if it is larger.
static bool is_scattered(const hexload_config_t* config, hexload_real_t noise_m2, const moments_t* found,
                         hexload_real_t left_m2) {
    const hexload_real_t stated_m2 = HEXLOAD_REAL(2.0) * N * square(config->sensors.displacement_sigma_m);
    return left_m2 > SCATTERED * found->shown + SCATTER_VARIANCES * hexload_max(noise_m2, stated_m2);
}

/// Displacement against velocity of the leg whose turn it is.
static void look_at_leg(hexload_plausibility_t* self, const hexload_config_t* config,
                        const hexload_sensors_t* sensors, hexload_real_t late_s) {
    const moments_t found = moments_of(self);
    const hexload_real_t noise_m2 =
        N * (HEXLOAD_REAL(2.0) * square(sensors->displacement_sigma_m) + integral_noise_m2(config, sensors));
    const hexload_real_t motion_m2 = hexload_max(found.shown, found.integral);
    const hexload_real_t left_m2 = found.shown + found.integral - HEXLOAD_REAL(2.0) * found.product;
    hexload_input_cause_t cause = HEXLOAD_INPUT_PLAUSIBLE;
    self->has_moved = motion_m2 > MOVING_VARIANCES * noise_m2;
    if (self->has_moved && left_m2 > UNEXPLAINED * motion_m2 + NOISE_VARIANCES * noise_m2) {
        cause = find_contradiction(self, &found, noise_m2, left_m2);
    }
    self->could_show = self->has_moved;
    if (self->has_moved && (cause == HEXLOAD_INPUT_PLAUSIBLE || cause == HEXLOAD_INPUT_VELOCITY_GAIN)) {
        regression_t fit;
        self->could_show = regress(self, config, sensors, &found, &fit);
        if (self->could_show) {
            fit.lag_s -= late_s;
            const hexload_input_cause_t finer = find_gain_or_lag(&fit, config->tick_s);
            cause = finer != HEXLOAD_INPUT_PLAUSIBLE ? finer : cause;
            if (cause == HEXLOAD_INPUT_PLAUSIBLE && is_scattered(config, noise_m2, &found, fit.left_m2)) {
                cause = HEXLOAD_INPUT_VELOCITY_OTHER;
            }
            self->could_show = is_sharp(&fit, config->tick_s);
        }
    }
    if (cause == HEXLOAD_INPUT_VELOCITY_GAIN && is_common(self)) {
        cause = HEXLOAD_INPUT_CLOCK;
    }
    self->motion_cause = (uint8_t)cause;
}

hexload_real_t hexload_rig_weight_n(const hexload_rig_config_t* rig, hexload_real_t weight_n) {
    const hexload_real_t share_n = weight_n / (hexload_real_t)HEXLOAD_LEGS;
    hexload_real_t sum_n = HEXLOAD_REAL(0.0);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        sum_n += hexload_abs(rig->force_offset_n[leg]) + rig->coulomb_n[leg] +
                 hexload_max(rig->stribeck_n[leg], HEXLOAD_REAL(0.0)) +
                 (hexload_abs(rig->force_gain[leg]) + rig->growth_n_n[leg]) * share_n;
    }
    return sum_n;
}

/// Forces that the empty platform's weight cannot be, whatever the legs' friction.
static void weigh(hexload_plausibility_t* self, const hexload_config_t* config, hexload_real_t weight_n) {
    const hexload_real_t own_n = config->platform.mass_kg * config->gravity_m_s2;
    const hexload_real_t block_s = (hexload_real_t)BLOCK_TICKS * config->tick_s;
    hexload_real_t most_n = weight_n + hexload_rig_weight_n(&config->rig, own_n);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        const hexload_real_t speed_m_s = hexload_sqrt(self->sum[leg].integral_m2 / N) / block_s; // rms
        most_n = hexload_fma(config->rig.viscous_n_s_m[leg], speed_m_s, most_n);
    }
    if (most_n < NEGATED * own_n) {
        self->force_cause = HEXLOAD_INPUT_FORCES_NEGATED;
    } else if (most_n < LIGHT * own_n) {
        self->force_cause = HEXLOAD_INPUT_FORCES_LIGHT;
    } else {
        // friction may be all that is missing
    }
}

/// Forces sidewards and the moment about the vertical, beyond what the machine's acceleration needs: a load
/// at rest takes none of them. Whether those of the leg that is looked at are out of place: its other sign
/// takes the imbalance away, or it is none where any size would.
static void balance(hexload_plausibility_t* self, const hexload_config_t* config,
                    const hexload_motion_t* motion) {
    const hexload_real_t mass_kg = self->wrench[3] / (config->gravity_m_s2 + self->acceleration[2]);
    const hexload_real_t weight_n = mass_kg * config->gravity_m_s2;
    const hexload_real_t own_n = config->platform.mass_kg * config->gravity_m_s2;
    const hexload_real_t* row = motion->J[self->turn];
    const hexload_real_t length_m = config->geometry.home_leg_length_m[self->turn];
    const hexload_real_t whole[3] = {self->wrench[0] - mass_kg * self->acceleration[0],
                                     self->wrench[1] - mass_kg * self->acceleration[1],
                                     self->wrench[2] / length_m};
    const hexload_real_t direction[3] = {row[0], row[1], row[5] / length_m};
    const hexload_real_t total = hexload_dot3(whole, whole);
    const hexload_real_t along_n = hexload_dot3(whole, direction) / hexload_dot3(direction, direction);
    const bool is_dead = hexload_abs(self->look.force_n) < DEAD * hexload_abs(weight_n);
    hexload_real_t left[3];
    for (int k = 0; k < 3; k++) {
        const hexload_real_t part = k == 2 ? self->look.wrench[2] / length_m : self->look.wrench[k];
        left[k] = whole[k] - (is_dead ? along_n * direction[k] : HEXLOAD_REAL(2.0) * part);
    }
    if (total > IMBALANCE_SQUARE * square(weight_n) && hexload_dot3(left, left) < LEFT_OF_IMBALANCE * total &&
        (is_dead ? along_n : self->look.force_n) * weight_n < HEXLOAD_REAL(0.0)) {
        self->force_cause = is_dead ? HEXLOAD_INPUT_FORCE_DEAD : HEXLOAD_INPUT_FORCE_SIGN;
    } else if (weight_n < LIGHT * own_n) {
        weigh(self, config, weight_n);
    }
}

/// What this window says: the most certain first.
static hexload_input_fault_t fault_of_window(const hexload_plausibility_t* self) {
    hexload_input_fault_t fault = {.cause = HEXLOAD_INPUT_PLAUSIBLE, .leg = NO_LEG};
    if (self->repeated >= REPEATED_SAMPLES) {
        fault.cause = HEXLOAD_INPUT_ROWS_REPEATED;
    } else if (self->motion_cause != HEXLOAD_INPUT_PLAUSIBLE) {
        fault.cause = (hexload_input_cause_t)self->motion_cause;
        fault.leg = fault.cause == HEXLOAD_INPUT_CLOCK ||
                            (fault.cause == HEXLOAD_INPUT_VELOCITY_SIGN && is_common(self))
                        ? (uint32_t)NO_LEG
                        : self->turn;
    } else if (self->stuck_force != NO_LEG) {
        fault.cause = HEXLOAD_INPUT_FORCE_STUCK;
        fault.leg = self->stuck_force;
    } else {
        fault.cause = (hexload_input_cause_t)self->force_cause;
        const bool is_of_one =
            fault.cause == HEXLOAD_INPUT_FORCE_SIGN || fault.cause == HEXLOAD_INPUT_FORCE_DEAD;
        fault.leg = is_of_one ? self->turn : (uint32_t)NO_LEG;
    }
    return fault;
}

static bool is_of_balance(uint32_t cause) {
    return cause >= (uint32_t)HEXLOAD_INPUT_FORCES_NEGATED;
}

/// Windows in a row that must show it. Repeated samples are a fact.
static int strikes_for(hexload_input_cause_t cause) {
    if (cause == HEXLOAD_INPUT_ROWS_REPEATED) {
        return 1;
    }
    return is_of_balance(cause) ? FORCE_STRIKES : MOTION_STRIKES;
}

/// Counts windows that show the same: of velocity and displacement a leg with any contradiction. A window
/// that could have shown it and does not begins anew; of forces, whose balance is rough, it takes one back.
static void count_strikes(hexload_plausibility_t* self, const hexload_input_fault_t* seen) {
    const bool is_balance = is_of_balance(self->seen_cause);
    if (seen->cause != HEXLOAD_INPUT_PLAUSIBLE) {
        const bool is_same = seen->leg == self->seen_leg && is_balance == is_of_balance(seen->cause) &&
                             (!is_balance || seen->cause == (hexload_input_cause_t)self->seen_cause);
        self->strikes = (uint8_t)(is_same ? count_up(self->strikes) : 1);
        self->seen_cause = (uint8_t)seen->cause;
        self->seen_leg = (uint8_t)seen->leg;
    } else if (is_balance) {
        self->strikes--;
    } else if (self->could_show) {
        self->strikes = 0;
    }
    if (self->strikes == 0) {
        self->seen_cause = HEXLOAD_INPUT_PLAUSIBLE;
    }
}

/// A fault gets another name when two windows in a row give it.
static void conclude(hexload_plausibility_t* self) {
    const hexload_input_fault_t seen = fault_of_window(self);
    const bool has_moved = self->has_moved || self->moving > 0;
    const bool is_repeated = seen.cause == (hexload_input_cause_t)self->seen_cause;
    count_strikes(self, &seen);
    if (seen.cause != HEXLOAD_INPUT_PLAUSIBLE && self->strikes >= strikes_for(seen.cause)) {
        const bool is_same_leg = self->hold > 0 && self->fault.leg == seen.leg;
        if (!is_same_leg || is_repeated) {
            self->fault = seen;
        }
        self->hold = HOLD;
    } else if (self->hold > 0 && (has_moved || is_of_balance(self->fault.cause))) {
        self->hold--;
    }
    if (self->hold == 0) {
        self->fault = (hexload_input_fault_t){.cause = HEXLOAD_INPUT_PLAUSIBLE, .leg = NO_LEG};
    }
}

/// The next window: on with the leg that is under suspicion, or whose gain is off, else with the next one.
static void begin_window(hexload_plausibility_t* self) {
    const bool is_suspect = self->strikes > 0 && self->seen_leg == self->turn;
    if (!is_suspect) {
        const bool has_reason = self->worst != NO_LEG && self->worst != self->turn;
        self->round = (uint8_t)(has_reason ? self->round : (self->round + 1) % HEXLOAD_LEGS);
        self->turn = has_reason ? self->worst : self->round;
    }
    memset(self->sum, 0, sizeof self->sum);
    memset(&self->look, 0, sizeof self->look);
    memset(self->wrench, 0, sizeof self->wrench);
    self->force_cause = HEXLOAD_INPUT_PLAUSIBLE;
    self->stuck_force = NO_LEG;
    self->repeated = 0;
    self->blocks = 0;
}

/// One stage of what is to do after a window's end.
static void evaluate(hexload_plausibility_t* self, const hexload_config_t* config,
                     const hexload_present_tick_t* now, hexload_real_t late_s) {
    const bool has_velocity = config->sensors.half_window_ticks == 0;
    if (self->stage <= SCREEN_END && has_velocity) {
        screen(self, config, &now->sensors, self->stage - 1);
    } else if (self->stage == LOOK && has_velocity) {
        look_at_leg(self, config, &now->sensors, late_s);
    } else if (self->stage == BALANCE && config->gravity_m_s2 > HEXLOAD_REAL(0.0)) {
        balance(self, config, now->motion);
        if ((self->force_cause == HEXLOAD_INPUT_PLAUSIBLE) &&
            hexload_noise_estimator_are_forces_quiet(now->noise, config)) {
            self->force_cause = HEXLOAD_INPUT_FORCES_QUIET;
        }
    } else if (self->stage == CONCLUDE) {
        conclude(self);
        begin_window(self);
    }
    self->stage = self->stage == CONCLUDE ? 0 : (uint8_t)(self->stage + 1);
}

void hexload_plausibility_step(hexload_plausibility_t* self, const hexload_config_t* config,
                               const hexload_leg_sample_t* sample, const hexload_present_tick_t* now,
                               hexload_real_t late_s) {
    watch_repeats(self, config, sample);
    if (now->sample == NULL || now->gap_ticks == 0 || now->gap_ticks > LONGEST_GAP_TICKS ||
        !self->has_begun) {
        self->has_begun = false;
        if (now->sample != NULL) {
            begin_block(self, now->sample);
        }
        return;
    }
    const hexload_real_t gap = (hexload_real_t)now->gap_ticks;
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        self->velocities[leg] = hexload_fma(gap, now->sample->velocity_m_s[leg], self->velocities[leg]);
    }
    self->ticks = (uint8_t)(self->ticks + now->gap_ticks);
    if (now->motion->newton_steps > USUAL_NEWTON_STEPS) {
        return; // what is to be done beyond sums can wait
    }
    bool is_over = self->ticks >= BLOCK_TICKS;
    if (self->stage > 0) {
        evaluate(self, config, now, late_s);
    } else if (self->ticks >= FORCES_TICKS && !self->has_forces) {
        add_forces(self, config, now);
        is_over = false; // its ways belong to these forces
    } else if (is_over) {
        if (is_moving(config, sample)) {
            note_stuck_forces(self);
        }
        close_block(self, config, now);
    }
    if (is_over) {
        begin_block(self, now->sample);
    }
}

bool hexload_plausibility_is_idle(const hexload_plausibility_t* self) {
    return (self->stage == 0U) && ((self->ticks % (uint32_t)FORCES_TICKS) != 0U);
}

void hexload_input_fault_judge(int parameters, hexload_estimate_t* estimate, uint32_t* health) {
    for (int k = 0; k < parameters; k++) {
        if (estimate->parameter_verdict[k] < HEXLOAD_VERDICT_MISFIT) {
            estimate->parameter_verdict[k] = HEXLOAD_VERDICT_MISFIT;
        }
    }
    if (estimate->verdict < HEXLOAD_VERDICT_MISFIT) {
        estimate->verdict = HEXLOAD_VERDICT_MISFIT;
    }
    hexload_health_set(health, HEXLOAD_HEALTH_INPUT_IMPLAUSIBLE);
}

void hexload_plausibility_judge(const hexload_plausibility_t* self, int parameters,
                                hexload_estimate_t* estimate, hexload_input_fault_t* fault,
                                uint32_t* health) {
    *fault = self->fault;
    if (self->fault.cause == HEXLOAD_INPUT_PLAUSIBLE) {
        return;
    }
    hexload_input_fault_judge(parameters, estimate, health);
}
