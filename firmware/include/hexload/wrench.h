/// @file wrench.h
/// Third stage: the legs' forces as one wrench on the platform. Paper (12).
#ifndef HEXLOAD_WRENCH_H
#define HEXLOAD_WRENCH_H

#include "hexload/kinematics.h"

HEXLOAD_DECLS_BEGIN

/// Wrench of the legs on the platform, moment about O_A.
typedef struct hexload_wrench {
    hexload_real_t force_n[3];   ///< platform axes
    hexload_real_t moment_nm[3]; ///< platform axes
} hexload_wrench_t;

/// [F; N] = J^T f (12), turned into platform axes, where the load's parameters are constant. Reentrant,
/// constant time.
void hexload_wrench_compute(const hexload_motion_t* motion, const hexload_leg_sample_t* sample,
                            hexload_wrench_t* wrench);

HEXLOAD_DECLS_END

#endif
