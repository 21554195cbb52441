/// @file body_model.h
/// Ten parameters seen from another point, and as a pseudo-inertia. Internal. Reentrant, constant time.
#ifndef HEXLOAD_BODY_MODEL_H
#define HEXLOAD_BODY_MODEL_H

#include "body/pseudo_inertia.h"
#include "hexload/estimate.h"

/// hexload_pseudo_inertia_is_positive() of theta as it is.
static inline bool hexload_body_is_consistent(const hexload_real_t theta[HEXLOAD_LOAD_DIM]) {
    static const hexload_real_t exact[HEXLOAD_LOAD_DIM] = {0};
    return hexload_pseudo_inertia_is_positive(theta, exact);
}

/// theta about another point, axes kept: h' = h - m r, and the tensor about r. Linear in theta.
void hexload_body_see_from(const hexload_real_t point_m[3], const hexload_real_t theta[HEXLOAD_LOAD_DIM],
                           hexload_real_t seen[HEXLOAD_LOAD_DIM]);

/// The covariance of what hexload_body_see_from() gives.
void hexload_body_spread_from(const hexload_real_t point_m[3],
                              const hexload_real_t covariance[HEXLOAD_LOAD_COVARIANCES],
                              hexload_real_t spread[HEXLOAD_LOAD_DIM][HEXLOAD_LOAD_DIM]);

/// The centre of mass, if the mass is known well enough for one.
bool hexload_body_find_com(const hexload_real_t theta[HEXLOAD_LOAD_DIM], hexload_real_t mass_variance_kg2,
                           hexload_real_t com_m[3]);

#endif
