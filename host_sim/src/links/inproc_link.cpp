#include <hexload_sim/inproc_link.hpp>
#include <hexload_sim/input_error.hpp>

#include "estimate_row.hpp"
#include "firmware_config.hpp"

namespace hexload::sim {

namespace {

class PaperLink final : public EstimatorLink {
  public:
    PaperLink(const PlatformFile& platform, const EstimatorSettings& settings, double sampling_s)
        : config_(checked_firmware_config(platform, settings, sampling_s)) {
        const hexload_status_t status = hexload_init(&estimator_, &config_);
        if (status != HEXLOAD_OK) {
            throw InputError(std::string("the estimator refuses the geometry: ") +
                             hexload_status_name(status));
        }
    }

    std::span<const std::string_view> parameter_names() const override {
        return paper_parameter_names();
    }

    std::span<const EstimateRow> step(const LegSample& sample) override {
        const hexload_leg_sample_t legs = firmware_sample(sample);
        hexload_estimate_t estimate;
        last_status_ = hexload_tick(&estimator_, &config_, &legs, &estimate);
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
    hexload_t estimator_{};
    hexload_status_t last_status_ = HEXLOAD_OK;
    EstimateRow row_;
};

} // namespace

std::unique_ptr<EstimatorLink> make_inproc_link(const PlatformFile& platform,
                                                const EstimatorSettings& settings, double sampling_s) {
    return std::make_unique<PaperLink>(platform, settings, sampling_s);
}

} // namespace hexload::sim
