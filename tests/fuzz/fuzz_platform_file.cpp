// Platform files: read and refused with words, or made a configuration that the firmware takes or refuses.
#include "bytes.h"

#include "platform_file/firmware_config.hpp"
#include "platform_file/input_error.hpp"
#include "platform_file/rig_file.hpp"

#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <string>

namespace {

// One file for all inputs of this process.
struct Scratch {
    std::filesystem::path path =
        std::filesystem::temp_directory_path() / ("hexload-fuzz-" + std::to_string(getpid()) + ".toml");
    Scratch() = default;
    Scratch(const Scratch&) = delete;
    Scratch& operator=(const Scratch&) = delete;
    ~Scratch() {
        std::error_code ignored;
        std::filesystem::remove(path, ignored);
    }
};

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    using namespace hexload::platform;
    static const Scratch scratch;
    std::ofstream(scratch.path, std::ios::binary)
        .write(reinterpret_cast<const char*>(data), static_cast<std::streamsize>(size));
    try {
        const PlatformFile platform = load_platform_file(scratch.path);
        const hexload_config_t config = checked_firmware_config(platform, platform.estimator, 1e-3);
        PROMISE(hexload_config_check(&config, nullptr) == HEXLOAD_OK);
        (void)with_rig_file(platform, scratch.path);
    } catch (const InputError& error) {
        PROMISE(std::string(error.what()).size() > 10); // says what and where
    }
    return 0;
}
