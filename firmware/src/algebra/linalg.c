#include "algebra/linalg.h"

bool hexload_invert3(hexload_real_t A[3][3], hexload_real_t inverse[3][3]) {
    hexload_real_t column[3][3]; // of the adjugate
    cross3(A[1], A[2], column[0]);
    cross3(A[2], A[0], column[1]);
    cross3(A[0], A[1], column[2]);
    const hexload_real_t determinant = dot3(A[0], column[0]);
    const hexload_real_t most_squared = dot3(A[0], A[0]) * dot3(A[1], A[1]) * dot3(A[2], A[2]);
    const hexload_real_t least = HEXLOAD_REAL(64.0) * HEXLOAD_REAL_EPSILON;
    if (!(determinant * determinant > least * least * most_squared)) { // also refuses NaN
        return false;
    }
    const hexload_real_t scale = HEXLOAD_REAL(1.0) / determinant;
    for (int i = 0; i < 3; i++) {
        HEXLOAD_UNROLL
        for (int k = 0; k < 3; k++) {
            inverse[i][k] = scale * column[k][i];
        }
    }
    return true;
}

void hexload_cholesky6(hexload_real_t A[6][6]) {
    for (int i = 0; i < 6; i++) {
        for (int j = 0; j <= i; j++) {
            hexload_real_t sum = A[i][j];
            for (int k = 0; k < j; k++) {
                sum = hexload_fma(-A[i][k], A[j][k], sum);
            }
            A[i][j] = i == j ? HEXLOAD_REAL(1.0) / hexload_sqrt(sum) : sum * A[j][j];
        }
    }
}

#ifndef HEXLOAD_INLINE_KERNELS
#include "algebra/linalg_kernels.h"
#endif
