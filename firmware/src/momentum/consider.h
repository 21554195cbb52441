/// @file consider.h
/// What is left unknown of the rig after commissioning, in the standard deviations of the load.
///
/// Errors of constants do not show in the innovations, and no run averages them out. Each direction of
/// config->rig is one way, of one standard deviation, in which all constants together may be off; beside the
/// filter runs what that does to its state, x^ - x = T for a unit of it (consider covariance: S. Schmidt
/// 1966; EQUATIONS.md derives it). The variance of a parameter is the filter's own plus the squares of its
/// row of T.
#ifndef HEXLOAD_CONSIDER_H
#define HEXLOAD_CONSIDER_H

#include "momentum/momentum_filter.h"

void hexload_consider_init(hexload_consider_t* self);

/// hexload_momentum_filter_step(), and the same for T. Reentrant, constant time but for a sample with
/// gap_ticks 0.
/// @param[out] update as there.
void hexload_consider_step(hexload_consider_t* self, hexload_momentum_filter_t* filter,
                           const hexload_config_t* config, const hexload_delayed_tick_t* past,
                           hexload_momentum_update_t* update);

/// Adds what the constants leave open to the filter's standard deviations.
/// @param[in,out] sigma of the load's parameters.
void hexload_consider_widen(const hexload_consider_t* self, const hexload_config_t* config,
                            hexload_real_t sigma[HEXLOAD_LOAD_DIM]);

#endif
