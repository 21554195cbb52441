#include "configuration/config_fields.h"
#include "algebra/real.h"
#include "hexload/state.h"

#include <stdbool.h>
#include <stddef.h>
#include <string.h>

/// Numbers of the configuration that lie next to each other, and their range.
typedef struct range {
    uint16_t offset; ///< of the first, bytes
    uint16_t size;   ///< of all, bytes
    uint8_t least;   ///< bound that is still good
    uint8_t most;    ///< likewise
} range_t;

#define NAME(name, value) name,
#define VALUE(name, value) (value),

enum { CONFIG_BOUNDS(NAME) };

static const hexload_real_t BOUNDS[] = {CONFIG_BOUNDS(VALUE)};

#define SIZE_OF(field) sizeof(((const hexload_config_t*)NULL)->field)
#define RANGE(field, least, most)                                                                            \
    {(uint16_t)offsetof(hexload_config_t, field), (uint16_t)SIZE_OF(field), (least), (most)},

static const range_t RANGES[] = {CONFIG_RANGES(RANGE)};

enum { RANGE_COUNT = (int)(sizeof RANGES / sizeof RANGES[0]) };

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

/// The first whose numbers are not all in their range. RANGE_COUNT: all are.
static int first_out_of_range(const hexload_config_t* config) {
    int k = 0;
    while (k < RANGE_COUNT && are_in(config, RANGES[k].offset, RANGES[k].size, BOUNDS[RANGES[k].least],
                                     BOUNDS[RANGES[k].most])) {
        k++;
    }
    return k;
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

#define IS_GOOD(field, condition) (condition),

/// The first bad one of the list; negative: none is.
HEXLOAD_RARE static int first_contradiction(const hexload_config_t* config) {
    const hexload_momentum_config_t* momentum = &config->momentum;
    const hexload_rig_config_t* rig = &config->rig;
    const hexload_real_t latest_s = (hexload_real_t)HEXLOAD_RIG_DELAY_TICKS_MAX * config->tick_s;
    const size_t directions = sizeof rig->direction[0] * rig->direction_count;
    const bool is_good[] = {CONFIG_CONTRADICTIONS(IS_GOOD)};
    for (int k = 0; k < (int)(sizeof is_good / sizeof is_good[0]); k++) {
        if (!is_good[k]) {
            return k;
        }
    }
    return -1;
}

int hexload_config_find_bad(const hexload_config_t* config) {
    const int range = first_out_of_range(config);
    if (range < RANGE_COUNT) {
        return range;
    }
    const int contradiction = first_contradiction(config);
    return contradiction < 0 ? contradiction : RANGE_COUNT + contradiction;
}
