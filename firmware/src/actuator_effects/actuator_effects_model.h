/// @file actuator_effects_model.h
/// Friction of a leg by its speed, and where the effects' covariance lies. Internal.
#ifndef HEXLOAD_ACTUATOR_EFFECTS_MODEL_H
#define HEXLOAD_ACTUATOR_EFFECTS_MODEL_H

#include "actuator_effects/actuator_effects.h"
#include "algebra/real.h"

/// Where row i of the effects begins in hexload_actuator_effects_t.covariance: theta, mu, then effects 0..i.
#define EFFECT_ROW(i) ((i)*HEXLOAD_MOMENTUM_STATES + (i) * ((i) + 1) / 2)

/// Covariance of two effects.
static inline hexload_real_t effects_covariance(const hexload_actuator_effects_t* self, int i, int j) {
    return self->covariance[HEXLOAD_MOMENTUM_STATES + (j <= i ? EFFECT_ROW(i) + j : EFFECT_ROW(j) + i)];
}

/// s(v) = v / sqrt(v^2 + v0^2), the sign of a speed, smooth about zero, and its slope s'(v) in s/m.
typedef struct friction_sign {
    hexload_real_t value;
    hexload_real_t slope_s_m;
} friction_sign_t;

static inline friction_sign_t friction_sign_of(hexload_real_t speed_m_s, hexload_real_t friction_speed_m_s) {
    const hexload_real_t inverse =
        HEXLOAD_REAL(1.0) / hexload_sqrt(speed_m_s * speed_m_s + friction_speed_m_s * friction_speed_m_s);
    const hexload_real_t share = friction_speed_m_s * inverse;
    return (friction_sign_t){.value = speed_m_s * inverse, .slope_s_m = share * share * inverse};
}

#endif
