#pragma once

#include "platform_file/input_error.hpp"

#include <cerrno>
#include <cstring>
#include <filesystem>

namespace hexload::sim {

// Right after the call that has failed: errno says why.
[[noreturn]] inline void throw_write_error(const std::filesystem::path& path) {
    throw platform::InputError(path.string() + ": cannot be written: " + std::strerror(errno));
}

} // namespace hexload::sim
