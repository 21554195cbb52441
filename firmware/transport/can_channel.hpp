// A CAN bus, chosen by its name: socketcan:vcan0, udp_multicast:239.74.163.2:43113 (python-can's format),
// slcan:127.0.0.1:4001 or slcan:/dev/ttyACM0 (classic frames as text on a serial line).
#pragma once

#include "bus/bus.h"

#include <chrono>
#include <cstdint>
#include <memory>
#include <optional>
#include <stdexcept>
#include <string>

namespace hexload::transport {

// The bus cannot be opened; what() says what was found, what was expected and the command that mends it.
class ChannelError : public std::runtime_error {
    using std::runtime_error::runtime_error;
};

// There is no bus of this name.
class ChannelNameError : public ChannelError {
    using ChannelError::ChannelError;
};

struct ChannelCounts {
    std::uint64_t sent = 0;
    std::uint64_t received = 0;
    std::uint64_t send_retries = 0;  // queue full, tried again
    std::uint64_t send_failures = 0; // given up at the deadline, or bus down
    std::uint64_t receive_drops = 0; // lost in the socket's queue, as the kernel counts them
    std::uint64_t error_frames = 0;  // the adapter's error reports; what is no frame; a lost connection
};

class CanChannel {
  public:
    CanChannel() = default;
    CanChannel(const CanChannel&) = delete;
    CanChannel& operator=(const CanChannel&) = delete;
    virtual ~CanChannel() = default;

    // Becomes readable when a frame, or the begin or end of an outage, can be read: for poll(), then
    // receive().
    virtual int descriptor() const = 0;

    // False: the bus is down, or its queue stayed full until the deadline; counted.
    virtual bool send(const hexload_bus_frame_t& frame, std::chrono::microseconds deadline) = 0;

    // Waits up to `timeout` (0: does not wait). Nothing: no frame, or the bus is down (see is_up()). Frames
    // that are not ours (extended, remote) are passed over; own frames do not come back.
    virtual std::optional<hexload_bus_frame_t> receive(std::chrono::microseconds timeout) = 0;

    // As the last send() or receive() found it.
    virtual bool is_up() const = 0;

    // What to do against the failures counted so far, e.g. a longer queue; empty: nothing.
    virtual std::string advice() const {
        return {};
    }

    const ChannelCounts& counts() const {
        return counts_;
    }
    const std::string& name() const {
        return name_;
    }

  protected:
    ChannelCounts counts_;
    std::string name_;
};

// A bus that can carry the frames of `profile`. Throws ChannelNameError, ChannelError.
std::unique_ptr<CanChannel> open_can_channel(const std::string& name, hexload_bus_profile_t profile);

} // namespace hexload::transport
