// Vectors, matrices and the two motion types that every stage of the plant shares.
#pragma once

#include <Eigen/Core>

namespace hexload::sim {

using Vector3 = Eigen::Vector3d;
using Matrix3 = Eigen::Matrix3d;
using Vector6 = Eigen::Matrix<double, 6, 1>; // six legs, or a twist/wrench with the linear part first
using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Matrix36 = Eigen::Matrix<double, 3, 6>; // one column per leg
using Legs = Eigen::Array<double, 6, 1>;      // six legs, element-wise arithmetic

inline constexpr double tick_s = 1e-3; // sampling period of controller and estimator

// Pose of platform frame A in base frame B.
struct Pose {
    Vector3 p_m = Vector3::Zero();   // displacement of O_A from its home position [0, 0, h0], base axes
    Matrix3 R = Matrix3::Identity(); // base <- platform
};

// Velocity of frame A, both parts in base axes.
struct Twist {
    Vector3 v_m_s = Vector3::Zero();
    Vector3 w_rad_s = Vector3::Zero();

    Vector6 stacked() const {
        return (Vector6() << v_m_s, w_rad_s).finished();
    }
};

// What a leg's transducers see, before any sensor error.
struct LegState {
    Legs displacement_m = Legs::Zero();
    Legs velocity_m_s = Legs::Zero();
    Legs force_n = Legs::Zero();
};

} // namespace hexload::sim
