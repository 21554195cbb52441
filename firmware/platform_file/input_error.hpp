// The one way in which this library refuses what a user gave it.
#pragma once

#include <cstddef>
#include <stdexcept>
#include <string>

namespace hexload::platform {

// what() reads "FILE:LINE: key: found X, expected Y"; parts that do not apply are left out.
class InputError : public std::runtime_error {
  public:
    explicit InputError(const std::string& message) : std::runtime_error(message) {}
    InputError(const std::string& file, std::size_t line, const std::string& key, const std::string& found,
               const std::string& expected)
        : std::runtime_error(file + ":" + std::to_string(line) + ": " + key + ": found " + found +
                             ", expected " + expected) {}
};

} // namespace hexload::platform
