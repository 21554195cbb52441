// What a program has printed has arrived, or its exit status says that it has not.
#pragma once

#include <cerrno>
#include <cstdio>
#include <cstring>

namespace hexload::platform {

// Of a program whose standard output is full or gone.
inline constexpr int exit_output_lost = 1;

// The last thing that a program does: its exit status, given the one that it would have otherwise. A failure
// keeps its own.
inline int status_with_output(const char* program, int status) {
    errno = 0;
    const bool is_flushed = std::fflush(stdout) == 0;
    const int fault = errno;
    if (is_flushed && std::ferror(stdout) == 0) {
        return status;
    }
    (void)std::fprintf(stderr, "%s: standard output cannot be written: %s\n", program,
                       fault != 0 ? std::strerror(fault) : "an earlier write failed");
    return status != 0 ? status : exit_output_lost;
}

} // namespace hexload::platform
