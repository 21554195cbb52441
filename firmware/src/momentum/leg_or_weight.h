/// @file leg_or_weight.h
/// Whether a wrench that is suddenly missing is another load's weight, or one leg's sensor that is suddenly
/// off. Internal.
///
/// What is missing, w, of wrench_monitor.h, is told by what it does to the legs, y = J M^-1 w, M the inertia
/// of platform and load about O_A. A speed that one sensor gets wrong is in one component of y, a
/// force that one gets wrong a column of P = J M^-1 J^T; a weight, wherever it is, is a force along g - a and
/// a moment across it, and moves all legs. The noise of y is that of the speeds' differences, alike in all
/// legs, and of the forces:
///
///     s^2 = kept (sigma_v / memory)^2 + tick / (2 memory - tick) sigma_f^2 |P|^2 / 6
///
/// Of y^T y / s^2 each kind explains what its least squares do; half of what one explains more than another
/// is the log of their odds.
#ifndef HEXLOAD_LEG_OR_WEIGHT_H
#define HEXLOAD_LEG_OR_WEIGHT_H

#include "front_end/present_tick.h"

/// What is missing.
typedef struct hexload_missing {
    const hexload_real_t* wrench; ///< about O_A, base axes, N and N m: `lasting` of hexload_wrench_monitor_t
    const hexload_real_t* pull_m_s2; ///< acceleration of the platform less gravity's, base axes
    const hexload_real_t* body;      ///< theta of platform and load, HEXLOAD_LOAD_DIM
    hexload_real_t kept;             ///< of the variance of speeds, what the wrench's mean keeps
} hexload_missing_t;

/// Its square in variances of its noise, and how much of that is explained.
typedef struct hexload_explained {
    hexload_real_t whole;
    hexload_real_t by_weight; ///< of the size and place that explain most
    hexload_real_t by_leg;    ///< by a force or a speed of the leg that explains most
} hexload_explained_t;

/// Some 2,000 instructions. Of a body that no mass has all three are not a number. Reentrant, constant time.
void hexload_explain_missing(const hexload_config_t* config, const hexload_present_tick_t* now,
                             const hexload_missing_t* missing, hexload_explained_t* explained);

#endif
