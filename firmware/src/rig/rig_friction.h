/// @file rig_friction.h
/// What is not known of a leg's friction when it is slow or turns round. Internal.
#ifndef HEXLOAD_RIG_FRICTION_H
#define HEXLOAD_RIG_FRICTION_H

#include "hexload/config.h"

/// Friction is known to no more than a share of itself, and errs for so long on end that white noise of as
/// many ticks times the variance does the same.
#define RIG_UNKNOWN_SHARE HEXLOAD_REAL(0.3)
#define RIG_UNKNOWN_S HEXLOAD_REAL(0.05)

static inline hexload_real_t hexload_rig_unknown_ticks(const hexload_config_t* config) {
    return RIG_UNKNOWN_S / config->tick_s;
}

#endif
