/// @file kinematics.h
/// Second stage: pose, Jacobian and twist of the platform from the legs. Paper (1)-(4).
#ifndef HEXLOAD_KINEMATICS_H
#define HEXLOAD_KINEMATICS_H

#include "hexload/leg_sample.h"

#include <stdbool.h>

HEXLOAD_DECLS_BEGIN

/// Newton steps of one search; a tick that follows another needs one or two, a start from home about five.
enum { HEXLOAD_NEWTON_STEPS_MAX = 8 };

/// A leg Jacobian taken apart, to solve J x = y. E are its left columns, M its right ones. Three legs, the
/// carriers (1), give the velocity once the rotation is known, and the other three (2) the rotation:
///     omega = S^-1 (y2 - K y1),  v = E1^-1 (y1 - M1 omega)  with  K = E2 E1^-1,  S = M2 - K M1
typedef struct hexload_leg_blocks {
    uint8_t leg[HEXLOAD_LEGS]; ///< the carriers, then the others
    hexload_real_t E1_inverse[3][3];
    hexload_real_t M1[3][3];
    hexload_real_t K[3][3];
    hexload_real_t S_inverse[3][3];
} hexload_leg_blocks_t;

/// Motion of the platform at one tick. Twists are [v; omega], base axes, of O_A.
typedef struct hexload_motion {
    hexload_real_t p_m[3];             ///< O_A minus its home position, base axes
    hexload_real_t quaternion[4];      ///< w, x, y, z of R; unit
    hexload_real_t R[3][3];            ///< base <- platform
    hexload_real_t J[HEXLOAD_LEGS][6]; ///< leg velocities = J [v; omega]; row i = [e_i, R a_i x e_i]
    hexload_real_t twist[6];           ///< [v m/s; omega rad/s] from the measured leg velocities
    uint32_t newton_steps;             ///< Jacobians evaluated by this call's search
} hexload_motion_t;

/// Constants of the geometry and the last pose, from which the next search starts.
typedef struct hexload_kinematics {
    hexload_real_t home_leg_m[HEXLOAD_LEGS][3];  ///< p0 + a_i - b_i
    hexload_real_t home_defect_m2[HEXLOAD_LEGS]; ///< its square minus L0_i^2: 0 on a symmetric machine
    hexload_real_t home_height_m;                ///< h0: with R = E the mean leg length is the mean L0_i
    hexload_real_t p_m[3];
    hexload_real_t quaternion[4];
    hexload_real_t displacement_m[HEXLOAD_LEGS]; ///< the legs of that pose
    hexload_leg_blocks_t jacobian;               ///< there
    bool is_lost;                                ///< no search starts from that pose any more
} hexload_kinematics_t;

/// Finds the home height and starts at the home pose.
/// @return HEXLOAD_OK; HEXLOAD_ERR_POSE: no height fits these legs; HEXLOAD_ERR_SINGULAR: home is a singular
/// pose.
HEXLOAD_MUST_USE hexload_status_t hexload_kinematics_init(hexload_kinematics_t* self,
                                                          const hexload_config_t* config);

/// Forward kinematics by Newton's method, from the last pose or, when the legs have moved far or nothing was
/// found from there the last time, from home; then the twist. Leg lengths of the result agree with the
/// displacements to a few ulp; the Jacobian is that of a pose less than a micrometre away. Poses beyond a
/// leg's length or 90 degrees from home are other assemblies of the same legs and count as not found.
/// @return HEXLOAD_OK, HEXLOAD_ERR_POSE or HEXLOAD_ERR_SINGULAR; then motion means nothing, and of self no
///         more than is_lost has changed. Reentrant. Worst case: HEXLOAD_NEWTON_STEPS_MAX Jacobians; one on a
///         tick that follows another up to 1 m/s, as the first step uses the last tick's.
HEXLOAD_MUST_USE hexload_status_t hexload_kinematics_solve(hexload_kinematics_t* self,
                                                           const hexload_config_t* config,
                                                           const hexload_leg_sample_t* sample,
                                                           hexload_motion_t* motion);

/// Components of a vector in platform axes, from those in base axes: R^T x.
static inline void hexload_motion_to_platform(const hexload_motion_t* motion,
                                              const hexload_real_t base_axes[3],
                                              hexload_real_t platform_axes[3]) {
    HEXLOAD_UNROLL
    for (int k = 0; k < 3; k++) {
        platform_axes[k] =
            hexload_fma(motion->R[2][k], base_axes[2],
                        hexload_fma(motion->R[1][k], base_axes[1], motion->R[0][k] * base_axes[0]));
    }
}

HEXLOAD_DECLS_END

#endif
