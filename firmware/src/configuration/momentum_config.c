#include "algebra/real.h"
#include "configuration/momentum_prior.h"
#include "hexload/state.h"

/// Mean distance of the platform's hinges from O_A.
static hexload_real_t hinge_radius_m(const hexload_geometry_t* geometry) {
    hexload_real_t sum_m = HEXLOAD_REAL(0.0);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        const hexload_real_t* a = geometry->platform_hinge_m[leg];
        sum_m += hexload_sqrt(a[0] * a[0] + a[1] * a[1] + a[2] * a[2]);
    }
    return sum_m / (hexload_real_t)HEXLOAD_LEGS;
}

void hexload_config_set_momentum(hexload_config_t* config) {
    hexload_momentum_config_t* momentum = &config->momentum;
    const hexload_real_t mass_kg = hexload_momentum_open_mass_sigma_kg(config);
    const hexload_real_t reach_m = HEXLOAD_REAL(1.25) * hinge_radius_m(&config->geometry);
    const hexload_real_t allowed_m = config->sensors.velocity_sigma_m_s * config->tick_s / HEXLOAD_REAL(32.0);
    const hexload_real_t ratio = config->sensors.displacement_sigma_m / allowed_m;
    momentum->prior_mass_kg = HEXLOAD_REAL(0.0);
    momentum->prior_mass_sigma_kg = mass_kg;
    momentum->prior_moment_sigma_kg_m = mass_kg * reach_m;
    momentum->prior_inertia_sigma_kg_m2 = HEXLOAD_REAL(1.3333333) * mass_kg * reach_m * reach_m;
    config->actuator_effects.prior_bias_sigma_n = config->platform.mass_kg;
    config->actuator_effects.prior_coulomb_sigma_n = HEXLOAD_REAL(2.0) * config->platform.mass_kg;
    config->actuator_effects.prior_viscous_sigma_n_s_m = HEXLOAD_REAL(10.0) * config->platform.mass_kg;
    uint32_t lag = HEXLOAD_TRANSIENT_TICKS;
    while (lag < HEXLOAD_LAG_TICKS_MAX) {
        const hexload_real_t window = (hexload_real_t)(2 * lag + 1);
        if (HEXLOAD_REAL(12.0) * ratio * ratio <= window * window * window) {
            break;
        }
        lag++;
    }
    momentum->lag_ticks = lag;
}

void hexload_config_set_known_mass(hexload_config_t* config, hexload_real_t mass_kg) {
    config->paper.load_mass_kg = mass_kg;
    config->momentum.prior_mass_kg = mass_kg;
    config->momentum.prior_mass_sigma_kg = HEXLOAD_REAL(1e-3) * mass_kg;
}
