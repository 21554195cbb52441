/// @file linalg.h
/// Fixed-size kernels of the core. Outputs never alias inputs. Reentrant, constant time. Matrices that are
/// only read are not const, because C11 does not convert a matrix to a const one.
#ifndef HEXLOAD_LINALG_H
#define HEXLOAD_LINALG_H

#include "hexload/real.h"

#include <stdbool.h>

static inline hexload_real_t dot3(const hexload_real_t a[3], const hexload_real_t b[3]) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static inline void cross3(const hexload_real_t a[3], const hexload_real_t b[3], hexload_real_t out[3]) {
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}

/// P A = L U with partial pivoting: row i of the factors was row pivot[i] of A; unit diagonal of L not
/// stored.
typedef struct lu6 {
    hexload_real_t factor[6][6];
    hexload_real_t inverse_diagonal[6]; ///< of U
    unsigned pivot[6];
} lu6_t;

/// @return false when a pivot is below 64 epsilon of the largest entry: A is singular to working precision.
bool lu6_factor(hexload_real_t A[6][6], lu6_t* lu);

/// Solves A x = b.
void lu6_solve(const lu6_t* lu, const hexload_real_t b[6], hexload_real_t x[6]);

/// Solves A^T x = e_row: x is that row of A^-1.
void lu6_inverse_row(const lu6_t* lu, int row, hexload_real_t x[6]);

/// Lower triangle of L with A = L L^T, diagonal inverted; A symmetric, its lower triangle is read.
/// @return false when A is not positive definite.
bool cholesky3(hexload_real_t A[3][3], hexload_real_t L[3][3]);

/// x = L^-1 b for the L of cholesky3().
static inline void forward_substitute3(hexload_real_t L[3][3], const hexload_real_t b[3],
                                       hexload_real_t x[3]) {
    x[0] = b[0] * L[0][0];
    x[1] = (b[1] - L[1][0] * x[0]) * L[1][1];
    x[2] = (b[2] - L[2][0] * x[0] - L[2][1] * x[1]) * L[2][2];
}

#endif
