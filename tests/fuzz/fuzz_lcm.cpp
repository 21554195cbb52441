// Messages of LCM: decoded by lcm-gen's code, then made the application's structs.
#include "bytes.h"

#include "transport/lcm_messages.hpp"

#include <hexload_lcm/session.hpp>

#include <algorithm>
#include <vector>

namespace {

// As a subscription takes it, behind the type's own fingerprint, without which nothing is decoded.
template <typename Message, typename Handler> void receive(std::span<const uint8_t> body, Handler handler) {
    std::vector<uint8_t> encoded(8 + body.size());
    const auto fingerprint = static_cast<uint64_t>(Message::getHash());
    for (unsigned n = 0; n < 8; ++n) {
        encoded[n] = static_cast<uint8_t>(fingerprint >> (56 - 8 * n));
    }
    std::copy(body.begin(), body.end(), encoded.begin() + 8);
    hexload::message::Taker<Message> taker;
    taker.handler = handler;
    taker.take(encoded);
}

} // namespace

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
    using namespace hexload;
    using namespace hexload::transport;
    if (size == 0) {
        return 0;
    }
    const std::span<const uint8_t> body(data + 1, size - 1);
    switch (data[0] % 6) {
    case 0:
        receive<leg_sample_t>(body, [](const leg_sample_t& message) { (void)leg_sample_of(message); });
        break;
    case 1:
        receive<estimate_t>(body, [](const estimate_t& message) {
            health_t health{};
            health.state = "idle";
            (void)answer_of(message, health);
        });
        break;
    case 2:
        receive<command_t>(body, [](const command_t& message) { (void)command_of(message); });
        break;
    case 3:
        receive<acknowledge_t>(body, [](const acknowledge_t& message) { (void)acknowledge_of(message); });
        break;
    case 4:
        receive<health_t>(body, [](const health_t& message) { (void)answer_of(estimate_t{}, message); });
        break;
    default:
        receive<load_change_t>(body, [](const load_change_t& message) { (void)load_change_of(message); });
        break;
    }
    return 0;
}
