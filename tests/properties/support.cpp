#include "support.hpp"

#include <hexload_sim/rotation.hpp>

#include <fstream>
#include <sstream>
#include <stdexcept>

#include <stdlib.h>

namespace hexload::sim::test {

std::filesystem::path scenario_path(const std::string& name) {
    return std::filesystem::path(HEXLOAD_SCENARIO_DIR) / (name + ".toml");
}

PlatformFile paper_platform() {
    return load_platform_file(scenario_path("platforms/paper"));
}

PlatformFile small_platform() {
    return load_platform_file(scenario_path("platforms/small_platform"));
}

Load paper_load() {
    return {500.0, {0.0, 0.0, 0.3}, 25.0 * Matrix3::Identity()};
}

Load eccentric_load(double mass_kg) {
    const Matrix3 unit_inertia =
        (Matrix3() << 0.050, 0.002, -0.004, 0.002, 0.060, 0.001, -0.004, 0.001, 0.040).finished();
    return {mass_kg, {0.06, -0.04, 0.3}, mass_kg * unit_inertia};
}

MassProperties loaded(const PlatformFile& platform, const Load& load) {
    return mass_properties(platform.platform) + mass_properties(load);
}

Vector3 RandomStates::vector3(double reach) {
    return {uniform(-reach, reach), uniform(-reach, reach), uniform(-reach, reach)};
}

Vector6 RandomStates::vector6(double reach) {
    return (Vector6() << vector3(reach), vector3(reach)).finished();
}

Pose RandomStates::pose(const Geometry& geometry) {
    const double reach_m = 0.5 * geometry.stroke_max_m;
    for (;;) {
        const Pose pose{vector3(reach_m), rotation_from_rpy(vector3(0.25))};
        const Vector6 displacement_m = leg_displacement(geometry, pose);
        if (displacement_m.minCoeff() > geometry.stroke_min_m &&
            displacement_m.maxCoeff() < geometry.stroke_max_m) {
            return pose;
        }
    }
}

Twist RandomStates::twist() {
    return {vector3(1.0), vector3(1.0)};
}

Pose moved(const Pose& pose, const Twist& twist, double h_s) {
    return {pose.p_m + h_s * twist.v_m_s, rotation_from_vector(h_s * twist.w_rad_s) * pose.R};
}

ScratchFolder::ScratchFolder() {
    std::string name = (std::filesystem::temp_directory_path() / "hexload-XXXXXX").string();
    if (mkdtemp(name.data()) == nullptr) {
        throw std::runtime_error("no scratch folder");
    }
    folder_ = name;
}

ScratchFolder::~ScratchFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
}

std::filesystem::path ScratchFolder::write(const std::string& name, const std::string& text) const {
    std::ofstream(path(name), std::ios::binary) << text;
    return path(name);
}

std::string read_text(const std::filesystem::path& path) {
    std::ostringstream text;
    text << std::ifstream(path, std::ios::binary).rdbuf();
    return text.str();
}

} // namespace hexload::sim::test
