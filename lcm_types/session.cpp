#include <hexload_lcm/session.hpp>

#include <algorithm>
#include <array>
#include <cctype>
#include <charconv>
#include <iterator>

#include <linux/filter.h>
#include <linux/if_packet.h>
#include <netinet/in.h>
#include <sys/socket.h>

namespace hexload::message {
namespace {

constexpr std::uint32_t loopback_index = 1; // in every network namespace
constexpr int most_descriptors = 1024;

// Of a URL whose messages stay within this computer; 0: they do not, or it is none of multicast.
std::uint16_t local_port(std::string_view url) {
    const std::size_t colon = url.rfind(':');
    if (!url.starts_with("udpm://") || !url.ends_with("?ttl=0") || colon == std::string_view::npos) {
        return 0;
    }
    std::uint16_t port = 0;
    std::from_chars(url.data() + colon + 1, url.data() + url.size(), port);
    return port;
}

bool is_datagram_socket(int descriptor, std::uint16_t port) {
    int type = 0;
    socklen_t size = sizeof type;
    sockaddr_in address{};
    socklen_t length = sizeof address;
    return getsockopt(descriptor, SOL_SOCKET, SO_TYPE, &type, &size) == 0 && type == SOCK_DGRAM &&
           getsockname(descriptor, reinterpret_cast<sockaddr*>(&address), &length) == 0 &&
           address.sin_family == AF_INET && ntohs(address.sin_port) == port;
}

} // namespace

std::string url_of(std::string_view option) {
    constexpr std::string_view name = "lcm";
    if (option == name) {
        return std::string(default_url);
    }
    if (option.starts_with(name) && option.size() > name.size() + 1 && option[name.size()] == ':') {
        return std::string(option.substr(name.size() + 1));
    }
    throw UrlError("LCM: found '" + std::string(option) +
                   "', expected lcm or lcm:URL, e.g. lcm:" + std::string(default_url));
}

std::string channel_of(std::string_view type_name) {
    constexpr std::string_view suffix = "_t";
    std::string channel = "HEXLOAD_";
    type_name.remove_suffix(type_name.ends_with(suffix) ? suffix.size() : 0);
    std::transform(type_name.begin(), type_name.end(), std::back_inserter(channel),
                   [](unsigned char letter) { return static_cast<char>(std::toupper(letter)); });
    return channel;
}

void GapCounter::take(std::int64_t sequence) {
    if (received_ > 0 && sequence <= last_) {
        ++restarts_;
        in_order_ = 0;
        gone_back_ += sequence != 0 && !has_two_sources() ? 1U : 0U;
    } else {
        if (received_ > 0) { // unsigned: what comes from outside may be any number
            lost_ += static_cast<std::uint64_t>(sequence) - static_cast<std::uint64_t>(last_) - 1;
        }
        in_order_ = std::min(in_order_ + 1, long_in_order);
        gone_back_ = in_order_ == long_in_order ? 0 : gone_back_;
    }
    last_ = sequence;
    ++received_;
}

// Behind fingerprint, sequence, tick and the filter's name stands how many parameters follow.
template <> bool is_bounded<estimate_t>(std::span<const std::uint8_t> encoded) {
    constexpr std::size_t before_name = 3 * sizeof(std::int64_t);
    constexpr std::uint32_t most_parameters = 64;
    const auto number = [encoded](std::size_t at) {
        std::uint32_t value = 0;
        for (std::size_t n = at; n < at + 4; ++n) {
            value = value << 8U | encoded[n];
        }
        return value;
    };
    if (encoded.size() < before_name + 8) {
        return false;
    }
    const std::size_t name = number(before_name);
    return name <= encoded.size() - before_name - 8 && number(before_name + 4 + name) <= most_parameters;
}

Session::Session(const std::string& url) : url_(url), lcm_(url) {
    if (!lcm_.good()) {
        refuse("no way to open it");
    }
}

void Session::refuse(const std::string& found) const {
    if (url_.starts_with("udpm:")) {
        throw SessionError(
            url_ + ": found " + found +
            ", expected a route for multicast; this adds one: ip route add 224.0.0.0/4 dev lo");
    }
    throw SessionError(url_ + ": found " + found + ", expected an LCM URL, e.g. " + std::string(default_url));
}

// LCM listens on all addresses of the computer. The sockets are LCM's own, and it does not tell them: they
// are those with the URL's port, of which a process has no other use. Where there is no such filter, the time
// to live alone keeps messages in.
void Session::keep_strangers_out() {
    const std::uint16_t port = local_port(url_);
    if (port == 0) {
        return;
    }
    std::array<sock_filter, 9> from_here{{
        BPF_STMT(BPF_LD | BPF_W | BPF_ABS, static_cast<std::uint32_t>(SKF_NET_OFF + 16)), // destination
        BPF_STMT(BPF_ALU | BPF_AND | BPF_K, 0xF0000000U),
        BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, 0xE0000000U, 0, 5), // multicast
        BPF_STMT(BPF_LD | BPF_B | BPF_ABS, static_cast<std::uint32_t>(SKF_AD_OFF + SKF_AD_PKTTYPE)),
        BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, PACKET_LOOPBACK, 2, 0), // sent here, over any interface
        BPF_STMT(BPF_LD | BPF_W | BPF_ABS, static_cast<std::uint32_t>(SKF_AD_OFF + SKF_AD_IFINDEX)),
        BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, loopback_index, 0, 1), // sent here, over the loopback interface
        BPF_STMT(BPF_RET | BPF_K, 0xFFFFFFFFU),
        BPF_STMT(BPF_RET | BPF_K, 0U),
    }};
    const sock_fprog program{static_cast<unsigned short>(from_here.size()), from_here.data()};
    for (int descriptor = 0; descriptor < most_descriptors; ++descriptor) {
        if (is_datagram_socket(descriptor, port)) {
            (void)setsockopt(descriptor, SOL_SOCKET, SO_ATTACH_FILTER, &program, sizeof program);
        }
    }
}

bool Session::handle(std::chrono::milliseconds timeout) {
    return lcm_.handleTimeout(static_cast<int>(timeout.count())) > 0;
}

int Session::descriptor() {
    return lcm_.getFileno();
}

} // namespace hexload::message
