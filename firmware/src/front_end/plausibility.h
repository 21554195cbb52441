/// @file plausibility.h
/// Whether the channels contradict each other: a sensor with a wrong sign, unit, leg or time, one that is
/// stuck, forces that cannot hold the platform.
///
/// In windows of 512 ticks. In blocks of 16 ticks the way of each leg by its displacement, and by the
/// integral of its velocity, must be the same; noise of a displacement goes into two blocks with opposite
/// signs, so that a regression over 32 blocks knows the gain to 0.1 % at 50 mm/s. All legs are screened in
/// each window and one of them, in turn or as its gain is off, is looked at closely: against the velocities
/// of all legs with either sign, and with a lag. Forces must hold the empty platform, and what they make
/// sidewards and about the vertical must be no more than the machine's acceleration needs.
///
/// A contradiction counts beyond five sigma of the effective noise and beyond what good sensors do (2 % of
/// gain, 2 ticks of lag; of a way that these do not explain, three times what noise leaves and 1 %), and when
/// two windows in a row show it; of forces, which friction and a base that is not level change too, four
/// windows. Noise alone passes five sigma once in 1.7 million windows of a test, 250 hours at 1 ms; twice in
/// a row, with four such tests in a window, in more than 1e6 hours.
///
/// What no channel tells of another, so that no fault is seen: legs renumbered in all channels alike or
/// mirrored, on a machine that is so symmetric, or a factor that all forces have in common, unless the
/// platform comes out lighter than it is, or the noise is that of another unit. EQUATIONS.md has more (P1).
#ifndef HEXLOAD_PLAUSIBILITY_H
#define HEXLOAD_PLAUSIBILITY_H

#include "front_end/present_tick.h"

void hexload_plausibility_init(hexload_plausibility_t* self);

/// Takes an accepted sample. At -O3 some 170 instructions, and up to 310 more in two of 16 ticks and in the
/// nine after a window's end, or later where a tick's pose takes long; constant bounds. Reentrant.
/// @param sample as the sensors gave it.
/// @param now the same or, with the rig's delays taken off, one of a little before. Without velocity sensors
///            only forces and repeated samples are looked at.
/// @param late_s by how much the velocities of `now` are known to be late.
void hexload_plausibility_step(hexload_plausibility_t* self, const hexload_config_t* config,
                               const hexload_leg_sample_t* sample, const hexload_present_tick_t* now,
                               hexload_real_t late_s);

/// Most by which the legs show another weight than that, N, of what commissioning has found of the machine:
/// sensors' offsets and gains, and dry friction with all legs moving the same way. Reentrant, 60
/// instructions.
hexload_real_t hexload_rig_weight_n(const hexload_rig_config_t* rig, hexload_real_t weight_n);

/// Whether a velocity is known to have the wrong sign, or to be another leg's: speeds then say nothing of
/// loads.
static inline bool hexload_plausibility_is_wiring(const hexload_plausibility_t* self) {
    return self->fault.cause == HEXLOAD_INPUT_VELOCITY_SIGN ||
           self->fault.cause == HEXLOAD_INPUT_VELOCITY_SWAPPED;
}

/// Whether the step has had nothing to do but its sums, as in most ticks: for what is not to meet its
/// longest.
bool hexload_plausibility_is_idle(const hexload_plausibility_t* self);

/// Whether samples repeat those before while the machine moves, or did so in the last five seconds.
static inline bool hexload_plausibility_has_repeats(const hexload_plausibility_t* self) {
    return self->fault.cause == HEXLOAD_INPUT_ROWS_REPEATED;
}

/// What any input fault does: no verdict is better than "misfit", and health says so.
/// @param parameters of the estimate.
/// @param[in,out] health sets INPUT_IMPLAUSIBLE.
void hexload_input_fault_judge(int parameters, hexload_estimate_t* estimate, uint32_t* health);

/// While there is a fault no verdict is better than "misfit".
/// @param parameters of the estimate.
/// @param[out] fault as it is reported.
/// @param[in,out] health sets INPUT_IMPLAUSIBLE.
void hexload_plausibility_judge(const hexload_plausibility_t* self, int parameters,
                                hexload_estimate_t* estimate, hexload_input_fault_t* fault, uint32_t* health);

#endif
