// The input fault as a sentence.
#pragma once

#include <hexload/status.h>

#include <string>

namespace hexload::transport {

// "leg 3: velocity ...: check ..."; nothing when there is no fault.
inline std::string input_fault_words(const hexload_input_fault_t& fault) {
    if (fault.cause == HEXLOAD_INPUT_PLAUSIBLE) {
        return {};
    }
    const std::string leg = fault.leg < 6 ? "leg " + std::to_string(fault.leg + 1) + ": " : std::string();
    return leg + hexload_input_fault_text(fault.cause);
}

} // namespace hexload::transport
