#include "lcm_wire.hpp"

#include "firmware_sample.hpp"
#include "lcm_link.hpp"

#include <fmt/format.h>

namespace hexload::sim {

LcmWire::LcmWire(const std::string& url) : name_("lcm:" + url), session_(url) {
    received_[0] = &session_.subscribe<estimate_t>([this](const estimate_t& message) { take(message); });
    received_[1] = &session_.subscribe<health_t>([this](const health_t& message) { take(message); });
    received_[2] =
        &session_.subscribe<acknowledge_t>([this](const acknowledge_t& message) { take(message); });
    received_[3] =
        &session_.subscribe<load_change_t>([this](const load_change_t& message) { take(message); });
}

void LcmWire::send(const hexload_bus_command_t& command) {
    command_t message = transport::command_message(command, newest_tick_);
    is_up_ = commands_.send(message);
}

bool LcmWire::send(const LegSample& sample, std::chrono::microseconds) {
    leg_sample_t message = transport::leg_sample_message(firmware_sample(sample));
    newest_tick_ = sample.tick;
    is_up_ = samples_.send(message);
    return is_up_;
}

std::optional<BusNews> LcmWire::read(std::chrono::microseconds timeout) {
    if (news_.empty()) {
        session_.handle(std::chrono::ceil<std::chrono::milliseconds>(timeout));
    }
    if (news_.empty()) {
        return std::nullopt;
    }
    const BusNews news = news_.front();
    news_.pop_front();
    return news;
}

void LcmWire::take(const estimate_t& message) {
    if (received_[0]->has_two_sources()) {
        throw LinkError(LinkFailure::second_controller,
                        name_ + ": two controllers publish their answers: end one of the two");
    }
    incomplete_ += estimate_ ? 1U : 0U;
    estimate_ = message;
    news_.emplace_back(AnswerPart{static_cast<std::uint32_t>(message.tick), false, std::nullopt});
}

void LcmWire::take(const health_t& message) {
    AnswerPart part{static_cast<std::uint32_t>(message.tick), true, std::nullopt};
    if (estimate_ && estimate_->tick == message.tick) {
        part.whole = transport::answer_of(*estimate_, message);
        if (!part.whole) {
            throw LinkError(
                LinkFailure::controller_fault,
                fmt::format("{}: the answer to tick {} has a word that this simulator does not know", name_,
                            message.tick));
        }
    } else {
        ++incomplete_;
        part.ends_tick = false;
    }
    estimate_.reset();
    news_.emplace_back(part);
}

void LcmWire::take(const acknowledge_t& message) {
    if (const auto acknowledge = transport::acknowledge_of(message)) {
        news_.emplace_back(*acknowledge);
    } else {
        news_.emplace_back(UnrelatedFrame{});
    }
}

void LcmWire::take(const load_change_t& message) {
    if (const auto change = transport::load_change_of(message)) {
        news_.emplace_back(*change);
    } else {
        news_.emplace_back(UnrelatedFrame{});
    }
}

BusCounts LcmWire::counts() const {
    BusCounts counts;
    counts.name = name_;
    counts.profile = "messages";
    counts.frames_sent = samples_.sent() + commands_.sent();
    counts.send_failures = samples_.failed() + commands_.failed();
    for (const message::GapCounter* channel : received_) {
        counts.frames_received += channel->received();
        counts.receive_drops += channel->lost();
    }
    return counts;
}

std::unique_ptr<EstimatorLink> make_lockstep_lcm_link(const std::string& url, const LinkSettings& settings) {
    return make_lockstep_link(std::make_unique<LcmWire>(url), settings);
}

std::unique_ptr<EstimatorLink> make_real_time_lcm_link(const std::string& url, const LinkSettings& settings) {
    return make_real_time_link(std::make_unique<LcmWire>(url), settings);
}

} // namespace hexload::sim
