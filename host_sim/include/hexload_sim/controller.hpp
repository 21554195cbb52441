// Joint-space servo, one per leg, at the tick: PID on leg length, velocity feed-forward, and load pressure
// feedback about the gravity offset. By default it reads its own noise-free transducers, so that the noise of
// the estimator's sensors does not change the motion.
#pragma once

#include <hexload_sim/types.hpp>

namespace hexload::sim {

// Longest step of the servo, which holds its command that long; longer ones only where it reads the
// estimator's sensors.
inline constexpr double servo_s = 1e-3;

// command = kp e + ki integral(e) + kd e' + feed-forward - pressure_feedback (f - f_gravity), in spool
// openings.
struct ControllerSettings {
    // Loop gain kp x speed gain (1.2 m/s) = 18 1/s: a third of what the valve allows, below half the 60 rad/s
    // of the weakest oil column mode at 600 kg.
    double proportional_1_m = 15.0;
    // Integral time 1 s: removes the droop of a new load in seconds, without phase lag at 0.5 Hz.
    double integral_1_m_s = 15.0;
    double derivative_s_m = 0.0;
    // Share of the reference speed fed forward through the speed gain. The paper's loop is a plain PID.
    double velocity_feedforward = 0.0;
    // Electrical leakage that damps the oil column to about 0.4 of critical; 0.7 % of spool per kN.
    double pressure_feedback_1_n = 7e-6;
    // Refer the feedback to the static leg forces at home under the first load, so that gravity asks for no
    // position error.
    bool gravity_offset = true;
    // Anti-windup: the integral part stays within this opening.
    double integral_limit = 0.1;
    // Read the estimator's sensors with all their errors, lost samples apart, instead of transducers of its
    // own.
    bool reads_sensors = false;
};

struct LegReference {
    Legs displacement_m = Legs::Zero();
    Legs velocity_m_s = Legs::Zero();
};

class Controller {
  public:
    // speed_gain_m_s: leg speed per unit of spool; gravity_force_n: static leg forces at home; tick_s: from
    // step to step.
    Controller(const ControllerSettings& settings, double speed_gain_m_s, const Legs& gravity_force_n,
               double tick_s);

    // Sets the integral part so that the command at rest on the reference is `command`.
    void hold(const Legs& command, const Legs& force_n);

    // Spool command in -1 ... 1 for the coming tick.
    Legs step(const LegReference& reference, const LegState& measured);

  private:
    ControllerSettings settings_;
    double tick_s_;
    double feedforward_s_m_;
    Legs gravity_force_n_;
    Legs integral_ = Legs::Zero();
};

} // namespace hexload::sim
