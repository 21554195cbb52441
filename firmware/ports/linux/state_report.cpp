#include "state_report.hpp"

#include <fmt/format.h>

namespace hexload::port {
namespace {

constexpr std::chrono::seconds progress_period{1};

bool is_progress(hexload_app_state_t state) {
    return state == HEXLOAD_APP_ESTIMATING || state == HEXLOAD_APP_CONVERGED;
}

std::string wrong_profile(hexload_bus_profile_t own) {
    const char* mine = hexload_bus_profile_name(own);
    const char* other =
        hexload_bus_profile_name(own == HEXLOAD_BUS_FD ? HEXLOAD_BUS_CLASSIC : HEXLOAD_BUS_FD);
    return fmt::format("samples of the profile {0} are on the bus, this controller speaks {1}: start it with "
                       "--profile {0}, or the simulator with --profile {1}",
                       other, mine);
}

std::string cause(const hexload_app_t& app, hexload_bus_profile_t profile) {
    switch (app.fault) {
    case HEXLOAD_FAULT_SAMPLE_TIMEOUT:
        return fmt::format(
            "the samples are silent since tick {}: is the simulator still running? Its next RESET and "
            "START begin anew",
            app.last_tick + 1);
    case HEXLOAD_FAULT_SAMPLES_REFUSED:
        return fmt::format("{} samples of the source refused in a row, the last good one at tick {}: check "
                           "the sensors and the platform file",
                           app.refused_in_a_row, app.last_tick);
    case HEXLOAD_FAULT_WRONG_PROFILE:
        return wrong_profile(profile);
    case HEXLOAD_FAULT_SECOND_CONTROLLER:
        return "a second controller is on the bus: stop one of the two";
    case HEXLOAD_FAULT_SECOND_SOURCE:
        return fmt::format("samples of two sources are on the bus, or of one that began anew without START: "
                           "those from elsewhere are refused, the last good one was at tick {}; stop one of "
                           "the two, then RESET and START begin anew",
                           app.last_tick);
    case HEXLOAD_FAULT_NOT_AUTHENTICATED:
        return fmt::format(
            "the samples are not those of who started it, the last one at tick {}: their codes are "
            "missing or wrong; RESET and START begin anew",
            app.last_tick);
    case HEXLOAD_FAULT_BUS_DOWN:
        return fmt::format("the bus is down, last tick {}: waiting for it", app.last_tick);
    default:
        return hexload_app_fault_name(app.fault);
    }
}

std::string describe(const hexload_app_t& app, hexload_bus_profile_t profile,
                     hexload_app_fault_t last_fault) {
    switch (app.state) {
    case HEXLOAD_APP_FAULT:
        return "fault: " + cause(app, profile);
    case HEXLOAD_APP_ARMED:
        return fmt::format("armed, {}, {} filter",
                           app.pacing == HEXLOAD_PACING_LOCKSTEP ? "lockstep" : "real time",
                           hexload_describe(app.config.kind)->name);
    case HEXLOAD_APP_IDLE:
        return last_fault == HEXLOAD_FAULT_BUS_DOWN ? "idle: the bus is up again" : "idle";
    default:
        return fmt::format("{} at tick {}", hexload_app_state_name(app.state), app.last_tick);
    }
}

} // namespace

std::optional<std::string> StateReport::changed(const hexload_app_t& app, Clock::time_point now) {
    if (app.state == state_ && app.fault == fault_) {
        return std::nullopt;
    }
    if (is_progress(state_) && is_progress(app.state)) {
        if (now - last_progress_ < progress_period) {
            return std::nullopt;
        }
        last_progress_ = now;
    }
    const bool concerns_fault = app.fault != HEXLOAD_FAULT_NONE || fault_ != HEXLOAD_FAULT_NONE;
    std::string line = describe(app, profile_, fault_);
    state_ = app.state;
    fault_ = app.fault;
    return faults_only_ && !concerns_fault ? std::nullopt : std::optional(std::move(line));
}

std::optional<std::string> StateReport::load_changed(const hexload_app_t& app) {
    const std::uint32_t before = load_changes_;
    load_changes_ = hexload_app_health(&app)->count[HEXLOAD_HEALTH_LOAD_CHANGED];
    if (load_changes_ <= before || faults_only_) {
        return std::nullopt;
    }
    return fmt::format("another load detected at tick {}", app.change_tick);
}

} // namespace hexload::port
