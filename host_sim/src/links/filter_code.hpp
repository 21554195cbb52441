// An estimator's code on the bus.
#pragma once

#include "bus/bus.h"

#include <hexload_sim/platform_file.hpp>

namespace hexload::sim {

constexpr hexload_bus_filter_t filter_of(EstimatorKind kind) {
    return kind == EstimatorKind::paper ? HEXLOAD_FILTER_PAPER : HEXLOAD_FILTER_MOMENTUM;
}

} // namespace hexload::sim
