// The platform file: everything about the machine that estimator and simulator must agree on.
#pragma once

#include "geometry.hpp"
#include "mass_properties.hpp"

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace hexload::platform {

// Standard deviations of white sensor noise per leg and sample.
struct SensorSigma {
    double displacement_sigma_m = 0.0;
    double velocity_sigma_m_s = 0.0;
    double force_sigma_n = 0.0;
    // How late a channel is after the displacements, its low-pass filter included.
    double force_delay_s = 0.0;
    double velocity_delay_s = 0.0;
    bool has_velocity = true;       // false: see without_velocity()
    double tick_s = default_tick_s; // between samples; all that goes by ticks has it from here
};

// The same without velocity sensors: the sigma is that of the speeds which the firmware finds at tick_s.
SensorSigma without_velocity(SensorSigma sensors);

enum class EstimatorKind {
    momentum,         // all ten parameters, any motion
    momentum_effects, // and the force sensors' biases and the legs' friction
    paper,            // the paper's filter: dz, Ixx, Iyy, Izz at known mass
};

enum class PaperPrior {
    safe,    // diag(1e-4 x3, 0.1, 500 x3)
    printed, // the paper's diag(1, 1, 1, 1, 10, 500, 500)
};

// As in the platform file.
std::string_view name_of(EstimatorKind kind);
std::string_view name_of(PaperPrior prior);

struct EstimatorSettings {
    EstimatorKind kind = EstimatorKind::momentum;
    PaperPrior prior = PaperPrior::safe;
    bool from_known_mass = false; // momentum kinds start from load.known_mass_kg, else from nothing
    // What is known beforehand of the machine's effects, per leg, beside what the rig file takes off;
    // nothing: what commissioning leaves, else the tolerance, else the firmware's default. Sigma 0: no
    // unknown.
    std::optional<double> bias_sigma_n;
    std::optional<double> coulomb_sigma_n;
    std::optional<double> viscous_sigma_n_s_m;
    std::optional<double> tilt_sigma_rad;
    std::optional<double> friction_speed_m_s;
};

// Section [tolerances], as far as the controller has them; nothing: the firmware's default. The rest is for
// `hexload commission` alone.
struct Tolerances {
    std::optional<double> force_offset_n;
    std::optional<double> tilt_rad;
    std::optional<double> friction_shape;
    std::optional<double> force_gain_common;
    std::optional<double> platform_mass;
    std::optional<double> platform_com_m;
    std::optional<double> platform_inertia;
    std::optional<double> timing_s;
    double contact_force_n = 0.0; // a steady one on the platform, in whichever direction
};

// Of a platform whose body has been found on the machine itself.
Tolerances of_known_body(Tolerances tolerances);

// What the actuators can do, section [actuators]; nothing: not stated. Motions are designed by it, and
// samples beyond twice of it are refused.
struct ActuatorSettings {
    std::optional<double> leg_speed_m_s; // of one leg, without load
    std::optional<double> leg_force_n;   // at standstill
    std::optional<double> speed_sum_m_s; // of six legs at the same time: what the supply feeds
};

// What commissioning has found beyond geometry and body; as in firmware's hexload_rig_config_t.
struct RigDirection {
    Vector6 force_offset_n = Vector6::Zero();
    Vector6 force_gain = Vector6::Zero();
    Vector6 coulomb_n = Vector6::Zero();
    Vector6 stribeck_n = Vector6::Zero();
    Vector6 growth_n_n = Vector6::Zero();
    Vector6 viscous_n_s_m = Vector6::Zero();
    std::array<double, 2> gravity_m_s2{};
    Eigen::Matrix<double, 10, 1> platform = Eigen::Matrix<double, 10, 1>::Zero(); // order of theta
    std::array<Vector3, 6> base_hinges_m{};
    std::array<Vector3, 6> platform_hinges_m{};
};

// One standard deviation of what commissioning leaves of a group, the root mean square over the legs.
struct RigSigma {
    std::optional<double> force_offset_n;
    std::optional<double> coulomb_n;
    std::optional<double> viscous_n_s_m;
    std::optional<double> gravity_m_s2; // of its x and y
};

struct RigSettings {
    Vector6 force_offset_n = Vector6::Zero();
    Vector6 force_gain = Vector6::Zero();
    Vector6 coulomb_n = Vector6::Zero();
    Vector6 stribeck_n = Vector6::Zero();
    Vector6 growth_n_n = Vector6::Zero();
    Vector6 viscous_n_s_m = Vector6::Zero();
    double stribeck_speed_m_s = 0.01;
    double reversal_speed_m_s = 0.001;
    double presliding_m = 0.0;
    double leg_inertia_kg_m2 = 0.0;
    double leg_slide_kg_m = 0.0;
    double leg_tilt_kg_m = 0.0;
    Vector3 gravity_m_s2 = Vector3(0.0, 0.0, -9.81); // base axes
    std::vector<RigDirection> directions;            // of what is still open, one standard deviation each
    RigSigma sigma;
    Tolerances declared; // those of the platform file, which commissioning has replaced
};

struct PlatformFile {
    std::string source; // names the file in messages
    Geometry geometry;
    PlatformBody platform;
    double gravity_m_s2 = 9.81;
    SensorSigma sensors;
    std::optional<double> known_mass_kg; // of the load
    EstimatorSettings estimator;
    ActuatorSettings actuators;
    Tolerances tolerances;
    std::optional<RigSettings> rig; // of a rig file, whose hinges and body then stand above
};

// Reads and checks a platform file. Throws InputError: file missing, TOML syntax, unknown or missing key,
// wrong type or length, value out of range, a body or a machine that cannot exist.
PlatformFile load_platform_file(const std::filesystem::path& path);

} // namespace hexload::platform
