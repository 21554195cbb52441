/// @file load_monitor.h
/// Whether the load is still the one that the filter knows, at once: the momentum of the present tick, with
/// the parameters as they are, against the present leg speeds.
///
/// The momentum filter runs lag_ticks behind, so its own innovations would detect a load change that much too
/// late. Here mu has six states of its own and no smoothing. What the filter does not know yet counts as
/// noise: each parameter with its sigma, as far as the present acceleration would show it within the memory
/// of the test.
///
/// Two tests: the mean of the normalised innovations squared detects jumps, of a load that is picked up or
/// dropped; the square of the innovations' mean detects ramps, of a centre of mass that has shifted, as the
/// wrong wrench then adds up in one direction.
#ifndef HEXLOAD_LOAD_MONITOR_H
#define HEXLOAD_LOAD_MONITOR_H

#include "front_end/present_tick.h"
#include "momentum/momentum_filter.h"
#include "momentum/wrench_monitor.h"

/// Time constant of the mean, and how long an error of the parameters has added up in mu.
#define HEXLOAD_LOAD_MONITOR_MEMORY_S HEXLOAD_REAL(0.05)

/// mu comes with the next sample.
void hexload_load_monitor_init(hexload_load_monitor_t* self);

/// The same for another load on the same machine.
void hexload_load_monitor_restart(hexload_load_monitor_t* self);

/// One sample of the present. After a gap mu begins anew, and the sample shows nothing.
/// @param variance_scale by which the filter's variances are too small, 1 or more: of a machine that is not
/// its model.
/// @param fit but for HEXLOAD_FIT_NOISE the machine's own past says what is noise (wrench_monitor.h).
/// @param now its force sigma covers what is not known of the forces.
/// @return true when the load has changed. Reentrant, constant time.
HEXLOAD_MUST_USE bool hexload_load_monitor_step(hexload_load_monitor_t* self, const hexload_config_t* config,
                                                const hexload_momentum_filter_t* filter,
                                                hexload_real_t variance_scale, hexload_fit_t fit,
                                                const hexload_present_tick_t* now);

/// Of an alarm: whether what is missing is the weight of another load, a force along g - a and a moment
/// across it, but for what its inertia makes of the platform's acceleration. What touches or shakes the
/// platform pushes along and about all axes alike.
/// @param fit of a load that is too new it must be 2 % of the weight, too.
HEXLOAD_MUST_USE bool hexload_load_monitor_is_weight(const hexload_load_monitor_t* self,
                                                     const hexload_config_t* config, hexload_fit_t fit);

/// Of an alarm: whether a force or a speed of one leg, as of a sensor that is suddenly off, explains what is
/// missing better than a weight, or so well that it is not certain yet; not where no mass has what theta is.
/// Some 2,000 instructions.
/// @param now the sample that was taken last.
HEXLOAD_MUST_USE bool hexload_load_monitor_is_one_leg(const hexload_load_monitor_t* self,
                                                      const hexload_config_t* config,
                                                      const hexload_momentum_filter_t* filter,
                                                      const hexload_present_tick_t* now);

/// Of an alarm: whether the mean NIS has taken longer to it than another load's takes. A machine that is not
/// its model shows so when it begins to move.
HEXLOAD_MUST_USE bool hexload_load_monitor_is_late(const hexload_load_monitor_t* self);

#endif
