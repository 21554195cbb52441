// The input fault as a sentence.
#pragma once

#include <hexload/types.h>

#include <cmath>
#include <string>

namespace hexload::transport {

// "the legs carry 4905 N more than the known mass explains: ..."; as long as the force is not known, without
// it. "leg 3: velocity ...: check ..."; nothing when there is no fault.
inline std::string input_fault_words(const hexload_input_fault_t& fault) {
    if (fault.cause == HEXLOAD_INPUT_PLAUSIBLE) {
        return {};
    }
    if (fault.cause == HEXLOAD_INPUT_KNOWN_MASS && fault.excess_n != 0) {
        const std::string force_n = std::to_string(std::lround(std::abs(fault.excess_n)));
        return "the legs carry " + force_n + " N " + (fault.excess_n > 0 ? "more" : "less") +
               " than the known mass explains: check load.known_mass_kg or the mass that was set, and the "
               "load";
    }
    const std::string leg = fault.leg < 6 ? "leg " + std::to_string(fault.leg + 1) + ": " : std::string();
    return leg + hexload_input_fault_text(fault.cause);
}

} // namespace hexload::transport
