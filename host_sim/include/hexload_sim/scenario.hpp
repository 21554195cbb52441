// One experiment: which machine, load, motion, servo and sensors, for how long, with which seed.
#pragma once

#include <hexload_sim/controller.hpp>
#include <hexload_sim/electric.hpp>
#include <hexload_sim/hydraulics.hpp>
#include <hexload_sim/leg_inertia.hpp>
#include <hexload_sim/load.hpp>
#include <hexload_sim/machine.hpp>
#include <hexload_sim/sensors.hpp>
#include <hexload_sim/trajectory.hpp>

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace hexload::sim {

// From at_s on (rounded to a tick) the platform carries this load. Pose and velocity stay continuous.
struct LoadChange {
    double at_s = 0.0;
    Load load;
};

// What seeded motions may use of the machine.
struct LimitSettings {
    double stroke_share = 0.9;             // of each end's stroke
    double valve_share = 0.7;              // of the unloaded speed; the rest is for loads and control
    double pump_flow_m3_s = 150e-3 / 60.0; // six legs together
};

struct Scenario {
    std::string name;
    std::string description;
    std::filesystem::path platform; // absolute or relative to the working directory
    double duration_s = 10.0;
    std::int64_t seed = 1;
    std::int64_t substeps = 4;                   // RK4 steps per millisecond, at least one per tick
    std::vector<LoadChange> loads{LoadChange{}}; // the first at 0 s, times increasing
    TrajectorySettings trajectory;
    LimitSettings limits;
    MachineSettings machine;
    SixLegBars leg_bars;
    HydraulicSettings hydraulics;
    ElectricSettings electric; // where it exists, in place of hydraulics but for its end stops
    ControllerSettings controller;
    bool states_servo = false; // loop gain or pressure feedback are the file's; else suit_default_servo's
    SensorSettings sensors;
};

// Ranges of the fields that the command line may override.
inline constexpr double duration_min_s = default_tick_s;
inline constexpr double duration_max_s = 4e6; // 32-bit tick counter
inline constexpr std::int64_t substeps_max = 1000;

// Reads and checks a scenario file; paths in it are relative to it. Does not read the platform file. Throws
// InputError: file missing, TOML syntax, unknown or missing key, wrong type or length, value out of range, a
// load that cannot exist, load times not increasing, unknown trajectory kind, static friction below
// Coulomb's.
Scenario load_scenario(const std::filesystem::path& path);

// The scenario as a TOML document with every default filled in; load_scenario reads it back.
std::string to_toml(const Scenario& scenario);

// What the legs of a scenario can do.
struct ActuatorLimits {
    double leg_speed_m_s = 0.0; // of one leg, without load
    double leg_force_n = 0.0;   // at standstill
    double speed_sum_m_s = 0.0; // of six legs at the same time
};

ActuatorLimits actuator_limits(const Geometry& geometry, const Scenario& scenario);

// The scenario's share of that.
MotionLimits motion_limits(const Geometry& geometry, const Scenario& scenario);

} // namespace hexload::sim
