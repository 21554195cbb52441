#include "tare.hpp"

#include "input_error.hpp"

#include <fmt/format.h>

namespace hexload::platform {

Vector10 theta_of(const PlatformBody& platform) {
    const MassProperties body = mass_properties(platform);
    const Vector3& h = body.first_moment_kg_m;
    const Matrix3& I = body.inertia_kg_m2;
    return (Vector10() << body.mass_kg, h.x(), h.y(), h.z(), I(0, 0), I(1, 1), I(2, 2), I(0, 1), I(0, 2),
            I(1, 2))
        .finished();
}

PlatformFile with_tare(PlatformFile platform, const Vector10& tare) {
    const Vector10 theta = theta_of(platform.platform) + tare;
    if (!(theta[0] > 0.0)) {
        throw InputError(fmt::format(
            "tare: found a mass of {:.6g} kg with the platform's, expected a positive one", theta[0]));
    }
    PlatformBody& body = platform.platform;
    body.mass_kg = theta[0];
    body.com_m = theta.segment<3>(1) / theta[0];
    body.inertia_kg_m2 << theta[4], theta[7], theta[8], //
        theta[7], theta[5], theta[9],                   //
        theta[8], theta[9], theta[6];
    platform.tolerances = of_known_body(platform.tolerances);
    const Matrix3 inertia_com_kg_m2 = mass_properties(body).inertia_com_kg_m2();
    if (const auto fault = find_inertia_fault(inertia_com_kg_m2, InertiaRule::positive)) {
        throw InputError(
            fmt::format("tare: found {} with the platform's, expected all positive, none above the "
                        "sum of the other two",
                        *fault));
    }
    return platform;
}

PlatformFile with_own_load(PlatformFile platform, double load_share) {
    platform.platform.mass_kg *= 1.0 - load_share;
    platform.platform.inertia_kg_m2 *= 1.0 - load_share;
    platform.known_mass_kg.reset();
    platform.tolerances = of_known_body(platform.tolerances);
    platform.tolerances.force_gain_common = 0.0; // sigma of what it weighs later has it
    return platform;
}

} // namespace hexload::platform
