/// @file motion.h
/// A platform with load on a prescribed motion, by inverse dynamics: leg samples that are exact to rounding,
/// for any motion and load, without a servo and without integration.
#ifndef HEXLOAD_TEST_MOTION_H
#define HEXLOAD_TEST_MOTION_H

#include "machine.h"

typedef struct body {
    double mass_kg;
    double com_m[3];             ///< platform axes
    double inertia_com_kg_m2[6]; ///< about its own centre of mass, order of enum hexload_inertia
} body_t;

/// Its ten parameters about O_A, in the order of enum hexload_load_parameter, by the parallel-axis theorem.
void theta_of(const body_t* body, double theta[10]);

/// Two sines for each of the six coordinates, x y z roll pitch yaw.
typedef struct motion {
    double amplitude[6][2]; ///< m and rad
    double frequency_hz[6][2];
    double phase_rad[6][2];
} motion_t;

/// Sines with amplitudes up to translation_m and rotation_rad, frequencies of 0.3 to 3 Hz.
motion_t random_motion(uint64_t seed, double translation_m, double rotation_rad);

/// The paper's excitation (23) with 0.2 degrees of yaw, plus a tilt of tilt_rad at other frequencies.
motion_t paper_motion(double tilt_rad);

pose_t pose_at(const motion_t* motion, double t_s);

/// What perfect sensors say at t_s when `load` rides on config's platform.
hexload_leg_sample_t perfect_sample(const hexload_config_t* config, const body_t* load,
                                    const motion_t* motion, double home_height_m, uint32_t tick);

/// Adds the configured sensors' white noise; displacement noise is 20 um.
void add_noise(const hexload_config_t* config, uint64_t* seed, hexload_leg_sample_t* sample);

#endif
