// The firmware's code of an estimator.
#pragma once

#include "platform_file.hpp"

#include <hexload/config.h>

namespace hexload::platform {

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

} // namespace hexload::platform
