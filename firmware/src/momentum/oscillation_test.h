/// @file oscillation_test.h
/// Whether the filter's innovations swing within a second or two: a load that is not rigid on a machine whose
/// constants are open. Internal.
///
/// Errors of a rig's constants go with forces and attitude: they last in the sums of half a second
/// (residual_test.h), which therefore tell no mismatch apart where constants are open. A part of the load
/// that swings or sloshes turns its sign within a second or two instead. Of two half seconds with the sums s1
/// and s2 and those that a unit of each open direction makes, e1 and e2 (consider.h),
///
///     d = s2 - s1,  c = d^T (2 n E + sum of (e2 - e1) (e2 - e1)^T)^-1 d,  q = |s1 + s2|^2 / (2 n)
///
/// Noise and constants within their sigmas make c at most chi-square with 6 degrees of freedom. Innovations
/// swing where c is beyond that by more than chance, and beyond all that lasts (R17). Half seconds that
/// follow each other show 0.5 to 1.5 Hz, those with one between them 0.26 to 0.74 Hz: they take turns.
#ifndef HEXLOAD_OSCILLATION_TEST_H
#define HEXLOAD_OSCILLATION_TEST_H

#include "hexload/state.h"

/// Also of another load, with the residual test.
void hexload_oscillation_test_init(hexload_oscillation_test_t* self);

/// Takes the half second that ends with this tick, and consider->shown back. Some 1,500 instructions twice in
/// two and a half seconds. Reentrant.
/// @param residual_test has the sum of the ticks before. @param whitened innovation of this one.
void hexload_oscillation_test_step(hexload_oscillation_test_t* self, hexload_consider_t* consider,
                                   const hexload_residual_test_t* residual_test,
                                   const hexload_real_t whitened[6]);

#endif
