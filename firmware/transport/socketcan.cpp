#include "socketcan.hpp"

#include "descriptor.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <thread>

#include <linux/can.h>
#include <linux/can/error.h>
#include <linux/can/raw.h>
#include <linux/netlink.h>
#include <linux/rtnetlink.h>
#include <net/if.h>
#include <poll.h>
#include <sys/epoll.h>
#include <sys/ioctl.h>
#include <sys/socket.h>

namespace hexload::transport {
namespace {

constexpr int receive_buffer_bytes = 4 << 20; // seconds of frames
constexpr std::chrono::microseconds full_queue_pause{50};

std::string reason() {
    return std::strerror(errno);
}

struct InterfaceState {
    int index = 0;
    int mtu_bytes = 0;
    bool is_up = false;
};

// Nothing: no such interface.
std::optional<InterfaceState> look_at_interface(int socket, const std::string& interface) {
    ifreq request{};
    interface.copy(request.ifr_name, IFNAMSIZ - 1);
    InterfaceState state;
    if (ioctl(socket, SIOCGIFINDEX, &request) != 0) {
        return std::nullopt;
    }
    state.index = request.ifr_ifindex;
    if (ioctl(socket, SIOCGIFMTU, &request) != 0) {
        return std::nullopt;
    }
    state.mtu_bytes = request.ifr_mtu;
    if (ioctl(socket, SIOCGIFFLAGS, &request) != 0) {
        return std::nullopt;
    }
    state.is_up = (request.ifr_flags & IFF_UP) != 0;
    return state;
}

Descriptor open_raw_socket(const std::string& name) {
    Descriptor socket(::socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC | SOCK_NONBLOCK, CAN_RAW));
    if (!socket) {
        const std::string why =
            errno == EAFNOSUPPORT || errno == EPROTONOSUPPORT
                ? "this kernel has no CAN: run the command in a machine that has one, "
                  "`tools/hexload vm -- COMMAND`; `tools/hexload doctor` says what is missing"
                : reason();
        throw ChannelError(name + ": " + why);
    }
    return socket;
}

// Errors are without effect here: an older kernel then lacks a counter, not the bus.
void set_up_raw_socket(int socket) {
    const int on = 1;
    const can_err_mask_t all_errors = CAN_ERR_MASK;
    setsockopt(socket, SOL_CAN_RAW, CAN_RAW_FD_FRAMES, &on, sizeof on);
    setsockopt(socket, SOL_CAN_RAW, CAN_RAW_ERR_FILTER, &all_errors, sizeof all_errors);
    setsockopt(socket, SOL_SOCKET, SO_RXQ_OVFL, &on, sizeof on);
    if (setsockopt(socket, SOL_SOCKET, SO_RCVBUFFORCE, &receive_buffer_bytes, sizeof receive_buffer_bytes) !=
        0) { // needs a right; the plain option is cut to the system's limit
        setsockopt(socket, SOL_SOCKET, SO_RCVBUF, &receive_buffer_bytes, sizeof receive_buffer_bytes);
    }
}

bool bind_to_interface(int socket, int index) {
    sockaddr_can address{};
    address.can_family = AF_CAN;
    address.can_ifindex = index;
    return bind(socket, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0;
}

// Reports when any interface changes; an invalid one when the system has none to give.
Descriptor open_link_monitor() {
    Descriptor monitor(::socket(AF_NETLINK, SOCK_RAW | SOCK_CLOEXEC | SOCK_NONBLOCK, NETLINK_ROUTE));
    sockaddr_nl address{};
    address.nl_family = AF_NETLINK;
    address.nl_groups = RTMGRP_LINK;
    if (!monitor || bind(monitor.get(), reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0) {
        return Descriptor{};
    }
    return monitor;
}

class SocketCan final : public CanChannel {
  public:
    SocketCan(const std::string& name, std::string interface, hexload_bus_profile_t profile)
        : interface_(std::move(interface)), is_fd_(profile == HEXLOAD_BUS_FD), socket_(open_raw_socket(name)),
          monitor_(open_link_monitor()), both_(epoll_create1(EPOLL_CLOEXEC)) {
        name_ = name;
        const auto state = look_at_interface(socket_.get(), interface_);
        refuse_unusable(state);
        set_up_raw_socket(socket_.get());
        if (!bind_to_interface(socket_.get(), state->index)) {
            throw ChannelError(name_ + ": cannot be used: " + reason());
        }
        index_ = state->index;
        watch(socket_);
        watch(monitor_);
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
        if (counts_.send_retries == 0) {
            return {};
        }
        return "the queue of " + interface_ + " was full " + std::to_string(counts_.send_retries) +
               " times: ip link set " + interface_ + " txqueuelen 1000";
    }

  private:
    void refuse_unusable(const std::optional<InterfaceState>& state) const;
    void watch(const Descriptor& descriptor);
    void look_again();
    void reopen(int index);
    bool write_frame(const hexload_bus_frame_t& frame);
    std::optional<hexload_bus_frame_t> receive_now();
    std::optional<hexload_bus_frame_t> taken(const canfd_frame& frame, bool is_fd);
    void note_error_frame(canid_t id);

    std::string interface_;
    bool is_fd_;
    bool is_up_ = true;
    int index_ = 0;
    Descriptor socket_;
    Descriptor monitor_;
    Descriptor both_; // epoll of the two
};

void SocketCan::refuse_unusable(const std::optional<InterfaceState>& state) const {
    if (!state) {
        throw ChannelError(name_ + ": found no interface " + interface_ +
                           ", expected one that is up: ip link add " + interface_ +
                           " type vcan, or plug the adapter in");
    }
    if (is_fd_ && state->mtu_bytes < static_cast<int>(CANFD_MTU)) {
        throw ChannelError(name_ + ": found mtu " + std::to_string(state->mtu_bytes) +
                           ", expected 72 for the profile fd: ip link set " + interface_ +
                           " down; ip link set " + interface_ + " mtu 72; ip link set " + interface_ +
                           " up; or use the profile classic");
    }
    if (!state->is_up) {
        throw ChannelError(name_ + ": found the interface down, expected it up: ip link set " + interface_ +
                           " up");
    }
}

void SocketCan::watch(const Descriptor& descriptor) {
    epoll_event event{};
    event.events = EPOLLIN;
    epoll_ctl(both_.get(), EPOLL_CTL_ADD, descriptor.get(), &event);
}

// After anything happened to some interface: is ours up, and is it still the one that the socket is bound to?
void SocketCan::look_again() {
    const auto state = look_at_interface(socket_.get(), interface_);
    is_up_ = state && state->is_up;
    if (is_up_ && state->index != index_) {
        reopen(state->index);
    }
}

void SocketCan::reopen(int index) {
    Descriptor fresh(::socket(PF_CAN, SOCK_RAW | SOCK_CLOEXEC | SOCK_NONBLOCK, CAN_RAW));
    if (!fresh) {
        is_up_ = false;
        return;
    }
    set_up_raw_socket(fresh.get());
    if (!bind_to_interface(fresh.get(), index)) {
        is_up_ = false;
        return;
    }
    socket_ = std::move(fresh); // closing the old one takes it out of the epoll
    index_ = index;
    watch(socket_);
}

bool SocketCan::write_frame(const hexload_bus_frame_t& frame) {
    canfd_frame out{};
    out.can_id = frame.id;
    out.len = frame.length;
    out.flags = frame.is_fd ? CANFD_BRS : 0;
    std::copy_n(frame.data, frame.length, out.data);
    const std::size_t size = frame.is_fd ? CANFD_MTU : CAN_MTU; // the two structs begin alike
    return write(socket_.get(), &out, size) == static_cast<ssize_t>(size);
}

bool SocketCan::send(const hexload_bus_frame_t& frame, std::chrono::microseconds deadline) {
    const auto end = std::chrono::steady_clock::now() + deadline;
    while (!write_frame(frame)) {
        const bool is_full = errno == ENOBUFS || errno == EAGAIN;
        if (!is_full || std::chrono::steady_clock::now() >= end) {
            is_up_ = is_up_ && errno != ENETDOWN && errno != ENODEV && errno != ENXIO;
            ++counts_.send_failures;
            return false;
        }
        ++counts_.send_retries;
        std::this_thread::sleep_for(full_queue_pause); // a full device queue does not report when it has room
    }
    ++counts_.sent;
    is_up_ = true;
    return true;
}

std::optional<hexload_bus_frame_t> SocketCan::receive(std::chrono::microseconds timeout) {
    const auto end = std::chrono::steady_clock::now() + timeout;
    for (;;) {
        if (const auto frame = receive_now()) {
            return frame;
        }
        std::array<char, 4096> news;
        bool changed = false;
        while (monitor_ && recv(monitor_.get(), news.data(), news.size(), 0) > 0) {
            changed = true;
        }
        if (changed) {
            look_again();
        }
        const auto left = end - std::chrono::steady_clock::now();
        if (timeout.count() == 0 || left.count() <= 0 || (changed && !is_up_) ||
            !wait_readable(both_.get(), std::chrono::ceil<std::chrono::microseconds>(left))) {
            return std::nullopt;
        }
    }
}

// The next frame of ours that is there.
std::optional<hexload_bus_frame_t> SocketCan::receive_now() {
    for (;;) {
        canfd_frame frame{};
        iovec part{&frame, sizeof frame};
        alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(std::uint32_t))> control;
        msghdr message{};
        message.msg_iov = &part;
        message.msg_iovlen = 1;
        message.msg_control = control.data();
        message.msg_controllen = control.size();
        const ssize_t size = recvmsg(socket_.get(), &message, 0);
        if (size < 0) {
            if (errno == ENETDOWN || errno == ENODEV) {
                look_again();
            }
            return std::nullopt;
        }
        if (const auto drops = dropped_messages(message)) {
            counts_.receive_drops = *drops;
        }
        if (const auto ours = taken(frame, size == static_cast<ssize_t>(CANFD_MTU))) {
            return ours;
        }
    }
}

std::optional<hexload_bus_frame_t> SocketCan::taken(const canfd_frame& frame, bool is_fd) {
    if ((frame.can_id & CAN_ERR_FLAG) != 0) {
        note_error_frame(frame.can_id);
        return std::nullopt;
    }
    if ((frame.can_id & (CAN_EFF_FLAG | CAN_RTR_FLAG)) != 0 || frame.len > CANFD_MAX_DLEN) {
        return std::nullopt;
    }
    ++counts_.received;
    hexload_bus_frame_t ours{};
    ours.id = frame.can_id & CAN_SFF_MASK;
    ours.is_fd = is_fd;
    ours.length = frame.len;
    std::copy_n(frame.data, frame.len, ours.data);
    return ours;
}

void SocketCan::note_error_frame(canid_t id) {
    ++counts_.error_frames;
    if ((id & CAN_ERR_BUSOFF) != 0) {
        is_up_ = false;
    } else if ((id & CAN_ERR_RESTARTED) != 0) {
        is_up_ = true;
    }
}

} // namespace

std::unique_ptr<CanChannel> open_socketcan(const std::string& name, const SocketCanName& parsed,
                                           hexload_bus_profile_t profile) {
    return std::make_unique<SocketCan>(name, parsed.interface, profile);
}

} // namespace hexload::transport
