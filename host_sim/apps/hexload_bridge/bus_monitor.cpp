#include "bus_monitor.hpp"

#include "transport/bit_time.hpp"

#include "app/app.h"

#include <fmt/format.h>

#include <algorithm>

namespace hexload::bridge {

BusMonitor::BusMonitor(hexload_bus_profile_t profile) {
    hexload_sample_assembly_init(&samples_, profile);
    hexload_answer_assembly_init(&answers_, profile);
    totals_.profile = hexload_bus_profile_name(profile);
}

BusEvent BusMonitor::take(const hexload_bus_frame_t& frame) {
    period_.busy_us += transport::longest_time_us(frame);
    BusEvent event;
    if (!take_sample(frame, event) && !take_answer(frame, event) && !take_slow(frame, event)) {
        ++period_.foreign;
    } else if (hexload_bus_is_from_controller(&frame)) {
        ++period_.from_controller;
    } else {
        ++period_.to_controller;
    }
    return event;
}

// Like the two below: false for a frame of another kind.
bool BusMonitor::take_sample(const hexload_bus_frame_t& frame, BusEvent& event) {
    hexload_leg_sample_t sample{};
    const hexload_bus_status_t status = hexload_sample_assembly_add(&samples_, &frame, &sample);
    count_refusal(status);
    if (status == HEXLOAD_BUS_OK) {
        count_tick(sample.tick);
        event.sample = sample;
    }
    return status != HEXLOAD_BUS_OTHER;
}

bool BusMonitor::take_answer(const hexload_bus_frame_t& frame, BusEvent& event) {
    hexload_bus_answer_t answer{};
    std::uint32_t answered_tick = 0;
    const hexload_bus_status_t status =
        hexload_answer_assembly_add(&answers_, &frame, newest_tick_, &answered_tick, &answer);
    count_refusal(status);
    if (status == HEXLOAD_BUS_OK) {
        ++totals_.answers;
        answer.input.excess_n = status_.input.excess_n; // of the status alone
        event.answer = answer;
    }
    return status != HEXLOAD_BUS_OTHER;
}

bool BusMonitor::take_slow(const hexload_bus_frame_t& frame, BusEvent& event) {
    hexload_bus_acknowledge_t acknowledge{};
    hexload_bus_command_t command{};
    hexload_bus_load_change_t change{};
    const hexload_bus_status_t statuses[] = {
        hexload_bus_decode_acknowledge(&frame, &acknowledge), hexload_bus_decode_status(&frame, &status_),
        hexload_bus_decode_command(&frame, &command), hexload_bus_decode_load_change(&frame, &change)};
    std::for_each(std::begin(statuses), std::end(statuses),
                  [this](hexload_bus_status_t status) { count_refusal(status); });
    if (statuses[0] == HEXLOAD_BUS_OK) {
        event.acknowledge = acknowledge;
    }
    if (statuses[3] == HEXLOAD_BUS_OK) {
        event.load_change = change;
    }
    totals_.has_controller |= statuses[1] == HEXLOAD_BUS_OK ? 1 : 0;
    return std::any_of(std::begin(statuses), std::end(statuses),
                       [](hexload_bus_status_t status) { return status != HEXLOAD_BUS_OTHER; });
}

void BusMonitor::count_tick(std::uint32_t tick) {
    if (totals_.samples > 0 && tick > newest_tick_) { // else a new run
        totals_.samples_missing += tick - newest_tick_ - 1;
    }
    newest_tick_ = tick;
    ++totals_.samples;
}

void BusMonitor::count_refusal(hexload_bus_status_t status) {
    switch (status) {
    case HEXLOAD_BUS_ERR_LENGTH:
        ++totals_.refused_length;
        break;
    case HEXLOAD_BUS_ERR_CRC:
        ++totals_.refused_checksum;
        break;
    case HEXLOAD_BUS_ERR_VALUE:
        ++totals_.refused_value;
        break;
    case HEXLOAD_BUS_ERR_TICK:
        ++totals_.refused_tick;
        break;
    case HEXLOAD_BUS_ERR_PROFILE:
        ++totals_.refused_profile;
        break;
    default:
        break;
    }
}

bus_statistics_t BusMonitor::end_period(std::chrono::duration<double> period) {
    constexpr double us_per_s = 1e6;
    totals_.tick = newest_tick_;
    totals_.period_s = period.count();
    totals_.frames_to_controller_1_s = static_cast<double>(period_.to_controller) / period.count();
    totals_.frames_from_controller_1_s = static_cast<double>(period_.from_controller) / period.count();
    totals_.foreign_frames_1_s = static_cast<double>(period_.foreign) / period.count();
    totals_.load_1 = period_.busy_us / us_per_s / period.count();
    totals_.peak_load_1 = std::max(totals_.peak_load_1, totals_.load_1);
    totals_.samples_incomplete = samples_.incomplete;
    totals_.answers_incomplete = answers_.incomplete;

    totals_.controller_version =
        fmt::format("{}.{}.{}", status_.version[0], status_.version[1], status_.version[2]);
    totals_.controller_state = hexload_app_state_name(static_cast<hexload_app_state_t>(status_.state));
    totals_.controller_fault = hexload_app_fault_name(static_cast<hexload_app_fault_t>(status_.fault));
    totals_.controller_tick = status_.tick;
    totals_.controller_overruns = status_.overruns;
    totals_.controller_samples_missing = status_.samples_missing;
    totals_.controller_frames_refused = status_.frames_refused;
    totals_.controller_samples_refused = status_.samples_refused;
    totals_.controller_load_changes = status_.load_changes;
    totals_.stack_margin_bytes = status_.stack_margin_bytes;
    totals_.time_margin_us = status_.time_margin_us;
    period_ = {};
    return totals_;
}

} // namespace hexload::bridge
