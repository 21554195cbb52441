#include "hexload/momentum.h"

#include "momentum_tick.h"

// The lasting memory of an estimator: 4-byte numbers, or 8-byte ones in the reference build.
_Static_assert(sizeof(hexload_momentum_effects_t) <=
                       (size_t)25 * 1024 * sizeof(hexload_real_t) / sizeof(float) ||
                   HEXLOAD_LAG_TICKS_MAX > 82,
               "an estimator fits in 25 KiB");

hexload_status_t hexload_momentum_effects_init(hexload_momentum_effects_t* self,
                                               const hexload_config_t* config) {
    const hexload_status_t status = hexload_momentum_init(&self->momentum, config);
    if (status == HEXLOAD_OK) {
        begin_effects(&self->momentum, config, &self->effects);
    }
    return status;
}

hexload_status_t hexload_momentum_effects_tick(hexload_momentum_effects_t* self,
                                               const hexload_config_t* config,
                                               const hexload_leg_sample_t* sample,
                                               hexload_estimate_t* estimate) {
    hexload_momentum_update_t update;
    return hexload_momentum_run(&self->momentum, config, &self->effects, sample, estimate, &update);
}

void hexload_momentum_effects_read(const hexload_momentum_effects_t* self, const hexload_estimate_t* estimate,
                                   hexload_effects_estimate_t* effects) {
    uint32_t open = 0;
    for (int k = 0; k < HEXLOAD_LOAD_DIM; k++) {
        open |= estimate->parameter_verdict[k] != HEXLOAD_VERDICT_CONVERGED ? (uint32_t)1 << k : 0;
    }
    hexload_actuator_effects_read(&self->effects.filter, effects->value, effects->sigma);
    effects->confounded_with_bias = self->effects.identifiability.bias_mask & open;
    effects->confounded_with_friction = self->effects.identifiability.friction_mask & open;
    effects->confounded_with_tilt = self->effects.identifiability.tilt_mask & open;
    effects->fastest_leg_m_s = self->effects.identifiability.fastest_leg_m_s;
}
