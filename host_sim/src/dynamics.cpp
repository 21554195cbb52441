#include <hexload_sim/dynamics.hpp>

#include <hexload_sim/linear_solve.hpp>
#include <hexload_sim/rotation.hpp>

#include <Eigen/Geometry>

namespace hexload::sim {

Matrix6 mass_matrix(const MassProperties& body, const Matrix3& R) {
    const Matrix3 Q = skew(R * body.first_moment_kg_m); // m_l [l]x of (8), with l from (21)
    Matrix6 M;
    M << body.mass_kg * Matrix3::Identity(), -Q,   //
        Q, R * body.inertia_kg_m2 * R.transpose(); // (20)
    return M;
}

Matrix6 coupling_matrix(const MassProperties& body, const Matrix3& R) {
    Matrix6 M = mass_matrix(body, R);
    M.diagonal().setZero();
    return M;
}

Vector6 bias_wrench(const MassProperties& body, const Matrix3& R, const Vector3& w_rad_s) {
    const Vector3 first_moment = R * body.first_moment_kg_m;
    const Vector3 spin = R * (body.inertia_kg_m2 * (R.transpose() * w_rad_s));
    Vector6 wrench;
    wrench << w_rad_s.cross(w_rad_s.cross(first_moment)), w_rad_s.cross(spin);
    return wrench;
}

Vector6 gravity_wrench(const MassProperties& body, const Matrix3& R, const Gravity& gravity) {
    const Vector3& up = gravity.up_m_s2;
    Vector6 wrench;
    wrench << body.mass_kg * up, (R * body.first_moment_kg_m).cross(up);
    return wrench;
}

Vector6 acceleration(const Geometry& geometry, const MassProperties& body, const Gravity& gravity,
                     const Pose& pose, const Twist& twist, const Vector6& leg_force_n) {
    const Vector6 net = jacobian(geometry, pose).transpose() * leg_force_n -
                        bias_wrench(body, pose.R, twist.w_rad_s) - gravity_wrench(body, pose.R, gravity);
    return solve(mass_matrix(body, pose.R), net);
}

Vector6 leg_forces(const Geometry& geometry, const MassProperties& body, const Gravity& gravity,
                   const Pose& pose, const Twist& twist, const Vector6& twist_rate) {
    const Vector6 wrench = mass_matrix(body, pose.R) * twist_rate + bias_wrench(body, pose.R, twist.w_rad_s) +
                           gravity_wrench(body, pose.R, gravity);
    return solve(jacobian(geometry, pose).transpose(), wrench);
}

JointSpaceModel joint_space_model(const Geometry& geometry, const MassProperties& body,
                                  const Gravity& gravity, const Pose& pose, const Twist& twist) {
    const LegVectors legs = leg_vectors(geometry, pose);
    const Matrix6 J_inverse = solve_columns(jacobian(legs), Matrix6::Identity());
    const Matrix6 M = mass_matrix(body, pose.R);
    // V' = J^-1 (l'' - J' V), so d(J^-1)/dt l' = -J^-1 J' V.
    const Vector6 drift = -J_inverse * leg_acceleration_bias(legs, twist);
    return {J_inverse.transpose() * M * J_inverse,
            J_inverse.transpose() * (M * drift + bias_wrench(body, pose.R, twist.w_rad_s)),
            J_inverse.transpose() * gravity_wrench(body, pose.R, gravity)};
}

double kinetic_energy_j(const MassProperties& body, const Matrix3& R, const Twist& twist) {
    const Vector6 V = twist.stacked();
    return 0.5 * V.dot(mass_matrix(body, R) * V);
}

double potential_energy_j(const MassProperties& body, const Gravity& gravity, const Pose& pose) {
    const Vector3 com_shift = pose.R * body.first_moment_kg_m - body.first_moment_kg_m; // m times metres
    return gravity.up_m_s2.dot(body.mass_kg * pose.p_m + com_shift);
}

} // namespace hexload::sim
