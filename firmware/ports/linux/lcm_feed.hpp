// The controller on LCM: hexload_app fed with leg samples and commands as messages.
//
// There is no listening time as on a CAN bus: two controllers at one URL both answer, and the simulator says
// so.
#pragma once

#include "feed.hpp"

#include "transport/lcm_messages.hpp"

#include <hexload_lcm/session.hpp>

namespace hexload::port {

class LcmFeed final : public Feed {
  public:
    // `config` and `settings` are such that hexload_app_init() takes them, else std::invalid_argument. Throws
    // message::SessionError.
    LcmFeed(const std::string& url, const hexload_config_t& config, const hexload_app_settings_t& settings);

    int descriptor() const override {
        return descriptor_;
    }
    void receive(const std::function<void()>& after_each) override;
    void period(std::uint32_t periods) override;
    bool is_ready() const override {
        return true;
    }
    bool is_taken() const override {
        return false;
    }
    const hexload_app_t& app() const override {
        return app_;
    }
    hexload_bus_profile_t profile() const override {
        return HEXLOAD_BUS_FD; // no frames here: messages carry whole samples, as the FD profile does
    }
    std::string description() const override;
    std::string summary() const override;

  private:
    void take(const leg_sample_t& message);
    void take(const command_t& message);
    std::uint16_t changes_detected() const;

    message::Session session_;
    message::Publisher<estimate_t> estimates_{session_};
    message::Publisher<health_t> healths_{session_};
    message::Publisher<load_change_t> load_changes_{session_};
    message::Publisher<acknowledge_t> acknowledges_{session_};
    const message::GapCounter& samples_;
    const message::GapCounter& commands_;
    int descriptor_;
    hexload_app_t app_{};
    std::uint64_t refused_ = 0;
    std::uint64_t overruns_ = 0;
};

} // namespace hexload::port
