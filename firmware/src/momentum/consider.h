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

/// Turns to the next direction, whose errors of mu' are looked at in this tick: one at a time.
static inline const hexload_rig_direction_t* hexload_consider_turn(hexload_consider_t* self,
                                                                   const hexload_config_t* config) {
    self->next++;
    if (self->next >= config->rig.direction_count) {
        self->next = 0;
    }
    return &config->rig.direction[self->next];
}

/// T's time update, before the filter's own: from its state at the last sample.
/// @param direction that of hexload_consider_turn(), or what of it is no state of a filter that goes with
///                  this one.
void hexload_consider_move(hexload_consider_t* self, const hexload_momentum_filter_t* filter,
                           const hexload_config_t* config, const hexload_delayed_tick_t* past,
                           const hexload_rig_direction_t* direction);

/// T of all directions as the filter's momentum begins anew.
void hexload_consider_seed(hexload_consider_t* self, const hexload_config_t* config,
                           const hexload_momentum_filter_t* filter, const hexload_motion_t* motion);

/// T of directions n and n + 1, which share what is read of the update, follows the filter's correction; of
/// the last of an odd number the one after it, of which nothing is read, as well.
/// @param n even.
/// @param[out] e the whitened innovations that a unit of each direction makes.
void hexload_consider_follow(hexload_consider_t* self, const hexload_config_t* config, uint32_t n,
                             hexload_momentum_update_t* update, hexload_real_t e[2][6]);

/// hexload_momentum_filter_step(), and all of that for T. Reentrant, constant time but for a sample with
/// gap_ticks 0.
/// @param[out] update as there.
void hexload_consider_step(hexload_consider_t* self, hexload_momentum_filter_t* filter,
                           const hexload_config_t* config, const hexload_delayed_tick_t* past,
                           hexload_momentum_update_t* update);

/// Adds what the constants leave open to the filter's standard deviations.
/// @param dispersion how many times the variance of the directions is that which the rig has shown.
/// @param[in,out] sigma of the load's parameters.
void hexload_consider_widen(const hexload_consider_t* self, const hexload_config_t* config,
                            hexload_real_t dispersion, hexload_real_t sigma[HEXLOAD_LOAD_DIM]);

#endif
