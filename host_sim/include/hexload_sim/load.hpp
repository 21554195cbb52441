// The load on the platform, which moves with the platform's own body.
#pragma once

#include "platform_file/mass_properties.hpp"

#include <hexload_sim/types.hpp>

namespace hexload::sim {

// A load fixed to the platform. mass_kg = 0: no load.
struct Load {
    double mass_kg = 0.0;
    Vector3 com_m = Vector3::Zero();             // platform axes, from O_A
    Matrix3 inertia_com_kg_m2 = Matrix3::Zero(); // tensor about the load's own centre of mass, platform axes

    // [m, hx, hy, hz, Ixx, Iyy, Izz, Ixy, Ixz, Iyz], h = m c, tensor entries about O_A.
    Eigen::Matrix<double, 10, 1> theta() const;
};

using platform::mass_properties; // of the empty platform
MassProperties mass_properties(const Load& load);

} // namespace hexload::sim
