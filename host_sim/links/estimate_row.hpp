// From the firmware's estimate to the row of the estimates file.
#pragma once

#include "platform_file/platform_file.hpp"

#include <hexload/hexload.h>
#include <hexload_sim/estimator_link.hpp>

#include <vector>

namespace hexload::sim {

// In the order of the firmware's arrays.
std::span<const std::string_view> parameter_names(EstimatorKind kind);

// Those of them that answers on a bus carry: the load's.
std::span<const std::string_view> load_parameter_names(EstimatorKind kind);

EstimateRow estimate_row(const hexload_estimate_t& estimate, double t_s, std::uint32_t health_bits);

// Puts the machine's effects behind the load's parameters.
void add_effects(EstimateRow& row, const hexload_effects_estimate_t& effects);

std::vector<ConfoundedParameter> confounded_parameters(const hexload_effects_estimate_t& effects);

std::vector<HealthCount> named_health_counts(const std::uint32_t (&count)[HEXLOAD_HEALTH_BITS]);

// Input faults as they come and go.
class InputFaultBook {
  public:
    void note(double t_s, const hexload_input_fault_t& fault);

    const std::vector<InputFault>& all() const {
        return all_;
    }
    // At present.
    std::string words() const;

  private:
    hexload_input_fault_t fault_{HEXLOAD_INPUT_PLAUSIBLE, HEXLOAD_LEGS, 0};
    std::vector<InputFault> all_;
};

} // namespace hexload::sim
