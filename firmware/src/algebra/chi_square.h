/// @file chi_square.h
/// Chi-square with 6 degrees of freedom: a sum of squares over six legs, or of six whitened momenta, where
/// there is nothing but noise. Internal.
#ifndef HEXLOAD_CHI_SQUARE_H
#define HEXLOAD_CHI_SQUARE_H

#include "hexload/types.h"

#define CHI_SQUARE_6_MEAN HEXLOAD_REAL(6.0)
#define CHI_SQUARE_6_95 HEXLOAD_REAL(12.59)  ///< exceeded in 5 % of all cases
#define CHI_SQUARE_6_999 HEXLOAD_REAL(22.46) ///< exceeded in 0.1 %

#endif
