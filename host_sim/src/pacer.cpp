#include <hexload_sim/pacer.hpp>

#include <algorithm>
#include <cerrno>
#include <cmath>

#include <time.h>

namespace hexload::sim {

using std::chrono::nanoseconds;

std::string_view name_of(Pacing pacing) {
    switch (pacing) {
    case Pacing::free_running:
        return "free_running";
    case Pacing::lockstep:
        return "lockstep";
    case Pacing::real_time:
        break;
    }
    return "real_time";
}

void DurationHistogram::add(nanoseconds duration) {
    const std::int64_t us =
        std::max<std::int64_t>(0, std::chrono::floor<std::chrono::microseconds>(duration).count());
    ++count_;
    longest_us_ = std::max(longest_us_, us);
    if (const auto bucket = static_cast<std::size_t>(us); bucket < buckets) {
        ++buckets_[bucket];
    }
}

std::int64_t DurationHistogram::quantile_us(double share) const {
    const auto wanted = static_cast<std::uint64_t>(std::ceil(share * static_cast<double>(count_)));
    std::uint64_t seen = 0;
    for (std::size_t bucket = 0; bucket < buckets; ++bucket) {
        seen += buckets_[bucket];
        if (seen >= wanted && seen > 0) {
            return static_cast<std::int64_t>(bucket);
        }
    }
    return longest_us_;
}

nanoseconds MonotonicClock::now() {
    timespec time{};
    clock_gettime(CLOCK_MONOTONIC, &time);
    return std::chrono::seconds(time.tv_sec) + nanoseconds(time.tv_nsec);
}

void MonotonicClock::sleep_until(nanoseconds time) {
    const auto whole = std::chrono::floor<std::chrono::seconds>(time);
    timespec until{};
    until.tv_sec = whole.count();
    until.tv_nsec = (time - whole).count();
    while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr) == EINTR) {
    }
}

void Pacer::wait() {
    nanoseconds now = clock_.now();
    if (counts_.periods == 0) {
        due_ = now;
    } else {
        counts_.work.add(now - begin_);
        due_ += period_;
        if (now > due_) {
            ++counts_.overruns;
        } else {
            clock_.sleep_until(due_);
            now = clock_.now();
        }
    }
    counts_.lateness.add(now - due_);
    begin_ = now;
    ++counts_.periods;
}

} // namespace hexload::sim
