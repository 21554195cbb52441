#include <hexload_sim/plant.hpp>

#include <Eigen/Cholesky>
#include <Eigen/Geometry>
#include <Eigen/LU>

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
    f(states.work.hydraulic_j...);
    f(states.work.body_j...);
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

} // namespace

Plant::Plant(const Geometry& geometry, double gravity_m_s2, const HydraulicSettings& hydraulics, int substeps,
             const LegBars& leg_bars)
    : geometry_(geometry), gravity_m_s2_(gravity_m_s2), leg_bars_(leg_bars),
      hydraulics_(hydraulics, geometry.stroke_min_m, geometry.stroke_max_m), substeps_(substeps),
      home_length_m_(geometry.home_leg_length_m.array()) {
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
    const Vector6 force_n = standing_leg_forces(geometry_, body, leg_bars_, gravity_m_s2_, pose);
    state_ = PlantState{};
    state_.body.p_m = pose.p_m;
    state_.body.q = quaternion_of(pose.R);
    state_.hydraulics = hydraulics_.equilibrium(force_n.array());
}

void Plant::set_body(const MassProperties& body) {
    body_ = body;
    inverse_mass_1_kg_ = 1.0 / body.mass_kg;
    com_m_ = body.com_m();
    inertia_com_kg_m2_ = body.inertia_com_kg_m2();
    inertia_com_inverse_ = inertia_com_kg_m2_.inverse();
}

void Plant::advance(const Legs& spool_command) {
    const double h = tick_s / substeps_;
    PlantState k1;
    PlantState k2;
    PlantState k3;
    PlantState k4;
    PlantState stage;
    const auto set_stage = [&](const PlantState& k, double step) {
        for_each_field([step](auto& y, const auto& y0, const auto& rate) { y = y0 + step * rate; }, stage,
                       state_, k);
    };
    for (int substep = 0; substep < substeps_; ++substep) {
        differentiate(state_, spool_command, k1);
        set_stage(k1, h / 2.0);
        differentiate(stage, spool_command, k2);
        set_stage(k2, h / 2.0);
        differentiate(stage, spool_command, k3);
        set_stage(k3, h);
        differentiate(stage, spool_command, k4);
        for_each_field([h](auto& y, const auto& r1, const auto& r2, const auto& r3,
                           const auto& r4) { y += h / 6.0 * (r1 + r4 + 2.0 * (r2 + r3)); },
                       state_, k1, k2, k3, k4);
        state_.body.q.normalize();
    }
}

PlantState Plant::derivative(const PlantState& state, const Legs& spool_command) const {
    PlantState rate;
    differentiate(state, spool_command, rate);
    return rate;
}

void Plant::differentiate(const PlantState& state, const Legs& spool_command, PlantState& rate) const {
    const Matrix3 R = rotation_of(state.body.q);
    LegKinematics legs;
    leg_kinematics(state.body, R, legs);
    const Legs hydraulic_n = hydraulics_.force_n(state.hydraulics);
    const Legs body_n = hydraulic_n - hydraulics_.friction_n(legs.velocity_m_s) +
                        hydraulics_.stop_force_n(legs.displacement_m, legs.velocity_m_s);

    hydraulics_.differentiate(state.hydraulics, spool_command, legs.displacement_m, legs.velocity_m_s,
                              rate.hydraulics);
    if (leg_bars_.have_mass()) {
        differentiate_with_legs(state.body, R, legs, body_n, rate.body);
    } else {
        differentiate_body(state.body, R, legs, body_n, rate.body);
    }
    rate.work.hydraulic_j = (hydraulic_n * legs.velocity_m_s).sum();
    rate.work.body_j = (body_n * legs.velocity_m_s).sum();
}

// (1)-(3), six legs at once, in platform axes, where the arms a_i are constant.
void Plant::leg_kinematics(const BodyState& body, const Matrix3& R, LegKinematics& legs) const {
    const Vector3 p = R.transpose() * body.p_m;
    const Legs leg_x = platform_x_ + p.x() - (R(0, 0) * base_x_ + R(1, 0) * base_y_ + R(2, 0) * base_z_);
    const Legs leg_y = platform_y_ + p.y() - (R(0, 1) * base_x_ + R(1, 1) * base_y_ + R(2, 1) * base_z_);
    const Legs leg_z = platform_z_ + p.z() - (R(0, 2) * base_x_ + R(1, 2) * base_y_ + R(2, 2) * base_z_);
    const Legs length_m = (leg_x.square() + leg_y.square() + leg_z.square()).sqrt();
    const Legs inverse_length = 1.0 / length_m;
    legs.e_x = leg_x * inverse_length;
    legs.e_y = leg_y * inverse_length;
    legs.e_z = leg_z * inverse_length;
    legs.displacement_m = length_m - home_length_m_;

    legs.m_x = platform_y_ * legs.e_z - platform_z_ * legs.e_y;
    legs.m_y = platform_z_ * legs.e_x - platform_x_ * legs.e_z;
    legs.m_z = platform_x_ * legs.e_y - platform_y_ * legs.e_x;
    const Vector3 v = R.transpose() * body.v_m_s;
    const Vector3& w = body.w_platform_rad_s;
    legs.velocity_m_s = v.x() * legs.e_x + v.y() * legs.e_y + v.z() * legs.e_z + //
                        w.x() * legs.m_x + w.y() * legs.m_y + w.z() * legs.m_z;
}

// (9)-(12) about the combined centre of mass, in platform axes: m a_c = F + m g, I_c w' = T_c - w x I_c w.
void Plant::differentiate_body(const BodyState& body, const Matrix3& R, const LegKinematics& legs,
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
    rate.v_m_s = R * (force * inverse_mass_1_kg_ + centre_from_com) - Vector3(0.0, 0.0, gravity_m_s2_);
    rate.w_platform_rad_s = w_rate;
}

// (11) about O_A in base axes, with the legs' masses at their hinges.
void Plant::differentiate_with_legs(const BodyState& body, const Matrix3& R, const LegKinematics& legs,
                                    const Legs& force_n, BodyState& rate) const {
    const Pose pose{body.p_m, R};
    const Twist twist{body.v_m_s, R * body.w_platform_rad_s};
    const LegWrench bars = leg_wrench(geometry_, leg_bars_, gravity_m_s2_, pose, twist);
    Vector6 net;
    net << R * Vector3((force_n * legs.e_x).sum(), (force_n * legs.e_y).sum(), (force_n * legs.e_z).sum()),
        R * Vector3((force_n * legs.m_x).sum(), (force_n * legs.m_y).sum(), (force_n * legs.m_z).sum());
    net -= bias_wrench(body_, R, twist.w_rad_s) + gravity_wrench(body_, R, gravity_m_s2_) + bars.bias;
    const Matrix6 mass = mass_matrix(body_, R) + bars.mass;
    const Vector6 twist_rate = mass.llt().solve(net);
    rate.p_m = body.v_m_s;
    rate.q = quaternion_rate(body.q, body.w_platform_rad_s);
    rate.v_m_s = twist_rate.head<3>();
    rate.w_platform_rad_s = R.transpose() * twist_rate.tail<3>();
}

Pose Plant::pose() const {
    return {state_.body.p_m, rotation_of(state_.body.q)};
}

Twist Plant::twist() const {
    return {state_.body.v_m_s, rotation_of(state_.body.q) * state_.body.w_platform_rad_s};
}

LegState Plant::legs() const {
    LegKinematics legs;
    leg_kinematics(state_.body, rotation_of(state_.body.q), legs);
    return {legs.displacement_m, legs.velocity_m_s, hydraulics_.force_n(state_.hydraulics)};
}

double Plant::kinetic_energy_j() const {
    return sim::kinetic_energy_j(body_, pose().R, twist()) +
           leg_kinetic_energy_j(geometry_, leg_bars_, pose(), twist());
}

double Plant::potential_energy_j() const {
    return sim::potential_energy_j(body_, gravity_m_s2_, pose()) +
           leg_potential_energy_j(geometry_, leg_bars_, gravity_m_s2_, pose());
}

} // namespace hexload::sim
