// hexload_sim SCENARIO.toml --out DIR: runs a scenario in closed loop with the estimator's firmware in
// process and writes a run directory.
#include <hexload_sim/estimate_file.hpp>
#include <hexload_sim/inproc_link.hpp>
#include <hexload_sim/input_error.hpp>
#include <hexload_sim/run_directory.hpp>
#include <hexload_sim/scenario.hpp>
#include <hexload_sim/simulator.hpp>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <chrono>
#include <initializer_list>
#include <limits>
#include <map>
#include <optional>
#include <string>

#include <unistd.h>

namespace {

namespace sim = hexload::sim;

constexpr int exit_bad_input = 2;
constexpr std::uint32_t ticks_per_progress = 200;

struct Options {
    std::string scenario;
    std::string out;
    std::optional<std::int64_t> seed;
    std::optional<double> duration_s;
    std::optional<std::int64_t> substeps;
    std::optional<sim::EstimatorKind> estimator;
    std::optional<sim::PaperPrior> prior;
    bool force = false;
    bool quiet = false;
};

template <typename Enum> std::map<std::string, Enum> by_name(std::initializer_list<Enum> values) {
    std::map<std::string, Enum> names;
    for (const Enum value : values) {
        names.emplace(sim::name_of(value), value);
    }
    return names;
}

void declare(CLI::App& app, Options& options) {
    const auto estimators = by_name({sim::EstimatorKind::paper, sim::EstimatorKind::momentum});
    const auto priors = by_name({sim::PaperPrior::safe, sim::PaperPrior::printed});
    app.add_option("scenario", options.scenario, "scenario file (TOML)")->required();
    app.add_option("--out", options.out, "run directory to write")->required();
    app.add_option("--seed", options.seed, "seed of motion and noise")
        ->check(CLI::Range(std::int64_t{0}, std::numeric_limits<std::int64_t>::max()));
    app.add_option("--duration", options.duration_s, "length of the run in s")
        ->check(CLI::Range(sim::duration_min_s, sim::duration_max_s));
    app.add_option("--substeps", options.substeps, "RK4 steps per 1 ms tick")
        ->check(CLI::Range(std::int64_t{1}, sim::substeps_max));
    app.add_option("--estimator", options.estimator,
                   "estimator: paper, momentum (default: the platform file's)")
        ->transform(CLI::CheckedTransformer(estimators));
    app.add_option("--prior", options.prior, "start covariance of the paper's filter: safe or printed")
        ->transform(CLI::CheckedTransformer(priors));
    app.add_flag("--force", options.force, "replace an existing run directory");
    app.add_flag("--quiet", options.quiet, "no progress, no summary");
}

sim::Scenario scenario_of(const Options& options) {
    sim::Scenario scenario = sim::load_scenario(options.scenario);
    scenario.seed = options.seed.value_or(scenario.seed);
    scenario.duration_s = options.duration_s.value_or(scenario.duration_s);
    scenario.substeps = options.substeps.value_or(scenario.substeps);
    return scenario;
}

sim::PlatformFile platform_of(const Options& options, const sim::Scenario& scenario) {
    sim::PlatformFile platform = sim::load_platform_file(scenario.platform);
    platform.estimator.kind = options.estimator.value_or(platform.estimator.kind);
    platform.estimator.prior = options.prior.value_or(platform.estimator.prior);
    return platform;
}

void show_progress(std::uint32_t done, std::uint32_t total) {
    constexpr std::size_t width = 40;
    const std::size_t filled = width * done / total;
    fmt::print(stderr, "\r[{:#<{}}{:.<{}}] {:3} %", "", filled, "", width - filled, 100ULL * done / total);
    if (done == total) {
        fmt::print(stderr, "\n");
    }
}

void print_summary(const sim::Scenario& scenario, const sim::RunCounts& counts, const sim::InprocLink& link,
                   const std::optional<sim::EstimateRow>& last, double elapsed_s) {
    fmt::print("{}: {} ticks, {} samples missing, {} refused, {:.2f} s, {:.0f} x real time\n", scenario.name,
               counts.ticks, counts.missing, counts.refused, elapsed_s, scenario.duration_s / elapsed_s);
    if (counts.refused > 0) {
        fmt::print("  last refusal: {}\n", link.last_refusal());
    }
    const auto names = link.parameter_names();
    for (std::size_t i = 0; last && i < names.size(); ++i) {
        fmt::print("  {:<4} {:10.4f} +- {:.2g}\n", names[i], last->value[i], last->sigma[i]);
    }
    if (last) {
        fmt::print("  verdict: {}\n", last->verdict);
    }
}

void simulate(const Options& options) {
    const sim::Scenario scenario = scenario_of(options);
    const sim::PlatformFile platform = platform_of(options, scenario);
    sim::Simulator simulator(platform, scenario);
    const auto link = sim::make_inproc_link(platform, platform.estimator);
    sim::RunDirectory directory(options.out, options.force);
    directory.write_inputs(scenario);
    sim::EstimateFile estimates(directory.file("estimates.csv"), link->parameter_names());

    const bool progress = !options.quiet && isatty(STDERR_FILENO) != 0;
    std::optional<sim::EstimateRow> last;
    const auto start = std::chrono::steady_clock::now();
    const sim::RunCounts counts = sim::run(
        simulator, link.get(), [&](const sim::Tick& tick, const std::optional<sim::EstimateRow>& estimate) {
            directory.write(tick);
            if (estimate) {
                estimates.write(*estimate);
                last = estimate;
            }
            if (progress && (tick.index % ticks_per_progress == 0 || tick.index + 1 == simulator.ticks())) {
                show_progress(tick.index + 1, simulator.ticks());
            }
        });
    estimates.close();
    directory.finish(scenario, platform, simulator, {counts, link->health_counts()});
    const std::chrono::duration<double> elapsed = std::chrono::steady_clock::now() - start;
    if (!options.quiet) {
        print_summary(scenario, counts, *link, last, elapsed.count());
        fmt::print("written to {}\n", options.out);
    }
}

} // namespace

int main(int argc, char** argv) {
    CLI::App app{"Simulates a hydraulic Stewart platform with a load and identifies the load on the way.",
                 "hexload_sim"};
    Options options;
    declare(app, options);
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? 0 : exit_bad_input;
    }
    try {
        simulate(options);
    } catch (const std::exception& error) {
        fmt::print(stderr, "hexload_sim: {}\n", error.what());
        return exit_bad_input;
    }
    return 0;
}
