// Where the twelve hinges are, how long the legs are, and whether such a machine can exist.
#pragma once

#include "types.hpp"

#include <array>
#include <optional>
#include <string>

namespace hexload::platform {

struct Geometry {
    std::array<Vector3, 6> base_hinges_m{};      // b_i, base axes
    std::array<Vector3, 6> platform_hinges_m{};  // a_i, platform axes
    Vector6 home_leg_length_m = Vector6::Zero(); // L0_i: leg length at zero displacement
    double stroke_min_m = 0.0;                   // leg displacement at the lower end stop
    double stroke_max_m = 0.0;                   // leg displacement at the upper end stop
    double home_height_m = 0.0;                  // h0, see derive_home_height_m
};

// Height of O_A above O_B at which, with R = I and x = y = 0, the mean leg length equals the mean
// home_leg_length_m. Not a number if the legs are too short to reach the platform.
double derive_home_height_m(const Geometry& geometry);

struct GeometryFault {
    std::string key; // platform file key that is wrong
    std::string found;
    std::string expected;
};

// The first reason why the machine cannot work, or nothing. Needs home_height_m. Checks hinges on one
// line, home pose not assemblable or beyond the stroke, and singular or nearly singular Jacobian at home.
std::optional<GeometryFault> find_geometry_fault(const Geometry& geometry);

} // namespace hexload::platform
