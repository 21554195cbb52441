// Hydraulic legs and their servo for a machine of which only speed and force are known.
#pragma once

#include "platform_file/platform_file.hpp"

#include <hexload_sim/scenario.hpp>

namespace hexload::sim {

// A scenario at standstill whose hydraulics and servo are the defaults, scaled: piston area to the force,
// valve to the speed, oil to area and stroke. Its servo follows from the platform's six resonances on its oil
// columns at home: the valve is twice as fast as the fastest of the empty platform, loop gain and pressure
// feedback are the default machine's shares of the slowest with the heaviest load, less where the servo's
// sampling would let a resonance grow.
Scenario scaled_machine(const PlatformFile& platform, const ActuatorLimits& limits,
                        const Load& heaviest_load);

} // namespace hexload::sim
