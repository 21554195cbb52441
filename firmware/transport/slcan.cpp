#include "slcan.hpp"

#include "descriptor.hpp"

#include "bus/slcan.h"

#include <array>
#include <cerrno>
#include <cstring>
#include <string_view>

#include <fcntl.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/epoll.h>
#include <sys/eventfd.h>
#include <sys/socket.h>
#include <termios.h>

namespace hexload::transport {
namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::seconds connect_limit{5};
constexpr std::chrono::seconds command_limit{1};
// The first return ends what another program may have left unfinished.
constexpr std::string_view open_commands = "\rC\rS8\rO\r";
constexpr std::string_view close_command = "C\r";

std::string reason(int error) {
    return std::strerror(error);
}

std::chrono::microseconds left_until(Clock::time_point end) {
    return std::chrono::ceil<std::chrono::microseconds>(end - Clock::now());
}

// 0, or why the address cannot be reached.
int connect_within_limit(const Descriptor& socket, const addrinfo& address) {
    if (connect(socket.get(), address.ai_addr, address.ai_addrlen) == 0) {
        return 0;
    }
    if (errno != EINPROGRESS) {
        return errno;
    }
    if (!wait_writable(socket.get(), connect_limit)) {
        return ETIMEDOUT;
    }
    int error = 0;
    socklen_t size = sizeof error;
    getsockopt(socket.get(), SOL_SOCKET, SO_ERROR, &error, &size);
    return error;
}

Descriptor connect_to(const std::string& name, const SlcanTcpName& parsed) {
    addrinfo hints{};
    hints.ai_socktype = SOCK_STREAM;
    addrinfo* found = nullptr;
    const int failure = getaddrinfo(parsed.host.c_str(), std::to_string(parsed.port).c_str(), &hints, &found);
    if (failure != 0) {
        throw ChannelError(name + ": found no host " + parsed.host + ": " + gai_strerror(failure));
    }
    const std::unique_ptr<addrinfo, decltype(&freeaddrinfo)> addresses(found, &freeaddrinfo);
    int error = 0;
    for (const addrinfo* address = found; address != nullptr; address = address->ai_next) {
        Descriptor made(socket(address->ai_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
        error = made ? connect_within_limit(made, *address) : errno;
        if (error == 0) {
            const int on = 1;
            setsockopt(made.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
            return made;
        }
    }
    throw ChannelError(name + ": found nobody who accepts the connection (" + reason(error) +
                       "), expected a serial line on TCP, as QEMU's -chardev socket or ser2net give it");
}

Descriptor open_device(const std::string& name, const std::string& path) {
    Descriptor made(open(path.c_str(), O_RDWR | O_NOCTTY | O_NONBLOCK | O_CLOEXEC));
    if (!made) {
        throw ChannelError(name + ": cannot be opened: " + reason(errno));
    }
    termios settings{};
    if (tcgetattr(made.get(), &settings) != 0) {
        throw ChannelError(name + ": found no serial device, expected one, e.g. /dev/ttyACM0");
    }
    cfmakeraw(&settings);
    settings.c_cflag |= CLOCAL | CREAD;
    if (tcsetattr(made.get(), TCSANOW, &settings) != 0) {
        throw ChannelError(name + ": cannot be set up: " + reason(errno));
    }
    tcflush(made.get(), TCIOFLUSH);
    return made;
}

class Slcan final : public CanChannel {
  public:
    Slcan(const std::string& name, Descriptor line, bool is_socket)
        : is_socket_(is_socket), line_(std::move(line)), more_(eventfd(0, EFD_CLOEXEC | EFD_NONBLOCK)),
          both_(epoll_create1(EPOLL_CLOEXEC)) {
        name_ = name;
        hexload_slcan_init(&decoder_);
        epoll_event event{};
        event.events = EPOLLIN;
        epoll_ctl(both_.get(), EPOLL_CTL_ADD, line_.get(), &event);
        epoll_ctl(both_.get(), EPOLL_CTL_ADD, more_.get(), &event);
        unsent_ = open_commands;
        if (!flush(Clock::now() + command_limit)) {
            throw ChannelError(name_ + ": the other end does not take any bytes");
        }
    }
    ~Slcan() override {
        if (is_up_ && unsent_.size() < longest_backlog) {
            unsent_ += close_command;
            flush(Clock::now());
        }
    }

    int descriptor() const override {
        return both_.get();
    }

    bool send(const hexload_bus_frame_t& frame, std::chrono::microseconds deadline) override;
    std::optional<hexload_bus_frame_t> receive(std::chrono::microseconds timeout) override;

    bool is_up() const override {
        return is_up_;
    }

    std::string advice() const override {
        return is_up_ ? "" : "the connection was lost: start the program anew when the other end is there";
    }

  private:
    static constexpr std::size_t longest_backlog = HEXLOAD_SLCAN_FRAME_BYTES;

    bool flush(Clock::time_point end);
    ssize_t write_some(std::string_view bytes);
    bool read_some();
    std::optional<hexload_bus_frame_t> next_frame();
    void tell_more(bool has_more);
    void lose_connection();
    void count_errors();

    bool is_socket_;
    bool is_up_ = true;
    Descriptor line_;
    Descriptor more_; // readable while read bytes wait in received_
    Descriptor both_; // epoll of the two
    bool has_told_more_ = false;
    hexload_slcan_t decoder_{};
    std::string unsent_; // the rest of what the line has taken a part of
    std::array<char, 4096> received_{};
    std::size_t begin_ = 0; // of received_, not yet decoded
    std::size_t end_ = 0;
};

void Slcan::count_errors() {
    counts_.error_frames = decoder_.dropped + decoder_.refusals + (is_up_ ? 0U : 1U);
}

void Slcan::lose_connection() {
    is_up_ = false;
    count_errors();
    epoll_ctl(both_.get(), EPOLL_CTL_DEL, line_.get(), nullptr); // it would be readable for ever
}

ssize_t Slcan::write_some(std::string_view bytes) {
    return is_socket_ ? ::send(line_.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL)
                      : write(line_.get(), bytes.data(), bytes.size());
}

// Writes what is unsent. False: something is left at the deadline, or the bus is down.
bool Slcan::flush(Clock::time_point end) {
    while (is_up_ && !unsent_.empty()) {
        const ssize_t written = write_some(unsent_);
        if (written > 0) {
            unsent_.erase(0, static_cast<std::size_t>(written));
        } else if (errno != EAGAIN && errno != EINTR) {
            lose_connection();
        } else {
            const auto left = left_until(end);
            if (left.count() <= 0) {
                return false;
            }
            ++counts_.send_retries;
            wait_writable(line_.get(), left);
        }
    }
    return is_up_;
}

// A frame that the line has taken a part of counts as sent: its rest goes first next time.
bool Slcan::send(const hexload_bus_frame_t& frame, std::chrono::microseconds deadline) {
    const auto end = Clock::now() + deadline;
    std::array<char, HEXLOAD_SLCAN_FRAME_BYTES> text;
    const int size = hexload_slcan_encode(&frame, text.data());
    bool is_taken = size > 0 && flush(end);
    if (is_taken) {
        unsent_.assign(text.data(), static_cast<std::size_t>(size));
        const bool is_written = flush(end);
        if (!is_written && is_up_ && unsent_.size() == static_cast<std::size_t>(size)) {
            unsent_.clear();
        }
        is_taken = is_written || (is_up_ && !unsent_.empty());
    }
    ++(is_taken ? counts_.sent : counts_.send_failures);
    return is_taken;
}

std::optional<hexload_bus_frame_t> Slcan::receive(std::chrono::microseconds timeout) {
    const auto end = Clock::now() + timeout;
    const bool was_up = is_up_;
    for (;;) {
        if (const auto frame = next_frame()) {
            return frame;
        }
        if (read_some()) {
            continue;
        }
        const auto left = timeout.count() == 0 ? timeout : left_until(end);
        if (left.count() <= 0 || (was_up && !is_up_) || !wait_readable(both_.get(), left)) {
            return std::nullopt;
        }
    }
}

// Out of the bytes that have been read.
std::optional<hexload_bus_frame_t> Slcan::next_frame() {
    std::optional<hexload_bus_frame_t> found;
    while (begin_ != end_ && !found) {
        hexload_bus_frame_t frame;
        if (hexload_slcan_take(&decoder_, received_[begin_++], &frame)) {
            found = frame;
            ++counts_.received;
        }
    }
    count_errors();
    tell_more(begin_ != end_);
    return found;
}

// Whoever polls the descriptor must not miss frames that have left the line already.
void Slcan::tell_more(bool has_more) {
    if (has_more == has_told_more_) {
        return;
    }
    std::uint64_t count = 1;
    const ssize_t done =
        has_more ? write(more_.get(), &count, sizeof count) : read(more_.get(), &count, sizeof count);
    has_told_more_ = done == sizeof count ? has_more : has_told_more_;
}

bool Slcan::read_some() {
    if (!is_up_) {
        return false;
    }
    const ssize_t size = read(line_.get(), received_.data(), received_.size());
    if (size < 0 && (errno == EAGAIN || errno == EINTR)) {
        return false;
    }
    if (size <= 0) {
        lose_connection();
        return false;
    }
    begin_ = 0;
    end_ = static_cast<std::size_t>(size);
    return true;
}

} // namespace

std::unique_ptr<CanChannel> open_slcan(const std::string& name, const SlcanName& parsed,
                                       hexload_bus_profile_t profile) {
    if (profile == HEXLOAD_BUS_FD) {
        throw ChannelNameError(name +
                               ": found the profile fd, expected classic: SLCAN has no FD frames; give "
                               "--profile classic");
    }
    if (const auto* device = std::get_if<SlcanDeviceName>(&parsed)) {
        return std::make_unique<Slcan>(name, open_device(name, device->path), false);
    }
    return std::make_unique<Slcan>(name, connect_to(name, std::get<SlcanTcpName>(parsed)), true);
}

} // namespace hexload::transport
