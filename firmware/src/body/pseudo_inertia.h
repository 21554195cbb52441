/// @file pseudo_inertia.h
/// Whether ten parameters are physically consistent: some distribution of mass has them. Internal.
///
/// That is so when the pseudo-inertia, [second moments of mass, h; h^T, m], is positive definite (Wensing,
/// Kim, Slotine, IEEE RA-L 2018, doi:10.1109/LRA.2017.2729659).
#ifndef HEXLOAD_PSEUDO_INERTIA_H
#define HEXLOAD_PSEUDO_INERTIA_H

#include "hexload/estimate.h"

#include <stdbool.h>

/// @param sigma of theta: three of them are granted to each parameter; zeros: none. Reentrant, constant time.
bool hexload_pseudo_inertia_is_positive(const hexload_real_t theta[HEXLOAD_LOAD_DIM],
                                        const hexload_real_t sigma[HEXLOAD_LOAD_DIM]);

#endif
