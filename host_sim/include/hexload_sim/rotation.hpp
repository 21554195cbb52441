// Rotations: R = Rz(yaw) Ry(pitch) Rx(roll), base <- platform.
#pragma once

#include <hexload_sim/types.hpp>

namespace hexload::sim {

// [a]x, so that skew(a) * b = a x b; (8).
Matrix3 skew(const Vector3& a);

// rpy_rad = [roll, pitch, yaw].
Matrix3 rotation_from_rpy(const Vector3& rpy_rad);

// Inverse of rotation_from_rpy for |pitch| < pi/2.
Vector3 rpy_from_rotation(const Matrix3& R);

// E with omega = E d(rpy)/dt, omega in base axes.
Matrix3 rpy_rate_to_angular_velocity(const Vector3& rpy_rad);

// exp([rotation_vector]x), Rodrigues.
Matrix3 rotation_from_vector(const Vector3& rotation_vector_rad);

} // namespace hexload::sim
