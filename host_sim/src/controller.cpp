#include <hexload_sim/controller.hpp>

namespace hexload::sim {

Controller::Controller(const ControllerSettings& settings, double speed_gain_m_s, const Legs& gravity_force_n,
                       double tick_s)
    : settings_(settings), tick_s_(tick_s), feedforward_s_m_(settings.velocity_feedforward / speed_gain_m_s),
      gravity_force_n_(settings.gravity_offset ? gravity_force_n : Legs::Zero()) {}

void Controller::hold(const Legs& command, const Legs& force_n) {
    integral_ = command + settings_.pressure_feedback_1_n * (force_n - gravity_force_n_);
}

Legs Controller::step(const LegReference& reference, const LegState& measured) {
    const Legs error_m = reference.displacement_m - measured.displacement_m;
    const Legs error_rate_m_s = reference.velocity_m_s - measured.velocity_m_s;
    const Legs command = settings_.proportional_1_m * error_m + integral_ +
                         settings_.derivative_s_m * error_rate_m_s +
                         feedforward_s_m_ * reference.velocity_m_s -
                         settings_.pressure_feedback_1_n * (measured.force_n - gravity_force_n_);
    const double limit = settings_.integral_limit;
    integral_ = (integral_ + settings_.integral_1_m_s * tick_s_ * error_m).max(-limit).min(limit);
    return command.max(-1.0).min(1.0);
}

} // namespace hexload::sim
