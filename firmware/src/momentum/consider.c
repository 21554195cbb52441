#include "momentum/consider.h"

#include "algebra/leg_blocks.h"
#include "algebra/linalg.h"
#include "momentum/momentum_model.h"

#include <stddef.h>
#include <string.h>

enum { DIM = HEXLOAD_LOAD_DIM };

void hexload_consider_init(hexload_consider_t* self) {
    memset(self, 0, sizeof *self);
}

/// What a wrong hinge does to a leg: its direction and the arm of its force.
typedef struct hinge_shift {
    hexload_real_t hinge_m[HEXLOAD_LEGS][3]; ///< R da - db, base axes
    hexload_real_t arm_m[HEXLOAD_LEGS][3];   ///< R da
    hexload_real_t twist[6];                 ///< of the pose, which fits the same leg lengths
} hinge_shift_t;

static void find_shift(const hexload_rig_direction_t* direction, const hexload_motion_t* motion,
                       hinge_shift_t* shift) {
    hexload_real_t along_m[HEXLOAD_LEGS];
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        for (int k = 0; k < 3; k++) {
            shift->arm_m[leg][k] = hexload_dot3(motion->R[k], direction->platform_hinge_m[leg]);
            shift->hinge_m[leg][k] = shift->arm_m[leg][k] - direction->base_hinge_m[leg][k];
        }
        along_m[leg] = -hexload_dot3(motion->J[leg], shift->hinge_m[leg]);
    }
    hexload_leg_blocks_solve(motion->jacobian, along_m, shift->twist);
}

/// Error of a leg's wrench about O_A by its direction and arm.
static void shift_leg(const hexload_config_t* config, const hexload_delayed_tick_t* past,
                      const hinge_shift_t* shift, int leg, hexload_real_t wrench[6]) {
    const hexload_motion_t* motion = &past->motion;
    const hexload_leg_sample_t* sample = &past->smooth.sample;
    const hexload_real_t* e = motion->J[leg];
    const hexload_real_t length_m = config->geometry.home_leg_length_m[leg] + sample->displacement_m[leg];
    const hexload_real_t force_n = sample->force_n[leg];
    hexload_real_t arm_m[3];
    hexload_real_t turned_m[3];
    hexload_real_t change_n[3];
    hexload_real_t of_arm[3];
    hexload_real_t of_force[3];
    hexload_times3(motion->R[0], config->geometry.platform_hinge_m[leg], arm_m);
    hexload_cross3(&shift->twist[3], arm_m, turned_m);
    for (int k = 0; k < 3; k++) {
        change_n[k] = force_n / length_m * (shift->twist[k] + turned_m[k] + shift->hinge_m[leg][k]);
        turned_m[k] = force_n * (turned_m[k] + shift->arm_m[leg][k]);
    }
    hexload_cross3(turned_m, e, of_arm);
    hexload_cross3(arm_m, change_n, of_force);
    for (int k = 0; k < 3; k++) {
        wrench[k] += change_n[k];
        wrench[3 + k] += of_arm[k] + of_force[k];
    }
}

/// Error of gravity's part, by its direction and by the pose's error; moment about the home point.
static void shift_gravity(const hexload_config_t* config, const hexload_real_t body[DIM],
                          const hexload_motion_t* motion, const hexload_rig_direction_t* direction,
                          const hinge_shift_t* shift, hexload_real_t drive[6]) {
    const hexload_real_t tilt_m_s2[3] = {direction->gravity_m_s2[0], direction->gravity_m_s2[1],
                                         HEXLOAD_REAL(0.0)};
    const hexload_real_t gravity_m_s2[3] = {HEXLOAD_REAL(0.0), HEXLOAD_REAL(0.0), -config->gravity_m_s2};
    const hexload_real_t m = body[HEXLOAD_LOAD_M];
    hexload_real_t h[3];
    hexload_real_t turned[3];
    hexload_real_t lever[3];
    hexload_real_t moment[3];
    hexload_times3(motion->R[0], &body[HEXLOAD_LOAD_HX], h);
    for (int k = 0; k < 3; k++) {
        lever[k] = hexload_fma(m, motion->p_m[k], h[k]);
        drive[k] += m * tilt_m_s2[k];
    }
    hexload_cross3(lever, tilt_m_s2, moment);
    hexload_cross3(&shift->twist[3], h, turned);
    for (int k = 0; k < 3; k++) {
        drive[3 + k] += moment[k];
        lever[k] = hexload_fma(m, shift->twist[k], turned[k]);
    }
    hexload_cross3(lever, gravity_m_s2, moment);
    for (int k = 0; k < 3; k++) {
        drive[3 + k] += moment[k];
    }
}

/// Error of a leg's dry friction, by the smooth speed; exp(-x^2) by a fraction, which a sigma can bear.
static hexload_real_t dry_error(const hexload_config_t* config, const hexload_rig_direction_t* direction,
                                int leg, hexload_real_t v, hexload_real_t force_n) {
    const hexload_real_t one = HEXLOAD_REAL(1.0);
    const hexload_real_t in_stribeck = v / config->rig.stribeck_speed_m_s;
    const hexload_real_t square = in_stribeck * in_stribeck;
    const hexload_real_t level_n =
        direction->coulomb_n[leg] +
        direction->stribeck_n[leg] / (one + square * (one + HEXLOAD_REAL(0.5) * square)) +
        direction->growth_n_n[leg] * hexload_abs(force_n);
    return v < HEXLOAD_REAL(0.0) ? -level_n : level_n;
}

/// Error of the legs' wrench about O_A, and the wrench itself, both by forces that count as those on the
/// platform.
static void shift_forces(const hexload_config_t* config, const hexload_delayed_tick_t* past,
                         const hexload_rig_direction_t* direction, const hinge_shift_t* shift,
                         hexload_real_t wrench[6]) {
    const hexload_smooth_sample_t* sample = &past->smooth;
    memset(wrench, 0, 6 * sizeof wrench[0]);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        const hexload_real_t v = sample->smooth_velocity_m_s[leg];
        const hexload_real_t force_n = sample->sample.force_n[leg];
        const hexload_real_t error_n =
            direction->force_offset_n[leg] + dry_error(config, direction, leg, v, force_n) +
            direction->force_gain[leg] * force_n + direction->viscous_n_s_m[leg] * v;
        shift_leg(config, past, shift, leg, wrench);
        for (int k = 0; k < 6; k++) {
            wrench[k] = hexload_fma(-error_n, past->motion.J[leg][k], wrench[k]);
        }
    }
}

/// Error of mu' when all constants are off by one unit of the direction: of wrench and gravity, moment about
/// the home point.
static void find_drive(const hexload_config_t* config, const hexload_real_t body[DIM],
                       const hexload_delayed_tick_t* past, const hexload_rig_direction_t* direction,
                       hexload_real_t drive[6]) {
    const hexload_motion_t* motion = &past->motion;
    const hexload_real_t* force_n = past->smooth.sample.force_n;
    hexload_real_t push_n[3] = {0};
    hexload_real_t moved[3];
    hinge_shift_t shift;
    find_shift(direction, motion, &shift);
    shift_forces(config, past, direction, &shift, drive);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        for (int k = 0; k < 3; k++) {
            push_n[k] = hexload_fma(force_n[leg], motion->J[leg][k], push_n[k]);
        }
    }
    hexload_cross3(motion->p_m, drive, moved);
    for (int k = 0; k < 3; k++) {
        drive[3 + k] += moved[k];
    }
    hexload_cross3(shift.twist, push_n, moved);
    for (int k = 0; k < 3; k++) {
        drive[3 + k] += moved[k];
    }
    shift_gravity(config, body, motion, direction, &shift, drive);
}

/// What all constants together are off by.
static void read_error(const hexload_consider_t* self, const hexload_config_t* config, uint32_t n,
                       hexload_real_t error[DIM]) {
    for (int k = 0; k < DIM; k++) {
        error[k] = self->load[n][k] + config->rig.direction[n].platform[k];
    }
}

/// T for mu = Y (theta + theta_platform), as the filter's begins.
HEXLOAD_RARE void hexload_consider_seed(hexload_consider_t* self, const hexload_config_t* config,
                                        const hexload_momentum_filter_t* filter,
                                        const hexload_motion_t* motion) {
    for (uint32_t n = 0; n < config->rig.direction_count; n++) {
        hexload_real_t error[DIM];
        read_error(self, config, n, error);
        hexload_momentum_of_body(error, motion, filter->smooth_twist, self->momentum[n]);
    }
}

static void predict(hexload_consider_t* self, const hexload_config_t* config, hexload_real_t dt_s,
                    hexload_real_t G[PULLED][LIFTED]) {
    for (uint32_t n = 0; n < config->rig.direction_count; n++) {
        hexload_real_t* momentum = self->momentum[n];
        for (int k = 0; k < 6; k++) {
            momentum[k] = hexload_fma(dt_s, self->drive[n][k], momentum[k]);
        }
        for (int k = 0; k < LIFTED; k++) {
            const hexload_real_t error = self->load[n][k] + config->rig.direction[n].platform[k];
            for (int a = 0; a < PULLED; a++) {
                momentum[FIRST_PULLED + a] = hexload_fma(G[a][k], error, momentum[FIRST_PULLED + a]);
            }
        }
    }
}

_Static_assert(HEXLOAD_RIG_DIRECTIONS_MAX % 2 == 0, "directions go in pairs");

/// An innovation is Y times theta less mu.
HEXLOAD_APART void hexload_consider_follow(hexload_consider_t* self, const hexload_config_t* config,
                                           uint32_t n, hexload_momentum_update_t* update,
                                           hexload_real_t e[2][6]) {
    hexload_real_t error[2][DIM];
    hexload_real_t both[6][2];
    hexload_real_t less[2][6];
    read_error(self, config, n, error[0]);
    read_error(self, config, n + 1, error[1]);
    hexload_momentum_rows(update->Y, error[0], error[1], 0, 6, e);
    for (int a = 0; a < 6; a++) {
        both[a][0] = e[0][a] - self->momentum[n][a];
        both[a][1] = e[1][a] - self->momentum[n + 1][a];
    }
    hexload_whiten6(update->L, &both[0][0], 2);
    hexload_read_columns6(&both[0][0], 2, 0, e);
    for (int a = 0; a < 6; a++) {
        less[0][a] = -e[0][a];
        less[1][a] = -e[1][a];
    }
    for (int a = 0; (a < 6) && !self->is_paused; a++) {
        self->shown[n][a] += e[0][a];
        self->shown[n + 1][a] += e[1][a];
    }
    hexload_downdate6(self->load[n], self->load[n + 1], less, &update->U.load[0][0], DIM, DIM);
    hexload_downdate6(self->momentum[n], self->momentum[n + 1], less, &update->U.momentum[0][0], 6, 6);
}

HEXLOAD_APART void hexload_consider_move(hexload_consider_t* self, const hexload_momentum_filter_t* filter,
                                         const hexload_config_t* config, const hexload_delayed_tick_t* past,
                                         const hexload_rig_direction_t* direction) {
    const hexload_real_t dt_s = config->tick_s * (hexload_real_t)past->smooth.gap_ticks;
    hexload_real_t body[DIM];
    hexload_momentum_filter_body(filter, body);
    find_drive(config, body, past, direction, self->drive[self->next]);
    if (past->smooth.gap_ticks > 0) {
        hexload_momentum_input_t input;
        hexload_real_t G[PULLED][LIFTED];
        hexload_momentum_read_arms(&past->motion, &input);
        hexload_momentum_pull(&filter->last_input, &input, dt_s * config->gravity_m_s2, G);
        predict(self, config, dt_s, G);
    }
}

void hexload_consider_step(hexload_consider_t* self, hexload_momentum_filter_t* filter,
                           const hexload_config_t* config, const hexload_delayed_tick_t* past,
                           hexload_momentum_update_t* update) {
    const uint32_t directions = config->rig.direction_count;
    if (directions > 0) {
        hexload_consider_move(self, filter, config, past, hexload_consider_turn(self, config));
    }
    hexload_momentum_filter_step(filter, config, past, update);
    if (past->smooth.gap_ticks == 0) {
        hexload_consider_seed(self, config, filter, &past->motion);
        return;
    }
    for (uint32_t n = 0; n < directions; n += 2) {
        hexload_real_t e[2][6];
        hexload_consider_follow(self, config, n, update, e);
    }
}

void hexload_consider_widen(const hexload_consider_t* self, const hexload_config_t* config,
                            hexload_real_t dispersion, hexload_real_t sigma[DIM]) {
    for (int k = 0; k < DIM && config->rig.direction_count > 0; k++) {
        hexload_real_t variance = HEXLOAD_REAL(0.0);
        for (uint32_t n = 0; n < config->rig.direction_count; n++) {
            variance = hexload_fma(self->load[n][k], self->load[n][k], variance);
        }
        sigma[k] = hexload_sqrt(hexload_fma(dispersion, variance, sigma[k] * sigma[k]));
    }
}
