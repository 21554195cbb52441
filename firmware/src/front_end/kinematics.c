#include "front_end/kinematics.h"

#include "algebra/leg_blocks.h"
#include "algebra/linalg.h"

#include <string.h>

enum { HOME_HEIGHT_STEPS = 30 };

/// Q = R - E. Taking E out first keeps the small rotations of a hexapod exact to rounding.
static void rotation_minus_identity(const hexload_real_t q[4], hexload_real_t Q[3][3]) {
    const hexload_real_t w = HEXLOAD_REAL(2.0) * q[0];
    const hexload_real_t x = HEXLOAD_REAL(2.0) * q[1];
    const hexload_real_t y = HEXLOAD_REAL(2.0) * q[2];
    const hexload_real_t z = HEXLOAD_REAL(2.0) * q[3];
    const hexload_real_t xy = x * q[2];
    const hexload_real_t xz = x * q[3];
    const hexload_real_t yz = y * q[3];
    const hexload_real_t xx = x * q[1];
    const hexload_real_t zz = z * q[3];
    Q[0][0] = hexload_fma(-y, q[2], -zz);
    Q[1][1] = -xx - zz;
    Q[2][2] = hexload_fma(-y, q[2], -xx);
    Q[0][1] = hexload_fma(-w, q[3], xy);
    Q[1][0] = hexload_fma(w, q[3], xy);
    Q[0][2] = hexload_fma(w, q[2], xz);
    Q[2][0] = hexload_fma(-w, q[2], xz);
    Q[1][2] = hexload_fma(-w, q[1], yz);
    Q[2][1] = hexload_fma(w, q[1], yz);
}

/// Moves a pose by a small twist times time, [translation; rotation vector] in base axes.
static void move_pose(hexload_real_t p[3], hexload_real_t q[4], const hexload_real_t step[6]) {
    const hexload_real_t half[3] = {HEXLOAD_REAL(0.5) * step[3], HEXLOAD_REAL(0.5) * step[4],
                                    HEXLOAD_REAL(0.5) * step[5]};
    hexload_real_t turned[3];
    cross3(half, &q[1], turned);
    const hexload_real_t w = q[0] - dot3(half, &q[1]);
    const hexload_real_t xyz[3] = {hexload_fma(half[0], q[0], q[1] + turned[0]),
                                   hexload_fma(half[1], q[0], q[2] + turned[1]),
                                   hexload_fma(half[2], q[0], q[3] + turned[2])};
    const hexload_real_t inverse_norm = HEXLOAD_REAL(1.0) / hexload_sqrt(hexload_fma(w, w, dot3(xyz, xyz)));
    q[0] = w * inverse_norm;
    HEXLOAD_UNROLL
    for (int k = 0; k < 3; k++) {
        q[1 + k] = xyz[k] * inverse_norm;
        p[k] += step[k];
    }
}

/// Leg vectors (1) of a pose, its Jacobian (3), and by how much the legs are too short. With u = p + (R - E)
/// a and the home leg c, |L|^2 - L0^2 = |c|^2 - L0^2 + u.(2c + u): displacements without the cancellation of
/// |L| - L0.
/// @return the largest length error.
static hexload_real_t legs_of_pose(const hexload_kinematics_t* self, const hexload_geometry_t* geometry,
                                   const hexload_leg_sample_t* sample, hexload_motion_t* motion,
                                   hexload_real_t error_m[6]) {
    hexload_real_t Q[3][3];
    hexload_real_t largest_m = HEXLOAD_REAL(0.0);
    rotation_minus_identity(motion->quaternion, Q);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        const hexload_real_t* a = geometry->platform_hinge_m[leg];
        const hexload_real_t* c = self->home_leg_m[leg];
        hexload_real_t lever[3]; // R a
        hexload_real_t L[3];
        hexload_real_t square_growth = self->home_defect_m2[leg];
        HEXLOAD_UNROLL
        for (int k = 0; k < 3; k++) {
            const hexload_real_t turned = dot3(Q[k], a);
            const hexload_real_t u = motion->p_m[k] + turned;
            lever[k] = a[k] + turned;
            L[k] = c[k] + u;
            square_growth = hexload_fma(u, c[k] + L[k], square_growth);
        }
        const hexload_real_t length_m = hexload_sqrt(dot3(L, L));
        const hexload_real_t inverse_length = HEXLOAD_REAL(1.0) / length_m;
        HEXLOAD_UNROLL
        for (int k = 0; k < 3; k++) {
            motion->J[leg][k] = L[k] * inverse_length;
        }
        cross3(lever, &motion->J[leg][0], &motion->J[leg][3]);
        error_m[leg] =
            sample->displacement_m[leg] - square_growth / (length_m + geometry->home_leg_length_m[leg]);
        largest_m = hexload_max(largest_m, hexload_abs(error_m[leg]));
    }
    return largest_m;
}

/// Newton's method on the leg lengths, from the pose in motion. The last step starts from an error so small
/// that the one it leaves, which is its square, is below rounding, and that the Jacobian of its start serves.
static hexload_status_t find_pose(const hexload_kinematics_t* self, const hexload_geometry_t* geometry,
                                  const hexload_leg_sample_t* sample, bool is_from_last,
                                  hexload_motion_t* motion, hexload_leg_blocks_t* jacobian) {
    memcpy(jacobian->leg, self->jacobian.leg, sizeof jacobian->leg);
    const hexload_real_t start_m =
        HEXLOAD_REAL(0.003) * hexload_sqrt(HEXLOAD_REAL_EPSILON) * geometry->home_leg_length_m[0];
    for (uint32_t newton_steps = 1; newton_steps <= HEXLOAD_NEWTON_STEPS_MAX; newton_steps++) {
        hexload_real_t error_m[HEXLOAD_LEGS];
        hexload_real_t step[6];
        const hexload_real_t largest_m = legs_of_pose(self, geometry, sample, motion, error_m);
        const bool is_made = is_from_last ? hexload_leg_blocks_update(motion->J, jacobian)
                                          : hexload_leg_blocks_make(motion->J, jacobian); // leads anywhere
        if (!is_made) {
            return HEXLOAD_ERR_SINGULAR;
        }
        hexload_leg_blocks_solve(jacobian, error_m, step);
        move_pose(motion->p_m, motion->quaternion, step);
        if (largest_m < start_m) {
            motion->newton_steps = newton_steps;
            return HEXLOAD_OK;
        }
    }
    return HEXLOAD_ERR_POSE;
}

/// h0 by Newton's method from above, where the mean leg length is convex and rises with the height.
static hexload_status_t find_home_height(const hexload_geometry_t* geometry, hexload_real_t* home_height_m) {
    hexload_real_t mean_length_m = HEXLOAD_REAL(0.0);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        mean_length_m += geometry->home_leg_length_m[leg] / HEXLOAD_REAL(6.0);
    }
    hexload_real_t lowest_m = geometry->platform_hinge_m[0][2] - geometry->base_hinge_m[0][2];
    for (int leg = 1; leg < HEXLOAD_LEGS; leg++) {
        lowest_m = hexload_min(lowest_m, geometry->platform_hinge_m[leg][2] - geometry->base_hinge_m[leg][2]);
    }
    hexload_real_t height_m = HEXLOAD_REAL(2.0) * mean_length_m - lowest_m;
    hexload_real_t error_m = mean_length_m;
    for (int step = 0; step < HOME_HEIGHT_STEPS; step++) {
        hexload_real_t slope = HEXLOAD_REAL(0.0);
        error_m = -mean_length_m;
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            const hexload_real_t* a = geometry->platform_hinge_m[leg];
            const hexload_real_t* b = geometry->base_hinge_m[leg];
            const hexload_real_t L[3] = {a[0] - b[0], a[1] - b[1], height_m + a[2] - b[2]};
            const hexload_real_t length_m = hexload_sqrt(dot3(L, L));
            error_m += length_m / HEXLOAD_REAL(6.0);
            slope += L[2] / (HEXLOAD_REAL(6.0) * length_m);
        }
        if (!(slope > HEXLOAD_REAL(0.01))) { // legs (nearly) flat: no height has this leg length
            return HEXLOAD_ERR_POSE;
        }
        height_m -= error_m / slope;
    }
    *home_height_m = height_m;
    return hexload_abs(error_m) < HEXLOAD_REAL(1e-5) * mean_length_m ? HEXLOAD_OK : HEXLOAD_ERR_POSE;
}

hexload_status_t hexload_kinematics_init(hexload_kinematics_t* self, const hexload_config_t* config) {
    const hexload_geometry_t* geometry = &config->geometry;
    hexload_kinematics_t fresh = {0};
    hexload_status_t status = find_home_height(geometry, &fresh.home_height_m);
    if (status != HEXLOAD_OK) {
        return status;
    }
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        const hexload_real_t L0 = geometry->home_leg_length_m[leg];
        for (int k = 0; k < 3; k++) {
            fresh.home_leg_m[leg][k] = geometry->platform_hinge_m[leg][k] - geometry->base_hinge_m[leg][k];
        }
        fresh.home_leg_m[leg][2] += fresh.home_height_m;
        fresh.home_defect_m2[leg] = dot3(fresh.home_leg_m[leg], fresh.home_leg_m[leg]) - L0 * L0;
    }
    fresh.quaternion[0] = HEXLOAD_REAL(1.0);

    const hexload_leg_sample_t no_displacement = {0};
    hexload_motion_t home = {.quaternion = {HEXLOAD_REAL(1.0)}};
    hexload_real_t error_m[HEXLOAD_LEGS];
    (void)legs_of_pose(&fresh, geometry, &no_displacement, &home, error_m);
    if (!hexload_leg_blocks_make(home.J, &fresh.jacobian)) {
        return HEXLOAD_ERR_SINGULAR;
    }
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        fresh.displacement_m[leg] = -error_m[leg];
    }
    *self = fresh;
    return HEXLOAD_OK;
}

/// Newton's first step from the last pose, whose legs and Jacobian are known; from farther away home is as
/// good a start, and one that cannot be the wrong one.
/// @return true when it is the last pose.
static bool begin_search(const hexload_kinematics_t* self, const hexload_geometry_t* geometry,
                         const hexload_leg_sample_t* sample, hexload_motion_t* motion) {
    hexload_real_t moved_m[HEXLOAD_LEGS];
    hexload_real_t step[6];
    hexload_real_t farthest_m = HEXLOAD_REAL(0.0);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        moved_m[leg] = sample->displacement_m[leg] - self->displacement_m[leg];
        farthest_m = hexload_max(farthest_m, hexload_abs(moved_m[leg]));
    }
    if (self->is_lost || farthest_m > HEXLOAD_REAL(0.05) * geometry->home_leg_length_m[0]) {
        memset(motion->p_m, 0, sizeof motion->p_m);
        memset(motion->quaternion, 0, sizeof motion->quaternion);
        motion->quaternion[0] = HEXLOAD_REAL(1.0);
        return false;
    }
    hexload_leg_blocks_solve(&self->jacobian, moved_m, step);
    memcpy(motion->p_m, self->p_m, sizeof motion->p_m);
    memcpy(motion->quaternion, self->quaternion, sizeof motion->quaternion);
    move_pose(motion->p_m, motion->quaternion, step);
    return true;
}

/// Newton can end in another assembly of the same legs, such as the mirror image below the base. No platform
/// moves farther from home than a leg's length or turns by 90 degrees.
static bool is_near_home(const hexload_motion_t* motion, const hexload_geometry_t* geometry) {
    const hexload_real_t reach_m = geometry->home_leg_length_m[0];
    const hexload_real_t half_turn = motion->quaternion[0] * motion->quaternion[0]; // cos^2 of half the angle
    return dot3(motion->p_m, motion->p_m) < reach_m * reach_m && half_turn > HEXLOAD_REAL(0.5);
}

/// The pose found is the present one, and the next search starts from it.
static void accept_pose(hexload_kinematics_t* self, const hexload_leg_sample_t* sample,
                        const hexload_leg_blocks_t* jacobian, hexload_motion_t* motion) {
    memcpy(self->p_m, motion->p_m, sizeof self->p_m);
    memcpy(self->quaternion, motion->quaternion, sizeof self->quaternion);
    memcpy(self->displacement_m, sample->displacement_m, sizeof self->displacement_m);
    leg_blocks_copy(jacobian, &self->jacobian);
    rotation_minus_identity(motion->quaternion, motion->R);
    for (int k = 0; k < 3; k++) {
        motion->R[k][k] += HEXLOAD_REAL(1.0);
    }
}

hexload_status_t hexload_kinematics_solve(hexload_kinematics_t* self, const hexload_config_t* config,
                                          const hexload_leg_sample_t* sample, hexload_motion_t* motion) {
    hexload_leg_blocks_t jacobian;
    const bool is_from_last = begin_search(self, &config->geometry, sample, motion);
    hexload_status_t status = find_pose(self, &config->geometry, sample, is_from_last, motion, &jacobian);
    if (status == HEXLOAD_OK && !is_near_home(motion, &config->geometry)) {
        status = HEXLOAD_ERR_POSE;
    }
    if (status != HEXLOAD_OK) {
        self->is_lost = self->is_lost || is_from_last;
        return status;
    }
    self->is_lost = false;
    accept_pose(self, sample, &jacobian, motion);
    motion->jacobian = &self->jacobian;
    hexload_leg_blocks_solve(motion->jacobian, sample->velocity_m_s, motion->twist); // inverse of (3)
    return HEXLOAD_OK;
}

#ifndef HEXLOAD_INLINE_KERNELS
void hexload_to_platform(const hexload_motion_t* motion, const hexload_real_t base_axes[3],
                         hexload_real_t platform_axes[3]) {
    hexload_motion_to_platform(motion, base_axes, platform_axes);
}
#endif
