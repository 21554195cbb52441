#include <hexload_sim/rotation.hpp>

#include <Eigen/Geometry>

#include <cmath>

namespace hexload::sim {

Matrix3 skew(const Vector3& a) {
    return (Matrix3() << 0.0, -a.z(), a.y(), a.z(), 0.0, -a.x(), -a.y(), a.x(), 0.0).finished();
}

Matrix3 rotation_from_rpy(const Vector3& rpy_rad) {
    return (Eigen::AngleAxisd(rpy_rad.z(), Vector3::UnitZ()) *
            Eigen::AngleAxisd(rpy_rad.y(), Vector3::UnitY()) *
            Eigen::AngleAxisd(rpy_rad.x(), Vector3::UnitX()))
        .toRotationMatrix();
}

Vector3 rpy_from_rotation(const Matrix3& R) {
    return {std::atan2(R(2, 1), R(2, 2)), std::atan2(-R(2, 0), std::hypot(R(2, 1), R(2, 2))),
            std::atan2(R(1, 0), R(0, 0))};
}

Matrix3 rpy_rate_to_angular_velocity(const Vector3& rpy_rad) {
    const double cos_pitch = std::cos(rpy_rad.y());
    const double cos_yaw = std::cos(rpy_rad.z());
    const double sin_yaw = std::sin(rpy_rad.z());
    return (Matrix3() << cos_pitch * cos_yaw, -sin_yaw, 0.0, //
            cos_pitch * sin_yaw, cos_yaw, 0.0,               //
            -std::sin(rpy_rad.y()), 0.0, 1.0)
        .finished();
}

Matrix3 rotation_from_vector(const Vector3& rotation_vector_rad) {
    const double angle_rad = rotation_vector_rad.norm();
    if (angle_rad == 0.0) {
        return Matrix3::Identity();
    }
    return Eigen::AngleAxisd(angle_rad, rotation_vector_rad / angle_rad).toRotationMatrix();
}

} // namespace hexload::sim
