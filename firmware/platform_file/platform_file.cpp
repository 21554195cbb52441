#include "platform_file.hpp"

#include "toml_fields.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <tuple>

namespace hexload::platform {
namespace {

constexpr std::array<Choice<EstimatorKind>, 3> estimator_kinds{
    {{"momentum", EstimatorKind::momentum},
     {"momentum_effects", EstimatorKind::momentum_effects},
     {"paper", EstimatorKind::paper}}};
constexpr std::array<Choice<PaperPrior>, 2> paper_priors{
    {{"safe", PaperPrior::safe}, {"printed", PaperPrior::printed}}};

// What machines have: wide enough for any, narrow enough that a number in another unit is refused where it
// stands. Those of sensors and effects are the firmware's (src/configuration/config.c).
constexpr Range coordinate{-20.0, 20.0, "m, from -20 to 20 (not mm)"};
constexpr Range leg_length{1e-3, 20.0, "m, from 0.001 to 20 (not mm)"};
constexpr Range body_mass{1e-3, 1e5, "kg, from 0.001 to 100000"};
constexpr Range inertia_entry{-1e6, 1e6, "kg m^2, from -1e6 to 1e6"};
constexpr Range load_mass{1e-3, 1e6, "kg, from 0.001 to 1e6; of an unknown load no such key"};
constexpr Range gravity{0.0, 30.0, "m/s^2, from 0 to 30, positive although it points down"};
constexpr Range displacement_noise{1e-10, 0.1, "m, from 1e-10 to 0.1"};
constexpr Range velocity_noise{1e-8, 1.0, "m/s, from 1e-8 to 1"};
constexpr Range force_noise{1e-6, 1e5, "N, from 1e-6 to 1e5"};
constexpr Range filter_band{0.1, 1e6, "Hz, from 0.1 to 1e6"};
constexpr Range sampling_period{shortest_tick_s, longest_tick_s, "s, from 0.00025 to 0.005 (not ms)"};
constexpr Range lateness{0.0, 1.0, "s, from 0 to 1"};
constexpr Range start_force{0.0, 1e6, "N, from 0 to 1e6"};
constexpr Range start_viscous{0.0, 1e8, "N s/m, from 0 to 1e8"};
constexpr Range start_tilt{0.0, 1.0, "rad, from 0 to 1 (not degrees)"};
constexpr Range friction_speed{1e-6, 10.0, "m/s, from 1e-6 to 10"};
constexpr Range friction_shape{0.0, 10.0, "of a logarithm, from 0 to 10"};
constexpr Range share{0.0, 1.0, "a share, from 0 to 1 (not %)"};
constexpr Range open_length{0.0, 1.0, "m, from 0 to 1 (not mm)"};
constexpr Range actuator_speed{1e-6, 1e3, "m/s, from 1e-6 to 1000 (not mm/s)"};
constexpr Range actuator_force{1e-3, 1e8, "N, from 0.001 to 1e8"};

void read_home_leg_length(TomlReader& table, Vector6& home_leg_length_m, bool is_one_number) {
    constexpr std::string_view key = "home_leg_length_m";
    table.require(key);
    if (is_one_number) {
        double length_m = 0.0;
        table.number(key, length_m, leg_length);
        home_leg_length_m.setConstant(length_m);
    } else {
        table.numbers(key, {home_leg_length_m.data(), 6}, leg_length);
    }
}

Geometry read_geometry(TomlReader table, bool one_home_leg_length) {
    Geometry geometry;
    table.require("base_hinges_m");
    table.points("base_hinges_m", geometry.base_hinges_m, coordinate);
    table.require("platform_hinges_m");
    table.points("platform_hinges_m", geometry.platform_hinges_m, coordinate);
    read_home_leg_length(table, geometry.home_leg_length_m, one_home_leg_length);
    std::array<double, 2> stroke_m{};
    table.require("stroke_m");
    table.numbers("stroke_m", stroke_m, coordinate);
    table.refuse_unknown_keys();
    if (!(stroke_m[0] < stroke_m[1])) {
        table.fail("stroke_m", fmt::format("[{}, {}]", stroke_m[0], stroke_m[1]),
                   "[min, max] with min < max");
    }
    geometry.stroke_min_m = stroke_m[0];
    geometry.stroke_max_m = stroke_m[1];
    geometry.home_height_m = derive_home_height_m(geometry);
    if (const auto fault = find_geometry_fault(geometry)) {
        table.fail(fault->key, fault->found, fault->expected);
    }
    const double shortest_m = geometry.home_leg_length_m.minCoeff();
    if (!(shortest_m + geometry.stroke_min_m > 0.0)) {
        table.fail("stroke_m",
                   fmt::format("{} m on a leg of {} m at home", geometry.stroke_min_m, shortest_m),
                   "displacements from the home length at which a leg keeps a length");
    }
    return geometry;
}

PlatformBody read_platform_body(TomlReader table) {
    PlatformBody platform;
    table.require("mass_kg");
    table.number("mass_kg", platform.mass_kg, body_mass);
    table.require("com_m");
    table.vector3("com_m", platform.com_m, coordinate);
    table.require("inertia_kg_m2");
    table.tensor("inertia_kg_m2", platform.inertia_kg_m2, inertia_entry);
    table.refuse_unknown_keys();
    // Positive, not just non-negative as for a load: the empty platform must have a mass matrix with an
    // inverse.
    const Matrix3 inertia_com_kg_m2 = mass_properties(platform).inertia_com_kg_m2();
    const auto fault = find_inertia_fault(inertia_com_kg_m2, InertiaRule::positive);
    if (fault) {
        table.fail("inertia_kg_m2", *fault, "all positive, none above the sum of the other two");
    }
    return platform;
}

double read_gravity_m_s2(TomlReader table) {
    double gravity_m_s2 = 0.0;
    table.require("gravity_m_s2");
    table.number("gravity_m_s2", gravity_m_s2, gravity);
    table.refuse_unknown_keys();
    return gravity_m_s2;
}

// Of second order, as Butterworth's: what it does to a signal well below its bandwidth.
double delay_of_low_pass_s(const std::optional<double>& bandwidth_hz) {
    return bandwidth_hz ? std::numbers::sqrt2 / (2.0 * std::numbers::pi * *bandwidth_hz) : 0.0;
}

// Those for `hexload commission` it reads itself; here only that they are what they should be.
Tolerances read_tolerances(TomlReader table) {
    for (const auto& [key, range] : {std::pair{"force_gain", share}, std::pair{"hinge_m", open_length},
                                     std::pair{"friction_growth", share}}) {
        std::optional<double> tolerance;
        table.optional_number(key, tolerance, range);
    }
    Tolerances open;
    table.optional_number("force_offset_n", open.force_offset_n, start_force);
    table.optional_number("tilt_rad", open.tilt_rad, start_tilt);
    table.optional_number("friction_shape", open.friction_shape, friction_shape);
    table.optional_number("force_gain_common", open.force_gain_common, share);
    table.optional_number("platform_mass", open.platform_mass, share);
    table.optional_number("platform_com_m", open.platform_com_m, open_length);
    table.optional_number("platform_inertia", open.platform_inertia, share);
    table.optional_number("timing_s", open.timing_s, lateness);
    table.number("contact_force_n", open.contact_force_n, start_force);
    table.refuse_unknown_keys();
    return open;
}

SensorSigma read_sensor_sigma(TomlReader table) {
    SensorSigma sigma;
    sigma.has_velocity = table.has("velocity_sigma_m_s"); // without its noise a sensor counts for nothing
    table.boolean("velocity", sigma.has_velocity);
    for (const auto& [key, value, range] :
         {std::tuple{"displacement_sigma_m", &sigma.displacement_sigma_m, displacement_noise},
          std::tuple{"velocity_sigma_m_s", &sigma.velocity_sigma_m_s, velocity_noise},
          std::tuple{"force_sigma_n", &sigma.force_sigma_n, force_noise}}) {
        if (sigma.has_velocity || value != &sigma.velocity_sigma_m_s) {
            table.require(key);
        }
        table.number(key, *value, range); // the estimator weighs measurements by them
    }
    table.number("tick_s", sigma.tick_s, sampling_period);
    std::optional<double> force_hz;
    std::optional<double> velocity_hz;
    std::optional<double> force_delay_s;
    table.optional_number("force_bandwidth_hz", force_hz, filter_band);
    table.optional_number("velocity_bandwidth_hz", velocity_hz, filter_band);
    table.optional_number("force_delay_s", force_delay_s, lateness);
    sigma.force_delay_s = force_delay_s.value_or(0.0) + delay_of_low_pass_s(force_hz);
    sigma.velocity_delay_s = delay_of_low_pass_s(velocity_hz);
    table.refuse_unknown_keys();
    return sigma.has_velocity ? sigma : without_velocity(sigma);
}

std::optional<double> read_known_mass_kg(TomlReader table) {
    std::optional<double> known_mass_kg;
    table.optional_number("known_mass_kg", known_mass_kg, load_mass);
    table.refuse_unknown_keys();
    return known_mass_kg;
}

EstimatorSettings read_estimator(TomlReader table) {
    EstimatorSettings settings;
    table.choice("kind", settings.kind, estimator_kinds);
    table.choice("prior", settings.prior, paper_priors);
    table.boolean("from_known_mass", settings.from_known_mass);
    table.optional_number("bias_sigma_n", settings.bias_sigma_n, start_force);
    table.optional_number("coulomb_sigma_n", settings.coulomb_sigma_n, start_force);
    table.optional_number("viscous_sigma_n_s_m", settings.viscous_sigma_n_s_m, start_viscous);
    table.optional_number("tilt_sigma_rad", settings.tilt_sigma_rad, start_tilt);
    table.optional_number("friction_speed_m_s", settings.friction_speed_m_s, friction_speed);
    table.refuse_unknown_keys();
    return settings;
}

ActuatorSettings read_actuators(TomlReader table) {
    ActuatorSettings settings;
    table.optional_number("leg_speed_m_s", settings.leg_speed_m_s, actuator_speed);
    table.optional_number("leg_force_n", settings.leg_force_n, actuator_force);
    table.optional_number("speed_sum_m_s", settings.speed_sum_m_s, actuator_speed);
    table.refuse_unknown_keys();
    return settings;
}

} // namespace

std::string_view name_of(EstimatorKind kind) {
    return name_in(estimator_kinds, kind);
}

std::string_view name_of(PaperPrior prior) {
    return name_in(paper_priors, prior);
}

SensorSigma without_velocity(SensorSigma sensors) {
    // The firmware's line through the displacements of 6 ms on both sides, of 2 to 12 ticks.
    const double half = std::clamp(std::floor(0.006 / sensors.tick_s + 0.5), 2.0, 12.0);
    const double sum_of_squares = half * (half + 1.0) * (2.0 * half + 1.0) / 3.0; // of -half .. half
    sensors.has_velocity = false;
    sensors.velocity_sigma_m_s = sensors.displacement_sigma_m / (sensors.tick_s * std::sqrt(sum_of_squares));
    sensors.velocity_delay_s = 0.0;
    return sensors;
}

Tolerances of_known_body(Tolerances tolerances) {
    tolerances.platform_mass = 0.0;
    tolerances.platform_com_m = 0.0;
    tolerances.platform_inertia = 0.0;
    return tolerances;
}

PlatformFile load_platform_file(const std::filesystem::path& path) {
    const toml::table root = parse_toml_file(path);
    TomlReader reader(path.string(), root);
    for (const char* section : {"geometry", "platform", "environment", "sensors"}) {
        reader.require(section);
    }
    PlatformFile file;
    file.source = path.string();
    file.geometry =
        read_geometry(reader.table("geometry"), root["geometry"]["home_leg_length_m"].is_number());
    file.platform = read_platform_body(reader.table("platform"));
    file.gravity_m_s2 = read_gravity_m_s2(reader.table("environment"));
    file.sensors = read_sensor_sigma(reader.table("sensors"));
    file.known_mass_kg = read_known_mass_kg(reader.table("load"));
    file.estimator = read_estimator(reader.table("estimator"));
    file.actuators = read_actuators(reader.table("actuators"));
    file.tolerances = read_tolerances(reader.table("tolerances"));
    reader.refuse_unknown_keys();
    return file;
}

} // namespace hexload::platform
