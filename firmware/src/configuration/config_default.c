#include "algebra/real.h"
#include "hexload/config.h"

#include <stddef.h>
#include <string.h>

/// All that is not zero of the default configuration, of which a rig's own parameters are the larger part.
typedef struct paper_machine {
    hexload_geometry_t geometry;
    hexload_platform_t platform;
    hexload_sensors_t sensors;
    hexload_tolerances_t tolerances;
    hexload_paper_config_t paper;
    hexload_momentum_config_t momentum;
} paper_machine_t;

// Paper, Table 1; hinges at radii 0.4 and 0.6 m, 15 and 10 degrees from the axes of symmetry.
static const paper_machine_t paper_machine = {
    .geometry =
        {.base_hinge_m = {{HEXLOAD_REAL(0.5908846518), HEXLOAD_REAL(0.1041889066), HEXLOAD_REAL(0.0)},
                          {HEXLOAD_REAL(-0.2052120860), HEXLOAD_REAL(0.5638155725), HEXLOAD_REAL(0.0)},
                          {HEXLOAD_REAL(-0.3856725658), HEXLOAD_REAL(0.4596266659), HEXLOAD_REAL(0.0)},
                          {HEXLOAD_REAL(-0.3856725658), HEXLOAD_REAL(-0.4596266659), HEXLOAD_REAL(0.0)},
                          {HEXLOAD_REAL(-0.2052120860), HEXLOAD_REAL(-0.5638155725), HEXLOAD_REAL(0.0)},
                          {HEXLOAD_REAL(0.5908846518), HEXLOAD_REAL(-0.1041889066), HEXLOAD_REAL(0.0)}},
         .platform_hinge_m = {{HEXLOAD_REAL(0.2828427125), HEXLOAD_REAL(0.2828427125), HEXLOAD_REAL(0.0)},
                              {HEXLOAD_REAL(0.1035276180), HEXLOAD_REAL(0.3863703305), HEXLOAD_REAL(0.0)},
                              {HEXLOAD_REAL(-0.3863703305), HEXLOAD_REAL(0.1035276180), HEXLOAD_REAL(0.0)},
                              {HEXLOAD_REAL(-0.3863703305), HEXLOAD_REAL(-0.1035276180), HEXLOAD_REAL(0.0)},
                              {HEXLOAD_REAL(0.1035276180), HEXLOAD_REAL(-0.3863703305), HEXLOAD_REAL(0.0)},
                              {HEXLOAD_REAL(0.2828427125), HEXLOAD_REAL(-0.2828427125), HEXLOAD_REAL(0.0)}},
         .home_leg_length_m = {HEXLOAD_REAL(0.8741), HEXLOAD_REAL(0.8741), HEXLOAD_REAL(0.8741),
                               HEXLOAD_REAL(0.8741), HEXLOAD_REAL(0.8741), HEXLOAD_REAL(0.8741)},
         .stroke_min_m = HEXLOAD_REAL(-0.3),
         .stroke_max_m = HEXLOAD_REAL(0.3)},
    .platform = {.mass_kg = HEXLOAD_REAL(100.0),
                 .inertia_kg_m2 = {HEXLOAD_REAL(25.0), HEXLOAD_REAL(25.0), HEXLOAD_REAL(44.0)}},
    .sensors = {.displacement_sigma_m = HEXLOAD_REAL(20e-6),
                .velocity_sigma_m_s = HEXLOAD_REAL(0.001),
                .force_sigma_n = HEXLOAD_REAL(5.0),
                .velocity_range_m_s = HEXLOAD_REAL(10.0),
                .force_range_n = HEXLOAD_REAL(1e6)},
    .tolerances = {.force_gain = HEXLOAD_REAL(0.005), // six load cells of 1 %, and gravity's 0.3 %
                   .platform_mass = HEXLOAD_REAL(0.03),
                   .platform_com_m = HEXLOAD_REAL(0.002),
                   .platform_inertia = HEXLOAD_REAL(0.06)}, // that mass, at a disc's rim
    .paper = {.load_mass_kg = HEXLOAD_REAL(500.0),
              .gate_nis = HEXLOAD_REAL(40.0), // chi-square, 3 degrees of freedom: 1e-8 of good innovations
              .inconsistent_nis = HEXLOAD_REAL(270000.0), // a factor of 300 on sigma, as the other filters'
              .nis_time_constant_s = HEXLOAD_REAL(0.5),
              .converged_relative_sigma = HEXLOAD_REAL(0.1),
              .longest_gap_ticks = 3, // at 3 Hz the trapezoid's error is then (2 pi 3 Hz 3 ms)^2 / 12 = 3e-4
              .longest_gate_ticks = 20},
    .momentum = {.longest_gap_ticks = 5,
                 .inconsistent_nis = HEXLOAD_REAL(9.0), // sigmas understated by 1.2
                 .nis_time_constant_s = HEXLOAD_REAL(0.5),
                 .converged_relative_sigma = HEXLOAD_REAL(0.05),
                 .excitation_time_constant_s = HEXLOAD_REAL(10.0),
                 .timing_s = HEXLOAD_REAL(0.5e-3)}, // half of a tick of 1 ms
};

void hexload_config_default(hexload_config_t* config) {
    memset(config, 0, sizeof *config);
    config->kind = HEXLOAD_KIND_MOMENTUM;
    config->tick_s = HEXLOAD_REAL(0.001);
    config->gravity_m_s2 = HEXLOAD_REAL(9.81);
    config->geometry = paper_machine.geometry;
    config->platform = paper_machine.platform;
    config->sensors = paper_machine.sensors;
    config->tolerances = paper_machine.tolerances;
    config->paper = paper_machine.paper;
    config->momentum = paper_machine.momentum;
    config->actuator_effects.friction_speed_m_s = HEXLOAD_REAL(5e-3);
    config->actuator_effects.friction_shape = HEXLOAD_REAL(2.0); // off by 0.77 of Coulomb's at most
    config->actuator_effects.leg_share = HEXLOAD_REAL(0.15); // half of it: six legs of 5 % of the platform
    config->rig.stribeck_speed_m_s = HEXLOAD_REAL(0.01);
    config->rig.reversal_speed_m_s = HEXLOAD_REAL(0.001);
    hexload_config_set_prior(config, HEXLOAD_PRIOR_SAFE);
    hexload_config_set_momentum(config);
}

void hexload_config_set_prior(hexload_config_t* config, hexload_prior_t prior) {
    hexload_paper_config_t* paper = &config->paper;
    if (prior == HEXLOAD_PRIOR_PRINTED) {
        paper->prior_dz_sigma_m = HEXLOAD_REAL(1.0);
        paper->prior_inertia_sigma_kg_m2[0] = HEXLOAD_REAL(3.1622777);
        paper->prior_inertia_sigma_kg_m2[1] = HEXLOAD_REAL(22.360680);
        paper->prior_inertia_sigma_kg_m2[2] = HEXLOAD_REAL(22.360680);
        return;
    }
    const hexload_real_t square_of_gyration_m2 = HEXLOAD_REAL(0.04472136); // sqrt(500) kg m^2 on 500 kg
    paper->prior_dz_sigma_m = HEXLOAD_REAL(0.31622777);
    for (int k = 0; k < 3; k++) {
        paper->prior_inertia_sigma_kg_m2[k] = square_of_gyration_m2 * paper->load_mass_kg;
    }
}

hexload_status_t hexload_config_set_gravity(hexload_config_t* config, const hexload_real_t gravity_m_s2[3]) {
    const hexload_real_t size =
        hexload_sqrt(gravity_m_s2[0] * gravity_m_s2[0] + gravity_m_s2[1] * gravity_m_s2[1] +
                     gravity_m_s2[2] * gravity_m_s2[2]);
    if (!isfinite(size) || !(gravity_m_s2[2] < HEXLOAD_REAL(0.0))) {
        return HEXLOAD_ERR_CONFIG;
    }
    // The shortest turn from u, upwards in base axes, to z: b - (u + z) (u + z) b / (1 + u z) + 2 z (u b).
    const hexload_real_t u[3] = {-gravity_m_s2[0] / size, -gravity_m_s2[1] / size, -gravity_m_s2[2] / size};
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        hexload_real_t* b = config->geometry.base_hinge_m[leg];
        const hexload_real_t aside_m = u[0] * b[0] + u[1] * b[1];
        const hexload_real_t share = aside_m / (HEXLOAD_REAL(1.0) + u[2]) + b[2];
        const hexload_real_t up_m = aside_m + u[2] * b[2];
        b[0] -= u[0] * share;
        b[1] -= u[1] * share;
        b[2] = up_m;
    }
    config->gravity_m_s2 = size;
    return HEXLOAD_OK;
}
