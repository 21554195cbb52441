// What every stage of the plant shares: the machine and its vectors as the platform file has them, and how
// it moves.
#pragma once

#include "platform_file/types.hpp"

namespace hexload::sim {

using namespace platform; // the machine, in the words of its file

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
