// The rig file of `hexload commission`: what one machine of a platform file is like.
#pragma once

#include "platform_file.hpp"

namespace hexload::platform {

// The platform file's machine with the hinges, body, gravity and delays of the rig file's table [rig], and
// the rest of it as `rig`. Other tables are the tools' own. Throws InputError as load_platform_file(), and
// where the rig file was made with another platform file's machine.
PlatformFile with_rig_file(PlatformFile platform, const std::filesystem::path& path);

} // namespace hexload::platform
