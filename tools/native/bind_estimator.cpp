#include "bindings.hpp"

#include "links/inproc_link.hpp"
#include "platform_file/input_error.hpp"

#include <nanobind/eigen/dense.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <algorithm>
#include <memory>
#include <string>
#include <vector>

namespace nb = nanobind;
using namespace hexload::sim;

namespace {

nb::str word(std::string_view text) {
    return nb::str(text.data(), text.size());
}

// The estimator that a platform file chooses, sample by sample.
class Estimator {
  public:
    Estimator(const PlatformFile& platform, double sampling_s, const std::optional<Tare>& tare)
        : sampling_s_(sampling_s), link_(make_inproc_link(platform, platform.estimator, sampling_s, tare)) {}

    nb::object step(std::uint32_t tick, const Vector6& displacement_m, const Vector6& velocity_m_s,
                    const Vector6& force_n) {
        const auto rows = link_->step({.tick = tick,
                                       .t_s = sampling_s_ * tick,
                                       .displacement_m = displacement_m,
                                       .velocity_m_s = velocity_m_s,
                                       .force_n = force_n});
        if (rows.empty()) {
            return nb::none();
        }
        const EstimateRow& row = rows.front();
        const std::size_t parameters = link_->parameter_names().size();
        const auto count = static_cast<Eigen::Index>(parameters);
        nb::list verdicts;
        for (std::size_t k = 0; k < std::min(parameters, row.parameter_verdict.size()); k++) {
            verdicts.append(word(row.parameter_verdict[k]));
        }
        return nb::make_tuple(Eigen::VectorXd(Eigen::Map<const Eigen::VectorXd>(row.value.data(), count)),
                              Eigen::VectorXd(Eigen::Map<const Eigen::VectorXd>(row.sigma.data(), count)),
                              Eigen::VectorXd(Eigen::Map<const Eigen::VectorXd>(row.own_sigma.data(), count)),
                              row.nis, word(row.verdict), verdicts, row.health);
    }

    std::vector<std::string> names() const {
        const auto names = link_->parameter_names();
        return {names.begin(), names.end()};
    }

    Eigen::MatrixXd covariance() const {
        const std::vector<double> values = link_->covariance();
        if (values.empty()) {
            return {};
        }
        const auto count = static_cast<Eigen::Index>(link_->parameter_names().size());
        return Eigen::Map<const Eigen::MatrixXd>(values.data(), count, count); // symmetric
    }

    std::uint32_t refused() const {
        return link_->refused();
    }

    std::string last_refusal() const {
        return link_->last_refusal();
    }

    std::vector<double> load_changes_s() const {
        return link_->load_changes_s();
    }

    std::string input_fault() const {
        return link_->input_fault();
    }

    std::vector<std::string> health_names() const {
        std::vector<std::string> names;
        for (const HealthCount& count : link_->health_counts()) {
            names.push_back(count.name);
        }
        return names;
    }

  private:
    double sampling_s_;
    std::unique_ptr<EstimatorLink> link_;
};

} // namespace

void bind_estimator(nb::module_& module) {
    nb::class_<Estimator>(module, "Estimator",
                          "The estimator that a platform file chooses, sample by sample.")
        .def(nb::init<const PlatformFile&, double, const std::optional<Tare>&>(), nb::arg("platform"),
             nb::arg("sampling_s"), nb::arg("tare").none() = nb::none())
        .def("step", &Estimator::step, nb::arg("tick"), nb::arg("displacement_m"), nb::arg("velocity_m_s"),
             nb::arg("force_n"),
             "One sample, (6,) each: (value [n], sigma [n], the filter's part of it [n], nis, verdict, the "
             "parameters' verdicts, health "
             "bits); None: refused.")
        .def_prop_ro("names", &Estimator::names)
        .def_prop_ro("covariance", &Estimator::covariance, "(n, n); (0, 0) of the paper's filter")
        .def_prop_ro("refused", &Estimator::refused)
        .def_prop_ro("last_refusal", &Estimator::last_refusal)
        .def_prop_ro("load_changes_s", &Estimator::load_changes_s)
        .def_prop_ro("input_fault", &Estimator::input_fault,
                     "what is wrong with the channels, in words; empty: nothing")
        .def_prop_ro("health_names", &Estimator::health_names, "of bit 0, 1, ...");
}
