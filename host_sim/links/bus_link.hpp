// The estimator on a controller that is reached by a wire: how a run paces itself, whatever the wire is.
#pragma once

#include "controller_wire.hpp"

#include "platform_file/platform_file.hpp"

#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>

namespace hexload::sim {

// A number of the bus contract that tells one run of a program from another.
std::uint16_t draw_session();

struct LinkSettings {
    // Whose commands these are.
    std::uint16_t session = draw_session();
    // hexload_app_configuration() that the controller must have to start: tick, machine, sensors and tuning
    // are in it; 0: any.
    std::uint32_t configuration = 0;
    // Which one the controller is to run.
    EstimatorKind estimator = EstimatorKind::paper;
    // From sample to sample.
    double tick_s = default_tick_s;
    // What its acknowledge of START must say of the load's known mass, unless it does not tell; nothing: any.
    std::optional<std::uint8_t> known_mass_crc;
    // Silence of the controller after which lockstep gives up and real time speaks up.
    std::chrono::milliseconds answer_timeout{2000};
    // Told of what happens on the bus in the run (real time): one line each.
    std::function<void(const std::string&)> report = [](const std::string&) {};
    // Tests have a clock of their own.
    std::function<std::chrono::steady_clock::time_point()> now = &std::chrono::steady_clock::now;
};

// Sends tick k and goes on when the controller has answered it, if the wire has it answered. Any answer that
// is missing, doubled, out of order or another estimator's ends the run with a LinkError, and so does an
// outage of the bus.
std::unique_ptr<EstimatorLink> make_lockstep_link(std::unique_ptr<ControllerWire> wire,
                                                  const LinkSettings& settings);

// Sends at every tick and takes the answers that are there. Missing and late answers are counted; outages of
// the bus and restarts of the controller are survived, reported and counted.
std::unique_ptr<EstimatorLink> make_real_time_link(std::unique_ptr<ControllerWire> wire,
                                                   const LinkSettings& settings);

} // namespace hexload::sim
