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

/// Inverse of A.
/// @return false when A is singular to working precision: its determinant is below 64 epsilon of the product
/// of its rows' lengths, which it is at most.
bool invert3(hexload_real_t A[3][3], hexload_real_t inverse[3][3]);

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
