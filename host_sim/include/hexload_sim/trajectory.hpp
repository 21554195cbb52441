// Reference motions of the platform (the signal generator of the paper's Figure 4).
#pragma once

#include "platform_file/geometry.hpp"

#include <hexload_sim/types.hpp>

#include <cstdint>
#include <filesystem>
#include <memory>
#include <variant>

namespace hexload::sim {

// Platform coordinates q = [x, y, z, roll, pitch, yaw] in m and rad, and their time derivatives.
struct Motion {
    Vector6 q = Vector6::Zero();
    Vector6 rate = Vector6::Zero();
    Vector6 acceleration = Vector6::Zero();

    Pose pose() const;
    Twist twist() const;
};

class Trajectory {
  public:
    Trajectory() = default;
    Trajectory(const Trajectory&) = delete;
    Trajectory& operator=(const Trajectory&) = delete;
    virtual ~Trajectory() = default;

    virtual Motion at(double t_s) const = 0; // t_s >= 0
};

// (23): x = y = 0.2 sin(pi t) m, yaw = 0.2 deg sin(pi t). Starts with a velocity step unless run_in_s > 0,
// over which the amplitude then grows from zero with continuous acceleration.
struct PaperMotion {
    double amplitude_x_m = 0.2;
    double amplitude_y_m = 0.2;
    double amplitude_yaw_deg = 0.2; // the paper leaves the unit out; its text says below 1 degree
    double frequency_hz = 0.5;
    double run_in_s = 0.0;
};

// Sums of sines on all six coordinates, amplitude falling with frequency, phases from the seed. Starts at
// rest at home. All amplitudes are scaled down together until MotionLimits holds.
struct MultisineMotion {
    double translation_m = 0.25; // largest sum of amplitudes of x, y and z
    double rotation_deg = 20.0;  // the same of roll, pitch and yaw
    double frequency_min_hz = 0.2;
    double frequency_max_hz = 2.5; // near the servo's bandwidth
    std::int64_t sines = 8;
    double run_in_s = 0.5;
};

// Moves between random poses, quintic in time (zero velocity and acceleration at both ends), each followed by
// a dwell. Targets whose move would break MotionLimits are drawn again.
struct WorkMotion {
    double reach_m = 0.12;
    double rotation_deg = 10.0;
    double move_s = 2.5;
    double dwell_s = 0.5;
};

// CSV with the header t,x,y,z,roll,pitch,yaw (s, m, rad), cubic between its rows, standing still outside
// them.
struct FileMotion {
    std::filesystem::path path;
};

struct StandstillMotion {
    Vector6 pose = Vector6::Zero(); // [x, y, z, roll, pitch, yaw]
};

using TrajectorySettings =
    std::variant<PaperMotion, MultisineMotion, WorkMotion, FileMotion, StandstillMotion>;

// What machine and supply allow; seeded motions are made to stay inside.
struct MotionLimits {
    double stroke_min_m = 0.0;
    double stroke_max_m = 0.0;
    double leg_speed_m_s = 0.0; // per leg: what the valve passes
    double speed_sum_m_s = 0.0; // over six legs: pump flow / piston area
};

// Whether a motion keeps the limits at every tick from 0 to duration_s, by inverse kinematics.
bool keeps_limits(const Trajectory& trajectory, const Geometry& geometry, const MotionLimits& limits,
                  double duration_s);

// Throws InputError: a bad trajectory file, or no seeded motion found inside the limits.
std::unique_ptr<Trajectory> make_trajectory(const TrajectorySettings& settings, const Geometry& geometry,
                                            const MotionLimits& limits, double duration_s,
                                            std::uint64_t seed);

} // namespace hexload::sim
