// Six hydraulic servo actuators: spool, orifices, oil, end stops. Element-wise over the legs.
//
// Model per leg (Merritt, Hydraulic Control Systems, 1967, ch. 5 and 6; Jelali and Kroll, Hydraulic
// Servo-systems, 2003, ch. 4):
//   spool       xs'' = wn^2 (command - xs) - 2 zeta wn xs', xs in [-1, 1]
//   orifices    q = K xs dp / sqrt(|dp| + p_laminar): square root of turbulent flow, linear near dp = 0
//   chambers    p' = beta / V (q - A v -+ leakage), V = dead volume + A x (chamber stroke)
//   leg force   f = pA A_A - pB A_B; it is what a load cell between rod and platform measures without
//   friction on platform f - friction + end stop force; friction.hpp has its laws
// Not modelled: supply line dynamics, cavitation, temperature, valve overlap and hysteresis.
#pragma once

#include <hexload_sim/friction.hpp>
#include <hexload_sim/types.hpp>

#include <numbers>

namespace hexload::sim {

// Defaults: a 21 MPa actuator for the paper's platform, six legs of about 10 kN each.
struct HydraulicSettings {
    // 210 bar, the usual rating of servo hydraulics; return line at 2 bar.
    double supply_pressure_pa = 21e6;
    double tank_pressure_pa = 0.2e6;
    // Equal-area actuator as in motion systems: 50 mm bore, 36 mm rod (ISO 3320 sizes) on both sides, so that
    // the speed gain is the same both ways. 13 kN at 2/3 of the supply pressure (Merritt's best load point).
    double piston_area_m2 = std::numbers::pi / 4.0 * (0.050 * 0.050 - 0.036 * 0.036);   // side A, extends
    double rod_side_area_m2 = std::numbers::pi / 4.0 * (0.050 * 0.050 - 0.036 * 0.036); // side B, retracts
    // Manifold and end clearance of each chamber: 53 mm of stroke.
    double dead_volume_m3 = 5e-5;
    // Effective bulk modulus: mineral oil 1.6 GPa less some entrained air and hose.
    double bulk_modulus_pa = 1.2e9;
    // Cross-piston leakage: 0.06 L/min per MPa, a sealed piston.
    double leakage_m3_s_pa = 1e-12;
    // Rated flow at 3.5 MPa per metering edge and full spool, port A: a 40 L/min servo valve, 1.2 m/s
    // unloaded. Port B is cut in the ratio of the piston areas (matched spool), so that reversing does not
    // shock the oil.
    double rated_flow_m3_s = 40e-3 / 60.0;
    // Pressure below which the orifice flow is laminar.
    double laminar_pressure_pa = 1e5;
    // Direct-driven valve of this size: -90 deg at 60 Hz, well damped.
    double valve_bandwidth_hz = 60.0;
    double valve_damping = 0.8;
    FrictionSettings friction; // on the rod, not seen in the chamber pressures
    // Elastic stop with damping that grows with the depth (Hunt and Crossley, 1975): 2 mm at stall force.
    double stop_stiffness_n_m = 1e7;
    double stop_damping_s_m = 5.0; // force factor 1 + this x approach speed
};

inline constexpr double rated_pressure_drop_pa = 3.5e6; // per metering edge (ISO 10770-1)

// State of the six actuators.
struct HydraulicState {
    Legs spool = Legs::Zero(); // opening, -1 ... 1
    Legs spool_rate_1_s = Legs::Zero();
    Legs pressure_a_pa = Legs::Zero();
    Legs pressure_b_pa = Legs::Zero();
};

// HydraulicSettings plus what the right-hand side needs of them again and again.
class Hydraulics {
  public:
    Hydraulics(const HydraulicSettings& settings, double stroke_min_m, double stroke_max_m);

    // Chamber pressure force, positive = extends.
    Legs force_n(const HydraulicState& state) const;

    // Time derivative of the state under a spool command, at the legs' displacement and velocity.
    void differentiate(const HydraulicState& state, const Legs& command, const Legs& displacement_m,
                       const Legs& velocity_m_s, HydraulicState& rate) const;

    // Pushes back into the stroke, zero inside it; to be added to force_n.
    Legs stop_force_n(const Legs& displacement_m, const Legs& velocity_m_s) const;

    // The state in which the legs stand still under these forces; its spool covers the leakage. Forces beyond
    // what supply pressure can hold throw InputError.
    HydraulicState equilibrium(const Legs& force_n) const;

    // Leg speed per unit of spool with no load on the rod.
    double speed_gain_m_s() const;

    const HydraulicSettings& settings() const {
        return settings_;
    }

  private:
    Legs orifice(const Legs& pressure_drop_pa) const;
    double orifice(double pressure_drop_pa) const;
    double balanced_pressure_a_pa(double f_n, bool extending) const;

    HydraulicSettings settings_;
    double stroke_min_m_;
    double stroke_max_m_;
    double flow_gain_a_; // m^3/s per sqrt(Pa) at full spool
    double flow_gain_b_;
    double natural_frequency_rad_s_;
};

} // namespace hexload::sim
