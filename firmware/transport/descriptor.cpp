#include "descriptor.hpp"

#include <cstring>

#include <poll.h>
#include <time.h>

namespace hexload::transport {

namespace {

bool wait_for(short event, int descriptor, std::chrono::microseconds timeout) {
    pollfd waited{descriptor, event, 0};
    const auto whole = std::chrono::floor<std::chrono::seconds>(timeout);
    timespec limit{};
    limit.tv_sec = whole.count();
    limit.tv_nsec = std::chrono::nanoseconds(timeout - whole).count();
    return ppoll(&waited, 1, &limit, nullptr) > 0;
}

} // namespace

bool wait_readable(int descriptor, std::chrono::microseconds timeout) {
    return wait_for(POLLIN, descriptor, timeout);
}

bool wait_writable(int descriptor, std::chrono::microseconds timeout) {
    return wait_for(POLLOUT, descriptor, timeout);
}

std::optional<std::uint32_t> dropped_messages(msghdr& message) {
    for (cmsghdr* part = CMSG_FIRSTHDR(&message); part != nullptr; part = CMSG_NXTHDR(&message, part)) {
        if (part->cmsg_level == SOL_SOCKET && part->cmsg_type == SO_RXQ_OVFL) {
            std::uint32_t dropped = 0;
            std::memcpy(&dropped, CMSG_DATA(part), sizeof dropped);
            return dropped;
        }
    }
    return std::nullopt;
}

} // namespace hexload::transport
