/// @file port.h
/// What a machine must supply to run the application on a CAN bus; firmware/ports/blank is where to start.
#ifndef HEXLOAD_APP_PORT_H
#define HEXLOAD_APP_PORT_H

#include "bus/bus.h"

HEXLOAD_DECLS_BEGIN

typedef struct hexload_port {
    void* context; ///< handed to each function
    /// Queues a frame. False: it could not be queued; the application counts that and goes on. Must not block
    /// longer than the port can spare of its period.
    bool (*send)(void* context, const hexload_bus_frame_t* frame);
    /// Free-running microseconds, may wrap. NULL: no clock, time margins read 0.
    uint32_t (*clock_us)(void* context);
    /// Bytes of stack never used so far. NULL: not measured.
    uint32_t (*stack_margin_bytes)(void* context);
} hexload_port_t;

HEXLOAD_DECLS_END

#endif
