#include "linalg.h"

/// Moves the row with the largest entry of the column to the diagonal.
static void pivot_to_diagonal(lu6_t* lu, int column) {
    int best = column;
    for (int row = column + 1; row < 6; row++) {
        if (hexload_abs(lu->factor[row][column]) > hexload_abs(lu->factor[best][column])) {
            best = row;
        }
    }
    for (int k = 0; k < 6; k++) {
        const hexload_real_t swapped = lu->factor[column][k];
        lu->factor[column][k] = lu->factor[best][k];
        lu->factor[best][k] = swapped;
    }
    const unsigned swapped = lu->pivot[column];
    lu->pivot[column] = lu->pivot[best];
    lu->pivot[best] = swapped;
}

bool lu6_factor(hexload_real_t A[6][6], lu6_t* lu) {
    hexload_real_t largest = HEXLOAD_REAL(0.0);
    for (int row = 0; row < 6; row++) {
        lu->pivot[row] = (unsigned)row;
        for (int k = 0; k < 6; k++) {
            lu->factor[row][k] = A[row][k];
            largest = hexload_max(largest, hexload_abs(A[row][k]));
        }
    }
    const hexload_real_t smallest_pivot = HEXLOAD_REAL(64.0) * HEXLOAD_REAL_EPSILON * largest;
    for (int column = 0; column < 6; column++) {
        pivot_to_diagonal(lu, column);
        if (!(hexload_abs(lu->factor[column][column]) > smallest_pivot)) { // also refuses NaN
            return false;
        }
        lu->inverse_diagonal[column] = HEXLOAD_REAL(1.0) / lu->factor[column][column];
        for (int row = column + 1; row < 6; row++) {
            const hexload_real_t multiplier = lu->factor[row][column] * lu->inverse_diagonal[column];
            lu->factor[row][column] = multiplier;
            for (int k = column + 1; k < 6; k++) {
                lu->factor[row][k] -= multiplier * lu->factor[column][k];
            }
        }
    }
    return true;
}

void lu6_solve(const lu6_t* lu, const hexload_real_t b[6], hexload_real_t x[6]) {
    for (int i = 0; i < 6; i++) {
        x[i] = b[lu->pivot[i]];
        for (int k = 0; k < i; k++) {
            x[i] -= lu->factor[i][k] * x[k];
        }
    }
    for (int i = 5; i >= 0; i--) {
        for (int k = i + 1; k < 6; k++) {
            x[i] -= lu->factor[i][k] * x[k];
        }
        x[i] *= lu->inverse_diagonal[i];
    }
}

void lu6_inverse_row(const lu6_t* lu, int row, hexload_real_t x[6]) {
    hexload_real_t y[6] = {0};
    y[row] = lu->inverse_diagonal[row];
    for (int i = row + 1; i < 6; i++) {
        for (int k = row; k < i; k++) {
            y[i] -= lu->factor[k][i] * y[k];
        }
        y[i] *= lu->inverse_diagonal[i];
    }
    for (int i = 5; i >= 0; i--) {
        for (int k = i + 1; k < 6; k++) {
            y[i] -= lu->factor[k][i] * y[k];
        }
        x[lu->pivot[i]] = y[i];
    }
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
