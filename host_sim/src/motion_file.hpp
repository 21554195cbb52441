// Reads a trajectory CSV.
#pragma once

#include <hexload_sim/types.hpp>

#include <filesystem>
#include <vector>

namespace hexload::sim {

struct MotionFileRow {
    double t_s;
    Vector6 q; // [x, y, z, roll, pitch, yaw]
};

// At least two rows, time strictly increasing. Throws InputError naming file and line.
std::vector<MotionFileRow> read_motion_file(const std::filesystem::path& path);

} // namespace hexload::sim
