#include "rivals.h"

#include <string.h>

/// out = A B, or A B^T.
static void multiply(const float* A, const float* B, float* out, int rows, int inner, int columns,
                     int is_transposed) {
    for (int i = 0; i < rows; i++) {
        for (int j = 0; j < columns; j++) {
            float sum = 0.0f;
            for (int k = 0; k < inner; k++) {
                sum += A[i * inner + k] * (is_transposed ? B[j * inner + k] : B[k * columns + j]);
            }
            out[i * columns + j] = sum;
        }
    }
}

/// Inverse of a symmetric positive definite matrix, by Gauss and Jordan without pivoting.
static void invert(float* A, float* inverse, int n) {
    for (int i = 0; i < n * n; i++) {
        inverse[i] = i % (n + 1) == 0 ? 1.0f : 0.0f;
    }
    for (int c = 0; c < n; c++) {
        const float scale = 1.0f / A[c * n + c];
        for (int k = 0; k < n; k++) {
            A[c * n + k] *= scale;
            inverse[c * n + k] *= scale;
        }
        for (int row = 0; row < n; row++) {
            const float factor = A[row * n + c];
            for (int k = 0; k < n && row != c; k++) {
                A[row * n + k] -= factor * A[c * n + k];
                inverse[row * n + k] -= factor * inverse[c * n + k];
            }
        }
    }
}

void dense_filter_step(rival_filter_t* self, const dense_input_t* dense, const rival_input_t* input) {
    enum { n = RIVAL_STATES, m = RATES };
    const float* F = &dense->F[0][0];
    const float* H = &dense->H[0][0];
    float* P = &self->P[0][0];
    float x[n], FP[n * n], PHt[n * m], S[m * m], S_inverse[m * m], K[n * m], KH[n * n], KHP[n * n];
    memcpy(x, self->x, sizeof x);
    multiply(F, x, self->x, n, n, 1, 0);
    multiply(F, P, FP, n, n, n, 0);
    multiply(FP, F, P, n, n, n, 1);
    for (int i = 0; i < m; i++) {
        for (int j = 0; j < m; j++) {
            P[i * n + j] += input->Q[i][j];
        }
    }
    multiply(P, H, PHt, n, n, m, 1);
    multiply(H, PHt, S, m, n, m, 0);
    for (int i = 0; i < m; i++) {
        for (int j = 0; j < m; j++) {
            S[i * m + j] += input->R[i][j];
        }
    }
    invert(S, S_inverse, m);
    multiply(PHt, S_inverse, K, n, m, m, 0);
    float innovation[m];
    multiply(H, self->x, innovation, m, n, 1, 0);
    for (int i = 0; i < m; i++) {
        innovation[i] = input->measured[i] - innovation[i];
    }
    multiply(K, innovation, x, n, m, 1, 0);
    multiply(K, H, KH, n, m, n, 0);
    multiply(KH, P, KHP, n, n, n, 0);
    for (int i = 0; i < n; i++) {
        self->x[i] += x[i];
        for (int j = 0; j < n; j++) {
            P[i * n + j] -= KHP[i * n + j];
        }
    }
}
