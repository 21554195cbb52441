#include "momentum/wrench_monitor.h"

#include "algebra/linalg.h"
#include "momentum/momentum_model.h"
#include "rig/rig_friction.h"

#include <string.h>

#define BIN_S HEXLOAD_REAL(0.05)
#define LEARNING_S HEXLOAD_REAL(10.0)

/// Motion before which nothing is known of the machine's errors.
#define ARMED_S HEXLOAD_REAL(4.0)

/// Chi-square with 3 degrees of freedom: 8e-11 of a normal y are beyond. A y that is not normal has been seen
/// at 23.
#define ALARM HEXLOAD_REAL(50.0)

/// Least standard deviation of y: a share of the weight, at the platform's hinges for the moments.
#define LEAST_SHARE HEXLOAD_REAL(0.005)

/// The same on a commissioned machine as it begins to move: what commissioning has left is less. As its own
/// past is known, up to ARMED_S of it, it fades to the least.
#define EARLY_SHARE HEXLOAD_REAL(0.05)

/// Of the square of friction: a leg's is off by twice the whole at most, and the errors of six cannot add up
/// to more than 4 6 / (1 / 2) = 48 of chi-square, below the alarm.
#define FRICTION_SHARE HEXLOAD_REAL(0.5)

/// On a machine that does not fit its model estimates take longer than their sigmas say.
#define DOUBTFUL_S HEXLOAD_REAL(2.0)

enum { DIM = HEXLOAD_LOAD_DIM, PARTS = HEXLOAD_WRENCH_PARTS, SQUARES = HEXLOAD_WRENCH_SQUARES };

void hexload_wrench_monitor_init(hexload_wrench_monitor_t* self) {
    memset(self, 0, sizeof *self);
}

void hexload_wrench_monitor_restart(hexload_wrench_monitor_t* self) {
    memset(self->residual, 0, sizeof self->residual);
    memset(self->lasting, 0, sizeof self->lasting);
    memset(self->filling, 0, sizeof self->filling);
    self->filling_peak = HEXLOAD_REAL(0.0);
    self->bins = 0;
    self->filled_s = HEXLOAD_REAL(0.0);
    self->last_square = HEXLOAD_REAL(0.0);
    self->ticks = 0;
}

/// y among the six parts of a wrench about O_A.
enum { FIRST = 2 };

/// Moves r on by a tick.
static void observe(hexload_wrench_monitor_t* self, const hexload_config_t* config,
                    const hexload_push_t* push) {
    const hexload_real_t rate_1_s = HEXLOAD_REAL(1.0) / config->tick_s;
    hexload_real_t rate[6]; // of mu, without the known wrench
    hexload_real_t missing[6];
    for (int a = 0; a < 6; a++) {
        const hexload_real_t change =
            push->momentum[a] - push->momentum_of_change[a] - self->last_momentum[a];
        rate[a] = rate_1_s * (change - push->impulse[a]);
        self->last_momentum[a] = push->momentum[a];
    }
    hexload_momentum_move_point(push->motion, rate, missing);
    const hexload_real_t share = config->tick_s / HEXLOAD_WRENCH_MEMORY_S;
    const hexload_real_t lasting_share = config->tick_s / HEXLOAD_WRENCH_LASTING_S;
    for (int i = 0; i < 6; i++) {
        self->residual[i] += share * (missing[i] - self->residual[i]);
        self->lasting[i] += lasting_share * (self->residual[i] - self->lasting[i]);
    }
}

/// Components of a wrench that y is made of: all but M_z.
enum { READ = 5 };

/// Of hexload_momentum_move_point() the parts of y beside F_z, for the many rows of a spread.
static hexload_real_t about_x(const hexload_real_t p_m[3], const hexload_real_t wrench[READ]) {
    return wrench[3] - (p_m[1] * wrench[2] - p_m[2] * wrench[1]);
}

static hexload_real_t about_y(const hexload_real_t p_m[3], const hexload_real_t wrench[READ]) {
    return wrench[4] - (p_m[2] * wrench[0] - p_m[0] * wrench[2]);
}

/// Of y y^T, what theta's errors make of it, the lower triangle: of a leaky mean the square is no more than
/// the mean of the squares.
static void read_unknown(const hexload_push_t* seen, hexload_real_t spread[PARTS][PARTS]) {
    const hexload_real_t* p_m = seen->motion->p_m;
    hexload_real_t of_y[PARTS][READ];
    for (int a = 0; a < READ; a++) {
        hexload_real_t row[READ];
        for (int b = 0; b < READ; b++) {
            row[b] = seen->unknown[b <= a ? a : b][b <= a ? b : a];
        }
        of_y[0][a] = row[2];
        of_y[1][a] = about_x(p_m, row);
        of_y[2][a] = about_y(p_m, row);
    }
    for (int i = 0; i < PARTS; i++) {
        spread[i][0] = seen->unknown_scale * of_y[i][2];
    }
    spread[1][1] = seen->unknown_scale * about_x(p_m, of_y[1]);
    spread[2][1] = seen->unknown_scale * about_x(p_m, of_y[2]);
    spread[2][2] = seen->unknown_scale * about_y(p_m, of_y[2]);
}

/// Where a leg is slow all of its friction may be wrong, and for as long as it is: by no past of moving legs
/// is that known.
static void observe_open(hexload_wrench_monitor_t* self, const hexload_config_t* config,
                         const hexload_push_t* seen) {
    const hexload_real_t whole =
        FRICTION_SHARE / (hexload_rig_unknown_ticks(config) * RIG_UNKNOWN_SHARE * RIG_UNKNOWN_SHARE);
    const hexload_real_t share = config->tick_s / HEXLOAD_WRENCH_MEMORY_S;
    hexload_real_t spread[PARTS][PARTS];
    read_unknown(seen, spread);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        const hexload_real_t* push = &seen->motion->J[leg][2]; // F_z, M_x, M_y
        const hexload_real_t variance_n2 = whole * seen->variance_n2[leg];
        for (int i = 0; i < PARTS; i++) {
            const hexload_real_t scaled = variance_n2 * push[i];
            for (int j = 0; j <= i; j++) {
                spread[i][j] = hexload_fma(scaled, push[j], spread[i][j]);
            }
        }
    }
    for (int i = 0; i < PARTS; i++) {
        for (int j = 0; j <= i; j++) {
            self->open[ROW(i) + j] += share * (spread[i][j] - self->open[ROW(i) + j]);
        }
    }
}

/// Least variances of y: of a share of the weight.
static void find_least(const hexload_config_t* config, const hexload_real_t body[DIM],
                       hexload_real_t least[PARTS]) {
    const hexload_real_t* a = config->geometry.platform_hinge_m[0];
    const hexload_real_t least_n = LEAST_SHARE * config->gravity_m_s2 * body[HEXLOAD_LOAD_M];
    least[0] = least_n * least_n;
    least[1] = least[0] * dot3(a, a);
    least[2] = least[1];
}

/// What of y counts for C: the share of its variance that is not open. Of a y with the covariance O + C that
/// is C. An error that was open, of slow legs or of a new load, shall not hide a load for the next 10 s.
static void take_own(const hexload_wrench_monitor_t* self, const hexload_real_t least[PARTS],
                     hexload_real_t own[PARTS]) {
    for (int i = 0; i < PARTS; i++) {
        const hexload_real_t open = hexload_max(self->open[ROW(i) + i], HEXLOAD_REAL(0.0));
        const hexload_real_t closed = self->mean_square[ROW(i) + i] + least[i];
        own[i] = self->residual[FIRST + i] * hexload_sqrt(closed / (closed + open));
    }
}

/// A bin goes to C when as many as there are have followed it: a change that is being detected shall not
/// excuse itself.
static void learn(hexload_wrench_monitor_t* self, const hexload_config_t* config,
                  const hexload_real_t y[PARTS]) {
    const hexload_real_t share = config->tick_s / BIN_S;
    hexload_real_t* oldest = self->bin[self->next_bin];
    for (int i = 0; i < PARTS; i++) {
        for (int j = 0; j <= i; j++) {
            self->filling[ROW(i) + j] += share * y[i] * y[j];
        }
    }
    self->filled_s += config->tick_s;
    if (self->filled_s < BIN_S) {
        return;
    }
    if (self->bins == HEXLOAD_WRENCH_BINS) {
        self->motion_s = hexload_min(self->motion_s + BIN_S, LEARNING_S);
        self->peak =
            hexload_max(self->bin_peak[self->next_bin], self->peak - BIN_S / LEARNING_S * self->peak);
        for (int k = 0; k < SQUARES; k++) {
            self->mean_square[k] += BIN_S / self->motion_s * (oldest[k] - self->mean_square[k]);
        }
    }
    memcpy(oldest, self->filling, sizeof self->filling);
    self->bin_peak[self->next_bin] = self->filling_peak;
    self->filling_peak = HEXLOAD_REAL(0.0);
    memset(self->filling, 0, sizeof self->filling);
    self->next_bin = (uint8_t)((self->next_bin + 1U) % (uint32_t)HEXLOAD_WRENCH_BINS);
    self->bins = (uint8_t)(self->bins + ((self->bins < HEXLOAD_WRENCH_BINS) ? 1 : 0));
    self->filled_s = HEXLOAD_REAL(0.0);
}

/// y^T S^-1 y, S of what is open, of C and of the least, as many times as that.
static hexload_real_t distance(const hexload_wrench_monitor_t* self, const hexload_real_t least[PARTS],
                               hexload_real_t times) {
    hexload_real_t S[3][3];
    hexload_real_t L[3][3];
    hexload_real_t x[3];
    for (int i = 0; i < PARTS; i++) {
        for (int j = 0; j <= i; j++) {
            S[i][j] = self->open[ROW(i) + j] + self->mean_square[ROW(i) + j];
        }
        S[i][i] += times * least[i];
    }
    if (!hexload_cholesky3(S, L)) {
        return HEXLOAD_REAL(0.0);
    }
    forward_substitute3(L, &self->residual[FIRST], x);
    return dot3(x, x);
}

/// Whether y is beyond what the machine has shown. The peaks were measured by the least share: by a larger
/// one they are as much smaller.
/// @param is_known what the machine's errors can be, of one that is commissioned, or that has not moved yet
/// and rests, whose errors are constant.
/// @param square of this tick or the last one, whichever is smaller: a speed that is wrong once moves r for
/// one tick, a load for as long as it is there.
static bool is_beyond_past(const hexload_wrench_monitor_t* self, const hexload_real_t least[PARTS],
                           bool is_known, hexload_real_t square) {
    if (self->motion_s >= ARMED_S) {
        return square > hexload_max(ALARM, HEXLOAD_REAL(2.0) * self->peak);
    }
    const hexload_real_t share =
        hexload_fma((LEAST_SHARE - EARLY_SHARE) / ARMED_S, self->motion_s, EARLY_SHARE);
    const hexload_real_t times = share * share / (LEAST_SHARE * LEAST_SHARE);
    return is_known && (square > ALARM) &&
           (distance(self, least, times) > hexload_max(ALARM, HEXLOAD_REAL(2.0) * self->peak / times));
}

bool hexload_wrench_monitor_step(hexload_wrench_monitor_t* self, const hexload_config_t* config,
                                 const hexload_momentum_filter_t* filter, hexload_fit_t fit,
                                 const hexload_push_t* push) {
    hexload_real_t body[DIM];
    hexload_real_t least[PARTS];
    if (self->ticks++ == 0) {
        memcpy(self->last_momentum, push->momentum, sizeof self->last_momentum);
        return false;
    }
    hexload_momentum_filter_body(filter, body);
    find_least(config, body, least);
    observe(self, config, push);
    observe_open(self, config, push);
    const hexload_real_t since_s = config->tick_s * (hexload_real_t)self->ticks;
    const bool is_settled =
        self->ticks > hexload_settling_ticks(config) && (fit != HEXLOAD_FIT_NONE || since_s > DOUBTFUL_S);
    const bool is_asked = is_settled && fit > HEXLOAD_FIT_NOISE;
    self->ticks = (uint16_t)(self->ticks - ((self->ticks == UINT16_MAX) ? 1 : 0));
    bool is_wrong = false;
    hexload_real_t now = HEXLOAD_REAL(0.0);
    if (is_asked) {
        now = distance(self, least, HEXLOAD_REAL(1.0));
        const hexload_real_t square = hexload_min(now, self->last_square);
        self->filling_peak = hexload_max(self->filling_peak, square);
        const bool has_not_moved = !push->is_moving && (self->motion_s <= HEXLOAD_REAL(0.0));
        const bool is_known = (config->rig.direction_count > 0U) || has_not_moved;
        is_wrong = is_beyond_past(self, least, is_known, square);
    }
    self->last_square = now;
    if (push->is_moving) {
        hexload_real_t own[PARTS];
        take_own(self, least, own);
        learn(self, config, own);
    }
    return is_wrong;
}
