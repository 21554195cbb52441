// From the platform file to the firmware's configuration.
#pragma once

#include "platform_file.hpp"

#include <hexload/hexload.h>

namespace hexload::platform {

// The firmware's defaults with everything that the platform file says put in. Without a known load mass the
// default mass stays; only the paper's filter reads it.
hexload_config_t firmware_config(const PlatformFile& platform, const EstimatorSettings& settings,
                                 double sampling_s);

// The same, for an estimator that is to run: throws InputError where the platform file lacks the known load
// mass that the paper's filter needs, or where the firmware refuses a field.
hexload_config_t checked_firmware_config(const PlatformFile& platform, const EstimatorSettings& settings,
                                         double sampling_s);

} // namespace hexload::platform
