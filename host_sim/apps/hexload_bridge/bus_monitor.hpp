// What goes over a CAN bus, seen by one who never sends: whole samples and answers, rates, and everything
// that is wrong.
#pragma once

#include "bus/answer_assembly.h"
#include "bus/sample_assembly.h"

#include <hexload_lcm/bus_statistics_t.hpp>
#include <hexload_lcm/namespace.hpp>

#include <chrono>
#include <cstdint>
#include <optional>

namespace hexload::bridge {

// What a frame completed.
struct BusEvent {
    std::optional<hexload_leg_sample_t> sample;
    std::optional<hexload_bus_answer_t> answer;
    std::optional<hexload_bus_acknowledge_t> acknowledge;
    std::optional<hexload_bus_load_change_t> load_change;
};

class BusMonitor {
  public:
    explicit BusMonitor(hexload_bus_profile_t profile);

    BusEvent take(const hexload_bus_frame_t& frame);

    // The statistics of the period that ends here, and the totals; begins the next period. All but sequence,
    // bus and receive_drops.
    bus_statistics_t end_period(std::chrono::duration<double> period);

    // Totals so far, for the summary.
    const bus_statistics_t& totals() const {
        return totals_;
    }
    std::uint32_t newest_tick() const {
        return newest_tick_;
    }
    // As far as the controller has reported it.
    std::uint32_t samples_missing() const {
        return status_.samples_missing;
    }

  private:
    bool take_sample(const hexload_bus_frame_t& frame, BusEvent& event);
    bool take_answer(const hexload_bus_frame_t& frame, BusEvent& event);
    bool take_slow(const hexload_bus_frame_t& frame, BusEvent& event);
    void count_tick(std::uint32_t tick);
    void count_refusal(hexload_bus_status_t status);

    struct Period {
        std::uint64_t to_controller = 0;
        std::uint64_t from_controller = 0;
        std::uint64_t foreign = 0;
        double busy_us = 0.0;
    };

    hexload_sample_assembly_t samples_{};
    hexload_answer_assembly_t answers_{};
    hexload_bus_controller_status_t status_{};
    bus_statistics_t totals_{};
    Period period_;
    std::uint32_t newest_tick_ = 0;
};

} // namespace hexload::bridge
