#include "momentum/jackknife.h"

#include "algebra/linalg.h"

#include <string.h>

enum {
    DIM = HEXLOAD_LOAD_DIM,
    MATRIX = HEXLOAD_LOAD_COVARIANCES,
    BLOCKS = HEXLOAD_JACKKNIFE_BLOCKS,
    FEWEST_BLOCKS = 4, ///< below, their spread says nothing
    HALF = 7,          ///< rows of a triangle with half of its entries
    FIRST_SWEPT = 5,   ///< rows that a step sweeps which reads the pivot's column too
};

/// Shortest block: errors of a motion and its friction last for tenths of a second.
#define BLOCK_S HEXLOAD_REAL(0.25)

/// What all parameters say together counts as that much more of each one's expectation, which is 1 less the
/// sum of its shares' squares: all of it where one block has all the information on a parameter. Of what they
/// say together, 9 at most, as much is as in the model beforehand.
#define POOLED HEXLOAD_REAL(0.25)

void hexload_jackknife_init(hexload_jackknife_t* self) {
    self->pooled = HEXLOAD_REAL(1.0);
    self->has_concluded = false;
    hexload_jackknife_forget(self);
}

void hexload_jackknife_forget(hexload_jackknife_t* self) {
    for (int b = 0; b < BLOCKS; b++) {
        self->order[b] = (uint8_t)b;
    }
    for (int k = 0; k < DIM; k++) {
        self->factor[k] = hexload_sqrt(hexload_jackknife_variance_scale(self));
    }
    self->blocks = 0;
    self->stage = HEXLOAD_JACKKNIFE_WAIT;
    self->step = 0;
    self->has_begun = false;
}

/// First row of each half, and the one after its last.
static const int HALVES[2][2] = {{0, HALF}, {HALF, DIM}};
static const int SWEPT[2][2] = {{0, FIRST_SWEPT}, {FIRST_SWEPT, DIM}};

/// y -= A x, A symmetric, its lower triangle by rows: what half of the rows, and they as columns, give of it.
static void take_product(const hexload_real_t A[MATRIX], const hexload_real_t x[DIM], const int rows[2],
                         hexload_real_t y[DIM]) {
    for (int i = rows[0]; i < rows[1]; i++) {
        const hexload_real_t* row = &A[ROW(i)];
        const hexload_real_t factor = -x[i];
        hexload_real_t sum = hexload_fma(row[i], factor, y[i]);
        for (int j = 0; j < i; j++) {
            sum = hexload_fma(-row[j], x[j], sum);
            y[j] = hexload_fma(row[j], factor, y[j]);
        }
        y[i] = sum;
    }
}

/// x^T A x.
static hexload_real_t square_form(const hexload_real_t A[MATRIX], const hexload_real_t x[DIM]) {
    hexload_real_t all = HEXLOAD_REAL(0.0);
    const hexload_real_t* row = A;
    for (int i = 0; i < DIM; i++) {
        hexload_real_t sum = HEXLOAD_REAL(0.5) * row[i] * x[i];
        for (int j = 0; j < i; j++) {
            sum = hexload_fma(row[j], x[j], sum);
        }
        all = hexload_fma(x[i], sum, all);
        row = &row[i + 1];
    }
    return HEXLOAD_REAL(2.0) * all;
}

static void read_column(const hexload_real_t A[MATRIX], int k, hexload_real_t column[DIM]) {
    for (int i = 0; i < DIM; i++) {
        column[i] = A[i >= k ? ROW(i) + k : ROW(k) + i];
    }
}

/// Gauss-Jordan on a symmetric matrix, in place, some of the rows at a time: after all pivots it is minus its
/// inverse (the sweep operator, Goodnight 1979). A pivot that rounding has left without a positive value
/// counts as one that is not known.
static void sweep(hexload_jackknife_t* self, int k, const int rows[2]) {
    hexload_real_t* A = self->work;
    hexload_real_t* column = self->column;
    if (rows[0] == 0) {
        read_column(A, k, column);
        self->pivot = column[k] > HEXLOAD_REAL(0.0) ? HEXLOAD_REAL(1.0) / column[k] : HEXLOAD_REAL(0.0);
        column[k] = HEXLOAD_REAL(-1.0);
        for (int i = 0; i < DIM; i++) {
            A[i >= k ? ROW(i) + k : ROW(k) + i] = HEXLOAD_REAL(0.0);
        }
    }
    for (int i = rows[0]; i < rows[1]; i++) {
        hexload_real_t* row = &A[ROW(i)];
        const hexload_real_t factor = -self->pivot * column[i];
        for (int j = 0; j <= i; j++) {
            row[j] = hexload_fma(factor, column[j], row[j]);
        }
    }
}

static void take_snapshot(hexload_jackknife_t* self, const hexload_momentum_filter_t* filter) {
    for (int i = 0; i < DIM; i++) {
        memcpy(&self->covariance[ROW(i)], filter->load_cov[i], (size_t)(i + 1) * sizeof self->covariance[0]);
        self->change[i] = filter->theta[i] - self->theta[i];
        self->theta[i] = filter->theta[i];
    }
    self->elapsed_ticks = 0;
}

/// What has come in since the last snapshot is a block, in the place after the others'.
static hexload_jackknife_block_t* newest(hexload_jackknife_t* self) {
    return &self->block[self->order[self->blocks]];
}

static void prepare(hexload_jackknife_t* self) {
    memcpy(self->work, self->covariance, sizeof self->work);
    memset(self->spread, 0, sizeof self->spread);
    memset(self->share, 0, sizeof self->share);
    memset(self->square, 0, sizeof self->square);
    memset(self->pair, 0, sizeof self->pair);
    memset(newest(self)->pull, 0, sizeof newest(self)->pull);
}

/// Its J is what Lambda has grown by. As its pull and those of all before add up to nothing, it is Lambda of
/// before times the change of theta, so far with the other sign. At first that is what was known beforehand,
/// and no block.
static void close_block(hexload_jackknife_t* self) {
    hexload_jackknife_block_t* block = newest(self);
    for (int i = 0; i < MATRIX; i++) {
        block->information[i] = -self->work[i] - self->information[i];
        self->information[i] = -self->work[i];
    }
    for (int k = 0; k < DIM; k++) {
        block->pull[k] = -block->pull[k];
    }
    if (self->has_begun) {
        self->blocks++;
    }
    self->has_begun = true;
}

/// What a block has moved parameter k by, its share in what is known of it, and whether it and the block
/// before have more of it together than of another.
static void compare(hexload_jackknife_t* self, int k, uint32_t b) {
    const hexload_jackknife_block_t* block = &self->block[self->order[b]];
    hexload_real_t moved = HEXLOAD_REAL(0.0);
    for (int i = 0; i < DIM; i++) {
        moved = hexload_fma(self->column[i], block->pull[i], moved);
    }
    const hexload_real_t share = square_form(block->information, self->column) * self->pivot;
    self->spread[k] = hexload_fma(moved * moved, self->pivot, self->spread[k]);
    self->share[k] += share;
    self->square[k] = hexload_fma(share, share, self->square[k]);
    if (b > 0) {
        self->pair[b - 1] = hexload_max(self->pair[b - 1], self->last_share + share);
    }
    self->last_share = share;
}

/// By how much sigma is too small: never too large, as few blocks may agree by chance. As they may differ by
/// chance too, the spread counts less by its standard deviation: else noise alone would widen sigma by 5 %.
/// Nothing is said of a parameter on which blocks have lost information, as shares whose squares add up to
/// more than they do show: what the filter adds against rounding takes some of a sum that is known far better
/// than its parts.
static void conclude(hexload_jackknife_t* self) {
    hexload_real_t own[DIM]; // what the blocks should move a parameter by
    hexload_real_t spread = POOLED;
    hexload_real_t expected = POOLED;
    for (int k = 0; k < DIM; k++) {
        own[k] = hexload_max(self->share[k] - self->square[k], HEXLOAD_REAL(0.0));
        self->spread[k] = (own[k] > HEXLOAD_REAL(0.0)) ? self->spread[k] : HEXLOAD_REAL(0.0);
        spread += self->spread[k];
        expected += own[k];
    }
    self->pooled = spread / expected;
    self->has_concluded = true;
    for (int k = 0; k < DIM; k++) {
        const hexload_real_t chance = hexload_sqrt(HEXLOAD_REAL(2.0) * self->square[k] * own[k]);
        const hexload_real_t square = (self->spread[k] + POOLED * self->pooled - chance) / (own[k] + POOLED);
        self->factor[k] = hexload_sqrt(hexload_max(square, HEXLOAD_REAL(1.0)));
    }
}

/// Makes room: the two neighbours that have the least together become one.
static void join_blocks(hexload_jackknife_t* self) {
    uint32_t at = 0;
    for (uint32_t b = 1; b + 1 < self->blocks; b++) {
        at = self->pair[b] < self->pair[at] ? b : at;
    }
    const uint8_t freed = self->order[at + 1];
    hexload_jackknife_block_t* block = &self->block[self->order[at]];
    for (int i = 0; i < MATRIX; i++) {
        block->information[i] += self->block[freed].information[i];
    }
    for (int k = 0; k < DIM; k++) {
        block->pull[k] += self->block[freed].pull[k];
    }
    self->blocks--;
    for (uint32_t b = at + 1; b < self->blocks; b++) {
        self->order[b] = self->order[b + 1];
    }
    self->order[self->blocks] = freed;
}

/// One step of a stage. @return the steps that the stage has.
static uint32_t take_step(hexload_jackknife_t* self, uint32_t step) {
    const uint32_t round = self->blocks + 1;
    const int* rows = HALVES[step % 2];
    switch (self->stage) {
    case HEXLOAD_JACKKNIFE_PREPARE:
        prepare(self);
        return 1;
    case HEXLOAD_JACKKNIFE_INVERT:
        sweep(self, (int)step / 2, SWEPT[step % 2]);
        return 2 * DIM;
    case HEXLOAD_JACKKNIFE_PULL:
        take_product(self->information, self->change, rows, newest(self)->pull);
        return 2;
    case HEXLOAD_JACKKNIFE_CLOSE:
        close_block(self);
        return 1;
    case HEXLOAD_JACKKNIFE_MOVE: // the pulls at theta of now; the newest is there already
        if (step / 2 + 1 < self->blocks) {
            hexload_jackknife_block_t* block = &self->block[self->order[step / 2]];
            take_product(block->information, self->change, rows, block->pull);
        }
        return 2 * round;
    case HEXLOAD_JACKKNIFE_COMPARE:
        if (step % round == 0) {
            read_column(self->covariance, (int)(step / round), self->column);
            self->pivot = HEXLOAD_REAL(1.0) / self->column[step / round];
        } else {
            compare(self, (int)(step / round), step % round - 1);
        }
        return DIM * round;
    case HEXLOAD_JACKKNIFE_CONCLUDE:
        if (self->blocks >= FEWEST_BLOCKS) {
            conclude(self);
        }
        return 1;
    default: // HEXLOAD_JACKKNIFE_JOIN: one that waits has no step
        if (self->blocks == BLOCKS) {
            join_blocks(self);
        }
        return 1;
    }
}

void hexload_jackknife_step(hexload_jackknife_t* self, const hexload_config_t* config,
                            const hexload_momentum_filter_t* filter) {
    self->elapsed_ticks++;
    if (self->stage == HEXLOAD_JACKKNIFE_WAIT) {
        if (!self->has_begun || (hexload_real_t)self->elapsed_ticks * config->tick_s >= BLOCK_S) {
            take_snapshot(self, filter);
            self->stage = HEXLOAD_JACKKNIFE_PREPARE;
        }
        return;
    }
    const uint32_t steps = take_step(self, self->step);
    self->step++;
    if (self->step >= steps) {
        self->step = 0;
        self->stage =
            self->stage == HEXLOAD_JACKKNIFE_JOIN ? HEXLOAD_JACKKNIFE_WAIT : (uint8_t)(self->stage + 1);
    }
}

void hexload_jackknife_widen(const hexload_jackknife_t* self, hexload_real_t least,
                             hexload_real_t sigma[DIM]) {
    for (int k = 0; k < DIM; k++) {
        sigma[k] *= hexload_max(self->factor[k], least);
    }
}
