// The names of buses, taken apart.
#pragma once

#include <cstdint>
#include <string>
#include <variant>

namespace hexload::port {

struct SocketCanName {
    std::string interface;
};

struct UdpMulticastName {
    std::string group; // dotted IPv4
    std::uint16_t port = 0;
};

using ChannelName = std::variant<SocketCanName, UdpMulticastName>;

// Throws ChannelNameError, which lists the forms that there are.
ChannelName parse_channel_name(const std::string& name);

} // namespace hexload::port
