#include "rig_file.hpp"

#include "toml_fields.hpp"

#include <fmt/format.h>

#include <cmath>
#include <span>

namespace hexload::platform {
namespace {

void read_legs(TomlReader& table, std::string_view key, Vector6& legs, const Range& rule) {
    table.require(key);
    table.numbers(key, {legs.data(), 6}, rule);
}

void read_number(TomlReader& table, std::string_view key, double& value, const Range& rule) {
    table.require(key);
    table.number(key, value, rule);
}

Geometry read_hinges(TomlReader& table, Geometry geometry) {
    table.require("base_hinges_m");
    table.points("base_hinges_m", geometry.base_hinges_m);
    table.require("platform_hinges_m");
    table.points("platform_hinges_m", geometry.platform_hinges_m);
    geometry.home_height_m = derive_home_height_m(geometry);
    if (const auto fault = find_geometry_fault(geometry)) {
        table.fail(fault->key, fault->found, fault->expected);
    }
    return geometry;
}

PlatformBody read_body(TomlReader& table) {
    PlatformBody body;
    read_number(table, "mass_kg", body.mass_kg, positive);
    table.require("com_m");
    table.vector3("com_m", body.com_m);
    table.require("inertia_kg_m2");
    table.tensor("inertia_kg_m2", body.inertia_kg_m2);
    const auto fault = find_inertia_fault(mass_properties(body).inertia_com_kg_m2(), InertiaRule::positive);
    if (fault) {
        table.fail("inertia_kg_m2", *fault, "all positive, none above the sum of the other two");
    }
    return body;
}

RigSettings read_settings(TomlReader& table) {
    RigSettings rig;
    read_legs(table, "force_offset_n", rig.force_offset_n, any_number);
    read_legs(table, "force_gain", rig.force_gain, any_number);
    read_legs(table, "coulomb_n", rig.coulomb_n, non_negative);
    read_legs(table, "stribeck_n", rig.stribeck_n, any_number);
    table.numbers("growth_n_n", {rig.growth_n_n.data(), 6}, non_negative); // none in the first rig files
    read_legs(table, "viscous_n_s_m", rig.viscous_n_s_m, non_negative);
    read_number(table, "stribeck_speed_m_s", rig.stribeck_speed_m_s, positive);
    read_number(table, "reversal_speed_m_s", rig.reversal_speed_m_s, positive);
    read_number(table, "presliding_m", rig.presliding_m, non_negative);
    read_number(table, "leg_inertia_kg_m2", rig.leg_inertia_kg_m2, any_number);
    read_number(table, "leg_slide_kg_m", rig.leg_slide_kg_m, any_number);
    read_number(table, "leg_tilt_kg_m", rig.leg_tilt_kg_m, any_number);
    table.require("gravity_m_s2");
    table.vector3("gravity_m_s2", rig.gravity_m_s2);
    if (!(rig.gravity_m_s2.z() < 0.0)) {
        table.fail("gravity_m_s2", fmt::format("z = {}", rig.gravity_m_s2.z()), "a vector that points down");
    }
    return rig;
}

RigDirection read_direction(TomlReader table) {
    RigDirection direction;
    read_legs(table, "force_offset_n", direction.force_offset_n, any_number);
    read_legs(table, "force_gain", direction.force_gain, any_number);
    read_legs(table, "coulomb_n", direction.coulomb_n, any_number);
    table.numbers("stribeck_n",
                  {direction.stribeck_n.data(), 6}); // this and the next: none in the first rig files
    table.numbers("growth_n_n", {direction.growth_n_n.data(), 6});
    read_legs(table, "viscous_n_s_m", direction.viscous_n_s_m, any_number);
    table.require("gravity_m_s2");
    table.numbers("gravity_m_s2", direction.gravity_m_s2);
    table.require("platform");
    table.numbers("platform", {direction.platform.data(), 10});
    table.require("base_hinges_m");
    table.points("base_hinges_m", direction.base_hinges_m);
    table.require("platform_hinges_m");
    table.points("platform_hinges_m", direction.platform_hinges_m);
    table.refuse_unknown_keys();
    return direction;
}

// Root mean square of a group's sigmas, the first `count` of `size`; nothing: the file does not say.
std::optional<double> read_sigma(TomlReader& table, std::string_view key, std::size_t size,
                                 std::size_t count) {
    std::array<double, 6> sigmas{};
    sigmas.fill(-1.0);
    table.numbers(key, std::span(sigmas).first(size), non_negative);
    if (sigmas[0] < 0.0) {
        return std::nullopt;
    }
    double sum = 0.0;
    for (std::size_t k = 0; k < count; k++) {
        sum += sigmas[k] * sigmas[k];
    }
    return std::sqrt(sum / static_cast<double>(count));
}

RigSigma read_sigmas(TomlReader table) {
    return {.force_offset_n = read_sigma(table, "force_offset_n", 6, 6),
            .coulomb_n = read_sigma(table, "coulomb_n", 6, 6),
            .viscous_n_s_m = read_sigma(table, "viscous_n_s_m", 6, 6),
            .gravity_m_s2 = read_sigma(table, "gravity_m_s2", 3, 2)};
}

// As in a file that was written and read again.
void require_same(const TomlReader& table, std::string_view key, std::span<const double> found,
                  std::span<const double> expected) {
    for (std::size_t k = 0; k < found.size(); k++) {
        if (!(std::abs(found[k] - expected[k]) <= 1e-12 + 1e-9 * std::abs(expected[k]))) {
            table.fail(
                key, fmt::format("{}", found[k]),
                fmt::format("{} as in the platform file: this is another machine's rig file", expected[k]));
        }
    }
}

std::span<const double> numbers_of(const std::array<Vector3, 6>& points) {
    return {points[0].data(), 18};
}

// The numbers of the platform file that the rig file was made with are this platform file's.
void check_machine(TomlReader& reader, const PlatformFile& platform) {
    TomlReader geometry = reader.table("geometry");
    for (const auto& [key, expected] :
         {std::pair{"base_hinges_m", &platform.geometry.base_hinges_m},
          std::pair{"platform_hinges_m", &platform.geometry.platform_hinges_m}}) {
        std::array<Vector3, 6> points;
        geometry.require(key);
        geometry.points(key, points);
        require_same(geometry, key, numbers_of(points), numbers_of(*expected));
    }
    Vector6 lengths_m;
    read_legs(geometry, "home_leg_length_m", lengths_m, positive);
    require_same(geometry, "home_leg_length_m", {lengths_m.data(), 6},
                 {platform.geometry.home_leg_length_m.data(), 6});
    TomlReader body = reader.table("platform");
    PlatformBody found;
    read_number(body, "mass_kg", found.mass_kg, positive);
    require_same(body, "mass_kg", {&found.mass_kg, 1}, {&platform.platform.mass_kg, 1});
    body.require("com_m");
    body.vector3("com_m", found.com_m);
    require_same(body, "com_m", {found.com_m.data(), 3}, {platform.platform.com_m.data(), 3});
    body.require("inertia_kg_m2");
    body.tensor("inertia_kg_m2", found.inertia_kg_m2);
    require_same(body, "inertia_kg_m2", {found.inertia_kg_m2.data(), 9},
                 {platform.platform.inertia_kg_m2.data(), 9});
    TomlReader environment = reader.table("environment");
    double gravity_m_s2 = 0.0;
    read_number(environment, "gravity_m_s2", gravity_m_s2, non_negative);
    require_same(environment, "gravity_m_s2", {&gravity_m_s2, 1}, {&platform.gravity_m_s2, 1});
}

bool is_near(const PlatformBody& a, const PlatformBody& b) {
    return std::abs(a.mass_kg - b.mass_kg) <= 1e-9 * b.mass_kg && a.com_m.isApprox(b.com_m, 1e-9) &&
           a.inertia_kg_m2.isApprox(b.inertia_kg_m2, 1e-9);
}

// What has been found is open by as much as its directions say, and no more by what was declared.
void replace_tolerances(const PlatformBody& declared, PlatformFile& platform) {
    platform.rig->declared = platform.tolerances;
    if (!platform.rig->directions.empty()) {
        platform.tolerances.force_gain_common = 0.0;
    }
    if (!is_near(platform.platform, declared)) {
        platform.tolerances = of_known_body(platform.tolerances);
    }
}

} // namespace

PlatformFile with_rig_file(PlatformFile platform, const std::filesystem::path& path) {
    const toml::table root = parse_toml_file(path);
    TomlReader reader(path.string(), root);
    reader.require("rig");
    check_machine(reader, platform);
    TomlReader table = reader.table("rig");
    platform.geometry = read_hinges(table, platform.geometry);
    const PlatformBody declared = platform.platform;
    platform.platform = read_body(table);
    platform.rig = read_settings(table);
    platform.rig->sigma = read_sigmas(reader.table("sigma"));
    for (TomlReader& direction : reader.tables("direction")) {
        platform.rig->directions.push_back(read_direction(direction));
    }
    if (platform.rig->directions.size() > 8) {
        reader.fail("direction", fmt::format("{} of them", platform.rig->directions.size()), "8 at most");
    }
    replace_tolerances(declared, platform);
    platform.gravity_m_s2 = platform.rig->gravity_m_s2.norm();
    read_number(table, "force_delay_s", platform.sensors.force_delay_s, non_negative);
    read_number(table, "velocity_delay_s", platform.sensors.velocity_delay_s, non_negative);
    table.refuse_unknown_keys();
    return platform;
}

} // namespace hexload::platform
