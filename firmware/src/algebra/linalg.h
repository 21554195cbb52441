/// @file linalg.h
/// Fixed-size kernels of the core. Outputs never alias inputs. Reentrant, constant time. Matrices that are
/// only read are not const, because C11 does not convert a matrix to a const one.
#ifndef HEXLOAD_LINALG_H
#define HEXLOAD_LINALG_H

#include "algebra/real.h"

#include <stdbool.h>

/// Where row i of a lower triangle begins that is stored by rows.
#define ROW(i) ((i) * ((i) + 1) / 2)

static inline hexload_real_t dot3(const hexload_real_t a[3], const hexload_real_t b[3]) {
    return hexload_fma(a[2], b[2], hexload_fma(a[1], b[1], a[0] * b[0]));
}

static inline hexload_real_t dot4(const hexload_real_t a[4], const hexload_real_t b[4]) {
    return hexload_fma(a[3], b[3], dot3(a, b));
}

static inline hexload_real_t dot6(const hexload_real_t a[6], const hexload_real_t b[6]) {
    return hexload_fma(
        a[5], b[5],
        hexload_fma(a[4], b[4],
                    hexload_fma(a[3], b[3], hexload_fma(a[2], b[2], hexload_fma(a[1], b[1], a[0] * b[0])))));
}

static inline void cross3(const hexload_real_t a[3], const hexload_real_t b[3], hexload_real_t out[3]) {
    out[0] = hexload_fma(a[1], b[2], -(a[2] * b[1]));
    out[1] = hexload_fma(a[2], b[0], -(a[0] * b[2]));
    out[2] = hexload_fma(a[0], b[1], -(a[1] * b[0]));
}

/// A x, A of three rows of three.
static inline void times3(const hexload_real_t* A, const hexload_real_t x[3], hexload_real_t out[3]) {
    out[0] = dot3(&A[0], x);
    out[1] = dot3(&A[3], x);
    out[2] = dot3(&A[6], x);
}

/// Inverse of A.
/// @return false when A is singular to working precision: its determinant is below 64 epsilon of the product
/// of its rows' lengths, which it is at most.
bool hexload_invert3(hexload_real_t A[3][3], hexload_real_t inverse[3][3]);

/// Lower triangle of L with A = L L^T, diagonal inverted; A symmetric, its lower triangle is read.
/// @return false when A is not positive definite.
static inline bool cholesky3(hexload_real_t A[3][3], hexload_real_t L[3][3]) {
    HEXLOAD_UNROLL
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j < i; j++) {
            hexload_real_t sum = A[i][j];
            for (int k = 0; k < j; k++) {
                sum = hexload_fma(-L[i][k], L[j][k], sum);
            }
            L[i][j] = sum * L[j][j];
        }
        hexload_real_t pivot = A[i][i];
        for (int k = 0; k < i; k++) {
            pivot = hexload_fma(-L[i][k], L[i][k], pivot);
        }
        if (!(pivot > HEXLOAD_REAL(0.0))) { // also refuses NaN
            return false;
        }
        L[i][i] = HEXLOAD_REAL(1.0) / hexload_sqrt(pivot);
    }
    return true;
}

/// Lower triangle of L with A = L L^T, diagonal inverted, in place; A positive definite, its lower triangle
/// is read.
void hexload_cholesky6(hexload_real_t A[6][6]);

/// Storage class of kernels: a build for speed has them in each caller.
#ifdef HEXLOAD_INLINE_KERNELS
#define HEXLOAD_KERNEL static inline
#include "algebra/linalg_kernels.h"
#else
#define HEXLOAD_KERNEL
/// The same as above, for code that is made small.
hexload_real_t hexload_dot3(const hexload_real_t a[3], const hexload_real_t b[3]);
void hexload_cross3(const hexload_real_t a[3], const hexload_real_t b[3], hexload_real_t out[3]);
void hexload_times3(const hexload_real_t* A, const hexload_real_t x[3], hexload_real_t out[3]);
bool hexload_cholesky3(hexload_real_t A[3][3], hexload_real_t L[3][3]);

/// X = L^-1 X for the L of hexload_cholesky6() and a matrix X of six rows.
void hexload_whiten6(hexload_real_t L[6][6], hexload_real_t* X, int columns);

/// Two columns of a matrix of six rows, i and the next.
void hexload_read_columns6(const hexload_real_t* X, int columns, int i, hexload_real_t u[2][6]);

/// Two rows -= u^T X for the first `count` of the columns of a matrix X of six rows.
void hexload_downdate6(hexload_real_t* row, hexload_real_t* next_row, hexload_real_t u[2][6],
                       const hexload_real_t* X, int columns, int count);
#endif

/// The same for a row and the next one of a matrix with as many columns as X.
static inline void downdate6_twice(hexload_real_t* row, hexload_real_t u[2][6], const hexload_real_t* X,
                                   int columns, int count) {
    hexload_downdate6(row, &row[columns], u, X, columns, count);
}

/// x = L^-1 b for the L of cholesky3().
static inline void forward_substitute3(hexload_real_t L[3][3], const hexload_real_t b[3],
                                       hexload_real_t x[3]) {
    x[0] = b[0] * L[0][0];
    x[1] = hexload_fma(-L[1][0], x[0], b[1]) * L[1][1];
    x[2] = hexload_fma(-L[2][1], x[1], hexload_fma(-L[2][0], x[0], b[2])) * L[2][2];
}

#endif
