/// @file paper_model.h
/// The paper's model of one tick, linearised: (25)-(28), (33)-(35).
#ifndef HEXLOAD_PAPER_MODEL_H
#define HEXLOAD_PAPER_MODEL_H

#include "paper/paper_filter.h"

/// Linear in the deviations of the state: d omega = N d theta + noise.
typedef struct hexload_paper_model {
    hexload_real_t rate_step_rad_s[3];        ///< dt omega'
    hexload_real_t by_dz[3];                  ///< N's first column (34); its third entry is zero
    hexload_real_t by_inertia[3];             ///< N's diagonal entries (34)
    hexload_real_t noise[3][3];               ///< Q of the rates, from the stated force noise; lower triangle
    hexload_jacobian_noise_t jacobian_noise;  ///< variances that force noise adds to N's entries, see D15
    hexload_real_t inertia_kg_m2[3];          ///< D
    hexload_real_t cautious_inertia_kg_m2[3]; ///< D of the derivatives
    /// Noise of a rate over the noise that it makes in the rate's derivative by its inertia, times -1.
    hexload_real_t noise_lever_kg_m2[3];
} hexload_paper_model_t;

/// Euler's equation about the common centre of mass from the last tick to this one, forces trapezoidal.
/// @param dt_s time since the last tick, > 0.
void hexload_paper_model_linearise(const hexload_paper_filter_t* filter, const hexload_config_t* config,
                                   const hexload_present_tick_t* now, const hexload_wrench_t* wrench,
                                   hexload_real_t dt_s, hexload_paper_model_t* model);

#endif
