// hexload_soak SCENARIO.toml SECONDS SEED: simulator and momentum estimator in one loop for hours, in
// constant memory and without files. Prints a JSON object for each tenth of the time and one at the end;
// `hexload soak` reads them.
#include "links/firmware_sample.hpp"
#include "platform_file/firmware_config.hpp"
#include "platform_file/input_error.hpp"
#include "platform_file/standard_output.hpp"

#include <hexload_sim/scaled_machine.hpp>
#include <hexload_sim/scenario.hpp>
#include <hexload_sim/simulator.hpp>

#include <Eigen/Cholesky>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace {

namespace platform = hexload::platform;
namespace sim = hexload::sim;

constexpr int exit_bad_input = 2;
constexpr std::uint32_t ticks_per_look = 1000;   // at the whole covariance
constexpr std::uint32_t settling_ticks = 60'000; // the start is not judged: an unlucky one is begun again
constexpr std::uint32_t reports = 10;
constexpr Eigen::Index parameters = HEXLOAD_LOAD_DIM;
constexpr Eigen::Index states = HEXLOAD_MOMENTUM_STATES;

using Parameters = Eigen::Matrix<double, parameters, 1>;
using Covariance = Eigen::Matrix<double, states, states>;

Covariance covariance_of(const hexload_momentum_filter_t& filter) {
    Covariance matrix;
    for (Eigen::Index row = 0; row < states; ++row) {
        for (Eigen::Index column = 0; column <= row; ++column) {
            const Eigen::Index a = row - parameters;
            const hexload_real_t value = row < parameters      ? filter.load_cov[row][column]
                                         : column < parameters ? filter.cross_cov[a][column]
                                                               : filter.momentum_cov[a][column - parameters];
            matrix(row, column) = static_cast<double>(value);
            matrix(column, row) = matrix(row, column);
        }
    }
    return matrix;
}

// What the loop has seen since the filter has settled.
struct Soak {
    double tick_s = 0.0;
    std::uint32_t ticks = 0;               // of the whole run
    std::uint32_t restarts_before = 0;     // of the filter, while it settled
    std::uint64_t bad_variances = 0;       // of any state in any tick: not positive, or no number
    std::uint32_t inconsistent_ticks = 0;  // verdicts
    double smallest_pivot = 1.0;           // of the correlations of all states: at 0 the covariance is none
    double largest_error_sigmas = 0.0;     // of any parameter
    double nees = 0.0;                     // at the last look; ideal 10
    Parameters sigma = Parameters::Zero(); // likewise
};

void look_at_tick(const hexload_t& estimator, const hexload_estimate_t& estimate, Soak& soak) {
    for (Eigen::Index state = 0; state < states; ++state) {
        const Eigen::Index a = state - parameters;
        const hexload_momentum_filter_t& filter = estimator.as.momentum.filter;
        const auto variance = static_cast<double>(state < parameters ? filter.load_cov[state][state]
                                                                     : filter.momentum_cov[a][a]);
        soak.bad_variances += variance > 0.0 && std::isfinite(variance) ? 0u : 1u;
    }
    soak.inconsistent_ticks += estimate.verdict == HEXLOAD_VERDICT_INCONSISTENT ? 1u : 0u;
}

void look_at_covariance(const hexload_t& estimator, const Parameters& truth, Soak& soak) {
    const Covariance P = covariance_of(estimator.as.momentum.filter);
    const Eigen::Matrix<double, states, 1> scale = P.diagonal().array().rsqrt();
    const Covariance correlation = scale.asDiagonal() * P * scale.asDiagonal();
    const Eigen::LDLT<Covariance> factor(correlation);
    soak.smallest_pivot = std::min(soak.smallest_pivot, factor.vectorD().minCoeff());
    Parameters error;
    for (Eigen::Index k = 0; k < parameters; ++k) {
        error[k] = static_cast<double>(estimator.as.momentum.filter.theta[k]) - truth[k];
    }
    const auto P_tt = P.topLeftCorner<parameters, parameters>();
    soak.sigma = P_tt.diagonal().array().sqrt();
    soak.nees = error.dot(P_tt.ldlt().solve(error));
    soak.largest_error_sigmas =
        std::max(soak.largest_error_sigmas, (error.array().abs() / soak.sigma.array()).maxCoeff());
}

void print_report(const hexload_t& estimator, const Soak& soak, bool is_last) {
    const std::uint32_t* count = hexload_health(&estimator)->count;
    const Eigen::Array<double, parameters, 1> sigma = soak.sigma.array();
    fmt::print(
        "{{\"t_s\": {:.3f}, \"nees\": {:.6g}, \"largest_error_sigmas\": {:.6g}, \"sigma\": [{:.6g}], "
        "\"smallest_pivot\": {:.6g}, \"bad_variances\": {}, \"inconsistent_ticks\": {}, "
        "\"load_changes\": {}, \"restarts\": {}, \"misstated_ticks\": {}, \"refused\": {}, \"last\": {}}}\n",
        soak.ticks * soak.tick_s, soak.nees, soak.largest_error_sigmas,
        fmt::join(sigma.data(), sigma.data() + parameters, ", "), soak.smallest_pivot, soak.bad_variances,
        soak.inconsistent_ticks, count[HEXLOAD_HEALTH_LOAD_CHANGED],
        count[HEXLOAD_HEALTH_FILTER_RESTARTED] - soak.restarts_before, count[HEXLOAD_HEALTH_NOISE_MISSTATED],
        hexload_health(&estimator)->refused, is_last);
    (void)std::fflush(stdout);
}

void soak(const sim::Scenario& scenario) {
    const platform::PlatformFile platform = platform::load_platform_file(scenario.platform);
    platform::EstimatorSettings settings = platform.estimator;
    settings.kind = platform::EstimatorKind::momentum;
    const hexload_config_t config =
        platform::checked_firmware_config(platform, settings, platform.sensors.tick_s);
    const double settling_s = settling_ticks * platform.sensors.tick_s;
    if (!(scenario.duration_s > settling_s) || scenario.duration_s > sim::duration_max_s) {
        throw platform::InputError(
            fmt::format("duration: found {} s, expected more than {} s, in which the filter settles",
                        scenario.duration_s, settling_s));
    }
    sim::Simulator simulator(platform, scenario);
    static hexload_t estimator;
    if (const hexload_status_t status = hexload_init(&estimator, &config); status != HEXLOAD_OK) {
        throw platform::InputError(hexload_status_name(status));
    }
    const std::uint32_t report_ticks = std::max(1u, (simulator.ticks() - 1) / reports);
    Soak soak{.tick_s = simulator.tick_s()};
    while (soak.ticks < simulator.ticks()) {
        const sim::Tick tick = simulator.step();
        ++soak.ticks;
        if (tick.sample) {
            const hexload_leg_sample_t sample = sim::firmware_sample(*tick.sample);
            hexload_estimate_t estimate;
            if (hexload_tick(&estimator, &config, &sample, &estimate) == HEXLOAD_OK) {
                if (soak.ticks > settling_ticks) {
                    look_at_tick(estimator, estimate, soak);
                }
            }
        }
        if (soak.ticks == settling_ticks) {
            soak.restarts_before = hexload_health(&estimator)->count[HEXLOAD_HEALTH_FILTER_RESTARTED];
        }
        const bool is_last = soak.ticks == simulator.ticks();
        if (soak.ticks > settling_ticks && ((soak.ticks - 1) % ticks_per_look == 0 || is_last)) {
            look_at_covariance(estimator, simulator.load().theta(), soak);
        }
        if (soak.ticks > settling_ticks && ((soak.ticks - 1) % report_ticks == 0 || is_last)) {
            print_report(estimator, soak, is_last);
        }
    }
}

} // namespace

int main(int argc, char** argv) {
    if (argc != 4) {
        fmt::print(stderr, "hexload_soak: found {} arguments, expected a scenario file, seconds and a seed\n",
                   argc - 1);
        return exit_bad_input;
    }
    try {
        sim::Scenario scenario = sim::load_scenario(argv[1]);
        scenario.duration_s = std::stod(argv[2]);
        scenario.seed = std::stoll(argv[3]);
        sim::suit_default_servo(scenario, platform::load_platform_file(scenario.platform));
        soak(scenario);
    } catch (const std::exception& error) {
        fmt::print(stderr, "hexload_soak: {}\n", error.what());
        return exit_bad_input;
    }
    return platform::status_with_output("hexload_soak", 0);
}
