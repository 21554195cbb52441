// The estimator's firmware in this process: what a controller on the bus would compute, without the bus.
#pragma once

#include <hexload_sim/estimator_link.hpp>
#include <hexload_sim/platform_file.hpp>

#include <memory>
#include <string>
#include <vector>

namespace hexload::sim {

struct HealthCount {
    std::string name; // as in hexload/status.h
    std::uint32_t ticks = 0;
};

class InprocLink : public EstimatorLink {
  public:
    // How often each health bit was set since the start, in the firmware's order.
    virtual std::vector<HealthCount> health_counts() const = 0;

    // Samples that step() refused, and the firmware's word for the last refusal.
    virtual std::uint32_t refused() const = 0;
    virtual std::string last_refusal() const = 0;
};

// Starts an estimator for samples that are sampling_s apart. Throws InputError where the platform file lacks what the
// estimator needs: a known load mass for the paper's filter, a home pose; or where this version lacks the estimator.
std::unique_ptr<InprocLink> make_inproc_link(const PlatformFile& platform, const EstimatorSettings& settings,
                                             double sampling_s = tick_s);

} // namespace hexload::sim
