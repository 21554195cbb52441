#include "bindings.hpp"

#include "links/estimate_file.hpp"
#include "links/inproc_link.hpp"
#include "platform_file/input_error.hpp"

#include "links/firmware_sample.hpp"
#include "platform_file/config_initialiser.hpp"
#include "platform_file/estimator_code.hpp"
#include "platform_file/firmware_config.hpp"
#include "links/load_body.hpp"

#include "front_end/kinematics.h"

#include <nanobind/eigen/dense.h>
#include <nanobind/ndarray.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <limits>
#include <memory>

namespace nb = nanobind;
using namespace hexload::sim;

namespace {

using Column = nb::ndarray<const double, nb::shape<-1>, nb::c_contig, nb::device::cpu>;
using LegColumns = nb::ndarray<const double, nb::shape<-1, 6>, nb::c_contig, nb::device::cpu>;

EstimatorSettings override_settings(EstimatorSettings settings, const std::optional<std::string>& estimator,
                                    const std::optional<std::string>& prior) {
    if (prior && *prior != "safe" && *prior != "printed") {
        throw InputError("prior: found " + *prior + ", expected safe or printed");
    }
    if (estimator) {
        const std::array kinds = {EstimatorKind::paper, EstimatorKind::momentum,
                                  EstimatorKind::momentum_effects};
        const auto* const kind =
            std::ranges::find(kinds, *estimator, [](EstimatorKind k) { return name_of(k); });
        if (kind == kinds.end()) {
            throw InputError("estimator: found " + *estimator +
                             ", expected paper, momentum or momentum_effects");
        }
        settings.kind = *kind;
    }
    if (prior) {
        settings.prior = *prior == "safe" ? PaperPrior::safe : PaperPrior::printed;
    }
    return settings;
}

// Whether nearly all rows are whole periods apart, and a good part of them one.
bool is_grid_of(const std::vector<double>& steps, double period_s) {
    std::size_t off_grid = 0;
    std::size_t ones = 0;
    for (const double step : steps) {
        const double periods = std::round(step / period_s);
        off_grid += periods < 1.0 || std::abs(step / period_s - periods) > 0.25 ? 1 : 0;
        ones += periods == 1.0 ? 1 : 0;
    }
    return 10 * off_grid <= steps.size() && 5 * ones >= steps.size();
}

// The log's sampling period: the median distance of its rows, or, where rows are missing so often that this
// is not one period, a whole part of it.
double sampling_period_s(const Column& t) {
    std::vector<double> steps(t.shape(0) - 1);
    for (std::size_t row = 0; row < steps.size(); row++) {
        steps[row] = t(row + 1) - t(row);
    }
    const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
    std::nth_element(steps.begin(), middle, steps.end());
    const double median_s = *middle;
    double period_s = median_s;
    for (int parts = 2; parts <= 3 && !is_grid_of(steps, period_s); parts++) {
        period_s = median_s / parts;
    }
    period_s = is_grid_of(steps, period_s) ? period_s : median_s;
    return std::round(period_s * 1e7) / 1e7; // logs print t to the microsecond or coarser
}

// Numbers rows by their time. A recorder's clock is never quite the sampling period, so the grid follows the
// rows slowly; what a row may be off by is for jitter alone.
class TickCounter {
  public:
    TickCounter(double first_t_s, double sampling_s) : grid_s_(first_t_s), sampling_s_(sampling_s) {}

    std::uint32_t tick_of(double t_s, std::size_t row) {
        const double ticks = (t_s - grid_s_) / sampling_s_;
        const double off = ticks - std::round(ticks);
        if (std::abs(off) > 0.25) {
            throw InputError("t: found " + std::to_string(t_s) + " s in data row " + std::to_string(row + 1) +
                             ", expected a multiple of the sampling period, " + std::to_string(sampling_s_) +
                             " s, after the first row");
        }
        const auto steps = static_cast<std::uint32_t>(std::llround(ticks));
        tick_ += steps;
        if (steps > 1) {
            missing_ += steps - 1;
            if (steps - 1 > longest_gap_) {
                longest_gap_ = steps - 1;
                longest_gap_t_s_ = t_s;
            }
        }
        grid_s_ += sampling_s_ * (steps + following * off);
        return tick_;
    }

    // Ticks that have no row: how many, the most in one place, and the time of the row after these.
    nb::tuple missing() const {
        return nb::make_tuple(missing_, longest_gap_, longest_gap_t_s_);
    }

  private:
    static constexpr double following = 0.02; // per row: 50 rows average the jitter of the clock

    double grid_s_, sampling_s_;
    std::uint32_t tick_ = 0;
    std::uint64_t missing_ = 0;
    std::uint32_t longest_gap_ = 0;
    double longest_gap_t_s_ = 0.0;
};

Vector6 legs_of_row(const LegColumns& columns, std::size_t row) {
    Vector6 legs;
    for (std::size_t leg = 0; leg < 6; leg++) {
        legs[static_cast<Eigen::Index>(leg)] = columns(row, leg);
    }
    return legs;
}

nb::object as_array(std::vector<double>&& values, std::size_t rows, std::size_t columns) {
    auto* owned = new std::vector<double>(std::move(values));
    const nb::capsule owner(owned, [](void* p) noexcept { delete static_cast<std::vector<double>*>(p); });
    if (columns == 0) {
        return nb::cast(nb::ndarray<nb::numpy, double>(owned->data(), {rows}, owner));
    }
    return nb::cast(nb::ndarray<nb::numpy, double>(owned->data(), {rows, columns}, owner));
}

// NaN where something is not known.
nb::dict body_dict(const LoadBody& body) {
    const auto vector = [](const std::array<double, 10>& values) {
        return as_array(std::vector<double>(values.begin(), values.end()), values.size(), 0);
    };
    nb::list names;
    for (const std::string_view name : LoadBody::names) {
        names.append(nb::str(name.data(), name.size()));
    }
    nb::dict result;
    result["names"] = names;
    result["value"] = vector(body.value);
    result["sigma"] = vector(body.sigma);
    result["is_consistent"] = body.is_consistent;
    result["distance_sigmas"] = body.distance_sigmas;
    result["nearest"] = vector(body.nearest);
    return result;
}

// What a replay returns, row by row; of a long one every second, fourth, ... row, those with an event, and
// the last.
class Answer {
  public:
    explicit Answer(std::size_t most_rows) : most_rows_(most_rows) {}

    void add(const EstimateRow& row, std::size_t parameters) {
        ticks_++;
        last_row_ = row;
        is_last_kept_ = ticks_ % every_ == 1 % every_ || is_event(row.health);
        if (is_last_kept_) {
            keep(row, parameters);
        }
        if (times_.size() >= most_rows_) {
            thin_out(parameters);
        }
    }

    bool empty() const {
        return ticks_ == 0;
    }

    nb::dict finish(const EstimatorLink& link, const std::string& first_refusal) && {
        const auto names = link.parameter_names();
        if (!is_last_kept_) {
            keep(last_row_, names.size());
        }
        const std::size_t rows = times_.size();
        nb::list name_list;
        for (const std::string_view name : names) {
            name_list.append(nb::str(name.data(), name.size()));
        }
        nb::dict counts;
        for (const HealthCount& count : link.health_counts()) {
            counts[count.name.c_str()] = count.ticks;
        }
        nb::dict result;
        result["names"] = name_list;
        result["ticks"] = ticks_;
        result["t"] = as_array(std::move(times_), rows, 0);
        result["value"] = as_array(std::move(values_), rows, names.size());
        result["sigma"] = as_array(std::move(sigmas_), rows, names.size());
        result["own_sigma"] = as_array(std::move(own_sigmas_), rows, names.size());
        result["nis"] = as_array(std::move(nis_), rows, 0);
        nb::list verdicts;
        for (const std::string_view verdict : verdicts_) {
            verdicts.append(nb::str(verdict.data(), verdict.size()));
        }
        result["verdict"] = verdicts;
        result["parameter_verdict"] =
            last_verdicts(std::min(names.size(), last_row_.parameter_verdict.size()));
        nb::dict confounded;
        for (const ConfoundedParameter& parameter : link.confounded_parameters()) {
            confounded[nb::str(parameter.name.data(), parameter.name.size())] = parameter.reason;
        }
        result["confounded"] = confounded;
        if (std::vector<double> covariance = link.covariance(); !covariance.empty()) {
            result["body"] = body_dict(load_body(last_row_, covariance));
            result["covariance"] = as_array(std::move(covariance), names.size(), names.size());
        }
        result["health"] = as_array(std::move(health_), rows, 0);
        result["health_counts"] = counts;
        nb::list faults;
        for (const InputFault& fault : link.input_faults()) {
            faults.append(nb::make_tuple(fault.t_s, fault.words));
        }
        result["input_faults"] = faults;
        result["input_fault"] = link.input_fault();
        result["refused"] = link.refused();
        result["first_refusal"] = first_refusal;
        return result;
    }

  private:
    static bool is_event(double health) {
        return (static_cast<std::uint32_t>(health) >> HEXLOAD_HEALTH_LOAD_CHANGED & 1U) != 0;
    }

    void keep(const EstimateRow& row, std::size_t parameters) {
        const auto count = static_cast<std::ptrdiff_t>(parameters);
        times_.push_back(row.t_s);
        values_.insert(values_.end(), row.value.begin(), row.value.begin() + count);
        sigmas_.insert(sigmas_.end(), row.sigma.begin(), row.sigma.begin() + count);
        own_sigmas_.insert(own_sigmas_.end(), row.own_sigma.begin(), row.own_sigma.begin() + count);
        nis_.push_back(row.nis);
        health_.push_back(row.health);
        verdicts_.push_back(row.verdict);
        ticks_of_rows_.push_back(ticks_);
    }

    void thin_out(std::size_t parameters) {
        every_ *= 2;
        std::size_t kept = 0;
        for (std::size_t row = 0; row < times_.size(); row++) {
            if (ticks_of_rows_[row] % every_ != 1 && !is_event(health_[row])) {
                continue;
            }
            for (auto* column : {&times_, &nis_, &health_}) {
                (*column)[kept] = (*column)[row];
            }
            for (auto* matrix : {&values_, &sigmas_, &own_sigmas_}) {
                std::copy_n(matrix->begin() + static_cast<std::ptrdiff_t>(row * parameters), parameters,
                            matrix->begin() + static_cast<std::ptrdiff_t>(kept * parameters));
            }
            verdicts_[kept] = verdicts_[row];
            ticks_of_rows_[kept] = ticks_of_rows_[row];
            kept++;
        }
        for (auto* column : {&times_, &nis_, &health_}) {
            column->resize(kept);
        }
        for (auto* matrix : {&values_, &sigmas_, &own_sigmas_}) {
            matrix->resize(kept * parameters);
        }
        verdicts_.resize(kept);
        ticks_of_rows_.resize(kept);
        is_last_kept_ = !ticks_of_rows_.empty() && ticks_of_rows_.back() == ticks_;
    }

    nb::list last_verdicts(std::size_t parameters) const {
        nb::list list;
        for (std::size_t k = 0; k < parameters; k++) {
            const std::string_view verdict = last_row_.parameter_verdict[k];
            list.append(nb::str(verdict.data(), verdict.size()));
        }
        return list;
    }

    std::size_t most_rows_;
    std::uint64_t every_ = 1, ticks_ = 0;
    bool is_last_kept_ = true;
    std::vector<double> times_, values_, sigmas_, own_sigmas_, nis_, health_;
    std::vector<std::string_view> verdicts_; // names of the firmware, which last
    std::vector<std::uint64_t> ticks_of_rows_;
    EstimateRow last_row_;
};

// The firmware over a log that comes in parts.
class Replay {
  public:
    Replay(const PlatformFile& platform, const std::optional<std::string>& estimator,
           const std::optional<std::string>& prior, double first_t_s, double sampling_s, bool has_velocity,
           const std::string& out_path, const std::optional<Tare>& tare,
           const std::optional<std::string>& bodies_path, const std::optional<std::string>& trace_path,
           std::size_t most_rows)
        : settings_(override_settings(platform.estimator, estimator, prior)), first_t_s_(first_t_s),
          sampling_s_(sampling_s),
          link_(make_inproc_link(machine_of(platform, has_velocity), settings_, sampling_s, tare,
                                 trace_path ? Traces::yes : Traces::no)),
          ticks_(first_t_s, sampling_s), file_(out_path, *link_), answer_(most_rows) {
        if (bodies_path) {
            if (link_->covariance().empty()) {
                throw InputError("bodies: found the estimator paper, expected momentum");
            }
            bodies_.emplace(*bodies_path);
        }
        if (trace_path) {
            traces_.emplace(*trace_path, hexload_describe(kind_of(settings_.kind))->measurements);
        }
    }

    void step(const Column& t, const LegColumns& displacement_m, const LegColumns& velocity_m_s,
              const LegColumns& force_n) {
        const std::size_t rows = t.shape(0);
        if (displacement_m.shape(0) != rows || velocity_m_s.shape(0) != rows || force_n.shape(0) != rows) {
            throw InputError("log: expected as many rows in each channel");
        }
        for (std::size_t row = 0; row < rows; row++, rows_++) {
            take({.tick = ticks_.tick_of(t(row), rows_),
                  .t_s = t(row),
                  .displacement_m = legs_of_row(displacement_m, row),
                  .velocity_m_s = legs_of_row(velocity_m_s, row),
                  .force_n = legs_of_row(force_n, row)});
        }
    }

    nb::dict finish() {
        if (answer_.empty()) {
            throw InputError("log: the estimator refused every sample; the first at " + first_refusal_);
        }
        file_.close();
        if (bodies_) {
            bodies_->close();
        }
        if (traces_) {
            traces_->close();
        }
        nb::dict result = std::move(answer_).finish(*link_, first_refusal_);
        result["missing"] = ticks_.missing();
        return result;
    }

  private:
    static PlatformFile machine_of(PlatformFile platform, bool has_velocity) {
        if (!has_velocity) {
            platform.sensors = without_velocity(platform.sensors);
        }
        return platform;
    }

    void take(const LegSample& sample) {
        const auto estimate = link_->step(sample);
        if (!estimate.empty()) {
            file_.write(estimate.front());
            answer_.add(estimate.front(), link_->parameter_names().size());
            if (const auto trace = link_->trace()) {
                // Ticks count from the first row, modulo 2^32: early ones of a delayed filter lie before it.
                traces_->write(first_t_s_ + sampling_s_ * static_cast<std::int32_t>(trace->tick), *trace);
            }
            if (bodies_) {
                bodies_->write(sample.t_s, load_body(estimate.front(), link_->covariance()));
            }
        } else if (first_refusal_.empty()) {
            first_refusal_ = "t = " + std::to_string(sample.t_s) + " s: " + link_->last_refusal();
        }
    }

    EstimatorSettings settings_;
    double first_t_s_, sampling_s_;
    std::unique_ptr<EstimatorLink> link_;
    TickCounter ticks_;
    EstimateFile file_;
    std::optional<BodyFile> bodies_;
    std::optional<TraceFile> traces_;
    Answer answer_;
    std::string first_refusal_;
    std::size_t rows_ = 0;
};

nb::dict replay(const PlatformFile& platform, const std::optional<std::string>& estimator,
                const std::optional<std::string>& prior, const Column& t, const LegColumns& displacement_m,
                const LegColumns& velocity_m_s, const LegColumns& force_n, const std::string& out_path,
                const std::optional<Tare>& tare, const std::optional<std::string>& bodies_path,
                const std::optional<std::string>& trace_path) {
    if (t.shape(0) < 2 || velocity_m_s.shape(0) < 2) {
        throw InputError("log: expected two rows or more, and as many in each channel");
    }
    Replay run(platform, estimator, prior, t(0), sampling_period_s(t), !std::isnan(velocity_m_s(0, 0)),
               out_path, tare, bodies_path, trace_path, std::numeric_limits<std::size_t>::max());
    run.step(t, displacement_m, velocity_m_s, force_n);
    return run.finish();
}

using Theta = Eigen::Matrix<double, HEXLOAD_LOAD_DIM, 1>;
using Covariance = Eigen::Matrix<double, HEXLOAD_LOAD_DIM, HEXLOAD_LOAD_DIM>;

// A hundred numbers as the firmware keeps them.
struct FirmwareEstimate {
    std::array<hexload_real_t, HEXLOAD_LOAD_DIM> theta{};
    std::array<hexload_real_t, HEXLOAD_LOAD_COVARIANCES> covariance{};

    FirmwareEstimate(const Theta& value, const Covariance& matrix) {
        std::size_t entry = 0;
        for (Eigen::Index row = 0; row < HEXLOAD_LOAD_DIM; row++) {
            theta[static_cast<std::size_t>(row)] = static_cast<hexload_real_t>(value[row]);
            for (Eigen::Index column = 0; column <= row; column++, entry++) {
                covariance[entry] = static_cast<hexload_real_t>(matrix(row, column));
            }
        }
    }
};

template <std::size_t size> Eigen::VectorXd as_vector(const hexload_real_t (&values)[size]) {
    return Eigen::Map<const Eigen::Matrix<hexload_real_t, Eigen::Dynamic, 1>>(values, size)
        .template cast<double>();
}

nb::dict describe_body(const Theta& theta, const Covariance& covariance) {
    const FirmwareEstimate estimate(theta, covariance);
    hexload_body_t body;
    hexload_body_describe(estimate.theta.data(), estimate.covariance.data(), &body);
    nb::dict result;
    result["mass_kg"] = static_cast<double>(body.mass_kg);
    result["mass_sigma_kg"] = static_cast<double>(body.mass_sigma_kg);
    result["com_m"] = nb::cast(as_vector(body.com_m));
    result["com_sigma_m"] = nb::cast(as_vector(body.com_sigma_m));
    result["inertia_kg_m2"] = nb::cast(as_vector(body.inertia_kg_m2));
    result["inertia_sigma_kg_m2"] = nb::cast(as_vector(body.inertia_sigma_kg_m2));
    result["has_com"] = body.has_com;
    result["has_inertia"] = body.has_inertia;
    result["is_consistent"] = body.is_consistent;
    return result;
}

nb::dict nearest_body(const Theta& theta, const Covariance& covariance) {
    const FirmwareEstimate estimate(theta, covariance);
    hexload_real_t nearest[HEXLOAD_LOAD_DIM];
    hexload_real_t distance_sigmas = 0;
    nb::dict result;
    result["is_found"] =
        hexload_body_nearest(estimate.theta.data(), estimate.covariance.data(), nearest, &distance_sigmas);
    result["theta"] = nb::cast(as_vector(nearest));
    result["distance_sigmas"] = static_cast<double>(distance_sigmas);
    return result;
}

// The kinematics stage alone, for comparison with the plant's.
class FirmwareKinematics {
  public:
    explicit FirmwareKinematics(const PlatformFile& platform)
        : config_(firmware_config(platform, platform.estimator, platform.sensors.tick_s)) {
        const hexload_status_t status = hexload_kinematics_init(&kinematics_, &config_);
        if (status != HEXLOAD_OK) {
            throw InputError(hexload_status_name(status));
        }
    }

    nb::dict solve(const Vector6& displacement_m, const Vector6& velocity_m_s) {
        hexload_leg_sample_t sample{};
        hexload_motion_t motion;
        copy_to_firmware(displacement_m, sample.displacement_m);
        copy_to_firmware(velocity_m_s, sample.velocity_m_s);
        const hexload_status_t status = hexload_kinematics_solve(&kinematics_, &config_, &sample, &motion);
        if (status != HEXLOAD_OK) {
            throw InputError(hexload_status_name(status));
        }
        using RowMajor3 = Eigen::Matrix<hexload_real_t, 3, 3, Eigen::RowMajor>;
        using RowMajor6 = Eigen::Matrix<hexload_real_t, 6, 6, Eigen::RowMajor>;
        nb::dict result;
        result["p_m"] =
            nb::cast(Vector3(Eigen::Map<Eigen::Matrix<hexload_real_t, 3, 1>>(motion.p_m).cast<double>()));
        result["R"] = nb::cast(Matrix3(Eigen::Map<RowMajor3>(&motion.R[0][0]).cast<double>()));
        result["twist"] =
            nb::cast(Vector6(Eigen::Map<Eigen::Matrix<hexload_real_t, 6, 1>>(motion.twist).cast<double>()));
        result["J"] = nb::cast(Matrix6(Eigen::Map<RowMajor6>(&motion.J[0][0]).cast<double>()));
        result["newton_steps"] = motion.newton_steps;
        return result;
    }

  private:
    hexload_config_t config_;
    hexload_kinematics_t kinematics_{};
};

} // namespace

void bind_firmware(nb::module_& module) {
    module.def(
        "config_bytes",
        [](const PlatformFile& platform, double sampling_s) {
            const hexload_config_t config = checked_firmware_config(platform, platform.estimator, sampling_s);
            return nb::bytes(&config, sizeof config);
        },
        nb::arg("platform"), nb::arg("sampling_s"),
        "The firmware's configuration as it lies in memory: numbers of 32 bits in the float build, so a "
        "32-bit "
        "controller can\nread it. ValueError names what is wrong.");
    module.def(
        "config_initialiser",
        [](const nb::bytes& bytes) {
            hexload_config_t config;
            if (bytes.size() != sizeof config) {
                throw InputError("config: found " + std::to_string(bytes.size()) + " bytes, expected " +
                                 std::to_string(sizeof config));
            }
            std::memcpy(&config, bytes.data(), sizeof config);
            return hexload::platform::config_initialiser(config);
        },
        nb::arg("config"), "C source of what config_bytes() returned: designated initialisers in braces.");
    module.def(
        "replay", &replay, nb::arg("platform"), nb::arg("estimator").none(), nb::arg("prior").none(),
        nb::arg("t"), nb::arg("displacement_m"), nb::arg("velocity_m_s"), nb::arg("force_n"),
        nb::arg("out_path"), nb::arg("tare").none() = nb::none(), nb::arg("bodies_path").none() = nb::none(),
        nb::arg("trace_path").none() = nb::none(),
        "Runs the firmware over a log: t [n] s, legs [n, 6] in m, m/s, N. Writes the estimates CSV "
        "and returns it as a\n"
        "dict of arrays, with health counts, each parameter's last verdict and the number of refused "
        "samples, and the load parameters that the machine's effects hide, with the reason; of the momentum "
        "filters also the final covariance,\nwithout the tare's, and the final body: mass, centre of mass "
        "and "
        "central tensor with sigmas, whether a body can have them,\nand the nearest that one can have. "
        "bodies_path: a CSV of the same for each row. A tare is added to the platform, and its sigma "
        "to that of the estimates. ValueError names what is wrong.");
    nb::class_<Replay>(
        module, "Replay",
        "replay() of a log that comes in parts, of which the result keeps `most_rows` rows at most: every "
        "second, fourth, ...,\nthose with a load change and the last. Its files have them all.")
        .def(nb::init<const PlatformFile&, const std::optional<std::string>&,
                      const std::optional<std::string>&, double, double, bool, const std::string&,
                      const std::optional<Tare>&, const std::optional<std::string>&,
                      const std::optional<std::string>&, std::size_t>(),
             nb::arg("platform"), nb::arg("estimator").none(), nb::arg("prior").none(), nb::arg("first_t_s"),
             nb::arg("sampling_s"), nb::arg("has_velocity"), nb::arg("out_path"), nb::arg("tare").none(),
             nb::arg("bodies_path").none(), nb::arg("trace_path").none(), nb::arg("most_rows"))
        .def("step", &Replay::step, nb::arg("t"), nb::arg("displacement_m"), nb::arg("velocity_m_s"),
             nb::arg("force_n"))
        .def("finish", &Replay::finish, "Once, at the end: what replay() returns.");
    module.def("sampling_period_s", &sampling_period_s, nb::arg("t"),
               "The median distance of at least two times, s, to 0.1 us.");
    module.def(
        "describe_body", &describe_body, nb::arg("theta"), nb::arg("covariance"),
        "hexload_body_describe() of hexload/estimate.h: theta [10], covariance [10, 10], of which the lower "
        "triangle is read.");
    module.def("nearest_body", &nearest_body, nb::arg("theta"), nb::arg("covariance"),
               "hexload_body_nearest() of hexload/estimate.h, likewise: a dict of theta, distance_sigmas, "
               "is_found.");
    nb::class_<FirmwareKinematics>(module, "Kinematics", "The firmware's kinematics stage, started at home.")
        .def(nb::init<const PlatformFile&>(), nb::arg("platform"))
        .def("solve", &FirmwareKinematics::solve, nb::arg("displacement_m"), nb::arg("velocity_m_s"),
             "Pose, twist and Jacobian from six leg displacements and velocities, searched from the last "
             "pose: a dict of p_m\n"
             "[3], R [3, 3], twist [6], J [6, 6], newton_steps. ValueError when there is no pose.");
}
