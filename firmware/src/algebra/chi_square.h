/// @file chi_square.h
/// Chi-square with 6 degrees of freedom: a sum of squares over six legs, or of six whitened momenta, where
/// there is nothing but noise. Internal.
#ifndef HEXLOAD_CHI_SQUARE_H
#define HEXLOAD_CHI_SQUARE_H

#include "algebra/real.h"

#define CHI_SQUARE_6_MEAN HEXLOAD_REAL(6.0)
#define CHI_SQUARE_6_95 HEXLOAD_REAL(12.59)  ///< exceeded in 5 % of all cases
#define CHI_SQUARE_6_999 HEXLOAD_REAL(22.46) ///< exceeded in 0.1 %

/// How much is kept of six numbers that may be noise, whose squares in sigmas add up to this: nothing of what
/// noise alone is in 95 % of all cases, of the rest the less the smaller (James, Stein 1961).
static inline hexload_real_t hexload_beyond_noise(hexload_real_t square) {
    return hexload_max(HEXLOAD_REAL(0.0), HEXLOAD_REAL(1.0) - CHI_SQUARE_6_95 / square);
}

#endif
