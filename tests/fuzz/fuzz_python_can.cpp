// Datagrams of python-can's udp_multicast: a msgpack map in each.
#include "bytes.h"

#include "transport/python_can_frame.hpp"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    using namespace hexload::transport;
    std::vector<char> packed(data, data + size);
    if (size > 0 && data[0] % 4 == 0 && size >= 4) { // a good one, with some bytes changed
        hexload_bus_frame_t frame{};
        frame.id = data[1];
        frame.length = static_cast<uint8_t>(data[2] % 9);
        pack_frame(frame, 1.0, packed);
        for (size_t n = 3; n + 1 < size; n += 2) {
            packed[data[n] % packed.size()] = static_cast<char>(data[n + 1]);
        }
    }
    const Datagram datagram = unpack_frame(packed);
    if (datagram.kind == DatagramKind::frame) {
        PROMISE(datagram.frame.id <= 0x7FF);
        PROMISE(datagram.frame.length <= (datagram.frame.is_fd ? HEXLOAD_BUS_FRAME_BYTES : 8));
        pack_frame(datagram.frame, 2.0, packed);
        PROMISE(unpack_frame(packed).kind == DatagramKind::frame);
    }
    return 0;
}
