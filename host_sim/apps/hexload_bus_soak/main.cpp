// hexload_bus_soak PLATFORM.toml SAMPLES ROWS PROFILE SEED CODES: leg samples over a bus on which things go
// wrong, through simulator's link and controller's node, in one process and in steps of one tick.
//
// SAMPLES: 18 doubles a tick: displacements, velocities, forces. ROWS, written: 33 doubles for each estimate
// that the simulator took: tick, verdict, health bits, the ten verdicts, values and sigmas. CODES: 1 for a
// key and codes on samples. Prints what happened as JSON. `hexload soak --faults` makes the samples and
// judges the rows.
#include "faulty_bus.hpp"

#include "links/can_link.hpp"
#include "links/estimate_row.hpp"
#include "platform_file/firmware_config.hpp"
#include "platform_file/input_error.hpp"
#include "platform_file/standard_output.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <map>
#include <string>
#include <vector>

namespace {

namespace platform = hexload::platform;
namespace sim = hexload::sim;
namespace transport = hexload::transport;

constexpr int exit_bad_input = 2;
constexpr std::uint32_t ticks_before_restart = 200; // a simulator that has ended is started again
constexpr std::size_t channels = 18;
constexpr transport::Key key{0x68, 0x65, 0x78, 0x6c, 0x6f, 0x61, 0x64};

using Row = std::array<double, 3 + 3 * HEXLOAD_LOAD_DIM>;

struct Run {
    sim::FaultyBus& bus;
    sim::CanLinkSettings settings;
    std::unique_ptr<sim::EstimatorLink> link;
    std::uint32_t down_ticks = ticks_before_restart;
    std::vector<Row> rows;
    std::map<std::string, std::uint64_t> ends; // of simulators, in words
    std::uint64_t starts = 0;
    std::uint64_t rejoins = 0;
};

double code_of(std::string_view verdict) {
    int code = 0;
    while (verdict != hexload_verdict_name(static_cast<hexload_verdict_t>(code))) {
        ++code;
    }
    return code;
}

Row row_of(const sim::EstimateRow& estimate, double tick_s) {
    Row row{std::round(estimate.t_s / tick_s), code_of(estimate.verdict),
            static_cast<double>(estimate.health)};
    for (std::size_t k = 0; k < HEXLOAD_LOAD_DIM; ++k) {
        row.at(3 + k) = code_of(estimate.parameter_verdict.at(k));
        row.at(3 + HEXLOAD_LOAD_DIM + k) = estimate.value.at(k);
        row.at(3 + 2 * HEXLOAD_LOAD_DIM + k) = estimate.sigma.at(k);
    }
    return row;
}

// The words without names and numbers, which differ from run to run.
std::string kind_of(const std::string& message) {
    std::string words = message.substr(message.find(": ") + 2);
    std::erase_if(words, [](char c) { return c >= '0' && c <= '9'; });
    return words;
}

void end(Run& run, const std::string& why) {
    run.rejoins += run.link ? run.link->bus_counts()->rejoins : 0;
    run.link.reset();
    run.down_ticks = 0;
    ++run.ends[why];
}

void begin(Run& run) {
    run.settings.session = static_cast<std::uint16_t>(run.starts % HEXLOAD_BUS_SESSIONS);
    ++run.starts;
    run.link = make_real_time_link(std::make_unique<sim::FaultyBusEnd>(run.bus), run.settings);
    run.link->start();
}

void step(Run& run, const sim::LegSample& sample) {
    try {
        if (run.bus.ends_simulator() && run.link) {
            end(run, "ended from outside");
        }
        if (!run.link && ++run.down_ticks >= ticks_before_restart) {
            begin(run);
        }
        if (run.link) {
            for (const sim::EstimateRow& row : run.link->step(sample)) {
                run.rows.push_back(row_of(row, run.settings.tick_s));
            }
        }
    } catch (const sim::LinkError& error) {
        end(run, kind_of(error.what()));
    }
    run.bus.elapse_ms();
}

std::vector<double> read_doubles(const char* path) {
    std::ifstream file(path, std::ios::binary | std::ios::ate);
    const auto bytes = static_cast<std::streamoff>(file.tellg());
    if (!file || bytes % static_cast<std::streamoff>(channels * sizeof(double)) != 0) {
        throw platform::InputError(fmt::format("{}: expected 18 doubles for each tick", path));
    }
    std::vector<double> values(static_cast<std::size_t>(bytes) / sizeof(double));
    file.seekg(0);
    file.read(reinterpret_cast<char*>(values.data()), bytes);
    return values;
}

sim::LegSample sample_of(const double* values, std::uint32_t tick, double tick_s) {
    sim::LegSample sample{.tick = tick, .t_s = tick * tick_s};
    constexpr Eigen::Index legs = HEXLOAD_LEGS;
    for (Eigen::Index leg = 0; leg < legs; ++leg) {
        sample.displacement_m[leg] = values[leg];
        sample.velocity_m_s[leg] = values[legs + leg];
        sample.force_n[leg] = values[2 * legs + leg];
    }
    return sample;
}

std::string as_json(const std::map<std::string, std::uint64_t>& counts) {
    std::string text;
    for (const auto& [name, count] : counts) {
        text += fmt::format("{}\"{}\": {}", text.empty() ? "" : ", ", name, count);
    }
    return "{" + text + "}";
}

// Numbers of the run, and the words for the codes in its rows.
void print_report(const Run& run) {
    std::string verdicts;
    std::string bits;
    std::string parameters;
    for (int code = 0; code <= HEXLOAD_VERDICT_INCONSISTENT; ++code) {
        verdicts += fmt::format("\"{}\", ", hexload_verdict_name(static_cast<hexload_verdict_t>(code)));
    }
    for (int bit = 0; bit < HEXLOAD_HEALTH_BITS; ++bit) {
        bits += fmt::format("\"{}\", ", hexload_health_name(static_cast<hexload_health_bit_t>(bit)));
    }
    for (const std::string_view name : sim::load_parameter_names(run.settings.estimator)) {
        parameters += fmt::format("\"{}\", ", name);
    }
    fmt::print("{{\"starts\": {}, \"rejoins\": {}, \"faults\": {}, \"ends\": {}, \"verdicts\": [{}], "
               "\"bits\": [{}], \"parameters\": [{}]}}\n",
               run.starts, run.rejoins, as_json(run.bus.faults()), as_json(run.ends),
               verdicts.substr(0, verdicts.size() - 2), bits.substr(0, bits.size() - 2),
               parameters.substr(0, parameters.size() - 2));
}

void soak(char** arguments) {
    const platform::PlatformFile file = platform::load_platform_file(arguments[1]);
    platform::EstimatorSettings estimator = file.estimator;
    estimator.kind = platform::EstimatorKind::momentum;
    const double tick_s = file.sensors.tick_s;
    const hexload_config_t config = platform::checked_firmware_config(file, estimator, tick_s);
    const bool has_codes = std::string(arguments[6]) == "1";
    sim::CanLinkSettings settings;
    settings.profile = std::string(arguments[4]) == "classic" ? HEXLOAD_BUS_CLASSIC : HEXLOAD_BUS_FD;
    settings.key = has_codes ? std::optional(key) : std::nullopt;
    settings.has_sample_codes = has_codes;
    settings.estimator = estimator.kind;
    settings.tick_s = tick_s;
    sim::FaultyBus bus(config, settings.profile, settings.key, std::stoull(arguments[5]));
    settings.now = [&bus] { return bus.now(); };
    Run run{.bus = bus, .settings = settings, .link = nullptr, .rows = {}, .ends = {}};
    const std::vector<double> samples = read_doubles(arguments[2]);
    for (std::size_t n = 0; n < samples.size() / channels; ++n) {
        step(run, sample_of(&samples[n * channels], static_cast<std::uint32_t>(n), tick_s));
    }
    run.rejoins += run.link ? run.link->bus_counts()->rejoins : 0;
    std::ofstream out(arguments[3], std::ios::binary);
    out.write(reinterpret_cast<const char*>(run.rows.data()),
              static_cast<std::streamsize>(run.rows.size() * sizeof(Row)));
    if (!out.flush()) {
        throw platform::InputError(fmt::format("{}: cannot be written", arguments[3]));
    }
    print_report(run);
}

} // namespace

int main(int argc, char** argv) {
    if (argc != 7) {
        fmt::print(
            stderr,
            "hexload_bus_soak: found {} arguments, expected PLATFORM SAMPLES ROWS PROFILE SEED CODES\n",
            argc - 1);
        return exit_bad_input;
    }
    try {
        soak(argv);
    } catch (const std::exception& error) {
        fmt::print(stderr, "hexload_bus_soak: {}\n", error.what());
        return exit_bad_input;
    }
    return platform::status_with_output("hexload_bus_soak", 0);
}
