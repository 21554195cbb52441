// hexload_sim SCENARIO.toml --out DIR: runs a scenario in closed loop, with the estimator's firmware in
// process or on a controller at the other end of a bus, and writes a run directory.
#include "options.hpp"

#include "app/app.h"
#include "links/can_link.hpp"
#include "links/estimate_file.hpp"
#include "links/inproc_link.hpp"
#include "links/lcm_link.hpp"
#include "links/lcm_plant_commands.hpp"
#include "links/lcm_publisher.hpp"
#include "platform_file/firmware_config.hpp"
#include "platform_file/input_error.hpp"
#include "platform_file/rig_file.hpp"
#include "platform_file/standard_output.hpp"
#include "transport/bus_load.hpp"
#include "transport/key.hpp"
#include "transport/real_time.hpp"

#include <hexload/hexload.h>
#include <hexload_sim/run_directory.hpp>
#include <hexload_sim/scaled_machine.hpp>
#include <hexload_sim/scenario.hpp>
#include <hexload_sim/simulator.hpp>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <thread>
#include <vector>

#include <unistd.h>

namespace {

namespace platform = hexload::platform;
namespace sim = hexload::sim;
namespace transport = hexload::transport;
namespace message = hexload::message;

constexpr std::uint32_t ticks_per_progress = 200;
constexpr double lockstep_timeout_s = 2.0;
constexpr double real_time_timeout_s = 0.1;

// Ctrl-C ends a run with the tick that it is in, and what there is of it is a run directory; a second one
// ends the program.
volatile std::sig_atomic_t is_interrupted = 0;

extern "C" void interrupt(int /*signal*/) {
    is_interrupted = 1;
    (void)std::signal(SIGINT, SIG_DFL);
}

sim::Scenario scenario_of(const Options& options) {
    sim::Scenario scenario = sim::load_scenario(options.scenario);
    scenario.seed = options.seed.value_or(scenario.seed);
    scenario.duration_s = options.duration_s.value_or(scenario.duration_s);
    scenario.substeps = options.substeps.value_or(scenario.substeps);
    return scenario;
}

platform::PlatformFile platform_of(const Options& options, const sim::Scenario& scenario) {
    platform::PlatformFile platform = platform::load_platform_file(scenario.platform);
    platform.estimator.kind = options.estimator.value_or(platform.estimator.kind);
    platform.estimator.prior = options.prior.value_or(platform.estimator.prior);
    if (!scenario.sensors.velocity_sensor) {
        platform.sensors = platform::without_velocity(platform.sensors);
    }
    return platform;
}

// The machine as the estimator knows it.
platform::PlatformFile known_platform(const Options& options, const platform::PlatformFile& platform) {
    return options.rig.empty() ? platform : platform::with_rig_file(platform, options.rig);
}

std::unique_ptr<sim::EstimatorLink> make_link(const Options& options,
                                              const platform::PlatformFile& platform) {
    if (options.is_in_process()) {
        if (options.lockstep) {
            throw platform::InputError("--lockstep: found with --bus inproc, expected a bus to wait for");
        }
        return sim::make_inproc_link(platform, platform.estimator, platform.sensors.tick_s, std::nullopt,
                                     options.publish.empty() ? sim::Traces::no : sim::Traces::yes);
    }
    const hexload_config_t config = platform::checked_firmware_config(
        platform, platform.estimator, platform.sensors.tick_s); // the controller has the same files
    const double timeout_s =
        options.answer_timeout_s.value_or(options.real_time ? real_time_timeout_s : lockstep_timeout_s);
    sim::CanLinkSettings settings;
    settings.tick_s = platform.sensors.tick_s;
    settings.profile = options.profile;
    settings.estimator = platform.estimator.kind;
    settings.known_mass_crc = hexload_bus_known_mass_crc(static_cast<float>(
        config.kind == HEXLOAD_KIND_PAPER ? config.paper.load_mass_kg : config.momentum.prior_mass_kg));
    settings.configuration = options.any_configuration ? 0 : hexload_app_configuration(&config);
    if (!options.key.empty()) {
        settings.key = transport::read_key(options.key);
        settings.has_sample_codes = options.sample_codes;
        settings.has_answer_codes = options.answer_codes;
    }
    settings.answer_timeout =
        std::chrono::ceil<std::chrono::milliseconds>(std::chrono::duration<double>(timeout_s));
    settings.report = [](const std::string& line) { fmt::print(stderr, "hexload_sim: {}\n", line); };
    if (!options.feed.empty()) {
        const std::string url = message::url_of(options.feed);
        return options.real_time ? sim::make_real_time_lcm_link(url, settings)
                                 : sim::make_lockstep_lcm_link(url, settings);
    }
    if (const auto overload = transport::find_overload(options.bus, options.profile, settings.tick_s)) {
        throw platform::InputError(*overload);
    }
    auto channel = transport::open_can_channel(options.bus, options.profile);
    return options.real_time ? sim::make_real_time_link(std::move(channel), settings)
                             : sim::make_lockstep_link(std::move(channel), settings);
}

std::unique_ptr<sim::LcmPublisher> make_publisher(const Options& options,
                                                  const platform::PlatformFile& platform) {
    if (options.publish.empty()) {
        return nullptr;
    }
    const bool feeds =
        !options.feed.empty() && message::url_of(options.feed) == message::url_of(options.publish);
    return std::make_unique<sim::LcmPublisher>(message::url_of(options.publish), platform.geometry,
                                               feeds ? sim::PublishSamples::no : sim::PublishSamples::yes);
}

// Only of a run by the clock: in any other nobody could say when.
std::unique_ptr<sim::LcmPlantCommands> make_commands(const Options& options, sim::Simulator& simulator) {
    if (options.publish.empty() || !options.real_time) {
        return nullptr;
    }
    return std::make_unique<sim::LcmPlantCommands>(
        message::url_of(options.publish), simulator,
        [](const std::string& line) { fmt::print(stderr, "hexload_sim: {}\n", line); });
}

void show_progress(std::uint32_t done, std::uint32_t total) {
    constexpr std::size_t width = 40;
    const std::size_t filled = width * done / total;
    fmt::print(stderr, "\r[{:#<{}}{:.<{}}] {:3} %", "", filled, "", width - filled, 100ULL * done / total);
    if (done == total) {
        fmt::print(stderr, "\n");
    }
}

void print_bus(const sim::BusCounts& bus) {
    fmt::print("  {}, profile {}: {} samples, {} answers, {} missing, {} late\n", bus.name, bus.profile,
               bus.samples, bus.answers, bus.missing, bus.late);
    fmt::print(
        "  frames: {} sent, {} received, {} of them refused, {} not sent, {} dropped on receipt, {} error "
        "frames\n",
        bus.frames_sent, bus.frames_received, bus.refused, bus.send_failures, bus.receive_drops,
        bus.error_frames);
    if (bus.rejoins + bus.outages > 0) {
        fmt::print("  the bus went down {} times, the controller was started again {} times\n", bus.outages,
                   bus.rejoins);
    }
    if (bus.events_missing > 0) {
        fmt::print("  {} events of a changed load did not arrive\n", bus.events_missing);
    }
    if (!bus.advice.empty()) {
        fmt::print("  {}\n", bus.advice);
    }
}

void print_pacing(const sim::PacingCounts& pacing, double tick_s) {
    fmt::print(
        "  {} periods of {:g} ms, {} overruns; late by {} us (median), {} us (99 %), {} us (longest)\n",
        pacing.periods, 1e3 * tick_s, pacing.overruns, pacing.lateness.quantile_us(0.5),
        pacing.lateness.quantile_us(0.99), pacing.lateness.longest_us());
}

// The mass that the estimator was given, and where that is not the load which the scenario has.
void print_known_mass(const sim::Scenario& scenario, const platform::PlatformFile& platform) {
    const bool is_taken =
        platform.estimator.kind == platform::EstimatorKind::paper || platform.estimator.from_known_mass;
    if (!platform.known_mass_kg || !is_taken) {
        return;
    }
    fmt::print("  given beforehand: the load weighs {:g} kg (load.known_mass_kg of {})\n",
               *platform.known_mass_kg, scenario.platform.filename().string());
    for (const sim::LoadChange& change : scenario.loads) {
        if (change.load.mass_kg != *platform.known_mass_kg && change.at_s <= scenario.duration_s) {
            fmt::print("    not true: from {:g} s on it weighs {:g} kg\n", change.at_s, change.load.mass_kg);
        }
    }
}

// What to do about a verdict that the machine itself causes, or its sensors.
// The paper's filter cannot tell them from a load that is not its own; `hexload sim` has the words for both.
void print_mend(const std::vector<sim::HealthCount>& health, const sim::EstimatorLink& link,
                std::string_view verdict, platform::EstimatorKind kind) {
    if (const std::string fault = link.input_fault(); !fault.empty()) {
        fmt::print("  input: {}\n", fault);
        return;
    }
    const auto is_misfit = [](const sim::HealthCount& count) {
        return count.name == hexload_health_name(HEXLOAD_HEALTH_MODEL_MISFIT) && count.ticks > 0;
    };
    if (kind != platform::EstimatorKind::paper &&
        verdict != hexload_verdict_name(HEXLOAD_VERDICT_CONVERGED) &&
        std::ranges::any_of(health, is_misfit)) {
        fmt::print(
            "  the machine does not fit its platform file: a base that is not level, friction, legs with "
            "mass or late sensors do that; `hexload commission` finds them in a run of the empty platform\n");
    }
}

void print_summary(const sim::Scenario& scenario, const platform::PlatformFile& platform,
                   const sim::RunResult& result, const sim::EstimatorLink& link,
                   const std::optional<sim::EstimateRow>& last, double elapsed_s) {
    const sim::RunCounts& counts = result.counts;
    fmt::print("{}: {} ticks, {} samples missing, {} refused, {:.2f} s, {:.0f} x real time\n", scenario.name,
               counts.ticks, counts.missing, counts.refused, elapsed_s, scenario.duration_s / elapsed_s);
    if (counts.refused > 0) {
        fmt::print("  last refusal: {}\n", link.last_refusal());
    }
    if (result.bus) {
        print_bus(*result.bus);
    }
    if (result.pacing.counts != nullptr) {
        print_pacing(*result.pacing.counts, platform.sensors.tick_s);
    }
    print_known_mass(scenario, platform);
    const auto names = link.parameter_names();
    for (std::size_t i = 0; last && i < names.size(); ++i) {
        fmt::print("  {:<8} {:10.4f} +- {:.2g}\n", names[i], last->value[i], last->sigma[i]);
    }
    for (const sim::ConfoundedParameter& parameter : link.confounded_parameters()) {
        fmt::print("  {}: {}\n", parameter.name, parameter.reason);
    }
    if (last) {
        fmt::print("  verdict: {}\n", last->verdict);
        print_mend(result.health, link, last->verdict, platform.estimator.kind);
    }
    if (!result.load_changes_s.empty()) {
        fmt::print("  another load detected at {:.3f} s\n", fmt::join(result.load_changes_s, " s, "));
    }
}

// Writes what comes out of the loop, tick by tick.
class Recorder {
  public:
    Recorder(sim::RunDirectory& directory, const sim::EstimatorLink& link, std::uint32_t ticks, bool show)
        : directory_(directory), estimates_(directory.file("estimates.csv"), link), ticks_(ticks),
          show_(show) {}

    void write(const sim::Tick& tick, std::span<const sim::EstimateRow> rows) {
        directory_.write(tick);
        write(rows);
        if (show_ && (tick.index % ticks_per_progress == 0 || tick.index + 1 == ticks_)) {
            show_progress(tick.index + 1, ticks_);
        }
    }
    void write(std::span<const sim::EstimateRow> rows) {
        for (const sim::EstimateRow& row : rows) {
            estimates_.write(row);
            last_ = row;
        }
    }
    void close() {
        estimates_.close();
    }
    const std::optional<sim::EstimateRow>& last() const {
        return last_;
    }

  private:
    sim::RunDirectory& directory_;
    sim::EstimateFile estimates_;
    std::uint32_t ticks_;
    bool show_;
    std::optional<sim::EstimateRow> last_;
};

std::chrono::nanoseconds nanoseconds_of(double seconds) {
    return std::chrono::round<std::chrono::nanoseconds>(std::chrono::duration<double>(seconds));
}

// The run's clock and what the system granted it; idle unless in real time.
struct RealTime {
    RealTime(bool wanted, double tick_s) : is_wanted(wanted), pacer(clock, nanoseconds_of(tick_s)) {
        // On a single processor a simulator that is too slow would leave nothing to the controller.
        if (wanted && std::thread::hardware_concurrency() > 1) {
            rights = transport::request_real_time(transport::simulator_priority);
        }
    }
    sim::PacingResult result(sim::Pacing mode) const {
        if (!is_wanted) {
            return {.mode = mode};
        }
        return {mode, &pacer.counts(), rights.has_priority, rights.has_locked_memory};
    }

    bool is_wanted;
    sim::MonotonicClock clock;
    sim::Pacer pacer;
    transport::RealTimeRights rights;
};

// What of the scenario has taken place in so many ticks.
void cut(sim::Scenario& scenario, std::uint32_t ticks, double tick_s) {
    scenario.duration_s = tick_s * (ticks - 1);
    std::erase_if(scenario.loads,
                  [&](const sim::LoadChange& change) { return change.at_s > scenario.duration_s; });
}

ExitStatus simulate(const Options& options) {
    sim::Scenario scenario = scenario_of(options);
    const platform::PlatformFile platform = platform_of(options, scenario);
    sim::suit_default_servo(scenario, platform);
    scenario.sensors.velocity_sensor = platform.sensors.has_velocity;
    sim::Simulator simulator(platform, scenario);
    const auto link = make_link(options, known_platform(options, platform));
    const auto publisher = make_publisher(options, platform);
    const auto commands = make_commands(options, simulator);
    sim::RunDirectory directory(options.out, options.force);
    directory.write_inputs(scenario);
    if (!options.rig.empty()) {
        directory.write_rig(options.rig);
    }
    Recorder recorder(directory, *link, simulator.ticks(), !options.quiet && isatty(STDERR_FILENO) != 0);
    RealTime real_time(options.real_time, simulator.tick_s());

    (void)std::signal(SIGINT, interrupt);
    link->start();
    const auto start = std::chrono::steady_clock::now();
    sim::RunResult result;
    result.counts = sim::run(
        simulator, link.get(),
        [&](const sim::Tick& tick, std::span<const sim::EstimateRow> rows) {
            recorder.write(tick, rows);
            if (commands) {
                commands->take();
            }
            if (publisher) {
                publisher->publish(tick, simulator.load());
                if (const auto trace = link->trace(); trace && !rows.empty()) {
                    publisher->publish(*trace);
                }
            }
            if (is_interrupted != 0) {
                simulator.end_now();
            }
        },
        options.real_time ? &real_time.pacer : nullptr);
    recorder.write(link->finish());
    result.counts.refused = link->refused(); // with the last answers
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
    recorder.close();
    if (is_interrupted != 0) {
        cut(scenario, result.counts.ticks, simulator.tick_s());
    }
    result.health = link->health_counts();
    result.load_changes_s = link->load_changes_s();
    result.input_faults = link->input_faults();
    result.bus = link->bus_counts();
    result.pacing = real_time.result(options.pacing());
    directory.finish(scenario, platform, simulator, result);
    if (!options.quiet) {
        print_summary(scenario, platform, result, *link, recorder.last(), elapsed.count());
        if (publisher && publisher->failed() > 0) {
            fmt::print("  {} messages not published\n", publisher->failed());
        }
        fmt::print("written to {}\n", options.out);
    }
    if (is_interrupted != 0) {
        fmt::print(stderr, "hexload_sim: interrupted after {:g} s\n", scenario.duration_s);
        return exit_interrupted;
    }
    if (result.bus && result.bus->ends_silent) {
        fmt::print(stderr, "hexload_sim: {}: the controller was silent at the end of the run\n",
                   result.bus->name);
        return exit_silent_controller;
    }
    return exit_done;
}

ExitStatus status_of(sim::LinkFailure failure) {
    switch (failure) {
    case sim::LinkFailure::silent_controller:
        return exit_silent_controller;
    case sim::LinkFailure::wrong_profile:
        return exit_wrong_profile;
    case sim::LinkFailure::second_controller:
        return exit_second_controller;
    case sim::LinkFailure::bus_down:
        return exit_bus_down;
    case sim::LinkFailure::controller_fault:
        break;
    }
    return exit_controller_fault;
}

ExitStatus status_of(const std::exception& error) {
    if (const auto* link = dynamic_cast<const sim::LinkError*>(&error)) {
        return status_of(link->failure());
    }
    const bool is_name = dynamic_cast<const transport::ChannelNameError*>(&error) != nullptr ||
                         dynamic_cast<const message::UrlError*>(&error) != nullptr;
    const bool is_transport = dynamic_cast<const transport::ChannelError*>(&error) != nullptr ||
                              dynamic_cast<const message::SessionError*>(&error) != nullptr;
    return is_transport && !is_name ? exit_bus_down : exit_bad_input;
}

} // namespace

int main(int argc, char** argv) {
    Options options;
    if (const auto status = read_command_line(argc, argv, options)) {
        return platform::status_with_output("hexload_sim", *status);
    }
    try {
        return platform::status_with_output("hexload_sim", simulate(options));
    } catch (const std::exception& error) {
        fmt::print(stderr, "hexload_sim: {}\n", error.what());
        return status_of(error);
    }
}
