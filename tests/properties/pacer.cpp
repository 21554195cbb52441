#include <hexload_sim/pacer.hpp>

#include <doctest/doctest.h>

#include <vector>

using namespace hexload::sim;
using namespace std::chrono_literals;
using std::chrono::nanoseconds;

namespace {

// Time passes only when somebody sleeps or works; sleeping ends `oversleep` late.
class SlowClock final : public PacingClock {
  public:
    nanoseconds now() override {
        return now_;
    }
    void sleep_until(nanoseconds time) override {
        slept_until.push_back(time);
        now_ = time + oversleep;
    }
    void work(nanoseconds duration) {
        now_ += duration;
    }

    nanoseconds oversleep{};
    std::vector<nanoseconds> slept_until;

  private:
    nanoseconds now_ = 7s;
};

} // namespace

SCENARIO("ticks that are done in time begin on multiples of the period") {
    GIVEN("a clock that wakes 30 us late and ticks of 400 us") {
        SlowClock clock;
        clock.oversleep = 30us;
        Pacer pacer(clock);
        WHEN("five ticks are run") {
            for (int tick = 0; tick < 5; ++tick) {
                pacer.wait();
                clock.work(400us);
            }
            THEN("lateness does not add up") {
                CHECK(clock.slept_until == std::vector<nanoseconds>{7s + 1ms, 7s + 2ms, 7s + 3ms, 7s + 4ms});
            }
            THEN("every tick is accounted for, none as an overrun") {
                CHECK(pacer.counts().periods == 5);
                CHECK(pacer.counts().overruns == 0);
                CHECK(pacer.counts().lateness.count() == 5);
                CHECK(pacer.counts().lateness.longest_us() == 30);
                CHECK(pacer.counts().work.quantile_us(0.5) == 400);
            }
        }
    }
}

SCENARIO("a tick that takes too long makes later ones late, and none is lost or shifted") {
    GIVEN("six ticks of 100 us, of which the second takes 3.5 ms") {
        SlowClock clock;
        Pacer pacer(clock);
        WHEN("they are run") {
            std::vector<nanoseconds> begins;
            for (int tick = 0; tick < 6; ++tick) {
                pacer.wait();
                begins.push_back(clock.now() - 7s);
                clock.work(tick == 1 ? nanoseconds(3500us) : nanoseconds(100us));
            }
            THEN("the three that were due meanwhile follow at once, and the sixth keeps its time") {
                CHECK(begins == std::vector<nanoseconds>{0ms, 1ms, 4500us, 4600us, 4700us, 5ms});
            }
            THEN("each late one is counted, with how late it was") {
                CHECK(pacer.counts().periods == 6);
                CHECK(pacer.counts().overruns == 3);
                CHECK(pacer.counts().lateness.longest_us() == 2500);
                CHECK(pacer.counts().work.longest_us() == 3500);
            }
        }
    }
}

SCENARIO("quantiles of durations are exact to the microsecond") {
    GIVEN("the durations 1 us to 1000 us") {
        DurationHistogram histogram;
        for (int us = 1; us <= 1000; ++us) {
            histogram.add(std::chrono::microseconds(us) + 999ns); // rounded down
        }
        WHEN("quantiles are read") {
            THEN("half of them do not exceed the 500th, and so on") {
                CHECK(histogram.quantile_us(0.5) == 500);
                CHECK(histogram.quantile_us(0.9) == 900);
                CHECK(histogram.quantile_us(0.999) == 999);
                CHECK(histogram.quantile_us(1.0) == 1000);
            }
        }
        WHEN("one of a second is added") {
            histogram.add(1s);
            THEN("it counts, and is the longest") {
                CHECK(histogram.count() == 1001);
                CHECK(histogram.quantile_us(0.5) == 501);
                CHECK(histogram.quantile_us(1.0) == 1'000'000);
                CHECK(histogram.longest_us() == 1'000'000);
            }
        }
    }
    GIVEN("nothing") {
        const DurationHistogram histogram;
        WHEN("a quantile is read") {
            THEN("it is zero") {
                CHECK(histogram.quantile_us(0.5) == 0);
            }
        }
    }
}
