#include "estimate_row.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>

namespace hexload::sim {

std::span<const std::string_view> parameter_names(EstimatorKind kind) {
    static constexpr std::array<std::string_view, HEXLOAD_PAPER_DIM> paper = {"dz", "Ixx", "Iyy", "Izz"};
    static constexpr std::array<std::string_view, parameters_max> all = {
        "m",        "hx",       "hy",       "hz",       "Ixx",      "Iyy",      "Izz",
        "Ixy",      "Ixz",      "Iyz",      "bias1",    "bias2",    "bias3",    "bias4",
        "bias5",    "bias6",    "coulomb1", "coulomb2", "coulomb3", "coulomb4", "coulomb5",
        "coulomb6", "viscous1", "viscous2", "viscous3", "viscous4", "viscous5", "viscous6"};
    static_assert(all.size() == std::size_t{HEXLOAD_LOAD_DIM} + std::size_t{HEXLOAD_EFFECTS_DIM});
    switch (kind) {
    case EstimatorKind::paper:
        return paper;
    case EstimatorKind::momentum:
        return std::span(all).first<HEXLOAD_LOAD_DIM>();
    case EstimatorKind::momentum_effects:
        break;
    }
    return all;
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

void add_machine(EstimateRow& row, const hexload_effects_estimate_t& machine) {
    std::copy(std::begin(machine.value), std::end(machine.value), row.value.begin() + HEXLOAD_LOAD_DIM);
    std::copy(std::begin(machine.sigma), std::end(machine.sigma), row.sigma.begin() + HEXLOAD_LOAD_DIM);
}

std::vector<ConfoundedParameter> confounded_parameters(const hexload_effects_estimate_t& machine) {
    const auto names = parameter_names(EstimatorKind::momentum);
    std::vector<ConfoundedParameter> hidden;
    for (std::size_t k = 0; k < names.size(); k++) {
        if ((machine.confounded_with_friction >> k & 1U) != 0) {
            hidden.push_back(
                {names[k], fmt::format("friction and load cannot be separated: no leg faster than "
                                       "{:.2g} m/s of late, or not in enough directions",
                                       machine.fastest_leg_m_s)});
        } else if ((machine.confounded_with_bias >> k & 1U) != 0) {
            hidden.push_back({names[k],
                              "the force sensors' bias and load cannot be separated: too little tilt "
                              "and acceleration of late"});
        }
    }
    return hidden;
}

std::vector<HealthCount> named_health_counts(const std::uint32_t (&count)[HEXLOAD_HEALTH_BITS]) {
    std::vector<HealthCount> counts;
    for (int bit = 0; bit < HEXLOAD_HEALTH_BITS; bit++) {
        counts.push_back({hexload_health_name(static_cast<hexload_health_bit_t>(bit)), count[bit]});
    }
    return counts;
}

} // namespace hexload::sim
