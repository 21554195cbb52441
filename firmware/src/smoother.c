#include "hexload/smoother.h"

#include <string.h>

/// A displacement's step, 2^-26 m: 15 nm, and a range of 32 m. Powers of two lose nothing in floating point.
#define STEPS_PER_M HEXLOAD_REAL(67108864.0)

#define CHI_SQUARE_6_95 HEXLOAD_REAL(12.59)

/// A multiple of both rings' sizes.
enum { ONE_ROUND = HEXLOAD_WINDOW_CAPACITY * HEXLOAD_DELAY_CAPACITY };

enum { THIRD_ON_FIRST, FIFTH_ON_FIRST, FIFTH_ON_THIRD };

/// The binomial coefficients C(n, 0..5) of any whole n, modulo 2^64, from those of 0 by additions alone: up
/// by C(n + 1, k) = C(n, k) + C(n, k - 1), down by its inverse.
static void make_binomials(int32_t n, uint64_t binomial[HEXLOAD_SMOOTHER_ORDERS]) {
    memset(binomial, 0, HEXLOAD_SMOOTHER_ORDERS * sizeof binomial[0]);
    binomial[0] = 1;
    for (int32_t i = 0; i < n; i++) {
        for (int k = HEXLOAD_SMOOTHER_ORDERS - 1; k > 0; k--) {
            binomial[k] += binomial[k - 1];
        }
    }
    for (int32_t i = 0; i > n; i--) {
        for (int k = 1; k < HEXLOAD_SMOOTHER_ORDERS; k++) {
            binomial[k] -= binomial[k - 1];
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

static void make_polynomials(hexload_smoother_constants_t* constants, const hexload_config_t* config) {
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
        const hexload_real_t sigma_m_s = config->sensors.displacement_sigma_m * slope[m] / config->tick_s;
        constants->slope[m] = slope[m] / (config->tick_s * both_sides * STEPS_PER_M);
        constants->inverse_variance[m] = both_sides / (sigma_m_s * sigma_m_s);
    }
}

void hexload_smoother_init(hexload_smoother_t* self, const hexload_config_t* config) {
    memset(self, 0, sizeof *self);
    hexload_smoother_constants_t* constants = &self->constants;
    constants->lag_ticks = config->momentum.lag_ticks;
    const int32_t lag = (int32_t)constants->lag_ticks;
    make_binomials(2 * lag + 1, constants->entering);
    for (int h = 0; h < 3; h++) { // Vandermonde: C(i - lag + h, 2 h + 1) from the C(i, n)
        uint64_t shift[HEXLOAD_SMOOTHER_ORDERS];
        make_binomials(h - lag, shift);
        for (int n = 0; n <= 2 * h + 1; n++) {
            constants->central[h][n] = shift[2 * h + 1 - n];
        }
    }
    make_polynomials(constants, config);
}

/// The cubic with these ends: where it is at `share` of the way.
static hexload_real_t hermite(hexload_real_t share, hexload_real_t from, hexload_real_t to,
                              hexload_real_t from_slope, hexload_real_t to_slope) {
    const hexload_real_t rest = HEXLOAD_REAL(1.0) - share;
    return from + (to - from) * share * share * (HEXLOAD_REAL(3.0) - HEXLOAD_REAL(2.0) * share) +
           share * rest * (from_slope * rest - to_slope * share);
}

static void store(hexload_smoother_t* self, const hexload_real_t displacement_m[HEXLOAD_LEGS],
                  const hexload_leg_sample_t* sample, bool is_missing) {
    const hexload_real_t farthest_m = HEXLOAD_REAL(31.0);
    const uint32_t at = self->stored % HEXLOAD_DELAY_CAPACITY;
    int32_t* steps = self->steps[self->stored % HEXLOAD_WINDOW_CAPACITY];
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        const hexload_real_t bounded_m =
            hexload_max(hexload_min(displacement_m[leg], farthest_m), -farthest_m);
        steps[leg] = (int32_t)(bounded_m * STEPS_PER_M);
        self->velocity_m_s[at][leg] = sample->velocity_m_s[leg];
        self->force_n[at][leg] = sample->force_n[leg];
    }
    self->is_missing[at] = is_missing;
    self->stored++;
}

static void bridge(hexload_smoother_t* self, const hexload_config_t* config,
                   const hexload_leg_sample_t* sample, uint32_t gap_ticks) {
    const int32_t* last_steps = self->steps[(self->stored - 1) % HEXLOAD_WINDOW_CAPACITY];
    const hexload_real_t* last_m_s = self->velocity_m_s[(self->stored - 1) % HEXLOAD_DELAY_CAPACITY];
    const hexload_real_t gap_s = config->tick_s * (hexload_real_t)gap_ticks;
    hexload_real_t from_m[HEXLOAD_LEGS];
    hexload_real_t from_slope_m[HEXLOAD_LEGS];
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        from_m[leg] = (hexload_real_t)last_steps[leg] / STEPS_PER_M;
        from_slope_m[leg] = gap_s * last_m_s[leg];
    }
    for (uint32_t tick = 1; tick < gap_ticks; tick++) {
        const hexload_real_t share = (hexload_real_t)tick / (hexload_real_t)gap_ticks;
        hexload_real_t between_m[HEXLOAD_LEGS];
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            between_m[leg] = hermite(share, from_m[leg], sample->displacement_m[leg], from_slope_m[leg],
                                     gap_s * sample->velocity_m_s[leg]);
        }
        store(self, between_m, sample, true);
    }
}

static uint32_t window_ticks(const hexload_smoother_t* self) {
    return 2 * self->constants.lag_ticks + 1;
}

static void begin_anew(hexload_smoother_t* self) {
    memset(self->sum, 0, sizeof self->sum);
    self->stored = 0;
    self->entered = 0;
    self->gap_ticks = 0;
    self->has_taken = false;
}

bool hexload_smoother_put(hexload_smoother_t* self, const hexload_config_t* config,
                          const hexload_leg_sample_t* sample, uint32_t gap_ticks) {
    const uint32_t waiting = self->stored - self->entered;
    const bool goes_on = self->stored > 0 && gap_ticks <= config->momentum.longest_gap_ticks &&
                         waiting + gap_ticks <= HEXLOAD_MISSING_TICKS_MAX;
    if (!goes_on) {
        begin_anew(self);
    } else {
        bridge(self, config, sample, gap_ticks);
    }
    store(self, sample->displacement_m, sample, false);
    if (!goes_on) {
        self->middle_tick = sample->tick - self->constants.lag_ticks - 1;
    }
    return goes_on;
}

/// Moves the window on by a tick: C(i - 1, n) = C(i, n) - C(i - 1, n - 1).
static void enter(hexload_smoother_t* self) {
    static const int32_t nothing[HEXLOAD_LEGS] = {0};
    const uint32_t window = window_ticks(self);
    const int32_t* in = self->steps[self->entered % HEXLOAD_WINDOW_CAPACITY];
    const int32_t* out =
        self->entered < window ? nothing : self->steps[(self->entered - window) % HEXLOAD_WINDOW_CAPACITY];
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        const uint64_t x = (uint64_t)(int64_t)in[leg];
        uint64_t lower = self->sum[0][leg] + x - (uint64_t)(int64_t)out[leg];
        self->sum[0][leg] = lower;
        for (int n = 1; n < HEXLOAD_SMOOTHER_ORDERS; n++) {
            lower = self->sum[n][leg] - lower + self->constants.entering[n] * x;
            self->sum[n][leg] = lower;
        }
    }
    self->entered++;
    self->middle_tick++;
    if (self->entered > 2 * ONE_ROUND) { // long before it could wrap; the places in the rings stay
        self->entered -= ONE_ROUND;
        self->stored -= ONE_ROUND;
    }
}

/// A signed sum as a number, by its halves: the conversion of 64 bits would be a call of a library.
static hexload_real_t to_real(uint64_t sum) {
    return (hexload_real_t)(int32_t)(sum >> 32) * HEXLOAD_REAL(4294967296.0) + (hexload_real_t)(uint32_t)sum;
}

static void fit_slopes(const hexload_smoother_t* self, hexload_real_t velocity_m_s[HEXLOAD_LEGS]) {
    const hexload_smoother_constants_t* constants = &self->constants;
    hexload_real_t part[3][HEXLOAD_LEGS];
    hexload_real_t q[3] = {0};
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        hexload_real_t odd[3];
        for (int h = 0; h < 3; h++) {
            uint64_t sum = 0;
            for (int n = 0; n < 2 * h + 2; n++) {
                sum += constants->central[h][n] * self->sum[n][leg];
            }
            odd[h] = to_real(sum);
        }
        odd[1] -= constants->project[THIRD_ON_FIRST] * odd[0];
        odd[2] -= constants->project[FIFTH_ON_FIRST] * odd[0] + constants->project[FIFTH_ON_THIRD] * odd[1];
        for (int m = 0; m < 3; m++) {
            part[m][leg] = constants->slope[m] * odd[m];
            q[m] += part[m][leg] * part[m][leg] * constants->inverse_variance[m];
        }
    }
    const hexload_real_t third = hexload_max(HEXLOAD_REAL(0.0), HEXLOAD_REAL(1.0) - CHI_SQUARE_6_95 / q[1]);
    const hexload_real_t fifth = hexload_max(HEXLOAD_REAL(0.0), HEXLOAD_REAL(1.0) - CHI_SQUARE_6_95 / q[2]);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        velocity_m_s[leg] = part[0][leg] + third * part[1][leg] + fifth * part[2][leg];
    }
}

static void read_middle(hexload_smoother_t* self, hexload_smooth_sample_t* out) {
    const uint32_t middle = self->entered - 1 - self->constants.lag_ticks;
    const int32_t* steps = self->steps[middle % HEXLOAD_WINDOW_CAPACITY];
    const uint32_t at = middle % HEXLOAD_DELAY_CAPACITY;
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        out->sample.displacement_m[leg] = (hexload_real_t)steps[leg] / STEPS_PER_M;
        out->sample.velocity_m_s[leg] = self->velocity_m_s[at][leg];
        out->sample.force_n[leg] = self->force_n[at][leg];
    }
    out->sample.tick = self->middle_tick;
    fit_slopes(self, out->smooth_velocity_m_s);
}

bool hexload_smoother_take(hexload_smoother_t* self, hexload_smooth_sample_t* out) {
    while (self->entered != self->stored) {
        enter(self);
        if (self->entered < window_ticks(self)) {
            continue;
        }
        self->gap_ticks++;
        const uint32_t middle = self->entered - 1 - self->constants.lag_ticks;
        if (!self->is_missing[middle % HEXLOAD_DELAY_CAPACITY]) {
            read_middle(self, out);
            out->gap_ticks = self->has_taken ? self->gap_ticks : 0;
            self->has_taken = true;
            self->gap_ticks = 0;
            return true;
        }
    }
    return false;
}
