#include "support.hpp"

#include <hexload_sim/hydraulics.hpp>
#include <hexload_sim/kinematics.hpp>
#include <hexload_sim/plant.hpp>
#include <hexload_sim/simulator.hpp>

#include <algorithm>
#include <cmath>

using namespace hexload::sim;
using namespace hexload::sim::test;

namespace {

Scenario standstill(const Vector6& pose, const Load& load) {
    Scenario scenario = load_scenario(scenario_path("paper_clean"));
    scenario.trajectory = StandstillMotion{pose};
    scenario.loads = {{0.0, load}};
    scenario.duration_s = 2.0;
    return scenario;
}

// Largest distance of a leg from its reference during the run.
double largest_error_m(const Scenario& scenario) {
    const PlatformFile platform = paper_platform();
    Simulator simulator(platform, scenario);
    double largest_m = 0.0;
    run(simulator, nullptr, [&](const Tick& tick, const auto&) {
        const Vector6 reference_m = leg_displacement(platform.geometry, tick.reference.pose());
        largest_m =
            std::max(largest_m, (tick.legs.displacement_m.matrix() - reference_m).cwiseAbs().maxCoeff());
    });
    return largest_m;
}

HydraulicSettings differential_cylinder() {
    HydraulicSettings settings;
    settings.piston_area_m2 = 1.257e-3;   // 40 mm bore
    settings.rod_side_area_m2 = 0.641e-3; // 28 mm rod
    return settings;
}

struct StopVisit {
    double beyond_m = 0.0;   // deepest point beyond the stroke
    double rest_m_s = 0.0;   // leg speed after two seconds
    double returned_m = 0.0; // displacement 0.2 s after reversing
};

StopVisit visit_stop(const PlatformFile& platform, const HydraulicSettings& settings, double command) {
    Plant plant(platform.geometry, platform.gravity_m_s2, settings, 4);
    plant.reset(Pose{}, loaded(platform, paper_load()));
    StopVisit visit;
    for (int tick = 0; tick < 2000; ++tick) {
        plant.advance(Legs::Constant(command));
        visit.beyond_m = std::max(visit.beyond_m, plant.legs().displacement_m.abs().maxCoeff() - 0.3);
    }
    visit.rest_m_s = plant.legs().velocity_m_s.abs().maxCoeff();
    for (int tick = 0; tick < 200; ++tick) {
        plant.advance(Legs::Constant(-command));
    }
    visit.returned_m = plant.legs().displacement_m.abs().maxCoeff();
    return visit;
}

} // namespace

SCENARIO("the servo holds gravity at standstill") {
    // Equilibrium is solved to rounding: 1e-16 of the supply pressure over an oil stiffness of 6e6 N/m is
    // 1e-18 m; what remains is the rounding of leg lengths through the loop.
    constexpr double still_m = 1e-12;
    const Vector6 home = Vector6::Zero();
    const Vector6 corner = (Vector6() << 0.1, -0.08, 0.05, 0.1, -0.08, 0.15).finished();
    GIVEN("loads from none to 1500 kg, at home and in a corner, in static equilibrium") {
        double equal_area_m = 0.0;
        double differential_m = 0.0;
        for (const double mass_kg : {0.0, 500.0, 1500.0}) {
            for (const Vector6& pose : {home, corner}) {
                Scenario scenario = standstill(pose, eccentric_load(mass_kg));
                equal_area_m = std::max(equal_area_m, largest_error_m(scenario));
                scenario.hydraulics = differential_cylinder();
                differential_m = std::max(differential_m, largest_error_m(scenario));
            }
        }
        WHEN("two seconds pass on cylinders of equal areas") {
            THEN("nothing moves") {
                CHECK(equal_area_m < still_m);
            }
        }
        WHEN("two seconds pass on differential cylinders") {
            THEN("nothing moves") {
                CHECK(differential_m < still_m);
            }
        }
    }
}

SCENARIO("the servo recovers from a new load") {
    GIVEN("an empty platform at rest that is given 1500 kg") {
        Scenario scenario = standstill(Vector6::Zero(), Load{});
        scenario.loads.push_back({0.1, eccentric_load(1500.0)});
        scenario.duration_s = 10.0;
        WHEN("ten integral times have passed") {
            Simulator simulator(paper_platform(), scenario);
            run(simulator, nullptr);
            const LegState legs = simulator.plant().legs();
            const Matrix6 J = jacobian(paper_platform().geometry, simulator.plant().pose());
            const double lift_n = (J.transpose() * legs.force_n.matrix())(2);
            THEN("the legs are back, to e^-9 of a droop of some millimetres") {
                CHECK(legs.displacement_m.abs().maxCoeff() < 5e-6);
            }
            THEN("they carry 1600 kg, to the acceleration that is left: 5e-6 m x (1 1/s)^2 over g") {
                CHECK(std::abs(lift_n / (1600.0 * 9.81) - 1.0) < 1e-6);
            }
        }
    }
}

SCENARIO("a load change keeps pose and velocity continuous") {
    GIVEN("a moving platform") {
        Scenario scenario = load_scenario(scenario_path("paper_clean"));
        scenario.loads.push_back({1.0, eccentric_load(800.0)});
        scenario.duration_s = 1.1;
        WHEN("the load changes after one second") {
            Simulator simulator(paper_platform(), scenario);
            double largest_step_m_s = 0.0;
            Vector6 before = simulator.plant().twist().stacked();
            run(simulator, nullptr, [&](const Tick& tick, const auto&) {
                largest_step_m_s =
                    std::max(largest_step_m_s, (tick.twist.stacked() - before).cwiseAbs().maxCoeff());
                before = tick.twist.stacked();
            });
            THEN("the twist changes in a tick by no more than 50 m/s^2 x 1 ms") {
                CHECK(largest_step_m_s < 0.05);
            }
        }
    }
}

SCENARIO("the end stops keep the stroke") {
    const PlatformFile platform = paper_platform();
    const HydraulicSettings settings;
    const double stall_n = settings.piston_area_m2 * settings.supply_pressure_pa;
    // Deepest point of an undamped stop: k d^2 / 2 = m v^2 / 2 + F d, for a leg with a third of the mass
    // behind it and twice the unloaded speed, as gravity and stored pressure help.
    const double speed_m_s = 2.0 * Hydraulics(settings, -0.3, 0.3).speed_gain_m_s();
    const double k = settings.stop_stiffness_n_m;
    const double deepest_m =
        (stall_n + std::sqrt(stall_n * stall_n + k * 600.0 / 3.0 * speed_m_s * speed_m_s)) / k;
    GIVEN("the paper's platform and load") {
        WHEN("valves are driven fully open for two seconds, then reversed") {
            const StopVisit out = visit_stop(platform, settings, 1.0);
            const StopVisit in = visit_stop(platform, settings, -1.0);
            THEN("the legs reach their stops, and not beyond what their stiffness allows") {
                CHECK(out.beyond_m > 0.0);
                CHECK(out.beyond_m < deepest_m);
                CHECK(in.beyond_m > 0.0);
                CHECK(in.beyond_m < deepest_m);
            }
            THEN("they come to rest there") {
                CHECK(out.rest_m_s < 1e-3);
                CHECK(in.rest_m_s < 1e-3);
            }
            THEN("they come back") {
                CHECK(out.returned_m < 0.3);
                CHECK(in.returned_m < 0.3);
            }
        }
    }
}

SCENARIO("a leg that cannot hold its load is refused") {
    GIVEN("a supply pressure of 1 MPa") {
        Scenario scenario = standstill(Vector6::Zero(), eccentric_load(1500.0));
        scenario.hydraulics.supply_pressure_pa = 1e6;
        WHEN("1500 kg are put on") {
            THEN("the message says which leg, which force and which pressure") {
                CHECK_THROWS_WITH_AS(Simulator(paper_platform(), scenario),
                                     doctest::Contains("supply pressure can hold"), std::runtime_error);
            }
        }
    }
}
