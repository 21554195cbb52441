// Vectors and matrices of what is said of a machine.
#pragma once

#include <Eigen/Core>

namespace hexload::platform {

using Vector3 = Eigen::Vector3d;
using Matrix3 = Eigen::Matrix3d;
using Vector6 = Eigen::Matrix<double, 6, 1>; // six legs, or a twist/wrench with the linear part first
using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Matrix36 = Eigen::Matrix<double, 3, 6>; // one column per leg
using Legs = Eigen::Array<double, 6, 1>;      // six legs, element-wise arithmetic

inline constexpr double tick_s = 1e-3; // sampling period of controller and estimator

} // namespace hexload::platform
