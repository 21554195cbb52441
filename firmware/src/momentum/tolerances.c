#include "momentum/tolerances.h"

/// One standard deviation of a parameter of the platform, each independent of the others.
static hexload_real_t platform_sigma(const hexload_momentum_filter_t* filter, int k) {
    const hexload_tolerances_t* open = &filter->tolerances;
    const hexload_real_t* own = filter->platform;
    if (k == HEXLOAD_LOAD_M) {
        return open->platform_mass * own[HEXLOAD_LOAD_M];
    }
    if (k <= HEXLOAD_LOAD_HZ) {
        return open->platform_com_m * own[HEXLOAD_LOAD_M];
    }
    const hexload_real_t third = HEXLOAD_REAL(1.0) / HEXLOAD_REAL(3.0);
    const hexload_real_t mean =
        third * (own[HEXLOAD_LOAD_IXX] + own[HEXLOAD_LOAD_IYY] + own[HEXLOAD_LOAD_IZZ]);
    return open->platform_inertia * (k <= HEXLOAD_LOAD_IZZ ? own[k] : mean);
}

hexload_real_t hexload_tolerances_covariance(const hexload_momentum_filter_t* filter, int i, int j) {
    const hexload_real_t gain = filter->tolerances.force_gain;
    const hexload_real_t of_platform = i == j ? platform_sigma(filter, i) : HEXLOAD_REAL(0.0);
    return gain * (filter->platform[i] + filter->theta[i]) * gain * (filter->platform[j] + filter->theta[j]) +
           of_platform * of_platform;
}

void hexload_tolerances_widen(const hexload_momentum_filter_t* filter,
                              hexload_real_t sigma[HEXLOAD_LOAD_DIM]) {
    for (int k = 0; k < HEXLOAD_LOAD_DIM; k++) {
        const hexload_real_t variance = hexload_tolerances_covariance(filter, k, k);
        if (variance > HEXLOAD_REAL(0.0)) {
            sigma[k] = hexload_sqrt(hexload_fma(sigma[k], sigma[k], variance));
        }
    }
}
