/// @file health.h
/// Bookkeeping of a tick that both estimators share. Internal.
#ifndef HEXLOAD_HEALTH_H
#define HEXLOAD_HEALTH_H

#include "hexload/types.h"

/// Sets a health bit of the present tick. Reentrant, constant time.
static inline void hexload_health_set(uint32_t* bits, hexload_health_bit_t bit) {
    const uint32_t one = 1;
    *bits |= one << bit;
}

/// Counts a refused sample. @return status.
hexload_status_t hexload_health_refuse(hexload_health_t* health, hexload_status_t status);

/// Takes over the bits of an accepted tick and counts each.
void hexload_health_count(hexload_health_t* health, uint32_t bits);

#endif
