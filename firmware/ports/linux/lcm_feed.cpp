#include "lcm_feed.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>

namespace hexload::port {

LcmFeed::LcmFeed(const std::string& url, const hexload_config_t& config,
                 const hexload_app_settings_t& settings)
    : session_(url),
      samples_(session_.subscribe<leg_sample_t>([this](const leg_sample_t& message) { take(message); })),
      commands_(session_.subscribe<command_t>([this](const command_t& message) { take(message); })),
      descriptor_(session_.descriptor()) {
    const hexload_status_t status = hexload_app_init(&app_, &config, &settings);
    if (status != HEXLOAD_OK) {
        throw std::invalid_argument(std::string("the controller refuses its configuration: ") +
                                    hexload_status_name(status));
    }
}

void LcmFeed::receive(const std::function<void()>& after_each) {
    for (int n = 0; n < messages_per_call && session_.handle(std::chrono::milliseconds{0}); ++n) {
        after_each();
    }
}

void LcmFeed::period(std::uint32_t periods) {
    overruns_ += periods > 1 ? periods - 1 : 0;
    hexload_app_elapse(&app_, periods);
}

void LcmFeed::take(const leg_sample_t& message) {
    if (samples_.has_two_sources()) {
        hexload_app_set_fault(&app_, HEXLOAD_FAULT_SECOND_SOURCE);
    }
    const auto sample = transport::leg_sample_of(message);
    if (!sample) {
        ++refused_;
        return;
    }
    hexload_bus_answer_t answer{};
    hexload_app_sample(&app_, &*sample, &answer);
    if (answer.status == HEXLOAD_OK &&
        hexload_app_has_load_changed(&app_, sample->tick)) { // before the answer, as on a CAN bus
        load_change_t change = transport::load_change_message({app_.change_tick, changes_detected()});
        load_changes_.send(change);
    }
    estimate_t estimate = transport::estimate_message(answer);
    health_t health = transport::health_message(answer, app_.samples_missing);
    estimates_.send(estimate);
    healths_.send(health);
}

std::uint16_t LcmFeed::changes_detected() const {
    constexpr std::uint32_t most = std::numeric_limits<std::uint16_t>::max();
    const std::uint32_t count = hexload_app_health(&app_)->count[HEXLOAD_HEALTH_LOAD_CHANGED];
    return static_cast<std::uint16_t>(std::min(count, most));
}

void LcmFeed::take(const command_t& message) {
    const auto command = transport::command_of(message);
    if (!command) {
        ++refused_;
        return;
    }
    hexload_bus_acknowledge_t acknowledge{};
    if (std::isfinite(command->argument)) {
        hexload_app_command(&app_, &*command, &acknowledge);
    } else {
        acknowledge.kind = command->kind;
        acknowledge.source = command->source;
        acknowledge.session = command->session;
        acknowledge.sequence = command->sequence;
        acknowledge.result = HEXLOAD_RESULT_BAD_ARGUMENT;
        acknowledge.state = static_cast<std::uint8_t>(app_.state);
        acknowledge.fault = static_cast<std::uint8_t>(app_.fault);
    }
    acknowledge_t reply = transport::acknowledge_message(acknowledge, app_.last_tick);
    acknowledges_.send(reply);
}

std::string LcmFeed::description() const {
    return "LCM " + session_.url();
}

std::string LcmFeed::summary() const {
    return fmt::format(
        "{} samples and {} commands received, {} messages lost, {} refused, {} answers sent, {} failed; "
        "{} periods overrun",
        samples_.received(), commands_.received(), samples_.lost() + commands_.lost(), refused_,
        healths_.sent(),
        estimates_.failed() + healths_.failed() + load_changes_.failed() + acknowledges_.failed(), overruns_);
}

} // namespace hexload::port
