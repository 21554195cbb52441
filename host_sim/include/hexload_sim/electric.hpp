// Six electric servo actuators: a motor on a screw, in a drive with a current loop and a speed loop.
// Element-wise over the legs.
//
// Model per leg (Leonhard, Control of Electrical Drives, 2001, ch. 15; Isermann, Mechatronic Systems, 2005):
//   speed loop    i* = (speed_gain (v* - v) + speed_integral z) / force_gain within +-current_limit
//                 z' = v* - v, held while i* is at the limit; v* = command x speed_limit, command in [-1, 1]
//   current loop  i' = 2 pi current_bandwidth (i* - i)
//   motor         f = force_gain i, force_gain = 2 pi k_t / lead
//   on platform   f - friction + end stop force - reflected_mass l''
// reflected_mass = (J_rotor + J_screw) (2 pi / lead)^2 resists along the leg and has no weight. l the length.
// Friction (friction.hpp) is the screw's. A load cell at the rod's end shows the force on the platform; a
// force from the current, force_gain i, has friction and the reflected mass in it.
// Not modelled: cogging, voltage limit beyond speed_limit, elastic screw, backlash, heat.
#pragma once

#include <hexload_sim/friction.hpp>
#include <hexload_sim/types.hpp>

namespace hexload::sim {

enum class ForceSignal { load_cell, current };

// Off by default: the legs are hydraulic. The other defaults are a 12 kN actuator for the paper's platform.
struct ElectricSettings {
    double force_gain_n_a = 0.0; // 1.6 N m/A on a lead of 25 mm: 400; 0: hydraulic legs
    double current_limit_a = 30.0;
    double current_bandwidth_hz = 300.0;
    double reflected_mass_kg = 75.0; // 1.2e-3 kg m^2 on a lead of 25 mm
    double speed_limit_m_s = 1.2;    // of command 1
    double speed_gain_n_s_m = 22e3;  // 20 Hz on 75 kg and a sixth of 600 kg
    double speed_integral_n_m = 4e5; // a seventh of that
    ForceSignal force_signal = ForceSignal::load_cell;
    FrictionSettings friction;

    bool exists() const {
        return force_gain_n_a > 0.0;
    }
    double stall_force_n() const {
        return force_gain_n_a * current_limit_a;
    }
};

// State of the six actuators.
struct ElectricState {
    Legs current_a = Legs::Zero();
    Legs lag_m = Legs::Zero(); // z, of the speed loop
};

class Electric {
  public:
    explicit Electric(const ElectricSettings& settings) : settings_(settings) {}

    // Of the motors, positive = extends.
    Legs force_n(const ElectricState& state) const {
        return settings_.force_gain_n_a * state.current_a;
    }

    // Time derivative of the state under a command, at the legs' velocity.
    void differentiate(const ElectricState& state, const Legs& command, const Legs& velocity_m_s,
                       ElectricState& rate) const;

    // The state in which the legs stand still under these forces. Forces beyond the current limit throw
    // InputError.
    ElectricState equilibrium(const Legs& force_n) const;

    const ElectricSettings& settings() const {
        return settings_;
    }

  private:
    ElectricSettings settings_;
};

} // namespace hexload::sim
