#include <hexload_sim/machine.hpp>

#include "platform_file/input_error.hpp"

#include <hexload_sim/random.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace hexload::sim {

Gravity::Gravity(double magnitude_m_s2, double tilt_x_rad, double tilt_y_rad)
    : up_m_s2(magnitude_m_s2 * Vector3(0.0 - std::sin(tilt_y_rad),
                                       std::cos(tilt_y_rad) * std::sin(tilt_x_rad),
                                       std::cos(tilt_y_rad) * std::cos(tilt_x_rad))) {}

MachineSettings::MachineSettings() {
    base_hinge_errors_m.fill(Vector3::Zero());
    platform_hinge_errors_m.fill(Vector3::Zero());
}

bool MachineSettings::has_hinge_errors() const {
    const auto is_off = [](const Vector3& error_m) { return !error_m.isZero(0.0); };
    return hinge_error_sigma_m > 0.0 || std::ranges::any_of(base_hinge_errors_m, is_off) ||
           std::ranges::any_of(platform_hinge_errors_m, is_off);
}

Machine true_machine(const PlatformFile& platform, const MachineSettings& settings) {
    Machine machine{platform.geometry, platform.platform,
                    Gravity(platform.gravity_m_s2, settings.tilt_rad[0], settings.tilt_rad[1])};
    machine.platform.mass_kg *= settings.platform_scale;
    machine.platform.inertia_kg_m2 *= settings.platform_scale;
    if (!settings.has_hinge_errors()) {
        return machine;
    }
    RandomStream random(static_cast<std::uint64_t>(settings.hinge_error_seed), RandomPurpose::hinge_errors);
    const auto misplace = [&](std::array<Vector3, 6>& hinges_m, const std::array<Vector3, 6>& errors_m) {
        for (std::size_t leg = 0; leg < 6; ++leg) {
            for (int axis = 0; axis < 3; ++axis) {
                hinges_m[leg](axis) += errors_m[leg](axis) + settings.hinge_error_sigma_m * random.normal();
            }
        }
    };
    misplace(machine.geometry.base_hinges_m, settings.base_hinge_errors_m);
    misplace(machine.geometry.platform_hinges_m, settings.platform_hinge_errors_m);
    if (const auto fault = find_geometry_fault(machine.geometry)) {
        throw InputError(fmt::format("machine: found {} with its hinge errors, expected {}", fault->found,
                                     fault->expected));
    }
    return machine;
}

} // namespace hexload::sim
