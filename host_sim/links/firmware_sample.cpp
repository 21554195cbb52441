#include "firmware_sample.hpp"

#include <algorithm>

namespace hexload::sim {

void copy_to_firmware(const Vector6& from, hexload_real_t (&to)[HEXLOAD_LEGS]) {
    std::transform(from.begin(), from.end(), to,
                   [](double value) { return static_cast<hexload_real_t>(value); });
}

hexload_leg_sample_t firmware_sample(const LegSample& sample) {
    hexload_leg_sample_t legs{};
    legs.tick = sample.tick;
    copy_to_firmware(sample.displacement_m, legs.displacement_m);
    copy_to_firmware(sample.velocity_m_s, legs.velocity_m_s);
    copy_to_firmware(sample.force_n, legs.force_n);
    return legs;
}

} // namespace hexload::sim
