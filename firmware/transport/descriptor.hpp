// What all kinds of bus need of descriptors.
#pragma once

#include <chrono>
#include <cstdint>
#include <optional>
#include <utility>

#include <sys/socket.h>
#include <unistd.h>

namespace hexload::transport {

// An owned file descriptor.
class Descriptor {
  public:
    explicit Descriptor(int descriptor = -1) : descriptor_(descriptor) {}
    Descriptor(Descriptor&& other) noexcept : descriptor_(std::exchange(other.descriptor_, -1)) {}
    Descriptor& operator=(Descriptor&& other) noexcept {
        std::swap(descriptor_, other.descriptor_);
        return *this;
    }
    ~Descriptor() {
        if (descriptor_ >= 0) {
            close(descriptor_);
        }
    }
    int get() const {
        return descriptor_;
    }
    explicit operator bool() const {
        return descriptor_ >= 0;
    }

  private:
    int descriptor_;
};

// Whether the descriptor can be read before `timeout` is over; a signal counts as no.
bool wait_readable(int descriptor, std::chrono::microseconds timeout);

// Whether it can be written before `timeout` is over; likewise.
bool wait_writable(int descriptor, std::chrono::microseconds timeout);

// Messages that a socket with SO_RXQ_OVFL has dropped since it was opened, if the received message says so.
std::optional<std::uint32_t> dropped_messages(msghdr& message);

} // namespace hexload::transport
