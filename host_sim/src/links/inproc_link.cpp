#include <hexload_sim/inproc_link.hpp>
#include <hexload_sim/input_error.hpp>

#include "firmware_config.hpp"

#include <algorithm>

namespace hexload::sim {

namespace {

constexpr std::array<std::string_view, HEXLOAD_PAPER_DIM> paper_parameters = {"dz", "Ixx", "Iyy", "Izz"};

class PaperLink final : public InprocLink {
  public:
    PaperLink(const PlatformFile& platform, const EstimatorSettings& settings, double sampling_s)
        : config_(firmware_config(platform, settings, sampling_s)) {
        const char* bad_field = nullptr;
        if (hexload_config_check(&config_, &bad_field) != HEXLOAD_OK) {
            throw InputError(std::string("the estimator refuses its configuration: ") + bad_field +
                             " is out of range");
        }
        const hexload_status_t status = hexload_init(&estimator_, &config_);
        if (status != HEXLOAD_OK) {
            throw InputError(std::string("the estimator refuses the geometry: ") +
                             hexload_status_name(status));
        }
    }

    std::span<const std::string_view> parameter_names() const override {
        return paper_parameters;
    }

    std::optional<EstimateRow> step(const LegSample& sample) override {
        hexload_leg_sample_t legs{};
        legs.tick = sample.tick;
        copy_to_firmware(sample.displacement_m, legs.displacement_m);
        copy_to_firmware(sample.velocity_m_s, legs.velocity_m_s);
        copy_to_firmware(sample.force_n, legs.force_n);
        hexload_estimate_t estimate;
        last_status_ = hexload_tick(&estimator_, &config_, &legs, &estimate);
        if (last_status_ != HEXLOAD_OK) {
            return std::nullopt;
        }
        EstimateRow row;
        row.t_s = sample.t_s;
        std::copy(std::begin(estimate.value), std::end(estimate.value), row.value.begin());
        std::copy(std::begin(estimate.sigma), std::end(estimate.sigma), row.sigma.begin());
        row.nis = static_cast<double>(estimate.nis);
        row.verdict = hexload_verdict_name(estimate.verdict);
        row.health = estimator_.health.bits;
        return row;
    }

    std::vector<HealthCount> health_counts() const override {
        std::vector<HealthCount> counts;
        for (int bit = 0; bit < HEXLOAD_HEALTH_BITS; bit++) {
            counts.push_back(
                {hexload_health_name(static_cast<hexload_health_bit_t>(bit)), estimator_.health.count[bit]});
        }
        return counts;
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
};

} // namespace

std::unique_ptr<InprocLink> make_inproc_link(const PlatformFile& platform, const EstimatorSettings& settings,
                                             double sampling_s) {
    if (settings.kind == EstimatorKind::momentum) {
        throw InputError("estimator: found momentum, expected paper: this version has no other");
    }
    if (!platform.known_mass_kg) {
        throw InputError(
            "load.known_mass_kg: found nothing, expected the load's mass, which the paper's filter needs");
    }
    return std::make_unique<PaperLink>(platform, settings, sampling_s);
}

} // namespace hexload::sim
