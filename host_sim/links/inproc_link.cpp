#include "inproc_link.hpp"

#include "estimate_row.hpp"
#include "firmware_sample.hpp"

#include "platform_file/firmware_config.hpp"
#include "platform_file/input_error.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>

namespace hexload::sim {

namespace {

// What the tare's errors, taken as independent, add to the sigmas of the estimate. The sum of load and
// platform is what the momentum filter measures. The paper's filter knows the load's mass and measures the
// height c of the common centre of mass and the inertia about it: at constant m_l dz + h_z = m c and I_C +
// m_l dz^2 + I - m c^2, and so m_l d(dz) = c dm - dh_z and dI_C = -dI + 2 dz dh_z + c (c - 2 dz) dm.
void add_tare_sigma(EstimateRow& row, const Vector10& tare_sigma, const hexload_config_t& config,
                    EstimatorKind kind) {
    if (kind != EstimatorKind::paper) {
        for (std::size_t k = 0; k < HEXLOAD_LOAD_DIM; k++) {
            row.sigma[k] = std::hypot(row.sigma[k], tare_sigma[static_cast<Eigen::Index>(k)]);
        }
        return;
    }
    const auto load_kg = static_cast<double>(config.paper.load_mass_kg);
    const auto own_kg = static_cast<double>(config.platform.mass_kg);
    const auto own_com_m = static_cast<double>(config.platform.com_m[2]);
    const double dz_m = row.value[HEXLOAD_PAPER_DZ];
    const double com_m = (load_kg * dz_m + own_kg * own_com_m) / (load_kg + own_kg);
    const double s_m = tare_sigma[HEXLOAD_LOAD_M];
    const double s_hz = tare_sigma[HEXLOAD_LOAD_HZ];
    const double tilting = std::hypot(2.0 * dz_m * s_hz, com_m * (com_m - 2.0 * dz_m) * s_m);
    const auto add = [&row](std::size_t k, double sigma) { row.sigma[k] = std::hypot(row.sigma[k], sigma); };
    add(HEXLOAD_PAPER_DZ, std::hypot(s_hz, com_m * s_m) / load_kg);
    add(HEXLOAD_PAPER_IXX, std::hypot(tare_sigma[HEXLOAD_LOAD_IXX], tilting));
    add(HEXLOAD_PAPER_IYY, std::hypot(tare_sigma[HEXLOAD_LOAD_IYY], tilting));
    add(HEXLOAD_PAPER_IZZ, tare_sigma[HEXLOAD_LOAD_IZZ]);
}

class InprocLink final : public EstimatorLink {
  public:
    InprocLink(const PlatformFile& platform, const EstimatorSettings& settings, double sampling_s,
               const std::optional<Tare>& tare, Traces traces)
        : kind_(settings.kind), traces_(traces),
          config_(checked_firmware_config(tare ? with_tare(platform, tare->theta) : platform, settings,
                                          sampling_s)),
          tare_(tare) {
        const hexload_status_t status = hexload_init(&estimator_, &config_);
        if (status != HEXLOAD_OK) {
            throw InputError(std::string("the estimator refuses the geometry: ") +
                             hexload_status_name(status));
        }
    }

    std::span<const std::string_view> parameter_names() const override {
        return sim::parameter_names(kind_);
    }

    std::span<const std::string_view> own_sigma_names() const override {
        return kind_ == EstimatorKind::paper ? std::span<const std::string_view>()
                                             : load_parameter_names(kind_);
    }

    std::span<const EstimateRow> step(const LegSample& sample) override {
        const hexload_leg_sample_t legs = firmware_sample(sample);
        last_status_ = traces_ == Traces::yes
                           ? hexload_trace(&estimator_, &config_, &legs, &estimate_, &trace_)
                           : hexload_tick(&estimator_, &config_, &legs, &estimate_);
        if (last_status_ != HEXLOAD_OK) {
            return {};
        }
        const std::uint32_t bits = hexload_health(&estimator_)->bits;
        row_ = estimate_row(estimate_, sample.t_s, bits);
        if ((bits >> HEXLOAD_HEALTH_LOAD_CHANGED & 1U) != 0) {
            load_changes_s_.push_back(sample.t_s);
        }
        input_faults_.note(sample.t_s, hexload_health(&estimator_)->input);
        if (hexload_read_effects(&estimator_, &estimate_, &effects_)) {
            add_effects(row_, effects_);
        }
        if (tare_) {
            add_tare_sigma(row_, tare_->sigma, config_, kind_);
        }
        return {&row_, 1};
    }

    std::vector<HealthCount> health_counts() const override {
        return named_health_counts(hexload_health(&estimator_)->count);
    }

    std::uint32_t refused() const override {
        return hexload_health(&estimator_)->refused;
    }

    std::string last_refusal() const override {
        return hexload_status_name(last_status_);
    }

    std::vector<double> load_changes_s() const override {
        return load_changes_s_;
    }

    std::vector<InputFault> input_faults() const override {
        return input_faults_.all();
    }

    std::string input_fault() const override {
        return input_faults_.words();
    }

    std::vector<double> covariance() const override {
        if (kind_ == EstimatorKind::paper) {
            return {}; // four parameters of a load that is known otherwise: no body's covariance
        }
        std::array<hexload_real_t, HEXLOAD_COVARIANCES_MAX> triangle{};
        const std::size_t size = parameter_names().size();
        std::vector<double> matrix(size * size);
        hexload_covariance(&estimator_, triangle.data());
        for (std::size_t row = 0, entry = 0; row < size; row++) {
            for (std::size_t column = 0; column <= row; column++, entry++) {
                matrix[row * size + column] = static_cast<double>(triangle[entry]);
                matrix[column * size + row] = matrix[row * size + column];
            }
        }
        return matrix;
    }

    std::optional<UpdateTrace> trace() const override {
        static constexpr std::array<std::string_view, 3> gates = {"none", "accepted", "rejected"};
        if (traces_ == Traces::no || last_status_ != HEXLOAD_OK) {
            return std::nullopt;
        }
        UpdateTrace trace{.tick = trace_.tick,
                          .dimension = trace_.dimension,
                          .nis = static_cast<double>(trace_.nis),
                          .sum_nis = static_cast<double>(trace_.sum_nis),
                          .sum_nis_mean = static_cast<double>(trace_.sum_nis_mean),
                          .gate = gates.at(trace_.gate)};
        std::copy(std::begin(trace_.innovation), std::end(trace_.innovation), trace.innovation.begin());
        std::copy(std::begin(trace_.variance), std::end(trace_.variance), trace.variance.begin());
        return trace;
    }

    std::vector<ConfoundedParameter> confounded_parameters() const override {
        return sim::confounded_parameters(effects_);
    }

  private:
    EstimatorKind kind_;
    Traces traces_;
    hexload_config_t config_;
    std::optional<Tare> tare_;
    hexload_t estimator_{};
    hexload_estimate_t estimate_{};
    hexload_trace_t trace_{};
    hexload_effects_estimate_t effects_{}; // zeros of a kind that has none
    hexload_status_t last_status_ = HEXLOAD_OK;
    EstimateRow row_;
    std::vector<double> load_changes_s_;
    InputFaultBook input_faults_;
};

} // namespace

std::unique_ptr<EstimatorLink> make_inproc_link(const PlatformFile& platform,
                                                const EstimatorSettings& settings, double sampling_s,
                                                const std::optional<Tare>& tare, Traces traces) {
    return std::make_unique<InprocLink>(platform, settings, sampling_s, tare, traces);
}

} // namespace hexload::sim
