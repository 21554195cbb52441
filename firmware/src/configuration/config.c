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
                   .platform_inertia = HEXLOAD_REAL(0.03)},
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
                 .excitation_time_constant_s = HEXLOAD_REAL(10.0)},
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

#define MILLION HEXLOAD_REAL(1e6)
#define LARGEST HEXLOAD_REAL(3.4e38)
#define LEAST_POSITIVE HEXLOAD_REAL(1.2e-38)

/// Numbers of the configuration that lie next to each other, and their range.
typedef struct range {
    const char* name;
    uint16_t offset;      ///< of the first, bytes
    uint16_t size;        ///< of all, bytes
    hexload_real_t least; ///< is still good
    hexload_real_t most;  ///< likewise
} range_t;

#define SIZE_OF(field) sizeof(((const hexload_config_t*)NULL)->field)
#define IN(field, least, most)                                                                               \
    { #field, (uint16_t)offsetof(hexload_config_t, field), (uint16_t)SIZE_OF(field), (least), (most) }
#define FINITE(field) IN(field, -LARGEST, LARGEST)
#define POSITIVE(field, most) IN(field, LEAST_POSITIVE, most)

static const range_t RANGES[] = {
    IN(tick_s, HEXLOAD_REAL(0.9999e-4), HEXLOAD_REAL(5.0001e-3)),
    FINITE(geometry.base_hinge_m),
    FINITE(geometry.platform_hinge_m),
    POSITIVE(geometry.home_leg_length_m, MILLION),
    FINITE(geometry.stroke_min_m),
    IN(geometry.stroke_max_m, -MILLION, MILLION),
    POSITIVE(platform.mass_kg, MILLION),
    FINITE(platform.com_m),
    FINITE(platform.inertia_kg_m2),
    IN(gravity_m_s2, HEXLOAD_REAL(0.0), HEXLOAD_REAL(30.0)),
    IN(sensors.displacement_sigma_m, HEXLOAD_REAL(1e-10), HEXLOAD_REAL(0.1)),
    IN(sensors.velocity_sigma_m_s, HEXLOAD_REAL(1e-8), HEXLOAD_REAL(1.0)),
    IN(sensors.force_sigma_n, HEXLOAD_REAL(1e-6), HEXLOAD_REAL(1e5)),
    POSITIVE(sensors.velocity_range_m_s, HEXLOAD_REAL(50.0)),
    POSITIVE(sensors.force_range_n, HEXLOAD_REAL(1e8)),
    IN(tolerances, HEXLOAD_REAL(0.0), HEXLOAD_REAL(1.0)),
    POSITIVE(paper.load_mass_kg, MILLION),
    POSITIVE(paper.prior_dz_sigma_m, HEXLOAD_REAL(1e3)),
    POSITIVE(paper.prior_inertia_sigma_kg_m2, MILLION),
    IN(paper.gate_nis, HEXLOAD_REAL(3.0), MILLION),
    IN(paper.inconsistent_nis, HEXLOAD_REAL(3.0), MILLION),
    IN(paper.nis_time_constant_s, HEXLOAD_REAL(0.0), HEXLOAD_REAL(1e3)),
    IN(paper.converged_relative_sigma, HEXLOAD_REAL(0.0), HEXLOAD_REAL(1.0)),
    IN(momentum.prior_mass_kg, HEXLOAD_REAL(0.0), MILLION),
    POSITIVE(momentum.prior_mass_sigma_kg, MILLION),
    POSITIVE(momentum.prior_moment_sigma_kg_m, MILLION),
    POSITIVE(momentum.prior_inertia_sigma_kg_m2, MILLION),
    IN(momentum.inconsistent_nis, HEXLOAD_REAL(6.0), MILLION),
    IN(momentum.nis_time_constant_s, HEXLOAD_REAL(0.0), HEXLOAD_REAL(1e3)),
    IN(momentum.converged_relative_sigma, HEXLOAD_REAL(0.0), HEXLOAD_REAL(1.0)),
    IN(momentum.excitation_time_constant_s, HEXLOAD_REAL(0.0), HEXLOAD_REAL(1e3)),
    IN(actuator_effects.prior_bias_sigma_n, HEXLOAD_REAL(0.0), MILLION),
    IN(actuator_effects.prior_coulomb_sigma_n, HEXLOAD_REAL(0.0), MILLION),
    IN(actuator_effects.prior_viscous_sigma_n_s_m, HEXLOAD_REAL(0.0), HEXLOAD_REAL(1e8)),
    IN(actuator_effects.prior_tilt_sigma_m_s2, HEXLOAD_REAL(0.0), HEXLOAD_REAL(30.0)),
    IN(actuator_effects.friction_speed_m_s, HEXLOAD_REAL(1e-6), HEXLOAD_REAL(10.0)),
    IN(rig.force_offset_n, -MILLION, MILLION),
    IN(rig.force_gain, HEXLOAD_REAL(-0.5), HEXLOAD_REAL(0.5)),
    IN(rig.coulomb_n, HEXLOAD_REAL(0.0), MILLION),
    IN(rig.stribeck_n, -MILLION, MILLION),
    IN(rig.growth_n_n, HEXLOAD_REAL(0.0), HEXLOAD_REAL(0.5)),
    IN(rig.viscous_n_s_m, HEXLOAD_REAL(0.0), HEXLOAD_REAL(1e8)),
    IN(rig.stribeck_speed_m_s, HEXLOAD_REAL(1e-6), HEXLOAD_REAL(10.0)),
    IN(rig.reversal_speed_m_s, HEXLOAD_REAL(1e-6), HEXLOAD_REAL(10.0)),
    IN(rig.presliding_m, HEXLOAD_REAL(0.0), HEXLOAD_REAL(0.01)),
    IN(rig.force_delay_s, HEXLOAD_REAL(0.0), MILLION),
    IN(rig.velocity_delay_s, HEXLOAD_REAL(0.0), MILLION),
    IN(rig.leg_inertia_kg_m2, -MILLION, MILLION),
    IN(rig.leg_slide_kg_m, -MILLION, MILLION),
    IN(rig.leg_tilt_kg_m, -MILLION, MILLION),
};

/// Whether numbers of so many bytes, from an offset on, are in a range; false for NaN.
static bool are_in(const hexload_config_t* config, size_t offset, size_t size, hexload_real_t least,
                   hexload_real_t most) {
    const unsigned char* bytes = (const unsigned char*)config;
    hexload_real_t value;
    for (size_t at = offset; at < offset + size; at += sizeof value) {
        memcpy(&value, &bytes[at], sizeof value);
        if (!(value >= least && value <= most)) {
            return false;
        }
    }
    return true;
}

/// The first whose numbers are not all in their range. NULL: all are.
static const char* first_out_of_range(const hexload_config_t* config) {
    for (size_t k = 0; k < sizeof RANGES / sizeof RANGES[0]; k++) {
        const range_t* range = &RANGES[k];
        if (!are_in(config, range->offset, range->size, range->least, range->most)) {
            return range->name;
        }
    }
    return NULL;
}

/// No leg is as short as nothing at the shortest displacement.
static bool leaves_legs(const hexload_geometry_t* geometry) {
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        if (!(geometry->home_leg_length_m[leg] + geometry->stroke_min_m > HEXLOAD_REAL(0.0))) {
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
    return xx > HEXLOAD_REAL(0.0) && xx * yy - xy * xy > HEXLOAD_REAL(0.0) &&
           determinant > HEXLOAD_REAL(0.0) && xx <= largest && yy <= largest && zz <= largest;
}

/// Dry friction at rest is none that pushes.
static bool is_dry_friction(const hexload_rig_config_t* rig) {
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        if (!(rig->stribeck_n[leg] >= -rig->coulomb_n[leg])) {
            return false;
        }
    }
    return true;
}

/// Beyond the ranges: counts, and what depends on another field. The first bad one; NULL: none is.
HEXLOAD_RARE static const char* first_contradiction(const hexload_config_t* config) {
    const hexload_momentum_config_t* momentum = &config->momentum;
    const hexload_rig_config_t* rig = &config->rig;
    const hexload_real_t latest_s = (hexload_real_t)HEXLOAD_RIG_DELAY_TICKS_MAX * config->tick_s;
    const size_t directions = sizeof rig->direction[0] * rig->direction_count;
    const struct {
        const char* name;
        bool is_good;
    } fields[] = {
        {"kind", (unsigned)config->kind < (unsigned)HEXLOAD_KINDS},
        {"sensors.half_window_ticks", config->sensors.half_window_ticks <= HEXLOAD_HALF_WINDOW_TICKS_MAX &&
                                          config->sensors.half_window_ticks != 1},
        {"geometry.stroke_min_m", leaves_legs(&config->geometry)},
        {"geometry.stroke_max_m", config->geometry.stroke_max_m > config->geometry.stroke_min_m},
        {"platform.inertia_kg_m2", is_inertia_of_body(&config->platform)},
        {"paper.nis_time_constant_s", config->paper.nis_time_constant_s >= config->tick_s},
        {"paper.longest_gap_ticks", config->paper.longest_gap_ticks >= 1},
        {"paper.longest_gate_ticks", config->paper.longest_gate_ticks >= 1},
        {"momentum.lag_ticks",
         momentum->lag_ticks >= HEXLOAD_TRANSIENT_TICKS && momentum->lag_ticks <= HEXLOAD_LAG_TICKS_MAX},
        {"momentum.longest_gap_ticks",
         momentum->longest_gap_ticks >= 1 && momentum->longest_gap_ticks <= HEXLOAD_MISSING_TICKS_MAX},
        {"momentum.nis_time_constant_s", momentum->nis_time_constant_s >= config->tick_s},
        {"momentum.excitation_time_constant_s", momentum->excitation_time_constant_s >= config->tick_s},
        {"rig.stribeck_n", is_dry_friction(rig)},
        {"rig.force_delay_s", rig->force_delay_s <= latest_s},
        {"rig.velocity_delay_s", rig->velocity_delay_s <= latest_s},
        {"rig.direction_count", rig->direction_count <= HEXLOAD_RIG_DIRECTIONS_MAX},
        {"rig.direction",
         rig->direction_count > HEXLOAD_RIG_DIRECTIONS_MAX ||
             are_in(config, offsetof(hexload_config_t, rig.direction), directions, -LARGEST, LARGEST)},
    };
    for (size_t k = 0; k < sizeof fields / sizeof fields[0]; k++) {
        if (!fields[k].is_good) {
            return fields[k].name;
        }
    }
    return NULL;
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
    const char* name = first_out_of_range(config);
    if (name == NULL) {
        name = first_contradiction(config);
    }
    if (bad_field != NULL) {
        *bad_field = name;
    }
    return name == NULL ? HEXLOAD_OK : HEXLOAD_ERR_CONFIG;
}
