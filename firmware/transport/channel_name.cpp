#include "channel_name.hpp"

#include "can_channel.hpp"

#include <charconv>

#include <arpa/inet.h>
#include <net/if.h>

namespace hexload::transport {
namespace {

constexpr std::uint16_t default_udp_port = 43113; // python-can's

[[noreturn]] void refuse(const std::string& name, const std::string& expected) {
    throw ChannelNameError("bus: found '" + name + "', expected " + expected);
}

bool is_ipv4_multicast(const std::string& group) {
    in_addr address{};
    return inet_pton(AF_INET, group.c_str(), &address) == 1 && IN_MULTICAST(ntohl(address.s_addr));
}

std::uint16_t parse_port(const std::string& name, const std::string& text, const char* place) {
    std::uint16_t port = 0;
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), port);
    if (error != std::errc{} || end != text.data() + text.size() || port == 0) {
        refuse(name, std::string("a port from 1 to 65535 after the ") + place);
    }
    return port;
}

UdpMulticastName parse_udp_multicast(const std::string& name, const std::string& rest) {
    const std::size_t colon = rest.find(':');
    UdpMulticastName parsed{rest.substr(0, colon), default_udp_port};
    if (!is_ipv4_multicast(parsed.group)) {
        refuse(name, "an IPv4 multicast group, 224.0.0.0 to 239.255.255.255, after udp_multicast:");
    }
    if (colon != std::string::npos) {
        parsed.port = parse_port(name, rest.substr(colon + 1), "group");
    }
    return parsed;
}

SlcanName parse_slcan(const std::string& name, const std::string& rest) {
    if (rest.starts_with('/')) {
        return SlcanDeviceName{rest};
    }
    const std::size_t colon = rest.find(':');
    if (colon == 0 || colon == std::string::npos) {
        refuse(name,
               "host and port, or the path of a serial device, after slcan:, e.g. slcan:127.0.0.1:4001, "
               "slcan:/dev/ttyACM0");
    }
    return SlcanTcpName{rest.substr(0, colon), parse_port(name, rest.substr(colon + 1), "host")};
}

} // namespace

ChannelName parse_channel_name(const std::string& name) {
    const std::size_t colon = name.find(':');
    const std::string kind = name.substr(0, colon);
    const std::string rest = colon == std::string::npos ? "" : name.substr(colon + 1);
    if (kind == "socketcan") {
        if (rest.empty() || rest.size() >= IFNAMSIZ) {
            refuse(name, "the name of a CAN interface after socketcan:, e.g. socketcan:vcan0");
        }
        return SocketCanName{rest};
    }
    if (kind == "udp_multicast") {
        return parse_udp_multicast(name, rest);
    }
    if (kind == "slcan") {
        return parse_slcan(name, rest);
    }
    refuse(name, "socketcan:INTERFACE, udp_multicast:GROUP[:PORT], slcan:HOST:PORT or slcan:DEVICE, e.g. "
                 "socketcan:vcan0, udp_multicast:239.74.163.2, slcan:/dev/ttyACM0");
}

} // namespace hexload::transport
