// Vectors and matrices of what is said of a machine.
#pragma once

#include <Eigen/Core>

#include <cstdint>

namespace hexload::platform {

using Vector3 = Eigen::Vector3d;
using Matrix3 = Eigen::Matrix3d;
using Vector6 = Eigen::Matrix<double, 6, 1>; // six legs, or a twist/wrench with the linear part first
using Matrix6 = Eigen::Matrix<double, 6, 6>;
using Matrix36 = Eigen::Matrix<double, 3, 6>; // one column per leg
using Legs = Eigen::Array<double, 6, 1>;      // six legs, element-wise arithmetic

// Sampling period of sensors, controller and estimator where the platform file says none.
inline constexpr double default_tick_s = 1e-3;
inline constexpr double shortest_tick_s = 0.25e-3;
inline constexpr double longest_tick_s = 5e-3;

// When a tick is: of periods that divide a second the nearest double of the decimal, which prints short.
inline double time_of_tick_s(std::uint32_t tick, double tick_s) {
    return static_cast<double>(tick) / (1.0 / tick_s);
}

} // namespace hexload::platform
