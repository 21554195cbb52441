// The controller on a CAN bus: hexload_node on a CanChannel.
#pragma once

#include "feed.hpp"
#include "painted_stack.hpp"

#include "app/node.h"
#include "transport/can_channel.hpp"
#include "transport/key.hpp"

#include <optional>

namespace hexload::port {

class CanFeed final : public Feed {
  public:
    // `config` and `settings` are such that hexload_node_init() takes them, else std::invalid_argument.
    // `stack` is the one that the calls below run on. With a key only who has it too commands the controller.
    CanFeed(std::unique_ptr<transport::CanChannel> channel, hexload_bus_profile_t profile,
            const hexload_config_t& config, const hexload_app_settings_t& settings, const PaintedStack& stack,
            const std::optional<transport::Key>& key);

    int descriptor() const override {
        return channel_->descriptor();
    }
    void receive(const std::function<void()>& after_each) override;
    void period(std::uint32_t periods) override;
    bool is_ready() const override {
        return hexload_node_is_active(&node_);
    }
    bool is_taken() const override {
        return node_.heard_controller;
    }
    const hexload_app_t& app() const override {
        return node_.app;
    }
    hexload_bus_profile_t profile() const override {
        return profile_;
    }
    std::string description() const override;
    std::string summary() const override;

  private:
    void tell_bus_state();

    std::unique_ptr<transport::CanChannel> channel_;
    hexload_bus_profile_t profile_;
    const PaintedStack& stack_;
    std::optional<transport::Aes128> aes_;
    hexload_node_t node_{};
    bool was_up_ = true;
};

} // namespace hexload::port
