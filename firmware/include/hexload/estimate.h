/// @file estimate.h
/// What goes into a tick, what comes out of it, and the body that it describes.
#ifndef HEXLOAD_ESTIMATE_H
#define HEXLOAD_ESTIMATE_H

#include "hexload/config.h"

#include <stdbool.h>

HEXLOAD_DECLS_BEGIN

/// All channels of all legs, taken at the same instant.
typedef struct hexload_leg_sample {
    uint32_t tick;                               ///< counts sampling periods; may wrap
    hexload_real_t displacement_m[HEXLOAD_LEGS]; ///< leg length minus home length
    hexload_real_t velocity_m_s[HEXLOAD_LEGS];   ///< its rate
    hexload_real_t force_n[HEXLOAD_LEGS];        ///< positive pushes the platform away from the base
} hexload_leg_sample_t;

/// theta, in the order of every array of ten: the load alone, platform axes, about O_A.
enum hexload_load_parameter {
    HEXLOAD_LOAD_M,   ///< mass, kg
    HEXLOAD_LOAD_HX,  ///< mass times centre of mass, kg m
    HEXLOAD_LOAD_HY,  ///< kg m
    HEXLOAD_LOAD_HZ,  ///< kg m
    HEXLOAD_LOAD_IXX, ///< entries of the inertia tensor, kg m^2; IXY = -integral of x y dm
    HEXLOAD_LOAD_IYY, ///< kg m^2
    HEXLOAD_LOAD_IZZ, ///< kg m^2
    HEXLOAD_LOAD_IXY, ///< kg m^2
    HEXLOAD_LOAD_IXZ, ///< kg m^2
    HEXLOAD_LOAD_IYZ, ///< kg m^2
    HEXLOAD_LOAD_DIM
};

/// Actuator effects, in the order of every array of twenty: six legs of the first, of the second, of the
/// third; then the tilt of the base, as what gravity's x and y have beside the configured, base axes, m/s^2.
enum hexload_actuator_effect {
    HEXLOAD_EFFECT_BIAS,    ///< of the force sensor, N
    HEXLOAD_EFFECT_COULOMB, ///< friction, N; opposes motion when positive
    HEXLOAD_EFFECT_VISCOUS, ///< friction, N s/m
    HEXLOAD_EFFECT_KINDS    ///< per leg
};

/// Parameters of the paper's filter, in the order of every array of four.
enum hexload_paper_parameter {
    HEXLOAD_PAPER_DZ,  ///< height of the load's centre of mass over O_A, m
    HEXLOAD_PAPER_IXX, ///< about the load's own centre of mass, kg m^2
    HEXLOAD_PAPER_IYY, ///< kg m^2
    HEXLOAD_PAPER_IZZ, ///< kg m^2
    HEXLOAD_PAPER_DIM
};

enum {
    HEXLOAD_PARAMETERS_MAX = HEXLOAD_LOAD_DIM,
    HEXLOAD_EFFECT_TILT = +HEXLOAD_EFFECT_KINDS * +HEXLOAD_LEGS, ///< where gravity's x stands
    HEXLOAD_EFFECTS_DIM = HEXLOAD_EFFECT_TILT + 2,
    /// Numbers of a symmetric matrix of theta, the lower triangle by rows.
    HEXLOAD_LOAD_COVARIANCES = HEXLOAD_LOAD_DIM * (HEXLOAD_LOAD_DIM + 1) / 2,
    HEXLOAD_MEASUREMENTS_MAX = 6,
};

/// How far one parameter can be trusted, or all of them (then the worst): a larger value is worse, and no
/// health bit is needed to read it. Before MISFIT sigma holds what is known; beyond CONVERGED the value is no
/// number to work with.
typedef enum hexload_verdict {
    /// Sigma is below converged_relative_sigma of the parameter's scale, but for the tolerances, which no
    /// motion lowers.
    HEXLOAD_VERDICT_CONVERGED,
    HEXLOAD_VERDICT_CONVERGING,  ///< the motion goes on lowering its sigma
    HEXLOAD_VERDICT_NOT_EXCITED, ///< the motion of the last seconds does not lower its sigma, or hardly
    /// The machine is not its model, or channels contradict each other: mend that. Sigma is widened, which
    /// holds for a machine that is a little off, not for wrong wiring or units.
    HEXLOAD_VERDICT_MISFIT,
    HEXLOAD_VERDICT_INCONSISTENT, ///< no body has such numbers, nor would with far larger sigmas
} hexload_verdict_t;

typedef struct hexload_estimate {
    uint32_t tick; ///< of the sample, sampling periods
    /// Ten parameters, enum hexload_load_parameter; of the paper's estimator the first four, enum
    /// hexload_paper_parameter. Units as there.
    hexload_real_t value[HEXLOAD_PARAMETERS_MAX];
    hexload_real_t sigma[HEXLOAD_PARAMETERS_MAX]; ///< standard deviation of each, same units
    /// The filter's part of sigma, which more motion lowers: without what the blocks of the run, mismatches,
    /// motion that may be none, gains that differ, the rig's directions and the tolerances add; same units.
    hexload_real_t own_sigma[HEXLOAD_PARAMETERS_MAX];
    hexload_verdict_t parameter_verdict[HEXLOAD_PARAMETERS_MAX]; ///< of each
    hexload_verdict_t verdict;                                   ///< the worst of them
    hexload_real_t nis;      ///< normalised innovation squared, 1; ideal mean 6, of the paper's estimator 3
    hexload_real_t nis_mean; ///< over nis_time_constant_s
} hexload_estimate_t;

/// What the estimator of actuator effects knows beside the load.
typedef struct hexload_effects_estimate {
    hexload_real_t value[HEXLOAD_EFFECTS_DIM]; ///< order and units of enum hexload_actuator_effect
    hexload_real_t sigma[HEXLOAD_EFFECTS_DIM]; ///< standard deviation of each, same units
    uint32_t confounded_with_bias;     ///< bit k: load parameter k has not converged, as biases look like it
    uint32_t confounded_with_friction; ///< bit k: as friction looks like it
    uint32_t confounded_with_tilt;     ///< bit k: as a base that is not level looks like it
    hexload_real_t fastest_leg_m_s;    ///< of late; fades over excitation_time_constant_s
} hexload_effects_estimate_t;

/// What became of a tick's measurement.
typedef enum hexload_gate {
    HEXLOAD_GATE_NONE,     ///< no measurement: history is still short, a gap, or the filter began anew
    HEXLOAD_GATE_ACCEPTED, ///< used
    HEXLOAD_GATE_REJECTED, ///< beyond the gate, not used
} hexload_gate_t;

/// The measurement update of one tick, for who tunes or judges a filter. Momentum estimators: momentum
/// [N s; N m s] about the fixed home point of O_A, base axes, of lag_ticks ago; paper's: angular velocity,
/// rad/s, platform axes.
typedef struct {         // no tag: hexload_trace() has the name
    uint32_t tick;       ///< of the measurement, sampling periods
    uint32_t dimension;  ///< of the measurement: 6 or 3; the other entries are 0
    hexload_gate_t gate; ///< what became of it
    hexload_real_t innovation[HEXLOAD_MEASUREMENTS_MAX]; ///< measured minus predicted
    hexload_real_t variance[HEXLOAD_MEASUREMENTS_MAX];   ///< of the innovation as the filter expects it
    hexload_real_t nis;                                  ///< innovation squared over its whole covariance, 1
    /// The NIS of the sum of the whitened innovations over the last whole half second, and its leaky mean
    /// over 5 s; ideal 6 or 3, also where nis is too blind to see an error that lasts.
    hexload_real_t sum_nis;
    hexload_real_t sum_nis_mean;
} hexload_trace_t;

/// "converged", "converging", "not_excited", "misfit" or "inconsistent". Static storage.
const char* hexload_verdict_name(hexload_verdict_t verdict);

/// The load as a body: what ten parameters stand for, whether a body can have them, and the nearest ones that
/// it can have. EQUATIONS.md derives it.
///
///     hexload_covariance(&estimator, covariance);
///     hexload_body_describe(estimate.value, covariance, &body);
///     if (!body.is_consistent && hexload_body_nearest(estimate.value, covariance, nearest, &distance)) ...
///
/// No part of the tick: call it when you need the answer, between two ticks, or at leisure on a copy of value
/// and covariance. Pure functions, reentrant, of bounded time.
typedef struct hexload_body {
    hexload_real_t mass_kg;        ///< m
    hexload_real_t mass_sigma_kg;  ///< standard deviation, as all sigmas here
    hexload_real_t com_m[3];       ///< centre of mass c = h / m, platform axes
    hexload_real_t com_sigma_m[3]; ///< of each coordinate
    /// Tensor about the centre of mass, platform axes, in the order of enum hexload_inertia, and its signs.
    hexload_real_t inertia_kg_m2[HEXLOAD_I_DIM];
    hexload_real_t inertia_sigma_kg_m2[HEXLOAD_I_DIM]; ///< of each entry
    bool has_com;       ///< false: centre of mass and tensor are unknown, and zero with their sigmas
    bool has_inertia;   ///< false: the tensor is unknown, and zero with its sigmas
    bool is_consistent; ///< some body has these parameters: the pseudo-inertia is positive definite
} hexload_body_t;

/// Mass, centre of mass and central tensor, each with its sigma by first order from the whole covariance.
/// First order needs small errors: the centre of mass is unknown while the mass's sigma is beyond a tenth of
/// the mass (its mean is then off by up to 0.1 sigma, its sigma by 4 %); so is the tensor, and while what
/// first order leaves out, the square of the errors of h over m, may be beyond half a sigma of an entry.
/// @param theta enum hexload_load_parameter; finite.
/// @param covariance of theta, lower triangle by rows; positive semidefinite.
/// On a Cortex-M7 6,800 instructions at -O2, 2,900 at -O3.
void hexload_body_describe(const hexload_real_t theta[HEXLOAD_LOAD_DIM],
                           const hexload_real_t covariance[HEXLOAD_LOAD_COVARIANCES], hexload_body_t* body);

/// The parameters that a body can have and that are nearest to theta, measured in sigmas with the whole
/// covariance (Mahalanobis): to 0.01 sigma, or a hundredth of the distance when that is more. Their
/// pseudo-inertia is at least 1e-5 of the scale that theta and its sigmas have. From there it is never
/// farther to the truth, which is some body's, than from theta.
/// @param[out] nearest theta itself, to the bit, when it is consistent, and when the result is false.
/// @param[out] distance_sigmas from theta; 0 when it is consistent.
/// @return false when a number is not finite, or when 40 steps were not enough, which has been seen only of
/// estimates that are a hundred sigmas off.
/// On a Cortex-M7 at -O2 17,000 instructions a step, 700,000 for 40; estimates of a filter that has just
/// begun take 120,000 in the middle and 430,000, the longest found.
HEXLOAD_MUST_USE bool hexload_body_nearest(const hexload_real_t theta[HEXLOAD_LOAD_DIM],
                                           const hexload_real_t covariance[HEXLOAD_LOAD_COVARIANCES],
                                           hexload_real_t nearest[HEXLOAD_LOAD_DIM],
                                           hexload_real_t* distance_sigmas);

HEXLOAD_DECLS_END

#endif
