// The seam between plant and controller: leg samples go out, estimates come back.
#pragma once

#include <hexload_sim/types.hpp>

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <string_view>

namespace hexload::sim {

// What the sensors deliver at one tick. The values are exactly representable in float32.
struct LegSample {
    std::uint32_t tick = 0;
    double t_s = 0.0;
    Vector6 displacement_m = Vector6::Zero();
    Vector6 velocity_m_s = Vector6::Zero();
    Vector6 force_n = Vector6::Zero();
};

struct EstimateRow {
    double t_s = 0.0;
    std::array<double, 10> value{}; // the first parameter_names().size() entries are used
    std::array<double, 10> sigma{};
    double nis = 0.0;
    std::string_view verdict;
    std::uint32_t health = 0;
};

class EstimatorLink {
  public:
    EstimatorLink() = default;
    EstimatorLink(const EstimatorLink&) = delete;
    EstimatorLink& operator=(const EstimatorLink&) = delete;
    virtual ~EstimatorLink() = default;

    virtual std::span<const std::string_view> parameter_names() const = 0;

    // Nothing: the estimator refused the sample.
    virtual std::optional<EstimateRow> step(const LegSample& sample) = 0;
};

} // namespace hexload::sim
