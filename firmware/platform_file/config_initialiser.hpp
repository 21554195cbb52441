// The firmware's configuration as C source, for a controller that has no file system.
#pragma once

#include <hexload/config.h>

#include <string>

namespace hexload::platform {

// "{ ... }" with a designated initialiser for each field, in the order of hexload_config_t, so that C11 and
// C++20 take it. Each number has the fewest digits that give its bits again; units stand as comments.
// Directions beyond direction_count are left out: zeros. The configuration is one that hexload_config_check()
// accepts.
std::string config_initialiser(const hexload_config_t& config);

} // namespace hexload::platform
