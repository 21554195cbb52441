/// @file painted_stack.h
/// How much of its stack a program has used: the last 8 KiB of the memory are painted before the start, what
/// lost its paint was used.
#ifndef HEXLOAD_MPS2_AN500_PAINTED_STACK_H
#define HEXLOAD_MPS2_AN500_PAINTED_STACK_H

#include <stdint.h>

/// Before anything that is to be counted, and before interrupts.
void painted_stack_paint(void);

/// Bytes never used so far, interrupts included. Walks over them: two thousand words at most.
uint32_t painted_stack_margin_bytes(void);

#endif
