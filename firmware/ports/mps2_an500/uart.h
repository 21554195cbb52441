/// @file uart.h
/// The board's first serial line, 8N1 at 1.5625 Mbaud, the fastest that it has from 25 MHz: leg samples and
/// answers of the classic profile as SLCAN are up to 148 of its 156 bytes per millisecond and direction.
///
/// Interrupts move the bytes between the line and two ring buffers. The functions below never wait; call them
/// from one thread.
#ifndef HEXLOAD_MPS2_AN500_UART_H
#define HEXLOAD_MPS2_AN500_UART_H

#include <stdbool.h>
#include <stdint.h>

enum {
    UART_RECEIVE_BYTES = 4096, ///< 26 ms of a full line; what comes on top is lost
    UART_SEND_BYTES = 1024,
};

void uart_start(void);

/// The next byte that has come. @return false when there is none.
bool uart_read(char* byte);

/// Whether uart_read() has a byte to give.
bool uart_has_byte(void);

/// Queues all of these bytes. @return false when there is no room for all; then none is queued.
bool uart_write(const char* bytes, uint32_t count);

#endif
