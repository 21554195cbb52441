#include "support.hpp"

#include <hexload_sim/machine.hpp>
#include <hexload_sim/rotation.hpp>
#include <hexload_sim/run_directory.hpp>
#include <hexload_sim/simulator.hpp>

#include <Eigen/LU>

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <vector>

using namespace hexload::sim;
using namespace hexload::sim::test;

namespace {

Scenario multisine(double duration_s) {
    Scenario scenario = load_scenario(scenario_path("multisine"));
    scenario.duration_s = duration_s;
    scenario.sensors.noise_scale = 0.0;
    return scenario;
}

std::vector<Tick> run_of(const Scenario& scenario) {
    std::vector<Tick> ticks;
    Simulator simulator(paper_platform(), scenario);
    run(simulator, nullptr, [&](const Tick& tick, const auto&) { ticks.push_back(tick); });
    return ticks;
}

// The signal a while before tick k, from six ticks around it (Lagrange).
template <typename Signal>
Vector6 interpolated(const std::vector<Tick>& ticks, std::size_t k, double ago_s, Signal signal) {
    const double at = static_cast<double>(k) - ago_s / default_tick_s;
    const auto first = static_cast<std::size_t>(std::floor(at)) - 2;
    Vector6 sum = Vector6::Zero();
    for (std::size_t i = first; i < first + 6; ++i) {
        double weight = 1.0;
        for (std::size_t j = first; j < first + 6; ++j) {
            if (j != i) {
                weight *= (at - static_cast<double>(j)) / (static_cast<double>(i) - static_cast<double>(j));
            }
        }
        sum += weight * signal(ticks[i]).matrix();
    }
    return sum;
}

Legs true_force(const Tick& tick) {
    return tick.legs.force_n;
}

Legs true_velocity(const Tick& tick) {
    return tick.legs.velocity_m_s;
}

// Largest distance of the sensors from the interpolated truth, and of the latter from that of the tick.
struct Lateness {
    double force_n = 0.0, velocity_m_s = 0.0, displacement_m = 0.0;
    double force_change_n = 0.0, velocity_change_m_s = 0.0;
};

Lateness lateness_of(const std::vector<Tick>& ticks, const SensorSettings& sensors) {
    Lateness late;
    const auto widen = [](double& largest, const Vector6& difference) {
        largest = std::max(largest, difference.norm());
    };
    for (std::size_t k = 20; k + 20 < ticks.size(); ++k) {
        const LegSample& seen = *ticks[k].sample;
        const LegState& truth = ticks[k].legs;
        const Vector6 force_n = interpolated(ticks, k, sensors.force_delay_s, true_force);
        const Vector6 velocity_m_s = interpolated(ticks, k, sensors.velocity_delay_s, true_velocity);
        widen(late.force_n, seen.force_n - force_n);
        widen(late.velocity_m_s, seen.velocity_m_s - velocity_m_s);
        widen(late.displacement_m, seen.displacement_m - truth.displacement_m.matrix());
        widen(late.force_change_n, force_n - truth.force_n.matrix());
        widen(late.velocity_change_m_s, velocity_m_s - truth.velocity_m_s.matrix());
    }
    return late;
}

// Leg 2 of a plant whose valves are moved to and fro, and what its low-passes make of it, in one number each:
// the component of that frequency, over 100 periods behind 100 periods of settling, Hann window squared, so
// that the platform's slow drift does not show.
struct Response {
    std::complex<double> force, force_seen, velocity, velocity_seen;
};

Response response_at(double frequency_hz, const LowPasses& low_passes) {
    const PlatformFile platform = paper_platform();
    Plant plant(platform.geometry, platform.gravity_m_s2, HydraulicSettings{}, 4, {}, low_passes);
    plant.reset(Pose{}, loaded(platform, eccentric_load(500.0)));
    const int ticks = static_cast<int>(std::lround(100.0 / (frequency_hz * default_tick_s)));
    const Legs shape = (Legs() << 0.02, -0.03, 0.01, 0.02, -0.01, -0.02).finished();
    const Legs still = plant.state().hydraulics.spool;
    Response response;
    for (int tick = -ticks; tick < ticks; ++tick) {
        const double phase = 2.0 * std::numbers::pi * frequency_hz * default_tick_s * tick;
        if (tick >= 0) {
            const double window = 1.0 - std::cos(2.0 * std::numbers::pi * tick / ticks);
            const std::complex<double> weight = window * window * std::polar(1.0, -phase);
            const LegState truth = plant.legs();
            const LegState seen = plant.transducers(truth);
            response.force += weight * truth.force_n(1);
            response.force_seen += weight * seen.force_n(1);
            response.velocity += weight * truth.velocity_m_s(1);
            response.velocity_seen += weight * seen.velocity_m_s(1);
        }
        plant.advance(still + shape * std::cos(phase));
    }
    return response;
}

std::complex<double> butterworth(double frequency_hz, double bandwidth_hz) {
    const std::complex<double> s(0.0, frequency_hz / bandwidth_hz);
    return 1.0 / (1.0 + std::numbers::sqrt2 * s + s * s);
}

} // namespace

SCENARIO("gravity on a tilted base is the vertical, seen from axes that were turned") {
    GIVEN("a base turned by 0.02 rad about x and -0.03 rad about y") {
        WHEN("it stands on the ground") {
            const Matrix3 world_from_base = rotation_from_rpy({0.02, -0.03, 0.0});
            const Vector3 found = Gravity(9.81, 0.02, -0.03).up_m_s2;
            THEN("up is R^T e_z times g, to rounding") {
                CHECK((found - world_from_base.transpose() * Vector3(0.0, 0.0, 9.81)).norm() < 1e-14);
            }
            THEN("a level base has it along z, to the bit") {
                CHECK(Gravity(9.81, 0.0, 0.0).up_m_s2 == Gravity(9.81).up_m_s2);
            }
        }
    }
}

SCENARIO("a tilted base is a level machine leaned over") {
    GIVEN("a load that stands on a base tilted by a degree each way") {
        const PlatformFile platform = paper_platform();
        const MassProperties body = loaded(platform, eccentric_load(500.0));
        const Gravity gravity(9.81, 0.02, -0.015);
        WHEN("its leg forces are found, and those of the machine with all hinges turned in the world") {
            const Matrix3 turn = rotation_from_rpy({0.02, -0.015, 0.0});
            Matrix6 J = jacobian(platform.geometry, Pose{});
            const Vector6 tilted =
                leg_forces(platform.geometry, body, gravity, Pose{}, Twist{}, Vector6::Zero());
            J.leftCols<3>() *= turn.transpose();
            J.rightCols<3>() *= turn.transpose();
            const Vector6 turned = J.transpose().inverse() * gravity_wrench(body, turn, 9.81);
            THEN("they are the same") {
                CHECK((tilted - turned).norm() < 1e-11 * turned.norm());
            }
        }
    }
}

SCENARIO("hinge errors belong to the machine, and the servo does not know them") {
    GIVEN("hinges off by 0.3 mm at random, one of them by 2 mm more") {
        Scenario scenario = multisine(0.2);
        scenario.machine.hinge_error_sigma_m = 0.3e-3;
        scenario.machine.hinge_error_seed = 7;
        scenario.machine.base_hinge_errors_m[2] = {0.0, 0.0, 2e-3};
        const PlatformFile platform = paper_platform();
        const Machine machine = true_machine(platform, scenario.machine);
        WHEN("the machine is looked at") {
            double squares_m2 = 0.0;
            for (std::size_t leg = 0; leg < 6; ++leg) {
                const Vector3 base_m = machine.geometry.base_hinges_m[leg] -
                                       platform.geometry.base_hinges_m[leg] -
                                       scenario.machine.base_hinge_errors_m[leg];
                squares_m2 += base_m.squaredNorm() + (machine.geometry.platform_hinges_m[leg] -
                                                      platform.geometry.platform_hinges_m[leg])
                                                         .squaredNorm();
            }
            THEN("36 errors have the standard deviation, within four standard errors of it, 1 / sqrt(72)") {
                CHECK(std::abs(std::sqrt(squares_m2 / 36.0) / 0.3e-3 - 1.0) < 4.0 / std::sqrt(72.0));
            }
            THEN("frames and zeros of the legs are the platform file's") {
                CHECK(machine.geometry.home_height_m == platform.geometry.home_height_m);
                CHECK(machine.geometry.home_leg_length_m == platform.geometry.home_leg_length_m);
            }
        }
        WHEN("a run starts") {
            const Tick start = run_of(scenario).front();
            THEN("the legs are where the nominal machine would have them, the platform is not") {
                const Vector6 wanted_m = leg_displacement(platform.geometry, start.reference.pose());
                CHECK((start.legs.displacement_m.matrix() - wanted_m).norm() < 1e-9);
                CHECK((start.pose.p_m - start.reference.pose().p_m).norm() > 1e-5);
            }
            THEN("displacements are those of the true hinges") {
                const Vector6 true_m = leg_displacement(machine.geometry, start.pose);
                CHECK((start.legs.displacement_m.matrix() - true_m).norm() < 1e-12);
            }
        }
        WHEN("another run's seed is taken, and another machine's") {
            MachineSettings other = scenario.machine;
            other.hinge_error_seed = 8;
            THEN("only the latter gives other hinges") {
                CHECK(true_machine(platform, scenario.machine).geometry.base_hinges_m ==
                      machine.geometry.base_hinges_m);
                CHECK(true_machine(platform, other).geometry.base_hinges_m != machine.geometry.base_hinges_m);
            }
        }
    }
    GIVEN("errors that put all platform hinges on one line") {
        MachineSettings settings;
        const PlatformFile platform = paper_platform();
        for (std::size_t leg = 0; leg < 6; ++leg) {
            settings.platform_hinge_errors_m[leg] =
                Vector3(0.1 * static_cast<double>(leg), 0.0, 0.0) - platform.geometry.platform_hinges_m[leg];
        }
        WHEN("the machine is built") {
            THEN("it is refused") {
                CHECK_THROWS_WITH_AS(true_machine(platform, settings),
                                     doctest::Contains("six hinges on one line"), std::runtime_error);
            }
        }
    }
}

SCENARIO("a heavier platform than weighed has its mass and inertia in proportion") {
    GIVEN("a platform 2 % heavier") {
        Scenario scenario = multisine(0.01);
        scenario.machine.platform_scale = 1.02;
        const Load& load = scenario.loads.front().load;
        const PlatformFile platform = paper_platform();
        WHEN("a run starts") {
            const Simulator simulator(platform, scenario);
            const MassProperties extra = simulator.body_at_start() + mass_properties(Load{});
            const MassProperties nominal = mass_properties(platform.platform) + mass_properties(load);
            THEN("2 % of the platform are added") {
                CHECK(std::abs(extra.mass_kg - nominal.mass_kg - 0.02 * platform.platform.mass_kg) < 1e-10);
                CHECK((extra.inertia_kg_m2 - nominal.inertia_kg_m2 - 0.02 * platform.platform.inertia_kg_m2)
                          .norm() < 1e-10);
            }
        }
    }
}

SCENARIO("low-passes have the response of a second-order Butterworth filter") {
    GIVEN("20 Hz in front of the force and 60 Hz in front of the velocity") {
        const LowPasses low_passes{20.0, 60.0};
        WHEN("valves move at 10, 20 and 40 Hz") {
            // Valves hold their command for a tick: they also move at 1000 Hz less f, by f / (1000 - f) and
            // by what their 60 Hz let through of it. Sampling shows that as f, in the truth but not behind
            // the low-pass.
            THEN("amplitude and phase are those of the formula") {
                for (const double frequency_hz : {10.0, 20.0, 40.0}) {
                    CAPTURE(frequency_hz);
                    const double image_hz = 1.0 / default_tick_s - frequency_hz;
                    const double image = frequency_hz / image_hz * std::pow(60.0 / image_hz, 2);
                    const Response r = response_at(frequency_hz, low_passes);
                    CHECK(std::abs(r.force_seen / r.force - butterworth(frequency_hz, 20.0)) < 1.5 * image);
                    CHECK(std::abs(r.velocity_seen / r.velocity - butterworth(frequency_hz, 60.0)) <
                          1.5 * image);
                }
            }
        }
    }
}

SCENARIO("what a low-pass does to a parabola does not depend on its step") {
    GIVEN("low-passes of 20 Hz and of 3 kHz in the midst of a motion, and an input that is a parabola in "
          "time") {
        const Legs shape = (Legs() << 1.0, -2.0, 0.5, 3.0, -1.5, 0.2).finished();
        const auto input_at = [&](double t_s) -> Legs {
            return shape * (1.0 + 700.0 * t_s) - 4e5 * t_s * t_s;
        };
        const auto run_in = [&](double bandwidth_hz, int steps) {
            const double h_s = 1e-3 / steps;
            const LowPass low_pass(bandwidth_hz, h_s);
            LowPassState state{shape.square(), 300.0 * shape};
            for (int step = 0; step < steps; ++step) {
                state = low_pass.after(state, {input_at(step * h_s), input_at((step + 0.5) * h_s),
                                               input_at((step + 1.0) * h_s)});
            }
            return state;
        };
        WHEN("10 us pass") {
            const double w = 2.0 * std::numbers::pi * 20.0;
            const LowPassState begin{shape.square(), 300.0 * shape};
            const LowPassState end =
                LowPass(20.0, 1e-5).after(begin, {input_at(0.0), input_at(0.5e-5), input_at(1e-5)});
            THEN("the rate has changed as the equation says for the middle, within (w x 10 us)^2") {
                const Legs value = 0.5 * (begin.value + end.value);
                const Legs rate = 0.5 * (begin.rate_1_s + end.rate_1_s);
                const Legs expected = w * (w * (input_at(0.5e-5) - value) - std::numbers::sqrt2 * rate);
                const Legs found = (end.rate_1_s - begin.rate_1_s) / 1e-5;
                CHECK((found - expected).abs().maxCoeff() < 1.6e-6 * expected.abs().maxCoeff());
            }
        }
        WHEN("a millisecond is made in one step and in a hundred") {
            THEN("values and rates are the same, to rounding of rates by a hundredth of the step") {
                for (const double bandwidth_hz : {20.0, 3000.0}) {
                    CAPTURE(bandwidth_hz);
                    const LowPassState once = run_in(bandwidth_hz, 1);
                    const LowPassState often = run_in(bandwidth_hz, 100);
                    CHECK((once.value - often.value).abs().maxCoeff() < 1e-10);
                    CHECK((once.rate_1_s - often.rate_1_s).abs().maxCoeff() < 1e-6);
                }
            }
        }
    }
}

SCENARIO("channels are late by any fraction of a tick") {
    GIVEN("forces late by 0.15 ms and velocities by 2.6 ms") {
        Scenario scenario = multisine(1.0);
        scenario.sensors.force_delay_s = 0.15e-3;
        scenario.sensors.velocity_delay_s = 2.6e-3;
        const std::vector<Tick> ticks = run_of(scenario);
        WHEN("they are compared with the truth, interpolated between ticks") {
            const Lateness late = lateness_of(ticks, scenario.sensors);
            // The valves' command steps at every tick, so force has a kinked second derivative, which no
            // polynomial follows; that is some per cent of what 0.15 ms change.
            THEN("they are the truth of that instant, displacement that of the tick") {
                CHECK(late.force_n < 0.05 * late.force_change_n);
                CHECK(late.velocity_m_s < 1e-3 * late.velocity_change_m_s);
                CHECK(late.displacement_m < 4e-8); // float32 of 0.3 m in six legs
            }
        }
        WHEN("the plant takes five times as many steps, one of which ends at these instants") {
            scenario.substeps = 20;
            const std::vector<Tick> fine = run_of(scenario);
            double force_n = 0.0;
            double velocity_m_s = 0.0;
            double plant_n = 0.0;
            for (std::size_t k = 0; k < ticks.size(); ++k) {
                force_n = std::max(force_n, (ticks[k].sample->force_n - fine[k].sample->force_n).norm());
                velocity_m_s = std::max(
                    velocity_m_s, (ticks[k].sample->velocity_m_s - fine[k].sample->velocity_m_s).norm());
                plant_n = std::max(plant_n, (ticks[k].legs.force_n - fine[k].legs.force_n).matrix().norm());
            }
            // Rounding of float32: 1.2e-4 N below 4 kN and 3e-8 m/s below 1 m/s, in six legs of two runs.
            THEN("they differ by no more than the plants do at the ticks, and by float32") {
                CHECK(force_n < 2.0 * plant_n + 6e-4);
                CHECK(velocity_m_s < 1.5e-7);
            }
        }
    }
    GIVEN("forces late by three whole ticks") {
        Scenario scenario = multisine(0.1);
        scenario.sensors.force_delay_s = 3e-3;
        const std::vector<Tick> ticks = run_of(scenario);
        WHEN("they are compared with the truth three ticks before") {
            THEN("they are the same float32") {
                for (std::size_t k = 3; k < ticks.size(); ++k) {
                    const Vector6 before = ticks[k - 3].legs.force_n.matrix().cast<float>().cast<double>();
                    CHECK((ticks[k].sample->force_n - before).norm() < 1e-3);
                }
            }
        }
    }
    GIVEN("a low-pass of 50 Hz and a delay of 0.4 ms") {
        Scenario scenario = multisine(1.0);
        scenario.sensors.low_passes.force_hz = 50.0;
        const std::vector<Tick> filtered = run_of(scenario);
        scenario.sensors.force_delay_s = 0.4e-3;
        const std::vector<Tick> late = run_of(scenario);
        WHEN("the late run is compared with the other, interpolated") {
            double worst_n = 0.0;
            double change_n = 0.0;
            for (std::size_t k = 20; k + 20 < late.size(); ++k) {
                const auto seen = [](const Tick& tick) { return Legs(tick.sample->force_n.array()); };
                const Vector6 expected_n = interpolated(filtered, k, 0.4e-3, seen);
                worst_n = std::max(worst_n, (late[k].sample->force_n - expected_n).norm());
                change_n = std::max(change_n, (filtered[k].sample->force_n - expected_n).norm());
            }
            // What the steps of the valves' command leave behind the low-pass is smoother by (50 Hz x
            // tick)^2.
            THEN("the delay comes behind the low-pass") {
                CHECK(worst_n < 2e-3 * change_n);
            }
        }
    }
}

SCENARIO("force gains multiply the force, and biases come on top") {
    GIVEN("six gains and six biases") {
        Scenario scenario = multisine(0.05);
        scenario.sensors.force_gain = (Legs() << 0.99, 1.01, 1.0, 1.02, 0.98, 1.005).finished();
        scenario.sensors.force_bias_n = (Vector6() << 1.0, -2.0, 3.0, 0.0, 5.0, -6.0).finished();
        WHEN("forces are read") {
            const Tick tick = run_of(scenario).back();
            const Vector6 expected =
                (scenario.sensors.force_gain * tick.legs.force_n).matrix() + scenario.sensors.force_bias_n;
            THEN("a reading is gain x force + bias, to float32") {
                CHECK((tick.sample->force_n - expected).cwiseAbs().maxCoeff() < 2e-4);
            }
        }
    }
}

SCENARIO("an encoder counts steps") {
    GIVEN("steps of 5 um") {
        Scenario scenario = multisine(1.0);
        scenario.sensors.displacement_step_m = 5e-6;
        const std::vector<Tick> ticks = run_of(scenario);
        WHEN("readings are compared with the truth") {
            double largest_m = 0.0;
            double squares_m2 = 0.0;
            double off_count = 0.0;
            for (const Tick& tick : ticks) {
                const Legs error_m = tick.sample->displacement_m.array() - tick.legs.displacement_m;
                const Legs counts = tick.sample->displacement_m.array() / 5e-6;
                largest_m = std::max(largest_m, error_m.abs().maxCoeff());
                squares_m2 += error_m.square().sum();
                off_count = std::max(off_count, (counts - counts.round()).abs().maxCoeff());
            }
            const double count = 6.0 * static_cast<double>(ticks.size());
            // float32 of 0.3 m: 1.5e-8 m, 0.003 steps.
            THEN("they are whole steps within half a step of it, evenly spread: step / sqrt(12)") {
                CHECK(off_count < 0.004);
                CHECK(largest_m < 2.5e-6 + 2e-8);
                CHECK(std::abs(std::sqrt(squares_m2 / count) / (5e-6 / std::sqrt(12.0)) - 1.0) < 0.05);
            }
        }
    }
}

SCENARIO("a machine without velocity sensors has none in its log") {
    GIVEN("such a machine, its servo with a derivative part on its sensors") {
        Scenario scenario = multisine(0.05);
        scenario.sensors.velocity_sensor = false;
        scenario.controller.reads_sensors = true;
        scenario.controller.derivative_s_m = 0.01;
        WHEN("a run is written") {
            ScratchFolder scratch;
            const PlatformFile platform = paper_platform();
            Simulator simulator(platform, scenario);
            RunDirectory directory(scratch.path("run"), false);
            directory.write_inputs(scenario);
            bool is_finite = true;
            bool has_velocity = false;
            const RunCounts counts = run(simulator, nullptr, [&](const Tick& tick, const auto&) {
                directory.write(tick);
                is_finite = is_finite && tick.legs.force_n.allFinite();
                has_velocity = has_velocity || !tick.sample->velocity_m_s.array().isNaN().all();
            });
            directory.finish(scenario, platform, simulator, {.counts = counts});
            const std::string log = read_text(scratch.path("run") / "log.csv");
            THEN("the log has displacements and forces") {
                CHECK(log.substr(0, log.find('\n')) == "t,dl1,dl2,dl3,dl4,dl5,dl6,f1,f2,f3,f4,f5,f6");
                CHECK(std::count(log.begin(), log.end(), ',') == 12 * (counts.ticks + 1));
            }
            THEN("samples say so, and the servo goes by the encoders") {
                CHECK_FALSE(has_velocity);
                CHECK(is_finite);
            }
        }
    }
}

SCENARIO("a servo on the estimator's sensors moves with their errors") {
    GIVEN("the paper's motion twice, with seeds of their own") {
        Scenario scenario = load_scenario(scenario_path("paper"));
        scenario.duration_s = 0.5;
        Scenario other = scenario;
        other.seed = scenario.seed + 1;
        WHEN("the servo reads its own transducers") {
            THEN("both move alike") {
                CHECK(run_of(scenario).back().pose.p_m == run_of(other).back().pose.p_m);
            }
        }
        WHEN("it reads the estimator's sensors") {
            scenario.controller.reads_sensors = true;
            other.controller.reads_sensors = true;
            THEN("they differ, by less than the noise of the encoders") {
                const double apart_m =
                    (run_of(scenario).back().pose.p_m - run_of(other).back().pose.p_m).norm();
                CHECK(apart_m > 0.0);
                CHECK(apart_m < 20e-6);
            }
        }
        WHEN("these have no errors") {
            scenario.sensors.noise_scale = 0.0;
            Scenario on_sensors = scenario;
            on_sensors.controller.reads_sensors = true;
            THEN("it moves as on its own, to the rounding of samples: float32 of 0.3 m") {
                CHECK((run_of(scenario).back().pose.p_m - run_of(on_sensors).back().pose.p_m).norm() < 1e-7);
            }
        }
    }
}
