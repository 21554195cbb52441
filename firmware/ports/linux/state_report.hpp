// What the controller says of itself: a line per change of state, with the cause of a fault and its remedy.
#pragma once

#include "app/app.h"

#include <chrono>
#include <cstdint>
#include <optional>
#include <string>

namespace hexload::port {

class StateReport {
  public:
    using Clock = std::chrono::steady_clock;

    StateReport(hexload_bus_profile_t profile, bool faults_only)
        : profile_(profile), faults_only_(faults_only) {}

    // The line for a change since the last call. Estimating and converged may alternate with every sample:
    // they are reported once per second at most.
    std::optional<std::string> changed(const hexload_app_t& app, Clock::time_point now);

    // The line for a load change that has been detected since the last call.
    std::optional<std::string> load_changed(const hexload_app_t& app);

  private:
    hexload_bus_profile_t profile_;
    bool faults_only_;
    hexload_app_state_t state_ = HEXLOAD_APP_IDLE;
    hexload_app_fault_t fault_ = HEXLOAD_FAULT_NONE;
    Clock::time_point last_progress_{};
    std::uint32_t load_changes_ = 0;
};

} // namespace hexload::port
