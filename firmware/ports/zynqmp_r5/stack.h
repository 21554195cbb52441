/// @file stack.h
/// How much of the stack was never used: start-up paints it.
#ifndef HEXLOAD_ZYNQMP_R5_STACK_H
#define HEXLOAD_ZYNQMP_R5_STACK_H

#include <stdint.h>

/// Bytes of painted stack that are still as they were. Looks at each of them: at most 8 KiB.
uint32_t stack_margin_bytes(void);

#endif
