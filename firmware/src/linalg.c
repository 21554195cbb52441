#include "linalg.h"

bool invert3(hexload_real_t A[3][3], hexload_real_t inverse[3][3]) {
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
        for (int k = 0; k < 3; k++) {
            inverse[i][k] = scale * column[k][i];
        }
    }
    return true;
}

bool cholesky3(hexload_real_t A[3][3], hexload_real_t L[3][3]) {
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < i; j++) {
            hexload_real_t sum = A[i][j];
            for (int k = 0; k < j; k++) {
                sum -= L[i][k] * L[j][k];
            }
            L[i][j] = sum * L[j][j];
        }
        hexload_real_t pivot = A[i][i];
        for (int k = 0; k < i; k++) {
            pivot -= L[i][k] * L[i][k];
        }
        if (!(pivot > HEXLOAD_REAL(0.0))) { // also refuses NaN
            return false;
        }
        L[i][i] = HEXLOAD_REAL(1.0) / hexload_sqrt(pivot);
    }
    return true;
}
