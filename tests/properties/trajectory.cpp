#include "support.hpp"

#include <hexload_sim/kinematics.hpp>
#include <hexload_sim/trajectory.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numbers>

using namespace hexload::sim;
using namespace hexload::sim::test;

namespace {

constexpr double duration_s = 10.0;

MotionLimits paper_limits() {
    return motion_limits(paper_platform().geometry, Scenario{});
}

std::unique_ptr<Trajectory> make(const TrajectorySettings& settings, std::uint64_t seed = 1) {
    return make_trajectory(settings, paper_platform().geometry, paper_limits(), duration_s, seed);
}

// Largest difference between the stated derivatives and central differences over h; the step is chosen so
// that truncation h^2/6 x (2 pi 2.5 Hz)^4 x 0.25 m, for the fastest sine at full amplitude, stays below the
// tolerance.
constexpr double h_s = 1e-5;
constexpr double difference_tolerance = 1e-6;

double derivative_error(const Trajectory& trajectory) {
    double worst = 0.0;
    for (int sample = 1; sample < 1000; ++sample) {
        const double t_s = sample * 0.00987; // meets no corner of the quintics
        const Motion before = trajectory.at(t_s - h_s);
        const Motion here = trajectory.at(t_s);
        const Motion after = trajectory.at(t_s + h_s);
        worst = std::max(worst, ((after.q - before.q) / (2.0 * h_s) - here.rate).cwiseAbs().maxCoeff());
        worst = std::max(
            worst, ((after.rate - before.rate) / (2.0 * h_s) - here.acceleration).cwiseAbs().maxCoeff());
    }
    return worst;
}

struct Extremes {
    double stroke_min_m = 0.0;
    double stroke_max_m = 0.0;
    double leg_speed_m_s = 0.0;
    double speed_sum_m_s = 0.0;
};

// By differences of leg lengths between half ticks, a way of its own.
Extremes extremes_of(const Trajectory& trajectory) {
    const Geometry geometry = paper_platform().geometry;
    Extremes extremes;
    constexpr double step_s = 0.5e-3;
    Legs before_m = leg_displacement(geometry, trajectory.at(0.0).pose()).array();
    for (int sample = 1; sample <= 20000; ++sample) {
        const Legs displacement_m = leg_displacement(geometry, trajectory.at(sample * step_s).pose()).array();
        const Legs speed_m_s = (displacement_m - before_m).abs() / step_s;
        extremes.stroke_min_m = std::min(extremes.stroke_min_m, displacement_m.minCoeff());
        extremes.stroke_max_m = std::max(extremes.stroke_max_m, displacement_m.maxCoeff());
        extremes.leg_speed_m_s = std::max(extremes.leg_speed_m_s, speed_m_s.maxCoeff());
        extremes.speed_sum_m_s = std::max(extremes.speed_sum_m_s, speed_m_s.sum());
        before_m = displacement_m;
    }
    return extremes;
}

void check_inside(const Extremes& extremes, const MotionLimits& limits) {
    // Between two ticks at which the limits hold, an acceleration of 20 m/s^2 adds at most 0.01 m/s and 5 um.
    CHECK(extremes.stroke_min_m >= limits.stroke_min_m - 5e-6);
    CHECK(extremes.stroke_max_m <= limits.stroke_max_m + 5e-6);
    CHECK(extremes.leg_speed_m_s <= limits.leg_speed_m_s + 0.01);
    CHECK(extremes.speed_sum_m_s <= limits.speed_sum_m_s + 6 * 0.01);
}

} // namespace

SCENARIO("the paper's motion is (23)") {
    GIVEN("the defaults") {
        const auto trajectory = make(PaperMotion{});
        WHEN("it is evaluated at any time") {
            double worst = 0.0;
            for (const double t_s : {0.0, 0.1, 0.5, 1.7, 9.99}) {
                const double sine = std::sin(std::numbers::pi * t_s);
                Vector6 expected = Vector6::Zero();
                expected(0) = expected(1) = 0.2 * sine;
                expected(5) = 0.2 * std::numbers::pi / 180.0 * sine;
                worst = std::max(worst, (trajectory->at(t_s).q - expected).norm());
            }
            THEN("x = y = 0.2 sin(pi t) m and rz = 0.2 deg sin(pi t), to rounding") {
                CHECK(worst < 1e-15);
            }
            THEN("it starts with the velocity step of 0.2 pi m/s") {
                CHECK(std::abs(trajectory->at(0.0).rate(0) - 0.2 * std::numbers::pi) < 1e-15);
            }
        }
    }
    GIVEN("a run-in of two seconds") {
        PaperMotion settings;
        settings.run_in_s = 2.0;
        const auto trajectory = make(settings);
        WHEN("it starts") {
            THEN("position, velocity and acceleration are zero") {
                CHECK(trajectory->at(0.0).q.isZero(0.0));
                CHECK(trajectory->at(0.0).rate.isZero(0.0));
                CHECK(trajectory->at(0.0).acceleration.isZero(0.0));
            }
        }
        WHEN("the run-in is over") {
            THEN("it is (23) again") {
                CHECK((trajectory->at(2.3).q - make(PaperMotion{})->at(2.3).q).isZero(0.0));
            }
        }
    }
}

SCENARIO("stated velocities and accelerations are derivatives") {
    GIVEN("each kind of motion") {
        ScratchFolder scratch;
        const auto path =
            scratch.write("motion.csv", "t,x,y,z,roll,pitch,yaw\n0,0,0,0,0,0,0\n5,0.1,0,0,0,0,0\n"
                                        "9,0.1,0.05,0.02,0.1,0,0.1\n10,0,0,0,0,0,0\n");
        PaperMotion run_in;
        run_in.run_in_s = 2.0;
        WHEN("they are differenced") {
            THEN("they agree") {
                CHECK(derivative_error(*make(PaperMotion{})) < difference_tolerance);
                CHECK(derivative_error(*make(run_in)) < difference_tolerance);
                CHECK(derivative_error(*make(MultisineMotion{})) < difference_tolerance);
                CHECK(derivative_error(*make(WorkMotion{})) < difference_tolerance);
                CHECK(derivative_error(*make(FileMotion{path})) < difference_tolerance);
            }
        }
    }
}

SCENARIO("a multisine is the same at ticks, where it goes on by angle sums, as between them") {
    GIVEN("the default multisine, and ticks in an order that meets blocks again") {
        const auto motion = make(MultisineMotion{});
        WHEN("a tick is compared with the mean of two instants a nanosecond to either side") {
            double worst_m = 0.0;
            for (int n = 0; n < 2000; ++n) {
                const double t_s = static_cast<double>(1 + n * 7919 % 60000) * default_tick_s;
                const Motion here = motion->at(t_s);
                const Vector6 mean = 0.5 * (motion->at(t_s - 1e-9).q + motion->at(t_s + 1e-9).q);
                worst_m = std::max(worst_m, (here.q - mean).cwiseAbs().maxCoeff());
            }
            // Rounding of a phase of 2 pi 2.5 Hz 60 s by half of 2^-43, in the tick and in its block's
            // begin, of amplitudes that add up to 0.35 rad at most; the curvature is below 1e-16.
            THEN("they differ by the rounding of the phases") {
                CHECK(worst_m < 2.0 * 0.35 * std::exp2(-43.0));
            }
            THEN("the motion does not depend on what was asked before") {
                const auto fresh = make(MultisineMotion{});
                const Motion asked_first = fresh->at(33.333);
                CHECK(asked_first.q == motion->at(33.333).q);
                CHECK(asked_first.acceleration == motion->at(33.333).acceleration);
            }
        }
    }
}

SCENARIO("seeded motions stay inside stroke, leg speed and flow") {
    GIVEN("multisines and work motions from several seeds") {
        WHEN("their leg lengths are followed") {
            THEN("all limits hold") {
                for (const std::uint64_t seed : {1U, 2U, 3U}) {
                    CAPTURE(seed);
                    check_inside(extremes_of(*make(MultisineMotion{}, seed)), paper_limits());
                    check_inside(extremes_of(*make(WorkMotion{}, seed)), paper_limits());
                }
            }
        }
    }
    GIVEN("a multisine that asks for less than the limits") {
        MultisineMotion settings;
        settings.translation_m = 0.02;
        settings.rotation_deg = 1.0;
        WHEN("it is made") {
            const Extremes extremes = extremes_of(*make(settings));
            THEN("it is not scaled up to them") {
                CHECK(extremes.stroke_max_m < 0.05);
            }
        }
    }
    GIVEN("a pump that delivers almost nothing") {
        MotionLimits limits = paper_limits();
        limits.speed_sum_m_s = 1e-6;
        WHEN("a motion is asked for") {
            THEN("it is refused with the reason") {
                const Geometry geometry = paper_platform().geometry;
                CHECK_THROWS_WITH_AS(make_trajectory(MultisineMotion{}, geometry, limits, duration_s, 1),
                                     doctest::Contains("limits of stroke, leg speed and flow"),
                                     std::runtime_error);
                CHECK_THROWS_WITH_AS(make_trajectory(WorkMotion{}, geometry, limits, duration_s, 1),
                                     doctest::Contains("limits of stroke, leg speed and flow"),
                                     std::runtime_error);
            }
        }
    }
}

SCENARIO("a motion from file passes through its rows and rests outside them") {
    GIVEN("a file of three rows") {
        ScratchFolder scratch;
        const auto path =
            scratch.write("motion.csv", "t,x,y,z,roll,pitch,yaw\n1,0,0,0,0,0,0\n2,0.1,0,0,0,0,0.05\n"
                                        "4,0,0.02,0,0,0,0\n");
        const auto trajectory = make(FileMotion{path});
        WHEN("it is evaluated at, before and after its rows") {
            THEN("it is there") {
                CHECK(std::abs(trajectory->at(2.0).q(0) - 0.1) < 1e-15);
                CHECK(std::abs(trajectory->at(2.0).q(5) - 0.05) < 1e-15);
                CHECK(trajectory->at(0.5).q.isZero(0.0));
                CHECK(trajectory->at(0.5).rate.isZero(0.0));
                CHECK(trajectory->at(9.0).q(1) == 0.02);
                CHECK(trajectory->at(9.0).rate.isZero(0.0));
            }
        }
    }
}
