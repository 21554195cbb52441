// The loop of the virtual controller: one thread that waits for its feed, its 1 ms clock and the signals that
// end it.
#pragma once

#include "feed.hpp"

namespace hexload::port {

enum class EcuEnd {
    signal, // SIGINT or SIGTERM
    taken,  // another controller is on the bus
};

// Prints the ready line, a line per change of state, and a summary at the end on stdout. `quiet`: of these
// only the ready line and faults. Block SIGINT and SIGTERM in all threads beforehand.
EcuEnd run_ecu(Feed& feed, bool quiet);

} // namespace hexload::port
