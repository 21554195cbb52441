// What the property tests share: machines, loads, random states, scratch folders.
#pragma once

#include <hexload_sim/dynamics.hpp>
#include "platform_file/platform_file.hpp"
#include <hexload_sim/random.hpp>
#include <hexload_sim/scenario.hpp>

#include <doctest/doctest.h>

#include <filesystem>
#include <string>

namespace hexload::sim::test {

std::filesystem::path scenario_path(const std::string& name);
PlatformFile paper_platform();
PlatformFile small_platform(); // centre of mass off O_A

// The paper's load, and one with nothing on an axis.
Load paper_load();
Load eccentric_load(double mass_kg);

MassProperties loaded(const PlatformFile& platform, const Load& load);

// Random states from a fixed seed, the poses with all legs inside the stroke.
class RandomStates {
  public:
    explicit RandomStates(std::uint64_t seed) : random_(seed, RandomPurpose::trajectory) {}
    double uniform(double min, double max) {
        return random_.uniform(min, max);
    }
    Vector3 vector3(double reach);
    Vector6 vector6(double reach);
    Pose pose(const Geometry& geometry);
    Twist twist(); // to 1 m/s and 1 rad/s in each coordinate

  private:
    RandomStream random_;
};

// The pose a time h later under a constant twist.
Pose moved(const Pose& pose, const Twist& twist, double h_s);

// A folder of its own, removed with its contents at the end.
class ScratchFolder {
  public:
    ScratchFolder();
    ScratchFolder(const ScratchFolder&) = delete;
    ScratchFolder& operator=(const ScratchFolder&) = delete;
    ~ScratchFolder();
    std::filesystem::path path(const std::string& name) const {
        return folder_ / name;
    }
    std::filesystem::path write(const std::string& name, const std::string& text) const;

  private:
    std::filesystem::path folder_;
};

std::string read_text(const std::filesystem::path& path);

} // namespace hexload::sim::test
