// The messages that lcm-gen makes of lcm_types/*.lcm, in C++ by their names alone.
#pragma once

namespace hexload_lcm {} // namespace hexload_lcm
namespace hexload {
using namespace hexload_lcm;
}
