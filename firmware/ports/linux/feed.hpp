// Where the controller's samples and commands come from and where its answers go: a CAN bus, or another
// transport.
#pragma once

#include "app/app.h"

#include <cstdint>
#include <functional>
#include <string>

namespace hexload::port {

class Feed {
  public:
    Feed() = default;
    Feed(const Feed&) = delete;
    Feed& operator=(const Feed&) = delete;
    virtual ~Feed() = default;

    // For poll(): readable when receive() has something to do.
    virtual int descriptor() const = 0;

    // Handles what has come, up to a bounded number of messages, and calls `after_each` after each of them.
    // Does not wait.
    virtual void receive(const std::function<void()>& after_each) = 0;

    // Every millisecond: the number of periods since the last call.
    virtual void period(std::uint32_t periods) = 0;

    // Speaks: samples and commands are answered.
    virtual bool is_ready() const = 0;

    // Heard another controller before it spoke itself, and will not.
    virtual bool is_taken() const = 0;

    virtual const hexload_app_t& app() const = 0;
    virtual hexload_bus_profile_t profile() const = 0;

    // Of the transport, for the line printed when ready, e.g. "socketcan:vcan0, profile fd".
    virtual std::string description() const = 0;

    // Counts of the transport, for the line printed at the end.
    virtual std::string summary() const = 0;

  protected:
    static constexpr int messages_per_call = 256; // then the clock has its turn
};

} // namespace hexload::port
