#include <hexload_sim/bar_dynamics.hpp>

#include <hexload_sim/rotation.hpp>

#include <Eigen/Core>

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
            const auto i = static_cast<std::size_t>(axis);
            arm_m_[i](leg) = arm_m(axis);
            arm_square_m2_[i](leg) = square_m2(axis, axis);
        }
        arm_square_m2_[3](leg) = square_m2(0, 1);
        arm_square_m2_[4](leg) = square_m2(0, 2);
        arm_square_m2_[5](leg) = square_m2(1, 2);
    }
}

Legs BarDynamics::across_kg(const LegRows& legs) const {
    return (fixed_kg_m2_ + rod_kg_ * (legs.length_m - rod_centre_m_).square()) / legs.length_m.square();
}

// hinge_load of the six legs, sorted by direction: what a hinge takes is
//
//     along e + slope l' u + mu w x (w x a) + (m_r + turning / l) up
void BarDynamics::add_bias(const LegRows& legs, const PlatformMotion& motion, RigidBias& bias) const {
    const Vector3& w = motion.w_rad_s;
    const Vector3& up = motion.up_m_s2;
    const auto& [a_x, a_y, a_z] = arm_m_;
    const Legs inverse_length = legs.length_m.inverse();
    const Legs mu = across_kg(legs);
    const Legs slope = 2.0 * (rod_kg_ * (1.0 - rod_centre_m_ * inverse_length) - mu) * inverse_length;

    const Legs u_x = motion.v_m_s.x() + w.y() * a_z - w.z() * a_y;
    const Legs u_y = motion.v_m_s.y() + w.z() * a_x - w.x() * a_z;
    const Legs u_z = motion.v_m_s.z() + w.x() * a_y - w.y() * a_x;
    const Legs w_along_a = w.x() * a_x + w.y() * a_y + w.z() * a_z;
    const double w_square = w.squaredNorm();
    const Legs s_x = w.x() * w_along_a - w_square * a_x;
    const Legs s_y = w.y() * w_along_a - w_square * a_y;
    const Legs s_z = w.z() * w_along_a - w_square * a_z;

    const Legs rate = legs.velocity_m_s;
    const Legs across_square = u_x.square() + u_y.square() + u_z.square() - rate.square();
    const Legs turning_n = turning_kg_m_ * inverse_length;
    const Legs extra_kg = along_kg_ - mu;
    const Legs along_n =
        extra_kg * (legs.e_x * s_x + legs.e_y * s_y + legs.e_z * s_z + across_square * inverse_length) -
        slope * (0.5 * across_square + rate.square()) -
        turning_n * (up.x() * legs.e_x + up.y() * legs.e_y + up.z() * legs.e_z);
    const Legs slope_n = slope * rate;
    const Legs weight_kg = rod_kg_ + turning_n;
    const Legs f_x = along_n * legs.e_x + slope_n * u_x + mu * s_x + up.x() * weight_kg;
    const Legs f_y = along_n * legs.e_y + slope_n * u_y + mu * s_y + up.y() * weight_kg;
    const Legs f_z = along_n * legs.e_z + slope_n * u_z + mu * s_z + up.z() * weight_kg;
    bias.force_n += Vector3(f_x.sum(), f_y.sum(), f_z.sum());
    bias.moment_n_m += Vector3((a_y * f_z - a_z * f_y).sum(), (a_z * f_x - a_x * f_z).sum(), //
                               (a_x * f_y - a_y * f_x).sum());
}

// Sum of X^T (mu E + (m_r + reflected - mu) e e^T) X over the legs, X = [E, -[a]x]: e^T X is the leg's row of
// J.
void BarDynamics::add_mass(const LegRows& legs, RigidMass& mass) const {
    const Legs mu = across_kg(legs);
    const Legs extra_kg = along_kg_ - mu;
    const Legs x = extra_kg * legs.e_x;
    const Legs y = extra_kg * legs.e_y;
    const Legs z = extra_kg * legs.e_z;
    const auto sum = [](const Legs& a, const Legs& b) { return (a * b).sum(); };
    const double xy = sum(x, legs.e_y);
    const double xz = sum(x, legs.e_z);
    const double yz = sum(y, legs.e_z);
    const double kg = mu.sum();
    mass.linear += (Matrix3() << kg + sum(x, legs.e_x), xy, xz, //
                    xy, kg + sum(y, legs.e_y), yz,              //
                    xz, yz, kg + sum(z, legs.e_z))
                       .finished();
    const Vector3 moment_kg_m(sum(mu, arm_m_[0]), sum(mu, arm_m_[1]), sum(mu, arm_m_[2]));
    mass.coupling += (Matrix3() << sum(x, legs.m_x), sum(x, legs.m_y), sum(x, legs.m_z), //
                      sum(y, legs.m_x), sum(y, legs.m_y), sum(y, legs.m_z),              //
                      sum(z, legs.m_x), sum(z, legs.m_y), sum(z, legs.m_z))
                         .finished() -
                     skew(moment_kg_m);
    const Legs m_x = extra_kg * legs.m_x;
    const Legs m_y = extra_kg * legs.m_y;
    const double I_xy = sum(m_x, legs.m_y) + sum(mu, arm_square_m2_[3]);
    const double I_xz = sum(m_x, legs.m_z) + sum(mu, arm_square_m2_[4]);
    const double I_yz = sum(m_y, legs.m_z) + sum(mu, arm_square_m2_[5]);
    mass.angular += (Matrix3() << sum(m_x, legs.m_x) + sum(mu, arm_square_m2_[0]), I_xy, I_xz, //
                     I_xy, sum(m_y, legs.m_y) + sum(mu, arm_square_m2_[1]), I_yz,              //
                     I_xz, I_yz, sum(extra_kg * legs.m_z, legs.m_z) + sum(mu, arm_square_m2_[2]))
                        .finished();
}

InverseMass::InverseMass(const RigidMass& mass)
    : linear(inverse_of(mass.linear)), carried(linear * mass.coupling),
      angular(inverse_of(mass.angular - mass.coupling.transpose() * carried)) {}

Vector6 InverseMass::acceleration(const Vector3& force_n, const Vector3& moment_n_m) const {
    const Vector3 w_rate = angular * (moment_n_m - carried.transpose() * force_n);
    Vector6 rate;
    rate << linear * force_n - carried * w_rate, w_rate;
    return rate;
}

} // namespace hexload::sim
