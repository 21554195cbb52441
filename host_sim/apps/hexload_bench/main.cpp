// hexload_bench SCENARIO.toml: wall time of the plant alone and of the closed loop with the firmware, on one
// thread and without files. Prints one JSON object; `hexload bench` reads it.
#include "links/inproc_link.hpp"
#include "platform_file/platform_file.hpp"
#include "platform_file/standard_output.hpp"

#include <hexload_sim/scenario.hpp>
#include <hexload_sim/simulator.hpp>

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <limits>

namespace {

namespace platform = hexload::platform;
namespace sim = hexload::sim;

constexpr int exit_bad_input = 2;
constexpr int repetitions = 3; // the shortest counts: what disturbs it only makes it longer

double wall_time_s(const platform::PlatformFile& platform, const sim::Scenario& scenario,
                   bool with_firmware) {
    double shortest = std::numeric_limits<double>::infinity();
    for (int i = 0; i < repetitions; ++i) {
        sim::Simulator simulator(platform, scenario);
        const auto link = sim::make_inproc_link(platform, platform.estimator, platform.sensors.tick_s);
        const auto start = std::chrono::steady_clock::now();
        sim::run(simulator, with_firmware ? link.get() : nullptr);
        const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
        shortest = std::min(shortest, elapsed.count());
    }
    return shortest;
}

} // namespace

int main(int argc, char** argv) {
    if (argc != 2) {
        fmt::print(stderr, "hexload_bench: found {} arguments, expected one, a scenario file\n", argc - 1);
        return exit_bad_input;
    }
    try {
        const sim::Scenario scenario = sim::load_scenario(argv[1]);
        const platform::PlatformFile platform = platform::load_platform_file(scenario.platform);
        fmt::print("{{\"simulated_s\": {}, \"substeps\": {}, \"plant_s\": {}, \"closed_loop_s\": {}}}\n",
                   scenario.duration_s, scenario.substeps, wall_time_s(platform, scenario, false),
                   wall_time_s(platform, scenario, true));
    } catch (const std::exception& error) {
        fmt::print(stderr, "hexload_bench: {}\n", error.what());
        return exit_bad_input;
    }
    return platform::status_with_output("hexload_bench", 0);
}
