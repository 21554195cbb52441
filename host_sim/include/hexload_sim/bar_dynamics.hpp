// The legs' mass of leg_inertia.hpp for the plant's right-hand side: six legs at once, in platform axes,
// where the hinges stand still. tests/properties compares the two.
#pragma once

#include <hexload_sim/leg_inertia.hpp>

#include <array>

namespace hexload::sim {

// The legs at one pose and twist, platform axes.
struct LegRows {
    Legs e_x, e_y, e_z; // rows of J: e_i ...
    Legs m_x, m_y, m_z; // ... and a_i x e_i
    Legs length_m;
    Legs displacement_m, velocity_m_s;
};

// Of O_A, platform axes.
struct PlatformMotion {
    Vector3 v_m_s;
    Vector3 w_rad_s;
    Vector3 up_m_s2; // gravity, as Gravity::up_m_s2
};

// mass x [linear; angular acceleration], about O_A, platform axes: a force and a moment.
struct RigidMass {
    Matrix3 linear;   // force by linear acceleration
    Matrix3 coupling; // force by angular acceleration; its transpose is moment by linear acceleration
    Matrix3 angular;
};

// What moves without acceleration needs: velocity terms and gravity.
struct RigidBias {
    Vector3 force_n;
    Vector3 moment_n_m;
};

// A mass as it is solved with: the linear block is eliminated.
struct InverseMass {
    InverseMass() = default;
    explicit InverseMass(const RigidMass& mass);

    // [linear; angular acceleration] under a force and a moment.
    Vector6 acceleration(const Vector3& force_n, const Vector3& moment_n_m) const;

    Matrix3 linear = Matrix3::Zero();  // inverse of that block
    Matrix3 carried = Matrix3::Zero(); // linear acceleration by angular acceleration, negative
    Matrix3 angular = Matrix3::Zero(); // inverse of what is left
};

class BarDynamics {
  public:
    // reflected_kg: a mass of each leg that resists along it alone and has no weight, as that of a motor on a
    // screw.
    BarDynamics(const Geometry& geometry, const SixLegBars& bars, double reflected_kg = 0.0);

    bool have_mass() const {
        return have_mass_;
    }

    void add_mass(const LegRows& legs, RigidMass& mass) const;
    void add_bias(const LegRows& legs, const PlatformMotion& motion, RigidBias& bias) const;

  private:
    // mu of leg_inertia.hpp.
    Legs across_kg(const LegRows& legs) const;

    bool have_mass_;
    Legs rod_kg_;
    Legs along_kg_;     // with the reflected mass
    Legs rod_centre_m_; // from the upper hinge
    Legs fixed_kg_m2_;  // of both bars, without the rod's distance
    Legs turning_kg_m_; // weight of the bars that turns the leg
    std::array<Legs, 3> arm_m_;
    std::array<Legs, 6> arm_square_m2_; // xx, yy, zz, xy, xz, yz of |a|^2 E - a a^T
};

} // namespace hexload::sim
