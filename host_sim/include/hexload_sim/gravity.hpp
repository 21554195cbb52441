// Gravity as the platform feels it: in base axes, which a base off level turns away from the vertical.
#pragma once

#include <hexload_sim/types.hpp>

namespace hexload::sim {

// What a body at rest must be given, base axes: the opposite of the acceleration of free fall.
struct Gravity {
    // A level base. Implicit: a number is the usual way to say gravity.
    Gravity(double level_m_s2) : up_m_s2(0.0, 0.0, level_m_s2) {}

    // A base turned from level about its x axis, then about its y axis as it was: world <- base is Ry(y)
    // Rx(x).
    Gravity(double magnitude_m_s2, double tilt_x_rad, double tilt_y_rad);

    Vector3 up_m_s2;
};

} // namespace hexload::sim
