#include "support.hpp"

#include <hexload_sim/plant.hpp>
#include <hexload_sim/simulator.hpp>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>

#include <algorithm>
#include <array>
#include <cmath>

using namespace hexload::sim;
using namespace hexload::sim::test;

namespace {

// RK4 at 0.25 ms on oil column modes up to 40 Hz: (2 pi 40 Hz x 0.25 ms)^4 / 120 = 1e-7 per oscillation, of
// which a share of the energy takes part.
constexpr double balance_tolerance = 1e-6;

struct Balance {
    double imbalance_j = 0.0; // work into the body less the energy that is in it
    double exchanged_j = 0.0; // sum of |work| per tick
    double lost_j = 0.0;      // to friction, the seals' bristles being counted as stored
    bool loss_grows = true;
};

Balance balance_of(const Scenario& scenario, const PlatformFile& platform) {
    Simulator simulator(platform, scenario);
    const Plant& plant = simulator.plant();
    const auto stored_j = [&] { return plant.kinetic_energy_j() + plant.potential_energy_j(); };
    const double start_j = stored_j();
    Balance balance;
    LegWork before;
    run(simulator, nullptr, [&](const Tick&, const auto&) {
        const LegWork& work = plant.state().work;
        balance.exchanged_j += std::abs(work.drive_j - before.drive_j);
        const double lost_j = work.drive_j - work.body_j - plant.bristle_energy_j();
        balance.loss_grows = balance.loss_grows && lost_j >= balance.lost_j;
        balance.lost_j = lost_j;
        before = work;
    });
    balance.imbalance_j = before.body_j - (stored_j() - start_j);
    return balance;
}

// Plant state after 0.1 s of small valve openings that never close, so that every function on the way is
// smooth.
PlantState state_after(int substeps, const SixLegBars& bars = {}) {
    const PlatformFile platform = paper_platform();
    Plant plant(platform.geometry, platform.gravity_m_s2, HydraulicSettings{}, substeps, bars);
    plant.reset(Pose{}, loaded(platform, eccentric_load(500.0)));
    const Legs command = (Legs() << 0.05, 0.08, 0.06, 0.1, 0.07, 0.09).finished();
    for (int tick = 0; tick < 100; ++tick) {
        plant.advance(command);
    }
    return plant.state();
}

// Distance in units of 1 m, 1 m/s, 1 rad/s and 1 MPa.
double distance(const PlantState& a, const PlantState& b) {
    return (a.body.p_m - b.body.p_m).norm() + (a.body.q - b.body.q).norm() +
           (a.body.v_m_s - b.body.v_m_s).norm() + (a.body.w_platform_rad_s - b.body.w_platform_rad_s).norm() +
           1e-6 * (a.hydraulics.pressure_a_pa - b.hydraulics.pressure_a_pa).matrix().norm();
}

// A plant in the midst of a motion.
struct RandomMotion {
    Pose pose;
    Twist twist;
    PlantState state;
};

// At a random pose and twist, the pressures in its cylinders 10 MPa and up to `spread_pa` more or less.
RandomMotion random_motion(RandomStates& random, const Geometry& geometry, double spread_pa) {
    RandomMotion motion{random.pose(geometry), random.twist(), {}};
    const Eigen::Quaterniond q(motion.pose.R);
    motion.state.body = {motion.pose.p_m,
                         {q.w(), q.x(), q.y(), q.z()},
                         motion.twist.v_m_s,
                         motion.pose.R.transpose() * motion.twist.w_rad_s};
    motion.state.hydraulics.pressure_a_pa = 10e6 + random.vector6(spread_pa).array();
    motion.state.hydraulics.pressure_b_pa = 10e6 + random.vector6(spread_pa).array();
    return motion;
}

struct RateError {
    double acceleration = 0.0; // relative
    double power = 0.0;        // relative to the force times 1 m/s
};

RateError worst_rate_error(const PlatformFile& platform) {
    const Geometry& geometry = platform.geometry;
    HydraulicSettings settings;
    settings.friction.coulomb_n.setConstant(50.0);
    const Friction friction(settings.friction, default_tick_s / 4);
    const Hydraulics hydraulics(settings, geometry.stroke_min_m, geometry.stroke_max_m);
    Plant plant(geometry, platform.gravity_m_s2, settings, 4);
    const MassProperties body = loaded(platform, eccentric_load(5.0 * platform.platform.mass_kg));
    plant.reset(Pose{}, body);
    RandomStates random(4);
    RateError worst;
    for (int sample = 0; sample < 200; ++sample) {
        const auto [pose, twist, state] = random_motion(random, geometry, 5e6);
        const PlantState rate = plant.derivative(state, Legs::Zero());

        const Vector6 velocity_m_s = leg_velocity(geometry, pose, twist);
        const Vector6 force_n = hydraulics.force_n(state.hydraulics).matrix();
        const Vector6 net_n =
            force_n - friction.at(velocity_m_s.array(), force_n.array(), Legs::Zero(), 1.0).force_n.matrix();
        const Vector6 expected = acceleration(geometry, body, platform.gravity_m_s2, pose, twist, net_n);
        Vector6 found;
        found << rate.body.v_m_s, pose.R * rate.body.w_platform_rad_s;
        worst.acceleration = std::max(worst.acceleration, (found - expected).norm() / expected.norm());
        worst.power =
            std::max(worst.power, std::abs(rate.work.drive_j - force_n.dot(velocity_m_s)) / force_n.norm());
    }
    return worst;
}

constexpr LegBars heavy_leg{
    .rod_mass_kg = 8.0, .rod_length_m = 0.5, .cylinder_mass_kg = 15.0, .cylinder_length_m = 0.6};

// No two of them alike, one without a rod's mass.
SixLegBars unlike_legs() {
    SixLegBars bars(heavy_leg);
    bars.rod_mass_kg = (Legs() << 8.0, 5.0, 0.0, 9.0, 3.0, 6.0).finished();
    bars.rod_length_m = (Legs() << 0.5, 0.55, 0.6, 0.45, 0.4, 0.52).finished();
    bars.cylinder_mass_kg = (Legs() << 15.0, 12.0, 20.0, 0.5, 11.0, 14.0).finished();
    bars.cylinder_length_m = (Legs() << 0.6, 0.5, 0.55, 0.65, 0.7, 0.45).finished();
    return bars;
}

// Four points that have the mass, the centre and the moment of inertia of the two uniform bars of a leg: each
// bar's half masses l / sqrt(12) from its middle. Column k: where point k is when the hinge is at leg_m.
Eigen::Matrix<double, 3, 4> points_of(const LegBars& bars, const Vector3& leg_m) {
    const Vector3 e = leg_m.normalized();
    const double rod_m = bars.rod_length_m / std::sqrt(12.0);
    const double cylinder_m = bars.cylinder_length_m / std::sqrt(12.0);
    Eigen::Matrix<double, 3, 4> points;
    points << leg_m - (bars.rod_length_m / 2.0 - rod_m) * e, leg_m - (bars.rod_length_m / 2.0 + rod_m) * e,
        (bars.cylinder_length_m / 2.0 - cylinder_m) * e, (bars.cylinder_length_m / 2.0 + cylinder_m) * e;
    return points;
}

// What a leg's points take from the hinge that moves so (d'Alembert), by finite differences alone.
Vector3 hinge_force_n(const LegBars& bars, const Gravity& gravity, const Vector3& leg_m,
                      const Vector3& velocity_m_s, const Vector3& acceleration_m_s2) {
    constexpr double step_s = 1e-4;
    constexpr double step_m = 1e-5;
    const auto at = [&](double t_s) {
        return points_of(bars, leg_m + velocity_m_s * t_s + acceleration_m_s2 * t_s * t_s / 2.0);
    };
    const Eigen::Matrix<double, 3, 4> acceleration =
        (at(step_s) - 2.0 * at(0.0) + at(-step_s)) / (step_s * step_s);
    const std::array<double, 4> mass_kg{bars.rod_mass_kg / 2.0, bars.rod_mass_kg / 2.0,
                                        bars.cylinder_mass_kg / 2.0, bars.cylinder_mass_kg / 2.0};
    Vector3 force_n = Vector3::Zero();
    for (int axis = 0; axis < 3; ++axis) {
        const Vector3 step = step_m * Vector3::Unit(axis);
        const Eigen::Matrix<double, 3, 4> moved =
            (points_of(bars, leg_m + step) - points_of(bars, leg_m - step)) / (2.0 * step_m);
        for (int k = 0; k < 4; ++k) {
            const Vector3 pull = acceleration.col(k) + gravity.up_m_s2;
            force_n(axis) += mass_kg[static_cast<std::size_t>(k)] * moved.col(k).dot(pull);
        }
    }
    return force_n;
}

// Share of the legs' wrench on the platform that the points do not explain, the worst of random states.
double unexplained_by_points(const SixLegBars& bars, const Gravity& gravity) {
    const PlatformFile platform = paper_platform();
    const Geometry& geometry = platform.geometry;
    const Hydraulics hydraulics(HydraulicSettings{}, geometry.stroke_min_m, geometry.stroke_max_m);
    Plant plant(geometry, gravity, HydraulicSettings{}, 4, bars);
    const MassProperties body = loaded(platform, eccentric_load(200.0));
    plant.reset(Pose{}, body);
    RandomStates random(5);
    double worst = 0.0;
    for (int sample = 0; sample < 100; ++sample) {
        const auto [pose, twist, state] = random_motion(random, geometry, 1e6);
        const PlantState rate = plant.derivative(state, Legs::Zero());
        Vector6 twist_rate;
        twist_rate << rate.body.v_m_s, pose.R * rate.body.w_platform_rad_s;
        // What the oil pushes, less what platform and load take.
        const Vector6 left =
            jacobian(geometry, pose).transpose() * hydraulics.force_n(state.hydraulics).matrix() -
            mass_matrix(body, pose.R) * twist_rate - bias_wrench(body, pose.R, twist.w_rad_s) -
            gravity_wrench(body, pose.R, gravity);
        const LegVectors legs = leg_vectors(geometry, pose);
        Vector6 taken = Vector6::Zero();
        for (int leg = 0; leg < 6; ++leg) {
            const Vector3 arm = legs.arm_m.col(leg);
            const Vector3& w = twist.w_rad_s;
            const Vector3 force =
                hinge_force_n(bars.of(leg), gravity, legs.length_m(leg) * legs.direction.col(leg),
                              twist.v_m_s + w.cross(arm),
                              twist_rate.head<3>() + twist_rate.tail<3>().cross(arm) + w.cross(w.cross(arm)));
            taken.head<3>() += force;
            taken.tail<3>() += arm.cross(force);
        }
        worst = std::max(worst, (left - taken).norm() / taken.norm());
    }
    return worst;
}

} // namespace

SCENARIO("the legs' masses, six at once, are those of each leg's formula") {
    GIVEN("unlike legs on a tilted base, random poses, twists and pressures") {
        const PlatformFile platform = paper_platform();
        const Geometry& geometry = platform.geometry;
        const Gravity gravity(9.81, -0.08, 0.05);
        const SixLegBars bars = unlike_legs();
        const Hydraulics hydraulics(HydraulicSettings{}, geometry.stroke_min_m, geometry.stroke_max_m);
        Plant plant(geometry, gravity, HydraulicSettings{}, 4, bars);
        const MassProperties body = loaded(platform, eccentric_load(200.0));
        plant.reset(Pose{}, body);
        WHEN("the plant is differentiated, and (11) is solved with the sum of the legs' wrenches") {
            RandomStates random(6);
            double worst = 0.0;
            for (int sample = 0; sample < 100; ++sample) {
                const auto [pose, twist, state] = random_motion(random, geometry, 1e6);
                const LegWrench legs = leg_wrench(geometry, bars, gravity, pose, twist);
                const Vector6 net =
                    jacobian(geometry, pose).transpose() * hydraulics.force_n(state.hydraulics).matrix() -
                    bias_wrench(body, pose.R, twist.w_rad_s) - gravity_wrench(body, pose.R, gravity) -
                    legs.bias;
                const Vector6 expected = (mass_matrix(body, pose.R) + legs.mass).llt().solve(net);
                const PlantState rate = plant.derivative(state, Legs::Zero());
                Vector6 found;
                found << rate.body.v_m_s, pose.R * rate.body.w_platform_rad_s;
                worst = std::max(worst, (found - expected).norm() / expected.norm());
            }
            THEN("accelerations are the same, to five digits lost in solving") {
                CHECK(worst < 1e-10);
            }
        }
    }
}

SCENARIO("legs with mass take from the platform what their points take") {
    GIVEN("legs of 23 kg, random poses, twists and pressures") {
        WHEN("the plant is differentiated, and points of the legs are followed along the hinges' path") {
            // Second differences over 0.1 ms of motions at up to some 4 rad/s: (4e-4)^2 / 12 = 1e-8, and
            // rounding of 1e-16 m / (1e-4 s)^2 = 1e-8 m/s^2 beside 10 m/s^2.
            THEN("forces of the oil and accelerations fit") {
                CHECK(unexplained_by_points(heavy_leg, 9.81) < 1e-6);
            }
            THEN("they also do where no leg is like another and the base is 6 degrees off level") {
                CHECK(unexplained_by_points(unlike_legs(), Gravity(9.81, 0.1, -0.05)) < 1e-6);
            }
        }
    }
    GIVEN("a ten second run with such legs") {
        Scenario scenario = load_scenario(scenario_path("multisine"));
        scenario.leg_bars = heavy_leg;
        WHEN("the work of the oil is compared with the energy of body and legs") {
            const Balance balance = balance_of(scenario, load_platform_file(scenario.platform));
            THEN("what went in is there") {
                CHECK(std::abs(balance.imbalance_j) < balance_tolerance * balance.exchanged_j);
            }
        }
    }
    GIVEN("such legs at rest") {
        const PlatformFile platform = paper_platform();
        Plant plant(platform.geometry, platform.gravity_m_s2, HydraulicSettings{}, 4, heavy_leg);
        plant.reset(Pose{}, loaded(platform, paper_load()));
        WHEN("a second passes") {
            const Legs spool = plant.state().hydraulics.spool;
            for (int tick = 0; tick < 1000; ++tick) {
                plant.advance(spool);
            }
            THEN("they have not sunk") {
                CHECK(plant.pose().p_m.norm() < 1e-9);
            }
        }
    }
}

SCENARIO("the power balance of a rig closes") {
    GIVEN("a scenario with every effect, and the same with bristles") {
        WHEN("the work of the legs is compared with the energy of body, legs and bristles") {
            THEN("what went in is there, and friction only takes") {
                for (const FrictionLaw law : {FrictionLaw::stribeck, FrictionLaw::lugre}) {
                    CAPTURE(static_cast<int>(law));
                    Scenario scenario = load_scenario(scenario_path("rig"));
                    scenario.duration_s = 10.0;
                    scenario.hydraulics.friction.law = law;
                    const Balance balance = balance_of(scenario, load_platform_file(scenario.platform));
                    CHECK(balance.exchanged_j > 10.0);
                    CHECK(std::abs(balance.imbalance_j) < balance_tolerance * balance.exchanged_j);
                    CHECK(balance.loss_grows);
                    CHECK(balance.lost_j > 0.0);
                }
            }
        }
    }
}

SCENARIO("the power balance of a ten second run closes") {
    GIVEN("motions with and without friction, and another machine") {
        WHEN("the work of the legs is compared with the energy of the body") {
            THEN("what went in is there, less what friction took") {
                for (const char* name : {"paper_clean", "multisine", "work", "friction", "small_platform"}) {
                    CAPTURE(name);
                    Scenario scenario = load_scenario(scenario_path(name));
                    scenario.duration_s = 10.0;
                    const Balance balance = balance_of(scenario, load_platform_file(scenario.platform));
                    CHECK(balance.exchanged_j > 10.0);
                    CHECK(std::abs(balance.imbalance_j) < balance_tolerance * balance.exchanged_j);
                    CHECK(balance.loss_grows);
                    CHECK((balance.lost_j > 0.0) == scenario.hydraulics.friction.exists());
                }
            }
        }
    }
}

SCENARIO("halving the RK4 step divides its error by sixteen") {
    GIVEN("a run of 0.1 s and its limit for very small steps") {
        const PlantState limit = state_after(64);
        WHEN("the step is halved twice") {
            const double error_2 = distance(state_after(2), limit);
            const double error_4 = distance(state_after(4), limit);
            const double error_8 = distance(state_after(8), limit);
            // The next order adds h / (h of the fastest mode): some 15 % here, less at the smaller step.
            THEN("the error falls by 2^4 each time") {
                CHECK(std::abs(error_2 / error_4 / 16.0 - 1.0) < 0.25);
                CHECK(std::abs(error_4 / error_8 / 16.0 - 1.0) < 0.15);
            }
            THEN("four steps per tick are exact to a nanometre and its like") {
                CHECK(error_4 < 1e-6);
            }
        }
    }
}

SCENARIO("with heavy legs, whose posture is shared between stages, halving the step does the same") {
    GIVEN("a run of 0.1 s of legs no two of which are alike, and its limit for very small steps") {
        const PlantState limit = state_after(64, unlike_legs());
        WHEN("the step is halved twice") {
            const double error_2 = distance(state_after(2, unlike_legs()), limit);
            const double error_4 = distance(state_after(4, unlike_legs()), limit);
            const double error_8 = distance(state_after(8, unlike_legs()), limit);
            THEN("the error falls by 2^4 each time, within the next order's share as above") {
                CHECK(std::abs(error_2 / error_4 / 16.0 - 1.0) < 0.25);
                CHECK(std::abs(error_4 / error_8 / 16.0 - 1.0) < 0.15);
            }
        }
    }
}

SCENARIO("the fast right-hand side is Newton-Euler about the platform centre") {
    GIVEN("random poses, twists and pressures of two machines") {
        WHEN("the plant is differentiated") {
            const RateError paper = worst_rate_error(paper_platform());
            const RateError small = worst_rate_error(small_platform());
            THEN("the accelerations are those of (11) and (12), to five digits lost in solving") {
                CHECK(paper.acceleration < 1e-10);
                CHECK(small.acceleration < 1e-10);
            }
            THEN("the leg power is force times J V") {
                CHECK(paper.power < 1e-13);
                CHECK(small.power < 1e-13);
            }
        }
    }
}
