/// @file machine.h
/// What the tests know of a hexapod, in double precision and written independently of the firmware: inverse
/// kinematics, leg forces of a wanted wrench, random numbers.
#ifndef HEXLOAD_TEST_MACHINE_H
#define HEXLOAD_TEST_MACHINE_H

#include "algebra/real.h"
#include "hexload/hexload.h"

#include <unity.h>

/// Tolerance of a result that the core computes: `factor` roundings of a number of size `scale`.
#define ROUNDINGS(factor, scale) ((double)(factor) * (double)HEXLOAD_REAL_EPSILON * (double)(scale))

typedef struct pose {
    double p_m[3]; ///< from home, base axes
    double rpy[3]; ///< roll, pitch, yaw in rad: R = Rz(yaw) Ry(pitch) Rx(roll)
} pose_t;

/// The paper's machine, in the core's precision.
hexload_config_t paper_machine(void);

/// A machine with general hinges, a platform whose centre of mass is off O_A and unequal home lengths.
hexload_config_t crooked_machine(void);

void rotation_of(const pose_t* pose, double R[3][3]);

/// Length of each leg minus its home length, for O_A at home_height_m + p.
void leg_displacements(const hexload_config_t* config, double home_height_m, const pose_t* pose,
                       double displacement_m[6]);

/// Jacobian of the leg lengths by central differences of leg_displacements(): no formula shared with the
/// firmware.
void leg_jacobian(const hexload_config_t* config, double home_height_m, const pose_t* pose, double J[6][6]);

/// Solves A x = b by elimination with full row pivoting; A and b are overwritten.
void solve6(double A[6][6], double b[6], double x[6]);

/// Uniform in [-1, 1]; the same sequence for the same seed on every machine.
double uniform(uint64_t* seed);

/// Standard normal.
double normal(uint64_t* seed);

#endif
