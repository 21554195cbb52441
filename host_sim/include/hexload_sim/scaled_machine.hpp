// Hydraulic legs and their servo for a machine of which only speed and force are known.
#pragma once

#include "platform_file/platform_file.hpp"

#include <hexload_sim/scenario.hpp>

namespace hexload::sim {

// A scenario at standstill whose hydraulics and servo are the defaults, scaled: piston area to the force,
// valve to the speed, oil to area and stroke. The resonance of the platform on its oil columns, empty and
// with the heaviest load, scales the valve's bandwidth, the pressure feedback and, where it is lower than the
// default machine's, the loop gain, so that the servo is as well damped as the default one.
Scenario scaled_machine(const PlatformFile& platform, const ActuatorLimits& limits, double heaviest_load_kg);

} // namespace hexload::sim
