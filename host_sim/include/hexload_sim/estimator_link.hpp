// The seam between plant and controller: leg samples go out, estimates come back.
#pragma once

#include <hexload_sim/types.hpp>

#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace hexload::sim {

// What the sensors deliver at one tick. The values are exactly representable in float32.
struct LegSample {
    std::uint32_t tick = 0;
    double t_s = 0.0;
    Vector6 displacement_m = Vector6::Zero();
    Vector6 velocity_m_s = Vector6::Zero();
    Vector6 force_n = Vector6::Zero();
};

// Ten load parameters, a bias and two kinds of friction of six legs, and gravity's x and y.
inline constexpr std::size_t parameters_max = 30;

struct EstimateRow {
    double t_s = 0.0;                           // of the sample that it belongs to
    std::array<double, parameters_max> value{}; // the first parameter_names().size() entries are used
    std::array<double, parameters_max> sigma{};
    std::array<double, parameters_max> own_sigma{}; // the filter's part of sigma; zeros from a bus
    double nis = 0.0;
    std::string_view verdict;                           // the worst of the parameters'
    std::array<std::string_view, 10> parameter_verdict; // of the load's parameters
    std::uint32_t health = 0;
};

struct HealthCount {
    std::string name; // as in hexload/types.h
    std::uint32_t ticks = 0;
};

// What is wrong with the channels of the samples, and what to do: in words, with the leg.
struct InputFault {
    double t_s = 0.0; // when it was found
    std::string words;
};

// A load parameter that is confounded with actuator effects.
struct ConfoundedParameter {
    std::string_view name;
    std::string reason;
};

// Why a run over a bus cannot go on.
enum class LinkFailure {
    silent_controller,
    wrong_profile,
    second_controller,
    bus_down,
    controller_fault, // it says that it cannot go on, or answers what was not asked
};

class LinkError : public std::runtime_error {
  public:
    LinkError(LinkFailure failure, const std::string& message)
        : std::runtime_error(message), failure_(failure) {}
    LinkFailure failure() const {
        return failure_;
    }

  private:
    LinkFailure failure_;
};

// Tick accounting of a bus: samples = sent + unsent, answers expected = answers + missing.
struct BusCounts {
    std::string name;
    std::string profile;
    std::string advice;       // against the failures that were counted; empty: none needed
    bool ends_silent = false; // the controller's answers had stopped before the end of the run
    std::uint64_t samples = 0;
    std::uint64_t unsent = 0;    // samples that the bus did not take
    std::uint64_t saturated = 0; // channels that were beyond their signal's range
    std::uint64_t expected = 0;  // answers due to the samples sent
    std::uint64_t answers = 0;
    std::uint64_t missing = 0; // answers that never came whole
    std::uint64_t late = 0;    // answers that were not there when the next tick was sent
    std::uint64_t rejoins = 0; // times that the controller was started again
    std::uint64_t outages = 0; // times that the bus went down
    std::uint64_t frames_sent = 0;
    std::uint64_t frames_received = 0;
    std::uint64_t refused = 0; // frames of a controller that came damaged, twice or late
    std::uint64_t send_retries = 0;
    std::uint64_t send_failures = 0;
    std::uint64_t receive_drops = 0;
    std::uint64_t error_frames = 0;
    std::uint64_t events_missing = 0; // load changes that were counted and not reported
};

// The measurement update of one tick; hexload_trace_t of the firmware says what is measured and its units.
struct UpdateTrace {
    std::uint32_t tick = 0;             // of the measurement, sampling periods
    std::size_t dimension = 0;          // 6 or 3
    std::array<double, 6> innovation{}; // measured minus predicted
    std::array<double, 6> variance{};   // of the innovation, as the filter expects it
    double nis = 0.0;                   // normalised innovation squared
    double sum_nis = 0.0;               // of the sum of the whitened ones over half a second; ideal 6
    double sum_nis_mean = 0.0;          // leaky mean of that
    std::string_view gate;              // none, accepted or rejected; none: the numbers are 0
};

class EstimatorLink {
  public:
    EstimatorLink() = default;
    EstimatorLink(const EstimatorLink&) = delete;
    EstimatorLink& operator=(const EstimatorLink&) = delete;
    virtual ~EstimatorLink() = default;

    virtual std::span<const std::string_view> parameter_names() const = 0;

    // Those of which EstimateRow::own_sigma is another number than sigma. None: the paper's filter has no
    // other, and a bus carries sigma alone.
    virtual std::span<const std::string_view> own_sigma_names() const {
        return {};
    }

    // Before the first sample: makes the estimator ready. Throws LinkError.
    virtual void start() {}

    // Hands over a sample; returns the estimates that have come by now, oldest first. In process and in
    // lockstep that is the sample's own, if it has one; in real time it may be an earlier one's. Nothing:
    // none has come, or the estimator refused the sample. Valid until the next call. Throws LinkError.
    virtual std::span<const EstimateRow> step(const LegSample& sample) = 0;

    // After the last sample: the estimates that were still under way. Throws LinkError.
    virtual std::span<const EstimateRow> finish() {
        return {};
    }

    // Samples that the estimator refused, and the firmware's word for the last refusal.
    virtual std::uint32_t refused() const = 0;
    virtual std::string last_refusal() const = 0;

    // How often each health bit was set since the start, in the firmware's order.
    virtual std::vector<HealthCount> health_counts() const = 0;

    // When the estimator detected a load change, in s since the start of the run.
    virtual std::vector<double> load_changes_s() const = 0;

    // The channels' contradictions that were found, in s since the start of the run.
    virtual std::vector<InputFault> input_faults() const {
        return {};
    }

    // The one at present; empty: none.
    virtual std::string input_fault() const {
        return {};
    }

    // Covariance of the estimates after the last sample, row by row. Empty: this link does not have it.
    virtual std::vector<double> covariance() const {
        return {};
    }

    // Parameters that have not converged because the machine hides them, after the last sample.
    virtual std::vector<ConfoundedParameter> confounded_parameters() const {
        return {};
    }

    // The measurement update of the last sample. Nothing: the sample was refused, or this link has no traces.
    virtual std::optional<UpdateTrace> trace() const {
        return std::nullopt;
    }

    // Nothing: there is no bus.
    virtual std::optional<BusCounts> bus_counts() const {
        return std::nullopt;
    }
};

} // namespace hexload::sim
