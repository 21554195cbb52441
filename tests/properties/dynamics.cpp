#include "support.hpp"

#include <hexload_sim/dynamics.hpp>
#include <hexload_sim/rotation.hpp>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include <algorithm>
#include <vector>

using namespace hexload::sim;
using namespace hexload::sim::test;

namespace {

constexpr int states = 200;

// Solving twice with matrices whose condition is below 1e5 loses five of sixteen digits.
constexpr double solve_tolerance = 1e-10;

// Central differences over h of functions with relative third derivatives below 100 1/s^3: 2e-9, plus
// rounding 2^-53 / h = 1e-11.
constexpr double h_s = 1e-5;
constexpr double difference_tolerance = 1e-8;

struct State {
    PlatformFile platform;
    MassProperties body;
    Pose pose;
    Twist twist;
    Vector6 force_n;
};

// Random states of both platforms, with loads from none to many times the platform.
std::vector<State> random_states() {
    std::vector<State> result;
    for (const PlatformFile& platform : {paper_platform(), small_platform()}) {
        RandomStates random(1);
        for (int state = 0; state < states; ++state) {
            const double mass_kg =
                state % 10 == 0 ? 0.0 : random.uniform(0.0, 15.0) * platform.platform.mass_kg;
            result.push_back({platform, loaded(platform, eccentric_load(mass_kg)),
                              random.pose(platform.geometry), random.twist(),
                              random.vector6(20.0 * mass_kg + 1000.0)});
        }
    }
    return result;
}

template <typename Error> double worst_of(Error error) {
    double worst = 0.0;
    for (const State& state : random_states()) {
        worst = std::max(worst, static_cast<double>(error(state)));
    }
    return worst;
}

double relative(const Eigen::VectorXd& value, const Eigen::VectorXd& expected) {
    return (value - expected).norm() / expected.norm();
}

} // namespace

SCENARIO("the mass matrix is that of the particles a body is made of") {
    GIVEN("a load of eight particles, and its mass, centre and tensor") {
        RandomStates random(3);
        std::vector<Vector3> particles_m;
        MassProperties body;
        constexpr double particle_kg = 7.0;
        for (int particle = 0; particle < 8; ++particle) {
            particles_m.push_back(random.vector3(0.5));
            const Vector3& r = particles_m.back();
            body = body + MassProperties{particle_kg, particle_kg * r, parallel_axis(particle_kg, r)};
        }
        const Pose pose{random.vector3(0.1), rotation_from_rpy(random.vector3(0.3))};
        const Twist twist = random.twist();
        WHEN("each particle moves with the platform") {
            double kinetic_j = 0.0;
            Vector6 gravity = Vector6::Zero();
            for (const Vector3& particle_m : particles_m) {
                const Vector3 arm_m = pose.R * particle_m;
                const Vector3 weight_n(0.0, 0.0, 9.81 * particle_kg);
                kinetic_j += 0.5 * particle_kg * (twist.v_m_s + twist.w_rad_s.cross(arm_m)).squaredNorm();
                gravity += (Vector6() << weight_n, arm_m.cross(weight_n)).finished();
            }
            THEN("their kinetic energies add up to V^T M V / 2, to rounding") {
                CHECK(std::abs(kinetic_energy_j(body, pose.R, twist) / kinetic_j - 1.0) < 1e-13);
            }
            THEN("their weights add up to the gravity wrench, to rounding") {
                CHECK(relative(gravity_wrench(body, pose.R, 9.81), gravity) < 1e-13);
            }
        }
    }
}

SCENARIO("the mass matrix is symmetric and positive definite") {
    GIVEN("random states and loads") {
        WHEN("its mirror image and its eigenvalues are looked at") {
            const double asymmetry = worst_of([](const State& s) {
                const Matrix6 M = mass_matrix(s.body, s.pose.R);
                return (M - M.transpose()).norm() / M.norm();
            });
            const double worst_negative = worst_of([](const State& s) {
                const Matrix6 M = mass_matrix(s.body, s.pose.R);
                return -Eigen::SelfAdjointEigenSolver<Matrix6>(M).eigenvalues().minCoeff() / M.norm() + 1.0;
            });
            THEN("it is symmetric to rounding") {
                CHECK(asymmetry < 1e-15);
            }
            THEN("its eigenvalues are positive") {
                CHECK(worst_negative < 1.0);
            }
        }
    }
}

SCENARIO("the coupling matrix of a load above the platform centre is (19)") {
    GIVEN("the paper's load: m_l l_z = 150 kg m") {
        const MassProperties body = loaded(paper_platform(), paper_load());
        WHEN("the platform is level") {
            const Matrix6 coupling = coupling_matrix(body, Matrix3::Identity());
            THEN("only x-pitch and y-roll are coupled, with the signs of (19)") {
                Matrix6 expected = Matrix6::Zero();
                expected(0, 4) = expected(4, 0) = 150.0;
                expected(1, 3) = expected(3, 1) = -150.0;
                CHECK((coupling - expected).norm() < 1e-12);
            }
        }
    }
}

SCENARIO("the gravity wrench is the gradient of the potential energy") {
    GIVEN("random states and loads") {
        WHEN("the potential energy is differenced along the motion") {
            const double worst = worst_of([](const State& s) {
                const double g = s.platform.gravity_m_s2;
                const double power_w = (potential_energy_j(s.body, g, moved(s.pose, s.twist, h_s)) -
                                        potential_energy_j(s.body, g, moved(s.pose, s.twist, -h_s))) /
                                       (2.0 * h_s);
                const Vector6 G = gravity_wrench(s.body, s.pose.R, g);
                return std::abs(power_w - G.dot(s.twist.stacked())) / G.norm();
            });
            THEN("it changes as G V says") {
                CHECK(worst < difference_tolerance);
            }
        }
    }
}

SCENARIO("the bias wrench is what a constant twist needs") {
    GIVEN("random states and loads") {
        WHEN("momentum about O_A is differenced along a motion of constant twist") {
            const double worst = worst_of([](const State& s) {
                const Vector6 V = s.twist.stacked();
                const auto momentum = [&](double t_s) {
                    return Vector6(mass_matrix(s.body, moved(s.pose, s.twist, t_s).R) * V);
                };
                Vector6 wrench = (momentum(h_s) - momentum(-h_s)) / (2.0 * h_s);
                // Euler's law about a moving point: the moment also turns the linear momentum.
                wrench.tail<3>() += s.twist.v_m_s.cross(Vector3(momentum(0.0).head<3>()));
                const Vector6 bias = bias_wrench(s.body, s.pose.R, s.twist.w_rad_s);
                return (wrench - bias).norm() / momentum(0.0).norm();
            });
            THEN("it changes as the bias says") {
                CHECK(worst < difference_tolerance);
            }
        }
    }
}

SCENARIO("inverse dynamics inverts forward dynamics") {
    GIVEN("random states, loads and leg forces") {
        WHEN("the forces are recovered from the acceleration that they cause") {
            const double worst = worst_of([](const State& s) {
                const double g = s.platform.gravity_m_s2;
                const Vector6 V_rate =
                    acceleration(s.platform.geometry, s.body, g, s.pose, s.twist, s.force_n);
                return relative(leg_forces(s.platform.geometry, s.body, g, s.pose, s.twist, V_rate),
                                s.force_n);
            });
            THEN("they are the same") {
                CHECK(worst < solve_tolerance);
            }
        }
    }
}

SCENARIO("joint space and task space give the same leg forces") {
    GIVEN("random states, loads and accelerations") {
        WHEN("(13) is evaluated at the leg accelerations of the task-space motion") {
            const double worst = worst_of([](const State& s) {
                const Geometry& geometry = s.platform.geometry;
                const double g = s.platform.gravity_m_s2;
                const Vector6 V_rate = acceleration(geometry, s.body, g, s.pose, s.twist, s.force_n);
                const LegVectors legs = leg_vectors(geometry, s.pose);
                const Vector6 leg_acceleration =
                    jacobian(legs) * V_rate + leg_acceleration_bias(legs, s.twist);
                const JointSpaceModel joint = joint_space_model(geometry, s.body, g, s.pose, s.twist);
                return relative(joint.mass_kg * leg_acceleration + joint.bias_n + joint.gravity_n, s.force_n);
            });
            THEN("they are those of (11) and (12)") {
                CHECK(worst < solve_tolerance);
            }
        }
        WHEN("leg power and wrench power are compared") {
            const double worst = worst_of([](const State& s) {
                const Matrix6 J = jacobian(s.platform.geometry, s.pose);
                const double legs_w = s.force_n.dot(leg_velocity(s.platform.geometry, s.pose, s.twist));
                const double wrench_w = (J.transpose() * s.force_n).dot(s.twist.stacked());
                return std::abs(legs_w - wrench_w) / s.force_n.norm();
            });
            THEN("they are equal to rounding") {
                CHECK(worst < 1e-14);
            }
        }
    }
}

SCENARIO("theta describes the load about the platform centre") {
    GIVEN("the paper's load") {
        WHEN("it is written as ten parameters") {
            const auto theta = paper_load().theta();
            THEN("the tensor carries the parallel-axis term: 25 + 500 x 0.3^2 = 70 kg m^2") {
                Eigen::Matrix<double, 10, 1> expected;
                expected << 500.0, 0.0, 0.0, 150.0, 70.0, 70.0, 25.0, 0.0, 0.0, 0.0;
                CHECK((theta - expected).norm() < 1e-12);
            }
        }
    }
}
