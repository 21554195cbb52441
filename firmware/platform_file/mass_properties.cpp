#include "mass_properties.hpp"

#include <Eigen/Eigenvalues>
#include <fmt/format.h>

namespace hexload::platform {

Matrix3 parallel_axis(double mass_kg, const Vector3& com_m) {
    return mass_kg * (com_m.squaredNorm() * Matrix3::Identity() - com_m * com_m.transpose());
}

Matrix3 MassProperties::inertia_com_kg_m2() const {
    return inertia_kg_m2 - parallel_axis(mass_kg, com_m());
}

MassProperties mass_properties(const PlatformBody& platform) {
    return {platform.mass_kg, platform.mass_kg * platform.com_m, platform.inertia_kg_m2};
}

MassProperties operator+(const MassProperties& a, const MassProperties& b) {
    return {a.mass_kg + b.mass_kg, a.first_moment_kg_m + b.first_moment_kg_m,
            a.inertia_kg_m2 + b.inertia_kg_m2};
}

std::optional<std::string> find_inertia_fault(const Matrix3& inertia_com_kg_m2, InertiaRule rule) {
    const Vector3 principal =
        Eigen::SelfAdjointEigenSolver<Matrix3>(inertia_com_kg_m2).eigenvalues(); // ascending
    const double rounding = 1e-12 * principal.cwiseAbs().maxCoeff();
    const bool signs_right =
        rule == InertiaRule::positive ? principal(0) > rounding : principal(0) >= -rounding;
    const bool is_consistent = signs_right && principal(2) <= principal(0) + principal(1) + rounding;
    if (is_consistent) {
        return std::nullopt;
    }
    return fmt::format("principal moments {:.6g}, {:.6g}, {:.6g} kg m^2 about the centre of mass",
                       principal(0), principal(1), principal(2));
}

} // namespace hexload::platform
