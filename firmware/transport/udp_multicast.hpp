// CAN frames as multicast datagrams within this machine, in python-can's format.
#pragma once

#include "can_channel.hpp"
#include "channel_name.hpp"

namespace hexload::transport {

// Never leaves the machine: the time to live is 0. The bus is down from a datagram that the network refuses
// until one passes again. Throws ChannelError.
std::unique_ptr<CanChannel> open_udp_multicast(const std::string& name, const UdpMulticastName& parsed);

} // namespace hexload::transport
