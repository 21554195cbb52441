// A controller that is reached over LCM alone: hexload_ecu --feed lcm.
#pragma once

#include "controller_wire.hpp"

#include "transport/lcm_messages.hpp"

#include <hexload_lcm/session.hpp>

#include <deque>

namespace hexload::sim {

class LcmWire final : public ControllerWire {
  public:
    // Throws message::SessionError.
    explicit LcmWire(const std::string& url);

    const std::string& name() const override {
        return name_;
    }
    hexload_bus_profile_t profile() const override {
        return HEXLOAD_BUS_FD; // whole samples and whole answers, as in that profile
    }
    bool has_own_sigma() const override {
        return true;
    }
    bool answers(std::uint32_t) const override {
        return true;
    }
    void send(const hexload_bus_command_t& command) override;
    bool send(const LegSample& sample, std::chrono::microseconds deadline) override;
    std::optional<BusNews> read(std::chrono::microseconds timeout) override;
    bool is_up() const override {
        return is_up_;
    }
    std::uint64_t incomplete_answers() const override {
        return incomplete_;
    }
    BusCounts counts() const override;

  private:
    void take(const estimate_t& message);
    void take(const health_t& message);
    void take(const acknowledge_t& message);
    void take(const load_change_t& message);

    std::string name_;
    message::Session session_;
    message::Publisher<leg_sample_t> samples_{session_};
    message::Publisher<command_t> commands_{session_};
    const message::GapCounter* received_[4]{};
    std::deque<BusNews> news_;
    std::optional<estimate_t> estimate_; // waits for its health
    std::uint32_t newest_tick_ = 0;
    std::uint64_t incomplete_ = 0;
    bool is_up_ = true;
};

} // namespace hexload::sim
