/// @file jackknife.h
/// How much the estimate varies from block to block of the run, against how much it should by the filter's
/// own covariance: what the noise model leaves out and what is no constant shows there, and not in the
/// innovations of single ticks. EQUATIONS.md derives it (R10). Internal.
///
/// Lambda = P_tt^-1 and Lambda theta grow by a share J_b, J_b theta_b in each block b of time. With theta of
/// now, s_b = J_b (theta_b - theta) is the pull of a block, P s_b what it has moved the estimate by, and the
/// sum of their squares over its expectation is the factor by which P is too small. A delete-one jackknife
/// would use (Lambda - J_b)^-1 for P, which is next to singular where one block has most of what is known.
#ifndef HEXLOAD_JACKKNIFE_H
#define HEXLOAD_JACKKNIFE_H

#include "momentum/momentum_filter.h"

/// No blocks: the next step begins with the filter's covariance as what is known beforehand.
void hexload_jackknife_init(hexload_jackknife_t* self);

/// Another load on the same machine: blocks begin anew, and until they say more sigma is too small by the
/// factor that they had in common.
void hexload_jackknife_forget(hexload_jackknife_t* self);

/// One step of the work, after a sample of the filter: some 550 instructions at most, constant bounds. A
/// round of up to 231 steps closes a block of a quarter of a second, or of as long as the round takes, and
/// finds the factors. Reentrant.
void hexload_jackknife_step(hexload_jackknife_t* self, const hexload_config_t* config,
                            const hexload_momentum_filter_t* filter);

/// @param[in]     least factor, 1 or more: of what says so too.
/// @param[in,out] sigma of the load's parameters: the filter's, then by as much larger as the blocks say.
void hexload_jackknife_widen(const hexload_jackknife_t* self, hexload_real_t least,
                             hexload_real_t sigma[HEXLOAD_LOAD_DIM]);

/// By which the filter's variances are too small, all of them together: 1 or more.
static inline hexload_real_t hexload_jackknife_variance_scale(const hexload_jackknife_t* self) {
    return hexload_max(self->pooled, HEXLOAD_REAL(1.0));
}

#endif
