// CAN frames as text on a serial line or a TCP connection, in the format of bus/slcan.h.
#pragma once

#include "can_channel.hpp"
#include "channel_name.hpp"

namespace hexload::transport {

// Tells the other end to close, to set 1 Mbit/s and to open; a controller that speaks SLCAN itself passes
// over that. The speed of a serial device is left as it is. A lost connection is a bus that is down and stays
// so. Throws ChannelNameError for the profile fd, which the format has no frames for, ChannelError when
// nobody is there.
std::unique_ptr<CanChannel> open_slcan(const std::string& name, const SlcanName& parsed,
                                       hexload_bus_profile_t profile);

} // namespace hexload::transport
