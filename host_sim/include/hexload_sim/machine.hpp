// The machine that stands there, as it differs from its platform file: base off level, hinges not where the
// drawing has them, a platform heavier or lighter than weighed. Estimator and servo know the platform file.
#pragma once

#include "platform_file/platform_file.hpp"

#include <hexload_sim/gravity.hpp>

#include <array>
#include <cstdint>

namespace hexload::sim {

// As the platform file says, by default.
struct MachineSettings {
    std::array<double, 2> tilt_rad{};                 // of the base, about its x and its y axis; see Gravity
    std::array<Vector3, 6> base_hinge_errors_m{};     // true less nominal
    std::array<Vector3, 6> platform_hinge_errors_m{}; // true less nominal
    double hinge_error_sigma_m = 0.0;  // random errors besides, of every coordinate of the 12 hinges
    std::int64_t hinge_error_seed = 1; // of the machine, whatever the seed of the run
    double platform_scale = 1.0;       // true mass and inertia over the platform file's

    MachineSettings();
    bool has_hinge_errors() const;
};

struct Machine {
    Geometry geometry; // origin and leg displacement zero as in the platform file
    PlatformBody platform;
    Gravity gravity;
};

// Throws InputError for hinge errors with which the machine cannot work.
Machine true_machine(const PlatformFile& platform, const MachineSettings& settings);

} // namespace hexload::sim
