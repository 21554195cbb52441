/// @file kinematics.h
/// Second stage: pose, Jacobian and twist of the platform from the legs. Paper (1)-(4).
#ifndef HEXLOAD_KINEMATICS_H
#define HEXLOAD_KINEMATICS_H

#include "algebra/real.h"
#include "hexload/state.h"

HEXLOAD_DECLS_BEGIN

/// Newton steps of one search; a tick that follows another needs one or two, a start from home about five.
enum { HEXLOAD_NEWTON_STEPS_MAX = 8 };

/// Motion of the platform at one tick. Twists are [v; omega], base axes, of O_A.
typedef struct hexload_motion {
    hexload_real_t p_m[3];             ///< O_A minus its home position, base axes
    hexload_real_t quaternion[4];      ///< w, x, y, z of R; unit
    hexload_real_t R[3][3];            ///< base <- platform
    hexload_real_t J[HEXLOAD_LEGS][6]; ///< leg velocities = J [v; omega]; row i = [e_i, R a_i x e_i]
    hexload_real_t twist[6];           ///< [v m/s; omega rad/s] from the measured leg velocities
    uint32_t newton_steps;             ///< Jacobians evaluated by this call's search
    /// J taken apart, to solve with it: the hexload_kinematics_t's that found this motion, until its next
    /// search.
    const hexload_leg_blocks_t* jacobian;
} hexload_motion_t;

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

/// The same as a function, for code that is made small.
#ifdef HEXLOAD_INLINE_KERNELS
static inline void hexload_to_platform(const hexload_motion_t* motion, const hexload_real_t base_axes[3],
                                       hexload_real_t platform_axes[3]) {
    hexload_motion_to_platform(motion, base_axes, platform_axes);
}
#else
void hexload_to_platform(const hexload_motion_t* motion, const hexload_real_t base_axes[3],
                         hexload_real_t platform_axes[3]);
#endif

HEXLOAD_DECLS_END

#endif
