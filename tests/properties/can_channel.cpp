#include "transport/can_channel.hpp"
#include "transport/channel_name.hpp"
#include "transport/python_can_frame.hpp"

#include <doctest/doctest.h>

#include <algorithm>

using namespace hexload::transport;

namespace {

std::string refusal(const std::string& name) {
    try {
        parse_channel_name(name);
    } catch (const ChannelNameError& error) {
        return error.what();
    }
    return "accepted";
}

hexload_bus_frame_t frame_of(std::uint32_t id, bool is_fd, std::size_t length) {
    hexload_bus_frame_t frame{};
    frame.id = id;
    frame.is_fd = is_fd;
    frame.length = static_cast<std::uint8_t>(length);
    std::uint8_t value = 0xFF; // as msgpack's longest headers begin
    for (std::uint8_t& byte : frame.data) {
        byte = value;
        value = static_cast<std::uint8_t>(value - 3);
    }
    return frame;
}

bool are_equal(const hexload_bus_frame_t& a, const hexload_bus_frame_t& b) {
    return a.id == b.id && a.is_fd == b.is_fd && a.length == b.length &&
           std::equal(a.data, a.data + a.length, b.data);
}

std::vector<char> packed(const hexload_bus_frame_t& frame) {
    std::vector<char> bytes;
    pack_frame(frame, 1700000000.25, bytes);
    return bytes;
}

// The datagram with the one-byte msgpack value after a key replaced.
std::vector<char> with_value(std::vector<char> bytes, const std::string& key, char value) {
    const auto found = std::search(bytes.begin(), bytes.end(), key.begin(), key.end());
    REQUIRE(found != bytes.end());
    *(found + static_cast<std::ptrdiff_t>(key.size())) = value;
    return bytes;
}

constexpr char msgpack_true = '\xc3';

} // namespace

SCENARIO("buses are chosen by name") {
    GIVEN("names of all kinds") {
        WHEN("they are parsed") {
            const auto can = std::get<SocketCanName>(parse_channel_name("socketcan:can7"));
            const auto group = std::get<UdpMulticastName>(parse_channel_name("udp_multicast:239.1.2.3"));
            const auto port = std::get<UdpMulticastName>(parse_channel_name("udp_multicast:239.1.2.3:5000"));
            const auto line = std::get<SlcanName>(parse_channel_name("slcan:localhost:4001"));
            const auto device = std::get<SlcanName>(parse_channel_name("slcan:/dev/serial/by-id/usb:1"));
            THEN("their parts are found, the port by default python-can's") {
                CHECK(can.interface == "can7");
                CHECK(group.group == "239.1.2.3");
                CHECK(group.port == 43113);
                CHECK(port.port == 5000);
                CHECK(std::get<SlcanTcpName>(line).host == "localhost");
                CHECK(std::get<SlcanTcpName>(line).port == 4001);
                CHECK(std::get<SlcanDeviceName>(device).path == "/dev/serial/by-id/usb:1");
            }
        }
    }
    GIVEN("names that no bus has") {
        WHEN("they are parsed") {
            THEN("the message lists the known forms") {
                for (const char* name :
                     {"", "vcan0", "socketcann:vcan0", "serial:/dev/ttyS0", "udp_multicast"}) {
                    CAPTURE(name);
                    const std::string message = refusal(name);
                    CHECK(message.find(std::string("found '") + name + "'") != std::string::npos);
                    CHECK(message.find("udp_multicast:") != std::string::npos);
                }
                CHECK(refusal("vcan0").find(
                          "expected socketcan:INTERFACE, udp_multicast:GROUP[:PORT], slcan:HOST:PORT") !=
                      std::string::npos);
            }
            THEN("wrong parts are named") {
                CHECK(refusal("socketcan:").find("name of a CAN interface") != std::string::npos);
                CHECK(refusal("socketcan:interface-name-too-long").find("name of a CAN interface") !=
                      std::string::npos);
                CHECK(refusal("udp_multicast:10.0.0.1").find("an IPv4 multicast group") != std::string::npos);
                CHECK(refusal("udp_multicast:ff15::1").find("an IPv4 multicast group") != std::string::npos);
                for (const char* name : {"slcan:", "slcan:ttyACM0", "slcan::4001"}) {
                    CAPTURE(name);
                    CHECK(refusal(name).find("host and port, or the path of a serial device") !=
                          std::string::npos);
                }
                for (const char* port : {"0", "65536", "-1", "80x", ""}) {
                    CAPTURE(port);
                    CHECK(refusal(std::string("udp_multicast:239.1.2.3:") + port)
                              .find("a port from 1 to 65535 after the group") != std::string::npos);
                    CHECK(refusal(std::string("slcan:127.0.0.1:") + port)
                              .find("a port from 1 to 65535 after the host") != std::string::npos);
                }
            }
        }
    }
}

SCENARIO("frames survive python-can's wire format") {
    GIVEN("frames of both formats and all lengths") {
        WHEN("they are packed and unpacked") {
            THEN("nothing has changed") {
                for (const std::size_t length : {0U, 1U, 4U, 8U}) {
                    const auto frame = frame_of(0x7FF, false, length);
                    const Datagram datagram = unpack_frame(packed(frame));
                    REQUIRE(datagram.kind == DatagramKind::frame);
                    CHECK(are_equal(datagram.frame, frame));
                }
                for (const std::size_t length : {0U, 8U, 12U, 16U, 20U, 24U, 32U, 48U, 64U}) {
                    const auto frame = frame_of(0, true, length);
                    const Datagram datagram = unpack_frame(packed(frame));
                    REQUIRE(datagram.kind == DatagramKind::frame);
                    CHECK(are_equal(datagram.frame, frame));
                }
            }
        }
    }
}

SCENARIO("datagrams that are not frames of the bus are recognised") {
    GIVEN("the datagram of a good frame") {
        const auto good = packed(frame_of(0x123, true, 64));
        WHEN("it says that it is an extended, a remote or an error frame") {
            THEN("it is a CAN frame, and not ours") {
                for (const char* key : {"is_extended_id", "is_remote_frame", "is_error_frame"}) {
                    CAPTURE(key);
                    CHECK(unpack_frame(with_value(good, key, msgpack_true)).kind ==
                          DatagramKind::other_frame);
                }
            }
        }
        WHEN("it is cut at any byte") {
            THEN("it is malformed") {
                for (std::size_t size = 0; size < good.size(); ++size) {
                    CAPTURE(size);
                    CHECK(unpack_frame({good.data(), size}).kind == DatagramKind::malformed);
                }
            }
        }
        WHEN("64 bytes come in a classic frame") {
            auto frame = frame_of(0x123, true, 64);
            frame.is_fd = false;
            THEN("it is malformed") {
                CHECK(unpack_frame(packed(frame)).kind == DatagramKind::malformed);
            }
        }
        WHEN("the identifier has more than 11 bits") {
            THEN("it is malformed") {
                CHECK(unpack_frame(packed(frame_of(0x800, true, 64))).kind == DatagramKind::malformed);
            }
        }
        WHEN("it is something else") {
            THEN("it is malformed") {
                const std::string text = "hello";
                CHECK(unpack_frame({text.data(), text.size()}).kind == DatagramKind::malformed);
            }
        }
    }
}
