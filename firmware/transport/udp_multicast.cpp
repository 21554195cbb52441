#include "udp_multicast.hpp"

#include "descriptor.hpp"
#include "python_can_frame.hpp"

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <netinet/in.h>
#include <sys/socket.h>

namespace hexload::transport {
namespace {

constexpr int receive_buffer_bytes = 4 << 20; // seconds of frames
constexpr std::size_t longest_datagram = 4096;
constexpr int most_passed_over = 256;

template <typename Value>
void set_option(const Descriptor& socket, int level, int option, const Value& value,
                const std::string& name) {
    if (setsockopt(socket.get(), level, option, &value, sizeof value) != 0) {
        throw ChannelError(name + ": cannot be set up: " + std::strerror(errno));
    }
}

Descriptor make_socket(const std::string& name) {
    Descriptor made(socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0));
    if (!made) {
        throw ChannelError(name + ": no UDP socket: " + std::strerror(errno));
    }
    return made;
}

[[noreturn]] void throw_no_route(const std::string& name, const UdpMulticastName& parsed) {
    throw ChannelError(name + ": found no route to " + parsed.group +
                       ", expected one for multicast: ip route add 224.0.0.0/4 dev lo");
}

sockaddr_in address_of(in_addr address, std::uint16_t port) {
    sockaddr_in socket_address{};
    socket_address.sin_family = AF_INET;
    socket_address.sin_port = htons(port);
    socket_address.sin_addr = address;
    return socket_address;
}

const sockaddr* generic(const sockaddr_in& address) {
    return reinterpret_cast<const sockaddr*>(&address);
}

double seconds_since_1970() {
    return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

// IPv4, of all interfaces.
std::vector<in_addr_t> own_addresses() {
    std::vector<in_addr_t> addresses;
    ifaddrs* first = nullptr;
    if (getifaddrs(&first) != 0) {
        return addresses;
    }
    for (const ifaddrs* one = first; one != nullptr; one = one->ifa_next) {
        if (one->ifa_addr != nullptr && one->ifa_addr->sa_family == AF_INET) {
            sockaddr_in address{};
            std::memcpy(&address, one->ifa_addr, sizeof address);
            addresses.push_back(address.sin_addr.s_addr);
        }
    }
    freeifaddrs(first);
    return addresses;
}

class UdpMulticast final : public CanChannel {
  public:
    UdpMulticast(const std::string& name, const UdpMulticastName& parsed)
        : receiver_(make_socket(name)), sender_(make_socket(name)) {
        name_ = name;
        in_addr group{};
        inet_pton(AF_INET, parsed.group.c_str(), &group);
        group_ = address_of(group, parsed.port);
        join(parsed);
        prepare_sender(parsed);
    }

    int descriptor() const override {
        return receiver_.get();
    }

    bool send(const hexload_bus_frame_t& frame, std::chrono::microseconds /*deadline*/) override {
        pack_frame(frame, seconds_since_1970(), packed_);
        // The loopback has no queue that could stay full: what it refuses, it refuses for another reason.
        is_up_ =
            sendto(sender_.get(), packed_.data(), packed_.size(), 0, generic(group_), sizeof group_) >= 0;
        ++(is_up_ ? counts_.sent : counts_.send_failures);
        return is_up_;
    }

    std::optional<hexload_bus_frame_t> receive(std::chrono::microseconds timeout) override {
        const auto end = std::chrono::steady_clock::now() + timeout;
        for (;;) {
            if (const auto frame = receive_now()) {
                return frame;
            }
            const auto left = end - std::chrono::steady_clock::now();
            if (timeout.count() == 0 || left.count() <= 0 ||
                !wait_readable(receiver_.get(), std::chrono::ceil<std::chrono::microseconds>(left))) {
                return std::nullopt;
            }
        }
    }

    bool is_up() const override {
        return is_up_;
    }

  private:
    void join(const UdpMulticastName& parsed) {
        set_option(receiver_, SOL_SOCKET, SO_REUSEADDR, 1, name_);
        set_option(receiver_, SOL_SOCKET, SO_REUSEPORT, 1, name_);
        set_option(receiver_, SOL_SOCKET, SO_RCVBUF, receive_buffer_bytes, name_);
        set_option(receiver_, SOL_SOCKET, SO_RXQ_OVFL, 1, name_);
        set_option(receiver_, IPPROTO_IP, IP_MULTICAST_ALL, 0, name_); // this group only
        // The group's address, not any: a datagram to one of the computer's own addresses is none of ours.
        if (bind(receiver_.get(), generic(group_), sizeof group_) != 0) {
            throw ChannelError(name_ + ": port " + std::to_string(parsed.port) +
                               " cannot be used: " + std::strerror(errno));
        }
        const ip_mreq membership{group_.sin_addr, {htonl(INADDR_ANY)}};
        if (setsockopt(receiver_.get(), IPPROTO_IP, IP_ADD_MEMBERSHIP, &membership, sizeof membership) != 0) {
            throw_no_route(name_, parsed);
        }
    }

    // A socket of its own, so that own datagrams are known by their port.
    void prepare_sender(const UdpMulticastName& parsed) {
        set_option(sender_, IPPROTO_IP, IP_MULTICAST_TTL, 0, name_);
        set_option(sender_, IPPROTO_IP, IP_MULTICAST_LOOP, 1, name_);
        const sockaddr_in any = address_of({htonl(INADDR_ANY)}, 0);
        socklen_t size = sizeof own_;
        if (bind(sender_.get(), generic(any), sizeof any) != 0 ||
            getsockname(sender_.get(), reinterpret_cast<sockaddr*>(&own_), &size) != 0) {
            throw ChannelError(name_ + ": no port to send from: " + std::strerror(errno));
        }
        const Descriptor probe = make_socket(name_);
        if (connect(probe.get(), generic(group_), sizeof group_) != 0) {
            throw_no_route(name_, parsed);
        }
    }

    bool is_of_this_computer(in_addr source) const {
        return ntohl(source.s_addr) >> 24 == IN_LOOPBACKNET ||
               std::ranges::find(addresses_, source.s_addr) != addresses_.end();
    }

    // The next frame that is there, past own and other datagrams; of a flood of these, so many at a time.
    std::optional<hexload_bus_frame_t> receive_now() {
        for (int n = 0; n < most_passed_over; ++n) {
            sockaddr_in source{};
            const std::optional<std::size_t> size = receive_datagram(source);
            if (!size) {
                return std::nullopt;
            }
            if (source.sin_port == own_.sin_port) {
                continue;
            }
            if (!is_of_this_computer(source.sin_addr)) { // own datagrams do not leave it (TTL 0)
                ++counts_.error_frames;
                continue;
            }
            const Datagram datagram = unpack_frame({received_.data(), *size});
            if (datagram.kind == DatagramKind::malformed) {
                ++counts_.error_frames;
            } else if (datagram.kind == DatagramKind::frame) {
                ++counts_.received;
                return datagram.frame;
            }
        }
        return std::nullopt;
    }

    std::optional<std::size_t> receive_datagram(sockaddr_in& source) {
        iovec part{received_.data(), received_.size()};
        alignas(cmsghdr) std::array<char, CMSG_SPACE(sizeof(std::uint32_t))> control;
        msghdr message{};
        message.msg_name = &source;
        message.msg_namelen = sizeof source;
        message.msg_iov = &part;
        message.msg_iovlen = 1;
        message.msg_control = control.data();
        message.msg_controllen = control.size();
        const ssize_t size = recvmsg(receiver_.get(), &message, 0);
        if (size < 0) {
            return std::nullopt;
        }
        if (const auto drops = dropped_messages(message)) {
            counts_.receive_drops = *drops;
        }
        return static_cast<std::size_t>(size);
    }

    Descriptor receiver_;
    Descriptor sender_;
    std::vector<in_addr_t> addresses_ = own_addresses();
    sockaddr_in group_{};
    sockaddr_in own_{};
    bool is_up_ = true;
    std::vector<char> packed_;
    std::array<char, longest_datagram> received_{};
};

} // namespace

std::unique_ptr<CanChannel> open_udp_multicast(const std::string& name, const UdpMulticastName& parsed) {
    return std::make_unique<UdpMulticast>(name, parsed);
}

} // namespace hexload::transport
