#include "bindings.hpp"

#include <hexload_sim/dynamics.hpp>
#include "platform_file/input_error.hpp"
#include <hexload_sim/kinematics.hpp>
#include "platform_file/platform_file.hpp"
#include "platform_file/rig_file.hpp"
#include <hexload_sim/rotation.hpp>
#include <hexload_sim/scaled_machine.hpp>
#include <hexload_sim/scenario.hpp>
#include <hexload_sim/simulator.hpp>
#include "platform_file/tare.hpp"

#include <nanobind/eigen/dense.h>
#include <nanobind/stl/array.h>
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <cmath>
#include <memory>

namespace nb = nanobind;
using namespace hexload::sim;

namespace {

Twist twist_of(const Vector6& V) {
    return {V.head<3>(), V.tail<3>()};
}

MassProperties body_of(const PlatformFile& platform, const Load& load) {
    return mass_properties(platform.platform) + mass_properties(load);
}

// A scenario's motion, or that of a trajectory file in its place.
struct Excitation {
    std::unique_ptr<Trajectory> trajectory;
    MotionLimits limits;
};

// The scenario's machine bounds it, whatever scenario the motion is of.
Excitation excitation(const Scenario& scenario, const PlatformFile& platform, double duration_s,
                      const Scenario& motion_of, const std::optional<std::filesystem::path>& file) {
    const MotionLimits limits = motion_limits(platform.geometry, scenario);
    const TrajectorySettings settings = file ? TrajectorySettings(FileMotion{*file}) : motion_of.trajectory;
    return {make_trajectory(settings, platform.geometry, limits, duration_s,
                            static_cast<std::uint64_t>(motion_of.seed)),
            limits};
}

// One row per millisecond: q, then the twist.
Eigen::Matrix<double, -1, 12, Eigen::RowMajor> reference_motion(const Trajectory& trajectory,
                                                                double duration_s) {
    const auto ticks = static_cast<Eigen::Index>(std::llround(duration_s / default_tick_s)) + 1;
    Eigen::Matrix<double, -1, 12, Eigen::RowMajor> rows(ticks, 12);
    for (Eigen::Index tick = 0; tick < ticks; ++tick) {
        const Motion motion = trajectory.at(static_cast<double>(tick) * default_tick_s);
        rows.row(tick) << motion.q.transpose(), motion.twist().stacked().transpose();
    }
    return rows;
}

using SimulatedRows = Eigen::Matrix<double, -1, 30, Eigen::RowMajor>;

// The scenario's machine on a trajectory file with one load, without an estimator.
SimulatedRows simulated(Scenario scenario, PlatformFile platform, const std::filesystem::path& file,
                        const Load& load, double duration_s) {
    scenario.trajectory = FileMotion{file};
    scenario.loads = {LoadChange{0.0, load}};
    scenario.duration_s = duration_s;
    platform.sensors.tick_s = default_tick_s; // it is the motion that is tried, with a servo of that rate
    Simulator simulator(platform, scenario);
    SimulatedRows rows(simulator.ticks(), 30);
    run(simulator, nullptr, [&rows](const Tick& tick, const auto&) {
        rows.row(tick.index) << tick.pose.p_m.transpose(), rpy_from_rotation(tick.pose.R).transpose(),
            tick.reference.q.transpose(), tick.legs.displacement_m.matrix().transpose(),
            tick.legs.velocity_m_s.matrix().transpose(), tick.legs.force_n.matrix().transpose();
    });
    return rows;
}

void bind_load(nb::module_& module) {
    nb::class_<Load>(module, "Load", "A load; mass_kg = 0: none.")
        .def(
            "__init__",
            [](Load* self, double mass_kg, const Vector3& com_m, const Matrix3& inertia_com_kg_m2) {
                new (self) Load{mass_kg, com_m, inertia_com_kg_m2};
            },
            nb::arg("mass_kg"), nb::arg("com_m"), nb::arg("inertia_com_kg_m2"))
        .def_rw("mass_kg", &Load::mass_kg)
        .def_rw("com_m", &Load::com_m)
        .def_rw("inertia_com_kg_m2", &Load::inertia_com_kg_m2,
                "(3, 3) tensor about the load's centre of mass")
        .def_prop_ro("theta", &Load::theta, "[m, hx, hy, hz, Ixx, Iyy, Izz, Ixy, Ixz, Iyz] about O_A");
}

void bind_platform(nb::module_& module) {
    using Hinges = Eigen::Matrix<double, 6, 3>;
    const auto rows = [](const std::array<Vector3, 6>& points) {
        Hinges matrix;
        for (int leg = 0; leg < 6; ++leg) {
            matrix.row(leg) = points[static_cast<std::size_t>(leg)].transpose();
        }
        return matrix;
    };
    nb::class_<PlatformFile>(module, "Platform", "A platform file.")
        .def_prop_ro("base_hinges_m",
                     [rows](const PlatformFile& p) { return rows(p.geometry.base_hinges_m); })
        .def_prop_ro("platform_hinges_m",
                     [rows](const PlatformFile& p) { return rows(p.geometry.platform_hinges_m); })
        .def_prop_ro("home_leg_length_m", [](const PlatformFile& p) { return p.geometry.home_leg_length_m; })
        .def_prop_ro("home_height_m", [](const PlatformFile& p) { return p.geometry.home_height_m; })
        .def_prop_ro("stroke_m",
                     [](const PlatformFile& p) {
                         return std::array<double, 2>{p.geometry.stroke_min_m, p.geometry.stroke_max_m};
                     })
        .def_prop_ro(
            "tick_s", [](const PlatformFile& p) { return p.sensors.tick_s; }, "between samples")
        .def_rw("source", &PlatformFile::source, "names the file in messages")
        .def_prop_ro("mass_kg", [](const PlatformFile& p) { return p.platform.mass_kg; })
        .def_prop_ro("com_m", [](const PlatformFile& p) { return p.platform.com_m; })
        .def_prop_ro(
            "inertia_kg_m2", [](const PlatformFile& p) { return p.platform.inertia_kg_m2; },
            "(3, 3) tensor about O_A")
        .def_prop_ro(
            "theta", [](const PlatformFile& p) { return theta_of(p.platform); },
            "(10,) of the empty platform, about O_A")
        .def_ro("gravity_m_s2", &PlatformFile::gravity_m_s2)
        .def_ro("known_mass_kg", &PlatformFile::known_mass_kg)
        .def_prop_ro("estimator_kind",
                     [](const PlatformFile& p) { return std::string(name_of(p.estimator.kind)); })
        .def_prop_ro(
            "actuators",
            [](const PlatformFile& p) {
                return std::array{p.actuators.leg_speed_m_s, p.actuators.leg_force_n,
                                  p.actuators.speed_sum_m_s};
            },
            "[leg_speed_m_s, leg_force_n, speed_sum_m_s]; None: not stated")
        .def_prop_ro("displacement_sigma_m",
                     [](const PlatformFile& p) { return p.sensors.displacement_sigma_m; })
        .def_prop_ro("has_velocity", [](const PlatformFile& p) { return p.sensors.has_velocity; })
        .def_prop_ro("velocity_sigma_m_s", [](const PlatformFile& p) { return p.sensors.velocity_sigma_m_s; })
        .def_prop_ro("force_sigma_n", [](const PlatformFile& p) { return p.sensors.force_sigma_n; })
        .def_prop_ro(
            "force_delay_s", [](const PlatformFile& p) { return p.sensors.force_delay_s; },
            "how late forces are after displacements, low-pass filter included")
        .def_prop_ro("velocity_delay_s", [](const PlatformFile& p) { return p.sensors.velocity_delay_s; });
    nb::class_<Tare>(module, "Tare", "Empty platform less platform file.")
        .def(
            "__init__",
            [](Tare* self, const Vector10& theta, const Vector10& sigma) {
                new (self) Tare{theta, sigma};
            },
            nb::arg("theta"), nb::arg("sigma"))
        .def_ro("theta", &Tare::theta)
        .def_ro("sigma", &Tare::sigma);
    module.def("with_own_load", &with_own_load, nb::arg("platform"), nb::arg("share"),
               "The platform file in which this share of the empty platform counts as an unknown load.");
    module.def("load_platform", &load_platform_file, nb::arg("path"), "Reads and checks a platform file.");
    module.def("with_rig", &with_rig_file, nb::arg("platform"), nb::arg("path"),
               "The platform as a rig file of hexload commission says that it is. Raises ValueError.");
}

void bind_scenario(nb::module_& module) {
    nb::class_<LoadChange>(module, "LoadChange")
        .def_ro("at_s", &LoadChange::at_s)
        .def_ro("load", &LoadChange::load);
    nb::class_<Scenario>(module, "Scenario", "A scenario file.")
        .def_ro("name", &Scenario::name)
        .def_ro("description", &Scenario::description)
        .def_ro("platform", &Scenario::platform, "path of the platform file")
        .def_ro("duration_s", &Scenario::duration_s)
        .def_ro("seed", &Scenario::seed)
        .def_ro("substeps", &Scenario::substeps)
        .def_ro("loads", &Scenario::loads)
        .def(
            "motion_limits",
            [](const Scenario& scenario, const PlatformFile& platform) {
                const MotionLimits limits = motion_limits(platform.geometry, scenario);
                // Orifices pass valve_share of the unloaded speed up to the load 1 - valve_share^2 of stall;
                // a motor at its voltage limit gives no more.
                const double stall_n = actuator_limits(platform.geometry, scenario).leg_force_n;
                const double share = scenario.limits.valve_share;
                return std::array<double, 5>{limits.stroke_min_m, limits.stroke_max_m, limits.leg_speed_m_s,
                                             limits.speed_sum_m_s, (1.0 - share * share) * stall_n};
            },
            nb::arg("platform"),
            "[stroke min, max in m, speed of a leg, sum of six legs' speeds in m/s, force of a leg in N]")
        .def(
            "machine_limits",
            [](const Scenario& scenario, const PlatformFile& platform) {
                const ActuatorLimits limits = actuator_limits(platform.geometry, scenario);
                return std::array<double, 3>{limits.leg_speed_m_s, limits.speed_sum_m_s, limits.leg_force_n};
            },
            nb::arg("platform"),
            "what motion_limits() keeps a margin to: [speed of a leg, sum of six in m/s, stall force in N]")
        .def(
            "reference_motion",
            [](const Scenario& scenario, const PlatformFile& platform, double duration_s,
               const std::optional<std::filesystem::path>& file, const std::optional<Scenario>& motion_of) {
                const Excitation found =
                    excitation(scenario, platform, duration_s, motion_of.value_or(scenario), file);
                return std::pair{
                    reference_motion(*found.trajectory, duration_s),
                    keeps_limits(*found.trajectory, platform.geometry, found.limits, duration_s)};
            },
            nb::arg("platform"), nb::arg("duration_s"), nb::arg("file").none() = nb::none(),
            nb::arg("motion_of").none() = nb::none(),
            "(n, 12) [x, y, z, roll, pitch, yaw, v, w] at each tick, and whether the motion keeps this "
            "scenario's limits: the\nmotion of this scenario, of a trajectory file, or of another scenario.")
        .def("simulated", &simulated, nb::arg("platform"), nb::arg("file"), nb::arg("load"),
             nb::arg("duration_s"),
             "(n, 30) at each tick of this scenario's machine on a trajectory file, with one load: [x, y, z, "
             "roll, pitch, yaw], the same\nof the reference, displacement, speed and force of each leg.")
        .def_prop_ro(
            "full_valve_error_m", [](const Scenario& s) { return 1.0 / s.controller.proportional_1_m; },
            "the error of a leg at which its valve is fully open: beyond it the leg does not follow")
        .def("to_toml", &to_toml, "the scenario with every default filled in");
    module.def(
        "scaled_machine",
        [](const PlatformFile& platform, const std::array<double, 3>& actuators, double heaviest_load_kg) {
            const ActuatorLimits limits{actuators[0], actuators[1], actuators[2]};
            return scaled_machine(platform, limits, heaviest_load_kg);
        },
        nb::arg("platform"), nb::arg("actuators"), nb::arg("heaviest_load_kg"),
        "A scenario with hydraulic legs and a servo that suit actuators [leg_speed_m_s, leg_force_n, "
        "speed_sum_m_s].");
    module.def("load_scenario", &load_scenario, nb::arg("path"), "Reads and checks a scenario file.");
}

void bind_kinematics(nb::module_& module) {
    module.def(
        "leg_displacement",
        [](const PlatformFile& platform, const Vector3& p, const Matrix3& R) {
            return leg_displacement(platform.geometry, {p, R});
        },
        nb::arg("platform"), nb::arg("p"), nb::arg("R"), "(1): (6,) in m");
    module.def(
        "leg_velocity",
        [](const PlatformFile& platform, const Vector3& p, const Matrix3& R, const Vector6& V) {
            return leg_velocity(platform.geometry, {p, R}, twist_of(V));
        },
        nb::arg("platform"), nb::arg("p"), nb::arg("R"), nb::arg("V"), "(3): (6,) in m/s");
    module.def(
        "jacobian",
        [](const PlatformFile& platform, const Vector3& p, const Matrix3& R) {
            return jacobian(platform.geometry, Pose{p, R});
        },
        nb::arg("platform"), nb::arg("p"), nb::arg("R"), "(3): (6, 6), leg velocity = J [v; omega]");
    module.def(
        "forward_kinematics",
        [](const PlatformFile& platform, const Vector6& dl) {
            const std::optional<Pose> pose = forward_kinematics(platform.geometry, dl);
            if (!pose) {
                throw InputError("dl: found leg displacements of no pose, expected ones near home");
            }
            return std::pair{pose->p_m, pose->R};
        },
        nb::arg("platform"), nb::arg("dl"), "(p, R) from leg displacements, by Newton's method from home");
    module.def("rotation_from_rpy", &rotation_from_rpy, nb::arg("rpy"), "Rz(yaw) Ry(pitch) Rx(roll)");
    module.def("rpy_from_rotation", &rpy_from_rotation, nb::arg("R"));
}

void bind_dynamics(nb::module_& module) {
    module.def(
        "mass_matrix",
        [](const PlatformFile& platform, const Load& load, const Matrix3& R) {
            return mass_matrix(body_of(platform, load), R);
        },
        nb::arg("platform"), nb::arg("load"), nb::arg("R"), "(18): (6, 6) about O_A, base axes");
    module.def(
        "coupling_matrix",
        [](const PlatformFile& platform, const Load& load, const Matrix3& R) {
            return coupling_matrix(body_of(platform, load), R);
        },
        nb::arg("platform"), nb::arg("load"), nb::arg("R"), "(19): (6, 6)");
    module.def(
        "gravity_wrench",
        [](const PlatformFile& platform, const Load& load, const Matrix3& R) {
            return gravity_wrench(body_of(platform, load), R, platform.gravity_m_s2);
        },
        nb::arg("platform"), nb::arg("load"), nb::arg("R"), "G of (11): holds the platform against gravity");
    module.def(
        "bias_wrench",
        [](const PlatformFile& platform, const Load& load, const Matrix3& R, const Vector3& w) {
            return bias_wrench(body_of(platform, load), R, w);
        },
        nb::arg("platform"), nb::arg("load"), nb::arg("R"), nb::arg("w"),
        "centripetal and gyroscopic terms of (11)");
    module.def(
        "acceleration",
        [](const PlatformFile& platform, const Load& load, const Vector3& p, const Matrix3& R,
           const Vector6& V, const Vector6& leg_force) {
            return acceleration(platform.geometry, body_of(platform, load), platform.gravity_m_s2, {p, R},
                                twist_of(V), leg_force);
        },
        nb::arg("platform"), nb::arg("load"), nb::arg("p"), nb::arg("R"), nb::arg("V"), nb::arg("leg_force"),
        "(11), (12): d/dt [v; omega] under leg forces");
    module.def(
        "leg_forces",
        [](const PlatformFile& platform, const Load& load, const Vector3& p, const Matrix3& R,
           const Vector6& V, const Vector6& twist_rate) {
            return leg_forces(platform.geometry, body_of(platform, load), platform.gravity_m_s2, {p, R},
                              twist_of(V), twist_rate);
        },
        nb::arg("platform"), nb::arg("load"), nb::arg("p"), nb::arg("R"), nb::arg("V"), nb::arg("twist_rate"),
        "Inverse dynamics: leg forces that give d/dt [v; omega]");
}

} // namespace

void bind_sim(nb::module_& module) {
    const nb::exception<InputError> input_error(module, "InputError", PyExc_ValueError);
    bind_load(module);
    bind_platform(module);
    bind_scenario(module);
    bind_kinematics(module);
    bind_dynamics(module);
}
