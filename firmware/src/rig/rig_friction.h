/// @file rig_friction.h
/// What is not known of a leg's friction when it is slow or turns round. Internal.
#ifndef HEXLOAD_RIG_FRICTION_H
#define HEXLOAD_RIG_FRICTION_H

#include "hexload/real.h"

/// Friction is known to no more than a share of itself, and errs for so many ticks on end that white noise of
/// their number times the variance does the same.
#define RIG_UNKNOWN_SHARE HEXLOAD_REAL(0.3)
#define RIG_UNKNOWN_TICKS HEXLOAD_REAL(50.0)

#endif
