#include "real_time.hpp"

#include <sched.h>
#include <sys/mman.h>

namespace hexload::transport {

RealTimeRights request_real_time(int priority) {
    sched_param parameters{};
    parameters.sched_priority = priority;
    return {.has_priority = sched_setscheduler(0, SCHED_FIFO, &parameters) == 0,
            .has_locked_memory = mlockall(MCL_CURRENT | MCL_FUTURE) == 0};
}

std::string describe(const RealTimeRights& rights) {
    std::string text =
        rights.has_priority ? "real-time priority" : "no real-time priority (allowed by ulimit -r 60)";
    text +=
        rights.has_locked_memory ? ", locked memory" : ", memory not locked (allowed by ulimit -l unlimited)";
    return text;
}

} // namespace hexload::transport
