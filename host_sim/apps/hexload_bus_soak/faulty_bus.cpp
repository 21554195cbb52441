#include "faulty_bus.hpp"

#include "bus/sample_assembly.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

namespace hexload::sim {

namespace {

struct Range {
    double least_ms, most_ms;
};
constexpr Range fault_length{1.0, 3000.0};
constexpr Range pause_length{300.0, 60000.0}; // long enough for estimates to converge
constexpr std::uint32_t supervised_ms =
    1000; // a controller that has heard another is started again after this
constexpr double longest_outage_ms = 400.0;
constexpr double latest_ms = 30.0; // of a frame
constexpr double smallest_share = 1e-3;
constexpr std::uint32_t far_ticks = 1U << 20;
constexpr double commands = HEXLOAD_COMMAND_CHALLENGE; // 1 to this one
constexpr int flood = 20;                              // frames in a millisecond, more than a bus carries

} // namespace

const char* FaultyBus::name_of(Fault fault) {
    static constexpr std::array names = {"none",
                                         "lost",
                                         "doubled",
                                         "reordered",
                                         "damaged",
                                         "late",
                                         "forged samples",
                                         "samples far ahead",
                                         "old samples",
                                         "forged commands",
                                         "status of another controller",
                                         "samples of the other profile",
                                         "controller restarted",
                                         "simulator restarted",
                                         "bus down"};
    static_assert(names.size() == static_cast<std::size_t>(Fault::count));
    return names.at(static_cast<std::size_t>(fault));
}

FaultyBus::FaultyBus(const hexload_config_t& config, hexload_bus_profile_t profile,
                     const std::optional<transport::Key>& key, std::uint64_t seed)
    : config_(config), profile_(profile), random_(seed, RandomPurpose::bus_faults), nonce_seed_(seed << 20U) {
    if (key) {
        aes_.emplace(*key);
    }
    hexload_sample_assembly_init(&heard_, profile);
    start_controller();
    change_fault();
}

void FaultyBus::start_controller() {
    hexload_port_t port{};
    port.context = this;
    port.send = [](void* self, const hexload_bus_frame_t* frame) {
        static_cast<FaultyBus*>(self)->carry(*frame, false);
        return true;
    };
    if (aes_) {
        port.aes128_encrypt_block = [](void* self, const std::uint8_t* in, std::uint8_t* out) {
            const hexload_cipher_t cipher = static_cast<FaultyBus*>(self)->aes_->cipher();
            cipher.encrypt_block(cipher.context, in, out);
        };
        port.nonce_seed = nonce_seed_++;
    }
    hexload_app_settings_t settings;
    hexload_app_settings_default(&settings);
    if (const auto status = hexload_node_init(&node_, &config_, &settings, profile_, &port);
        status != HEXLOAD_OK) {
        throw std::invalid_argument(hexload_status_name(status));
    }
}

void FaultyBus::elapse_ms() {
    now_ += std::chrono::milliseconds(1);
    ++ms_;
    if (ms_ >= fault_ends_ms_) {
        change_fault();
    }
    deliver_due();
    interfere();
    hexload_node_period(&node_, 1);
    if (node_.heard_controller && node_.age_ms >= supervised_ms) {
        start_controller();
    }
}

// A fault, a pause, another fault: each of a length drawn evenly on a logarithmic scale.
void FaultyBus::change_fault() {
    const bool was_down = fault_ == Fault::bus_down;
    const bool begins = fault_ == Fault::none && ms_ > 0;
    const Range length = begins ? fault_length : pause_length;
    fault_ = Fault::none;
    if (was_down) {
        hexload_node_bus_state(&node_, true);
    }
    double length_ms = std::exp(random_.uniform(std::log(length.least_ms), std::log(length.most_ms)));
    if (begins) {
        fault_ = static_cast<Fault>(
            1 + static_cast<int>(random_.uniform(0.0, static_cast<int>(Fault::count) - 1)));
        share_ = std::exp(random_.uniform(std::log(smallest_share), 0.0));
        ++begun_[name_of(fault_)];
        far_tick_ = last_sample_.tick + far_ticks;
    }
    if (fault_ == Fault::controller_restart) {
        start_controller();
    } else if (fault_ == Fault::simulator_restart) {
        ends_simulator_ = true;
    } else if (fault_ == Fault::bus_down) {
        length_ms = std::min(length_ms, longest_outage_ms);
        hexload_node_bus_state(&node_, false);
        waiting_.clear();
        held_.reset();
    }
    fault_ends_ms_ = ms_ + static_cast<std::uint64_t>(std::ceil(length_ms));
}

bool FaultyBus::ends_simulator() {
    const bool ends = ends_simulator_;
    ends_simulator_ = false;
    return ends;
}

bool FaultyBus::send(const hexload_bus_frame_t& frame) {
    if (!is_up()) {
        return false;
    }
    note_sample(frame);
    carry(frame, true);
    return true;
}

std::optional<hexload_bus_frame_t> FaultyBus::receive(std::chrono::microseconds timeout) {
    const auto end = now_ + timeout;
    while (to_simulator_.empty() && now_ < end) {
        elapse_ms();
    }
    if (to_simulator_.empty()) {
        return std::nullopt;
    }
    const hexload_bus_frame_t frame = to_simulator_.front();
    to_simulator_.pop_front();
    return frame;
}

void FaultyBus::carry(const hexload_bus_frame_t& frame, bool is_to_controller) {
    hexload_bus_frame_t carried = frame;
    switch (fault_ == Fault::none || !is_hit() ? Fault::none : fault_) {
    case Fault::lost:
    case Fault::bus_down:
        return;
    case Fault::doubled:
        deliver(carried, is_to_controller);
        break;
    case Fault::reordered:
        if (!held_) {
            held_ = Waiting{ms_, is_to_controller, carried};
            return;
        }
        break;
    case Fault::damaged:
        carried.data[static_cast<int>(random_.uniform(0.0, carried.length))] ^=
            static_cast<std::uint8_t>(1 + static_cast<int>(random_.uniform(0.0, 255.0)));
        break;
    case Fault::late:
        waiting_.push_back({ms_ + 1 + static_cast<std::uint64_t>(random_.uniform(0.0, latest_ms)),
                            is_to_controller, carried});
        return;
    default:
        break;
    }
    deliver(carried, is_to_controller);
    if (held_ && held_->is_to_controller == is_to_controller) {
        const Waiting behind = *held_;
        held_.reset();
        deliver(behind.frame, is_to_controller);
    }
}

void FaultyBus::deliver(const hexload_bus_frame_t& frame, bool is_to_controller) {
    if (is_to_controller) {
        hexload_node_receive(&node_, &frame);
    } else {
        to_simulator_.push_back(frame);
    }
}

void FaultyBus::deliver_due() {
    const std::size_t count = waiting_.size(); // those that an answer adds wait for the next ms
    for (std::size_t n = 0; n < count; ++n) {
        const Waiting next = waiting_.front();
        waiting_.pop_front();
        if (next.due_ms <= ms_) {
            deliver(next.frame, next.is_to_controller);
        } else {
            waiting_.push_back(next);
        }
    }
}

// What somebody who listens knows of the source: its tick, and forces near those of its legs.
void FaultyBus::note_sample(const hexload_bus_frame_t& frame) {
    hexload_leg_sample_t sample;
    if (hexload_sample_assembly_add(&heard_, &frame, &sample) == HEXLOAD_BUS_OK) {
        last_sample_ = sample;
    }
}

// What comes from elsewhere in this millisecond.
void FaultyBus::interfere() {
    if (fault_ == Fault::none || !is_hit()) {
        return;
    }
    const hexload_bus_profile_t other = profile_ == HEXLOAD_BUS_FD ? HEXLOAD_BUS_CLASSIC : HEXLOAD_BUS_FD;
    switch (fault_) {
    case Fault::forged_sample:
        send_sample_of(last_sample_.tick + static_cast<std::uint32_t>(random_.uniform(0.0, 8.0)), profile_,
                       random_.uniform(0.5, 1.5));
        break;
    case Fault::far_ahead:
        for (int n = 0; n < flood; ++n) {
            send_sample_of(far_tick_++, profile_, random_.uniform(0.5, 1.5));
        }
        break;
    case Fault::old_samples:
        send_sample_of(last_sample_.tick - static_cast<std::uint32_t>(random_.uniform(1.0, 200.0)), profile_,
                       random_.uniform(0.5, 1.5));
        break;
    case Fault::forged_command:
        send_command();
        break;
    case Fault::other_controller:
        send_status();
        break;
    case Fault::other_profile:
        send_sample_of(last_sample_.tick, other, 1.0);
        break;
    default:
        break;
    }
}

void FaultyBus::send_sample_of(std::uint32_t tick, hexload_bus_profile_t profile, double force_share) {
    hexload_leg_sample_t sample = last_sample_;
    std::array<hexload_bus_frame_t, HEXLOAD_BUS_SAMPLE_FRAMES> frames{};
    std::uint32_t saturated = 0;
    sample.tick = tick;
    for (auto& force_n : sample.force_n) {
        force_n *= static_cast<hexload_real_t>(force_share);
    }
    const int count = hexload_bus_encode_sample(profile, &sample, frames.data(), &saturated);
    for (int n = 0; n < count; ++n) {
        deliver(frames.at(static_cast<std::size_t>(n)), true);
    }
}

// SET_KNOWN_MASS, STOP, RESET and others, of a source of its own and without a code. A controller with a key
// carries out none of them; without one it obeys anybody, and no rule could tell: none is sent there.
void FaultyBus::send_command() {
    const auto kind = static_cast<std::uint8_t>(random_.uniform(1.0, commands + 1.0));
    const hexload_bus_command_t command{.kind = kind,
                                        .source = HEXLOAD_SOURCE_OPERATOR,
                                        .session = 7,
                                        .sequence = static_cast<std::uint8_t>(ms_),
                                        .argument = kind == HEXLOAD_COMMAND_SET_KNOWN_MASS ? 900.0F : 0.0F,
                                        .configuration = 0};
    hexload_bus_frame_t frame;
    if (aes_ && hexload_bus_encode_command(&command, &frame) == HEXLOAD_BUS_OK) {
        deliver(frame, true);
    }
}

void FaultyBus::send_status() {
    hexload_bus_controller_status_t status{};
    status.counter = static_cast<std::uint8_t>(ms_);
    status.state = HEXLOAD_APP_CONVERGED;
    hexload_bus_frame_t frame;
    hexload_bus_encode_status(&status, 0, &frame);
    deliver(frame, true);
    deliver(frame, false);
}

} // namespace hexload::sim
