/// @file leg_blocks.h
/// The leg Jacobian, rows [e, (R a) x e] with |e| = 1, taken apart in blocks of 3 x 3. Reentrant, constant
/// time.
#ifndef HEXLOAD_LEG_BLOCKS_H
#define HEXLOAD_LEG_BLOCKS_H

#include "hexload/state.h"

#include <stdbool.h>
#include <string.h>

/// @return false when J is singular to working precision.
bool hexload_leg_blocks_make(hexload_real_t J[HEXLOAD_LEGS][6], hexload_leg_blocks_t* blocks);

/// The same with the carriers that blocks->leg names, a permutation of the legs, while they span space well;
/// otherwise with others. Cheaper in a pose near the one for which they were chosen.
bool hexload_leg_blocks_update(hexload_real_t J[HEXLOAD_LEGS][6], hexload_leg_blocks_t* blocks);

/// By members, which compilers copy in place, several numbers at a time; for the whole they call memcpy().
static inline void leg_blocks_copy(const hexload_leg_blocks_t* from, hexload_leg_blocks_t* to) {
    memcpy(to->leg, from->leg, sizeof to->leg);
    memcpy(to->E1_inverse, from->E1_inverse, sizeof to->E1_inverse);
    memcpy(to->M1, from->M1, sizeof to->M1);
    memcpy(to->K, from->K, sizeof to->K);
    memcpy(to->S_inverse, from->S_inverse, sizeof to->S_inverse);
}

/// Solves J x = y.
void hexload_leg_blocks_solve(const hexload_leg_blocks_t* blocks, const hexload_real_t y[HEXLOAD_LEGS],
                              hexload_real_t x[6]);

/// J^-1 by columns: row i is the twist at which leg i moves at unit speed and the others stand.
void hexload_leg_blocks_invert(const hexload_leg_blocks_t* blocks, hexload_real_t columns[HEXLOAD_LEGS][6]);

#endif
