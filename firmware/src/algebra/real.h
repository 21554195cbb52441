/// @file real.h
/// Arithmetic of the core's floating-point type: what it takes from libm, how a b + c is rounded, and what
/// the compiler is told of loops and functions. Internal. Reentrant, constant time.
#ifndef HEXLOAD_ALGEBRA_REAL_H
#define HEXLOAD_ALGEBRA_REAL_H

#include "hexload/types.h"

#include <math.h>

/// 1: a b + c is rounded once, as processors with that instruction do it in half the time; 0: twice, for
/// those without. All builds with the same value compute the same bits. On x86-64 libm does it where the
/// processor does not.
#ifndef HEXLOAD_FUSED
#if defined(__FP_FAST_FMAF) || defined(__ARM_FEATURE_FMA) || defined(__x86_64__)
#define HEXLOAD_FUSED 1
#else
#define HEXLOAD_FUSED 0
#endif
#endif

#ifdef HEXLOAD_REFERENCE_DOUBLE
#define HEXLOAD_REAL_EPSILON 2.220446049250313e-16
static inline hexload_real_t hexload_sqrt(hexload_real_t x) {
    return sqrt(x);
}
static inline hexload_real_t hexload_abs(hexload_real_t x) {
    return fabs(x);
}
static inline hexload_real_t hexload_fma(hexload_real_t a, hexload_real_t b, hexload_real_t c) {
    return HEXLOAD_FUSED ? fma(a, b, c) : a * b + c;
}
#else
/// Distance from 1 to the next larger number.
#define HEXLOAD_REAL_EPSILON 1.1920929e-7f
static inline hexload_real_t hexload_sqrt(hexload_real_t x) {
    return sqrtf(x);
}
static inline hexload_real_t hexload_abs(hexload_real_t x) {
    return fabsf(x);
}
/// a b + c.
static inline hexload_real_t hexload_fma(hexload_real_t a, hexload_real_t b, hexload_real_t c) {
    return HEXLOAD_FUSED ? fmaf(a, b, c) : a * b + c;
}
#endif

/// Before a loop of at most eight rounds, whose bounds are numbers or counters of such loops around it: its
/// body then stands once for each round, and what it indexes stays in registers. clang does so by itself.
#if defined(__GNUC__) && !defined(__clang__)
#define HEXLOAD_UNROLL _Pragma("GCC unroll 8")
#else
#define HEXLOAD_UNROLL
#endif

/// Before a function that no usual tick calls: it is made small instead of fast.
#if defined(__GNUC__)
#define HEXLOAD_RARE __attribute__((cold))
#else
#define HEXLOAD_RARE
#endif

/// Before a function with a frame of its own: as a part of its caller its memory would lie on the stack under
/// all that the caller calls afterwards.
#if defined(__GNUC__)
#define HEXLOAD_APART __attribute__((noinline))
#else
#define HEXLOAD_APART
#endif

/// Larger and smaller of two numbers; with a NaN the second argument.
static inline hexload_real_t hexload_max(hexload_real_t a, hexload_real_t b) {
    return a > b ? a : b;
}
static inline hexload_real_t hexload_min(hexload_real_t a, hexload_real_t b) {
    return a < b ? a : b;
}

#endif
