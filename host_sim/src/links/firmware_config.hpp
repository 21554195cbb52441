// From the platform file to the firmware's configuration.
#pragma once

#include <hexload_sim/estimator_link.hpp>
#include <hexload_sim/platform_file.hpp>

#include <hexload/hexload.h>

namespace hexload::sim {

void copy_to_firmware(const Vector6& from, hexload_real_t (&to)[HEXLOAD_LEGS]);

hexload_leg_sample_t firmware_sample(const LegSample& sample);

// The firmware's defaults with everything that the platform file says put in. Without a known load mass the
// default mass stays; only the paper's filter reads it.
hexload_config_t firmware_config(const PlatformFile& platform, const EstimatorSettings& settings,
                                 double sampling_s);

// The same, for an estimator that is to run: throws InputError where the platform file lacks the known load
// mass that the paper's filter needs, or where the firmware refuses a field.
hexload_config_t checked_firmware_config(const PlatformFile& platform, const EstimatorSettings& settings,
                                         double sampling_s);

} // namespace hexload::sim
