// From the platform file to the firmware's configuration.
#pragma once

#include <hexload_sim/platform_file.hpp>

#include <hexload/hexload.h>

namespace hexload::sim {

void copy_to_firmware(const Vector6& from, hexload_real_t (&to)[HEXLOAD_LEGS]);

// The firmware's defaults with everything that the platform file says put in. Without a known load mass the
// default mass stays; only the paper's filter reads it.
hexload_config_t firmware_config(const PlatformFile& platform, const EstimatorSettings& settings,
                                 double sampling_s);

} // namespace hexload::sim
