#include "ecu.hpp"

#include "state_report.hpp"

#include "transport/descriptor.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <csignal>
#include <limits>
#include <system_error>

#include <poll.h>
#include <sys/signalfd.h>
#include <sys/timerfd.h>

namespace hexload::port {
namespace {

using transport::Descriptor;

constexpr long period_ns = 1'000'000;

Descriptor checked(int descriptor, const char* what) {
    if (descriptor < 0) {
        throw std::system_error(errno, std::generic_category(), what);
    }
    return Descriptor(descriptor);
}

Descriptor millisecond_timer() {
    Descriptor timer = checked(timerfd_create(CLOCK_MONOTONIC, TFD_CLOEXEC | TFD_NONBLOCK), "timer");
    itimerspec every{};
    every.it_value.tv_nsec = period_ns;
    every.it_interval.tv_nsec = period_ns;
    timerfd_settime(timer.get(), 0, &every, nullptr);
    return timer;
}

Descriptor ending_signals() {
    sigset_t signals;
    sigemptyset(&signals);
    sigaddset(&signals, SIGINT);
    sigaddset(&signals, SIGTERM);
    return checked(signalfd(-1, &signals, SFD_CLOEXEC | SFD_NONBLOCK), "signals");
}

std::uint32_t expirations(const Descriptor& timer) {
    std::uint64_t count = 0;
    if (read(timer.get(), &count, sizeof count) != sizeof count) {
        return 0;
    }
    return static_cast<std::uint32_t>(
        std::min<std::uint64_t>(count, std::numeric_limits<std::uint32_t>::max()));
}

void say(const std::string& line) {
    fmt::print("hexload_ecu: {}\n", line);
    (void)std::fflush(stdout);
}

void say_end(const Feed& feed) {
    const hexload_app_t& app = feed.app();
    say(fmt::format("ended in state {}, last tick {}, {} samples missing, {} refused; {}",
                    hexload_app_state_name(app.state), app.last_tick, app.samples_missing,
                    hexload_app_health(&app)->refused, feed.summary()));
}

} // namespace

EcuEnd run_ecu(Feed& feed, bool quiet) {
    const Descriptor timer = millisecond_timer();
    const Descriptor signals = ending_signals();
    std::array<pollfd, 3> waited{
        {{feed.descriptor(), POLLIN, 0}, {timer.get(), POLLIN, 0}, {signals.get(), POLLIN, 0}}};
    StateReport report(feed.profile(), quiet);
    bool was_ready = false;
    const auto tell = [&] {
        if (!was_ready && feed.is_ready()) {
            say("ready on " + feed.description());
            was_ready = true;
        }
        if (const auto line = report.changed(feed.app(), StateReport::Clock::now())) {
            say(*line);
        }
        if (const auto line = report.load_changed(feed.app())) {
            say(*line);
        }
    };
    while (true) {
        poll(waited.data(), waited.size(), -1);
        if (waited[2].revents != 0) {
            break;
        }
        if (waited[0].revents != 0) {
            feed.receive(tell); // START and the first sample may have come together: each changes the state
        }
        if (waited[1].revents != 0) {
            feed.period(expirations(timer));
        }
        if (feed.is_taken()) {
            return EcuEnd::taken;
        }
        tell();
    }
    if (!quiet) {
        say_end(feed);
    }
    return EcuEnd::signal;
}

} // namespace hexload::port
