#include <hexload_sim/sensors.hpp>

#include <cmath>

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

} // namespace

Sensors::Sensors(const SensorSettings& settings, const SensorSigma& sigma, std::uint64_t seed)
    : settings_(settings), sigma_{settings.noise_scale * sigma.displacement_sigma_m,
                                  settings.noise_scale * sigma.velocity_sigma_m_s,
                                  settings.noise_scale * sigma.force_sigma_n},
      displacement_noise_(seed, RandomPurpose::displacement_noise),
      velocity_noise_(seed, RandomPurpose::velocity_noise), force_noise_(seed, RandomPurpose::force_noise),
      dropout_(seed, RandomPurpose::dropout), history_(static_cast<std::size_t>(settings.delay_ticks) + 1) {}

std::optional<LegSample> Sensors::sample(std::uint32_t tick, const LegState& legs) {
    const LegState seen = delayed(tick, legs);
    // Noise is drawn for lost samples too, so that the others do not depend on the losses.
    const LegSample sample{
        tick,
        static_cast<double>(tick) / 1000.0, // nearest double of the decimal, prints short
        transduced(seen.displacement_m, settings_.displacement_bias_m, sigma_.displacement_sigma_m,
                   settings_.displacement_step_m, displacement_noise_),
        transduced(seen.velocity_m_s, settings_.velocity_bias_m_s, sigma_.velocity_sigma_m_s,
                   settings_.velocity_step_m_s, velocity_noise_),
        transduced(seen.force_n, settings_.force_bias_n, sigma_.force_sigma_n, settings_.force_step_n,
                   force_noise_)};
    if (dropout_.uniform() < settings_.dropout_probability) {
        return std::nullopt;
    }
    return sample;
}

LegState Sensors::delayed(std::uint32_t tick, const LegState& legs) {
    if (tick == 0) {
        std::fill(history_.begin(), history_.end(), legs);
    }
    history_[tick % history_.size()] = legs;
    return history_[(tick + 1) % history_.size()];
}

} // namespace hexload::sim
