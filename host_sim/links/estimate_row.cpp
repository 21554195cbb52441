#include "estimate_row.hpp"

#include "platform_file/estimator_code.hpp"
#include "transport/input_fault_words.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <iterator>

namespace hexload::sim {

static_assert(parameters_max == HEXLOAD_UNKNOWNS_MAX);

std::span<const std::string_view> parameter_names(EstimatorKind kind) {
    using Names = std::vector<std::string_view>;
    static const auto all = [] {
        std::array<Names, HEXLOAD_KINDS> names;
        for (std::size_t code = 0; code < names.size(); code++) {
            const hexload_descriptor_t& descriptor = *hexload_describe(static_cast<hexload_kind_t>(code));
            for (std::uint32_t k = 0; k < descriptor.parameters + descriptor.effects; k++) {
                names[code].emplace_back(descriptor.unknown[k].name);
            }
        }
        return names;
    }();
    return all[kind_of(kind)];
}

std::span<const std::string_view> load_parameter_names(EstimatorKind kind) {
    return parameter_names(kind).first(hexload_describe(kind_of(kind))->parameters);
}

EstimateRow estimate_row(const hexload_estimate_t& estimate, double t_s, std::uint32_t health_bits) {
    EstimateRow row;
    row.t_s = t_s;
    std::copy(std::begin(estimate.value), std::end(estimate.value), row.value.begin());
    std::copy(std::begin(estimate.sigma), std::end(estimate.sigma), row.sigma.begin());
    std::copy(std::begin(estimate.own_sigma), std::end(estimate.own_sigma), row.own_sigma.begin());
    row.nis = static_cast<double>(estimate.nis);
    row.verdict = hexload_verdict_name(estimate.verdict);
    std::transform(std::begin(estimate.parameter_verdict), std::end(estimate.parameter_verdict),
                   row.parameter_verdict.begin(), hexload_verdict_name);
    row.health = health_bits;
    return row;
}

void add_effects(EstimateRow& row, const hexload_effects_estimate_t& effects) {
    std::copy(std::begin(effects.value), std::end(effects.value), row.value.begin() + HEXLOAD_LOAD_DIM);
    for (auto* sigma : {&row.sigma, &row.own_sigma}) {
        std::copy(std::begin(effects.sigma), std::end(effects.sigma), sigma->begin() + HEXLOAD_LOAD_DIM);
    }
}

std::vector<ConfoundedParameter> confounded_parameters(const hexload_effects_estimate_t& effects) {
    const auto names = parameter_names(EstimatorKind::momentum);
    std::vector<ConfoundedParameter> confounded;
    for (std::size_t k = 0; k < names.size(); k++) {
        if ((effects.confounded_with_friction >> k & 1U) != 0) {
            confounded.push_back(
                {names[k], fmt::format("friction and load cannot be separated: no leg faster than "
                                       "{:.2g} m/s of late, or not in enough directions",
                                       effects.fastest_leg_m_s)});
        } else if ((effects.confounded_with_bias >> k & 1U) != 0) {
            confounded.push_back({names[k],
                                  "the force sensors' bias and load cannot be separated: too little tilt "
                                  "and acceleration of late"});
        } else if ((effects.confounded_with_tilt >> k & 1U) != 0) {
            confounded.push_back({names[k],
                                  "the base's tilt and load cannot be separated: too little rotation of the "
                                  "platform of late"});
        }
    }
    return confounded;
}

std::vector<HealthCount> named_health_counts(const std::uint32_t (&count)[HEXLOAD_HEALTH_BITS]) {
    std::vector<HealthCount> counts;
    counts.reserve(HEXLOAD_HEALTH_BITS);
    for (int bit = 0; bit < HEXLOAD_HEALTH_BITS; bit++) {
        counts.push_back({hexload_health_name(static_cast<hexload_health_bit_t>(bit)), count[bit]});
    }
    return counts;
}

void InputFaultBook::note(double t_s, const hexload_input_fault_t& fault) {
    const bool is_new = fault.cause != fault_.cause || fault.leg != fault_.leg;
    fault_ = fault;
    if (is_new && fault.cause != HEXLOAD_INPUT_PLAUSIBLE) {
        all_.push_back({t_s, words()});
    } else if (fault.cause != HEXLOAD_INPUT_PLAUSIBLE) { // a force that is too much becomes known, and larger
        all_.back().words = words();
    }
}

std::string InputFaultBook::words() const {
    return transport::input_fault_words(fault_);
}

} // namespace hexload::sim
