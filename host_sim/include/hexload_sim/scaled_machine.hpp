// Hydraulic legs and their servo for a machine of which only speed and force are known, and the default
// servo on a platform that is too light for it.
#pragma once

#include "platform_file/platform_file.hpp"

#include <hexload_sim/scenario.hpp>

namespace hexload::sim {

// A scenario at standstill whose hydraulics and servo are the defaults, scaled: piston area to the force,
// valve to the speed, oil to area and stroke. Its servo follows from the platform's six resonances on its oil
// columns at home: the valve is twice as fast as the fastest of the empty platform, loop gain and pressure
// feedback are the default machine's shares of the resonance that the heaviest mass has, less where valve and
// sampling would let a resonance grow.
Scenario scaled_machine(const PlatformFile& platform, const ActuatorLimits& limits, double heaviest_load_kg);

// Lowers the pressure feedback of a servo that the scenario leaves to the defaults, where valve and sampling
// turn it so far round that a resonance of the platform with its heaviest load grows at home: with the
// paper's platform below some 85 kg. Loop gain, and with it the motion, stay; every other scenario stays as
// it is.
void suit_default_servo(Scenario& scenario, const PlatformFile& platform);

} // namespace hexload::sim
