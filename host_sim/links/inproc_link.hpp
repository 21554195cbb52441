// The estimator's firmware in this process: what a controller on the bus would compute, without the bus.
#pragma once

#include "platform_file/platform_file.hpp"
#include "platform_file/tare.hpp"

#include <hexload_sim/estimator_link.hpp>

#include <memory>
#include <optional>

namespace hexload::sim {

enum class Traces { no, yes };

// Starts an estimator for samples that are sampling_s apart. Throws InputError where the platform file lacks
// what the estimator needs: a known load mass for the paper's filter, a home pose. With a tare the platform
// is the platform file's and the tare's together, and the sigmas include the tare's uncertainty. With traces
// the link has trace().
std::unique_ptr<EstimatorLink> make_inproc_link(const PlatformFile& platform,
                                                const EstimatorSettings& settings, double sampling_s,
                                                const std::optional<Tare>& tare = std::nullopt,
                                                Traces traces = Traces::no);

} // namespace hexload::sim
