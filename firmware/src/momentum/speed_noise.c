#include "momentum/speed_noise.h"

#include "front_end/noise_estimator.h"

hexload_real_t hexload_speed_noise(hexload_smoother_t* smoother, uint32_t place, hexload_real_t sigma_m_s) {
    const hexload_real_t share = HEXLOAD_REAL(1.0) / (hexload_real_t)HEXLOAD_TRANSIENT_TICKS;
    const hexload_real_t all = HEXLOAD_THIRD_DIFFERENCE_SQUARE * (hexload_real_t)HEXLOAD_LEGS;
    const hexload_real_t* row[4];
    hexload_real_t sum = HEXLOAD_REAL(0.0);
    for (uint32_t k = 0; k < 4u; k++) {
        row[k] = smoother->velocity_m_s[(place + HEXLOAD_TRANSIENT_TICKS - k) % HEXLOAD_DELAY_CAPACITY];
    }
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        const hexload_real_t difference =
            hexload_third_difference(row[0][leg], row[1][leg], row[2][leg], row[3][leg]);
        sum = hexload_fma(difference, difference, sum);
    }
    smoother->noise_m2_s2 =
        hexload_fma(share / all, sum, (HEXLOAD_REAL(1.0) - share) * smoother->noise_m2_s2);
    return hexload_max(sigma_m_s * sigma_m_s, smoother->noise_m2_s2);
}
