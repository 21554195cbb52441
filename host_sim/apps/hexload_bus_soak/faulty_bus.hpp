// A controller's node in this process and a bus to it on which things go wrong: frames are lost, doubled,
// changed, late or somebody else's, the controller is started anew, the bus is down. Time passes by the
// millisecond and only when it is told to, or while somebody waits for a frame: the same seed, the same run.
#pragma once

#include "app/node.h"
#include "transport/can_channel.hpp"
#include "transport/key.hpp"

#include <hexload_sim/random.hpp>

#include <chrono>
#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>

namespace hexload::sim {

class FaultyBus {
  public:
    using Clock = std::chrono::steady_clock;

    FaultyBus(const hexload_config_t& config, hexload_bus_profile_t profile,
              const std::optional<transport::Key>& key, std::uint64_t seed);
    FaultyBus(const FaultyBus&) = delete;
    FaultyBus& operator=(const FaultyBus&) = delete;

    void elapse_ms();

    // Of the simulator. False: the bus is down.
    bool send(const hexload_bus_frame_t& frame);
    std::optional<hexload_bus_frame_t> receive(std::chrono::microseconds timeout);

    bool is_up() const {
        return fault_ != Fault::bus_down;
    }
    Clock::time_point now() const {
        return now_;
    }
    // The simulator is to end here, and another one to begin.
    bool ends_simulator();

    // How often each fault has begun.
    const std::map<std::string, std::uint64_t>& faults() const {
        return begun_;
    }

  private:
    enum class Fault {
        none,
        lost,
        doubled,
        reordered,
        damaged,
        late,
        forged_sample,
        far_ahead,
        old_samples,
        forged_command,
        other_controller,
        other_profile,
        controller_restart,
        simulator_restart,
        bus_down,
        count,
    };
    static const char* name_of(Fault fault);

    struct Waiting {
        std::uint64_t due_ms;
        bool is_to_controller;
        hexload_bus_frame_t frame;
    };

    void start_controller();
    void change_fault();
    void carry(const hexload_bus_frame_t& frame, bool is_to_controller);
    void deliver(const hexload_bus_frame_t& frame, bool is_to_controller);
    void deliver_due();
    void note_sample(const hexload_bus_frame_t& frame);
    void interfere();
    void send_sample_of(std::uint32_t tick, hexload_bus_profile_t profile, double force_share);
    void send_command();
    void send_status();
    bool is_hit() {
        return random_.uniform() < share_;
    }

    hexload_config_t config_;
    hexload_bus_profile_t profile_;
    std::optional<transport::Aes128> aes_;
    RandomStream random_;
    hexload_node_t node_{};
    std::uint64_t nonce_seed_;
    Clock::time_point now_{};
    std::uint64_t ms_ = 0;
    Fault fault_ = Fault::none;
    double share_ = 0.0;              // of frames, or of milliseconds, that the fault hits
    std::uint64_t fault_ends_ms_ = 0; // or what is without one
    bool ends_simulator_ = false;
    hexload_sample_assembly_t heard_{}; // what the simulator sends
    hexload_leg_sample_t last_sample_{};
    std::uint32_t far_tick_ = 0;
    std::deque<Waiting> waiting_;
    std::optional<Waiting> held_; // goes behind the next frame of its direction
    std::deque<hexload_bus_frame_t> to_simulator_;
    std::map<std::string, std::uint64_t> begun_;
};

// The simulator's end of it.
class FaultyBusEnd final : public transport::CanChannel {
  public:
    explicit FaultyBusEnd(FaultyBus& bus) : bus_(bus) {
        name_ = "soak";
    }
    int descriptor() const override {
        return -1;
    }
    bool send(const hexload_bus_frame_t& frame, std::chrono::microseconds) override {
        return bus_.send(frame);
    }
    std::optional<hexload_bus_frame_t> receive(std::chrono::microseconds timeout) override {
        return bus_.receive(timeout);
    }
    bool is_up() const override {
        return bus_.is_up();
    }

  private:
    FaultyBus& bus_;
};

} // namespace hexload::sim
