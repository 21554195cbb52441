// From what the legs do to what the estimator sees: delay, gain, bias, noise, quantisation, float32, dropout.
// The low-passes come first and are part of the plant.
#pragma once

#include "platform_file/platform_file.hpp"

#include <hexload_sim/estimator_link.hpp>
#include <hexload_sim/low_pass.hpp>
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
    Legs force_gain = Legs::Ones(); // reading over force, before the bias
    LowPasses low_passes;
    bool velocity_sensor = true; // false: the log has no vl1 ... vl6, the sample's velocity is not a number
    double displacement_step_m = 0.0; // quantisation; 0 = none
    double velocity_step_m_s = 0.0;
    double force_step_n = 0.0;
    std::int64_t delay_ticks = 0; // values are this old; before that, those of the first tick
    double force_delay_s = 0.0;   // of this channel, besides delay_ticks: any fraction of a tick
    double velocity_delay_s = 0.0;
    double dropout_probability = 0.0; // chance that a whole sample is missing
};

// A delay as whole ticks and the share, 0 to 1 without 1, of a tick that is left.
struct Delay {
    std::int64_t ticks = 0;
    double share = 0.0;
};
Delay delay_of(double delay_s, double tick_s);

// What has happened to a leg's sensors during the run.
struct SensorFault {
    double force_offset_n = 0.0; // that the force sensor says too much
    bool velocity_negated = false;
};

class Sensors {
  public:
    Sensors(const SensorSettings& settings, const SensorSigma& sigma, std::uint64_t seed);

    // Once per tick, with what the transducers say now; of the channels with a delay, what they said the
    // share of a tick before. Nothing: the sample was lost.
    std::optional<LegSample> sample(std::uint32_t tick, const LegState& transducers);

    // From the next sample on; replaces what the leg, 0 to 5, had before.
    void set_fault(int leg, const SensorFault& fault);

    // The last sample, also if it was lost, as a servo reads it. Without a velocity sensor it takes the
    // difference of displacement.
    const LegState& reading() const {
        return reading_;
    }

    // Standard deviations in use: noise_scale times the platform file's.
    const SensorSigma& sigma() const {
        return sigma_;
    }

  private:
    LegState delayed(std::uint32_t tick, const LegState& transducers);
    void read(const LegSample& sample);

    SensorSettings settings_;
    Vector6 force_offset_n_ = Vector6::Zero(); // of faults
    Legs velocity_sign_ = Legs::Ones();
    SensorSigma sigma_;
    RandomStream displacement_noise_;
    RandomStream velocity_noise_;
    RandomStream force_noise_;
    RandomStream dropout_;
    std::uint32_t velocity_ticks_; // delay
    std::uint32_t force_ticks_;
    std::vector<LegState> history_; // ring of the longest delay + 1
    LegState reading_;
};

} // namespace hexload::sim
