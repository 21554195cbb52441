#include <hexload_sim/inproc_link.hpp>
#include <hexload_sim/input_error.hpp>

#include "estimate_row.hpp"
#include "firmware_config.hpp"

#include <cmath>

namespace hexload::sim {

namespace {

// The firmware's estimators by one name each.
hexload_status_t init(hexload_paper_t& self, const hexload_config_t& config) {
    return hexload_paper_init(&self, &config);
}
hexload_status_t init(hexload_momentum_t& self, const hexload_config_t& config) {
    return hexload_momentum_init(&self, &config);
}
hexload_status_t init(hexload_momentum_effects_t& self, const hexload_config_t& config) {
    return hexload_momentum_effects_init(&self, &config);
}
hexload_status_t tick(hexload_paper_t& self, const hexload_config_t& config,
                      const hexload_leg_sample_t& sample, hexload_estimate_t& estimate) {
    return hexload_paper_tick(&self, &config, &sample, &estimate);
}
hexload_status_t tick(hexload_momentum_t& self, const hexload_config_t& config,
                      const hexload_leg_sample_t& sample, hexload_estimate_t& estimate) {
    return hexload_momentum_tick(&self, &config, &sample, &estimate);
}
hexload_status_t tick(hexload_momentum_effects_t& self, const hexload_config_t& config,
                      const hexload_leg_sample_t& sample, hexload_estimate_t& estimate) {
    return hexload_momentum_effects_tick(&self, &config, &sample, &estimate);
}
const hexload_health_t& health_of(const hexload_paper_t& self) {
    return self.health;
}
const hexload_health_t& health_of(const hexload_momentum_t& self) {
    return self.health;
}
const hexload_health_t& health_of(const hexload_momentum_effects_t& self) {
    return self.momentum.health;
}

hexload_effects_estimate_t machine_of(const hexload_momentum_effects_t& self,
                                      const hexload_estimate_t& estimate) {
    hexload_effects_estimate_t machine{};
    hexload_momentum_effects_read(&self, &estimate, &machine);
    return machine;
}

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

std::vector<double> covariance_of(const hexload_paper_t&) {
    return {};
}

// A symmetric matrix of the entries row by row of its lower triangle.
template <class Entry> std::vector<double> symmetric(std::size_t size, Entry entry) {
    std::vector<double> matrix(size * size);
    for (std::size_t row = 0; row < size; row++) {
        for (std::size_t column = 0; column <= row; column++) {
            const auto value = static_cast<double>(entry(row, column));
            matrix[row * size + column] = value;
            matrix[column * size + row] = value;
        }
    }
    return matrix;
}

constexpr std::size_t triangle(std::size_t row) {
    return row * (row + 1) / 2;
}

std::vector<double> covariance_of(const hexload_momentum_t& self) {
    return symmetric(HEXLOAD_LOAD_DIM, [&self](std::size_t row, std::size_t column) {
        return self.filter.load_cov[row][column];
    });
}

// The rows of the machine's effects go on where a lower triangle by rows of the load's parameters and the
// momentum ends.
std::vector<double> covariance_of(const hexload_momentum_effects_t& self) {
    constexpr std::size_t load = HEXLOAD_LOAD_DIM;
    constexpr std::size_t states = HEXLOAD_MOMENTUM_STATES;
    const auto state_of = [](std::size_t k) { return k < load ? k : k - load + states; };
    return symmetric(load + HEXLOAD_EFFECTS_DIM, [&](std::size_t row, std::size_t column) {
        const std::size_t entry = triangle(state_of(row)) + state_of(column);
        return row < load ? self.momentum.filter.load_cov[row][column]
                          : self.filter.covariance[entry - triangle(states)];
    });
}

template <class Estimator, EstimatorKind kind> class InprocLink final : public EstimatorLink {
  public:
    InprocLink(const PlatformFile& platform, const EstimatorSettings& settings, double sampling_s,
               const std::optional<Tare>& tare)
        : config_(checked_firmware_config(tare ? with_tare(platform, tare->theta) : platform, settings,
                                          sampling_s)),
          tare_(tare) {
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
        last_status_ = tick(estimator_, config_, legs, estimate_);
        if (last_status_ != HEXLOAD_OK) {
            return {};
        }
        row_ = estimate_row(estimate_, sample.t_s, health_of(estimator_).bits);
        if ((health_of(estimator_).bits >> HEXLOAD_HEALTH_LOAD_CHANGED & 1U) != 0) {
            load_changes_s_.push_back(sample.t_s);
        }
        if constexpr (kind == EstimatorKind::momentum_effects) {
            add_machine(row_, machine_of(estimator_, estimate_));
        }
        if (tare_) {
            add_tare_sigma(row_, tare_->sigma, config_, kind);
        }
        return {&row_, 1};
    }

    std::vector<HealthCount> health_counts() const override {
        return named_health_counts(health_of(estimator_).count);
    }

    std::uint32_t refused() const override {
        return health_of(estimator_).refused;
    }

    std::string last_refusal() const override {
        return hexload_status_name(last_status_);
    }

    std::vector<double> load_changes_s() const override {
        return load_changes_s_;
    }

    std::vector<double> covariance() const override {
        return covariance_of(estimator_);
    }

    std::vector<ConfoundedParameter> confounded_parameters() const override {
        if constexpr (kind == EstimatorKind::momentum_effects) {
            return sim::confounded_parameters(machine_of(estimator_, estimate_));
        }
        return {};
    }

  private:
    hexload_config_t config_;
    std::optional<Tare> tare_;
    Estimator estimator_{};
    hexload_estimate_t estimate_{};
    hexload_status_t last_status_ = HEXLOAD_OK;
    EstimateRow row_;
    std::vector<double> load_changes_s_;
};

} // namespace

std::unique_ptr<EstimatorLink> make_inproc_link(const PlatformFile& platform,
                                                const EstimatorSettings& settings, double sampling_s,
                                                const std::optional<Tare>& tare) {
    using Kind = EstimatorKind;
    switch (settings.kind) {
    case Kind::paper:
        return std::make_unique<InprocLink<hexload_paper_t, Kind::paper>>(platform, settings, sampling_s,
                                                                          tare);
    case Kind::momentum_effects:
        return std::make_unique<InprocLink<hexload_momentum_effects_t, Kind::momentum_effects>>(
            platform, settings, sampling_s, tare);
    case Kind::momentum:
        break;
    }
    return std::make_unique<InprocLink<hexload_momentum_t, Kind::momentum>>(platform, settings, sampling_s,
                                                                            tare);
}

} // namespace hexload::sim
