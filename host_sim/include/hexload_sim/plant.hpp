// Platform, load and hydraulic legs as one system of ordinary differential equations, integrated by RK4.
//
// Same physics as dynamics.hpp in the form that is cheapest to integrate: the body is solved about the
// combined centre of mass in platform axes, where its tensor is constant. tests/properties compares the two.
#pragma once

#include <hexload_sim/dynamics.hpp>
#include <hexload_sim/hydraulics.hpp>
#include <hexload_sim/leg_inertia.hpp>

namespace hexload::sim {

struct BodyState {
    Vector3 p_m = Vector3::Zero();              // as Pose
    Eigen::Vector4d q{1.0, 0.0, 0.0, 0.0};      // unit quaternion w, x, y, z; base <- platform
    Vector3 v_m_s = Vector3::Zero();            // of O_A, base axes
    Vector3 w_platform_rad_s = Vector3::Zero(); // angular velocity in platform axes
};

// Work of the legs since the last reset. The difference is what friction and end stops took.
struct LegWork {
    double hydraulic_j = 0.0; // chamber force x leg speed: into the rods
    double body_j = 0.0;      // force on the platform x leg speed: into the body
};

struct PlantState {
    HydraulicState hydraulics;
    BodyState body;
    LegWork work;
};

class Plant {
  public:
    Plant(const Geometry& geometry, double gravity_m_s2, const HydraulicSettings& hydraulics, int substeps,
          const LegBars& leg_bars = {});

    // Static equilibrium at a pose, at rest. Throws InputError if the legs cannot hold the body there.
    void reset(const Pose& pose, const MassProperties& body);

    // Exchanges the body; pose, twist and oil stay as they are.
    void set_body(const MassProperties& body);

    // One tick under a constant spool command, in `substeps` RK4 steps.
    void advance(const Legs& spool_command);

    Pose pose() const;
    Twist twist() const;
    LegState legs() const;
    const PlantState& state() const {
        return state_;
    }

    // Time derivative of the state; body rates in .body, powers in .work.
    PlantState derivative(const PlantState& state, const Legs& spool_command) const;

    // Of the body and of the legs.
    double kinetic_energy_j() const;
    double potential_energy_j() const;

  private:
    struct LegKinematics {
        Legs e_x, e_y, e_z; // rows of J in platform axes: e_i ...
        Legs m_x, m_y, m_z; // ... and a_i x e_i
        Legs displacement_m, velocity_m_s;
    };
    void leg_kinematics(const BodyState& body, const Matrix3& R, LegKinematics& legs) const;
    void differentiate(const PlantState& state, const Legs& spool_command, PlantState& rate) const;
    void differentiate_body(const BodyState& body, const Matrix3& R, const LegKinematics& legs,
                            const Legs& force_n, BodyState& rate) const;

    void differentiate_with_legs(const BodyState& body, const Matrix3& R, const LegKinematics& legs,
                                 const Legs& force_n, BodyState& rate) const;

    Geometry geometry_;
    double gravity_m_s2_;
    LegBars leg_bars_;
    Hydraulics hydraulics_;
    int substeps_;
    Legs home_length_m_;
    Legs base_x_, base_y_, base_z_; // b_i - p0
    Legs platform_x_, platform_y_, platform_z_;

    MassProperties body_;
    double inverse_mass_1_kg_ = 0.0;
    Vector3 com_m_ = Vector3::Zero();
    Matrix3 inertia_com_kg_m2_ = Matrix3::Identity();
    Matrix3 inertia_com_inverse_ = Matrix3::Identity();

    PlantState state_;
};

} // namespace hexload::sim
