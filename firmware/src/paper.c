#include "hexload/paper.h"

#include "configuration/config_fields.h"
#include "paper_tick.h"

// The lasting memory of an estimator: 4-byte numbers, or 8-byte ones in the reference build.
_Static_assert(sizeof(hexload_paper_t) <= 1696 * sizeof(hexload_real_t) / sizeof(float),
               "an estimator fits in 1,696 bytes");

hexload_status_t hexload_paper_init(hexload_paper_t* self, const hexload_config_t* config) {
    hexload_kinematics_t kinematics;
    if (hexload_config_find_bad(config) >= 0) {
        return HEXLOAD_ERR_CONFIG;
    }
    const hexload_status_t status = hexload_kinematics_init(&kinematics, config);
    if (status != HEXLOAD_OK) {
        return status;
    }
    *self = (hexload_paper_t){.kinematics = kinematics};
    hexload_leg_sample_init(&self->leg_gate);
    hexload_noise_estimator_init(&self->noise_estimator);
    hexload_lost_channels_init(&self->lost);
    hexload_plausibility_init(&self->plausibility);
    hexload_known_mass_init(&self->known_mass, config);
    hexload_paper_filter_init(&self->filter, config);
    hexload_residual_test_init(&self->residual_test, HEXLOAD_PAPER_MEASUREMENTS);
    self->residual_test.has_begun = true; // no load change comes before, and the start may tell most
    hexload_hum_test_init(&self->hum_test, config);
    hexload_paper_supervisor_init(&self->supervisor);
    return HEXLOAD_OK;
}

hexload_status_t hexload_paper_tick(hexload_paper_t* self, const hexload_config_t* config,
                                    const hexload_leg_sample_t* sample, hexload_estimate_t* estimate) {
    return hexload_paper_run(self, config, sample, estimate, NULL);
}
