// meta.json of a run directory.
#pragma once

#include <hexload_sim/run_directory.hpp>

#include <string>

namespace hexload::sim {

std::string run_meta_json(const Scenario& scenario, const PlatformFile& platform, const Simulator& simulator,
                          const RunResult& result);

} // namespace hexload::sim
