#include "momentum/tolerances.h"

#include "algebra/real.h"

static hexload_real_t hypotenuse(hexload_real_t a, hexload_real_t b) {
    return hexload_sqrt(hexload_fma(a, a, b * b));
}

void hexload_tolerances_add_legs(hexload_tolerances_t* tolerances, hexload_real_t share) {
    tolerances->platform_mass = hypotenuse(tolerances->platform_mass, share);
    tolerances->platform_inertia = hypotenuse(tolerances->platform_inertia, share + share);
}

static hexload_real_t mean_moment(const hexload_real_t own[HEXLOAD_LOAD_DIM]) {
    const hexload_real_t third = HEXLOAD_REAL(1.0) / HEXLOAD_REAL(3.0);
    return third * (own[HEXLOAD_LOAD_IXX] + own[HEXLOAD_LOAD_IYY] + own[HEXLOAD_LOAD_IZZ]);
}

/// One standard deviation of a parameter of the platform, each independent of the others.
static inline hexload_real_t platform_sigma(const hexload_momentum_filter_t* filter, hexload_real_t mean,
                                            int k) {
    const hexload_tolerances_t* open = &filter->tolerances;
    const hexload_real_t* own = filter->platform;
    if (k == HEXLOAD_LOAD_M) {
        return open->platform_mass * own[HEXLOAD_LOAD_M];
    }
    if (k <= HEXLOAD_LOAD_HZ) {
        return open->platform_com_m * own[HEXLOAD_LOAD_M];
    }
    return open->platform_inertia * (k <= HEXLOAD_LOAD_IZZ ? own[k] : mean);
}

/// What all forces have in common.
static inline hexload_real_t of_gain(const hexload_momentum_filter_t* filter, int i, int j) {
    const hexload_real_t gain = filter->tolerances.force_gain;
    return gain * (filter->platform[i] + filter->theta[i]) * gain * (filter->platform[j] + filter->theta[j]);
}

hexload_real_t hexload_tolerances_covariance(const hexload_momentum_filter_t* filter, int i, int j) {
    const hexload_real_t mean = mean_moment(filter->platform);
    const hexload_real_t of_platform = i == j ? platform_sigma(filter, mean, i) : HEXLOAD_REAL(0.0);
    return of_gain(filter, i, j) + of_platform * of_platform;
}

void hexload_tolerances_widen(const hexload_momentum_filter_t* filter, hexload_real_t sigma[HEXLOAD_LOAD_DIM],
                              hexload_real_t variance[HEXLOAD_LOAD_DIM]) {
    const hexload_real_t mean = mean_moment(filter->platform);
    for (int k = 0; k < HEXLOAD_LOAD_DIM; k++) {
        const hexload_real_t of_platform = platform_sigma(filter, mean, k);
        variance[k] = of_gain(filter, k, k) + of_platform * of_platform;
        if (variance[k] > HEXLOAD_REAL(0.0)) {
            sigma[k] = hexload_sqrt(hexload_fma(sigma[k], sigma[k], variance[k]));
        }
    }
}
