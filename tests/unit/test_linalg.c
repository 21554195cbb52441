#include "algebra/linalg.h"
#include "machine.h"

void setUp(void) {}
void tearDown(void) {}

static void random_matrix(uint64_t* seed, hexload_real_t A[3][3]) {
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < 3; j++) {
            A[i][j] = (hexload_real_t)uniform(seed) + (i == j ? HEXLOAD_REAL(3.0) : HEXLOAD_REAL(0.0));
        }
    }
}

static void test_inverse_times_the_matrix_is_the_identity(void) {
    uint64_t seed = 1;
    for (int run = 0; run < 100; run++) {
        // GIVEN a matrix with a condition number below 10
        hexload_real_t A[3][3], inverse[3][3];
        random_matrix(&seed, A);
        // WHEN it is inverted
        TEST_ASSERT_TRUE(hexload_invert3(A, inverse));
        // THEN the product is the identity, to ten roundings of each of its three terms
        for (int i = 0; i < 3; i++) {
            for (int j = 0; j < 3; j++) {
                double sum = 0.0;
                for (int k = 0; k < 3; k++) {
                    sum += (double)inverse[i][k] * (double)A[k][j];
                }
                TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(3 * 10 * 10, 1.0), i == j ? 1.0 : 0.0, sum);
            }
        }
    }
}

static void test_inverse_of_a_singular_matrix_is_refused_at_any_scale(void) {
    for (int exponent = -6; exponent <= 6; exponent += 6) {
        // GIVEN a matrix whose last row is the sum of the others, in millionths, ones or millions
        uint64_t seed = 3;
        hexload_real_t A[3][3], inverse[3][3];
        random_matrix(&seed, A);
        for (int j = 0; j < 3; j++) {
            A[0][j] *= (hexload_real_t)pow(10.0, exponent);
            A[1][j] *= (hexload_real_t)pow(10.0, exponent);
            A[2][j] = A[0][j] + A[1][j];
        }
        // WHEN it is inverted THEN that is refused
        TEST_ASSERT_FALSE(hexload_invert3(A, inverse));
    }
}

static void test_inverse_of_a_matrix_with_nan_is_refused(void) {
    uint64_t seed = 4;
    hexload_real_t A[3][3], inverse[3][3];
    random_matrix(&seed, A);
    A[1][2] = (hexload_real_t)NAN;
    TEST_ASSERT_FALSE(hexload_invert3(A, inverse));
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

static void test_rows_nearly_in_a_plane_are_refused_whichever_they_are(void) {
    // GIVEN a row that lies in the plane of two others, which are at right angles, but for half of 64
    // roundings WHEN the matrix is inverted THEN it is singular, whichever row that is, and with 200
    // roundings it is not
    for (int n = 0; n < 3; n++) {
        hexload_real_t A[3][3] = {{HEXLOAD_REAL(0.0)}}, inverse[3][3];
        A[n][0] = HEXLOAD_REAL(1.0);
        A[(n + 1) % 3][1] = HEXLOAD_REAL(1.0);
        A[(n + 2) % 3][0] = HEXLOAD_REAL(1.0);
        A[(n + 2) % 3][1] = HEXLOAD_REAL(1.0);
        A[(n + 2) % 3][2] = HEXLOAD_REAL(32.0) * HEXLOAD_REAL_EPSILON;
        TEST_ASSERT_FALSE(hexload_invert3(A, inverse));
        A[(n + 2) % 3][2] = HEXLOAD_REAL(200.0) * HEXLOAD_REAL_EPSILON;
        TEST_ASSERT_TRUE(hexload_invert3(A, inverse));
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_inverse_times_the_matrix_is_the_identity);
    RUN_TEST(test_inverse_of_a_singular_matrix_is_refused_at_any_scale);
    RUN_TEST(test_inverse_of_a_matrix_with_nan_is_refused);
    RUN_TEST(test_cholesky_whitens_its_own_matrix);
    RUN_TEST(test_cholesky_refuses_what_is_not_positive_definite);
    RUN_TEST(test_rows_nearly_in_a_plane_are_refused_whichever_they_are);
    return UNITY_END();
}
