// Platform, load and hydraulic or electric legs as one system of ordinary differential equations, integrated
// by RK4.
//
// Same physics as dynamics.hpp in the form that is cheapest to integrate: the body is solved about the
// combined centre of mass in platform axes, where its tensor is constant. tests/properties compares the two.
#pragma once

#include <hexload_sim/bar_dynamics.hpp>
#include <hexload_sim/dynamics.hpp>
#include <hexload_sim/electric.hpp>
#include <hexload_sim/hydraulics.hpp>
#include <hexload_sim/leg_inertia.hpp>
#include <hexload_sim/low_pass.hpp>

#include <array>
#include <cstddef>
#include <optional>
#include <span>

namespace hexload::sim {

struct BodyState {
    Vector3 p_m = Vector3::Zero();              // as Pose
    Eigen::Vector4d q{1.0, 0.0, 0.0, 0.0};      // unit quaternion w, x, y, z; base <- platform
    Vector3 v_m_s = Vector3::Zero();            // of O_A, base axes
    Vector3 w_platform_rad_s = Vector3::Zero(); // angular velocity in platform axes
};

// Work of the legs since the last reset. The difference is what friction and end stops took.
struct LegWork {
    double drive_j = 0.0; // chamber or motor force x leg speed: into the rods
    double body_j = 0.0;  // force on the platform x leg speed: into the body
};

// What only a rig has: bristles of the seals, low-passes behind the transducers.
struct RigState {
    Legs bristle_m = Legs::Zero();
    LowPassState force_n;
    LowPassState velocity_m_s;
};

struct PlantState {
    HydraulicState hydraulics;
    BodyState body;
    LegWork work;
    RigState rig;
    ElectricState electric; // in place of hydraulics
};

// A look at the transducers between two ticks.
struct Glimpse {
    double share = 0.0; // of the tick that has passed, 0 to 1
    LegState transducers;
};

class Plant {
  public:
    // `substeps`: RK4 steps of a tick. Throws InputError for a current loop too fast for them.
    Plant(const Geometry& geometry, const Gravity& gravity, const HydraulicSettings& hydraulics, int substeps,
          const SixLegBars& leg_bars = {}, const LowPasses& low_passes = {}, double tick_s = default_tick_s,
          const ElectricSettings& electric = {});

    // Static equilibrium at a pose, at rest. Throws InputError if the legs cannot hold the body there.
    void reset(const Pose& pose, const MassProperties& body);

    // Exchanges the body; pose, twist and oil stay as they are.
    void set_body(const MassProperties& body);

    // One tick in `substeps` RK4 steps: valves under a constant command, drives on the way to it from the one
    // before, as drives interpolate. Glimpses are taken on the way, by the
    // continuous extension of RK4 (third order).
    void advance(const Legs& spool_command, std::span<Glimpse> glimpses = {});

    Pose pose() const;
    Twist twist() const;
    LegState legs() const;

    // What the transducers say of legs(), behind the low-passes.
    LegState transducers(const LegState& legs) const {
        return transducers(state_, legs);
    }
    const PlantState& state() const {
        return state_;
    }

    // Time derivative of the state; body rates in .body, powers in .work.
    PlantState derivative(const PlantState& state, const Legs& spool_command) const;

    // In the seals: part of what friction took, which it gives back.
    double bristle_energy_j() const {
        return friction_.has_bristles() ? friction_.stored_j(state_.rig.bristle_m) : 0.0;
    }

    // Of the body and of the legs.
    double kinetic_energy_j() const;
    double potential_energy_j() const;

  private:
    // What the pose alone determines. Of legs with mass it is dear and found twice a substep: at its middle,
    // for both stages there, and at its end, which is the begin of the next.
    struct Posture {
        Matrix3 R;
        LegRows legs;    // but for the speeds, which are the stage's
        BarPosture bars; // of legs with mass
        bool is_current = false;
    };
    // Second derivatives of a pose.
    struct Curvature {
        Vector3 p_m_s2;
        Eigen::Vector4d q_1_s2;
    };
    struct Stages {
        PlantState k1, k2, k3, k4, at; // rates, and the state they are taken at
        std::array<Legs, 4> shown_n, speed_m_s;
        RigState end; // of the low-passes
    };
    // The command at the begin, the middle and the end of a substep.
    using Commands = std::array<Legs, 3>;
    Commands commands_of(int step, const Legs& command) const;
    void substep(const Commands& commands, double h_s);
    static Curvature curvature(const BodyState& body, const BodyState& rate);
    void place(double after_s, const Curvature& curvature);
    void finish_substep(double h_s);
    LegState glimpse(double h_s, double share) const;
    LegState transducers(const PlantState& state, const LegState& legs) const;
    LegState legs(const PlantState& state) const;
    void take(const BodyState& body, Posture& posture) const;
    void leg_directions(const BodyState& body, const Matrix3& R, LegRows& legs) const;
    // Of a stage, 0 to 3, with what the transducers see there.
    void take_stage(std::size_t stage, const PlantState& state, const Legs& spool_command, PlantState& rate);
    void filter_substep();
    // Returns what the force sensors' transducers say: chamber pressures, load cells or currents.
    Legs differentiate(const PlantState& state, const Legs& spool_command, Posture& posture,
                       PlantState& rate) const;
    Legs drive_force_n(const PlantState& state) const;
    Legs friction_and_stops_n(const PlantState& state, const LegRows& legs, const Legs& drive_n,
                              PlantState& rate) const;
    Legs cell_force_n(const PlantState& state, const Matrix3& R, const LegRows& legs, const Legs& body_n,
                      const BodyState& rate) const;
    void differentiate_body(const BodyState& body, const Matrix3& R, const LegRows& legs, const Legs& force_n,
                            BodyState& rate) const;
    void differentiate_with_legs(const BodyState& body, const Posture& posture, const PlatformMotion& motion,
                                 const Legs& force_n, BodyState& rate) const;

    Geometry geometry_;
    Gravity gravity_;
    SixLegBars leg_bars_;
    BarDynamics bar_dynamics_;
    Hydraulics hydraulics_;
    Electric electric_;
    bool is_electric_;
    bool has_load_cells_; // which show the reflected mass' part, unlike chambers and currents
    Friction friction_;
    std::optional<LowPass> force_low_pass_;
    std::optional<LowPass> velocity_low_pass_;
    Legs last_command_ = Legs::Zero(); // of drives
    double tick_s_;
    int substeps_;
    Legs home_length_m_;
    Legs base_x_, base_y_, base_z_; // b_i - p0
    Legs platform_x_, platform_y_, platform_z_;

    MassProperties body_;
    double inverse_mass_1_kg_ = 0.0;
    Vector3 com_m_ = Vector3::Zero();
    Matrix3 inertia_com_kg_m2_ = Matrix3::Identity();
    Matrix3 inertia_com_inverse_ = Matrix3::Identity();

    double t_s_ = 0.0;      // since the reset
    double coldness_ = 1.0; // of the friction, during this tick
    PlantState state_;
    Posture posture_;
    Stages stages_; // of the last substep
};

} // namespace hexload::sim
