#include "estimate_row.hpp"

#include <algorithm>
#include <iterator>

namespace hexload::sim {

std::span<const std::string_view> parameter_names(EstimatorKind kind) {
    static constexpr std::array<std::string_view, HEXLOAD_PAPER_DIM> paper = {"dz", "Ixx", "Iyy", "Izz"};
    static constexpr std::array<std::string_view, HEXLOAD_LOAD_DIM> load = {
        "m", "hx", "hy", "hz", "Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz"};
    if (kind == EstimatorKind::paper) {
        return paper;
    }
    return load;
}

EstimateRow estimate_row(const hexload_estimate_t& estimate, double t_s, std::uint32_t health_bits) {
    EstimateRow row;
    row.t_s = t_s;
    std::copy(std::begin(estimate.value), std::end(estimate.value), row.value.begin());
    std::copy(std::begin(estimate.sigma), std::end(estimate.sigma), row.sigma.begin());
    row.nis = static_cast<double>(estimate.nis);
    row.verdict = hexload_verdict_name(estimate.verdict);
    std::transform(std::begin(estimate.parameter_verdict), std::end(estimate.parameter_verdict),
                   row.parameter_verdict.begin(), hexload_verdict_name);
    row.health = health_bits;
    return row;
}

std::vector<HealthCount> named_health_counts(const std::uint32_t (&count)[HEXLOAD_HEALTH_BITS]) {
    std::vector<HealthCount> counts;
    for (int bit = 0; bit < HEXLOAD_HEALTH_BITS; bit++) {
        counts.push_back({hexload_health_name(static_cast<hexload_health_bit_t>(bit)), count[bit]});
    }
    return counts;
}

} // namespace hexload::sim
