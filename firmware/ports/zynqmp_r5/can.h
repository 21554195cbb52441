/// @file can.h
/// The CAN controller of the Zynq UltraScale+ (UG1085, chapter "CAN Controller"; registers in UG1087),
/// polled, with classic frames at 1 Mbit/s. Its clock and pins are those that the boot loader has set: 100
/// MHz.
#ifndef HEXLOAD_ZYNQMP_R5_CAN_H
#define HEXLOAD_ZYNQMP_R5_CAN_H

#include "bus/bus.h"

HEXLOAD_DECLS_BEGIN

enum {
    CAN_FIFO_FRAMES = 64, ///< depth of the receive FIFO
    CAN_BUS_OFF_MS = 100, ///< rest after bus-off; ISO 11898-1 asks for 128 x 11 bits, 1.4 ms
};

/// One controller. The fields are the driver's own.
typedef struct can {
    volatile uint32_t* registers; ///< CAN0: 0xFF060000
    uint32_t rest_ms;             ///< left of the rest after bus-off; 0: the controller is on the bus
    uint32_t bus_offs;            ///< since the start, wraps
    uint32_t overflows;           ///< times that received frames were lost, wraps
} can_t;

/// Resets the controller and puts it on the bus.
void can_start(can_t* self, volatile uint32_t* registers);

/// Takes a data frame with a standard identifier out of the receive FIFO; others are dropped on the way.
/// @return false: there is none. Worst case: CAN_FIFO_FRAMES frames dropped.
HEXLOAD_MUST_USE bool can_receive(can_t* self, hexload_bus_frame_t* frame);

/// Queues a frame. @return false: the transmit FIFO is full, the controller is bus-off, or it is an FD frame.
HEXLOAD_MUST_USE bool can_send(can_t* self, const hexload_bus_frame_t* frame);

/// Whether frames were lost since the last call because the receive FIFO was full. They came after those that
/// are in it.
HEXLOAD_MUST_USE bool can_take_overflow(can_t* self);

/// Bus-off ends the controller's part on the bus for CAN_BUS_OFF_MS, then it starts anew.
/// @param periods of 1 ms since the last call.
/// @return whether it is on the bus.
bool can_check_bus(can_t* self, uint32_t periods);

HEXLOAD_DECLS_END

#endif
