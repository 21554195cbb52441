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

// mass x [linear; angular acceleration] + bias: blocks about O_A, platform axes.
struct RigidBlocks {
    Matrix3 linear;   // force by linear acceleration
    Matrix3 coupling; // force by angular acceleration; its transpose is moment by linear acceleration
    Matrix3 angular;
    Vector3 force_n; // bias
    Vector3 moment_n_m;
};

class BarDynamics {
  public:
    BarDynamics(const Geometry& geometry, const SixLegBars& bars);

    bool have_mass() const {
        return have_mass_;
    }

    void add(const LegRows& legs, const PlatformMotion& motion, RigidBlocks& blocks) const;

  private:
    void add_mass(const LegRows& legs, const Legs& across_kg, RigidBlocks& blocks) const;

    bool have_mass_;
    Legs rod_kg_;
    Legs rod_centre_m_; // from the upper hinge
    Legs fixed_kg_m2_;  // of both bars, without the rod's distance
    Legs turning_kg_m_; // weight of the bars that turns the leg
    std::array<Legs, 3> arm_m_;
    std::array<Legs, 6> arm_square_m2_; // xx, yy, zz, xy, xz, yz of |a|^2 E - a a^T
};

// [linear; angular acceleration] x with mass x = [force; moment].
Vector6 solve(const RigidBlocks& blocks, const Vector3& force_n, const Vector3& moment_n_m);

} // namespace hexload::sim
