#include "configuration/health.h"

hexload_status_t hexload_health_refuse(hexload_health_t* health, hexload_status_t status) {
    if (health->refused < UINT32_MAX) {
        health->refused++;
    }
    return status;
}

void hexload_health_count(hexload_health_t* health, uint32_t bits) {
    health->bits = bits;
    uint32_t left = bits & ((1u << HEXLOAD_HEALTH_BITS) - 1u);
    for (int bit = 0; left != 0; bit++) {
        if ((left & 1u) != 0 && health->count[bit] < UINT32_MAX) {
            health->count[bit]++;
        }
        left >>= 1;
    }
}
