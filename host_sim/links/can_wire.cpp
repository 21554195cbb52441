#include "can_wire.hpp"

#include "firmware_sample.hpp"

#include "app/node.h"
#include "platform_file/input_error.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace hexload::sim {

namespace {

constexpr std::chrono::microseconds command_deadline{1000};
constexpr std::size_t memory_frames = 12; // four FD answers: what a network delivers twice comes soon after
constexpr std::chrono::seconds command_patience{1}; // for a challenge: later the command would surprise

} // namespace

CanWire::CanWire(std::unique_ptr<transport::CanChannel> channel, const CanLinkSettings& settings)
    : channel_(std::move(channel)), profile_(settings.profile), now_(settings.now),
      has_sample_codes_(settings.key && settings.has_sample_codes),
      has_answer_codes_(settings.key && settings.has_answer_codes) {
    hexload_answer_assembly_init(&assembly_, profile_);
    if (settings.key) {
        aes_.emplace(*settings.key);
    }
}

void CanWire::send(const hexload_bus_command_t& wanted) {
    hexload_bus_command_t command = wanted;
    if (command.kind == HEXLOAD_COMMAND_START) {
        command.argument += static_cast<float>((has_sample_codes_ ? HEXLOAD_PACING_CODES : 0) +
                                               (has_answer_codes_ ? HEXLOAD_PACING_ANSWER_CODES : 0));
    }
    hexload_bus_frame_t frame;
    if (hexload_bus_encode_command(&command, &frame) != HEXLOAD_BUS_OK) {
        return;
    }
    if (!aes_) {
        channel_->send(frame,
                       command_deadline); // a lost one is sent again by whoever waits for its acknowledge
        return;
    }
    waiting_ = frame;
    waits_until_ = now_() + command_patience;
    if (nonce_) {
        send_with_code();
    } else {
        ask_challenge(command);
    }
}

void CanWire::ask_challenge(hexload_bus_command_t command) {
    hexload_bus_frame_t frame;
    command.kind = HEXLOAD_COMMAND_CHALLENGE;
    command.argument = 0.0F;
    if (hexload_bus_encode_command(&command, &frame) == HEXLOAD_BUS_OK) {
        channel_->send(frame, command_deadline);
    }
}

void CanWire::send_with_code() {
    const hexload_cipher_t cipher = aes_->cipher();
    hexload_bus_frame_t code;
    hexload_bus_encode_command_mac(&cipher, &*nonce_, &*waiting_, &code);
    channel_->send(*waiting_, command_deadline);
    channel_->send(code, command_deadline);
    used_ = *nonce_;
    nonce_.reset();
    waiting_.reset();
}

bool CanWire::send(const LegSample& sample, std::chrono::microseconds deadline) {
    const hexload_leg_sample_t legs = firmware_sample(sample);
    hexload_bus_frame_t frames[HEXLOAD_BUS_SAMPLE_FRAMES];
    const int count = hexload_bus_encode_sample(profile_, &legs, frames, &saturated_);
    if (count < 0) {
        throw InputError(fmt::format("sample of tick {}: found a channel that is not finite", sample.tick));
    }
    newest_tick_ = sample.tick;
    const bool is_sent = std::all_of(frames, frames + count, [&](const hexload_bus_frame_t& frame) {
        return channel_->send(frame, deadline / count);
    });
    return is_sent && send_sample_code(frames, count, sample.tick, deadline / count);
}

// What a START with codes counted in is their nonce: it was carried out.
void CanWire::begin_codes(const hexload_bus_acknowledge_t& acknowledge) {
    if (acknowledge.kind != HEXLOAD_COMMAND_START || acknowledge.result != HEXLOAD_RESULT_DONE) {
        return;
    }
    if (has_sample_codes_) {
        hexload_sample_code_init(&sample_code_.emplace(), &used_);
    }
    if (has_answer_codes_) {
        hexload_answer_code_init(&answer_code_.emplace(), profile_, &used_);
    }
}

void CanWire::fail_unproven(const char* what) const {
    throw LinkError(LinkFailure::second_controller,
                    fmt::format("{}: the answers near tick {} are not the controller's: {}; somebody else "
                                "answers in its place",
                                name(), newest_tick_, what));
}

bool CanWire::is_answer_code(const hexload_bus_frame_t& frame) {
    if (!answer_code_) {
        return false;
    }
    const hexload_cipher_t cipher = aes_->cipher();
    const hexload_bus_status_t status = hexload_answer_code_check(&*answer_code_, &cipher, &frame);
    if (status == HEXLOAD_BUS_ERR_AUTHENTICATION) {
        fail_unproven("their code is not of its key");
    }
    const bool is_refused = status == HEXLOAD_BUS_PARTIAL || status == HEXLOAD_BUS_ERR_LENGTH;
    refused_ += is_refused ? 1U : 0U;
    return status != HEXLOAD_BUS_OTHER;
}

// Estimates that go on without codes are another's. A controller that does not estimate may have been started
// anew, and know nothing of codes.
void CanWire::count_into_answer_code(const hexload_bus_frame_t& frame, const AnswerPart& part) {
    if (!answer_code_) {
        return;
    }
    const hexload_cipher_t cipher = aes_->cipher();
    const bool ends_answer = part.whole || profile_ == HEXLOAD_BUS_CLASSIC;
    hexload_answer_code_add(&*answer_code_, &cipher, &frame, ends_answer, part.answered_tick);
    if (profile_ == HEXLOAD_BUS_FD && (assembly_.parts & (assembly_.parts + 1U)) != 0) {
        answer_code_->is_whole = false; // parts before their turn: a code counts frames in their order
    }
    if (answer_code_->unproven > HEXLOAD_NODE_UNPROVEN && part.whole &&
        (part.whole->state == HEXLOAD_APP_ESTIMATING || part.whole->state == HEXLOAD_APP_CONVERGED)) {
        fail_unproven("they have no codes of its key");
    }
}

bool CanWire::send_sample_code(const hexload_bus_frame_t* frames, int count, std::uint32_t tick,
                               std::chrono::microseconds deadline) {
    if (!sample_code_) {
        return true;
    }
    const hexload_cipher_t cipher = aes_->cipher();
    for (int n = 0; n < count; ++n) {
        hexload_sample_code_add(&*sample_code_, &cipher, &frames[n], n + 1 == count, tick);
    }
    if (!hexload_sample_code_is_due(&*sample_code_)) {
        return true;
    }
    hexload_bus_frame_t code;
    hexload_sample_code_encode(&*sample_code_, &cipher, &code);
    return channel_->send(code, deadline);
}

std::optional<BusNews> CanWire::read(std::chrono::microseconds timeout) {
    const auto frame = channel_->receive(timeout);
    if (!frame) {
        return std::nullopt;
    }
    if (is_echo(*frame)) {
        ++refused_;
        return StaleFrame{};
    }
    if (is_answer_code(*frame)) {
        return UnrelatedFrame{};
    }
    if (auto answer = read_answer(*frame)) {
        return answer;
    }
    hexload_bus_acknowledge_t acknowledge;
    if (is_taken(hexload_bus_decode_acknowledge(&*frame, &acknowledge))) {
        begin_codes(acknowledge);
        return acknowledge;
    }
    if (is_taken(hexload_bus_decode_status(&*frame, &status_))) {
        return status_;
    }
    hexload_nonce_t nonce;
    if (aes_ && is_taken(hexload_bus_decode_challenge(&*frame, &nonce))) {
        nonce_ = nonce;
        if (waiting_ && now_() < waits_until_) {
            send_with_code();
        }
    }
    hexload_bus_load_change_t change;
    if (is_taken(hexload_bus_decode_load_change(&*frame, &change))) {
        return change;
    }
    return UnrelatedFrame{};
}

bool CanWire::is_echo(const hexload_bus_frame_t& frame) {
    if (!hexload_bus_is_from_controller(&frame)) {
        return false;
    }
    const auto is_same = [&frame](const hexload_bus_frame_t& before) {
        return before.id == frame.id && before.length == frame.length &&
               std::equal(frame.data, frame.data + frame.length, before.data);
    };
    if (std::any_of(heard_.begin(), heard_.end(), is_same)) {
        return true;
    }
    heard_.push_front(frame);
    heard_.resize(std::min(heard_.size(), memory_frames));
    return false;
}

// Whether the answer frame before with this identifier was of the same tick, or the same page of the same
// tick, and says something else. Of earlier ones that is not looked at: a sample that comes late is answered
// too.
bool CanWire::contradicts_last(const hexload_bus_frame_t& frame) const {
    const auto last =
        std::find_if(heard_.begin() + 1, heard_.end(),
                     [&frame](const hexload_bus_frame_t& before) { return before.id == frame.id; });
    const int head = frame.is_fd ? 0 : 1; // the tick; behind a page's checksum: counter, tick and page
    return last != heard_.end() && std::equal(frame.data + head, frame.data + 4, last->data + head);
}

void CanWire::fail_two_answers() const {
    throw LinkError(
        LinkFailure::second_controller,
        fmt::format("{}: two answers to one tick, near tick {}: a second controller is on the bus", name(),
                    newest_tick_));
}

// One that has begun counts too: in lockstep nothing follows it.
std::uint64_t CanWire::incomplete_answers() const {
    constexpr std::uint32_t all_parts = 7;
    const bool lacks_frames = profile_ == HEXLOAD_BUS_FD && assembly_.parts % all_parts != 0;
    return assembly_.incomplete + (lacks_frames ? 1U : 0U);
}

bool CanWire::is_taken(hexload_bus_status_t status) {
    refused_ += status < 0 ? 1U : 0U;
    return status == HEXLOAD_BUS_OK;
}

std::optional<BusNews> CanWire::read_answer(const hexload_bus_frame_t& frame) {
    AnswerPart part;
    hexload_bus_answer_t answer;
    const hexload_bus_status_t status =
        hexload_answer_assembly_add(&assembly_, &frame, newest_tick_, &part.answered_tick, &answer);
    const bool is_answer =
        status == HEXLOAD_BUS_OK || status == HEXLOAD_BUS_PARTIAL || status == HEXLOAD_BUS_ERR_TICK;
    if (is_answer && contradicts_last(frame)) {
        fail_two_answers();
    }
    switch (status) {
    case HEXLOAD_BUS_OK:
        answer.input.excess_n = status_.input.excess_n; // of the status alone
        part.whole = answer;
        part.ends_tick = true;
        count_into_answer_code(frame, part);
        return part;
    case HEXLOAD_BUS_PARTIAL:
        part.ends_tick = profile_ == HEXLOAD_BUS_CLASSIC;
        count_into_answer_code(frame, part);
        return part;
    case HEXLOAD_BUS_OTHER:
        return std::nullopt;
    case HEXLOAD_BUS_ERR_TICK: // late
        ++refused_;
        return StaleFrame{};
    case HEXLOAD_BUS_ERR_PROFILE:
        throw LinkError(LinkFailure::wrong_profile,
                        fmt::format("{}: a controller answers in another profile than {}", name(),
                                    hexload_bus_profile_name(profile_)));
    default:
        ++refused_; // damaged: the answer stays incomplete and is missed
        return UnrelatedFrame{};
    }
}

BusCounts CanWire::counts() const {
    const transport::ChannelCounts& channel = channel_->counts();
    BusCounts counts;
    counts.name = channel_->name();
    counts.profile = hexload_bus_profile_name(profile_);
    counts.advice = channel_->advice();
    counts.saturated = saturated_;
    counts.refused = refused_;
    counts.frames_sent = channel.sent;
    counts.frames_received = channel.received;
    counts.send_retries = channel.send_retries;
    counts.send_failures = channel.send_failures;
    counts.receive_drops = channel.receive_drops;
    counts.error_frames = channel.error_frames;
    return counts;
}

std::unique_ptr<EstimatorLink> make_lockstep_link(std::unique_ptr<transport::CanChannel> channel,
                                                  const CanLinkSettings& settings) {
    return make_lockstep_link(std::make_unique<CanWire>(std::move(channel), settings), settings);
}

std::unique_ptr<EstimatorLink> make_real_time_link(std::unique_ptr<transport::CanChannel> channel,
                                                   const CanLinkSettings& settings) {
    return make_real_time_link(std::make_unique<CanWire>(std::move(channel), settings), settings);
}

} // namespace hexload::sim
