#include "algebra/linalg.h"
#include "machine.h"
#include "momentum/jackknife.h"
#include "motion.h"

#include <math.h>
#include <string.h>

void setUp(void) {}
void tearDown(void) {}

enum { DIM = HEXLOAD_LOAD_DIM, MANY = 40, BLOCK_TICKS = 250 };

/// Blocks of a linear model in double precision: the information of each, and the theta that it alone would
/// find, which is `spread` times as far off as its information says.
typedef struct blocks {
    double information[MANY][DIM][DIM];
    double theta[MANY][DIM];
} blocks_t;

static const double prior_sigma = 300.0;

static void solve(double A[DIM][DIM], const double b[DIM], double x[DIM]) {
    double work[DIM][DIM + 1];
    for (int i = 0; i < DIM; i++) {
        memcpy(work[i], A[i], sizeof A[i]);
        work[i][DIM] = b[i];
    }
    for (int p = 0; p < DIM; p++) {
        for (int i = 0; i < DIM; i++) {
            const double share = i == p ? 0.0 : work[i][p] / work[p][p];
            for (int j = p; j <= DIM; j++) {
                work[i][j] -= share * work[p][j];
            }
        }
    }
    for (int i = 0; i < DIM; i++) {
        x[i] = work[i][DIM] / work[i][i];
    }
}

static void invert(double A[DIM][DIM], double inverse[DIM][DIM]) {
    for (int k = 0; k < DIM; k++) {
        double unit[DIM] = {0};
        unit[k] = 1.0;
        solve(A, unit, inverse[k]); // symmetric: a column is a row
    }
}

/// Information of m and h a hundred times that of the inertias, and correlated.
static void draw(blocks_t* blocks, int count, double spread, uint64_t* seed) {
    for (int b = 0; b < count; b++) {
        double root[DIM][DIM];
        double covariance[DIM][DIM];
        const double size = 1.0 + uniform(seed) * uniform(seed);
        for (int i = 0; i < DIM; i++) {
            for (int k = 0; k < DIM; k++) {
                root[i][k] = size * (i < 4 ? 10.0 : 1.0) * (uniform(seed) + (i == k ? 1.5 : 0.0));
            }
        }
        for (int i = 0; i < DIM; i++) {
            for (int j = 0; j < DIM; j++) {
                blocks->information[b][i][j] = 0.0;
                for (int k = 0; k < DIM; k++) {
                    blocks->information[b][i][j] += root[i][k] * root[j][k];
                }
            }
        }
        double noise[DIM] = {0};
        for (int k = 0; k < DIM; k++) {
            const double factor = normal(seed);
            for (int i = 0; i < DIM; i++) {
                noise[i] += root[i][k] * factor; // of variance J
            }
        }
        invert(blocks->information[b], covariance);
        for (int i = 0; i < DIM; i++) {
            blocks->theta[b][i] = 100.0 + 30.0 * i;
            for (int k = 0; k < DIM; k++) {
                blocks->theta[b][i] += spread * covariance[i][k] * noise[k];
            }
        }
    }
}

/// P and theta of the prior and the first `count` blocks.
static void combine(const blocks_t* blocks, int count, double P[DIM][DIM], double theta[DIM]) {
    double information[DIM][DIM] = {{0}};
    double pull[DIM] = {0};
    for (int i = 0; i < DIM; i++) {
        information[i][i] = 1.0 / (prior_sigma * prior_sigma);
    }
    for (int b = 0; b < count; b++) {
        for (int i = 0; i < DIM; i++) {
            for (int j = 0; j < DIM; j++) {
                information[i][j] += blocks->information[b][i][j];
                pull[i] += blocks->information[b][i][j] * blocks->theta[b][j];
            }
        }
    }
    invert(information, P);
    solve(information, pull, theta);
}

/// A filter that has seen that much, for the time of a block.
static void show(hexload_jackknife_t* jackknife, const blocks_t* blocks, int count, int ticks) {
    const hexload_config_t config = paper_machine();
    hexload_momentum_filter_t filter = {.nis = HEXLOAD_REAL(6.0)};
    double P[DIM][DIM];
    double theta[DIM];
    combine(blocks, count, P, theta);
    for (int i = 0; i < DIM; i++) {
        filter.theta[i] = (hexload_real_t)theta[i];
        for (int j = 0; j < DIM; j++) {
            filter.load_cov[i][j] = (hexload_real_t)P[i][j];
        }
    }
    for (int tick = 0; tick < ticks; tick++) {
        hexload_jackknife_step(jackknife, &config, &filter);
    }
}

/// All of them, and the time that the last round takes.
static void show_all(hexload_jackknife_t* jackknife, const blocks_t* blocks, int count) {
    for (int b = 0; b <= count; b++) {
        show(jackknife, blocks, b, BLOCK_TICKS);
    }
}

/// Blocks that count as one: from the first of a group to the one before the next group's.
typedef struct groups {
    int first[MANY + 1];
    int count;
} groups_t;

static groups_t one_by_one(int count) {
    groups_t groups = {.count = count};
    for (int b = 0; b <= count; b++) {
        groups.first[b] = b;
    }
    return groups;
}

/// What a group has moved each parameter by, by all numbers at once, and its share in what is known of it.
static void compare_group(const blocks_t* blocks, const int first[2], double P[DIM][DIM],
                          const double theta[DIM], double moved[DIM], double share[DIM]) {
    for (int k = 0; k < DIM; k++) {
        moved[k] = share[k] = 0.0;
        for (int b = first[0]; b < first[1]; b++) {
            for (int i = 0; i < DIM; i++) {
                for (int j = 0; j < DIM; j++) {
                    const double J = blocks->information[b][i][j];
                    moved[k] += P[k][i] * J * (blocks->theta[b][j] - theta[j]);
                    share[k] += P[k][i] * J * P[j][k] / P[k][k];
                }
            }
        }
    }
}

/// Of the first `count` blocks in groups.
static void naive_factors_of(const blocks_t* blocks, int count, const groups_t* groups, double factor[DIM]) {
    double P[DIM][DIM], theta[DIM], spread[DIM] = {0}, expected[DIM] = {0}, square[DIM] = {0};
    double all_spread = 0.25, all_expected = 0.25; // so much is as in the model beforehand
    combine(blocks, count, P, theta);
    for (int b = 0; b < groups->count; b++) {
        double moved[DIM], share[DIM];
        compare_group(blocks, &groups->first[b], P, theta, moved, share);
        for (int k = 0; k < DIM; k++) {
            spread[k] += moved[k] * moved[k] / P[k][k];
            expected[k] += share[k] - share[k] * share[k];
            square[k] += share[k] * share[k];
        }
    }
    for (int k = 0; k < DIM; k++) {
        all_spread += spread[k];
        all_expected += expected[k];
    }
    for (int k = 0; k < DIM; k++) {
        const double beyond = spread[k] - sqrt(2.0 * square[k] * expected[k]); // a standard deviation
        factor[k] = sqrt(fmax(1.0, (beyond + 0.25 * all_spread / all_expected) / (expected[k] + 0.25)));
    }
}

static void naive_factors(const blocks_t* blocks, int count, double factor[DIM]) {
    const groups_t groups = one_by_one(count);
    naive_factors_of(blocks, count, &groups, factor);
}

/// Joins the two neighbours of which the parameter that they have most of together has least.
static void join_least(const blocks_t* blocks, int count, groups_t* groups) {
    double P[DIM][DIM], theta[DIM], last[DIM] = {0}, least = HUGE_VAL;
    int at = 0;
    combine(blocks, count, P, theta);
    for (int b = 0; b < groups->count; b++) {
        double moved[DIM], share[DIM], most = 0.0;
        compare_group(blocks, &groups->first[b], P, theta, moved, share);
        for (int k = 0; k < DIM; k++) {
            most = fmax(most, last[k] + share[k]);
            last[k] = share[k];
        }
        if (b > 0 && most < least) {
            least = most;
            at = b;
        }
    }
    groups->count--;
    for (int b = at; b <= groups->count; b++) {
        groups->first[b] = groups->first[b + 1];
    }
}

static void test_factors_are_those_of_all_blocks_at_once(void) {
    // GIVEN fifteen blocks whose estimates spread twice as much as they say
    static blocks_t blocks;
    static hexload_jackknife_t jackknife;
    uint64_t seed = 3;
    double factor[DIM];
    hexload_real_t sigma[DIM];
    draw(&blocks, 15, 2.0, &seed);
    // WHEN a filter has seen them one after the other
    hexload_jackknife_init(&jackknife);
    show_all(&jackknife, &blocks, 15);
    // THEN its sigmas grow by what the blocks say all together: rounding of an inverse, 1e-7 times a
    // condition of some 1e3, and of theta, 2e-5 of a sigma of 1e-2 at least
    naive_factors(&blocks, 15, factor);
    for (int k = 0; k < DIM; k++) {
        sigma[k] = HEXLOAD_REAL(1.0);
    }
    hexload_jackknife_widen(&jackknife, HEXLOAD_REAL(1.0), sigma);
    for (int k = 0; k < DIM; k++) {
        TEST_ASSERT_DOUBLE_WITHIN(0.01 * factor[k], factor[k], (double)sigma[k]);
    }
    TEST_ASSERT_EQUAL_UINT32(15, jackknife.blocks);
    // AND by no less than something else says
    sigma[0] = HEXLOAD_REAL(1.0);
    hexload_jackknife_widen(&jackknife, HEXLOAD_REAL(50.0), sigma);
    TEST_ASSERT_EQUAL_DOUBLE(50.0, (double)sigma[0]);
}

static void test_where_there_is_no_room_the_two_smallest_neighbours_are_joined(void) {
    // GIVEN twenty-six blocks, ten more than there is room for with one free, that spread three times as much
    // as they say
    static blocks_t blocks;
    static hexload_jackknife_t jackknife;
    uint64_t seed = 4;
    double factor[DIM];
    draw(&blocks, 26, 3.0, &seed);
    hexload_jackknife_init(&jackknife);
    groups_t groups = one_by_one(0);
    show(&jackknife, &blocks, 0, BLOCK_TICKS);
    for (int b = 1; b <= 26; b++) {
        // WHEN one after the other comes
        show(&jackknife, &blocks, b, BLOCK_TICKS);
        groups.first[++groups.count] = b;
        naive_factors_of(&blocks, b, &groups, factor);
        // THEN from four on sigmas grow by what they say, of which the smallest neighbours are one when there
        // are sixteen
        TEST_ASSERT_EQUAL_INT(b >= 4, jackknife.has_concluded);
        for (int k = 0; k < DIM; k++) {
            TEST_ASSERT_DOUBLE_WITHIN(0.02 * factor[k], b >= 4 ? factor[k] : 1.0,
                                      (double)jackknife.factor[k]);
        }
        if (groups.count == 16) {
            join_least(&blocks, b, &groups);
        }
        TEST_ASSERT_EQUAL_UINT32(groups.count, jackknife.blocks);
    }
}

static void test_a_block_is_a_quarter_of_a_second(void) {
    // GIVEN a first snapshot, which is at once, and the round after it WHEN 249 ms have gone by THEN it
    // waits, and at 250 ms the next one begins
    static blocks_t blocks;
    static hexload_jackknife_t jackknife;
    uint64_t seed = 5;
    draw(&blocks, 1, 1.0, &seed);
    hexload_jackknife_init(&jackknife);
    show(&jackknife, &blocks, 0, 1);
    TEST_ASSERT_EQUAL_UINT8(HEXLOAD_JACKKNIFE_PREPARE, jackknife.stage);
    show(&jackknife, &blocks, 0, 249);
    TEST_ASSERT_EQUAL_UINT8(HEXLOAD_JACKKNIFE_WAIT, jackknife.stage);
    TEST_ASSERT_TRUE(jackknife.has_begun);
    show(&jackknife, &blocks, 1, 1);
    TEST_ASSERT_EQUAL_UINT8(HEXLOAD_JACKKNIFE_PREPARE, jackknife.stage);
}

/// Another run of so many blocks, which spread by so much more than they say.
static const hexload_jackknife_t* run_of(int count, double spread, uint64_t* seed) {
    static blocks_t blocks;
    static hexload_jackknife_t jackknife;
    draw(&blocks, count, spread, seed);
    hexload_jackknife_init(&jackknife);
    show_all(&jackknife, &blocks, count);
    return &jackknife;
}

/// Mean of the pooled square over runs of MANY blocks.
static double mean_pooled(double spread, uint64_t seed) {
    enum { RUNS = 24 };
    double sum = 0.0;
    for (int run = 0; run < RUNS; run++) {
        const hexload_jackknife_t* jackknife = run_of(MANY, spread, &seed);
        TEST_ASSERT_TRUE(jackknife->blocks < HEXLOAD_JACKKNIFE_BLOCKS);
        sum += (double)jackknife->pooled / RUNS;
    }
    return sum;
}

static void test_an_honest_filter_is_left_alone_and_another_is_widened(void) {
    // GIVEN more blocks than there is room for WHEN they spread as they say THEN the factors' mean square is
    // one: chi-square with some 10 x 10 degrees of freedom in each of 24 runs, correlated by twos at most,
    // 0.04; and at most a tenth less, as shares' squares are less than what they stand for
    const double honest = mean_pooled(1.0, 5);
    TEST_ASSERT_DOUBLE_WITHIN(0.11, 0.95, honest);
    // AND six times as far they are six times as large, squared, but for the share, a quarter of 9.25, that
    // is as in the model beforehand
    TEST_ASSERT_DOUBLE_WITHIN(0.5, 36.0 - 35.0 * 0.25 / 9.25, mean_pooled(6.0, 5) / honest);
}

/// Mean over runs and parameters of the factors' squares.
static double mean_square_factor(double spread, uint64_t seed) {
    enum { RUNS = 24 };
    double sum = 0.0;
    for (int run = 0; run < RUNS; run++) {
        const hexload_jackknife_t* jackknife = run_of(15, spread, &seed);
        for (int k = 0; k < DIM; k++) {
            sum += (double)(jackknife->factor[k] * jackknife->factor[k]) / (RUNS * DIM);
        }
    }
    return sum;
}

static void test_what_blocks_differ_by_in_the_model_widens_hardly(void) {
    // GIVEN fifteen blocks that spread as they say WHEN sigma is widened by no more than what is beyond a
    // standard deviation THEN the squares of the factors are one and, of a normal spread of a third to a
    // half, its part beyond that on average, 0.083 of it: 1.03 to 1.04, and twice as much for its skewness
    TEST_ASSERT_DOUBLE_WITHIN(0.04, 1.04, mean_square_factor(1.0, 7));
    // AND of blocks that spread three times as far, less by that deviation of nine at most, a half
    TEST_ASSERT_DOUBLE_WITHIN(0.7, 8.5, mean_square_factor(3.0, 7));
}

static void test_a_standstill_takes_nothing_from_what_blocks_of_motion_say(void) {
    // GIVEN twelve blocks of motion that spread five times as much as they say
    static blocks_t blocks;
    static hexload_jackknife_t jackknife;
    uint64_t seed = 7;
    hexload_real_t before[DIM];
    draw(&blocks, 12, 5.0, &seed);
    hexload_jackknife_init(&jackknife);
    show_all(&jackknife, &blocks, 12);
    memcpy(before, jackknife.factor, sizeof before);
    // WHEN nothing more is learnt for a minute
    show(&jackknife, &blocks, 12, 60000);
    // THEN nothing changes, to some roundings of the shares
    for (int k = 0; k < DIM; k++) {
        TEST_ASSERT_DOUBLE_WITHIN(1e-3 * (double)before[k], (double)before[k], (double)jackknife.factor[k]);
    }
}

static void test_information_that_goes_again_is_no_misfit(void) {
    // GIVEN six blocks of motion, of which the last ones tell each inertia a thousand times worse than their
    // sum
    static blocks_t blocks;
    static hexload_jackknife_t jackknife;
    const hexload_config_t config = paper_machine();
    hexload_momentum_filter_t filter = {.nis = HEXLOAD_REAL(6.0)};
    uint64_t seed = 13;
    draw(&blocks, 6, 1.0, &seed);
    hexload_jackknife_init(&jackknife);
    show_all(&jackknife, &blocks, 6);
    // WHEN half of what is known of sums goes and comes again, as variances that grow by roundings take it
    for (int i = 0; i < DIM; i++) {
        for (int j = 0; j < DIM; j++) {
            filter.load_cov[i][j] = i == j ? HEXLOAD_REAL(1.0) : HEXLOAD_REAL(0.998);
        }
    }
    for (int block = 0; block < 8; block++) {
        for (int k = 0; k < DIM; k++) {
            filter.load_cov[k][k] =
                HEXLOAD_REAL(1.0) + (block % 2 == 0 ? HEXLOAD_REAL(0.0) : HEXLOAD_REAL(2e-3));
            filter.theta[k] = HEXLOAD_REAL(0.05) * (hexload_real_t)normal(&seed); // as far as sums are known
        }
        for (int tick = 0; tick < BLOCK_TICKS; tick++) {
            hexload_jackknife_step(&jackknife, &config, &filter);
        }
    }
    // THEN the blocks do not differ by more than noise: 9 would be a misfit
    TEST_ASSERT_TRUE(jackknife.has_concluded);
    TEST_ASSERT_TRUE(jackknife.pooled >= HEXLOAD_REAL(0.0) && jackknife.pooled < HEXLOAD_REAL(4.0));
}

static void test_another_load_begins_with_what_the_machine_has_shown(void) {
    // GIVEN factors of a machine that is not its model, about six
    static blocks_t blocks;
    static hexload_jackknife_t jackknife;
    uint64_t seed = 11;
    draw(&blocks, 15, 6.0, &seed);
    hexload_jackknife_init(&jackknife);
    show_all(&jackknife, &blocks, 15);
    // WHEN the load changes THEN all parameters have what they had in common
    hexload_jackknife_forget(&jackknife);
    for (int k = 0; k < DIM; k++) {
        TEST_ASSERT_DOUBLE_WITHIN(1.5, 6.0, (double)jackknife.factor[k]);
    }
    // AND another start knows nothing of it
    hexload_jackknife_init(&jackknife);
    for (int k = 0; k < DIM; k++) {
        TEST_ASSERT_TRUE(jackknife.factor[k] == HEXLOAD_REAL(1.0));
    }
}

static void test_a_parameter_without_a_variance_gives_no_number_that_is_none(void) {
    // GIVEN a filter for which hx has no variance left WHEN blocks of it are compared for ten seconds THEN
    // every factor is a number, and widens
    hexload_config_t config = paper_machine();
    static hexload_momentum_filter_t filter;
    static hexload_jackknife_t jackknife;
    memset(&filter, 0, sizeof filter);
    for (int k = 0; k < DIM; k++) {
        filter.load_cov[k][k] = k == HEXLOAD_LOAD_HX ? HEXLOAD_REAL(0.0) : HEXLOAD_REAL(1.0);
    }
    hexload_jackknife_init(&jackknife);
    for (int tick = 0; tick < 10000; tick++) {
        hexload_jackknife_step(&jackknife, &config, &filter);
        filter.load_cov[0][0] *= HEXLOAD_REAL(0.9999);
    }
    TEST_ASSERT_TRUE(jackknife.has_concluded);
    for (int k = 0; k < DIM; k++) {
        TEST_ASSERT_TRUE(isfinite(jackknife.factor[k]) && jackknife.factor[k] >= HEXLOAD_REAL(1.0));
    }
}

static void test_a_parameter_that_another_one_determines_counts_as_not_known(void) {
    // GIVEN a covariance of one each, in which hx is m to the bit, so that nothing of its own is left of it
    // WHEN it is inverted THEN hx has no information, and each other parameter one of its own alone
    hexload_config_t config = paper_machine();
    static hexload_momentum_filter_t filter;
    static hexload_jackknife_t jackknife;
    memset(&filter, 0, sizeof filter);
    for (int k = 0; k < DIM; k++) {
        filter.load_cov[k][k] = HEXLOAD_REAL(1.0);
    }
    filter.load_cov[HEXLOAD_LOAD_HX][HEXLOAD_LOAD_M] = HEXLOAD_REAL(1.0);
    filter.load_cov[HEXLOAD_LOAD_M][HEXLOAD_LOAD_HX] = HEXLOAD_REAL(1.0);
    hexload_jackknife_init(&jackknife);
    for (int tick = 0; tick < BLOCK_TICKS; tick++) {
        hexload_jackknife_step(&jackknife, &config, &filter);
    }
    TEST_ASSERT_TRUE(jackknife.has_begun);
    for (int i = 0; i < DIM; i++) {
        for (int j = 0; j <= i; j++) {
            TEST_ASSERT_EQUAL_DOUBLE(i == j && i != HEXLOAD_LOAD_HX ? 1.0 : 0.0,
                                     (double)jackknife.information[i * (i + 1) / 2 + j]);
        }
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_factors_are_those_of_all_blocks_at_once);
    RUN_TEST(test_where_there_is_no_room_the_two_smallest_neighbours_are_joined);
    RUN_TEST(test_a_block_is_a_quarter_of_a_second);
    RUN_TEST(test_an_honest_filter_is_left_alone_and_another_is_widened);
    RUN_TEST(test_what_blocks_differ_by_in_the_model_widens_hardly);
    RUN_TEST(test_a_standstill_takes_nothing_from_what_blocks_of_motion_say);
    RUN_TEST(test_information_that_goes_again_is_no_misfit);
    RUN_TEST(test_another_load_begins_with_what_the_machine_has_shown);
    RUN_TEST(test_a_parameter_without_a_variance_gives_no_number_that_is_none);
    RUN_TEST(test_a_parameter_that_another_one_determines_counts_as_not_known);
    return UNITY_END();
}
