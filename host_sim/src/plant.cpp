#include <hexload_sim/plant.hpp>

#include "platform_file/input_error.hpp"

#include <hexload_sim/rotation.hpp>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

namespace hexload::sim {
namespace {

// Calls f(a.x, b.x, ...) for each field x of plant states a, b, ...
template <typename F, typename... States> void for_each_field(F&& f, States&... states) {
    f(states.hydraulics.spool...);
    f(states.hydraulics.spool_rate_1_s...);
    f(states.hydraulics.pressure_a_pa...);
    f(states.hydraulics.pressure_b_pa...);
    f(states.body.p_m...);
    f(states.body.q...);
    f(states.body.v_m_s...);
    f(states.body.w_platform_rad_s...);
    f(states.work.drive_j...);
    f(states.work.body_j...);
}

template <typename F, typename... States> void for_each_bristle(F&& f, States&... states) {
    f(states.rig.bristle_m...);
}

template <typename F, typename... States> void for_each_electric_field(F&& f, States&... states) {
    f(states.electric.current_a...);
    f(states.electric.lag_m...);
}

// The squared norm is divided out, because inside an RK4 step q is a unit quaternion only to O(h^2).
Matrix3 rotation_of(const Eigen::Vector4d& q) {
    const double w = q(0);
    const double x = q(1);
    const double y = q(2);
    const double z = q(3);
    const double s = 2.0 / q.squaredNorm();
    return (Matrix3() << 1.0 - s * (y * y + z * z), s * (x * y - w * z), s * (x * z + w * y), //
            s * (x * y + w * z), 1.0 - s * (x * x + z * z), s * (y * z - w * x),              //
            s * (x * z - w * y), s * (y * z + w * x), 1.0 - s * (x * x + y * y))
        .finished();
}

// q' = q (0, w) / 2, w in platform axes.
Eigen::Vector4d quaternion_rate(const Eigen::Vector4d& q, const Vector3& w) {
    return {-0.5 * (q(1) * w.x() + q(2) * w.y() + q(3) * w.z()),
            0.5 * (q(0) * w.x() + q(2) * w.z() - q(3) * w.y()),
            0.5 * (q(0) * w.y() + q(3) * w.x() - q(1) * w.z()),
            0.5 * (q(0) * w.z() + q(1) * w.y() - q(2) * w.x())};
}

Eigen::Vector4d quaternion_of(const Matrix3& R) {
    const Eigen::Quaterniond q(R);
    return {q.w(), q.x(), q.y(), q.z()};
}

// (3), the rows of J times the twist.
inline void set_speeds(const PlatformMotion& motion, LegRows& legs) {
    const Vector3& v = motion.v_m_s;
    const Vector3& w = motion.w_rad_s;
    legs.velocity_m_s = v.x() * legs.e_x + v.y() * legs.e_y + v.z() * legs.e_z + //
                        w.x() * legs.m_x + w.y() * legs.m_y + w.z() * legs.m_z;
}

std::optional<LowPass> low_pass(double bandwidth_hz, double step_s) {
    return bandwidth_hz > 0.0 ? std::optional<LowPass>(std::in_place, bandwidth_hz, step_s) : std::nullopt;
}

// Cubic through value and rate at both ends of a step.
Legs between(const LowPassState& begin, const LowPassState& end, double h_s, double share) {
    const double rest = 1.0 - share;
    return rest * rest * ((1.0 + 2.0 * share) * begin.value + share * h_s * begin.rate_1_s) +
           share * share * ((1.0 + 2.0 * rest) * end.value - rest * h_s * end.rate_1_s);
}

} // namespace

Plant::Plant(const Geometry& geometry, const Gravity& gravity, const HydraulicSettings& hydraulics,
             int substeps, const SixLegBars& leg_bars, const LowPasses& low_passes, double tick_s,
             const ElectricSettings& electric)
    : geometry_(geometry), gravity_(gravity), leg_bars_(leg_bars),
      bar_dynamics_(geometry, leg_bars, electric.exists() ? electric.reflected_mass_kg : 0.0),
      hydraulics_(hydraulics, geometry.stroke_min_m, geometry.stroke_max_m), electric_(electric),
      is_electric_(electric.exists()),
      has_load_cells_(is_electric_ && electric.force_signal == ForceSignal::load_cell),
      friction_(is_electric_ ? electric.friction : hydraulics.friction, tick_s / substeps),
      force_low_pass_(low_pass(low_passes.force_hz, tick_s / substeps)),
      velocity_low_pass_(low_pass(low_passes.velocity_hz, tick_s / substeps)), tick_s_(tick_s),
      substeps_(substeps), home_length_m_(geometry.home_leg_length_m.array()) {
    // An explicit step follows a current loop up to w x step = 1.
    constexpr double hz_per_substep = 150.0;
    const double most_hz = hz_per_substep * substeps * (1e-3 / tick_s);
    if (is_electric_ && electric.current_bandwidth_hz > most_hz) {
        throw InputError(fmt::format("electric.current_bandwidth_hz: found {}, expected at most {} x "
                                     "simulation.substeps = {:g}",
                                     electric.current_bandwidth_hz, hz_per_substep, most_hz));
    }
    for (int leg = 0; leg < 6; ++leg) {
        const Vector3& a = geometry.platform_hinges_m[static_cast<std::size_t>(leg)];
        const Vector3& b = geometry.base_hinges_m[static_cast<std::size_t>(leg)];
        platform_x_(leg) = a.x();
        platform_y_(leg) = a.y();
        platform_z_(leg) = a.z();
        base_x_(leg) = b.x();
        base_y_(leg) = b.y();
        base_z_(leg) = b.z() - geometry.home_height_m;
    }
}

void Plant::reset(const Pose& pose, const MassProperties& body) {
    set_body(body);
    const Vector6 force_n = standing_leg_forces(geometry_, body, leg_bars_, gravity_, pose);
    state_ = PlantState{};
    state_.body.p_m = pose.p_m;
    state_.body.q = quaternion_of(pose.R);
    if (is_electric_) {
        state_.electric = electric_.equilibrium(force_n.array());
    } else {
        state_.hydraulics = hydraulics_.equilibrium(force_n.array());
    }
    state_.rig.force_n.value = drive_force_n(state_);
    last_command_ = state_.hydraulics.spool;
    t_s_ = 0.0;
    coldness_ = friction_.coldness(t_s_);
}

void Plant::set_body(const MassProperties& body) {
    body_ = body;
    inverse_mass_1_kg_ = 1.0 / body.mass_kg;
    com_m_ = body.com_m();
    inertia_com_kg_m2_ = body.inertia_com_kg_m2();
    inertia_com_inverse_ = inertia_com_kg_m2_.inverse();
    posture_.is_current = false;
}

void Plant::advance(const Legs& spool_command, std::span<Glimpse> glimpses) {
    const double h_s = tick_s_ / substeps_;
    coldness_ = friction_.coldness(t_s_);
    Commands commands = commands_of(0, spool_command);
    for (int step = 0; step < substeps_; ++step) {
        if (is_electric_) {
            commands = commands_of(step, spool_command);
        }
        substep(commands, h_s);
        for (Glimpse& each : glimpses) {
            const double passed = each.share * substeps_;
            if (std::min(static_cast<int>(passed), substeps_ - 1) == step) {
                each.transducers = glimpse(h_s, passed - step);
            }
        }
        finish_substep(h_s);
    }
    last_command_ = spool_command;
    t_s_ += tick_s_;
}

Plant::Commands Plant::commands_of(int step, const Legs& command) const {
    if (!is_electric_) {
        return {command, command, command};
    }
    const auto at = [&](double substeps) -> Legs {
        return last_command_ + substeps / substeps_ * (command - last_command_);
    };
    return {at(step), at(step + 0.5), at(step + 1.0)};
}

void Plant::substep(const Commands& commands, double h_s) {
    PlantState& stage = stages_.at;
    const auto set_stage = [&](const PlantState& k, double step) {
        const auto move = [step](auto& y, const auto& y0, const auto& rate) { y = y0 + step * rate; };
        for_each_field(move, stage, state_, k);
        if (friction_.has_bristles()) {
            for_each_bristle(move, stage, state_, k);
        }
        if (is_electric_) {
            for_each_electric_field(move, stage, state_, k);
        }
    };
    const bool shares = bar_dynamics_.have_mass(); // else it is plain RK4
    Curvature bend;
    take_stage(0, state_, commands[0], stages_.k1);
    set_stage(stages_.k1, h_s / 2.0);
    if (shares) {
        bend = curvature(state_.body, stages_.k1.body);
        place(h_s / 2.0, bend);
        posture_.is_current = false;
    }
    take_stage(1, stage, commands[1], stages_.k2);
    set_stage(stages_.k2, h_s / 2.0);
    if (shares) {
        place(h_s / 2.0, bend);
    }
    take_stage(2, stage, commands[1], stages_.k3);
    if (shares) {
        bend = curvature(stage.body, stages_.k3.body);
    }
    set_stage(stages_.k3, h_s);
    if (shares) {
        place(h_s, bend);
        posture_.is_current = false;
    }
    take_stage(3, stage, commands[2], stages_.k4);
    filter_substep();
}

void Plant::take_stage(std::size_t stage, const PlantState& state, const Legs& spool_command,
                       PlantState& rate) {
    if (force_low_pass_ || velocity_low_pass_) {
        stages_.shown_n[stage] = differentiate(state, spool_command, posture_, rate);
        stages_.speed_m_s[stage] = posture_.legs.velocity_m_s;
    } else {
        differentiate(state, spool_command, posture_, rate);
    }
}

// Of fourth order as the step itself: with Runge-Kutta's weights Simpson's rule takes the middle from the
// mean of both stages there.
void Plant::filter_substep() {
    const auto seen = [](const std::array<Legs, 4>& stage) -> LowPassInput {
        return {stage[0], 0.5 * (stage[1] + stage[2]), stage[3]};
    };
    if (force_low_pass_) {
        stages_.end.force_n = force_low_pass_->after(state_.rig.force_n, seen(stages_.shown_n));
    }
    if (velocity_low_pass_) {
        stages_.end.velocity_m_s =
            velocity_low_pass_->after(state_.rig.velocity_m_s, seen(stages_.speed_m_s));
    }
}

// With q'' of q' = q (0, w) / 2.
Plant::Curvature Plant::curvature(const BodyState& body, const BodyState& rate) {
    return {rate.v_m_s, quaternion_rate(body.q, rate.w_platform_rad_s) -
                            0.25 * body.w_platform_rad_s.squaredNorm() * body.q};
}

// As in Nystrom's method for equations of second order (Hairer, Norsett, Wanner, II.14): both stages in the
// middle are at the mean of RK4's two poses. The next step begins where the fourth stage was but for h^3 p'''
// / 12, 1 nm at 1000 m/s^3.
void Plant::place(double after_s, const Curvature& curvature) {
    const BodyState& start = state_.body;
    stages_.at.body.p_m = start.p_m + after_s * (start.v_m_s + after_s / 2.0 * curvature.p_m_s2);
    stages_.at.body.q = start.q + after_s * (stages_.k1.body.q + after_s / 2.0 * curvature.q_1_s2);
}

void Plant::finish_substep(double h_s) {
    const auto move = [h_s](auto& y, const auto& r1, const auto& r2, const auto& r3, const auto& r4) {
        y += h_s / 6.0 * (r1 + r4 + 2.0 * (r2 + r3));
    };
    for_each_field(move, state_, stages_.k1, stages_.k2, stages_.k3, stages_.k4);
    if (friction_.has_bristles()) {
        for_each_bristle(move, state_, stages_.k1, stages_.k2, stages_.k3, stages_.k4);
    }
    if (is_electric_) {
        for_each_electric_field(move, state_, stages_.k1, stages_.k2, stages_.k3, stages_.k4);
    }
    state_.body.q.normalize();
    state_.rig.force_n = stages_.end.force_n;
    state_.rig.velocity_m_s = stages_.end.velocity_m_s;
}

// Hairer, Norsett, Wanner, Solving Ordinary Differential Equations I, II.6: the continuous extension of RK4.
LegState Plant::glimpse(double h_s, double share) const {
    const double share_3 = 2.0 / 3.0 * share * share * share;
    const double b1 = h_s * (share - 1.5 * share * share + share_3);
    const double b2 = h_s * (share * share - share_3);
    const double b4 = h_s * (share_3 - 0.5 * share * share);
    PlantState state;
    const auto move = [&](auto& y, const auto& y0, const auto& r1, const auto& r2, const auto& r3,
                          const auto& r4) { y = y0 + b1 * r1 + b2 * (r2 + r3) + b4 * r4; };
    for_each_field(move, state, state_, stages_.k1, stages_.k2, stages_.k3, stages_.k4);
    if (friction_.has_bristles()) {
        for_each_bristle(move, state, state_, stages_.k1, stages_.k2, stages_.k3, stages_.k4);
    }
    if (is_electric_) {
        for_each_electric_field(move, state, state_, stages_.k1, stages_.k2, stages_.k3, stages_.k4);
    }
    state.rig.force_n.value = between(state_.rig.force_n, stages_.end.force_n, h_s, share);
    state.rig.velocity_m_s.value = between(state_.rig.velocity_m_s, stages_.end.velocity_m_s, h_s, share);
    return transducers(state, legs(state));
}

PlantState Plant::derivative(const PlantState& state, const Legs& spool_command) const {
    PlantState rate;
    Posture posture;
    differentiate(state, spool_command, posture, rate);
    return rate;
}

Legs Plant::differentiate(const PlantState& state, const Legs& spool_command, Posture& posture,
                          PlantState& rate) const {
    if (!posture.is_current) {
        take(state.body, posture);
    }
    LegRows& legs = posture.legs;
    const PlatformMotion motion{posture.R.transpose() * state.body.v_m_s, state.body.w_platform_rad_s};
    set_speeds(motion, legs);
    const Legs drive_n = drive_force_n(state);
    const Legs body_n = friction_and_stops_n(state, legs, drive_n, rate);
    if (is_electric_) {
        electric_.differentiate(state.electric, spool_command, legs.velocity_m_s, rate.electric);
    } else {
        hydraulics_.differentiate(state.hydraulics, spool_command, legs.displacement_m, legs.velocity_m_s,
                                  rate.hydraulics);
    }
    if (bar_dynamics_.have_mass()) {
        differentiate_with_legs(state.body, posture, motion, body_n, rate.body);
    } else {
        differentiate_body(state.body, posture.R, legs, body_n, rate.body);
    }
    rate.work.drive_j = (drive_n * legs.velocity_m_s).sum();
    rate.work.body_j = (body_n * legs.velocity_m_s).sum();
    return has_load_cells_ ? cell_force_n(state, posture.R, legs, body_n, rate.body) : drive_n;
}

Legs Plant::drive_force_n(const PlantState& state) const {
    return is_electric_ ? electric_.force_n(state.electric) : hydraulics_.force_n(state.hydraulics);
}

// What the drives push the platform and the legs' mass with.
Legs Plant::friction_and_stops_n(const PlantState& state, const LegRows& legs, const Legs& drive_n,
                                 PlantState& rate) const {
    Legs body_n = drive_n;
    if (friction_.exists()) {
        const FrictionForce friction =
            friction_.at(legs.velocity_m_s, drive_n, state.rig.bristle_m, coldness_);
        body_n -= friction.force_n;
        rate.rig.bristle_m = friction.bristle_rate_m_s;
    }
    body_n += hydraulics_.stop_force_n(legs.displacement_m, legs.velocity_m_s);
    return body_n;
}

// Between the screw and the rest: without reflected mass x l'', l'' = e (a_O + w' x a + w x (w x a)) + |u|^2
// across the leg / l.
Legs Plant::cell_force_n(const PlantState& state, const Matrix3& R, const LegRows& legs, const Legs& body_n,
                         const BodyState& rate) const {
    const Vector3& w = state.body.w_platform_rad_s;
    const Vector3 v = R.transpose() * state.body.v_m_s;
    const Vector3 a = R.transpose() * rate.v_m_s;
    Legs l_rate2;
    for (int leg = 0; leg < 6; ++leg) {
        const Vector3 e(legs.e_x(leg), legs.e_y(leg), legs.e_z(leg));
        const Vector3 arm(platform_x_(leg), platform_y_(leg), platform_z_(leg));
        const Vector3 u = v + w.cross(arm);
        const double across_square = u.squaredNorm() - legs.velocity_m_s(leg) * legs.velocity_m_s(leg);
        l_rate2(leg) = e.dot(a + rate.w_platform_rad_s.cross(arm) + w.cross(w.cross(arm))) +
                       across_square / legs.length_m(leg);
    }
    return body_n - electric_.settings().reflected_mass_kg * l_rate2;
}

void Plant::take(const BodyState& body, Posture& posture) const {
    posture.R = rotation_of(body.q);
    leg_directions(body, posture.R, posture.legs);
    if (bar_dynamics_.have_mass()) {
        posture.bars = bar_dynamics_.at(body_, posture.legs, posture.R.transpose() * gravity_.up_m_s2);
    }
    posture.is_current = bar_dynamics_.have_mass();
}

// (1)-(3), six legs at once, in platform axes, where the arms a_i are constant.
void Plant::leg_directions(const BodyState& body, const Matrix3& R, LegRows& legs) const {
    const Vector3 p = R.transpose() * body.p_m;
    const Legs leg_x = platform_x_ + p.x() - (R(0, 0) * base_x_ + R(1, 0) * base_y_ + R(2, 0) * base_z_);
    const Legs leg_y = platform_y_ + p.y() - (R(0, 1) * base_x_ + R(1, 1) * base_y_ + R(2, 1) * base_z_);
    const Legs leg_z = platform_z_ + p.z() - (R(0, 2) * base_x_ + R(1, 2) * base_y_ + R(2, 2) * base_z_);
    legs.length_m = (leg_x.square() + leg_y.square() + leg_z.square()).sqrt();
    const Legs inverse_length = 1.0 / legs.length_m;
    legs.e_x = leg_x * inverse_length;
    legs.e_y = leg_y * inverse_length;
    legs.e_z = leg_z * inverse_length;
    legs.displacement_m = legs.length_m - home_length_m_;

    legs.m_x = platform_y_ * legs.e_z - platform_z_ * legs.e_y;
    legs.m_y = platform_z_ * legs.e_x - platform_x_ * legs.e_z;
    legs.m_z = platform_x_ * legs.e_y - platform_y_ * legs.e_x;
}

// (9)-(12) about the combined centre of mass, in platform axes: m a_c = F + m g, I_c w' = T_c - w x I_c w.
void Plant::differentiate_body(const BodyState& body, const Matrix3& R, const LegRows& legs,
                               const Legs& force_n, BodyState& rate) const {
    const Vector3 force((force_n * legs.e_x).sum(), (force_n * legs.e_y).sum(), (force_n * legs.e_z).sum());
    const Vector3 moment((force_n * legs.m_x).sum(), (force_n * legs.m_y).sum(), (force_n * legs.m_z).sum());

    const Vector3& w = body.w_platform_rad_s;
    const Vector3 moment_com = moment - com_m_.cross(force);
    const Vector3 w_rate = inertia_com_inverse_ * (moment_com - w.cross(inertia_com_kg_m2_ * w));
    // a_A = a_c - w' x c - w x (w x c)
    const Vector3 centre_from_com = -w_rate.cross(com_m_) - w.cross(w.cross(com_m_));

    rate.p_m = body.v_m_s;
    rate.q = quaternion_rate(body.q, w);
    rate.v_m_s = R * (force * inverse_mass_1_kg_ + centre_from_com) - gravity_.up_m_s2;
    rate.w_platform_rad_s = w_rate;
}

// (11) about O_A in platform axes, with the legs' masses at their hinges.
void Plant::differentiate_with_legs(const BodyState& body, const Posture& posture,
                                    const PlatformMotion& motion, const Legs& force_n,
                                    BodyState& rate) const {
    const Vector6 twist_rate =
        posture.bars.inverse.acceleration(bar_dynamics_.driving(posture.bars, posture.legs, motion, force_n));
    rate.p_m = body.v_m_s;
    rate.q = quaternion_rate(body.q, motion.w_rad_s);
    rate.v_m_s = posture.R * twist_rate.head<3>();
    rate.w_platform_rad_s = twist_rate.tail<3>();
}

Pose Plant::pose() const {
    return {state_.body.p_m, rotation_of(state_.body.q)};
}

Twist Plant::twist() const {
    return {state_.body.v_m_s, rotation_of(state_.body.q) * state_.body.w_platform_rad_s};
}

LegState Plant::legs() const {
    return legs(state_);
}

LegState Plant::legs(const PlantState& state) const {
    if (has_load_cells_) {
        PlantState rate;
        Posture posture;
        const Legs shown_n = differentiate(state, Legs::Zero(), posture, rate);
        return {posture.legs.displacement_m, posture.legs.velocity_m_s, shown_n};
    }
    LegRows legs;
    const Matrix3 R = rotation_of(state.body.q);
    leg_directions(state.body, R, legs);
    const PlatformMotion motion{R.transpose() * state.body.v_m_s, state.body.w_platform_rad_s};
    set_speeds(motion, legs);
    return {legs.displacement_m, legs.velocity_m_s, drive_force_n(state)};
}

LegState Plant::transducers(const PlantState& state, const LegState& legs) const {
    return {legs.displacement_m, velocity_low_pass_ ? state.rig.velocity_m_s.value : legs.velocity_m_s,
            force_low_pass_ ? state.rig.force_n.value : legs.force_n};
}

double Plant::kinetic_energy_j() const {
    return sim::kinetic_energy_j(body_, pose().R, twist()) +
           leg_kinetic_energy_j(geometry_, leg_bars_, pose(), twist()) +
           (is_electric_ ? 0.5 * electric_.settings().reflected_mass_kg : 0.0) *
               leg_velocity(geometry_, pose(), twist()).array().square().sum();
}

double Plant::potential_energy_j() const {
    return sim::potential_energy_j(body_, gravity_, pose()) +
           leg_potential_energy_j(geometry_, leg_bars_, gravity_, pose());
}

} // namespace hexload::sim
