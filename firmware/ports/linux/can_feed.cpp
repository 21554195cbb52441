#include "can_feed.hpp"

#include <fmt/format.h>

#include <chrono>

namespace hexload::port {
namespace {

constexpr std::chrono::microseconds send_deadline{200};

} // namespace

CanFeed::CanFeed(std::unique_ptr<transport::CanChannel> channel, hexload_bus_profile_t profile,
                 const hexload_config_t& config, const hexload_app_settings_t& settings,
                 const PaintedStack& stack, const std::optional<transport::Key>& key)
    : channel_(std::move(channel)), profile_(profile), stack_(stack) {
    hexload_port_t port{};
    port.context = this;
    port.send = [](void* self, const hexload_bus_frame_t* frame) {
        return static_cast<CanFeed*>(self)->channel_->send(*frame, send_deadline);
    };
    port.clock_us = [](void*) {
        const auto time = std::chrono::steady_clock::now().time_since_epoch();
        return static_cast<std::uint32_t>(std::chrono::floor<std::chrono::microseconds>(time).count());
    };
    port.stack_margin_bytes = [](void* self) { return static_cast<CanFeed*>(self)->stack_.margin_bytes(); };
    if (key) {
        aes_.emplace(*key);
        port.aes128_encrypt_block = [](void* self, const std::uint8_t* in, std::uint8_t* out) {
            const hexload_cipher_t cipher = static_cast<CanFeed*>(self)->aes_->cipher();
            cipher.encrypt_block(cipher.context, in, out);
        };
        port.nonce_seed = transport::draw_nonce_seed();
    }
    const hexload_status_t status = hexload_node_init(&node_, &config, &settings, profile, &port);
    if (status != HEXLOAD_OK) {
        throw std::invalid_argument(std::string("the controller refuses its configuration: ") +
                                    hexload_status_name(status));
    }
}

void CanFeed::receive(const std::function<void()>& after_each) {
    for (int n = 0; n < messages_per_call; ++n) {
        const auto frame = channel_->receive(std::chrono::microseconds{0});
        if (!frame) {
            break;
        }
        hexload_node_receive(&node_, &*frame);
        after_each();
    }
    tell_bus_state();
}

void CanFeed::period(std::uint32_t periods) {
    hexload_node_period(&node_, periods);
    tell_bus_state();
}

void CanFeed::tell_bus_state() {
    if (const bool is_up = channel_->is_up(); is_up != was_up_) {
        hexload_node_bus_state(&node_, is_up);
        was_up_ = is_up;
    }
}

std::string CanFeed::description() const {
    return fmt::format("{}, profile {}{}", channel_->name(), hexload_bus_profile_name(profile_),
                       aes_ ? ", for commands with its key" : "");
}

std::string CanFeed::summary() const {
    const transport::ChannelCounts& counts = channel_->counts();
    std::string text = fmt::format(
        "{} frames sent, {} received, {} refused, {} periods overrun, {} bytes of stack never used",
        counts.sent, counts.received, node_.status.frames_refused, node_.status.overruns,
        stack_.margin_bytes());
    if (counts.send_failures + counts.receive_drops + counts.error_frames > 0) {
        text += fmt::format("; {} frames not sent, {} dropped on receipt, {} error frames",
                            counts.send_failures, counts.receive_drops, counts.error_frames);
    }
    if (const std::string advice = channel_->advice(); !advice.empty()) {
        text += "; " + advice;
    }
    return text;
}

} // namespace hexload::port
