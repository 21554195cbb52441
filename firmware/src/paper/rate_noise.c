#include "paper/rate_noise.h"

#include "algebra/linalg.h"

void hexload_rate_noise(const hexload_leg_blocks_t* blocks, hexload_real_t T[3][3],
                        hexload_real_t noise[3][3]) {
    hexload_real_t square[3][3]; // omega = S^-1 z with z = y2 - K y1, whose covariance is E + K K^T
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k <= i; k++) {
            square[i][k] =
                dot3(blocks->K[i], blocks->K[k]) + (i == k ? HEXLOAD_REAL(1.0) : HEXLOAD_REAL(0.0));
            square[k][i] = square[i][k];
        }
    }
    hexload_real_t gain[3][3];
    HEXLOAD_UNROLL
    for (int i = 0; i < 3; i++) {
        HEXLOAD_UNROLL
        for (int k = 0; k < 3; k++) {
            gain[i][k] =
                hexload_fma(T[i][2], blocks->S_inverse[2][k],
                            hexload_fma(T[i][1], blocks->S_inverse[1][k], T[i][0] * blocks->S_inverse[0][k]));
        }
    }
    for (int i = 0; i < 3; i++) {
        hexload_real_t product[3];
        for (int k = 0; k < 3; k++) {
            product[k] = dot3(square[k], gain[i]); // square is symmetric
        }
        for (int k = 0; k <= i; k++) {
            noise[i][k] = dot3(product, gain[k]);
        }
    }
}
