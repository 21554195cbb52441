#include "linalg.h"
#include "machine.h"

void setUp(void) {}
void tearDown(void) {}

static void random_matrix(uint64_t* seed, hexload_real_t A[6][6]) {
    for (int i = 0; i < 6; i++) {
        for (int j = 0; j < 6; j++) {
            A[i][j] = (hexload_real_t)uniform(seed) + (i == j ? HEXLOAD_REAL(3.0) : HEXLOAD_REAL(0.0));
        }
    }
}

// A diagonally heavy 6 x 6 matrix has a condition number below 10; 6 roundings for each of 6 eliminations.
static const double solve_factor = 6 * 6 * 10;

static void test_lu_solution_satisfies_the_equations(void) {
    uint64_t seed = 1;
    for (int run = 0; run < 100; run++) {
        // GIVEN a well-conditioned matrix and a right-hand side
        hexload_real_t A[6][6], b[6], x[6];
        lu6_t lu;
        random_matrix(&seed, A);
        for (int i = 0; i < 6; i++) {
            b[i] = (hexload_real_t)uniform(&seed);
        }
        // WHEN it is solved
        TEST_ASSERT_TRUE(lu6_factor(A, &lu));
        lu6_solve(&lu, b, x);
        // THEN the solution put back gives the right-hand side
        for (int i = 0; i < 6; i++) {
            double sum = 0.0;
            for (int k = 0; k < 6; k++) {
                sum += (double)A[i][k] * (double)x[k];
            }
            TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(solve_factor, 1.0), (double)b[i], sum);
        }
    }
}

static void test_rows_of_the_inverse_times_the_matrix_are_unit_vectors(void) {
    uint64_t seed = 2;
    for (int run = 0; run < 100; run++) {
        // GIVEN the factors of a matrix whose rows need exchanging
        hexload_real_t A[6][6], x[6];
        lu6_t lu;
        random_matrix(&seed, A);
        for (int j = 0; j < 6; j++) {
            const hexload_real_t swapped = A[0][j];
            A[0][j] = A[4][j];
            A[4][j] = swapped;
        }
        TEST_ASSERT_TRUE(lu6_factor(A, &lu));
        for (int row = 0; row < 6; row++) {
            // WHEN one row of the inverse is asked for
            lu6_inverse_row(&lu, row, x);
            // THEN row times matrix is the unit vector of that row
            for (int j = 0; j < 6; j++) {
                double sum = 0.0;
                for (int k = 0; k < 6; k++) {
                    sum += (double)x[k] * (double)A[k][j];
                }
                TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(solve_factor, 1.0), row == j ? 1.0 : 0.0, sum);
            }
        }
    }
}

static void test_lu_refuses_a_singular_matrix(void) {
    // GIVEN a matrix whose last row is the sum of the others
    uint64_t seed = 3;
    hexload_real_t A[6][6];
    lu6_t lu;
    random_matrix(&seed, A);
    for (int j = 0; j < 6; j++) {
        A[5][j] = A[0][j] + A[1][j] + A[2][j] + A[3][j] + A[4][j];
    }
    // WHEN it is factored THEN that is refused
    TEST_ASSERT_FALSE(lu6_factor(A, &lu));
}

static void test_lu_refuses_a_matrix_with_nan(void) {
    uint64_t seed = 4;
    hexload_real_t A[6][6];
    lu6_t lu;
    random_matrix(&seed, A);
    A[2][3] = (hexload_real_t)NAN;
    TEST_ASSERT_FALSE(lu6_factor(A, &lu));
}

static void test_cholesky_whitens_its_own_matrix(void) {
    // GIVEN a covariance that spans ten orders of magnitude
    hexload_real_t A[3][3] = {{HEXLOAD_REAL(4.0), HEXLOAD_REAL(2e-5), HEXLOAD_REAL(1e-3)},
                              {HEXLOAD_REAL(2e-5), HEXLOAD_REAL(1e-9), HEXLOAD_REAL(2e-8)},
                              {HEXLOAD_REAL(1e-3), HEXLOAD_REAL(2e-8), HEXLOAD_REAL(2e-6)}};
    hexload_real_t L[3][3];
    // WHEN its factor whitens each of its columns
    TEST_ASSERT_TRUE(cholesky3(A, L));
    hexload_real_t whitened[3][3];
    for (int j = 0; j < 3; j++) {
        const hexload_real_t column[3] = {A[0][j], A[1][j], A[2][j]};
        forward_substitute3(L, column, whitened[j]);
    }
    // THEN the products of the whitened columns are the covariance again, to roundings of the geometric mean
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            const double scale = sqrt((double)A[i][i] * (double)A[j][j]);
            TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(50, scale), (double)A[i][j],
                                      (double)dot3(whitened[i], whitened[j]));
        }
    }
}

static void test_cholesky_refuses_what_is_not_positive_definite(void) {
    hexload_real_t A[3][3] = {{HEXLOAD_REAL(1.0), HEXLOAD_REAL(2.0), HEXLOAD_REAL(0.0)},
                              {HEXLOAD_REAL(2.0), HEXLOAD_REAL(1.0), HEXLOAD_REAL(0.0)},
                              {HEXLOAD_REAL(0.0), HEXLOAD_REAL(0.0), HEXLOAD_REAL(1.0)}};
    hexload_real_t L[3][3];
    TEST_ASSERT_FALSE(cholesky3(A, L));
    A[0][0] = (hexload_real_t)NAN;
    TEST_ASSERT_FALSE(cholesky3(A, L));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_lu_solution_satisfies_the_equations);
    RUN_TEST(test_rows_of_the_inverse_times_the_matrix_are_unit_vectors);
    RUN_TEST(test_lu_refuses_a_singular_matrix);
    RUN_TEST(test_lu_refuses_a_matrix_with_nan);
    RUN_TEST(test_cholesky_whitens_its_own_matrix);
    RUN_TEST(test_cholesky_refuses_what_is_not_positive_definite);
    return UNITY_END();
}
