#include "options.hpp"

#include <hexload_sim/scenario.hpp>

#include <CLI/CLI.hpp>

#include <cmath>
#include <cstdlib>
#include <initializer_list>
#include <limits>
#include <map>
#include <string>

namespace {

namespace platform = hexload::platform;
namespace sim = hexload::sim;

/// CLI::Range lets NaN pass, which is not outside of anything.
std::string is_number(const std::string& text) {
    return std::isnan(std::strtod(text.c_str(), nullptr)) ? "found " + text + ", expected a number"
                                                          : std::string();
}

constexpr const char* footer = "Exit status: 0 done, 2 bad option or file, 3 the controller is silent, 4 it "
                               "speaks another profile, 5 a second\n"
                               "controller is on the bus, 6 the bus is down or cannot be opened, 7 the "
                               "controller is in fault or answers out of order, 130 ended by\n"
                               "Ctrl-C, with a run directory of what there was.\n"
                               "In real time a run goes on when the controller falls silent or the bus goes "
                               "down, and counts what was lost; status 3 says that\n"
                               "the controller was still silent at the end.\n"
                               "Example: hexload_sim paper.toml --out run --bus socketcan:vcan0 --real-time";

template <typename Enum> std::map<std::string, Enum> by_name(std::initializer_list<Enum> values) {
    std::map<std::string, Enum> names;
    for (const Enum value : values) {
        names.emplace(name_of(value), value);
    }
    return names;
}

void declare_experiment(CLI::App& app, Options& options) {
    using platform::EstimatorKind;
    const auto estimators =
        by_name({EstimatorKind::paper, EstimatorKind::momentum, EstimatorKind::momentum_effects});
    const auto priors = by_name({platform::PaperPrior::safe, platform::PaperPrior::printed});
    app.add_option("scenario", options.scenario, "scenario file (TOML)")->required();
    app.add_option("--out", options.out, "run directory to write")->required();
    app.add_option("--seed", options.seed, "seed of motion and noise")
        ->check(CLI::Range(std::int64_t{0}, std::numeric_limits<std::int64_t>::max()));
    app.add_option("--duration", options.duration_s, "length of the run in s")
        ->check(CLI::Range(sim::duration_min_s, sim::duration_max_s))
        ->check(is_number);
    app.add_option("--substeps", options.substeps, "RK4 steps per millisecond, at least one per tick")
        ->check(CLI::Range(std::int64_t{1}, sim::substeps_max));
    app.add_option("--estimator", options.estimator,
                   "estimator: paper, momentum, momentum_effects (default: the platform file's)")
        ->transform(CLI::CheckedTransformer(estimators));
    app.add_option("--prior", options.prior, "start covariance of the paper's filter: safe or printed")
        ->transform(CLI::CheckedTransformer(priors));
    app.add_option("--rig", options.rig, "rig file of hexload commission that the estimator has");
}

void declare_bus(CLI::App& app, Options& options) {
    const std::map<std::string, hexload_bus_profile_t> profiles = {{"fd", HEXLOAD_BUS_FD},
                                                                   {"classic", HEXLOAD_BUS_CLASSIC}};
    auto* bus = app.add_option(
        "--bus", options.bus,
        "where the estimator is: inproc (default), socketcan:INTERFACE, udp_multicast:GROUP[:PORT], "
        "slcan:HOST:PORT, slcan:DEVICE (with --profile classic)");
    auto* profile = app.add_option("--profile", options.profile, "frames of the bus: fd (default) or classic")
                        ->transform(CLI::CheckedTransformer(profiles));
    app.add_option("--feed", options.feed, "the estimator is not on a bus but on LCM: lcm, lcm:URL")
        ->excludes(bus, profile);
    app.add_option("--publish", options.publish,
                   "publish the run on LCM, samples and truth, for lcm-spy and lcm-logger: lcm, lcm:URL");
    auto* key = app.add_option("--key", options.key,
                               "key file of a controller that has one: commands are sent with its codes")
                    ->needs(bus);
    app.add_flag("--sample-codes", options.sample_codes,
                 "samples have codes of the key too, one for 16 ticks: without them the controller stops")
        ->needs(key);
    app.add_flag("--answer-codes", options.answer_codes,
                 "answers have codes of the key too, one for 16 ticks, or 64 in the classic profile: without "
                 "them the run ends")
        ->needs(key);
    auto* lockstep = app.add_flag("--lockstep", options.lockstep,
                                  "tick k + 1 follows when tick k is answered (default on a bus)");
    app.add_flag("--real-time", options.real_time, "ticks by the clock")->excludes(lockstep);
    app.add_flag(
        "--any-configuration", options.any_configuration,
        "start a controller whose machine, tuning or known mass is another than this simulator's files say");
    app.add_option("--answer-timeout", options.answer_timeout_s,
                   "silence of the controller, in s, that ends a run in lockstep (default 2) or is reported "
                   "in real time "
                   "(default 0.1)")
        ->check(CLI::Range(0.001, 3600.0))
        ->check(is_number);
}

} // namespace

sim::Pacing Options::pacing() const {
    if (real_time) {
        return sim::Pacing::real_time;
    }
    return is_in_process() ? sim::Pacing::free_running : sim::Pacing::lockstep;
}

std::optional<ExitStatus> read_command_line(int argc, char** argv, Options& options) {
    CLI::App app{"Simulates a hydraulic Stewart platform with a load and identifies the load on the way.",
                 "hexload_sim"};
    declare_experiment(app, options);
    declare_bus(app, options);
    app.add_flag("--force", options.force, "replace an existing run directory");
    app.add_flag("--quiet", options.quiet, "no progress, no summary");
    app.footer(footer);
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? exit_done : exit_bad_input;
    }
    return std::nullopt;
}
