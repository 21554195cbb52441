// The names of buses, taken apart.
#pragma once

#include <cstdint>
#include <string>
#include <variant>

namespace hexload::transport {

struct SocketCanName {
    std::string interface;
};

struct UdpMulticastName {
    std::string group; // dotted IPv4
    std::uint16_t port = 0;
};

struct SlcanTcpName {
    std::string host;
    std::uint16_t port = 0;
};

struct SlcanDeviceName {
    std::string path;
};

using SlcanName = std::variant<SlcanTcpName, SlcanDeviceName>;

using ChannelName = std::variant<SocketCanName, UdpMulticastName, SlcanName>;

// Throws ChannelNameError, which lists the forms that there are.
ChannelName parse_channel_name(const std::string& name);

} // namespace hexload::transport
