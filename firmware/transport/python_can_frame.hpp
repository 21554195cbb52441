// python-can's udp_multicast wire format: a msgpack map of the fields of can.Message in each datagram.
#pragma once

#include "bus/bus.h"

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

namespace hexload::transport {

enum class DatagramKind {
    frame,       // one that the bus contract may know
    other_frame, // a CAN frame with an extended identifier, a remote or an error frame
    malformed,
};

struct Datagram {
    DatagramKind kind = DatagramKind::malformed;
    hexload_bus_frame_t frame{}; // with DatagramKind::frame only
};

// `timestamp_s`: of sending, seconds since 1970. `packed` is overwritten.
void pack_frame(const hexload_bus_frame_t& frame, double timestamp_s, std::vector<char>& packed);

Datagram unpack_frame(std::span<const char> packed);

} // namespace hexload::transport
