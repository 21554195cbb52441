// Newton-Euler dynamics of platform + load about O_A, in base axes: (5)-(19), corrected, nothing neglected.
// Legs are massless here; leg_inertia.hpp has their mass. Wrenches are [force; moment about O_A].
#pragma once

#include <hexload_sim/gravity.hpp>
#include <hexload_sim/kinematics.hpp>
#include <hexload_sim/load.hpp>

namespace hexload::sim {

// (18) with the tensor about O_A; (19) shows the entries that (18) misprints.
Matrix6 mass_matrix(const MassProperties& body, const Matrix3& R);

// (19): the off-diagonal part of (18), which couples the six degrees of freedom.
Matrix6 coupling_matrix(const MassProperties& body, const Matrix3& R);

// H(q, q') q' of (11): [w x (w x m l); w x (I w)]. The force row is the centripetal term that (5) and (9)
// drop.
Vector6 bias_wrench(const MassProperties& body, const Matrix3& R, const Vector3& w_rad_s);

// G of (11): the wrench that HOLDS the platform against gravity, [m g up; l x m g up]; equals the gradient of
// the potential energy. (10) drops the moment.
Vector6 gravity_wrench(const MassProperties& body, const Matrix3& R, const Gravity& gravity);

// Forward dynamics, (11) and (12): V' = M^-1 (J^T f - H - G), linear part first.
Vector6 acceleration(const Geometry& geometry, const MassProperties& body, const Gravity& gravity,
                     const Pose& pose, const Twist& twist, const Vector6& leg_force_n);

// Inverse dynamics, (11) and (12): f = J^-T (M V' + H + G); twist_rate = V'.
Vector6 leg_forces(const Geometry& geometry, const MassProperties& body, const Gravity& gravity,
                   const Pose& pose, const Twist& twist, const Vector6& twist_rate);

// (13): f = mass l'' + bias + gravity, with (14). (15) is the same without bias.
struct JointSpaceModel {
    Matrix6 mass_kg;   // J^-T M J^-1
    Vector6 bias_n;    // J^-T (M d(J^-1)/dt l' + H V)
    Vector6 gravity_n; // J^-T G
};
JointSpaceModel joint_space_model(const Geometry& geometry, const MassProperties& body,
                                  const Gravity& gravity, const Pose& pose, const Twist& twist);

// 1/2 V^T M V.
double kinetic_energy_j(const MassProperties& body, const Matrix3& R, const Twist& twist);

// m g (height of the centre of mass above its home height with R = I); height is along the vertical.
double potential_energy_j(const MassProperties& body, const Gravity& gravity, const Pose& pose);

} // namespace hexload::sim
