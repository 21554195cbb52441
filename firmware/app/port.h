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
    /// AES-128 of one block with the key of this controller: hardware's, or a library's. Commands are then
    /// carried out for who has the key alone. NULL: no key, commands of anybody.
    void (*aes128_encrypt_block)(void* context, const uint8_t in[16], uint8_t out[16]);
    /// With a key: a number that no start has had before with it, or commands recorded at that start could be
    /// played again. Of a hardware random number generator, or a count of starts in non-volatile memory; it
    /// need not be secret.
    uint64_t nonce_seed;
} hexload_port_t;

HEXLOAD_DECLS_END

#endif
