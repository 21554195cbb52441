// From the simulator's leg sample to the firmware's.
#pragma once

#include <hexload/hexload.h>
#include <hexload_sim/estimator_link.hpp>

namespace hexload::sim {

void copy_to_firmware(const Vector6& from, hexload_real_t (&to)[HEXLOAD_LEGS]);

hexload_leg_sample_t firmware_sample(const LegSample& sample);

} // namespace hexload::sim
