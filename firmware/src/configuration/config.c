#include "hexload/config.h"

#include "hexload/state.h"

#include <stdbool.h>
#include <stddef.h>
#include <string.h>

/// All that is not zero of the default configuration, of which a rig's own parameters are the larger part.
typedef struct paper_machine {
    hexload_geometry_t geometry;
    hexload_platform_t platform;
    hexload_sensors_t sensors;
    hexload_paper_config_t paper;
    hexload_momentum_config_t momentum;
} paper_machine_t;

void hexload_config_default(hexload_config_t* config) {
    // Paper, Table 1; hinges at radii 0.4 and 0.6 m, 15 and 10 degrees from the axes of symmetry.
    static const paper_machine_t paper_machine = {
        .geometry =
            {.base_hinge_m = {{HEXLOAD_REAL(0.5908846518), HEXLOAD_REAL(0.1041889066), HEXLOAD_REAL(0.0)},
                              {HEXLOAD_REAL(-0.2052120860), HEXLOAD_REAL(0.5638155725), HEXLOAD_REAL(0.0)},
                              {HEXLOAD_REAL(-0.3856725658), HEXLOAD_REAL(0.4596266659), HEXLOAD_REAL(0.0)},
                              {HEXLOAD_REAL(-0.3856725658), HEXLOAD_REAL(-0.4596266659), HEXLOAD_REAL(0.0)},
                              {HEXLOAD_REAL(-0.2052120860), HEXLOAD_REAL(-0.5638155725), HEXLOAD_REAL(0.0)},
                              {HEXLOAD_REAL(0.5908846518), HEXLOAD_REAL(-0.1041889066), HEXLOAD_REAL(0.0)}},
             .platform_hinge_m =
                 {{HEXLOAD_REAL(0.2828427125), HEXLOAD_REAL(0.2828427125), HEXLOAD_REAL(0.0)},
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
        .paper =
            {.load_mass_kg = HEXLOAD_REAL(500.0),
             .gate_nis = HEXLOAD_REAL(40.0), // chi-square, 3 degrees of freedom: 1e-8 of good innovations
             .inconsistent_nis = HEXLOAD_REAL(5.0), // sigmas understated by 1.3; 13 sigma of the mean below
             .nis_time_constant_s = HEXLOAD_REAL(0.5),
             .converged_relative_sigma = HEXLOAD_REAL(0.1),
             .longest_gap_ticks = 3, // at 3 Hz the trapezoid's error is then (2 pi 3 Hz 3 ms)^2 / 12 = 3e-4
             .longest_gate_ticks = 20},
        .momentum = {.longest_gap_ticks = 5,
                     .inconsistent_nis = HEXLOAD_REAL(9.0), // sigmas understated by 1.2
                     .nis_time_constant_s = HEXLOAD_REAL(0.5),
                     .converged_relative_sigma = HEXLOAD_REAL(0.05),
                     .excitation_time_constant_s = HEXLOAD_REAL(10.0)},
    };
    memset(config, 0, sizeof *config);
    config->kind = HEXLOAD_KIND_MOMENTUM;
    config->tick_s = HEXLOAD_REAL(0.001);
    config->gravity_m_s2 = HEXLOAD_REAL(9.81);
    config->geometry = paper_machine.geometry;
    config->platform = paper_machine.platform;
    config->sensors = paper_machine.sensors;
    config->paper = paper_machine.paper;
    config->momentum = paper_machine.momentum;
    config->actuator_effects.friction_speed_m_s = HEXLOAD_REAL(5e-3);
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

static bool are_finite(const hexload_real_t* values, int count) {
    for (int k = 0; k < count; k++) {
        if (!isfinite(values[k])) {
            return false;
        }
    }
    return true;
}

static bool is_in(hexload_real_t value, hexload_real_t least, hexload_real_t most) {
    return value >= least && value <= most; // false for NaN
}

/// No leg is as short as nothing at this displacement.
static bool leaves_legs(const hexload_geometry_t* geometry, hexload_real_t displacement_m) {
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        if (!(geometry->home_leg_length_m[leg] + displacement_m > HEXLOAD_REAL(0.0))) {
            return false;
        }
    }
    return true;
}

static bool are_positive_up_to(hexload_real_t most, const hexload_real_t* values, int count) {
    for (int k = 0; k < count; k++) {
        if (!(values[k] > HEXLOAD_REAL(0.0)) || !(values[k] <= most)) {
            return false;
        }
    }
    return true;
}

/// A tensor of some body: about the centre of mass it is positive definite, and no moment exceeds the sum of
/// the others.
static bool is_inertia_of_body(const hexload_platform_t* platform) {
    const hexload_real_t* I = platform->inertia_kg_m2;
    const hexload_real_t* c = platform->com_m;
    const hexload_real_t m = platform->mass_kg;
    const hexload_real_t xx = I[HEXLOAD_I_XX] - m * (c[1] * c[1] + c[2] * c[2]);
    const hexload_real_t yy = I[HEXLOAD_I_YY] - m * (c[0] * c[0] + c[2] * c[2]);
    const hexload_real_t zz = I[HEXLOAD_I_ZZ] - m * (c[0] * c[0] + c[1] * c[1]);
    const hexload_real_t xy = I[HEXLOAD_I_XY] + m * c[0] * c[1];
    const hexload_real_t xz = I[HEXLOAD_I_XZ] + m * c[0] * c[2];
    const hexload_real_t yz = I[HEXLOAD_I_YZ] + m * c[1] * c[2];
    const hexload_real_t determinant =
        xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz);
    const hexload_real_t half_trace = HEXLOAD_REAL(0.5) * (xx + yy + zz);
    const hexload_real_t largest =
        half_trace * HEXLOAD_REAL(1.0001); // a flat plate has xx + yy = zz, and rounding
    return are_finite(I, HEXLOAD_I_DIM) && xx > HEXLOAD_REAL(0.0) && xx * yy - xy * xy > HEXLOAD_REAL(0.0) &&
           determinant > HEXLOAD_REAL(0.0) && xx <= largest && yy <= largest && zz <= largest;
}

typedef struct field {
    const char* name;
    bool is_good;
} field_t;

/// NULL: all are.
static const char* first_bad(const field_t* fields, size_t count) {
    const char* name = NULL;
    for (size_t k = 0; k < count && name == NULL; k++) {
        name = fields[k].is_good ? NULL : fields[k].name;
    }
    return name;
}

#define MILLION HEXLOAD_REAL(1e6)

/// The first bad field of machine and sensors.
static const char* check_machine(const hexload_config_t* config) {
    const hexload_geometry_t* geometry = &config->geometry;
    const hexload_sensors_t* sensors = &config->sensors;
    const field_t fields[] = {
        {"kind", (unsigned)config->kind < (unsigned)HEXLOAD_KINDS},
        {"tick_s", is_in(config->tick_s, HEXLOAD_REAL(0.9999e-4), HEXLOAD_REAL(5.0001e-3))},
        {"geometry.base_hinge_m", are_finite(&geometry->base_hinge_m[0][0], 3 * HEXLOAD_LEGS)},
        {"geometry.platform_hinge_m", are_finite(&geometry->platform_hinge_m[0][0], 3 * HEXLOAD_LEGS)},
        {"geometry.home_leg_length_m",
         are_positive_up_to(MILLION, geometry->home_leg_length_m, HEXLOAD_LEGS)},
        {"geometry.stroke_min_m", leaves_legs(geometry, geometry->stroke_min_m)},
        {"geometry.stroke_max_m", is_in(geometry->stroke_max_m, geometry->stroke_min_m, MILLION) &&
                                      geometry->stroke_max_m > geometry->stroke_min_m},
        {"platform.mass_kg", are_positive_up_to(MILLION, &config->platform.mass_kg, 1)},
        {"platform.com_m", are_finite(config->platform.com_m, 3)},
        {"platform.inertia_kg_m2", is_inertia_of_body(&config->platform)},
        {"gravity_m_s2", is_in(config->gravity_m_s2, HEXLOAD_REAL(0.0), HEXLOAD_REAL(30.0))},
        {"sensors.displacement_sigma_m",
         is_in(sensors->displacement_sigma_m, HEXLOAD_REAL(1e-10), HEXLOAD_REAL(0.1))},
        {"sensors.velocity_sigma_m_s",
         is_in(sensors->velocity_sigma_m_s, HEXLOAD_REAL(1e-8), HEXLOAD_REAL(1.0))},
        {"sensors.force_sigma_n", is_in(sensors->force_sigma_n, HEXLOAD_REAL(1e-6), HEXLOAD_REAL(1e5))},
        {"sensors.velocity_range_m_s",
         are_positive_up_to(HEXLOAD_REAL(50.0), &sensors->velocity_range_m_s, 1)},
        {"sensors.force_range_n", are_positive_up_to(HEXLOAD_REAL(1e8), &sensors->force_range_n, 1)},
    };
    return first_bad(fields, sizeof fields / sizeof fields[0]);
}

/// The first bad field of tuning of the paper's filter.
static const char* check_paper(const hexload_config_t* config) {
    const hexload_paper_config_t* paper = &config->paper;
    const field_t fields[] = {
        {"paper.load_mass_kg", are_positive_up_to(MILLION, &paper->load_mass_kg, 1)},
        {"paper.prior_dz_sigma_m", are_positive_up_to(HEXLOAD_REAL(1e3), &paper->prior_dz_sigma_m, 1)},
        {"paper.prior_inertia_sigma_kg_m2", are_positive_up_to(MILLION, paper->prior_inertia_sigma_kg_m2, 3)},
        {"paper.gate_nis", is_in(paper->gate_nis, HEXLOAD_REAL(3.0), MILLION)},
        {"paper.inconsistent_nis", is_in(paper->inconsistent_nis, HEXLOAD_REAL(3.0), MILLION)},
        {"paper.nis_time_constant_s", is_in(paper->nis_time_constant_s, config->tick_s, HEXLOAD_REAL(1e3))},
        {"paper.converged_relative_sigma",
         is_in(paper->converged_relative_sigma, HEXLOAD_REAL(0.0), HEXLOAD_REAL(1.0))},
        {"paper.longest_gap_ticks", paper->longest_gap_ticks >= 1},
        {"paper.longest_gate_ticks", paper->longest_gate_ticks >= 1},
    };
    return first_bad(fields, sizeof fields / sizeof fields[0]);
}

/// The first bad field of tuning of the momentum filter and of actuator effects.
static const char* check_momentum(const hexload_config_t* config) {
    const hexload_momentum_config_t* momentum = &config->momentum;
    const hexload_actuator_effects_config_t* effects = &config->actuator_effects;
    const field_t fields[] = {
        {"momentum.lag_ticks",
         momentum->lag_ticks >= HEXLOAD_TRANSIENT_TICKS && momentum->lag_ticks <= HEXLOAD_LAG_TICKS_MAX},
        {"momentum.longest_gap_ticks",
         momentum->longest_gap_ticks >= 1 && momentum->longest_gap_ticks <= HEXLOAD_MISSING_TICKS_MAX},
        {"momentum.prior_mass_kg", is_in(momentum->prior_mass_kg, HEXLOAD_REAL(0.0), MILLION)},
        {"momentum.prior_mass_sigma_kg", are_positive_up_to(MILLION, &momentum->prior_mass_sigma_kg, 1)},
        {"momentum.prior_moment_sigma_kg_m",
         are_positive_up_to(MILLION, &momentum->prior_moment_sigma_kg_m, 1)},
        {"momentum.prior_inertia_sigma_kg_m2",
         are_positive_up_to(MILLION, &momentum->prior_inertia_sigma_kg_m2, 1)},
        {"momentum.inconsistent_nis", is_in(momentum->inconsistent_nis, HEXLOAD_REAL(6.0), MILLION)},
        {"momentum.nis_time_constant_s",
         is_in(momentum->nis_time_constant_s, config->tick_s, HEXLOAD_REAL(1e3))},
        {"momentum.converged_relative_sigma",
         is_in(momentum->converged_relative_sigma, HEXLOAD_REAL(0.0), HEXLOAD_REAL(1.0))},
        {"momentum.excitation_time_constant_s",
         is_in(momentum->excitation_time_constant_s, config->tick_s, HEXLOAD_REAL(1e3))},
        {"actuator_effects.prior_bias_sigma_n",
         is_in(effects->prior_bias_sigma_n, HEXLOAD_REAL(0.0), MILLION)},
        {"actuator_effects.prior_coulomb_sigma_n",
         is_in(effects->prior_coulomb_sigma_n, HEXLOAD_REAL(0.0), MILLION)},
        {"actuator_effects.prior_viscous_sigma_n_s_m",
         is_in(effects->prior_viscous_sigma_n_s_m, HEXLOAD_REAL(0.0), HEXLOAD_REAL(1e8))},
        {"actuator_effects.friction_speed_m_s",
         is_in(effects->friction_speed_m_s, HEXLOAD_REAL(1e-6), HEXLOAD_REAL(10.0))},
    };
    return first_bad(fields, sizeof fields / sizeof fields[0]);
}

static bool are_in(const hexload_real_t values[HEXLOAD_LEGS], hexload_real_t least, hexload_real_t most) {
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        if (!is_in(values[leg], least, most)) {
            return false;
        }
    }
    return true;
}

/// Dry friction at rest is none that pushes.
static bool is_dry_friction(const hexload_rig_config_t* rig) {
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        if (!is_in(rig->stribeck_n[leg], -rig->coulomb_n[leg], MILLION)) {
            return false;
        }
    }
    return true;
}

static bool are_directions(const hexload_rig_config_t* rig) {
    for (uint32_t n = 0; n < HEXLOAD_RIG_DIRECTIONS_MAX && n < rig->direction_count; n++) {
        const hexload_rig_direction_t* direction = &rig->direction[n];
        if (!are_finite(direction->force_offset_n, HEXLOAD_LEGS) ||
            !are_finite(direction->force_gain, HEXLOAD_LEGS) ||
            !are_finite(direction->coulomb_n, HEXLOAD_LEGS) ||
            !are_finite(direction->stribeck_n, HEXLOAD_LEGS) ||
            !are_finite(direction->growth_n_n, HEXLOAD_LEGS) ||
            !are_finite(direction->viscous_n_s_m, HEXLOAD_LEGS) || !are_finite(direction->gravity_m_s2, 2) ||
            !are_finite(direction->platform, 4 + HEXLOAD_I_DIM) ||
            !are_finite(&direction->base_hinge_m[0][0], 3 * HEXLOAD_LEGS) ||
            !are_finite(&direction->platform_hinge_m[0][0], 3 * HEXLOAD_LEGS)) {
            return false;
        }
    }
    return true;
}

/// The first bad field of what commissioning has found.
static const char* check_rig(const hexload_config_t* config) {
    const hexload_rig_config_t* rig = &config->rig;
    const hexload_real_t zero = HEXLOAD_REAL(0.0);
    const hexload_real_t half = HEXLOAD_REAL(0.5);
    const hexload_real_t ten = HEXLOAD_REAL(10.0);
    const hexload_real_t micro = HEXLOAD_REAL(1e-6);
    const hexload_real_t latest_s = (hexload_real_t)HEXLOAD_RIG_DELAY_TICKS_MAX * config->tick_s;
    const field_t fields[] = {
        {"rig.force_offset_n", are_in(rig->force_offset_n, -MILLION, MILLION)},
        {"rig.force_gain", are_in(rig->force_gain, -half, half)},
        {"rig.coulomb_n", are_in(rig->coulomb_n, zero, MILLION)},
        {"rig.stribeck_n", is_dry_friction(rig)},
        {"rig.growth_n_n", are_in(rig->growth_n_n, zero, half)},
        {"rig.viscous_n_s_m", are_in(rig->viscous_n_s_m, zero, HEXLOAD_REAL(1e8))},
        {"rig.stribeck_speed_m_s", is_in(rig->stribeck_speed_m_s, micro, ten)},
        {"rig.reversal_speed_m_s", is_in(rig->reversal_speed_m_s, micro, ten)},
        {"rig.presliding_m", is_in(rig->presliding_m, zero, HEXLOAD_REAL(0.01))},
        {"rig.force_delay_s", is_in(rig->force_delay_s, zero, latest_s)},
        {"rig.velocity_delay_s", is_in(rig->velocity_delay_s, zero, latest_s)},
        {"rig.leg_inertia_kg_m2", is_in(rig->leg_inertia_kg_m2, -MILLION, MILLION)},
        {"rig.leg_slide_kg_m", is_in(rig->leg_slide_kg_m, -MILLION, MILLION)},
        {"rig.leg_tilt_kg_m", is_in(rig->leg_tilt_kg_m, -MILLION, MILLION)},
        {"rig.direction_count", rig->direction_count <= HEXLOAD_RIG_DIRECTIONS_MAX},
        {"rig.direction", are_directions(rig)},
    };
    return first_bad(fields, sizeof fields / sizeof fields[0]);
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

hexload_status_t hexload_config_check(const hexload_config_t* config, const char** bad_field) {
    const char* name = check_machine(config);
    if (name == NULL) {
        name = check_paper(config);
    }
    if (name == NULL) {
        name = check_momentum(config);
    }
    if (name == NULL) {
        name = check_rig(config);
    }
    if (bad_field != NULL) {
        *bad_field = name;
    }
    return name == NULL ? HEXLOAD_OK : HEXLOAD_ERR_CONFIG;
}
