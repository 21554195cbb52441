// The way to a controller and back, whatever carries it: frames of a CAN bus, or messages.
#pragma once

#include "bus/bus.h"

#include <hexload_sim/estimator_link.hpp>

#include <chrono>
#include <optional>
#include <string>
#include <variant>

namespace hexload::sim {

// One answer frame or message. An answer may be a few of them, also over several ticks.
struct AnswerPart {
    std::uint32_t answered_tick = 0;           // the sample that the controller had just processed
    bool ends_tick = false;                    // no more of the answer follows before the next sample
    std::optional<hexload_bus_answer_t> whole; // with the last part
};

struct UnrelatedFrame {};

// A frame of a controller that says nothing new: to the last bit one of those before, or of an answer that is
// over. Some networks deliver frames twice, or in another order.
struct StaleFrame {};

using BusNews = std::variant<UnrelatedFrame, StaleFrame, AnswerPart, hexload_bus_acknowledge_t,
                             hexload_bus_controller_status_t, hexload_bus_load_change_t>;

class ControllerWire {
  public:
    ControllerWire() = default;
    ControllerWire(const ControllerWire&) = delete;
    ControllerWire& operator=(const ControllerWire&) = delete;
    virtual ~ControllerWire() = default;

    virtual const std::string& name() const = 0;

    // The profile that the controller is to speak.
    virtual hexload_bus_profile_t profile() const = 0;

    // Whether answers have the filter's part of sigma too.
    virtual bool has_own_sigma() const {
        return false;
    }

    // Whether the controller is to answer the sample of this tick.
    virtual bool answers(std::uint32_t tick) const = 0;

    // Whether commands are sent with the controller's key.
    virtual bool has_key() const {
        return false;
    }

    // With a key it may go when the controller has said what it must count in: read() sends it then.
    virtual void send(const hexload_bus_command_t& command) = 0;

    // False: not all of it could be sent until the deadline. Throws InputError for a channel that is not
    // finite.
    virtual bool send(const LegSample& sample, std::chrono::microseconds deadline) = 0;

    // What comes next; nothing when nothing came in time. Throws LinkError for what the one controller of
    // this profile would not send.
    virtual std::optional<BusNews> read(std::chrono::microseconds timeout) = 0;

    virtual bool is_up() const = 0;

    // Answers that were given up because parts of them were lost.
    virtual std::uint64_t incomplete_answers() const = 0;

    // Whether answers have come that must have codes of the controller's key, and none of it yet.
    virtual bool has_unproven_answers() const {
        return false;
    }

    // The wire's own counters, the others zero.
    virtual BusCounts counts() const = 0;
};

} // namespace hexload::sim
