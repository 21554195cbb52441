/// @file systick.h
/// The processor's own timer: counts down with 25 MHz on this board. ARMv7-M Architecture Reference Manual,
/// B3.3.
#ifndef HEXLOAD_MPS2_AN500_SYSTICK_H
#define HEXLOAD_MPS2_AN500_SYSTICK_H

#include <stdint.h>

#define SYSTICK ((volatile uint32_t*)0xE000E010u) // control, reload, value
enum { SYSTICK_CONTROL, SYSTICK_RELOAD, SYSTICK_VALUE };

#endif
