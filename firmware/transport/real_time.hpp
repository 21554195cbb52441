// Rights of a process that keeps a 1 ms clock.
#pragma once

#include <string>

namespace hexload::transport {

struct RealTimeRights {
    bool has_priority = false;      // SCHED_FIFO
    bool has_locked_memory = false; // no page is ever fetched again
};

// Above all that is not real time, below the kernel's own threads at 99; the controller comes before the
// simulator.
inline constexpr int controller_priority = 60;
inline constexpr int simulator_priority = 50;

// Asks for both, the priority for the calling thread and the memory for the process; the system may deny
// each.
RealTimeRights request_real_time(int priority);

// One line for a log: what was had, and the commands that allow what was not.
std::string describe(const RealTimeRights& rights);

} // namespace hexload::transport
