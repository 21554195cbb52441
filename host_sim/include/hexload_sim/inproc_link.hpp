// The estimator's firmware in this process: what a controller on the bus would compute, without the bus.
#pragma once

#include <hexload_sim/estimator_link.hpp>
#include <hexload_sim/platform_file.hpp>

#include <memory>

namespace hexload::sim {

// Starts an estimator for samples that are sampling_s apart. Throws InputError where the platform file lacks
// what the estimator needs: a known load mass for the paper's filter, a home pose; or where this version
// lacks the estimator.
std::unique_ptr<EstimatorLink>
make_inproc_link(const PlatformFile& platform, const EstimatorSettings& settings, double sampling_s = tick_s);

} // namespace hexload::sim
