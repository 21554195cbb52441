#include <hexload_sim/inproc_link.hpp>
#include <hexload_sim/input_error.hpp>

#include "estimate_row.hpp"
#include "firmware_config.hpp"

namespace hexload::sim {

namespace {

// The firmware's two estimators by one name each.
hexload_status_t init(hexload_t& self, const hexload_config_t& config) {
    return hexload_init(&self, &config);
}
hexload_status_t init(hexload_momentum_t& self, const hexload_config_t& config) {
    return hexload_momentum_init(&self, &config);
}
hexload_status_t tick(hexload_t& self, const hexload_config_t& config, const hexload_leg_sample_t& sample,
                      hexload_estimate_t& estimate) {
    return hexload_tick(&self, &config, &sample, &estimate);
}
hexload_status_t tick(hexload_momentum_t& self, const hexload_config_t& config,
                      const hexload_leg_sample_t& sample, hexload_estimate_t& estimate) {
    return hexload_momentum_tick(&self, &config, &sample, &estimate);
}

template <class Estimator, EstimatorKind kind> class InprocLink final : public EstimatorLink {
  public:
    InprocLink(const PlatformFile& platform, const EstimatorSettings& settings, double sampling_s)
        : config_(checked_firmware_config(platform, settings, sampling_s)) {
        const hexload_status_t status = init(estimator_, config_);
        if (status != HEXLOAD_OK) {
            throw InputError(std::string("the estimator refuses the geometry: ") +
                             hexload_status_name(status));
        }
    }

    std::span<const std::string_view> parameter_names() const override {
        return sim::parameter_names(kind);
    }

    std::span<const EstimateRow> step(const LegSample& sample) override {
        const hexload_leg_sample_t legs = firmware_sample(sample);
        hexload_estimate_t estimate{};
        last_status_ = tick(estimator_, config_, legs, estimate);
        if (last_status_ != HEXLOAD_OK) {
            return {};
        }
        row_ = estimate_row(estimate, sample.t_s, estimator_.health.bits);
        return {&row_, 1};
    }

    std::vector<HealthCount> health_counts() const override {
        return named_health_counts(estimator_.health.count);
    }

    std::uint32_t refused() const override {
        return estimator_.health.refused;
    }

    std::string last_refusal() const override {
        return hexload_status_name(last_status_);
    }

  private:
    hexload_config_t config_;
    Estimator estimator_{};
    hexload_status_t last_status_ = HEXLOAD_OK;
    EstimateRow row_;
};

} // namespace

std::unique_ptr<EstimatorLink> make_inproc_link(const PlatformFile& platform,
                                                const EstimatorSettings& settings, double sampling_s) {
    if (settings.kind == EstimatorKind::paper) {
        return std::make_unique<InprocLink<hexload_t, EstimatorKind::paper>>(platform, settings, sampling_s);
    }
    return std::make_unique<InprocLink<hexload_momentum_t, EstimatorKind::momentum>>(platform, settings,
                                                                                    sampling_s);
}

} // namespace hexload::sim
