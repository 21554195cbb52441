// hexload_bridge --bus NAME: listens on a CAN bus, never sends, and publishes on LCM what the bus carried.
#include "bus_monitor.hpp"

#include "platform_file/standard_output.hpp"
#include "transport/can_channel.hpp"
#include "transport/lcm_messages.hpp"

#include <hexload_lcm/session.hpp>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include <csignal>
#include <map>
#include <string>

namespace {

namespace bridge = hexload::bridge;
namespace message = hexload::message;
namespace transport = hexload::transport;
using Clock = std::chrono::steady_clock;

enum ExitStatus {
    exit_ended = 0,
    exit_bad_input = 2,
    exit_no_transport = 4,
};

constexpr const char* footer =
    "Exit status: 0 ended by SIGINT or SIGTERM, 2 bad option, 4 the bus or LCM cannot be opened.\n"
    "Example: hexload_bridge --bus socketcan:vcan0";

constexpr std::chrono::seconds statistics_period{1};
constexpr std::chrono::milliseconds longest_wait{50}; // a signal is seen that late

struct Options {
    std::string bus;
    std::string lcm{message::default_url};
    hexload_bus_profile_t profile = HEXLOAD_BUS_FD;
    bool samples = false;
};

volatile std::sig_atomic_t is_ended = 0;

void declare(CLI::App& app, Options& options) {
    const std::map<std::string, hexload_bus_profile_t> profiles = {{"fd", HEXLOAD_BUS_FD},
                                                                   {"classic", HEXLOAD_BUS_CLASSIC}};
    app.add_option("--bus", options.bus,
                   "socketcan:INTERFACE, udp_multicast:GROUP[:PORT], slcan:HOST:PORT or slcan:DEVICE")
        ->required();
    app.add_option("--profile", options.profile, "frames of the bus: fd (default) or classic")
        ->transform(CLI::CheckedTransformer(profiles));
    app.add_option("--lcm", options.lcm, "LCM's URL; the default stays within this computer");
    app.add_flag("--samples", options.samples,
                 "publish the leg samples too, where no simulator does: as the bus rounds them");
    app.footer(footer);
}

// The messages of one bus.
class Teller {
  public:
    explicit Teller(const Options& options)
        : channel_(transport::open_can_channel(options.bus, options.profile)), monitor_(options.profile),
          session_(options.lcm), tells_samples_(options.samples) {}

    void wait_and_tell() {
        if (const auto frame = channel_->receive(longest_wait)) {
            tell(monitor_.take(*frame));
        }
        if (const auto now = Clock::now(); now - period_began_ >= statistics_period) {
            tell_statistics(now);
        }
    }

    void tell_statistics(Clock::time_point now) {
        hexload::bus_statistics_t statistics = monitor_.end_period(now - period_began_);
        period_began_ = now;
        statistics.bus = channel_->name();
        statistics.receive_drops = static_cast<std::int64_t>(channel_->counts().receive_drops);
        statistics_.send(statistics);
    }

    std::string summary() const {
        const hexload::bus_statistics_t& totals = monitor_.totals();
        return fmt::format("{} frames, {} samples ({} incomplete, {} ticks missing), {} answers ({} "
                           "incomplete), refused {} by length, "
                           "{} by checksum, {} by value, {} by tick, {} of the other profile; {} frames "
                           "dropped on receipt, {} messages "
                           "not sent",
                           channel_->counts().received, totals.samples, totals.samples_incomplete,
                           totals.samples_missing, totals.answers, totals.answers_incomplete,
                           totals.refused_length, totals.refused_checksum, totals.refused_value,
                           totals.refused_tick, totals.refused_profile, channel_->counts().receive_drops,
                           samples_.failed() + estimates_.failed() + healths_.failed() +
                               load_changes_.failed() + acknowledges_.failed() + statistics_.failed());
    }

  private:
    void tell(const bridge::BusEvent& event) {
        if (event.sample && tells_samples_) {
            auto sample = transport::leg_sample_message(*event.sample);
            samples_.send(sample);
        }
        if (event.answer) {
            auto estimate = transport::estimate_message(*event.answer);
            auto health = transport::health_message(*event.answer, monitor_.samples_missing());
            estimates_.send(estimate);
            healths_.send(health);
        }
        if (event.load_change) {
            auto change = transport::load_change_message(*event.load_change);
            load_changes_.send(change);
        }
        if (event.acknowledge) {
            auto acknowledge = transport::acknowledge_message(*event.acknowledge, monitor_.newest_tick());
            acknowledges_.send(acknowledge);
        }
    }

    std::unique_ptr<transport::CanChannel> channel_;
    bridge::BusMonitor monitor_;
    message::Session session_;
    message::Publisher<hexload::leg_sample_t> samples_{session_};
    message::Publisher<hexload::estimate_t> estimates_{session_};
    message::Publisher<hexload::health_t> healths_{session_};
    message::Publisher<hexload::load_change_t> load_changes_{session_};
    message::Publisher<hexload::acknowledge_t> acknowledges_{session_};
    message::Publisher<hexload::bus_statistics_t> statistics_{session_};
    bool tells_samples_;
    Clock::time_point period_began_ = Clock::now();
};

void say(const std::string& line) {
    fmt::print("hexload_bridge: {}\n", line);
    (void)std::fflush(stdout);
}

ExitStatus run(const Options& options) {
    Teller teller(options);
    for (const int signal : {SIGINT, SIGTERM}) {
        (void)std::signal(signal, [](int) { is_ended = 1; });
    }
    say(fmt::format("ready on {}, profile {}, LCM {}", options.bus, hexload_bus_profile_name(options.profile),
                    options.lcm));
    while (is_ended == 0) {
        teller.wait_and_tell();
    }
    teller.tell_statistics(Clock::now());
    say("ended; " + teller.summary());
    return exit_ended;
}

ExitStatus status_of(const std::exception& error) {
    const bool is_transport = dynamic_cast<const transport::ChannelError*>(&error) != nullptr ||
                              dynamic_cast<const message::SessionError*>(&error) != nullptr;
    const bool is_name = dynamic_cast<const transport::ChannelNameError*>(&error) != nullptr;
    return is_transport && !is_name ? exit_no_transport : exit_bad_input;
}

} // namespace

int main(int argc, char** argv) {
    CLI::App app{"Listens on a CAN bus and publishes on LCM what it carried.", "hexload_bridge"};
    Options options;
    declare(app, options);
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& error) {
        return hexload::platform::status_with_output("hexload_bridge",
                                                     app.exit(error) == 0 ? exit_ended : exit_bad_input);
    }
    try {
        return hexload::platform::status_with_output("hexload_bridge", run(options));
    } catch (const std::exception& error) {
        fmt::print(stderr, "hexload_bridge: {}\n", error.what());
        return status_of(error);
    }
}
