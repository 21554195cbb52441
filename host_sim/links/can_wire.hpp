// A controller at the other end of a CAN bus.
#pragma once

#include "controller_wire.hpp"

#include "bus/answer_assembly.h"
#include "transport/can_channel.hpp"

#include <memory>

namespace hexload::sim {

class CanWire final : public ControllerWire {
  public:
    CanWire(std::unique_ptr<transport::CanChannel> channel, hexload_bus_profile_t profile);

    const std::string& name() const override {
        return channel_->name();
    }
    hexload_bus_profile_t profile() const override {
        return profile_;
    }
    bool answers(std::uint32_t tick) const override {
        return profile_ == HEXLOAD_BUS_FD || tick % HEXLOAD_BUS_ANSWER_PERIOD == 0;
    }
    void send(const hexload_bus_command_t& command) override;
    bool send(const LegSample& sample, std::chrono::microseconds deadline) override;
    std::optional<BusNews> read(std::chrono::microseconds timeout) override;
    bool is_up() const override {
        return channel_->is_up();
    }
    std::uint64_t incomplete_answers() const override {
        return assembly_.incomplete;
    }
    BusCounts counts() const override;

  private:
    std::optional<BusNews> read_answer(const hexload_bus_frame_t& frame);

    std::unique_ptr<transport::CanChannel> channel_;
    hexload_bus_profile_t profile_;
    hexload_answer_assembly_t assembly_{};
    hexload_bus_controller_status_t status_{};
    std::uint32_t newest_tick_ = 0;
    std::uint32_t saturated_ = 0;
};

} // namespace hexload::sim
