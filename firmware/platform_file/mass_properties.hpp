// Bodies: the empty moving platform, and what adds up when bodies are fixed to each other.
#pragma once

#include "types.hpp"

#include <optional>
#include <string>

namespace hexload::platform {

// The empty moving platform.
struct PlatformBody {
    double mass_kg = 0.0;
    Vector3 com_m = Vector3::Zero();         // platform axes, from O_A
    Matrix3 inertia_kg_m2 = Matrix3::Zero(); // tensor about O_A, platform axes
};

// Mass properties about O_A in platform axes; they add up.
struct MassProperties {
    double mass_kg = 0.0;
    Vector3 first_moment_kg_m = Vector3::Zero(); // m c
    Matrix3 inertia_kg_m2 = Matrix3::Zero();     // tensor about O_A

    Vector3 com_m() const {
        return first_moment_kg_m / mass_kg;
    }
    Matrix3 inertia_com_kg_m2() const; // tensor about the centre of mass
};

MassProperties mass_properties(const PlatformBody& platform);
MassProperties operator+(const MassProperties& a, const MassProperties& b);

// m (|c|^2 E - c c^T): what the parallel-axis theorem adds to a central tensor.
Matrix3 parallel_axis(double mass_kg, const Vector3& com_m);

enum class InertiaRule {
    non_negative, // rods and points allowed
    positive,
};

// Why no body can have this central tensor (a principal moment that breaks the rule, or one above the sum of
// the other two), or nothing.
std::optional<std::string> find_inertia_fault(const Matrix3& inertia_com_kg_m2, InertiaRule rule);

} // namespace hexload::platform
