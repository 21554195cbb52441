/// @file console.h
/// Words for whoever brings the board up: UART0, with the speed that the boot loader has set.
#ifndef HEXLOAD_ZYNQMP_R5_CONSOLE_H
#define HEXLOAD_ZYNQMP_R5_CONSOLE_H

#include <stdint.h>

/// Writes a line. Blocks while the UART's FIFO of 64 bytes is full: not for the 1 ms path.
void console_say(const char* line);

/// Writes a line that ends with a number, in hexadecimal digits.
void console_say_number(const char* line, uint32_t number);

#endif
