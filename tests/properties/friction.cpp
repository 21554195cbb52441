#include "support.hpp"

#include <hexload_sim/friction.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

using namespace hexload::sim;
using namespace hexload::sim::test;

namespace {

constexpr double step_s = default_tick_s / 4.0;
const Legs speeds_m_s = (Legs() << -0.5, -0.005, 0.0, 0.005, 0.5, 1.0).finished();

FrictionSettings dry(FrictionLaw law) {
    FrictionSettings settings;
    settings.law = law;
    settings.coulomb_n.setConstant(100.0);
    settings.viscous_n_s_m.setConstant(200.0);
    if (law != FrictionLaw::coulomb) {
        settings.static_n.setConstant(150.0);
    }
    return settings;
}

Legs steady_n(const FrictionSettings& settings, const Legs& force_n = Legs::Zero(), double t_s = 1e9) {
    const Friction friction(settings, step_s);
    return friction.at(speeds_m_s, force_n, Legs::Zero(), friction.coldness(t_s)).force_n;
}

double stribeck_n(double v_m_s, double coulomb_n, double static_n) {
    const double r = v_m_s / FrictionSettings{}.stribeck_speed_m_s;
    return coulomb_n + (static_n - coulomb_n) * std::exp(-r * r);
}

// A rod that is moved as `velocity_m_s` of time says; six legs alike.
struct Rod {
    explicit Rod(const FrictionSettings& settings) : friction(settings, step_s) {}

    // One Runge-Kutta step of the bristles, as the plant takes them.
    template <typename Velocity> void step(Velocity velocity_m_s) {
        const auto rate = [&](double t, const Legs& z) { return at(velocity_m_s(t), z).bristle_rate_m_s; };
        const double h = step_s;
        const Legs k1 = rate(t_s, bristle_m);
        const Legs k2 = rate(t_s + h / 2.0, bristle_m + h / 2.0 * k1);
        const Legs k3 = rate(t_s + h / 2.0, bristle_m + h / 2.0 * k2);
        const Legs k4 = rate(t_s + h, bristle_m + h * k3);
        bristle_m += h / 6.0 * (k1 + k4 + 2.0 * (k2 + k3));
        t_s += h;
    }
    FrictionForce at(double velocity_m_s, const Legs& z) const {
        return friction.at(Legs::Constant(velocity_m_s), Legs::Zero(), z, 1.0);
    }

    Friction friction;
    double t_s = 0.0;
    Legs bristle_m = Legs::Zero();
};

// Friction after a second of sliding.
double sliding_n(double velocity_m_s) {
    Rod rod(dry(FrictionLaw::lugre));
    for (int step = 0; step < 4000; ++step) {
        rod.step([&](double) { return velocity_m_s; });
    }
    return rod.at(velocity_m_s, rod.bristle_m).force_n(0);
}

constexpr double cycle_rad_s = 2.0 * std::numbers::pi * 2.0;

struct Cycle {
    double work_j = 0.0; // on one leg
    double stored_j = 0.0;
    double least_lost_j = 0.0; // lowest of work less stored on the way
    double largest_n = 0.0;
};

// One second to and fro.
Cycle cycle_of(double amplitude_m) {
    FrictionSettings settings = dry(FrictionLaw::lugre);
    settings.viscous_n_s_m.setZero();
    Rod rod(settings);
    const auto velocity = [&](double t_s) { return amplitude_m * cycle_rad_s * std::cos(cycle_rad_s * t_s); };
    const auto force_n = [&] { return rod.at(velocity(rod.t_s), rod.bristle_m).force_n(0); };
    Cycle cycle;
    for (int step = 0; step < 4000; ++step) {
        const double before_w = force_n() * velocity(rod.t_s);
        rod.step(velocity);
        cycle.work_j += step_s / 2.0 * (before_w + force_n() * velocity(rod.t_s));
        cycle.stored_j = rod.friction.stored_j(rod.bristle_m) / 6.0;
        cycle.least_lost_j = std::min(cycle.least_lost_j, cycle.work_j - cycle.stored_j);
        cycle.largest_n = std::max(cycle.largest_n, std::abs(force_n()));
    }
    return cycle;
}

} // namespace

SCENARIO("Coulomb friction opposes the motion") {
    GIVEN("Coulomb and viscous friction") {
        WHEN("legs move both ways and stand still") {
            const Legs friction_n = steady_n(dry(FrictionLaw::coulomb));
            THEN("friction is Coulomb's law smoothed at its speed, plus the viscous part") {
                const double at_corner_n = 100.0 / std::sqrt(2.0) + 1.0;
                CHECK(friction_n(2) == 0.0);
                CHECK(std::abs(friction_n(3) - at_corner_n) < 1e-9);
                CHECK(std::abs(friction_n(1) + at_corner_n) < 1e-9);
                CHECK(std::abs(friction_n(5) - 300.0) < 100.0 * 0.5 * 0.005 * 0.005 * 1.01);
            }
        }
    }
}

SCENARIO("Stribeck friction falls from its breakaway level to Coulomb's") {
    GIVEN("150 N at breakaway and 100 N in full slide") {
        WHEN("legs move at half the Stribeck speed and far above it") {
            const Legs friction_n = steady_n(dry(FrictionLaw::stribeck));
            THEN("friction is the curve's level, smoothed as Coulomb's, plus the viscous part") {
                CHECK(friction_n(2) == 0.0);
                CHECK(std::abs(friction_n(3) - (stribeck_n(0.005, 100.0, 150.0) / std::sqrt(2.0) + 1.0)) <
                      1e-9);
                CHECK(std::abs(friction_n(1) + friction_n(3)) < 1e-9);
                CHECK(std::abs(friction_n(5) - 300.0) < 100.0 * 0.5 * 0.005 * 0.005 * 1.01);
            }
        }
    }
}

SCENARIO("friction grows with the force of the leg, and falls as the leg warms up") {
    GIVEN("dry friction of 100 N and 1 % of the leg's force") {
        FrictionSettings settings = dry(FrictionLaw::coulomb);
        settings.viscous_n_s_m.setZero();
        const Legs unloaded_n = steady_n(settings);
        settings.force_share = 0.01;
        WHEN("legs are pulled or pushed with 5 kN") {
            const Legs pushed_n = steady_n(settings, Legs::Constant(5000.0));
            const Legs pulled_n = steady_n(settings, Legs::Constant(-5000.0));
            THEN("friction is half as high again") {
                CHECK((pushed_n - 1.5 * unloaded_n).abs().maxCoeff() < 1e-9);
                CHECK((pulled_n - pushed_n).abs().maxCoeff() == 0.0);
            }
        }
    }
    GIVEN("legs that rub 1.4 times as much when cold, and warm up in 50 s") {
        FrictionSettings settings = dry(FrictionLaw::stribeck);
        const Legs warm_n = steady_n(settings);
        settings.cold_factor = 1.4;
        settings.warm_up_s = 50.0;
        WHEN("they start, and 50 s later") {
            THEN("friction is 1.4 times and 1 + 0.4 / e times what it is in the end") {
                CHECK((steady_n(settings, Legs::Zero(), 0.0) - 1.4 * warm_n).abs().maxCoeff() < 1e-9);
                CHECK((steady_n(settings, Legs::Zero(), 50.0) - (1.0 + 0.4 / std::numbers::e) * warm_n)
                          .abs()
                          .maxCoeff() < 1e-9);
            }
        }
    }
}

SCENARIO("a rod on bristles gives way like a spring before it slides") {
    GIVEN("bristles of 2 MN/m without damping, and a breakaway level of 150 N") {
        FrictionSettings settings = dry(FrictionLaw::lugre);
        settings.viscous_n_s_m.setZero();
        settings.bristle_damping_n_s_m = 0.0;
        Rod rod(settings);
        WHEN("the rod is moved by 1 um in 0.1 s") {
            for (int step = 0; step < 400; ++step) {
                rod.step([](double) { return 1e-5; });
            }
            // Of x' = z' (1 - stiffness z / g): z = x - stiffness x^2 / (2 g), next term 1 / 6 of the square.
            const double share = 2e6 * 1e-6 / stribeck_n(1e-5, 100.0, 150.0);
            THEN("friction is stiffness times way, less what the bristles slipped") {
                const double spring_n = 2.0 * (1.0 - share / 2.0);
                CHECK(std::abs(rod.at(1e-5, rod.bristle_m).force_n(0) - spring_n) <
                      2.0 * share * share / 6.0 * 1.01);
            }
        }
    }
}

SCENARIO("a rod that slides has the friction of the Stribeck curve, however fast the bristles relax") {
    GIVEN("bristles that relax within a tenth of a step of the integration, or within 300 steps") {
        WHEN("the rod slides for a second at 1 mm/s to 2 m/s") {
            // Slowest: stiffness v / g = 2e6 x 1e-3 / 150 = 13 1/s.
            THEN("friction is the curve's level plus the viscous part, to what e^-13 leaves of the start") {
                for (const double v_m_s : {1e-3, 0.01, 0.1, 0.5, 2.0}) {
                    CAPTURE(v_m_s);
                    const double expected_n = stribeck_n(v_m_s, 100.0, 150.0) + 200.0 * v_m_s;
                    CHECK(std::abs(sliding_n(v_m_s) / expected_n - 1.0) < 2e-6);
                    CHECK(std::abs(sliding_n(-v_m_s) + sliding_n(v_m_s)) < 1e-9);
                }
            }
        }
    }
}

SCENARIO("a rod on bristles takes energy in every cycle and gives none") {
    GIVEN("a rod that is moved to and fro at 2 Hz, without viscous friction") {
        WHEN("its work is compared with the energy of the bristles, step by step") {
            THEN("never more was stored than done, but for the trapezoids of the work; friction keeps its "
                 "level") {
                for (const double amplitude_m : {2e-6, 50e-6, 2e-3}) {
                    CAPTURE(amplitude_m);
                    const Cycle cycle = cycle_of(amplitude_m);
                    const double speed_m_s = cycle_rad_s * amplitude_m;
                    // (w h)^2 / 12 of force times way, 4 amplitudes in each of two cycles.
                    const double step_error_j =
                        std::pow(cycle_rad_s * step_s, 2) / 12.0 * 150.0 * 8.0 * amplitude_m;
                    CHECK(cycle.least_lost_j > -step_error_j);
                    CHECK(cycle.work_j > cycle.stored_j);
                    CHECK(cycle.largest_n < 150.0 + FrictionSettings{}.bristle_damping_n_s_m * speed_m_s);
                }
            }
        }
    }
}
