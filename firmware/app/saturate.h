/// @file saturate.h
/// Counters that stay at their largest value. Internal to firmware/app.
#ifndef HEXLOAD_APP_SATURATE_H
#define HEXLOAD_APP_SATURATE_H

#include <stdint.h>

static inline void hexload_count(uint32_t* counter, uint32_t more) {
    *counter = more < UINT32_MAX - *counter ? *counter + more : UINT32_MAX;
}

#endif
