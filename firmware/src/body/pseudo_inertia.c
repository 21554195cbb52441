#include "body/pseudo_inertia.h"

#include "algebra/linalg.h"

bool hexload_pseudo_inertia_is_positive(const hexload_real_t theta[HEXLOAD_LOAD_DIM],
                                        const hexload_real_t sigma[HEXLOAD_LOAD_DIM]) {
    const hexload_real_t half = HEXLOAD_REAL(0.5);
    const hexload_real_t* h = &theta[HEXLOAD_LOAD_HX];
    const hexload_real_t* I = &theta[HEXLOAD_LOAD_IXX];
    const hexload_real_t* s = &sigma[HEXLOAD_LOAD_IXX];
    const hexload_real_t granted = HEXLOAD_REAL(1.5) * (s[0] + s[1] + s[2]);
    const hexload_real_t half_trace = half * (I[0] + I[1] + I[2]) + granted;
    const hexload_real_t mass_kg = theta[HEXLOAD_LOAD_M] + HEXLOAD_REAL(3.0) * sigma[HEXLOAD_LOAD_M];
    hexload_real_t moments[3][3]; // Schur complement of m: second moments about the centre of mass
    hexload_real_t L[3][3];
    if (!(mass_kg > HEXLOAD_REAL(0.0))) {
        return false;
    }
    for (int i = 0; i < 3; i++) {
        for (int j = 0; j <= i; j++) { // the lower triangle is read
            const hexload_real_t moment = i == j ? half_trace - I[i] : -I[HEXLOAD_I_XY + (i + j - 1)];
            moments[i][j] = moment - h[i] * h[j] / mass_kg;
        }
        moments[i][i] += hexload_abs(h[i]) * HEXLOAD_REAL(6.0) * sigma[HEXLOAD_LOAD_HX + i] / mass_kg;
    }
    return hexload_cholesky3(moments, L);
}
