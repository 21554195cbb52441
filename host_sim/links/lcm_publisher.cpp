#include "lcm_publisher.hpp"

#include "firmware_sample.hpp"

#include "transport/lcm_messages.hpp"

#include <hexload_sim/kinematics.hpp>
#include <hexload_sim/rotation.hpp>

#include <algorithm>

namespace hexload::sim {

namespace {

template <typename Vector, std::size_t count> void copy(const Vector& from, double (&to)[count]) {
    static_assert(Vector::SizeAtCompileTime == count);
    std::copy(from.begin(), from.end(), to);
}

platform_state_t state_message(const Tick& tick) {
    platform_state_t message{};
    message.tick = tick.index;
    copy(tick.pose.p_m, message.position_m);
    copy(rpy_from_rotation(tick.pose.R), message.roll_pitch_yaw_rad);
    copy(tick.twist.v_m_s, message.velocity_m_s);
    copy(tick.twist.w_rad_s, message.angular_velocity_rad_s);
    return message;
}

load_truth_t load_message(const Tick& tick, const Load& load) {
    load_truth_t message{};
    message.tick = tick.index;
    message.mass_kg = load.mass_kg;
    copy(load.com_m, message.com_m);
    const Matrix3& inertia = load.inertia_com_kg_m2;
    const Vector6 entries{
        {inertia(0, 0), inertia(1, 1), inertia(2, 2), inertia(0, 1), inertia(0, 2), inertia(1, 2)}};
    copy(entries, message.inertia_kg_m2);
    return message;
}

// (12), turned into platform axes.
wrench_t wrench_message(const Tick& tick, const Geometry& geometry) {
    const Vector6 wrench = jacobian(geometry, tick.pose).transpose() * tick.legs.force_n.matrix();
    wrench_t message{};
    message.tick = tick.index;
    copy(Vector3(tick.pose.R.transpose() * wrench.head<3>()), message.force_n);
    copy(Vector3(tick.pose.R.transpose() * wrench.tail<3>()), message.moment_n_m);
    return message;
}

} // namespace

LcmPublisher::LcmPublisher(const std::string& url, const Geometry& geometry, PublishSamples samples)
    : session_(url), geometry_(geometry), publishes_samples_(samples) {}

void LcmPublisher::publish(const Tick& tick, const Load& load) {
    if (tick.sample && publishes_samples_ == PublishSamples::yes) {
        leg_sample_t sample = transport::leg_sample_message(firmware_sample(*tick.sample));
        samples_.send(sample);
    }
    platform_state_t state = state_message(tick);
    load_truth_t truth = load_message(tick, load);
    wrench_t wrench = wrench_message(tick, geometry_);
    states_.send(state);
    loads_.send(truth);
    wrenches_.send(wrench);
}

void LcmPublisher::publish(const UpdateTrace& trace) {
    innovation_t message{};
    message.tick = trace.tick;
    message.dimension = static_cast<std::int32_t>(trace.dimension);
    for (std::size_t k = 0; k < trace.dimension; k++) {
        message.innovation.push_back(static_cast<float>(trace.innovation[k]));
        message.variance.push_back(static_cast<float>(trace.variance[k]));
    }
    message.nis = static_cast<float>(trace.nis);
    message.sum_nis = static_cast<float>(trace.sum_nis);
    message.sum_nis_mean = static_cast<float>(trace.sum_nis_mean);
    message.gate = trace.gate;
    innovations_.send(message);
}

std::uint64_t LcmPublisher::failed() const {
    return samples_.failed() + states_.failed() + loads_.failed() + wrenches_.failed() +
           innovations_.failed();
}

} // namespace hexload::sim
