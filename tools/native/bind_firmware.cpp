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

// The log's sampling period: the median distance of its rows, as rows may be missing.
double sampling_period_s(const Column& t) {
    std::vector<double> steps(t.shape(0) - 1);
    for (std::size_t row = 0; row < steps.size(); row++) {
        steps[row] = t(row + 1) - t(row);
    }
    const auto middle = steps.begin() + static_cast<std::ptrdiff_t>(steps.size() / 2);
    std::nth_element(steps.begin(), middle, steps.end());
    return std::round(*middle * 1e7) / 1e7; // logs print t to the microsecond or coarser
}

std::uint32_t tick_of_row(const Column& t, std::size_t row, double sampling_s) {
    const double ticks = (t(row) - t(0)) / sampling_s;
    if (std::abs(ticks - std::round(ticks)) > 0.25) {
        throw InputError("t: found " + std::to_string(t(row)) + " s in data row " + std::to_string(row + 1) +
                         ", expected a multiple of the sampling period, " + std::to_string(sampling_s) +
                         " s, after the first row");
    }
    return static_cast<std::uint32_t>(std::llround(ticks));
}

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

// What replay() returns, row by row.
class Answer {
  public:
    void add(const EstimateRow& row, std::size_t parameters) {
        times_.push_back(row.t_s);
        values_.insert(values_.end(), row.value.begin(),
                       row.value.begin() + static_cast<std::ptrdiff_t>(parameters));
        sigmas_.insert(sigmas_.end(), row.sigma.begin(),
                       row.sigma.begin() + static_cast<std::ptrdiff_t>(parameters));
        own_sigmas_.insert(own_sigmas_.end(), row.own_sigma.begin(),
                           row.own_sigma.begin() + static_cast<std::ptrdiff_t>(parameters));
        nis_.push_back(row.nis);
        health_.push_back(row.health);
        verdicts_.append(nb::str(row.verdict.data(), row.verdict.size()));
        last_row_ = row;
    }

    bool empty() const {
        return times_.empty();
    }

    nb::dict finish(const EstimatorLink& link, const std::string& first_refusal) && {
        const auto names = link.parameter_names();
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
        result["t"] = as_array(std::move(times_), rows, 0);
        result["value"] = as_array(std::move(values_), rows, names.size());
        result["sigma"] = as_array(std::move(sigmas_), rows, names.size());
        result["own_sigma"] = as_array(std::move(own_sigmas_), rows, names.size());
        result["nis"] = as_array(std::move(nis_), rows, 0);
        result["verdict"] = verdicts_;
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
    nb::list last_verdicts(std::size_t parameters) const {
        nb::list list;
        for (std::size_t k = 0; k < parameters; k++) {
            const std::string_view verdict = last_row_.parameter_verdict[k];
            list.append(nb::str(verdict.data(), verdict.size()));
        }
        return list;
    }

    std::vector<double> times_, values_, sigmas_, own_sigmas_, nis_, health_;
    nb::list verdicts_;
    EstimateRow last_row_;
};

nb::dict replay(const PlatformFile& platform, const std::optional<std::string>& estimator,
                const std::optional<std::string>& prior, const Column& t, const LegColumns& displacement_m,
                const LegColumns& velocity_m_s, const LegColumns& force_n, const std::string& out_path,
                const std::optional<Tare>& tare, const std::optional<std::string>& bodies_path,
                const std::optional<std::string>& trace_path) {
    const std::size_t rows = t.shape(0);
    if (rows < 2 || displacement_m.shape(0) != rows || velocity_m_s.shape(0) != rows ||
        force_n.shape(0) != rows) {
        throw InputError("log: expected two rows or more, and as many in each channel");
    }
    const double sampling_s = sampling_period_s(t);
    const EstimatorSettings settings = override_settings(platform.estimator, estimator, prior);
    PlatformFile machine = platform;
    if (std::isnan(velocity_m_s(0, 0))) {
        machine.sensors = without_velocity(machine.sensors);
    }
    const auto link =
        make_inproc_link(machine, settings, sampling_s, tare, trace_path ? Traces::yes : Traces::no);
    EstimateFile file(out_path, *link);
    std::optional<BodyFile> bodies;
    if (bodies_path) {
        if (link->covariance().empty()) {
            throw InputError("bodies: found the estimator paper, expected momentum");
        }
        bodies.emplace(*bodies_path);
    }
    std::optional<TraceFile> traces;
    if (trace_path) {
        traces.emplace(*trace_path, hexload_describe(kind_of(settings.kind))->measurements);
    }
    Answer answer;
    std::string first_refusal;
    for (std::size_t row = 0; row < rows; row++) {
        const auto estimate = link->step({.tick = tick_of_row(t, row, sampling_s),
                                          .t_s = t(row),
                                          .displacement_m = legs_of_row(displacement_m, row),
                                          .velocity_m_s = legs_of_row(velocity_m_s, row),
                                          .force_n = legs_of_row(force_n, row)});
        if (!estimate.empty()) {
            file.write(estimate.front());
            answer.add(estimate.front(), link->parameter_names().size());
            if (const auto trace = link->trace()) {
                // Ticks count from the first row, modulo 2^32: early ones of a delayed filter lie before it.
                traces->write(t(0) + sampling_s * static_cast<std::int32_t>(trace->tick), *trace);
            }
            if (bodies) {
                bodies->write(t(row), load_body(estimate.front(), link->covariance()));
            }
        } else if (first_refusal.empty()) {
            first_refusal = "t = " + std::to_string(t(row)) + " s: " + link->last_refusal();
        }
    }
    if (answer.empty()) {
        throw InputError("log: the estimator refused every sample; the first at " + first_refusal);
    }
    file.close();
    if (bodies) {
        bodies->close();
    }
    if (traces) {
        traces->close();
    }
    return std::move(answer).finish(*link, first_refusal);
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
        : config_(firmware_config(platform, platform.estimator, tick_s)) {
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
    module.def(
        "describe_body", &describe_body, nb::arg("theta"), nb::arg("covariance"),
        "hexload_body_describe() of hexload/body.h: theta [10], covariance [10, 10], of which the lower "
        "triangle is read.");
    module.def(
        "nearest_body", &nearest_body, nb::arg("theta"), nb::arg("covariance"),
        "hexload_body_nearest() of hexload/body.h, likewise: a dict of theta, distance_sigmas, is_found.");
    nb::class_<FirmwareKinematics>(module, "Kinematics", "The firmware's kinematics stage, started at home.")
        .def(nb::init<const PlatformFile&>(), nb::arg("platform"))
        .def("solve", &FirmwareKinematics::solve, nb::arg("displacement_m"), nb::arg("velocity_m_s"),
             "Pose, twist and Jacobian from six leg displacements and velocities, searched from the last "
             "pose: a dict of p_m\n"
             "[3], R [3, 3], twist [6], J [6, 6], newton_steps. ValueError when there is no pose.");
}
