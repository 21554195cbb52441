#include "support.hpp"

#include <hexload_sim/sensors.hpp>

#include <cmath>

using namespace hexload::sim;
using namespace hexload::sim::test;

namespace {

constexpr SensorSigma unit_sigma{20e-6, 1e-3, 5.0};
constexpr std::uint32_t ticks = 20000;

LegState at(double value) {
    return {Legs::Constant(value), Legs::Constant(value), Legs::Constant(value)};
}

SensorSettings silent() {
    SensorSettings settings;
    settings.noise_scale = 0.0;
    return settings;
}

struct Statistics {
    double mean = 0.0;
    double sigma = 0.0;
    double neighbours = 0.0; // correlation of one tick with the next
};

// Of one leg's force, the truth being zero.
Statistics statistics_of(Sensors sensors) {
    double sum = 0.0;
    double squares = 0.0;
    double products = 0.0;
    double before = 0.0;
    for (std::uint32_t tick = 0; tick < ticks; ++tick) {
        const double force_n = sensors.sample(tick, LegState{}).value().force_n(2);
        sum += force_n;
        squares += force_n * force_n;
        products += force_n * before;
        before = force_n;
    }
    return {sum / ticks, std::sqrt(squares / ticks), products / squares};
}

} // namespace

SCENARIO("noise is white and has the platform file's standard deviation") {
    GIVEN("20,000 samples, noise twice the nominal") {
        SensorSettings settings;
        settings.noise_scale = 2.0;
        const Statistics found = statistics_of(Sensors(settings, unit_sigma, 7));
        // Five standard errors of each statistic: sigma/sqrt(n), sigma/sqrt(2 n), 1/sqrt(n).
        WHEN("mean, deviation and correlation are estimated") {
            THEN("they are 0, 2 x 5 N and 0") {
                CHECK(std::abs(found.mean) < 5.0 * 10.0 / std::sqrt(ticks));
                CHECK(std::abs(found.sigma - 10.0) < 5.0 * 10.0 / std::sqrt(2.0 * ticks));
                CHECK(std::abs(found.neighbours) < 5.0 / std::sqrt(ticks));
            }
        }
    }
}

SCENARIO("a noise-free sensor delivers the truth rounded to float32") {
    GIVEN("no noise and a value that float32 cannot hold") {
        Sensors sensors(silent(), unit_sigma, 1);
        WHEN("it is sampled") {
            const LegSample sample = sensors.sample(3, at(0.1)).value();
            THEN("it is the nearest float32, at t = tick / 1000") {
                const Vector6 nearest = Vector6::Constant(static_cast<double>(0.1F));
                CHECK(sample.displacement_m == nearest);
                CHECK(sample.velocity_m_s == nearest);
                CHECK(sample.force_n == nearest);
                CHECK(sample.t_s == 0.003);
                CHECK(sample.tick == 3);
            }
        }
    }
}

SCENARIO("bias, quantisation and delay are applied in this order of nature") {
    GIVEN("a bias on leg 2 and steps of 0.25") {
        SensorSettings settings = silent();
        settings.force_bias_n(1) = 0.5;
        settings.force_step_n = 0.25;
        Sensors sensors(settings, unit_sigma, 1);
        WHEN("1.1 N is measured") {
            const LegSample sample = sensors.sample(0, at(1.1)).value();
            THEN("leg 1 reads 1.0 and leg 2 reads 1.5") {
                CHECK(sample.force_n(0) == 1.0);
                CHECK(sample.force_n(1) == 1.5);
            }
        }
    }
    GIVEN("a delay of two ticks") {
        SensorSettings settings = silent();
        settings.delay_ticks = 2;
        Sensors sensors(settings, unit_sigma, 1);
        WHEN("the truth counts ticks from ten") {
            THEN("the first value is repeated until the third tick brings it") {
                for (std::uint32_t tick = 0; tick < 8; ++tick) {
                    const double seen = sensors.sample(tick, at(10.0 + tick)).value().force_n(0);
                    CHECK(seen == 10.0 + (tick < 2 ? 0.0 : tick - 2.0));
                }
            }
        }
    }
}

SCENARIO("whole samples are lost with the wanted probability, and the others do not change") {
    GIVEN("one sensor set that loses 5 % and one that loses none, of one seed") {
        SensorSettings lossy;
        lossy.dropout_probability = 0.05;
        Sensors losing(lossy, unit_sigma, 9);
        Sensors keeping(SensorSettings{}, unit_sigma, 9);
        WHEN("20,000 ticks are sampled") {
            std::uint32_t lost = 0;
            bool same = true;
            for (std::uint32_t tick = 0; tick < ticks; ++tick) {
                const auto found = losing.sample(tick, LegState{});
                const auto expected = keeping.sample(tick, LegState{});
                lost += found ? 0U : 1U;
                same = same && (!found || found->force_n == expected->force_n);
            }
            THEN("the share lost is 5 %, within five binomial standard deviations") {
                CHECK(std::abs(lost - 0.05 * ticks) < 5.0 * std::sqrt(0.05 * 0.95 * ticks));
            }
            THEN("the samples that arrive are the same") {
                CHECK(same);
            }
        }
    }
}
