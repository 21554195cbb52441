#include <hexload_sim/leg_inertia.hpp>

#include <hexload_sim/linear_solve.hpp>
#include <hexload_sim/rotation.hpp>

#include <Eigen/Geometry>

namespace hexload::sim {
namespace {

// mu of the header, and its derivative by the length.
struct AcrossMass {
    double kg;
    double slope_kg_m;
};

AcrossMass across_mass(const LegBars& bars, double length_m) {
    const double rod_arm_m = length_m - bars.rod_length_m / 2.0;
    const double fixed_kg_m2 = bars.cylinder_mass_kg * bars.cylinder_length_m * bars.cylinder_length_m / 3.0 +
                               bars.rod_mass_kg * bars.rod_length_m * bars.rod_length_m / 12.0;
    const double kg = (fixed_kg_m2 + bars.rod_mass_kg * rod_arm_m * rod_arm_m) / (length_m * length_m);
    return {kg, 2.0 * (bars.rod_mass_kg * rod_arm_m / length_m - kg) / length_m};
}

// The hinge's velocity by the platform's twist.
Eigen::Matrix<double, 3, 6> hinge_jacobian(const Vector3& arm_m) {
    Eigen::Matrix<double, 3, 6> X;
    X << Matrix3::Identity(), -skew(arm_m);
    return X;
}

} // namespace

SixLegBars::SixLegBars(const LegBars& each)
    : rod_mass_kg(Legs::Constant(each.rod_mass_kg)), rod_length_m(Legs::Constant(each.rod_length_m)),
      cylinder_mass_kg(Legs::Constant(each.cylinder_mass_kg)),
      cylinder_length_m(Legs::Constant(each.cylinder_length_m)) {}

HingeLoad hinge_load(const LegBars& bars, const Gravity& gravity, const Vector3& leg_m,
                     const Vector3& velocity_m_s) {
    const double length_m = leg_m.norm();
    const Vector3 e = leg_m / length_m;
    const AcrossMass mu = across_mass(bars, length_m);
    const double along_m_s = e.dot(velocity_m_s);
    const Vector3 across_m_s = velocity_m_s - along_m_s * e;
    const Vector3& up = gravity.up_m_s2;
    // d/dt (dT/du) - dT/dL at constant u; V = m_c g l_c / 2 e_z + m_r g (L_z - l_r / 2 e_z).
    const double turning_kg_m =
        (bars.cylinder_mass_kg * bars.cylinder_length_m - bars.rod_mass_kg * bars.rod_length_m) / 2.0;
    return {mu.kg * Matrix3::Identity() + (bars.rod_mass_kg - mu.kg) * e * e.transpose(),
            mu.slope_kg_m * along_m_s * across_m_s +
                ((bars.rod_mass_kg - mu.kg) / length_m - mu.slope_kg_m / 2.0) * across_m_s.squaredNorm() * e,
            bars.rod_mass_kg * up + turning_kg_m / length_m * (up - e.dot(up) * e)};
}

LegWrench leg_wrench(const Geometry& geometry, const SixLegBars& bars, const Gravity& gravity,
                     const Pose& pose, const Twist& twist) {
    const LegVectors legs = leg_vectors(geometry, pose);
    const Vector3& w = twist.w_rad_s;
    LegWrench sum;
    for (int leg = 0; leg < 6; ++leg) {
        const Vector3 arm_m = legs.arm_m.col(leg);
        const Vector3 velocity_m_s = twist.v_m_s + w.cross(arm_m);
        const HingeLoad load =
            hinge_load(bars.of(leg), gravity, legs.length_m(leg) * legs.direction.col(leg), velocity_m_s);
        const Eigen::Matrix<double, 3, 6> X = hinge_jacobian(arm_m);
        sum.mass += X.transpose() * load.mass_kg * X;
        sum.bias +=
            X.transpose() * (load.mass_kg * w.cross(w.cross(arm_m)) + load.velocity_n + load.gravity_n);
    }
    return sum;
}

Vector6 standing_leg_forces(const Geometry& geometry, const MassProperties& body, const SixLegBars& bars,
                            const Gravity& gravity, const Pose& pose) {
    const Vector6 of_body = leg_forces(geometry, body, gravity, pose, Twist{}, Vector6::Zero());
    if (!bars.have_mass()) {
        return of_body;
    }
    const Vector6 wrench = leg_wrench(geometry, bars, gravity, pose, Twist{}).bias;
    return of_body + solve(jacobian(geometry, pose).transpose(), wrench);
}

double leg_kinetic_energy_j(const Geometry& geometry, const SixLegBars& bars, const Pose& pose,
                            const Twist& twist) {
    const Vector6 V = twist.stacked();
    return 0.5 * V.dot(leg_wrench(geometry, bars, 0.0, pose, twist).mass * V);
}

double leg_potential_energy_j(const Geometry& geometry, const SixLegBars& bars, const Gravity& gravity,
                              const Pose& pose) {
    const LegVectors legs = leg_vectors(geometry, pose);
    const Legs rise_m_s2 = legs.direction.transpose() * gravity.up_m_s2; // of a metre along the leg, times g
    const Legs rod_centre_m = legs.length_m.array() - bars.rod_length_m / 2.0;
    return ((bars.rod_mass_kg * rod_centre_m + bars.cylinder_mass_kg * bars.cylinder_length_m / 2.0) *
            rise_m_s2)
        .sum();
}

} // namespace hexload::sim
