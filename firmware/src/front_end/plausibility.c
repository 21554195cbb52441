#include "front_end/plausibility.h"

#include <string.h>

enum {
    BLOCK_TICKS = 16,
    BLOCKS = 32,           ///< in a window
    LONGEST_GAP_TICKS = 8, ///< that the integral of a velocity bridges
    MOVING_LEGS = 4,       ///< that must have one gain before it is the clock's
    REPEATED_SAMPLES = 26, ///< one in twenty: a sensor's converter may be late once
    STUCK_TICKS = 64,      ///< of a force; noise passes the steps of any converter before
    FRESH_TICKS = 4,       ///< within which other forces have changed
    FRESH_LEGS = 3,        ///< so many others
    MOTION_STRIKES = 2,    ///< windows in a row
    FORCE_STRIKES = 4,     ///< friction and a tilted base look like other forces for a while
    HOLD = 10,             ///< windows
    NO_LEG = HEXLOAD_LEGS,
    SCREEN_END = HEXLOAD_LEGS, ///< stages of the evaluation: a leg each, and then
    LOOK,
    BALANCE,
    CONCLUDE,
};

#define N ((hexload_real_t)BLOCKS)

/// Beyond noise: two-sided, 5.7e-7. As a square.
#define SIGMAS_SQUARE HEXLOAD_REAL(25.0)

/// What sensors in order do, in gain; of the lag so many ticks.
#define GAIN_FLOOR HEXLOAD_REAL(0.02)
#define LAG_FLOOR_TICKS HEXLOAD_REAL(2.0)

/// A leg moves when the variance of its ways is so many times that of their noise.
#define MOVING_VARIANCES HEXLOAD_REAL(25.0)
#define SCREENED_VARIANCES HEXLOAD_REAL(400.0)

/// Share of the motion that gain and lag of a sensor that belongs there leave unexplained at most; share
/// below which another sensor explains it; share of a channel that does not move.
#define UNEXPLAINED HEXLOAD_REAL(0.02)
#define EXPLAINED HEXLOAD_REAL(0.05)
#define STILL HEXLOAD_REAL(0.01)

/// A leg is fast enough to change its displacement at every tick.
#define MOVING_SIGMAS HEXLOAD_REAL(10.0)

/// Weight of the empty platform below which forces are not its; imbalance in shares of the weight; change of
/// one force in shares of the mean one; share of the imbalance that its cause leaves.
#define LIGHT HEXLOAD_REAL(0.7)
#define NEGATED HEXLOAD_REAL(-0.5)
#define IMBALANCE HEXLOAD_REAL(0.05)
#define FORCE_CHANGE HEXLOAD_REAL(0.3)
#define LEFT_OF_IMBALANCE HEXLOAD_REAL(0.25)

void hexload_plausibility_init(hexload_plausibility_t* self) {
    memset(self, 0, sizeof *self);
    self->fault.leg = NO_LEG;
    self->seen_leg = NO_LEG;
}

static hexload_real_t square(hexload_real_t x) {
    return x * x;
}

/// Counts samples that repeat the one before, and the ticks for which each force has stood still.
static void watch_repeats(hexload_plausibility_t* self, const hexload_config_t* config,
                          const hexload_leg_sample_t* sample) {
    bool is_repeated = true;
    bool is_moving = false;
    const hexload_real_t fast_m_s = MOVING_SIGMAS * config->sensors.velocity_sigma_m_s;
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        const bool has_changed = sample->force_n[leg] != self->last_force_n[leg];
        is_repeated =
            is_repeated && !has_changed && sample->displacement_m[leg] == self->last_displacement_m[leg];
        is_moving = is_moving || hexload_abs(sample->velocity_m_s[leg]) > fast_m_s;
        self->run[leg] = has_changed ? 0 : (uint8_t)(self->run[leg] + (self->run[leg] < UINT8_MAX ? 1 : 0));
        self->last_force_n[leg] = sample->force_n[leg];
        self->last_displacement_m[leg] = sample->displacement_m[leg];
    }
    self->repeated = (uint16_t)(self->repeated + (is_repeated && is_moving ? 1 : 0));
}

/// Forces that stand still while enough others change and the machine moves.
static void note_stuck_forces(hexload_plausibility_t* self, const hexload_config_t* config,
                              const hexload_leg_sample_t* sample) {
    const hexload_real_t fast_m_s = MOVING_SIGMAS * config->sensors.velocity_sigma_m_s;
    bool is_moving = false;
    int fresh = 0;
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        is_moving = is_moving || hexload_abs(sample->velocity_m_s[leg]) > fast_m_s;
        fresh += self->run[leg] < FRESH_TICKS ? 1 : 0;
    }
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        if (is_moving && fresh >= FRESH_LEGS && self->run[leg] >= STUCK_TICKS) {
            self->stuck_forces = (uint8_t)(self->stuck_forces | 1u << leg);
        }
    }
}

static void begin_block(hexload_plausibility_t* self, const hexload_leg_sample_t* sample) {
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        self->leg[leg].begin_m = sample->displacement_m[leg];
        self->leg[leg].begin_m_s = sample->velocity_m_s[leg];
        self->leg[leg].velocities = HEXLOAD_REAL(0.0);
    }
    self->ticks = 0;
    self->has_begun = true;
}

static void add_look(hexload_plausibility_look_t* look, bool is_first, hexload_real_t shown_m,
                     hexload_real_t own_m, hexload_real_t change_m_s,
                     const hexload_real_t integral_m[HEXLOAD_LEGS]) {
    look->shown_m2 = hexload_fma(shown_m, shown_m, look->shown_m2);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        look->cross_m2[leg] = hexload_fma(shown_m, integral_m[leg], look->cross_m2[leg]);
    }
    look->change_m_s += change_m_s;
    look->change_m2_s2 = hexload_fma(change_m_s, change_m_s, look->change_m2_s2);
    look->change_shown_m2_s = hexload_fma(change_m_s, shown_m, look->change_shown_m2_s);
    look->change_integral_m2_s = hexload_fma(change_m_s, own_m, look->change_integral_m2_s);
    look->jump_m2_s2 += is_first ? HEXLOAD_REAL(0.0) : square(change_m_s - look->last_change_m_s);
    look->last_change_m_s = change_m_s;
}

/// Sums up a block. Forces by the trapezoidal rule over the window, as the twist's change is.
static void close_block(hexload_plausibility_t* self, const hexload_config_t* config,
                        const hexload_present_tick_t* now) {
    const hexload_motion_t* motion = now->motion;
    const bool is_first = self->blocks == 0;
    const bool is_last = self->blocks == BLOCKS - 1;
    const hexload_real_t weight = is_first || is_last ? HEXLOAD_REAL(0.5) : HEXLOAD_REAL(1.0);
    hexload_real_t integral_m[HEXLOAD_LEGS];
    for (int n = 0; n < HEXLOAD_LEGS; n++) {
        hexload_plausibility_leg_t* leg = &self->leg[n];
        const hexload_real_t shown_m = now->sample->displacement_m[n] - leg->begin_m;
        const hexload_real_t change_m_s = now->sample->velocity_m_s[n] - leg->begin_m_s;
        const hexload_real_t force_n = weight * now->sample->force_n[n];
        integral_m[n] = config->tick_s * (leg->velocities - HEXLOAD_REAL(0.5) * change_m_s);
        leg->shown_m += shown_m;
        leg->integral_m += integral_m[n];
        leg->product_m2 = hexload_fma(shown_m, integral_m[n], leg->product_m2);
        leg->integral_m2 = hexload_fma(integral_m[n], integral_m[n], leg->integral_m2);
        leg->force_n += force_n;
        for (int k = 0; k < 3; k++) {
            self->wrench[k] = hexload_fma(motion->J[n][k], force_n, self->wrench[k]);
        }
        self->wrench[3] = hexload_fma(motion->J[n][5], force_n, self->wrench[3]);
    }
    const hexload_plausibility_leg_t* own = &self->leg[self->turn];
    add_look(&self->look, is_first, now->sample->displacement_m[self->turn] - own->begin_m,
             integral_m[self->turn], now->sample->velocity_m_s[self->turn] - own->begin_m_s, integral_m);
    const hexload_real_t since_s = config->tick_s * (hexload_real_t)((BLOCKS - 1) * BLOCK_TICKS);
    for (int k = 0; k < 3; k++) {
        self->acceleration[k] = is_first  ? motion->twist[k]
                                : is_last ? (motion->twist[k] - self->acceleration[k]) / since_s
                                          : self->acceleration[k];
    }
    self->blocks++;
    self->stage = is_last ? 1 : 0;
}

/// Variance of the way of a block by velocity.
static hexload_real_t integral_noise_m2(const hexload_config_t* config, const hexload_sensors_t* sensors) {
    return (hexload_real_t)BLOCK_TICKS * square(config->tick_s * sensors->velocity_sigma_m_s);
}

/// Gain of a leg's displacement against its velocity, without lag.
static void screen(hexload_plausibility_t* self, const hexload_config_t* config,
                   const hexload_sensors_t* sensors, int n) {
    const hexload_plausibility_leg_t* leg = &self->leg[n];
    const hexload_real_t noise_m2 = integral_noise_m2(config, sensors);
    const hexload_real_t motion_m2 =
        leg->integral_m2 - leg->integral_m * leg->integral_m / N - (N - HEXLOAD_REAL(1.0)) * noise_m2;
    if (n == 0) {
        self->moving = 0;
        self->largest_error = GAIN_FLOOR;
        self->worst = NO_LEG;
    }
    if (!(motion_m2 > N * SCREENED_VARIANCES * noise_m2)) {
        return;
    }
    const hexload_real_t gain = (leg->product_m2 - leg->shown_m * leg->integral_m / N) / motion_m2;
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
    const hexload_plausibility_leg_t* leg = &self->leg[self->turn];
    const hexload_plausibility_look_t* look = &self->look;
    const moments_t moments = {
        .shown = look->shown_m2 - leg->shown_m * leg->shown_m / N,
        .integral = leg->integral_m2 - leg->integral_m * leg->integral_m / N,
        .product = leg->product_m2 - leg->shown_m * leg->integral_m / N,
        .change = look->change_m2_s2 - look->change_m_s * look->change_m_s / N,
        .change_shown = look->change_shown_m2_s - look->change_m_s * leg->shown_m / N,
        .change_integral = look->change_integral_m2_s - look->change_m_s * leg->integral_m / N,
    };
    return moments;
}

/// Whether all legs that move have a gain of one sign and one size.
static bool is_common(const hexload_plausibility_t* self) {
    const hexload_real_t spread = self->largest_gain - self->least_gain;
    return self->moving >= MOVING_LEGS && spread < GAIN_FLOOR * hexload_abs(self->largest_gain);
}

/// Displacement = gain x velocity's integral + lag x velocity's change: the errors' variances are those of a
/// displacement's noise, which enters two blocks with opposite signs, and of the integral's.
static hexload_input_cause_t find_gain_and_lag(const hexload_plausibility_t* self,
                                               const hexload_config_t* config,
                                               const hexload_sensors_t* sensors, const moments_t* found,
                                               hexload_real_t late_s) {
    const hexload_real_t noise_m2 = integral_noise_m2(config, sensors);
    const hexload_real_t edge_m2 = square(sensors->displacement_sigma_m);
    const hexload_real_t block_s = (hexload_real_t)BLOCK_TICKS * config->tick_s;
    const hexload_real_t change_noise = HEXLOAD_REAL(2.0) * N * square(sensors->velocity_sigma_m_s);
    const hexload_real_t integral = found->integral - N * noise_m2;
    const hexload_real_t change = found->change - change_noise;
    const bool has_lag = change > MOVING_VARIANCES * change_noise;
    const hexload_real_t determinant =
        has_lag ? integral * change - square(found->change_integral) : integral;
    if (!(integral > HEXLOAD_REAL(0.0)) ||
        !(determinant > STILL * integral * (has_lag ? change : HEXLOAD_REAL(1.0)))) {
        return HEXLOAD_INPUT_PLAUSIBLE;
    }
    const hexload_real_t gain =
        has_lag ? (found->product * change - found->change_shown * found->change_integral) / determinant
                : found->product / determinant;
    const hexload_real_t inflation =
        has_lag ? integral * change / determinant : HEXLOAD_REAL(1.0); // as gain and lag look alike
    const hexload_real_t gain_variance =
        inflation *
        (edge_m2 * (square(block_s) * found->change + HEXLOAD_REAL(4.0) * found->integral / N) +
         noise_m2 * found->integral) /
        square(integral);
    const hexload_real_t error = square(gain - HEXLOAD_REAL(1.0));
    if (error > square(GAIN_FLOOR) && error > SIGMAS_SQUARE * gain_variance) {
        return HEXLOAD_INPUT_VELOCITY_GAIN;
    }
    if (has_lag) {
        const hexload_real_t lag_s =
            (found->change_shown * integral - found->product * found->change_integral) / determinant - late_s;
        const hexload_real_t lag_variance =
            inflation * (edge_m2 * self->look.jump_m2_s2 + noise_m2 * found->change) / square(change);
        if (hexload_abs(lag_s) > LAG_FLOOR_TICKS * config->tick_s &&
            square(lag_s) > SIGMAS_SQUARE * lag_variance) {
            return HEXLOAD_INPUT_VELOCITY_LAG;
        }
    }
    return HEXLOAD_INPUT_PLAUSIBLE;
}

/// The leg whose velocity, with either sign, leaves least of the displacement unexplained.
static hexload_real_t find_best(const hexload_plausibility_t* self, const moments_t* found, int* best,
                                bool* is_negative) {
    const hexload_plausibility_leg_t* own = &self->leg[self->turn];
    hexload_real_t least = found->shown + found->integral;
    for (int n = 0; n < HEXLOAD_LEGS; n++) {
        const hexload_plausibility_leg_t* leg = &self->leg[n];
        const hexload_real_t integral = leg->integral_m2 - leg->integral_m * leg->integral_m / N;
        const hexload_real_t product = self->look.cross_m2[n] - own->shown_m * leg->integral_m / N;
        const hexload_real_t left = found->shown + integral - HEXLOAD_REAL(2.0) * hexload_abs(product);
        if (left < least) {
            least = left;
            *best = n;
            *is_negative = product < HEXLOAD_REAL(0.0);
        }
    }
    return least;
}

/// A velocity that is not at all its displacement's derivative.
static hexload_input_cause_t find_contradiction(const hexload_plausibility_t* self, const moments_t* found) {
    const hexload_real_t motion = hexload_max(found->shown, found->integral);
    int best = self->turn;
    bool is_negative = false;
    const hexload_real_t left = find_best(self, found, &best, &is_negative);
    if (left < EXPLAINED * motion && (best != self->turn || is_negative)) {
        return best != self->turn ? HEXLOAD_INPUT_VELOCITY_SWAPPED : HEXLOAD_INPUT_VELOCITY_SIGN;
    }
    if (square(found->product) > (HEXLOAD_REAL(1.0) - EXPLAINED) * found->shown * found->integral) {
        return HEXLOAD_INPUT_VELOCITY_GAIN;
    }
    if (found->integral < STILL * found->shown) {
        return HEXLOAD_INPUT_VELOCITY_STUCK;
    }
    return found->shown < STILL * found->integral ? HEXLOAD_INPUT_DISPLACEMENT_STUCK
                                                  : HEXLOAD_INPUT_VELOCITY_OTHER;
}

/// Displacement against velocity of the leg whose turn it is.
static void look(hexload_plausibility_t* self, const hexload_config_t* config,
                 const hexload_sensors_t* sensors, hexload_real_t late_s) {
    const moments_t found = moments_of(self);
    const hexload_real_t noise_m2 =
        N * (HEXLOAD_REAL(2.0) * square(sensors->displacement_sigma_m) + integral_noise_m2(config, sensors));
    const hexload_real_t motion_m2 = hexload_max(found.shown, found.integral);
    const hexload_real_t left = found.shown + found.integral - HEXLOAD_REAL(2.0) * found.product;
    hexload_input_cause_t cause = HEXLOAD_INPUT_PLAUSIBLE;
    self->has_moved = motion_m2 > MOVING_VARIANCES * noise_m2;
    if (self->has_moved && left > UNEXPLAINED * motion_m2 + HEXLOAD_REAL(4.0) * noise_m2) {
        cause = find_contradiction(self, &found);
    } else if (self->has_moved) {
        cause = find_gain_and_lag(self, config, sensors, &found, late_s);
    }
    if ((cause == HEXLOAD_INPUT_VELOCITY_GAIN) && is_common(self)) {
        cause = HEXLOAD_INPUT_CLOCK;
    }
    self->motion_cause = (uint8_t)cause;
}

/// What the legs push sidewards and about the vertical beyond what the machine's acceleration needs, as
/// forces: a static load takes none of it. Each leg has a direction there.
typedef struct imbalance {
    hexload_real_t whole[3];
    hexload_real_t direction[HEXLOAD_LEGS][3];
    hexload_real_t weight_n;     ///< that the legs carry
    hexload_real_t mean_force_n; ///< of their sizes
} imbalance_t;

static void find_imbalance(const hexload_plausibility_t* self, const hexload_config_t* config,
                           const hexload_motion_t* motion, imbalance_t* found) {
    const hexload_real_t scale = HEXLOAD_REAL(1.0) / (hexload_real_t)(BLOCKS - 1);
    const hexload_real_t mass_kg = scale * self->wrench[2] / (config->gravity_m_s2 + self->acceleration[2]);
    hexload_real_t sideways = HEXLOAD_REAL(0.0);
    hexload_real_t turning_m2 = HEXLOAD_REAL(0.0);
    found->mean_force_n = HEXLOAD_REAL(0.0);
    for (int n = 0; n < HEXLOAD_LEGS; n++) {
        const hexload_real_t* row = motion->J[n];
        sideways += row[0] * row[0] + row[1] * row[1];
        turning_m2 += row[5] * row[5];
        found->mean_force_n += scale * hexload_abs(self->leg[n].force_n) / (hexload_real_t)HEXLOAD_LEGS;
    }
    const hexload_real_t per_arm = hexload_sqrt(sideways / turning_m2);
    for (int n = 0; n < HEXLOAD_LEGS; n++) {
        found->direction[n][0] = motion->J[n][0];
        found->direction[n][1] = motion->J[n][1];
        found->direction[n][2] = per_arm * motion->J[n][5];
    }
    found->whole[0] = scale * self->wrench[0] - mass_kg * self->acceleration[0];
    found->whole[1] = scale * self->wrench[1] - mass_kg * self->acceleration[1];
    found->whole[2] = per_arm * scale * self->wrench[3];
    found->weight_n = mass_kg * config->gravity_m_s2;
}

/// One force whose other sign, or another size, takes the imbalance away.
static void balance(hexload_plausibility_t* self, const hexload_config_t* config,
                    const hexload_motion_t* motion) {
    imbalance_t found;
    find_imbalance(self, config, motion, &found);
    const hexload_real_t own_n = config->platform.mass_kg * config->gravity_m_s2;
    hexload_real_t whole = HEXLOAD_REAL(0.0);
    for (int k = 0; k < 3; k++) {
        whole += square(found.whole[k]);
    }
    hexload_real_t least = square(LEFT_OF_IMBALANCE) * whole;
    self->force_cause = HEXLOAD_INPUT_PLAUSIBLE;
    self->force_leg = NO_LEG;
    for (int n = 0; n < HEXLOAD_LEGS && whole > square(IMBALANCE * found.weight_n); n++) {
        const hexload_real_t* direction = found.direction[n];
        const hexload_real_t length = square(direction[0]) + square(direction[1]) + square(direction[2]);
        const hexload_real_t along =
            found.whole[0] * direction[0] + found.whole[1] * direction[1] + found.whole[2] * direction[2];
        const hexload_real_t wrong_n = along / length; // what this force is too large by
        const hexload_real_t left = whole - along * wrong_n;
        const hexload_real_t force_n = self->leg[n].force_n / (hexload_real_t)(BLOCKS - 1);
        if (left < least && hexload_abs(wrong_n) > FORCE_CHANGE * found.mean_force_n) {
            const bool is_sign =
                hexload_abs(HEXLOAD_REAL(2.0) * force_n - wrong_n) < FORCE_CHANGE * hexload_abs(wrong_n);
            least = left;
            self->force_cause = is_sign ? HEXLOAD_INPUT_FORCE_SIGN : HEXLOAD_INPUT_FORCE_SIZE;
            self->force_leg = (uint8_t)n;
        }
    }
    if (found.weight_n < NEGATED * own_n) {
        self->force_cause = HEXLOAD_INPUT_FORCES_NEGATED;
        self->force_leg = NO_LEG;
    } else if (found.weight_n < LIGHT * own_n && self->force_cause == HEXLOAD_INPUT_PLAUSIBLE) {
        self->force_cause = HEXLOAD_INPUT_FORCES_LIGHT;
    }
}

/// What this window says: the most certain first.
static hexload_input_fault_t fault_of_window(const hexload_plausibility_t* self) {
    hexload_input_fault_t fault = {HEXLOAD_INPUT_PLAUSIBLE, NO_LEG};
    if (self->repeated >= REPEATED_SAMPLES) {
        fault.cause = HEXLOAD_INPUT_ROWS_REPEATED;
    } else if (self->motion_cause != HEXLOAD_INPUT_PLAUSIBLE) {
        fault.cause = (hexload_input_cause_t)self->motion_cause;
        fault.leg = fault.cause == HEXLOAD_INPUT_CLOCK ||
                            (fault.cause == HEXLOAD_INPUT_VELOCITY_SIGN && is_common(self))
                        ? (uint32_t)NO_LEG
                        : self->turn;
    } else if (self->stuck_forces != 0) {
        fault.cause = HEXLOAD_INPUT_FORCE_STUCK;
        fault.leg = 0;
        while ((self->stuck_forces >> fault.leg & 1u) == 0) {
            fault.leg++;
        }
    } else {
        fault.cause = (hexload_input_cause_t)self->force_cause;
        fault.leg = self->force_leg;
    }
    return fault;
}

static bool is_of_balance(hexload_input_cause_t cause) {
    return cause >= HEXLOAD_INPUT_FORCES_NEGATED;
}

static void conclude(hexload_plausibility_t* self) {
    const hexload_input_fault_t seen = fault_of_window(self);
    const bool has_moved = self->has_moved || self->moving > 0;
    if (seen.cause != HEXLOAD_INPUT_PLAUSIBLE) {
        const bool is_same =
            seen.cause == (hexload_input_cause_t)self->seen_cause && seen.leg == self->seen_leg;
        self->strikes = (uint8_t)(is_same ? self->strikes + (self->strikes < UINT8_MAX ? 1 : 0) : 1);
    } else if (has_moved || is_of_balance((hexload_input_cause_t)self->seen_cause)) {
        self->strikes = 0;
    }
    if (seen.cause != HEXLOAD_INPUT_PLAUSIBLE || self->strikes == 0) {
        self->seen_cause = (uint8_t)seen.cause;
        self->seen_leg = (uint8_t)seen.leg;
    }
    if (self->strikes >= (is_of_balance(seen.cause) ? FORCE_STRIKES : MOTION_STRIKES)) {
        self->fault = seen;
        self->hold = HOLD;
    } else if (self->hold > 0 && (has_moved || is_of_balance(self->fault.cause))) {
        self->hold--;
    }
    if (self->hold == 0) {
        self->fault = (hexload_input_fault_t){HEXLOAD_INPUT_PLAUSIBLE, NO_LEG};
    }
}

/// The next window: on with the leg that has a fault, or has a gain that is off, else with the next one.
static void begin_window(hexload_plausibility_t* self) {
    if (self->motion_cause == HEXLOAD_INPUT_PLAUSIBLE) {
        const bool has_reason = self->worst != NO_LEG && self->worst != self->turn;
        self->round = (uint8_t)(has_reason ? self->round : (self->round + 1) % HEXLOAD_LEGS);
        self->turn = has_reason ? self->worst : self->round;
    }
    for (int n = 0; n < HEXLOAD_LEGS; n++) {
        hexload_plausibility_leg_t* leg = &self->leg[n];
        leg->shown_m = HEXLOAD_REAL(0.0);
        leg->integral_m = HEXLOAD_REAL(0.0);
        leg->product_m2 = HEXLOAD_REAL(0.0);
        leg->integral_m2 = HEXLOAD_REAL(0.0);
        leg->force_n = HEXLOAD_REAL(0.0);
    }
    memset(&self->look, 0, sizeof self->look);
    memset(self->wrench, 0, sizeof self->wrench);
    self->repeated = 0;
    self->stuck_forces = 0;
    self->blocks = 0;
}

/// One stage of what is to do after a window's end.
static void evaluate(hexload_plausibility_t* self, const hexload_config_t* config,
                     const hexload_present_tick_t* now, hexload_real_t late_s) {
    const bool has_velocity = config->sensors.half_window_ticks == 0;
    if (self->stage <= SCREEN_END && has_velocity) {
        screen(self, config, &now->sensors, self->stage - 1);
    } else if (self->stage == LOOK && has_velocity) {
        look(self, config, &now->sensors, late_s);
    } else if (self->stage == BALANCE && config->gravity_m_s2 > HEXLOAD_REAL(0.0)) {
        balance(self, config, now->motion);
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
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        self->leg[leg].velocities = hexload_fma((hexload_real_t)now->gap_ticks,
                                                now->sample->velocity_m_s[leg], self->leg[leg].velocities);
    }
    self->ticks = (uint16_t)(self->ticks + now->gap_ticks);
    if (self->stage > 0) {
        evaluate(self, config, now, late_s);
    } else if (self->ticks >= BLOCK_TICKS) {
        note_stuck_forces(self, config, sample);
        close_block(self, config, now);
    }
    if (self->ticks >= BLOCK_TICKS) {
        begin_block(self, now->sample);
    }
}

void hexload_plausibility_judge(const hexload_plausibility_t* self, int parameters,
                                hexload_estimate_t* estimate, hexload_input_fault_t* fault,
                                uint32_t* health) {
    *fault = self->fault;
    if (self->fault.cause == HEXLOAD_INPUT_PLAUSIBLE) {
        return;
    }
    for (int k = 0; k < parameters; k++) {
        estimate->parameter_verdict[k] = HEXLOAD_VERDICT_INCONSISTENT;
    }
    estimate->verdict = HEXLOAD_VERDICT_INCONSISTENT;
    hexload_health_set(health, HEXLOAD_HEALTH_INCONSISTENT);
    hexload_health_set(health, HEXLOAD_HEALTH_INPUT_IMPLAUSIBLE);
}
