#include "momentum/smoother.h"

#include "algebra/chi_square.h"
#include "momentum/motion_directions.h"
#include "momentum/transient.h"

#include <string.h>

/// A displacement's step, 2^-26 m: 15 nm, and a range of 32 m. Powers of two lose nothing in floating point.
#define STEPS_PER_M HEXLOAD_REAL(67108864.0)

/// A multiple of all rings' sizes.
enum { ONE_ROUND = HEXLOAD_WINDOW_CAPACITY * HEXLOAD_DELAY_CAPACITY * HEXLOAD_FORCE_CAPACITY };

_Static_assert((int)HEXLOAD_LAG_TICKS_MAX >= (int)HEXLOAD_TRANSIENT_TICKS, "the lag covers the ticks after");

/// Steps to a speed and back, multiplied, beyond which it is an outlier: 60 sigma each, more than 0.3 m/s
/// that ring at 95 Hz.
#define OUTLIER_SIGMAS_SQUARE HEXLOAD_REAL(3600.0)

enum { THIRD_ON_FIRST, FIFTH_ON_FIRST, FIFTH_ON_THIRD };

/// The sums count tick j of the window, from -lag to lag, with C(j + h - 1, 2 h) and C(j + h, 2 h + 1), in
/// turn for h = 0, 1, 2: the odd ones are odd in j. When the window moves on, each j falls by one; by
/// Pascal's rule each sum then loses that before it, from before or after the move.
static void move_on(uint64_t sum[HEXLOAD_SMOOTHER_ORDERS]) {
    const uint64_t second = sum[2];
    const uint64_t fourth = sum[4];
    sum[1] -= sum[0];
    sum[2] -= sum[1];
    sum[3] -= second;
    sum[4] -= sum[3];
    sum[5] -= fourth;
}

/// Weights of the two ends of the window, from those of j = 0 by moving on; C(-j + h - 1, 2 h) is that of j
/// + 1.
HEXLOAD_RARE static void make_weights(hexload_smoother_constants_t* constants) {
    uint64_t weight[HEXLOAD_SMOOTHER_ORDERS] = {1};
    for (uint32_t j = 0; j < constants->lag_ticks; j++) {
        for (int n = 0; n < HEXLOAD_SMOOTHER_ORDERS; n += 2) {
            constants->entering[n] = (int32_t)weight[n];
        }
        move_on(weight);
    }
    for (int n = 0; n < HEXLOAD_SMOOTHER_ORDERS; n++) {
        constants->leaving[n] = (int32_t)(uint32_t)weight[n];
        if (n % 2 == 1) {
            constants->entering[n] = -constants->leaving[n];
        }
    }
}

/// C(j + h, 2 h + 1): odd in j, of degree 1, 3, 5 for h = 0, 1, 2.
static void odd_polynomials(int32_t j, hexload_real_t p[3]) {
    const hexload_real_t x = (hexload_real_t)j;
    const hexload_real_t square = x * x;
    p[0] = x;
    p[1] = p[0] * (square - HEXLOAD_REAL(1.0)) / HEXLOAD_REAL(6.0);
    p[2] = p[1] * (square - HEXLOAD_REAL(4.0)) / HEXLOAD_REAL(20.0);
}

HEXLOAD_RARE static void make_polynomials(hexload_smoother_constants_t* constants,
                                          const hexload_config_t* config) {
    static const hexload_real_t slope_at_0[3] = {HEXLOAD_REAL(1.0), -HEXLOAD_REAL(1.0) / HEXLOAD_REAL(6.0),
                                                 HEXLOAD_REAL(1.0) / HEXLOAD_REAL(30.0)};
    const int32_t lag = (int32_t)constants->lag_ticks;
    hexload_real_t* project = constants->project;
    hexload_real_t square[3] = {0};
    hexload_real_t p[3];
    // Gram and Schmidt, one polynomial after the other: the sums of the next need the projection of the last.
    for (int32_t j = 1; j <= lag; j++) {
        odd_polynomials(j, p);
        square[0] += p[0] * p[0];
        project[THIRD_ON_FIRST] += p[0] * p[1];
        project[FIFTH_ON_FIRST] += p[0] * p[2];
    }
    project[THIRD_ON_FIRST] /= square[0];
    project[FIFTH_ON_FIRST] /= square[0];
    for (int32_t j = 1; j <= lag; j++) {
        odd_polynomials(j, p);
        p[1] -= project[THIRD_ON_FIRST] * p[0];
        square[1] += p[1] * p[1];
        project[FIFTH_ON_THIRD] += p[1] * p[2];
    }
    project[FIFTH_ON_THIRD] /= square[1];
    for (int32_t j = 1; j <= lag; j++) {
        odd_polynomials(j, p);
        p[1] -= project[THIRD_ON_FIRST] * p[0];
        p[2] -= project[FIFTH_ON_FIRST] * p[0] + project[FIFTH_ON_THIRD] * p[1];
        square[2] += p[2] * p[2];
    }
    const hexload_real_t slope[3] = {slope_at_0[0], slope_at_0[1] - project[THIRD_ON_FIRST],
                                     slope_at_0[2] - project[FIFTH_ON_FIRST] -
                                         project[FIFTH_ON_THIRD] * (slope_at_0[1] - project[THIRD_ON_FIRST])};
    for (int m = 0; m < 3; m++) {
        const hexload_real_t both_sides = HEXLOAD_REAL(2.0) * square[m];
        const hexload_real_t slope_1_s = slope[m] / config->tick_s;
        constants->slope[m] = slope[m] / (config->tick_s * both_sides * STEPS_PER_M);
        constants->inverse_gain[m] = both_sides / (slope_1_s * slope_1_s);
        constants->slope_gain += slope_1_s * slope_1_s / both_sides;
    }
}

HEXLOAD_RARE void hexload_smoother_init(hexload_smoother_t* self, const hexload_config_t* config) {
    memset(self, 0, sizeof *self);
    hexload_smoother_constants_t* constants = &self->constants;
    constants->lag_ticks = config->momentum.lag_ticks;
    make_weights(constants);
    make_polynomials(constants, config);
    hexload_motion_directions_init(&self->directions);
}

/// The cubic with these ends: where it is at `share` of the way.
static hexload_real_t hermite(hexload_real_t share, hexload_real_t from, hexload_real_t to,
                              hexload_real_t from_slope, hexload_real_t to_slope) {
    const hexload_real_t rest = HEXLOAD_REAL(1.0) - share;
    return from + (to - from) * share * share * (HEXLOAD_REAL(3.0) - HEXLOAD_REAL(2.0) * share) +
           share * rest * (from_slope * rest - to_slope * share);
}

static uint32_t bit_of(uint32_t place) {
    return (uint32_t)1 << (place % 32U);
}

static void leave_out(hexload_smoother_t* self, uint32_t place) {
    self->left_out[place / 32U] |= bit_of(place);
}

static void store(hexload_smoother_t* self, const hexload_leg_sample_t* sample, bool is_left_out) {
    const hexload_real_t farthest_m = HEXLOAD_REAL(31.0);
    const uint32_t at = self->stored % HEXLOAD_DELAY_CAPACITY;
    int32_t* steps = self->steps[self->stored % HEXLOAD_WINDOW_CAPACITY];
    hexload_real_t* force_n = self->force_n[self->stored % HEXLOAD_FORCE_CAPACITY];
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        const hexload_real_t bounded_m =
            hexload_max(hexload_min(sample->displacement_m[leg], farthest_m), -farthest_m);
        steps[leg] = (int32_t)(bounded_m * STEPS_PER_M);
        self->velocity_m_s[at][leg] = sample->velocity_m_s[leg];
        force_n[leg] = sample->force_n[leg];
    }
    self->left_out[at / 32U] &= ~bit_of(at);
    if (is_left_out) {
        leave_out(self, at);
    }
    self->stored++;
}

static hexload_real_t line(hexload_real_t share, hexload_real_t from, hexload_real_t to) {
    return hexload_fma(share, to - from, from);
}

HEXLOAD_RARE static void bridge(hexload_smoother_t* self, const hexload_config_t* config,
                                const hexload_present_tick_t* now) {
    const hexload_leg_sample_t* sample = now->sample;
    const uint32_t gap_ticks = now->gap_ticks;
    const uint32_t last = self->stored - 1;
    const uint32_t at = last % HEXLOAD_DELAY_CAPACITY;
    const int32_t* last_steps = self->steps[last % HEXLOAD_WINDOW_CAPACITY];
    const hexload_real_t* last_m_s = self->velocity_m_s[at];
    const hexload_real_t* last_n = self->force_n[last % HEXLOAD_FORCE_CAPACITY];
    const hexload_real_t gap_s = config->tick_s * (hexload_real_t)gap_ticks;
    hexload_leg_sample_t between = {0};
    for (uint32_t tick = 1; tick < gap_ticks; tick++) {
        const hexload_real_t share = (hexload_real_t)tick / (hexload_real_t)gap_ticks;
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            const hexload_real_t from_m = (hexload_real_t)last_steps[leg] / STEPS_PER_M;
            const hexload_real_t to_m_s = sample->velocity_m_s[leg];
            between.displacement_m[leg] =
                hermite(share, from_m, sample->displacement_m[leg], gap_s * last_m_s[leg], gap_s * to_m_s);
            between.velocity_m_s[leg] = line(share, last_m_s[leg], to_m_s);
            between.force_n[leg] = line(share, last_n[leg], sample->force_n[leg]);
        }
        store(self, &between, true);
    }
}

/// Leaves out the last tick when a speed of it stands out from those before and after it.
static void leave_out_outlier(hexload_smoother_t* self, const hexload_present_tick_t* now) {
    const hexload_leg_sample_t* next = now->sample;
    const hexload_real_t sigma_m_s = now->sensors.velocity_sigma_m_s;
    hexload_real_t largest = HEXLOAD_REAL(0.0);
    if (self->stored < 2) {
        return;
    }
    const uint32_t at = (self->stored - 1) % HEXLOAD_DELAY_CAPACITY;
    const hexload_real_t* outlier_m_s = self->velocity_m_s[at];
    const hexload_real_t* last_m_s = self->velocity_m_s[(self->stored - 2) % HEXLOAD_DELAY_CAPACITY];
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        const hexload_real_t product =
            (outlier_m_s[leg] - last_m_s[leg]) * (outlier_m_s[leg] - next->velocity_m_s[leg]);
        largest = hexload_max(largest, product);
    }
    if (largest > OUTLIER_SIGMAS_SQUARE * sigma_m_s * sigma_m_s) {
        leave_out(self, at);
    }
}

static uint32_t window_ticks(const hexload_smoother_t* self) {
    return 2 * self->constants.lag_ticks + 1;
}

HEXLOAD_RARE static void begin_anew(hexload_smoother_t* self) {
    memset(self->sum, 0, sizeof self->sum);
    self->stored = 0;
    self->entered = 0;
    self->has_taken = false;
    memset(self->held_m_s, 0, sizeof self->held_m_s);
}

static uint64_t times(int32_t weight, int32_t steps) {
    return (uint64_t)((int64_t)weight * steps);
}

/// Moves the window on by a tick.
static void enter(hexload_smoother_t* self) {
    static const int32_t nothing[HEXLOAD_LEGS] = {0};
    const uint32_t window = window_ticks(self);
    const int32_t* in = self->steps[self->entered % HEXLOAD_WINDOW_CAPACITY];
    const int32_t* out =
        self->entered < window ? nothing : self->steps[(self->entered - window) % HEXLOAD_WINDOW_CAPACITY];
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        uint64_t* sum = self->sum[leg];
        for (int n = 0; n < HEXLOAD_SMOOTHER_ORDERS; n++) {
            sum[n] += times(self->constants.leaving[n], -out[leg]);
        }
        move_on(sum);
        for (int n = 0; n < HEXLOAD_SMOOTHER_ORDERS; n++) {
            sum[n] += times(self->constants.entering[n], in[leg]);
        }
    }
    self->entered++;
    self->middle_tick++;
    if (self->entered > 2 * ONE_ROUND) { // long before it could wrap; the places in the rings stay
        self->entered -= ONE_ROUND;
        self->stored -= ONE_ROUND;
    }
}

/// Moves the window on by a tick, and tells whether its middle may be taken out.
static bool enter_next(hexload_smoother_t* self) {
    enter(self);
    const bool is_full = self->entered >= self->constants.lag_ticks + 1 + HEXLOAD_TRANSIENT_TICKS;
    self->gap_ticks += is_full ? 1U : 0U;
    return is_full;
}

/// Where more ticks are missing of late than a lag ago, those that wait grow in number. The oldest are then
/// left out, whether they were missing or not: to begin anew for want of room would cost a window.
static void make_room(hexload_smoother_t* self, uint32_t gap_ticks) {
    while (self->stored - self->entered + gap_ticks > HEXLOAD_MISSING_TICKS_MAX) {
        (void)enter_next(self);
    }
}

bool hexload_smoother_put(hexload_smoother_t* self, const hexload_config_t* config,
                          const hexload_present_tick_t* now) {
    const hexload_leg_sample_t* sample = now->sample;
    const bool goes_on = self->stored > 0 && now->gap_ticks <= config->momentum.longest_gap_ticks;
    if (!goes_on) {
        begin_anew(self);
    } else {
        make_room(self, now->gap_ticks);
        bridge(self, config, now);
    }
    leave_out_outlier(self, now);
    store(self, sample, false);
    if (!goes_on) {
        self->middle_tick = sample->tick - self->constants.lag_ticks - 1;
    }
    return goes_on;
}

/// A signed sum as a number, by its halves: the conversion of 64 bits would be a call of a library.
static hexload_real_t to_real(uint64_t sum) {
    return hexload_fma((hexload_real_t)(int32_t)(sum >> 32), HEXLOAD_REAL(4294967296.0),
                       (hexload_real_t)(uint32_t)sum);
}

/// Speeds from displacements err alike over a window: a mean over it has the variance of one of them, which
/// is ten times that of a mean of independent ones (transient.c).
static hexload_real_t transient_sigma(const hexload_sensors_t* sensors) {
    const bool is_white = sensors->half_window_ticks == 0;
    return (is_white ? HEXLOAD_REAL(1.0) : HEXLOAD_REAL(3.1622777)) * sensors->velocity_sigma_m_s;
}

static void fit_slopes(hexload_smoother_t* self, hexload_real_t sigma_m,
                       hexload_real_t velocity_m_s[HEXLOAD_LEGS]) {
    const hexload_smoother_constants_t* constants = &self->constants;
    const hexload_real_t of_displacement_1_m2 = HEXLOAD_REAL(1.0) / (sigma_m * sigma_m);
    hexload_real_t inverse_variance_s2_m2[3];
    hexload_real_t part[3][HEXLOAD_LEGS];
    hexload_real_t share[3];
    hexload_real_t q[3] = {0};
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        hexload_real_t odd[3];
        for (int h = 0; h < 3; h++) {
            odd[h] = to_real(self->sum[leg][2 * h + 1]);
        }
        odd[1] = hexload_fma(-constants->project[THIRD_ON_FIRST], odd[0], odd[1]);
        odd[2] = hexload_fma(-constants->project[FIFTH_ON_FIRST], odd[0], odd[2]);
        odd[2] = hexload_fma(-constants->project[FIFTH_ON_THIRD], odd[1], odd[2]);
        for (int m = 0; m < 3; m++) {
            part[m][leg] = constants->slope[m] * odd[m];
            q[m] = hexload_fma(part[m][leg], part[m][leg], q[m]);
        }
    }
    for (int m = 0; m < 3; m++) {
        inverse_variance_s2_m2[m] = constants->inverse_gain[m] * of_displacement_1_m2;
        share[m] = hexload_beyond_noise(q[m] * inverse_variance_s2_m2[m]);
    }
    hexload_motion_directions_learn(&self->directions, part[0], hexload_sqrt(inverse_variance_s2_m2[0]));
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        part[0][leg] *= share[0];
        part[1][leg] = hexload_fma(share[2], part[2][leg], share[1] * part[1][leg]);
    }
    hexload_motion_directions_keep(&self->directions, inverse_variance_s2_m2[0], part[0]);
    hexload_motion_directions_keep(&self->directions, inverse_variance_s2_m2[1], part[1]);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        velocity_m_s[leg] = part[0][leg] + part[1][leg];
    }
}

/// The forces whose trapezoids are the integral of those at the ticks: weights of f - D2 f / 12 + 11 D4 f /
/// 720.
static void read_forces(const hexload_smoother_t* self, uint32_t middle,
                        hexload_real_t force_n[HEXLOAD_LEGS]) {
    enum { ROWS = (2 * HEXLOAD_FORCE_NEIGHBOURS) + 1 };
    const hexload_real_t* row[ROWS];
    for (uint32_t k = 0; k < ROWS; k++) {
        row[k] = self->force_n[(middle + k - HEXLOAD_FORCE_NEIGHBOURS) % HEXLOAD_FORCE_CAPACITY];
    }
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        const hexload_real_t near_n = row[1][leg] + row[3][leg];
        const hexload_real_t far_n = row[0][leg] + row[4][leg];
        force_n[leg] = hexload_fma(HEXLOAD_FORCE_OWN, row[2][leg],
                                   hexload_fma(HEXLOAD_FORCE_NEAR, near_n, HEXLOAD_FORCE_FAR * far_n));
    }
}

static void read_middle(hexload_smoother_t* self, const hexload_sensors_t* sensors,
                        hexload_smooth_sample_t* out) {
    const uint32_t middle = self->entered - 1 - self->constants.lag_ticks;
    const int32_t* steps = self->steps[middle % HEXLOAD_WINDOW_CAPACITY];
    const uint32_t at = middle % HEXLOAD_DELAY_CAPACITY;
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        out->sample.displacement_m[leg] = (hexload_real_t)steps[leg] / STEPS_PER_M;
        out->sample.velocity_m_s[leg] = self->velocity_m_s[at][leg];
        out->force_variance_n2[leg] = HEXLOAD_REAL(0.0);
        out->leg_wrench[leg] = HEXLOAD_REAL(0.0);
        out->smooth_velocity_m_s[leg] = self->held_m_s[leg];
    }
    out->sample.tick = self->middle_tick;
    read_forces(self, middle, out->sample.force_n);
    if (self->entered >= window_ticks(self)) {
        fit_slopes(self, sensors->displacement_sigma_m, out->smooth_velocity_m_s);
    }
    hexload_transient_follow(self, at, transient_sigma(sensors), out->smooth_velocity_m_s);
    memcpy(self->held_m_s, out->smooth_velocity_m_s, sizeof self->held_m_s);
}

bool hexload_smoother_take(hexload_smoother_t* self, const hexload_sensors_t* sensors,
                           hexload_smooth_sample_t* out) {
    const uint32_t lag = self->constants.lag_ticks;
    while (self->entered != self->stored) {
        const bool is_full = enter_next(self);
        const uint32_t middle = self->entered - 1 - lag;
        if (is_full && !hexload_smoother_leaves_out(self, middle % HEXLOAD_DELAY_CAPACITY)) {
            read_middle(self, sensors, out);
            out->gap_ticks = self->has_taken ? self->gap_ticks : 0;
            self->has_taken = true;
            self->gap_ticks = 0;
            return true;
        }
    }
    return false;
}
