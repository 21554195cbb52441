// A controller at the other end of a CAN bus.
#pragma once

#include "can_link.hpp"
#include "controller_wire.hpp"

#include "bus/answer_assembly.h"
#include "bus/answer_code.h"
#include "bus/authentication.h"
#include "bus/sample_code.h"
#include "transport/can_channel.hpp"
#include "transport/key.hpp"

#include <deque>
#include <functional>
#include <memory>
#include <optional>

namespace hexload::sim {

class CanWire final : public ControllerWire {
  public:
    CanWire(std::unique_ptr<transport::CanChannel> channel, const CanLinkSettings& settings);

    const std::string& name() const override {
        return channel_->name();
    }
    hexload_bus_profile_t profile() const override {
        return profile_;
    }
    bool answers(std::uint32_t tick) const override {
        return profile_ == HEXLOAD_BUS_FD || tick % HEXLOAD_BUS_ANSWER_PERIOD == 0;
    }
    bool has_key() const override {
        return aes_.has_value();
    }
    void send(const hexload_bus_command_t& wanted) override;
    bool send(const LegSample& sample, std::chrono::microseconds deadline) override;
    std::optional<BusNews> read(std::chrono::microseconds timeout) override;
    bool is_up() const override {
        return channel_->is_up();
    }
    std::uint64_t incomplete_answers() const override;
    bool has_unproven_answers() const override {
        return answer_code_ && (answer_code_->has_frames || answer_code_->unproven > 0);
    }
    BusCounts counts() const override;

  private:
    std::optional<BusNews> read_answer(const hexload_bus_frame_t& frame);
    bool is_echo(const hexload_bus_frame_t& frame);
    bool contradicts_last(const hexload_bus_frame_t& frame) const;
    [[noreturn]] void fail_two_answers() const;
    bool is_taken(hexload_bus_status_t status);
    void ask_challenge(hexload_bus_command_t command);
    void send_with_code();
    void begin_codes(const hexload_bus_acknowledge_t& acknowledge);
    bool is_answer_code(const hexload_bus_frame_t& frame);
    void count_into_answer_code(const hexload_bus_frame_t& frame, const AnswerPart& part);
    [[noreturn]] void fail_unproven(const char* what) const;
    bool send_sample_code(const hexload_bus_frame_t* frames, int count, std::uint32_t tick,
                          std::chrono::microseconds deadline);

    std::unique_ptr<transport::CanChannel> channel_;
    hexload_bus_profile_t profile_;
    std::function<std::chrono::steady_clock::time_point()> now_;
    std::optional<transport::Aes128> aes_;
    std::optional<hexload_nonce_t> nonce_;       // of the next command
    std::optional<hexload_bus_frame_t> waiting_; // a command that has none yet
    std::chrono::steady_clock::time_point waits_until_{};
    bool has_sample_codes_;
    bool has_answer_codes_;
    hexload_nonce_t used_{};                           // of the last command
    std::optional<hexload_sample_code_t> sample_code_; // since START was carried out
    std::optional<hexload_answer_code_t> answer_code_; // likewise
    hexload_answer_assembly_t assembly_{};
    hexload_bus_controller_status_t status_{};
    std::uint32_t newest_tick_ = 0;
    std::uint32_t saturated_ = 0;
    std::uint64_t refused_ = 0;
    std::deque<hexload_bus_frame_t> heard_; // the last ones of the controller, newest first
};

} // namespace hexload::sim
