// The estimator on a controller that is fed over LCM.
#pragma once

#include "bus_link.hpp"

namespace hexload::sim {

// Both throw message::SessionError when LCM cannot be used, as lcm_types/include/hexload_lcm/session.hpp
// says.
std::unique_ptr<EstimatorLink> make_lockstep_lcm_link(const std::string& url, const LinkSettings& settings);
std::unique_ptr<EstimatorLink> make_real_time_lcm_link(const std::string& url, const LinkSettings& settings);

} // namespace hexload::sim
