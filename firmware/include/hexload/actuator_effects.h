/// @file actuator_effects.h
/// What the legs' force sensors show beside the force on the platform, as more states beside the momentum
/// filter's: a bias, Coulomb friction and viscous friction of each leg. EQUATIONS.md derives it.
///
///     f = force on the platform + bias + coulomb s(v) + viscous v,   s(v) = v / sqrt(v^2 + v0^2)
///
/// so mu' loses Jw^T times the last three: the model stays linear in all unknowns. v is the smoother's leg
/// speed, whose noise is not that tick's velocity sensor's.
#ifndef HEXLOAD_ACTUATOR_EFFECTS_FILTER_H
#define HEXLOAD_ACTUATOR_EFFECTS_FILTER_H

#include "hexload/momentum_filter.h"

HEXLOAD_DECLS_BEGIN

/// Effects, in the order of every array of eighteen: six legs of the first, of the second, of the third.
enum hexload_actuator_effect {
    HEXLOAD_EFFECT_BIAS,    ///< N
    HEXLOAD_EFFECT_COULOMB, ///< N, opposes motion when positive
    HEXLOAD_EFFECT_VISCOUS, ///< N s/m
    HEXLOAD_EFFECT_KINDS
};

enum {
    HEXLOAD_EFFECTS_DIM = 3 * HEXLOAD_LEGS,
    /// Rows of the effects in a lower triangle by rows that begins with the momentum filter's states.
    HEXLOAD_EFFECTS_COVARIANCES =
        HEXLOAD_EFFECTS_DIM * HEXLOAD_MOMENTUM_STATES + HEXLOAD_EFFECTS_DIM * (HEXLOAD_EFFECTS_DIM + 1) / 2,
};

/// Eighteen states that go with those of a momentum filter.
typedef struct hexload_actuator_effects {
    hexload_real_t effect[HEXLOAD_EFFECTS_DIM];
    hexload_real_t covariance[HEXLOAD_EFFECTS_COVARIANCES]; ///< the momentum filter's covariance goes on here
    hexload_real_t last_push[HEXLOAD_LEGS][6];              ///< Jw at the last sample, leg by leg
    hexload_real_t last_sign[HEXLOAD_LEGS];                 ///< s(v)
    hexload_real_t last_speed_m_s[HEXLOAD_LEGS];
    /// What the smoother leaves of the legs' speeds, beyond the velocity sensors' noise: leaky mean square.
    hexload_real_t left_m2_s2;
    uint32_t ticks;      ///< that it goes back
    uint32_t rest_ticks; ///< how long no motion has stood out of the smoother's noise
} hexload_actuator_effects_t;

/// No effects, with the configured sigmas; an effect of sigma zero stays zero.
void hexload_actuator_effects_init(hexload_actuator_effects_t* self, const hexload_config_t* config);

/// hexload_momentum_filter_step() of all states together.
/// @param load theta and mu. Reentrant; time as there.
/// @return false when the platform has been at rest for seconds: there is nothing more to be learnt, and the
/// sensors' noise would be taken for motion. Nothing has been done then, and mu must begin anew.
HEXLOAD_MUST_USE bool
hexload_actuator_effects_step(hexload_actuator_effects_t* self, hexload_momentum_filter_t* load,
                              const hexload_config_t* config, const hexload_sensors_t* sensors,
                              const hexload_smoother_constants_t* smoother,
                              const hexload_smooth_sample_t* sample, const hexload_motion_t* motion,
                              const hexload_leg_blocks_t* jacobian);

/// The load has changed, the machine has not: what is known of the effects stays, what they have in common
/// with the old load goes. With hexload_momentum_filter_forget(load).
void hexload_actuator_effects_forget(hexload_actuator_effects_t* self);

/// False when a number is not finite: then only hexload_actuator_effects_init() helps.
bool hexload_actuator_effects_is_finite(const hexload_actuator_effects_t* self);

/// Estimates and their standard deviations.
void hexload_actuator_effects_read(const hexload_actuator_effects_t* self,
                                   hexload_real_t value[HEXLOAD_EFFECTS_DIM],
                                   hexload_real_t sigma[HEXLOAD_EFFECTS_DIM]);

/// A sample of the present without the known effects, and sensors whose force sigma covers the unknown ones.
/// @param memory_s how long the errors of the effects add up in what is to be computed from the sample.
void hexload_actuator_effects_clean(const hexload_actuator_effects_t* self, const hexload_config_t* config,
                                    hexload_real_t memory_s, hexload_leg_sample_t* sample,
                                    hexload_sensors_t* sensors);

HEXLOAD_DECLS_END

#endif
