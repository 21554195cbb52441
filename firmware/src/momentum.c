#include "hexload/momentum.h"

#include "algebra/leg_blocks.h"
#include "algebra/real.h"
#include "configuration/config_fields.h"
#include "configuration/momentum_prior.h"
#include "momentum_tick.h"

// The lasting memory of an estimator: 4-byte numbers, or 8-byte ones in the reference build.
_Static_assert(sizeof(hexload_momentum_t) <= (size_t)20 * 1024 * sizeof(hexload_real_t) / sizeof(float) ||
                   HEXLOAD_LAG_TICKS_MAX > 82,
               "an estimator fits in 20 KiB");

/// The noise of six speeds of legs, through J^-1.
HEXLOAD_RARE static void set_rate_gain(const hexload_leg_blocks_t* jacobian,
                                       hexload_smoother_constants_t* constants) {
    hexload_real_t twist[HEXLOAD_LEGS][6];
    hexload_leg_blocks_invert(jacobian, twist);
    for (int k = 0; k < 3; k++) {
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            constants->rate_gain[k] += twist[leg][3 + k] * twist[leg][3 + k];
        }
    }
}

HEXLOAD_RARE hexload_status_t hexload_momentum_init(hexload_momentum_t* self,
                                                    const hexload_config_t* config) {
    hexload_kinematics_t kinematics;
    if (hexload_config_find_bad(config) >= 0) {
        return HEXLOAD_ERR_CONFIG;
    }
    const hexload_status_t status = hexload_kinematics_init(&kinematics, config);
    if (status != HEXLOAD_OK) {
        return status;
    }
    *self = (hexload_momentum_t){.kinematics = kinematics, .delayed_kinematics = kinematics};
    hexload_leg_sample_init(&self->leg_gate);
    hexload_lost_channels_init(&self->lost);
    hexload_rig_history_init(&self->history);
    hexload_rig_twists_init(&self->twists);
    hexload_rig_slide_init(&self->slide);
    hexload_noise_estimator_init(&self->noise_estimator);
    hexload_plausibility_init(&self->plausibility);
    hexload_load_monitor_init(&self->monitor);
    hexload_smoother_init(&self->smoother, config);
    set_rate_gain(&kinematics.jacobian, &self->smoother.constants);
    hexload_momentum_filter_init(&self->filter, config);
    hexload_consider_init(&self->consider);
    hexload_jackknife_init(&self->jackknife);
    hexload_residual_test_init(&self->residual_test, HEXLOAD_MOMENTUM_MEASUREMENTS);
    hexload_oscillation_test_init(&self->oscillation);
    hexload_momentum_supervisor_init(&self->supervisor);
    self->is_mass_known = config->momentum.prior_mass_sigma_kg < hexload_momentum_open_mass_sigma_kg(config);
    return HEXLOAD_OK;
}

hexload_status_t hexload_momentum_tick(hexload_momentum_t* self, const hexload_config_t* config,
                                       const hexload_leg_sample_t* sample, hexload_estimate_t* estimate) {
    return hexload_momentum_run(self, config, NULL, sample, estimate, NULL);
}
