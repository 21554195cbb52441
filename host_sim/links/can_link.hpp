// The estimator on a controller at the other end of a CAN bus.
#pragma once

#include "bus_link.hpp"

#include "transport/can_channel.hpp"
#include "transport/key.hpp"

#include <optional>

namespace hexload::sim {

struct CanLinkSettings : LinkSettings {
    hexload_bus_profile_t profile = HEXLOAD_BUS_FD;
    // The controller's, for commands; nothing: it has none.
    std::optional<transport::Key> key;
    // With the key: samples have codes too.
    bool has_sample_codes = false;
    // With the key: answers must have codes too.
    bool has_answer_codes = false;
};

// In the classic profile only every HEXLOAD_BUS_ANSWER_PERIOD-th tick is answered, with one page of an
// estimate.
std::unique_ptr<EstimatorLink> make_lockstep_link(std::unique_ptr<transport::CanChannel> channel,
                                                  const CanLinkSettings& settings);
std::unique_ptr<EstimatorLink> make_real_time_link(std::unique_ptr<transport::CanChannel> channel,
                                                   const CanLinkSettings& settings);

} // namespace hexload::sim
