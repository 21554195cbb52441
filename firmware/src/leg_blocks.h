/// @file leg_blocks.h
/// The leg Jacobian, rows [e, (R a) x e] with |e| = 1, taken apart in blocks of 3 x 3. Reentrant, constant
/// time.
#ifndef HEXLOAD_LEG_BLOCKS_H
#define HEXLOAD_LEG_BLOCKS_H

#include "hexload/kinematics.h"

#include <stdbool.h>

/// @return false when J is singular to working precision.
bool leg_blocks_make(hexload_real_t J[HEXLOAD_LEGS][6], hexload_leg_blocks_t* blocks);

/// Solves J x = y.
void leg_blocks_solve(const hexload_leg_blocks_t* blocks, const hexload_real_t y[HEXLOAD_LEGS],
                      hexload_real_t x[6]);

/// Lower half of J^-1.
void leg_blocks_rate_gain(const hexload_leg_blocks_t* blocks, hexload_real_t gain[3][HEXLOAD_LEGS]);

#endif
