// hexload_ecu --bus NAME --platform FILE: the controller as a Linux process. With --feed lcm it is on LCM
// instead of a bus.
#include "can_feed.hpp"
#include "ecu.hpp"
#include "lcm_feed.hpp"
#include "painted_stack.hpp"

#include "platform_file/firmware_config.hpp"
#include "platform_file/input_error.hpp"
#include "platform_file/platform_file.hpp"
#include "platform_file/rig_file.hpp"
#include "transport/bus_load.hpp"
#include "transport/can_channel.hpp"
#include "transport/key.hpp"
#include "transport/real_time.hpp"

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <csignal>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <system_error>
#include <utility>

#include <sys/prctl.h>

namespace {

namespace port = hexload::port;
namespace platform = hexload::platform;
namespace transport = hexload::transport;
namespace message = hexload::message;

enum ExitStatus {
    exit_ended = 0,
    exit_bad_input = 2,
    exit_second_controller = 3,
    exit_no_bus = 4,
    exit_system = 5,
};

constexpr const char* footer =
    "Exit status: 0 ended by SIGINT or SIGTERM, 2 bad option or file, 3 another controller was "
    "heard on the bus\nbefore this one spoke, 4 the bus cannot be opened, 5 the system refused a "
    "resource.\nExample: hexload_ecu --bus socketcan:vcan0 --platform platform.toml --key platform.key";

struct Options {
    std::string bus;
    std::string feed;
    std::string platform;
    std::string rig;
    hexload_bus_profile_t profile = HEXLOAD_BUS_FD;
    std::optional<platform::EstimatorKind> estimator;
    std::optional<platform::PaperPrior> prior;
    std::optional<std::uint32_t> sample_timeout_ms;
    std::string key;
    bool without_authentication = false;
    bool real_time_priority = false;
    bool die_with_parent = false;
    bool quiet = false;
};

void declare(CLI::App& app, Options& options) {
    const std::map<std::string, hexload_bus_profile_t> profiles = {{"fd", HEXLOAD_BUS_FD},
                                                                   {"classic", HEXLOAD_BUS_CLASSIC}};
    const std::map<std::string, platform::PaperPrior> priors = {{"safe", platform::PaperPrior::safe},
                                                                {"printed", platform::PaperPrior::printed}};
    const std::map<std::string, platform::EstimatorKind> estimators = {
        {"momentum", platform::EstimatorKind::momentum},
        {"momentum_effects", platform::EstimatorKind::momentum_effects},
        {"paper", platform::EstimatorKind::paper}};
    auto* source = app.add_option_group("source", "where samples and commands come from");
    auto* bus = source->add_option("--bus", options.bus,
                                   "socketcan:INTERFACE, udp_multicast:GROUP[:PORT], slcan:HOST:PORT or "
                                   "slcan:DEVICE (with --profile classic)");
    source->add_option("--feed", options.feed, "lcm or lcm:URL: no bus, messages alone");
    source->require_option(1);
    app.add_option("--platform", options.platform, "platform file (TOML): the controller's configuration")
        ->required();
    app.add_option("--rig", options.rig, "rig file of hexload commission, made with that platform file");
    app.add_option("--profile", options.profile, "frames of the bus: fd (default) or classic")
        ->transform(CLI::CheckedTransformer(profiles))
        ->needs(bus);
    app.add_option(
           "--estimator", options.estimator,
           "estimator until a command selects another: paper, momentum (default: the platform file's)")
        ->transform(CLI::CheckedTransformer(estimators));
    app.add_option("--prior", options.prior, "start covariance of the paper's filter: safe or printed")
        ->transform(CLI::CheckedTransformer(priors));
    app.add_option("--sample-timeout-ms", options.sample_timeout_ms,
                   "silence of the samples in real time that is a fault (default 100)")
        ->check(CLI::Range(5, 60000));
    auto* key = app.add_option("--key", options.key,
                               "key file: only commands of who has the same key are carried out "
                               "(hexload key new FILE makes one)")
                    ->needs(bus);
    app.add_flag("--without-authentication", options.without_authentication,
                 "carry out commands of anybody on the bus; one of the two must be given")
        ->needs(bus)
        ->excludes(key);
    app.add_flag("--real-time-priority", options.real_time_priority, "ask for SCHED_FIFO and locked memory");
    app.add_flag("--die-with-parent", options.die_with_parent,
                 "end when the process that started this one ends");
    app.add_flag("--quiet", options.quiet, "print the ready line and faults only");
    app.footer(footer);
}

// The signals come by descriptor, to whichever thread reads it.
void block_ending_signals() {
    sigset_t signals;
    sigemptyset(&signals);
    sigaddset(&signals, SIGINT);
    sigaddset(&signals, SIGTERM);
    pthread_sigmask(SIG_BLOCK, &signals, nullptr);
}

platform::PlatformFile platform_of(const Options& options) {
    platform::PlatformFile file = platform::load_platform_file(options.platform);
    file.estimator.kind = options.estimator.value_or(file.estimator.kind);
    file.estimator.prior = options.prior.value_or(file.estimator.prior);
    return options.rig.empty() ? file : platform::with_rig_file(std::move(file), options.rig);
}

std::optional<transport::Key> key_of(const Options& options) {
    if (!options.key.empty()) {
        return transport::read_key(options.key);
    }
    if (!options.without_authentication) {
        throw platform::InputError("--bus: found neither --key nor --without-authentication, expected one: "
                                   "without a key anybody on the bus commands this controller");
    }
    return std::nullopt;
}

std::unique_ptr<port::Feed> make_feed(const Options& options, const port::PaintedStack& stack) {
    const platform::PlatformFile file = platform_of(options);
    const hexload_config_t config =
        platform::checked_firmware_config(file, file.estimator, file.sensors.tick_s);
    hexload_app_settings_t settings;
    hexload_app_settings_default(&settings);
    settings.sample_timeout_ms = options.sample_timeout_ms.value_or(settings.sample_timeout_ms);
    if (!options.feed.empty()) {
        return std::make_unique<port::LcmFeed>(message::url_of(options.feed), config, settings);
    }
    const std::optional<transport::Key> key = key_of(options);
    if (const auto overload = transport::find_overload(options.bus, options.profile, file.sensors.tick_s)) {
        throw platform::InputError(*overload);
    }
    return std::make_unique<port::CanFeed>(transport::open_can_channel(options.bus, options.profile),
                                           options.profile, config, settings, stack, key);
}

ExitStatus run(const Options& options) {
    port::PaintedStack stack;
    const auto feed = make_feed(options, stack);
    port::EcuEnd end = port::EcuEnd::signal;
    stack.run([&] {
        if (options.real_time_priority) {
            const auto rights = transport::request_real_time(transport::controller_priority);
            fmt::print("hexload_ecu: {}\n", describe(rights));
        }
        end = run_ecu(*feed, options.quiet);
    });
    if (end == port::EcuEnd::taken) {
        fmt::print(stderr,
                   "hexload_ecu: {}: a second controller: another one is on the bus already; stop it first\n",
                   options.bus);
        return exit_second_controller;
    }
    return exit_ended;
}

ExitStatus status_of(const std::exception& error) {
    if (dynamic_cast<const transport::ChannelNameError*>(&error) != nullptr ||
        dynamic_cast<const message::UrlError*>(&error) != nullptr) {
        return exit_bad_input;
    }
    if (dynamic_cast<const transport::ChannelError*>(&error) != nullptr ||
        dynamic_cast<const message::SessionError*>(&error) != nullptr) {
        return exit_no_bus;
    }
    return dynamic_cast<const std::system_error*>(&error) != nullptr ? exit_system : exit_bad_input;
}

} // namespace

int main(int argc, char** argv) {
    CLI::App app{"The load identifying controller as a process: answers leg samples on a CAN bus.",
                 "hexload_ecu"};
    Options options;
    declare(app, options);
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        return app.exit(error) == 0 ? exit_ended : exit_bad_input;
    }
    if (options.die_with_parent) {
        prctl(PR_SET_PDEATHSIG, SIGTERM);
    }
    block_ending_signals();
    try {
        return run(options);
    } catch (const std::exception& error) {
        fmt::print(stderr, "hexload_ecu: {}\n", error.what());
        return status_of(error);
    }
}
