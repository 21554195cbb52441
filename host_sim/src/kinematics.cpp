#include <hexload_sim/kinematics.hpp>

#include <hexload_sim/linear_solve.hpp>
#include <hexload_sim/rotation.hpp>

#include <Eigen/Geometry>

namespace hexload::sim {
namespace {

constexpr int newton_steps_max = 50;
constexpr int halvings_max = 20;
constexpr double length_tolerance_m =
    1e-12; // thousands of ulp of a 1 m leg, so that rounding cannot stall it

Pose moved(const Pose& pose, const Vector6& step) {
    return {pose.p_m + step.head<3>(), rotation_from_vector(step.tail<3>()) * pose.R};
}

} // namespace

LegVectors leg_vectors(const Geometry& geometry, const Pose& pose) {
    LegVectors legs;
    const Vector3 centre_m = pose.p_m + Vector3(0.0, 0.0, geometry.home_height_m);
    for (int leg = 0; leg < 6; ++leg) {
        const auto i = static_cast<std::size_t>(leg);
        legs.arm_m.col(leg) = pose.R * geometry.platform_hinges_m[i];
        const Vector3 vector_m = centre_m + legs.arm_m.col(leg) - geometry.base_hinges_m[i];
        legs.length_m(leg) = vector_m.norm();
        legs.direction.col(leg) = vector_m / legs.length_m(leg);
    }
    return legs;
}

Vector6 leg_displacement(const Geometry& geometry, const Pose& pose) {
    return leg_vectors(geometry, pose).length_m - geometry.home_leg_length_m;
}

Matrix6 jacobian(const LegVectors& legs) {
    Matrix6 J;
    for (int leg = 0; leg < 6; ++leg) {
        const Vector3 e = legs.direction.col(leg);
        const Vector3 arm_m = legs.arm_m.col(leg);
        J.row(leg) << e.transpose(), arm_m.cross(e).transpose();
    }
    return J;
}

Matrix6 jacobian(const Geometry& geometry, const Pose& pose) {
    return jacobian(leg_vectors(geometry, pose));
}

Vector6 leg_velocity(const Geometry& geometry, const Pose& pose, const Twist& twist) {
    return jacobian(geometry, pose) * twist.stacked();
}

Vector6 leg_acceleration_bias(const LegVectors& legs, const Twist& twist) {
    Vector6 bias;
    for (int leg = 0; leg < 6; ++leg) {
        const Vector3 e = legs.direction.col(leg);
        const Vector3 swing = twist.w_rad_s.cross(legs.arm_m.col(leg));
        const Vector3 hinge_velocity = twist.v_m_s + swing;
        const double along = e.dot(hinge_velocity);
        // d/dt (e . u) at constant twist: centripetal part of the hinge, and the turning of e.
        bias(leg) = e.dot(twist.w_rad_s.cross(swing)) +
                    (hinge_velocity.squaredNorm() - along * along) / legs.length_m(leg);
    }
    return bias;
}

std::optional<Pose> forward_kinematics(const Geometry& geometry, const Vector6& displacement_m,
                                       const Pose& guess) {
    Pose pose = guess;
    const auto error_of = [&](const Pose& candidate) -> Vector6 {
        return displacement_m - leg_displacement(geometry, candidate);
    };
    Vector6 error_m = error_of(pose);
    for (int step_count = 0; step_count < newton_steps_max; ++step_count) {
        if (error_m.cwiseAbs().maxCoeff() < length_tolerance_m) {
            return pose;
        }
        Vector6 step = solve(jacobian(geometry, pose), error_m);
        bool improved = false;
        for (int halving = 0; halving < halvings_max && !improved; ++halving, step *= 0.5) {
            const Pose candidate = moved(pose, step);
            const Vector6 candidate_error_m = error_of(candidate);
            if (candidate_error_m.norm() < error_m.norm()) {
                pose = candidate;
                error_m = candidate_error_m;
                improved = true;
            }
        }
        if (!improved) {
            return std::nullopt;
        }
    }
    return std::nullopt;
}

} // namespace hexload::sim
