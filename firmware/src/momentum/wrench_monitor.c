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

/// y alone of hexload_momentum_move_point(), for the many rows of a spread.
static void read_parts(const hexload_motion_t* motion, const hexload_real_t wrench[READ],
                       hexload_real_t parts[PARTS]) {
    const hexload_real_t* p = motion->p_m;
    parts[0] = wrench[2];
    parts[1] = wrench[3] - (p[1] * wrench[2] - p[2] * wrench[1]);
    parts[2] = wrench[4] - (p[2] * wrench[0] - p[0] * wrench[2]);
}

/// Of y y^T, what theta's errors make of it: of a leaky mean the square is no more than the mean of the
/// squares.
static void read_unknown(const hexload_push_t* seen, hexload_real_t spread[PARTS][PARTS]) {
    hexload_real_t rows[READ][PARTS];
    for (int a = 0; a < READ; a++) {
        hexload_real_t row[READ];
        for (int b = 0; b < READ; b++) {
            row[b] = seen->unknown_scale * seen->unknown[b <= a ? a : b][b <= a ? b : a];
        }
        read_parts(seen->motion, row, rows[a]);
    }
    for (int i = 0; i < PARTS; i++) {
        const hexload_real_t column[READ] = {rows[0][i], rows[1][i], rows[2][i], rows[3][i], rows[4][i]};
        read_parts(seen->motion, column, spread[i]);
    }
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

/// What is open of y y^T, and C, with its floor: a share of the weight.
static void find_spread(const hexload_wrench_monitor_t* self, const hexload_config_t* config,
                        const hexload_real_t body[DIM], hexload_real_t share, hexload_real_t S[3][3]) {
    const hexload_real_t* a = config->geometry.platform_hinge_m[0];
    const hexload_real_t least_n = share * config->gravity_m_s2 * body[HEXLOAD_LOAD_M];
    const hexload_real_t least_n_m2 = least_n * least_n * dot3(a, a);
    for (int i = 0; i < PARTS; i++) {
        for (int j = 0; j <= i; j++) {
            S[i][j] = self->open[ROW(i) + j] + self->mean_square[ROW(i) + j];
        }
        S[i][i] += i == 0 ? least_n * least_n : least_n_m2;
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

/// y^T S^-1 y.
static hexload_real_t distance(const hexload_wrench_monitor_t* self, const hexload_config_t* config,
                               const hexload_real_t body[DIM], hexload_real_t share) {
    hexload_real_t S[3][3];
    hexload_real_t L[3][3];
    hexload_real_t x[3];
    find_spread(self, config, body, share, S);
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
static bool is_beyond_past(const hexload_wrench_monitor_t* self, const hexload_config_t* config,
                           const hexload_real_t body[DIM], bool is_known, hexload_real_t square) {
    if (self->motion_s >= ARMED_S) {
        return square > hexload_max(ALARM, HEXLOAD_REAL(2.0) * self->peak);
    }
    const hexload_real_t share =
        hexload_fma((LEAST_SHARE - EARLY_SHARE) / ARMED_S, self->motion_s, EARLY_SHARE);
    const hexload_real_t scale = LEAST_SHARE * LEAST_SHARE / (share * share);
    return is_known && (square > ALARM) &&
           (distance(self, config, body, share) > hexload_max(ALARM, HEXLOAD_REAL(2.0) * scale * self->peak));
}

bool hexload_wrench_monitor_step(hexload_wrench_monitor_t* self, const hexload_config_t* config,
                                 const hexload_momentum_filter_t* filter, hexload_fit_t fit,
                                 const hexload_push_t* push) {
    hexload_real_t body[DIM];
    if (self->ticks++ == 0) {
        memcpy(self->last_momentum, push->momentum, sizeof self->last_momentum);
        return false;
    }
    hexload_momentum_filter_body(filter, body);
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
        now = distance(self, config, body, LEAST_SHARE);
        const hexload_real_t square = hexload_min(now, self->last_square);
        self->filling_peak = hexload_max(self->filling_peak, square);
        const bool has_not_moved = !push->is_moving && (self->motion_s <= HEXLOAD_REAL(0.0));
        const bool is_known = (config->rig.direction_count > 0U) || has_not_moved;
        is_wrong = is_beyond_past(self, config, body, is_known, square);
    }
    self->last_square = now;
    if (push->is_moving) {
        learn(self, config, &self->residual[FIRST]);
    }
    return is_wrong;
}
