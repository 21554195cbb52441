/// @file known_mass.h
/// Whether the legs carry what the stated mass of the load weighs. The paper's filter never corrects it, and
/// finds another height for it with a sigma as small as ever.
///
/// The legs' force upwards, in the mean of the last two seconds, must be that of platform and stated load
/// under gravity and the platform's mean acceleration. What is left counts beyond five sigma of what force
/// sensors and platform are off by (hexload_tolerances_t), beyond what the rig's own effects do, which this
/// filter does not take off, and beyond what a centre of mass anywhere within the hinges' reach does in this
/// motion. Of the same mean a share of the weight that is more than granted widens sigma (R16). The momentum
/// filters find the mass themselves. EQUATIONS.md has the equations (P4).
#ifndef HEXLOAD_KNOWN_MASS_H
#define HEXLOAD_KNOWN_MASS_H

#include "front_end/present_tick.h"
#include "front_end/wrench.h"

void hexload_known_mass_init(hexload_known_mass_t* self, const hexload_config_t* config);

/// Takes an accepted sample that lacks no force; some 110 instructions, reentrant.
/// @param wrench of the legs.
void hexload_known_mass_step(hexload_known_mass_t* self, const hexload_config_t* config,
                             const hexload_present_tick_t* now, const hexload_wrench_t* wrench);

/// While the stated mass is contradicted no verdict is better than "misfit": another load or a force that is
/// wrong may be the reason. hexload_plausibility_judge() comes before it: what that has found may be the
/// reason, and is what is reported.
/// @param estimate, fault, health as there.
void hexload_known_mass_judge(const hexload_known_mass_t* self, hexload_estimate_t* estimate,
                              hexload_input_fault_t* fault, uint32_t* health);

#endif
