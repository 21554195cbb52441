// Real time: ticks on an absolute clock, with an account of every one that was not kept.
//
// Period n begins at the first wait() + n periods, whatever happened before: a tick that takes too long makes
// the next ones late until they have caught up, each is counted, and none is dropped or shifted.
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <string_view>

namespace hexload::sim {

enum class Pacing {
    free_running, // as fast as the ticks are done
    lockstep,     // as fast as the controller answers
    real_time,
};

std::string_view name_of(Pacing pacing);

// Durations in whole microseconds, exact to 10 ms; of longer ones only the longest is known.
class DurationHistogram {
  public:
    void add(std::chrono::nanoseconds duration); // negative: counts as zero
    std::uint64_t count() const {
        return count_;
    }
    // The smallest duration that at least `share` (0..1) of all do not exceed, rounded down; 0 without any.
    std::int64_t quantile_us(double share) const;
    std::int64_t longest_us() const {
        return longest_us_;
    }

  private:
    static constexpr std::size_t buckets = 10'000;
    std::array<std::uint64_t, buckets> buckets_{};
    std::uint64_t count_ = 0;
    std::int64_t longest_us_ = 0;
};

// A clock to wait by; tests have one of their own.
class PacingClock {
  public:
    PacingClock() = default;
    PacingClock(const PacingClock&) = delete;
    PacingClock& operator=(const PacingClock&) = delete;
    virtual ~PacingClock() = default;
    virtual std::chrono::nanoseconds now() = 0;
    virtual void sleep_until(std::chrono::nanoseconds time) = 0;
};

// The machine's monotonic clock, slept on with an absolute deadline.
class MonotonicClock final : public PacingClock {
  public:
    std::chrono::nanoseconds now() override;
    void sleep_until(std::chrono::nanoseconds time) override;
};

struct PacingCounts {
    std::uint64_t periods = 0;
    std::uint64_t overruns = 0; // ticks that were not done when the next one was due
    DurationHistogram lateness; // from when a period was due to when it began
    DurationHistogram work;     // from when a period began to when it was done
};

class Pacer {
  public:
    explicit Pacer(PacingClock& clock, std::chrono::nanoseconds period = std::chrono::milliseconds(1))
        : clock_(clock), period_(period) {}

    // Call at the begin of each tick: returns when the tick is due, or at once when that is past.
    void wait();

    const PacingCounts& counts() const {
        return counts_;
    }

  private:
    PacingClock& clock_;
    std::chrono::nanoseconds period_;
    std::chrono::nanoseconds due_{};
    std::chrono::nanoseconds begin_{};
    PacingCounts counts_;
};

// How a run was paced.
struct PacingResult {
    Pacing mode = Pacing::free_running;
    const PacingCounts* counts = nullptr; // in real time
    bool has_priority = false;            // real-time scheduling
    bool has_locked_memory = false;
};

} // namespace hexload::sim
