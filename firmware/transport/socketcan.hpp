// A CAN interface of the Linux kernel: vcan or a real adapter.
#pragma once

#include "can_channel.hpp"
#include "channel_name.hpp"

namespace hexload::transport {

// Survives that the interface goes down and up again, or is taken away and comes back under the same name.
// Throws ChannelError: no CAN in the kernel, no such interface, interface down, or too small for FD frames
// when the profile has them.
std::unique_ptr<CanChannel> open_socketcan(const std::string& name, const SocketCanName& parsed,
                                           hexload_bus_profile_t profile);

} // namespace hexload::transport
