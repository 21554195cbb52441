/// Bodies of arbitrary parameters and covariances.
#include "bytes.h"

#include "hexload/estimate.h"

#include <math.h>

int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    bytes_t bytes = {data, size};
    const bool is_any = take_byte(&bytes) % 4 == 0; // else numbers of a size that bodies have
    hexload_real_t theta[HEXLOAD_LOAD_DIM], covariance[HEXLOAD_LOAD_COVARIANCES] = {0},
                                            nearest[HEXLOAD_LOAD_DIM];
    hexload_real_t distance = HEXLOAD_REAL(-1.0);
    hexload_body_t body;
    for (int k = 0; k < HEXLOAD_LOAD_DIM; k++) {
        theta[k] = (hexload_real_t)(is_any ? take_float(&bytes) : 4.0f * (float)(int8_t)take_byte(&bytes));
    }
    for (int k = 0, i = 0; k < HEXLOAD_LOAD_COVARIANCES; k++) {
        const bool is_diagonal = k == i * (i + 1) / 2 + i;
        const float small = (is_diagonal ? 10.0f : 0.1f) * (float)(int8_t)take_byte(&bytes);
        covariance[k] = (hexload_real_t)(is_any ? take_float(&bytes) : is_diagonal ? fabsf(small) : small);
        i += is_diagonal ? 1 : 0;
    }
    hexload_body_describe(theta, covariance, &body);
    const bool is_found = hexload_body_nearest(theta, covariance, nearest, &distance);
    PROMISE(!(distance < 0));
    if (is_found) {
        PROMISE(isfinite(distance));
        hexload_body_describe(nearest, covariance, &body);
        PROMISE(body.is_consistent);
    } else {
        PROMISE(memcmp(nearest, theta, sizeof theta) == 0);
    }
    return 0;
}
