/// @file linalg_kernels.h
/// The kernels that take most of a tick, for linalg.h and linalg.c alone: a build for speed has them in each
/// caller, which makes of it what their numbers of columns allow; any other has them once. HEXLOAD_KERNEL:
/// their storage class.
#ifndef HEXLOAD_LINALG_KERNELS_H
#define HEXLOAD_LINALG_KERNELS_H

HEXLOAD_KERNEL hexload_real_t hexload_dot3(const hexload_real_t a[3], const hexload_real_t b[3]) {
    return dot3(a, b);
}

HEXLOAD_KERNEL void hexload_cross3(const hexload_real_t a[3], const hexload_real_t b[3],
                                   hexload_real_t out[3]) {
    cross3(a, b, out);
}

HEXLOAD_KERNEL void hexload_times3(const hexload_real_t* A, const hexload_real_t x[3],
                                   hexload_real_t out[3]) {
    times3(A, x, out);
}

HEXLOAD_KERNEL bool hexload_cholesky3(hexload_real_t A[3][3], hexload_real_t L[3][3]) {
    return cholesky3(A, L);
}

HEXLOAD_KERNEL void hexload_whiten6(hexload_real_t L[6][6], hexload_real_t* X, int columns) {
    hexload_real_t own[6][6];
    HEXLOAD_UNROLL
    for (int i = 0; i < 6; i++) {
        HEXLOAD_UNROLL
        for (int k = 0; k <= i; k++) {
            own[i][k] = L[i][k];
        }
    }
    for (int column = 0; column < columns; column++) {
        hexload_real_t x[6];
        HEXLOAD_UNROLL
        for (int i = 0; i < 6; i++) {
            x[i] = X[i * columns + column];
            HEXLOAD_UNROLL
            for (int k = 0; k < i; k++) {
                x[i] = hexload_fma(-own[i][k], x[k], x[i]);
            }
            x[i] *= own[i][i];
            X[i * columns + column] = x[i];
        }
    }
}

HEXLOAD_KERNEL void hexload_read_columns6(const hexload_real_t* X, int columns, int i,
                                          hexload_real_t u[2][6]) {
    HEXLOAD_UNROLL
    for (int a = 0; a < 6; a++) {
        u[0][a] = X[a * columns + i];
        u[1][a] = X[a * columns + i + 1];
    }
}

HEXLOAD_KERNEL void hexload_downdate6(hexload_real_t* row, hexload_real_t* next_row, hexload_real_t u[2][6],
                                      const hexload_real_t* X, int columns, int count) {
    hexload_real_t own[2][6];
    HEXLOAD_UNROLL
    for (int a = 0; a < 6; a++) {
        own[0][a] = u[0][a];
        own[1][a] = u[1][a];
    }
    for (int j = 0; j < count; j++) {
        hexload_real_t left = row[j];
        hexload_real_t next_left = next_row[j];
        HEXLOAD_UNROLL
        for (int a = 0; a < 6; a++) {
            const hexload_real_t x = X[a * columns + j];
            left = hexload_fma(-own[0][a], x, left);
            next_left = hexload_fma(-own[1][a], x, next_left);
        }
        row[j] = left;
        next_row[j] = next_left;
    }
}

#endif
