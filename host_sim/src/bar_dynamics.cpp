#include <hexload_sim/bar_dynamics.hpp>

#include <hexload_sim/rotation.hpp>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace hexload::sim {
namespace {

// Of a symmetric matrix, by its cofactors.
Matrix3 inverse_of(const Matrix3& A) {
    const double xx = A(1, 1) * A(2, 2) - A(1, 2) * A(1, 2);
    const double xy = A(0, 2) * A(1, 2) - A(0, 1) * A(2, 2);
    const double xz = A(0, 1) * A(1, 2) - A(0, 2) * A(1, 1);
    const double yy = A(0, 0) * A(2, 2) - A(0, 2) * A(0, 2);
    const double yz = A(0, 1) * A(0, 2) - A(0, 0) * A(1, 2);
    const double zz = A(0, 0) * A(1, 1) - A(0, 1) * A(0, 1);
    const double scale = 1.0 / (A(0, 0) * xx + A(0, 1) * xy + A(0, 2) * xz);
    Matrix3 inverse;
    inverse << scale * xx, scale * xy, scale * xz, //
        scale * xy, scale * yy, scale * yz,        //
        scale * xz, scale * yz, scale * zz;
    return inverse;
}

} // namespace

BarDynamics::BarDynamics(const Geometry& geometry, const SixLegBars& bars, double reflected_kg)
    : have_mass_(bars.have_mass() || reflected_kg > 0.0), rod_kg_(bars.rod_mass_kg),
      along_kg_(rod_kg_ + reflected_kg), rod_centre_m_(bars.rod_length_m / 2.0),
      fixed_kg_m2_(bars.cylinder_mass_kg * bars.cylinder_length_m.square() / 3.0 +
                   bars.rod_mass_kg * bars.rod_length_m.square() / 12.0),
      turning_kg_m_((bars.cylinder_mass_kg * bars.cylinder_length_m - bars.rod_mass_kg * bars.rod_length_m) /
                    2.0) {
    for (int leg = 0; leg < 6; ++leg) {
        const Vector3& arm_m = geometry.platform_hinges_m[static_cast<std::size_t>(leg)];
        const Matrix3 square_m2 = arm_m.squaredNorm() * Matrix3::Identity() - arm_m * arm_m.transpose();
        for (int axis = 0; axis < 3; ++axis) {
            arm_m_[static_cast<std::size_t>(axis)](leg) = arm_m(axis);
        }
        arm_square_m2_(leg) = arm_m.squaredNorm();
        of_hinge_.col(leg) << 1.0, arm_m, square_m2.diagonal(), square_m2(0, 1), square_m2(0, 2),
            square_m2(1, 2);
    }
}

BarDynamics::HingeMasses BarDynamics::at_hinges(const Legs& kg) const {
    const Eigen::Matrix<double, 10, 1> sum = of_hinge_ * kg.matrix();
    return {sum(0), sum.segment<3>(1),
            (Matrix3() << sum(4), sum(7), sum(8), //
             sum(7), sum(5), sum(9),              //
             sum(8), sum(9), sum(6))
                .finished()};
}

// Sum over the legs of X^T (mu E + (m_r + reflected - mu) e e^T) X, X = [E, -[a]x]: masses mu at the hinges,
// and the rest along the legs.
BarPosture BarDynamics::at(const MassProperties& body, const LegRows& legs, const Vector3& up_m_s2) const {
    const Legs inverse_length = legs.length_m.inverse();
    const Legs rod_arm_m = legs.length_m - rod_centre_m_;
    const Legs mu = (fixed_kg_m2_ + rod_kg_ * rod_arm_m.square()) * inverse_length.square();
    const HingeMasses across = at_hinges(mu);
    const Legs turning_kg = turning_kg_m_ * inverse_length;
    const HingeMasses hanging = at_hinges(rod_kg_ + turning_kg);

    BarPosture posture;
    posture.first_moment_kg_m = body.first_moment_kg_m + across.first_moment_kg_m;
    posture.inertia_kg_m2 = body.inertia_kg_m2 + across.inertia_kg_m2;
    posture.weight = {(body.mass_kg + hanging.kg) * up_m_s2,
                      (body.first_moment_kg_m + hanging.first_moment_kg_m).cross(up_m_s2)};
    posture.extra_kg = along_kg_ - mu;
    const auto& [a_x, a_y, a_z] = arm_m_;
    posture.extra_arm_kg_m = posture.extra_kg * (legs.e_x * a_x + legs.e_y * a_y + legs.e_z * a_z);
    posture.slope_kg_m = 2.0 * (rod_kg_ * rod_arm_m * inverse_length - mu) * inverse_length;
    posture.across_kg_m = posture.extra_kg * inverse_length - 0.5 * posture.slope_kg_m;
    posture.weight_n =
        turning_kg * (up_m_s2.x() * legs.e_x + up_m_s2.y() * legs.e_y + up_m_s2.z() * legs.e_z);

    RigidMass mass{(body.mass_kg + across.kg) * Matrix3::Identity(), -skew(posture.first_moment_kg_m),
                   posture.inertia_kg_m2};
    add_along(posture.extra_kg, legs, mass);
    posture.inverse = InverseMass(mass);
    return posture;
}

// e^T X is the leg's row of J.
void BarDynamics::add_along(const Legs& extra_kg, const LegRows& legs, RigidMass& mass) {
    const auto sum = [](const Legs& a, const Legs& b) { return (a * b).sum(); };
    const Legs x = extra_kg * legs.e_x;
    const Legs y = extra_kg * legs.e_y;
    const Legs z = extra_kg * legs.e_z;
    const double xy = sum(x, legs.e_y);
    const double xz = sum(x, legs.e_z);
    const double yz = sum(y, legs.e_z);
    mass.linear += (Matrix3() << sum(x, legs.e_x), xy, xz, //
                    xy, sum(y, legs.e_y), yz,              //
                    xz, yz, sum(z, legs.e_z))
                       .finished();
    mass.coupling += (Matrix3() << sum(x, legs.m_x), sum(x, legs.m_y), sum(x, legs.m_z), //
                      sum(y, legs.m_x), sum(y, legs.m_y), sum(y, legs.m_z),              //
                      sum(z, legs.m_x), sum(z, legs.m_y), sum(z, legs.m_z))
                         .finished();
    const Legs m_x = extra_kg * legs.m_x;
    const Legs m_y = extra_kg * legs.m_y;
    const double I_xy = sum(m_x, legs.m_y);
    const double I_xz = sum(m_x, legs.m_z);
    const double I_yz = sum(m_y, legs.m_z);
    mass.angular += (Matrix3() << sum(m_x, legs.m_x), I_xy, I_xz, //
                     I_xy, sum(m_y, legs.m_y), I_yz,              //
                     I_xz, I_yz, sum(extra_kg * legs.m_z, legs.m_z))
                        .finished();
}

// hinge_load of the six legs, sorted by direction: what a hinge takes is
//
//     along e + slope l' u + mu w x (w x a) + (m_r + turning / l) up
//     along = extra e (w x (w x a)) + (extra / l - slope / 2) (u^2 - l'^2) - slope l'^2 - turning up e / l
//
// u = v + w x a. What a factor s of u sums up to is that of masses at the hinges: s v + w x s a, and the
// moment s a x v + s (a^2 E - a a^T) w.
RigidWrench BarDynamics::driving(const BarPosture& at, const LegRows& legs, const PlatformMotion& motion,
                                 const Legs& force_n) const {
    const Vector3& v = motion.v_m_s;
    const Vector3& w = motion.w_rad_s;
    const auto& [a_x, a_y, a_z] = arm_m_;
    const Legs w_along_a = w.x() * a_x + w.y() * a_y + w.z() * a_z;
    const Legs w_along_e = w.x() * legs.e_x + w.y() * legs.e_y + w.z() * legs.e_z;
    const double w_square = w.squaredNorm();
    const Vector3 v_w = 2.0 * v.cross(w);
    const Legs u_square = v.squaredNorm() + v_w.x() * a_x + v_w.y() * a_y + v_w.z() * a_z +
                          w_square * arm_square_m2_ - w_along_a.square();
    const Legs rate_square = legs.velocity_m_s.square();
    const Legs along_n = at.extra_kg * w_along_e * w_along_a - w_square * at.extra_arm_kg_m +
                         at.across_kg_m * (u_square - rate_square) - at.slope_kg_m * rate_square -
                         at.weight_n;
    const HingeMasses slope = at_hinges(at.slope_kg_m * legs.velocity_m_s); // in kg/s

    const Legs f = force_n - along_n;
    const Vector3 force((f * legs.e_x).sum(), (f * legs.e_y).sum(), (f * legs.e_z).sum());
    const Vector3 moment((f * legs.m_x).sum(), (f * legs.m_y).sum(), (f * legs.m_z).sum());
    return {force - at.weight.force_n - slope.kg * v -
                w.cross(w.cross(at.first_moment_kg_m) + slope.first_moment_kg_m),
            moment - at.weight.moment_n_m - w.cross(at.inertia_kg_m2 * w) - slope.first_moment_kg_m.cross(v) -
                slope.inertia_kg_m2 * w};
}

InverseMass::InverseMass(const RigidMass& mass)
    : linear(inverse_of(mass.linear)), carried(linear * mass.coupling),
      angular(inverse_of(mass.angular - mass.coupling.transpose() * carried)) {}

Vector6 InverseMass::acceleration(const RigidWrench& wrench) const {
    const Vector3 w_rate = angular * (wrench.moment_n_m - carried.transpose() * wrench.force_n);
    Vector6 rate;
    rate << linear * wrench.force_n - carried * w_rate, w_rate;
    return rate;
}

} // namespace hexload::sim
