// How long a frame keeps a real bus busy, at most. The formulas are those of firmware/bus/README.md.
#pragma once

#include "bus/bus.h"

namespace hexload::transport {

// At 1 Mbit/s, and 5 Mbit/s after the bit-rate switch of an FD frame; worst-case stuffing, interframe space
// included.
inline double longest_time_us(const hexload_bus_frame_t& frame) {
    constexpr double nominal_bit_us = 1.0;
    constexpr double data_bit_us = 0.2;
    const int data_bits = 8 * frame.length;
    if (!frame.is_fd) {
        const int stuff = (34 + data_bits - 1) / 4;
        return nominal_bit_us * (data_bits + 44 + stuff + 3);
    }
    constexpr int head = 17;              // SOF .. BRS
    constexpr int head_stuff = 4;         // at most
    constexpr int tail = 13;              // CRC delimiter .. interframe space
    constexpr int longest_short_crc = 16; // bytes
    const int checksum = frame.length <= longest_short_crc ? 17 + 6 : 21 + 7; // with fixed stuff bits
    const int stuff = (head + 5 + data_bits - 1) / 4 - head_stuff;
    return nominal_bit_us * (head + head_stuff + tail) + data_bit_us * (5 + data_bits + stuff + 4 + checksum);
}

} // namespace hexload::transport
