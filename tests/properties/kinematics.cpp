#include "support.hpp"

#include <hexload_sim/kinematics.hpp>
#include <hexload_sim/rotation.hpp>

#include <algorithm>

using namespace hexload::sim;
using namespace hexload::sim::test;

namespace {

constexpr int states = 200;

// Central differences over h: truncation h^2/6 |d^3 L/dt^3|, the third derivative below 100 m/s^3 for 1 m/s
// and 1 rad/s on legs of 0.3 m or more, gives 2e-9; rounding 2^-53 L / h gives 1e-11.
constexpr double h_s = 1e-5;
constexpr double difference_tolerance = 1e-8;

// Largest entry of error(pose, twist) over random states of both platforms.
template <typename Error> double worst_of(Error error) {
    double worst = 0.0;
    for (const PlatformFile& platform : {paper_platform(), small_platform()}) {
        RandomStates random(1);
        for (int state = 0; state < states; ++state) {
            const Pose pose = random.pose(platform.geometry);
            worst = std::max(worst, error(platform.geometry, pose, random.twist()).cwiseAbs().maxCoeff());
        }
    }
    return worst;
}

} // namespace

SCENARIO("home is where the mean leg has its home length") {
    GIVEN("the paper's platform and a small one") {
        const Geometry paper = paper_platform().geometry;
        const Geometry small = small_platform().geometry;
        WHEN("they stand at home") {
            const double paper_mean_m = leg_displacement(paper, Pose{}).mean();
            const double small_mean_m = leg_displacement(small, Pose{}).mean();
            THEN("the mean displacement is zero, to some rounding of the length") {
                CHECK(std::abs(paper_mean_m) < 1e-15);
                CHECK(std::abs(small_mean_m) < 1e-15);
            }
            THEN("the paper's platform is 0.798276 m high") {
                CHECK(std::abs(paper.home_height_m - 0.798276) < 0.5e-6);
            }
        }
    }
}

SCENARIO("the Jacobian is the derivative of the leg lengths") {
    GIVEN("random poses and twists") {
        WHEN("leg lengths are differenced along the motion") {
            const double worst_m_s =
                worst_of([](const Geometry& geometry, const Pose& pose, const Twist& twist) {
                    return Vector6((leg_displacement(geometry, moved(pose, twist, h_s)) -
                                    leg_displacement(geometry, moved(pose, twist, -h_s))) /
                                       (2.0 * h_s) -
                                   jacobian(geometry, pose) * twist.stacked());
                });
            THEN("they change as J V says") {
                CHECK(worst_m_s < difference_tolerance);
            }
        }
    }
}

SCENARIO("the acceleration bias is the derivative of J V at constant twist") {
    GIVEN("random poses and twists") {
        WHEN("leg velocities are differenced along the motion") {
            const double worst_m_s2 =
                worst_of([](const Geometry& geometry, const Pose& pose, const Twist& twist) {
                    return Vector6((leg_velocity(geometry, moved(pose, twist, h_s), twist) -
                                    leg_velocity(geometry, moved(pose, twist, -h_s), twist)) /
                                       (2.0 * h_s) -
                                   leg_acceleration_bias(leg_vectors(geometry, pose), twist));
                });
            THEN("they change as the bias says") {
                CHECK(worst_m_s2 < 10.0 * difference_tolerance); // a derivative higher: some 10 1/s more
            }
        }
    }
}

SCENARIO("forward kinematics inverts inverse kinematics") {
    GIVEN("random poses in the workspace") {
        WHEN("the pose is recovered from its leg displacements, starting from home") {
            const double worst = worst_of([](const Geometry& geometry, const Pose& pose, const Twist&) {
                const auto found = forward_kinematics(geometry, leg_displacement(geometry, pose));
                REQUIRE(found.has_value());
                Vector6 error;
                error << found->p_m - pose.p_m, rpy_from_rotation(found->R * pose.R.transpose());
                return error;
            });
            THEN("it is the same pose, to the length tolerance of 1e-12 m times |J^-1| < 100") {
                CHECK(worst < 1e-10);
            }
        }
    }
}

SCENARIO("forward kinematics reports leg lengths that no pose has") {
    GIVEN("one leg far longer than its neighbours allow") {
        Vector6 displacement_m = Vector6::Zero();
        displacement_m(0) = 2.0;
        WHEN("its pose is asked for") {
            const auto found = forward_kinematics(paper_platform().geometry, displacement_m);
            THEN("there is none") {
                CHECK_FALSE(found.has_value());
            }
        }
    }
}

SCENARIO("roll, pitch and yaw rates give the angular velocity") {
    GIVEN("random angles and rates") {
        RandomStates random(2);
        double worst_rad_s = 0.0;
        for (int state = 0; state < states; ++state) {
            const Vector3 rpy = random.vector3(1.0);
            const Vector3 rate = random.vector3(1.0);
            const Matrix3 R_rate =
                (rotation_from_rpy(rpy + h_s * rate) - rotation_from_rpy(rpy - h_s * rate)) / (2.0 * h_s);
            const Matrix3 spin = R_rate * rotation_from_rpy(rpy).transpose();
            const Vector3 error =
                Vector3(spin(2, 1), spin(0, 2), spin(1, 0)) - rpy_rate_to_angular_velocity(rpy) * rate;
            worst_rad_s = std::max(worst_rad_s, error.cwiseAbs().maxCoeff());
        }
        THEN("R' R^T is its cross-product matrix") {
            CHECK(worst_rad_s < difference_tolerance);
        }
        THEN("angles survive the way through R") {
            const Vector3 rpy(0.3, -0.8, 2.0);
            CHECK((rpy_from_rotation(rotation_from_rpy(rpy)) - rpy).norm() < 1e-14);
        }
    }
}
