#include "can_channel.hpp"

#include "channel_name.hpp"
#include "slcan.hpp"
#include "socketcan.hpp"
#include "udp_multicast.hpp"

namespace hexload::transport {

std::unique_ptr<CanChannel> open_can_channel(const std::string& name, hexload_bus_profile_t profile) {
    const ChannelName parsed = parse_channel_name(name);
    if (const auto* socketcan = std::get_if<SocketCanName>(&parsed)) {
        return open_socketcan(name, *socketcan, profile);
    }
    if (const auto* slcan = std::get_if<SlcanName>(&parsed)) {
        return open_slcan(name, *slcan, profile);
    }
    return open_udp_multicast(name, std::get<UdpMulticastName>(parsed));
}

} // namespace hexload::transport
