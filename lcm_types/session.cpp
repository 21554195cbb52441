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
