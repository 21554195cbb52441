// The command line of hexload_sim.
#pragma once

#include "bus/bus.h"
#include "platform_file/platform_file.hpp"

#include <hexload_sim/pacer.hpp>

#include <cstdint>
#include <optional>
#include <string>

enum ExitStatus {
    exit_done = 0,
    exit_bad_input = 2,
    exit_silent_controller = 3,
    exit_wrong_profile = 4,
    exit_second_controller = 5,
    exit_bus_down = 6,
    exit_controller_fault = 7,
    exit_interrupted = 130, // by Ctrl-C, as of a shell; the run directory holds what there was
};

struct Options {
    std::string scenario;
    std::string out;
    std::string rig; // of the controller; the plant is the scenario's
    std::optional<std::int64_t> seed;
    std::optional<double> duration_s;
    std::optional<std::int64_t> substeps;
    std::optional<hexload::platform::EstimatorKind> estimator;
    std::optional<hexload::platform::PaperPrior> prior;
    std::string bus = "inproc";
    hexload_bus_profile_t profile = HEXLOAD_BUS_FD;
    std::string feed;    // lcm or lcm:URL: the controller is there, not on a bus
    std::string publish; // lcm or lcm:URL: the run is published there
    std::string key;     // file: the controller's
    bool sample_codes = false;
    bool answer_codes = false;
    bool any_configuration = false;
    std::optional<double> answer_timeout_s;
    bool lockstep = false;
    bool real_time = false;
    bool force = false;
    bool quiet = false;

    bool is_in_process() const {
        return bus == "inproc" && feed.empty();
    }
    hexload::sim::Pacing pacing() const;
};

// A status: the program ends with it, as all has been said (help, or what is wrong).
std::optional<ExitStatus> read_command_line(int argc, char** argv, Options& options);
