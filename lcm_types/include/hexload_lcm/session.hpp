// LCM with what it leaves to its users: a network that is checked at the start, sequence numbers, gap
// counting.
#pragma once

#include <hexload_lcm/estimate_t.hpp>
#include <hexload_lcm/namespace.hpp>

#include <lcm/lcm-cpp.hpp>

#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace hexload::message {

// LCM's own group and port; time to live 0: no message leaves this computer.
inline constexpr std::string_view default_url = "udpm://239.255.76.67:7667?ttl=0";

// LCM cannot be used; what() says why and, where it is known, the command that mends it.
class SessionError : public std::runtime_error {
    using std::runtime_error::runtime_error;
};

// The option that names the URL is not one.
class UrlError : public SessionError {
    using SessionError::SessionError;
};

// "lcm" is the default URL, "lcm:URL" is URL. Throws UrlError for anything else.
std::string url_of(std::string_view option);

// The channel of a type has its name: leg_sample_t travels on HEXLOAD_LEG_SAMPLE. The table is
// lcm_types/README.md.
std::string channel_of(std::string_view type_name);
template <typename Message> std::string channel_of() {
    return channel_of(Message::getTypeName());
}

// Counts the messages of a channel that did not arrive. A sequence number that is not later is a restarted
// source.
class GapCounter {
  public:
    void take(std::int64_t sequence);

    // A message that cannot be decoded.
    void refuse() {
        ++refused_;
    }

    std::uint64_t received() const {
        return received_;
    }
    std::uint64_t refused() const {
        return refused_;
    }
    std::uint64_t lost() const {
        return lost_;
    }
    std::uint64_t restarts() const {
        return restarts_;
    }

  private:
    std::int64_t last_ = -1;
    std::uint64_t received_ = 0;
    std::uint64_t refused_ = 0;
    std::uint64_t lost_ = 0;
    std::uint64_t restarts_ = 0;
};

// One connection to LCM. Not for several threads.
class Session {
  public:
    // Throws SessionError; without a route for multicast it names the command that adds one.
    explicit Session(const std::string& url);
    Session(const Session&) = delete;
    Session& operator=(const Session&) = delete;

    const std::string& url() const {
        return url_;
    }

    // Calls handler for each message of this type from within handle(). The counter lives as long as the
    // session. The first subscription makes LCM send itself a message; SessionError if it has not come back
    // after ten seconds.
    template <typename Message> const GapCounter& subscribe(std::function<void(const Message&)> handler);

    // Waits for a message (0: does not wait) and hands it out. False: none came.
    bool handle(std::chrono::milliseconds timeout);

    // For poll(): readable when handle() has something to do.
    int descriptor();

    // False: LCM cannot send now, e.g. because the network is gone.
    template <typename Message> [[nodiscard]] bool send(const Message& message);

  private:
    [[noreturn]] void refuse(const std::string& found) const;

    std::string url_;
    ::lcm::LCM lcm_;
    std::vector<std::shared_ptr<void>> takers_; // of the subscriptions
};

// Sends messages of one type and numbers them.
template <typename Message> class Publisher {
  public:
    explicit Publisher(Session& session) : session_(session) {}

    // A message that LCM does not take has its number all the same, so that its receivers count it as lost.
    bool send(Message& message) {
        message.sequence = next_++;
        const bool is_sent = session_.send(message);
        failed_ += is_sent ? 0U : 1U;
        return is_sent;
    }
    std::uint64_t sent() const {
        return static_cast<std::uint64_t>(next_) - failed_;
    }
    std::uint64_t failed() const {
        return failed_;
    }

  private:
    Session& session_;
    std::int64_t next_ = 0;
    std::uint64_t failed_ = 0;
};

// Whether a message cannot claim more than it holds, as the generated decoders believe what it claims.
template <typename Message> bool is_bounded(std::span<const std::uint8_t> /*encoded*/) {
    return true;
}
template <> bool is_bounded<estimate_t>(std::span<const std::uint8_t> encoded);

// What a subscription hands its messages to.
template <typename Message> struct Taker {
    GapCounter counter;
    std::function<void(const Message&)> handler;

    void take(std::span<const std::uint8_t> encoded) {
        Message message{};
        if (!is_bounded<Message>(encoded) ||
            message.decode(encoded.data(), 0, static_cast<int>(encoded.size())) < 0) {
            counter.refuse();
            return;
        }
        counter.take(message.sequence);
        handler(message);
    }
};

template <typename Message>
const GapCounter& Session::subscribe(std::function<void(const Message&)> handler) {
    auto taker = std::make_shared<Taker<Message>>();
    taker->handler = std::move(handler);
    takers_.push_back(taker);
    ::lcm::Subscription* subscription = lcm_.subscribeFunction<Taker<Message>*>(
        channel_of<Message>(),
        [](const ::lcm::ReceiveBuffer* received, const std::string&, Taker<Message>* self) {
            self->take({static_cast<const std::uint8_t*>(received->data), received->data_size});
        },
        taker.get());
    if (subscription == nullptr) {
        refuse("that messages do not come back");
    }
    subscription->setQueueCapacity(0); // no limit: a full queue would drop messages silently
    return taker->counter;
}

template <typename Message> bool Session::send(const Message& message) {
    return lcm_.publish(channel_of<Message>(), &message) == 0;
}

} // namespace hexload::message
