// From what the legs do to what the estimator sees: delay, bias, noise, quantisation, float32, dropout.
#pragma once

#include <hexload_sim/estimator_link.hpp>
#include <hexload_sim/platform_file.hpp>
#include <hexload_sim/random.hpp>

#include <cstdint>
#include <optional>
#include <vector>

namespace hexload::sim {

// All defaults are those of an ideal sensor with the platform file's white noise.
struct SensorSettings {
    double noise_scale = 1.0; // times the platform file's standard deviations; 0 = noise-free
    Vector6 displacement_bias_m = Vector6::Zero();
    Vector6 velocity_bias_m_s = Vector6::Zero();
    Vector6 force_bias_n = Vector6::Zero();
    double displacement_step_m = 0.0; // quantisation; 0 = none
    double velocity_step_m_s = 0.0;
    double force_step_n = 0.0;
    std::int64_t delay_ticks = 0;     // values are this old; before that, those of the first tick
    double dropout_probability = 0.0; // chance that a whole sample is missing
};

class Sensors {
  public:
    Sensors(const SensorSettings& settings, const SensorSigma& sigma, std::uint64_t seed);

    // Once per tick. Nothing: the sample was lost.
    std::optional<LegSample> sample(std::uint32_t tick, const LegState& legs);

    // Standard deviations in use: noise_scale times the platform file's.
    const SensorSigma& sigma() const {
        return sigma_;
    }

  private:
    LegState delayed(std::uint32_t tick, const LegState& legs);

    SensorSettings settings_;
    SensorSigma sigma_;
    RandomStream displacement_noise_;
    RandomStream velocity_noise_;
    RandomStream force_noise_;
    RandomStream dropout_;
    std::vector<LegState> history_; // ring of delay_ticks + 1
};

} // namespace hexload::sim
