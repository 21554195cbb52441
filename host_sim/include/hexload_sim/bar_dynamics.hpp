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
};

// mass x [linear; angular acceleration], about O_A, platform axes: a force and a moment.
struct RigidMass {
    Matrix3 linear;   // force by linear acceleration
    Matrix3 coupling; // force by angular acceleration; its transpose is moment by linear acceleration
    Matrix3 angular;
};

// About O_A, platform axes.
struct RigidWrench {
    Vector3 force_n;
    Vector3 moment_n_m;
};

// A mass as it is solved with: the linear block is eliminated.
struct InverseMass {
    InverseMass() = default;
    explicit InverseMass(const RigidMass& mass);

    // [linear; angular acceleration].
    Vector6 acceleration(const RigidWrench& wrench) const;

    Matrix3 linear = Matrix3::Zero();  // inverse of that block
    Matrix3 carried = Matrix3::Zero(); // linear acceleration by angular acceleration, negative
    Matrix3 angular = Matrix3::Zero(); // inverse of what is left
};

// Platform, load and legs at one pose: what is the same at any speed.
struct BarPosture {
    InverseMass inverse;
    Vector3 first_moment_kg_m; // of platform, load and masses mu at the hinges
    Matrix3 inertia_kg_m2;
    RigidWrench weight;
    // Of what resists along a leg otherwise than across it.
    Legs extra_kg;       // along less mu
    Legs extra_arm_kg_m; // times e a
    Legs slope_kg_m;     // mu by length
    Legs across_kg_m;    // force by the square of the speed across the leg
    Legs weight_n;
};

class BarDynamics {
  public:
    // reflected_kg: a mass of each leg that resists along it alone and has no weight, as that of a motor on a
    // screw.
    BarDynamics(const Geometry& geometry, const SixLegBars& bars, double reflected_kg = 0.0);

    bool have_mass() const {
        return have_mass_;
    }

    // up_m_s2: Gravity's, in platform axes.
    BarPosture at(const MassProperties& body, const LegRows& legs, const Vector3& up_m_s2) const;

    // What the legs' forces leave for acceleration: less weight and velocity terms.
    RigidWrench driving(const BarPosture& at, const LegRows& legs, const PlatformMotion& motion,
                        const Legs& force_n) const;

  private:
    struct HingeMasses {
        double kg;
        Vector3 first_moment_kg_m;
        Matrix3 inertia_kg_m2;
    };
    HingeMasses at_hinges(const Legs& kg) const;
    static void add_along(const Legs& extra_kg, const LegRows& legs, RigidMass& mass);

    bool have_mass_;
    Legs rod_kg_;
    Legs along_kg_;     // with the reflected mass
    Legs rod_centre_m_; // from the upper hinge
    Legs fixed_kg_m2_;  // of both bars, without the rod's distance
    Legs turning_kg_m_; // weight of the bars that turns the leg
    std::array<Legs, 3> arm_m_;
    Legs arm_square_m2_;
    Eigen::Matrix<double, 10, 6> of_hinge_; // 1 kg there: mass, first moment, xx, yy, zz, xy, xz, yz
};

} // namespace hexload::sim
