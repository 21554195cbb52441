#include "transport/can_channel.hpp"

#include "bus/slcan.h"
#include "transport/descriptor.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <string>

#include <arpa/inet.h>
#include <fcntl.h>
#include <netinet/in.h>
#include <pty.h>
#include <sys/socket.h>
#include <termios.h>

using namespace hexload::transport;
using namespace std::chrono_literals;

namespace {

constexpr auto patience = 60s;
constexpr auto at_once = 0us;

// The other end of the line, with the channel that is opened to it.
class OtherEnd {
  public:
    virtual ~OtherEnd() = default;
    virtual std::string name() const = 0;
    // After the channel has been opened.
    virtual int descriptor() = 0;
    virtual void hang_up() = 0;

    void write_text(const std::string& text) {
        REQUIRE(write(descriptor(), text.data(), text.size()) == static_cast<ssize_t>(text.size()));
    }

    // What comes up to the next `end`, which is part of it.
    std::string read_until(const std::string& end) {
        std::size_t place = unread_.find(end, begin_);
        while (place == std::string::npos) {
            std::array<char, 65536> bytes;
            const bool has_come = wait_readable(descriptor(), patience);
            const ssize_t size = has_come ? read(descriptor(), bytes.data(), bytes.size()) : 0;
            if (size <= 0) {
                FAIL("the line is silent after: ", unread_.substr(begin_));
            }
            unread_.erase(0, begin_).append(bytes.data(), static_cast<std::size_t>(size));
            begin_ = 0;
            place = unread_.find(end);
        }
        const std::size_t first = begin_;
        begin_ = place + end.size();
        return unread_.substr(first, begin_ - first);
    }

  private:
    std::string unread_;
    std::size_t begin_ = 0; // of what has not been given
};

class TcpServer final : public OtherEnd {
  public:
    TcpServer() : listener_(socket(AF_INET, SOCK_STREAM, 0)) {
        sockaddr_in address{};
        address.sin_family = AF_INET;
        address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        const int small = 4096; // so that it is full soon
        setsockopt(listener_.get(), SOL_SOCKET, SO_RCVBUF, &small, sizeof small);
        REQUIRE(bind(listener_.get(), reinterpret_cast<sockaddr*>(&address), sizeof address) == 0);
        REQUIRE(listen(listener_.get(), 1) == 0);
        socklen_t size = sizeof address;
        getsockname(listener_.get(), reinterpret_cast<sockaddr*>(&address), &size);
        port_ = ntohs(address.sin_port);
    }
    std::string name() const override {
        return "slcan:127.0.0.1:" + std::to_string(port_);
    }
    int descriptor() override {
        if (!line_) {
            line_ = Descriptor(accept(listener_.get(), nullptr, nullptr));
        }
        return line_.get();
    }
    void hang_up() override {
        line_ = Descriptor();
        listener_ = Descriptor();
    }

  private:
    Descriptor listener_;
    Descriptor line_;
    int port_ = 0;
};

class SerialLine final : public OtherEnd {
  public:
    SerialLine() {
        int ours = -1;
        int theirs = -1;
        std::array<char, 256> path{};
        REQUIRE(openpty(&ours, &theirs, path.data(), nullptr, nullptr) == 0);
        ours_ = Descriptor(ours);
        theirs_ = Descriptor(theirs); // kept open: else the line hangs up before the channel is there
        path_ = path.data();
    }
    std::string name() const override {
        return "slcan:" + path_;
    }
    int descriptor() override {
        return ours_.get();
    }
    void hang_up() override {
        theirs_ = Descriptor();
        ours_ = Descriptor();
    }

  private:
    Descriptor ours_;
    Descriptor theirs_;
    std::string path_;
};

hexload_bus_frame_t frame_of(std::uint32_t id) {
    hexload_bus_frame_t frame{};
    frame.id = id;
    frame.length = 8;
    std::fill_n(frame.data, 8, static_cast<std::uint8_t>(id));
    return frame;
}

std::string text_of(std::uint32_t id) {
    std::array<char, HEXLOAD_SLCAN_FRAME_BYTES> text;
    const hexload_bus_frame_t frame = frame_of(id);
    const int size = hexload_slcan_encode(&frame, text.data());
    return {text.data(), static_cast<std::size_t>(size)};
}

std::string refusal(const std::string& name, hexload_bus_profile_t profile = HEXLOAD_BUS_CLASSIC) {
    try {
        open_can_channel(name, profile);
    } catch (const ChannelError& error) {
        return error.what();
    }
    return "accepted";
}

bool contains(const std::string& text, const std::string& part) {
    return text.find(part) != std::string::npos;
}

template <typename End> void check_frames_pass() {
    End end;
    auto channel = open_can_channel(end.name(), HEXLOAD_BUS_CLASSIC);
    WHEN("it has been opened") {
        THEN("the other end was told 1 Mbit/s and to open, and on closing to close") {
            CHECK(end.read_until("O\r") == "\rC\rS8\rO\r");
            end.descriptor();
            channel.reset();
            CHECK(end.read_until("\r") == "C\r");
        }
    }
    WHEN("frames are sent") {
        end.read_until("O\r");
        THEN("their text comes, byte for byte") {
            for (const std::uint32_t id : {0x000U, 0x055U, 0x7FFU}) {
                CHECK(channel->send(frame_of(id), patience));
                CHECK(end.read_until("\r") == text_of(id));
            }
            CHECK(channel->counts().sent == 3);
            CHECK(channel->counts().send_failures == 0);
        }
    }
    WHEN("frames come in pieces, with other lines and garbage in between") {
        end.write_text("\r\aS8\r" + text_of(1) + "garbage\r" + text_of(2) + text_of(3).substr(0, 7));
        THEN("the whole ones are received in order, the broken one with its rest") {
            const auto first = channel->receive(patience);
            const auto second = channel->receive(patience);
            REQUIRE((first && second));
            CHECK(first->id == 1);
            CHECK(second->id == 2);
            CHECK(std::equal(first->data, first->data + 8, frame_of(1).data));
            CHECK(!channel->receive(at_once));
            end.write_text(text_of(3).substr(7));
            const auto third = channel->receive(patience);
            REQUIRE(third);
            CHECK(third->id == 3);
            CHECK(channel->counts().received == 3);
            CHECK(channel->counts().error_frames == 2); // the bell and the garbage
        }
    }
    WHEN("frames wait that have left the line together") {
        end.write_text(text_of(1) + text_of(2));
        REQUIRE(channel->receive(patience));
        THEN("the descriptor stays readable until the last one is taken") {
            CHECK(wait_readable(channel->descriptor(), at_once));
            CHECK(channel->receive(at_once));
            CHECK(!channel->receive(at_once));
            CHECK(!wait_readable(channel->descriptor(), at_once));
        }
    }
    WHEN("the other end goes") {
        end.read_until("O\r");
        REQUIRE(channel->is_up());
        end.hang_up();
        THEN("the bus is down, is counted, and nobody waits for it for ever") {
            CHECK(wait_readable(channel->descriptor(), patience)); // so that whoever polls hears of it
            CHECK(!channel->receive(patience));
            CHECK(!channel->is_up());
            CHECK(channel->counts().error_frames == 1);
            CHECK(!channel->send(frame_of(1), patience));
            CHECK(channel->counts().send_failures == 1);
            CHECK(!wait_readable(channel->descriptor(), at_once));
            CHECK(contains(channel->advice(), "connection was lost"));
        }
    }
}

} // namespace

SCENARIO("SLCAN over TCP carries classic frames") {
    GIVEN("a connection") {
        check_frames_pass<TcpServer>();
    }
}

SCENARIO("SLCAN over a serial device carries classic frames") {
    GIVEN("a serial device") {
        check_frames_pass<SerialLine>();
    }
}

SCENARIO("an SLCAN line whose other end does not read fills up and loses no part of a frame") {
    GIVEN("a connection whose other end has stopped reading") {
        TcpServer end;
        auto channel = open_can_channel(end.name(), HEXLOAD_BUS_CLASSIC);
        end.descriptor();
        WHEN("frames are sent until one is refused") {
            std::uint32_t sent = 0;
            while (channel->send(frame_of(sent % 0x800), 1000us)) {
                ++sent;
            }
            THEN("that one is counted, the bus is up, and the others come whole and in order when it reads "
                 "again") {
                CHECK(channel->is_up());
                CHECK(channel->counts().send_failures == 1);
                CHECK(channel->counts().send_retries > 0);
                CHECK(channel->counts().sent == sent);
                end.read_until("O\r");
                for (std::uint32_t id = 0; id < sent / 2; ++id) {
                    REQUIRE(end.read_until("\r") == text_of(id % 0x800));
                }
                CHECK(channel->send(frame_of(0x123), patience));
                for (std::uint32_t id = sent / 2; id < sent; ++id) {
                    REQUIRE(end.read_until("\r") == text_of(id % 0x800));
                }
                CHECK(end.read_until("\r") == text_of(0x123));
            }
        }
    }
}

SCENARIO("an SLCAN bus that cannot be had is refused with what was expected") {
    GIVEN("a line that would take a connection") {
        TcpServer end;
        WHEN("it is opened for FD frames") {
            THEN("the profile is refused, as a wrong option is") {
                CHECK_THROWS_AS(open_can_channel(end.name(), HEXLOAD_BUS_FD), ChannelNameError);
                CHECK(contains(refusal(end.name(), HEXLOAD_BUS_FD), "expected classic"));
            }
        }
        WHEN("nobody listens any more") {
            const std::string name = end.name();
            end.hang_up();
            THEN("the message says so") {
                CHECK(contains(refusal(name), name + ": found nobody who accepts the connection"));
            }
        }
    }
    GIVEN("names of nothing, and of what is no serial device") {
        WHEN("they are opened") {
            THEN("the message says what was found") {
                CHECK(contains(refusal("slcan:/nowhere/ttyACM0"), "cannot be opened: No such file"));
                CHECK(contains(refusal("slcan:/dev/null"), "found no serial device, expected one"));
                CHECK(contains(refusal("slcan:host.invalid:4001"), "found no host host.invalid"));
            }
        }
    }
}
