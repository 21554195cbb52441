#include <hexload_sim/sensors.hpp>

#include <algorithm>
#include <cmath>
#include <limits>

namespace hexload::sim {
namespace {

Vector6 transduced(const Legs& truth, const Vector6& bias, double sigma, double step, RandomStream& noise) {
    Vector6 value = truth.matrix() + bias;
    for (int leg = 0; leg < 6; ++leg) {
        if (sigma > 0.0) {
            value(leg) += sigma * noise.normal();
        }
        if (step > 0.0) {
            value(leg) = step * std::round(value(leg) / step);
        }
        // Leg by leg: gcc 12 optimises the rounding of Eigen's cast<float>().cast<double>() away for two of
        // six legs.
        value(leg) = static_cast<double>(static_cast<float>(value(leg)));
    }
    return value;
}

constexpr double same_instant = 1e-6; // of a tick: rounding of a delay in s

} // namespace

Delay delay_of(double delay_s, double tick_s) {
    const double ticks = delay_s / tick_s;
    const double whole = std::floor(ticks + same_instant);
    const double share = ticks - whole;
    return {static_cast<std::int64_t>(whole), share > same_instant ? share : 0.0};
}

Sensors::Sensors(const SensorSettings& settings, const SensorSigma& sigma, std::uint64_t seed)
    : settings_(settings), sigma_{settings.noise_scale * sigma.displacement_sigma_m,
                                  settings.noise_scale * sigma.velocity_sigma_m_s,
                                  settings.noise_scale * sigma.force_sigma_n,
                                  sigma.force_delay_s,
                                  sigma.velocity_delay_s,
                                  sigma.has_velocity,
                                  sigma.tick_s},
      displacement_noise_(seed, RandomPurpose::displacement_noise),
      velocity_noise_(seed, RandomPurpose::velocity_noise), force_noise_(seed, RandomPurpose::force_noise),
      dropout_(seed, RandomPurpose::dropout),
      velocity_ticks_(static_cast<std::uint32_t>(settings.delay_ticks +
                                                 delay_of(settings.velocity_delay_s, sigma.tick_s).ticks)),
      force_ticks_(static_cast<std::uint32_t>(settings.delay_ticks +
                                              delay_of(settings.force_delay_s, sigma.tick_s).ticks)),
      history_(std::max(velocity_ticks_, force_ticks_) + 1) {}

std::optional<LegSample> Sensors::sample(std::uint32_t tick, const LegState& transducers) {
    const LegState seen = delayed(tick, transducers);
    // Noise is drawn for lost samples too, so that the others do not depend on the losses.
    LegSample sample{tick, time_of_tick_s(tick, sigma_.tick_s),
                     transduced(seen.displacement_m, settings_.displacement_bias_m,
                                sigma_.displacement_sigma_m, settings_.displacement_step_m,
                                displacement_noise_),
                     transduced(velocity_sign_ * seen.velocity_m_s, settings_.velocity_bias_m_s,
                                sigma_.velocity_sigma_m_s, settings_.velocity_step_m_s, velocity_noise_),
                     transduced(settings_.force_gain * seen.force_n, settings_.force_bias_n + force_offset_n_,
                                sigma_.force_sigma_n, settings_.force_step_n, force_noise_)};
    read(sample);
    if (!settings_.velocity_sensor) {
        sample.velocity_m_s.setConstant(std::numeric_limits<double>::quiet_NaN());
    }
    if (dropout_.uniform() < settings_.dropout_probability) {
        return std::nullopt;
    }
    return sample;
}

void Sensors::set_fault(int leg, const SensorFault& fault) {
    force_offset_n_(leg) = fault.force_offset_n;
    velocity_sign_(leg) = fault.velocity_negated ? -1.0 : 1.0;
}

void Sensors::read(const LegSample& sample) {
    const Legs before_m = sample.tick == 0 ? Legs(sample.displacement_m.array()) : reading_.displacement_m;
    reading_ = {sample.displacement_m.array(), sample.velocity_m_s.array(), sample.force_n.array()};
    if (!settings_.velocity_sensor) {
        reading_.velocity_m_s = (reading_.displacement_m - before_m) / sigma_.tick_s;
    }
}

LegState Sensors::delayed(std::uint32_t tick, const LegState& transducers) {
    if (tick == 0) {
        std::fill(history_.begin(), history_.end(), transducers);
    }
    const auto size = static_cast<std::uint32_t>(history_.size());
    history_[tick % size] = transducers;
    const auto ago = [&](std::uint32_t ticks) -> const LegState& {
        return history_[(tick % size + size - ticks) % size];
    };
    return {ago(static_cast<std::uint32_t>(settings_.delay_ticks)).displacement_m,
            ago(velocity_ticks_).velocity_m_s, ago(force_ticks_).force_n};
}

} // namespace hexload::sim
