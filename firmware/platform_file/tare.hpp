// The empty platform's own parameters, as a run of it shows them: legs and modelling errors act on the
// estimator as a constant offset of theta.
#pragma once

#include "platform_file.hpp"

namespace hexload::platform {

using Vector10 = Eigen::Matrix<double, 10, 1>; // [m, hx, hy, hz, Ixx, Iyy, Izz, Ixy, Ixz, Iyz] about O_A

struct Tare {
    Vector10 theta = Vector10::Zero(); // empty platform less platform file
    Vector10 sigma = Vector10::Zero(); // standard deviation of each
};

// The empty platform's parameters.
Vector10 theta_of(const PlatformBody& platform);

// The platform file with the tare added to its platform. Throws InputError where no body has the sum.
PlatformFile with_tare(PlatformFile platform, const Vector10& tare);

// The platform file in which this share of the empty platform, 0 to 1, counts as an unknown load. Offsets of
// the platform, which themselves are no body, are then identified as part of one.
PlatformFile with_own_load(PlatformFile platform, double share);

} // namespace hexload::platform
