#include "support.hpp"

#include <hexload_sim/plant.hpp>
#include <hexload_sim/simulator.hpp>

#include <Eigen/Geometry>

#include <algorithm>
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
    double lost_j = 0.0;      // to friction
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
        balance.exchanged_j += std::abs(work.hydraulic_j - before.hydraulic_j);
        const double lost_j = work.hydraulic_j - work.body_j;
        balance.loss_grows = balance.loss_grows && lost_j >= balance.lost_j;
        balance.lost_j = lost_j;
        before = work;
    });
    balance.imbalance_j = before.body_j - (stored_j() - start_j);
    return balance;
}

// Plant state after 0.1 s of small valve openings that never close, so that every function on the way is
// smooth.
PlantState state_after(int substeps) {
    const PlatformFile platform = paper_platform();
    Plant plant(platform.geometry, platform.gravity_m_s2, HydraulicSettings{}, substeps);
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

struct RateError {
    double acceleration = 0.0; // relative
    double power = 0.0;        // relative to the force times 1 m/s
};

RateError worst_rate_error(const PlatformFile& platform) {
    const Geometry& geometry = platform.geometry;
    HydraulicSettings settings;
    settings.coulomb_friction_n = 50.0;
    const Hydraulics hydraulics(settings, geometry.stroke_min_m, geometry.stroke_max_m);
    Plant plant(geometry, platform.gravity_m_s2, settings, 4);
    const MassProperties body = loaded(platform, eccentric_load(5.0 * platform.platform.mass_kg));
    plant.reset(Pose{}, body);
    RandomStates random(4);
    RateError worst;
    for (int sample = 0; sample < 200; ++sample) {
        const Pose pose = random.pose(geometry);
        const Twist twist = random.twist();
        const Eigen::Quaterniond q(pose.R);
        PlantState state;
        state.body = {
            pose.p_m, {q.w(), q.x(), q.y(), q.z()}, twist.v_m_s, pose.R.transpose() * twist.w_rad_s};
        state.hydraulics.pressure_a_pa = 10e6 + random.vector6(5e6).array();
        state.hydraulics.pressure_b_pa = 10e6 + random.vector6(5e6).array();
        const PlantState rate = plant.derivative(state, Legs::Zero());

        const Vector6 velocity_m_s = leg_velocity(geometry, pose, twist);
        const Vector6 force_n = hydraulics.force_n(state.hydraulics).matrix();
        const Vector6 net_n = force_n - hydraulics.friction_n(velocity_m_s.array()).matrix();
        const Vector6 expected = acceleration(geometry, body, platform.gravity_m_s2, pose, twist, net_n);
        Vector6 found;
        found << rate.body.v_m_s, pose.R * rate.body.w_platform_rad_s;
        worst.acceleration = std::max(worst.acceleration, (found - expected).norm() / expected.norm());
        worst.power = std::max(worst.power,
                               std::abs(rate.work.hydraulic_j - force_n.dot(velocity_m_s)) / force_n.norm());
    }
    return worst;
}

} // namespace

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
                    CHECK((balance.lost_j > 0.0) == (scenario.hydraulics.coulomb_friction_n > 0.0));
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
