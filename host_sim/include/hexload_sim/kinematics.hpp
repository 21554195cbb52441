// Inverse and forward kinematics and the velocity Jacobian: (1)-(3) with the errata of A, B, R.
#pragma once

#include "platform_file/geometry.hpp"

#include <hexload_sim/types.hpp>

#include <optional>

namespace hexload::sim {

struct LegVectors {
    Matrix36 direction; // column i: e_i = L_i / |L_i|, base axes
    Vector6 length_m;   // |L_i|
    Matrix36 arm_m;     // column i: R a_i, base axes
};

// (1): L_i = p0 + p + R a_i - b_i.
LegVectors leg_vectors(const Geometry& geometry, const Pose& pose);

// |L_i| - L0_i, positive = extended.
Vector6 leg_displacement(const Geometry& geometry, const Pose& pose);

// (3): d|L|/dt = J V, row i = [e_i^T, (R a_i x e_i)^T].
Matrix6 jacobian(const LegVectors& legs);
Matrix6 jacobian(const Geometry& geometry, const Pose& pose);

// (2), (3): d|L_i|/dt in m/s.
Vector6 leg_velocity(const Geometry& geometry, const Pose& pose, const Twist& twist);

// dJ/dt V: the leg accelerations of a platform whose twist does not change.
Vector6 leg_acceleration_bias(const LegVectors& legs, const Twist& twist);

// Newton's method from `guess`, with step halving where a full step does not reduce the leg length error.
// Nothing if the displacement belongs to no pose near the guess.
std::optional<Pose> forward_kinematics(const Geometry& geometry, const Vector6& displacement_m,
                                       const Pose& guess = {});

} // namespace hexload::sim
