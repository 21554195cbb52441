/// @file wrench.h
/// Third stage: the legs' forces as one wrench on the platform. Paper (12).
#ifndef HEXLOAD_WRENCH_H
#define HEXLOAD_WRENCH_H

#include "front_end/kinematics.h"

/// [F; N] = J^T f (12), turned into platform axes, where the load's parameters are constant. Reentrant,
/// constant time.
void hexload_wrench_compute(const hexload_motion_t* motion, const hexload_leg_sample_t* sample,
                            hexload_wrench_t* wrench);

#endif
