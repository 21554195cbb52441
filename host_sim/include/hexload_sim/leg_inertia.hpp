// Mass of the legs: a cylinder that turns about its base hinge and a rod that slides in it, each a uniform
// slender bar along the leg. The cylinder ends at the base hinge, the rod at the platform's.
//
// Both bars follow from the leg vector L = length e of the hinge alone. With the rod's mass m_r and length
// l_r, and the cylinder's m_c, l_c, their kinetic energy is that of a mass at the hinge that differs along
// and across the leg,
//
//     T = 1/2 m_r (e u)^2 + 1/2 mu |u - e (e u)|^2
//     mu = [m_c l_c^2 / 3 + m_r l_r^2 / 12 + m_r (length - l_r / 2)^2] / length^2
//
// u the hinge's velocity. Lagrange's equation for L gives the force that moves them, which the platform
// supplies at the hinge. Spin about the leg's own axis is left out.
#pragma once

#include <hexload_sim/dynamics.hpp>

namespace hexload::sim {

// Of one leg.
struct LegBars {
    double rod_mass_kg = 0.0;
    double rod_length_m = 0.55;
    double cylinder_mass_kg = 0.0;
    double cylinder_length_m = 0.60;
};

// Of the six legs. Without mass by default, as in the paper.
struct SixLegBars {
    SixLegBars() : SixLegBars(LegBars{}) {}
    SixLegBars(const LegBars& each); // legs alike

    Legs rod_mass_kg;
    Legs rod_length_m;
    Legs cylinder_mass_kg;
    Legs cylinder_length_m;

    bool have_mass() const {
        return (rod_mass_kg > 0.0).any() || (cylinder_mass_kg > 0.0).any();
    }
    LegBars of(int leg) const {
        return {rod_mass_kg(leg), rod_length_m(leg), cylinder_mass_kg(leg), cylinder_length_m(leg)};
    }
};

// What a leg takes from its upper hinge: mass_kg x acceleration + velocity_n + gravity_n, base axes.
struct HingeLoad {
    Matrix3 mass_kg;
    Vector3 velocity_n;
    Vector3 gravity_n;
};

HingeLoad hinge_load(const LegBars& bars, const Gravity& gravity, const Vector3& leg_m,
                     const Vector3& velocity_m_s);

// Their sum over the legs as a wrench on the platform about O_A, base axes: mass x [v'; w'] + bias.
struct LegWrench {
    Matrix6 mass = Matrix6::Zero();
    Vector6 bias = Vector6::Zero();
};

LegWrench leg_wrench(const Geometry& geometry, const SixLegBars& bars, const Gravity& gravity,
                     const Pose& pose, const Twist& twist);

// The leg forces in which platform, load and legs stand still.
Vector6 standing_leg_forces(const Geometry& geometry, const MassProperties& body, const SixLegBars& bars,
                            const Gravity& gravity, const Pose& pose);

double leg_kinetic_energy_j(const Geometry& geometry, const SixLegBars& bars, const Pose& pose,
                            const Twist& twist);

// m g (height, along the vertical, of the bars' centres above the base hinges).
double leg_potential_energy_j(const Geometry& geometry, const SixLegBars& bars, const Gravity& gravity,
                              const Pose& pose);

} // namespace hexload::sim
