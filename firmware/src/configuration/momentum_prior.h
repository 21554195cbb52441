/// @file momentum_prior.h
/// What is taken of a load of which nothing is known. Internal.
#ifndef HEXLOAD_MOMENTUM_PRIOR_H
#define HEXLOAD_MOMENTUM_PRIOR_H

#include "hexload/config.h"

/// A few times the platform's own mass.
static inline hexload_real_t hexload_momentum_open_mass_sigma_kg(const hexload_config_t* config) {
    return HEXLOAD_REAL(3.0) * config->platform.mass_kg;
}

#endif
