#include "rig/rig.h"

#include "algebra/linalg.h"
#include "rig/rig_friction.h"

#include <string.h>

/// A leg as slow as this may as well stand.
#define SLOW_M_S HEXLOAD_REAL(0.005)

/// A delay in ticks: whole ones, and the part of the next.
typedef struct delay_shift {
    uint32_t whole;
    hexload_real_t part;
} delay_shift_t;

static delay_shift_t shift_of(const hexload_config_t* config, hexload_real_t delay_s) {
    const hexload_real_t ticks = delay_s / config->tick_s;
    const uint32_t whole = (uint32_t)ticks;
    return (delay_shift_t){whole, ticks - (hexload_real_t)whole};
}

/// How late the latest channel is, rounded up: what comes out is so much older than what goes in.
static uint32_t delay_ticks(const hexload_config_t* config) {
    const hexload_real_t latest_s = hexload_max(config->rig.force_delay_s, config->rig.velocity_delay_s);
    const delay_shift_t latest = shift_of(config, latest_s);
    return latest.whole + (latest.part > HEXLOAD_REAL(0.0) ? 1 : 0);
}

void hexload_rig_history_init(hexload_rig_history_t* self) {
    memset(self, 0, sizeof *self);
}

/// The sample of so many ticks ago.
static const hexload_leg_sample_t* ago(const hexload_rig_history_t* self, const hexload_leg_sample_t* sample,
                                       uint32_t ticks) {
    return ticks == 0 ? sample
                      : &self->past[(self->next + HEXLOAD_RIG_HISTORY - ticks) % HEXLOAD_RIG_HISTORY];
}

static hexload_real_t between(hexload_real_t from, hexload_real_t to, hexload_real_t part) {
    return hexload_fma(part, to - from, from);
}

bool hexload_rig_align(const hexload_rig_history_t* self, const hexload_config_t* config,
                       const hexload_leg_sample_t* sample, uint32_t gap_ticks, hexload_leg_sample_t* aligned,
                       uint32_t* aligned_gap_ticks) {
    const hexload_rig_config_t* rig = &config->rig;
    const uint32_t delay = delay_ticks(config);
    const delay_shift_t of_force = shift_of(config, rig->force_delay_s);
    const delay_shift_t of_velocity = shift_of(config, rig->velocity_delay_s);
    *aligned_gap_ticks = self->has_begun ? self->since_ticks + gap_ticks : 0;
    if (delay > 0 && (gap_ticks != 1 || self->stored < delay)) {
        return false;
    }
    *aligned = *ago(self, sample, delay);
    const hexload_leg_sample_t* force = ago(self, sample, delay - of_force.whole);
    const hexload_leg_sample_t* later_force =
        of_force.whole < delay ? ago(self, sample, delay - of_force.whole - 1) : force;
    const hexload_leg_sample_t* velocity = ago(self, sample, delay - of_velocity.whole);
    const hexload_leg_sample_t* later_velocity =
        of_velocity.whole < delay ? ago(self, sample, delay - of_velocity.whole - 1) : velocity;
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        const hexload_real_t shown_n =
            between(force->force_n[leg], later_force->force_n[leg], of_force.part) - rig->force_offset_n[leg];
        aligned->force_n[leg] = shown_n / (HEXLOAD_REAL(1.0) + rig->force_gain[leg]);
        aligned->velocity_m_s[leg] =
            between(velocity->velocity_m_s[leg], later_velocity->velocity_m_s[leg], of_velocity.part);
    }
    return true;
}

void hexload_rig_history_store(hexload_rig_history_t* self, const hexload_leg_sample_t* sample,
                               uint32_t gap_ticks, bool has_aligned) {
    if (gap_ticks != 1) {
        self->stored = 0;
    }
    self->past[self->next] = *sample;
    self->next++;
    if (self->next == HEXLOAD_RIG_HISTORY) {
        self->next = 0;
    }
    if (self->stored < HEXLOAD_RIG_HISTORY) {
        self->stored++;
    }
    self->has_begun = self->has_begun || has_aligned;
    self->since_ticks = has_aligned ? 0 : self->since_ticks + gap_ticks;
}

/// exp(-x) for x >= 0 by the 32nd power of a Pade approximant: absolute error below 2e-6. What is less is
/// nothing.
static hexload_real_t decay(hexload_real_t x) {
    if (x > HEXLOAD_REAL(16.0)) {
        return HEXLOAD_REAL(0.0);
    }
    const hexload_real_t z = HEXLOAD_REAL(0.03125) * x;
    const hexload_real_t even = hexload_fma(z, z, HEXLOAD_REAL(12.0));
    const hexload_real_t odd = HEXLOAD_REAL(6.0) * z;
    hexload_real_t power = (even - odd) / (even + odd);
    for (int k = 0; k < 5; k++) {
        power *= power;
    }
    return power;
}

static hexload_real_t direction(hexload_real_t speed_m_s, hexload_real_t reversal_m_s) {
    const hexload_real_t rest = decay(HEXLOAD_REAL(2.0) * hexload_abs(speed_m_s) / reversal_m_s);
    const hexload_real_t size = (HEXLOAD_REAL(1.0) - rest) / (HEXLOAD_REAL(1.0) + rest);
    return speed_m_s < HEXLOAD_REAL(0.0) ? -size : size;
}

void hexload_rig_slide_init(hexload_rig_slide_t* self) {
    memset(self, 0, sizeof *self);
}

/// s moved on: towards the direction of motion, with the way.
static hexload_real_t slide(const hexload_config_t* config, hexload_real_t share, hexload_real_t speed_m_s,
                            uint32_t gap_ticks) {
    const hexload_rig_config_t* rig = &config->rig;
    const hexload_real_t towards = direction(speed_m_s, rig->reversal_speed_m_s);
    const hexload_real_t way_m = hexload_abs(speed_m_s) * config->tick_s * (hexload_real_t)gap_ticks;
    if (!(rig->presliding_m > HEXLOAD_REAL(0.0))) {
        return towards;
    }
    return towards + decay(way_m / rig->presliding_m) * (share - towards);
}

void hexload_rig_compensate(hexload_rig_slide_t* self, const hexload_config_t* config,
                            const hexload_real_t speed_m_s[HEXLOAD_LEGS], uint32_t gap_ticks,
                            hexload_real_t force_n[HEXLOAD_LEGS], hexload_real_t variance_n2[HEXLOAD_LEGS]) {
    const hexload_rig_config_t* rig = &config->rig;
    const hexload_real_t unknown_ticks = hexload_rig_unknown_ticks(config);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        const hexload_real_t v = speed_m_s[leg];
        force_n[leg] = hexload_fma(-rig->viscous_n_s_m[leg], v, force_n[leg]);
        const hexload_real_t rubbing_n =
            hexload_fma(rig->growth_n_n[leg], hexload_abs(force_n[leg]),
                        rig->coulomb_n[leg] + hexload_max(rig->stribeck_n[leg], HEXLOAD_REAL(0.0)));
        variance_n2[leg] = HEXLOAD_REAL(0.0);
        if (rubbing_n > HEXLOAD_REAL(0.0)) {
            const hexload_real_t in_stribeck = v / rig->stribeck_speed_m_s;
            const hexload_real_t in_slow = v / SLOW_M_S;
            const hexload_real_t dry_n =
                hexload_fma(rig->stribeck_n[leg], decay(in_stribeck * in_stribeck), rig->coulomb_n[leg]);
            const hexload_real_t unknown_n = RIG_UNKNOWN_SHARE * rubbing_n;
            const hexload_real_t share = slide(config, self->share[leg], v, gap_ticks);
            const hexload_real_t turning = HEXLOAD_REAL(1.0) - share * share;
            self->share[leg] = share;
            force_n[leg] -= dry_n * share;
            // shown = r + growth |r| s
            const hexload_real_t grown = rig->growth_n_n[leg] * share;
            force_n[leg] /= HEXLOAD_REAL(1.0) + (force_n[leg] < HEXLOAD_REAL(0.0) ? -grown : grown);
            variance_n2[leg] =
                unknown_ticks * unknown_n * unknown_n * hexload_max(decay(in_slow * in_slow), turning);
        }
    }
}

bool hexload_rig_has_leg_mass(const hexload_config_t* config) {
    const hexload_rig_config_t* rig = &config->rig;
    return rig->leg_inertia_kg_m2 != HEXLOAD_REAL(0.0) || rig->leg_slide_kg_m != HEXLOAD_REAL(0.0) ||
           rig->leg_tilt_kg_m != HEXLOAD_REAL(0.0);
}

void hexload_rig_twists_init(hexload_rig_twists_t* self) {
    memset(self, 0, sizeof *self);
}

void hexload_rig_accelerate(hexload_rig_twists_t* self, const hexload_config_t* config,
                            const hexload_real_t twist[6], uint32_t gap_ticks,
                            hexload_real_t acceleration[6]) {
    memset(acceleration, 0, 6 * sizeof acceleration[0]);
    if (gap_ticks != 1) {
        self->stored = 0;
    }
    if (self->stored > 0) {
        const uint32_t oldest = (self->next + HEXLOAD_RIG_TWISTS - self->stored) % HEXLOAD_RIG_TWISTS;
        const hexload_real_t since_s = config->tick_s * (hexload_real_t)self->stored;
        for (int k = 0; k < 6; k++) {
            acceleration[k] = (twist[k] - self->past[oldest][k]) / since_s;
        }
    }
    memcpy(self->past[self->next], twist, sizeof self->past[0]);
    self->next = (self->next + 1) % HEXLOAD_RIG_TWISTS;
    self->stored += self->stored < HEXLOAD_RIG_TWISTS ? 1 : 0;
}

/// Motion of a leg's upper hinge, base axes.
typedef struct hinge {
    hexload_real_t arm_m[3]; ///< R a
    hexload_real_t speed_m_s[3];
    hexload_real_t acceleration_m_s2[3];
} hinge_t;

static void move_hinge(const hexload_config_t* config, const hexload_motion_t* motion, int leg,
                       const hexload_real_t twist[6], const hexload_real_t acceleration[6], hinge_t* hinge) {
    hexload_real_t turned[3];
    hexload_real_t pulled[3];
    hexload_real_t swung[3];
    hexload_times3(motion->R[0], config->geometry.platform_hinge_m[leg], hinge->arm_m);
    hexload_cross3(&twist[3], hinge->arm_m, turned);
    hexload_cross3(&twist[3], turned, pulled);
    hexload_cross3(&acceleration[3], hinge->arm_m, swung);
    for (int k = 0; k < 3; k++) {
        hinge->speed_m_s[k] = twist[k] + turned[k];
        hinge->acceleration_m_s2[k] = acceleration[k] + swung[k] + pulled[k];
    }
}

/// F = nu a_a + nu' (e u) u_a - (nu / l + nu' / 2) |u_a|^2 e + D g / l (z - e e_z), nu = B / l^2 - C / l.
static void force_on_hinge(const hexload_config_t* config, const hinge_t* hinge, const hexload_real_t e[3],
                           hexload_real_t length_m, hexload_real_t force_n[3]) {
    const hexload_rig_config_t* rig = &config->rig;
    const hexload_real_t inverse = HEXLOAD_REAL(1.0) / length_m;
    const hexload_real_t nu = inverse * (inverse * rig->leg_inertia_kg_m2 - rig->leg_slide_kg_m);
    const hexload_real_t slope =
        inverse * inverse * (rig->leg_slide_kg_m - HEXLOAD_REAL(2.0) * inverse * rig->leg_inertia_kg_m2);
    const hexload_real_t along = hexload_dot3(e, hinge->speed_m_s);
    const hexload_real_t drawn = hexload_dot3(e, hinge->acceleration_m_s2);
    const hexload_real_t tilting = inverse * rig->leg_tilt_kg_m * config->gravity_m_s2;
    const hexload_real_t across_square = hexload_dot3(hinge->speed_m_s, hinge->speed_m_s) - along * along;
    const hexload_real_t inwards = (nu * inverse + HEXLOAD_REAL(0.5) * slope) * across_square;
    const hexload_real_t turning = slope * along;
    const hexload_real_t of_e = -(nu * drawn + turning * along + inwards + tilting * e[2]);
    for (int k = 0; k < 3; k++) {
        force_n[k] = hexload_fma(nu, hinge->acceleration_m_s2[k],
                                 hexload_fma(turning, hinge->speed_m_s[k], of_e * e[k]));
    }
    force_n[2] += tilting;
}

void hexload_rig_leg_wrench(const hexload_config_t* config, const hexload_leg_sample_t* sample,
                            const hexload_motion_t* motion, const hexload_real_t twist[6],
                            const hexload_real_t acceleration[6], hexload_real_t wrench[6]) {
    memset(wrench, 0, 6 * sizeof wrench[0]);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        const hexload_real_t length_m = config->geometry.home_leg_length_m[leg] + sample->displacement_m[leg];
        hinge_t hinge;
        hexload_real_t force_n[3];
        hexload_real_t moment[3];
        move_hinge(config, motion, leg, twist, acceleration, &hinge);
        force_on_hinge(config, &hinge, motion->J[leg], length_m, force_n);
        hexload_cross3(hinge.arm_m, force_n, moment);
        for (int k = 0; k < 3; k++) {
            wrench[k] += force_n[k];
            wrench[3 + k] += moment[k];
        }
    }
}
