// The firmware's code of an estimator.
#pragma once

#include <hexload/config.h>
#include <hexload_sim/platform_file.hpp>

namespace hexload::sim {

constexpr hexload_kind_t kind_of(EstimatorKind kind) {
    switch (kind) {
    case EstimatorKind::paper:
        return HEXLOAD_KIND_PAPER;
    case EstimatorKind::momentum_effects:
        return HEXLOAD_KIND_MOMENTUM_EFFECTS;
    case EstimatorKind::momentum:
        break;
    }
    return HEXLOAD_KIND_MOMENTUM;
}

} // namespace hexload::sim
