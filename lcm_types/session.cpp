#include <hexload_lcm/session.hpp>

#include <algorithm>
#include <cctype>
#include <iterator>

namespace hexload::message {

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
    } else if (received_ > 0) {
        lost_ += static_cast<std::uint64_t>(sequence - last_ - 1);
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

bool Session::handle(std::chrono::milliseconds timeout) {
    return lcm_.handleTimeout(static_cast<int>(timeout.count())) > 0;
}

int Session::descriptor() {
    return lcm_.getFileno();
}

} // namespace hexload::message
