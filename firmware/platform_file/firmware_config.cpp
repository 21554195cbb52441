#include "firmware_config.hpp"

#include "estimator_code.hpp"
#include "input_error.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <tuple>

namespace hexload::platform {

namespace {

hexload_real_t real(double value) {
    return static_cast<hexload_real_t>(value);
}

template <int size, std::size_t count>
void copy(const Eigen::Matrix<double, size, 1>& from, hexload_real_t (&to)[count]) {
    static_assert(size == count);
    std::transform(from.begin(), from.end(), to, real);
}

hexload_rig_direction_t firmware_direction(const RigDirection& from) {
    hexload_rig_direction_t to{};
    copy(from.force_offset_n, to.force_offset_n);
    copy(from.force_gain, to.force_gain);
    copy(from.coulomb_n, to.coulomb_n);
    copy(from.stribeck_n, to.stribeck_n);
    copy(from.growth_n_n, to.growth_n_n);
    copy(from.viscous_n_s_m, to.viscous_n_s_m);
    std::ranges::transform(from.gravity_m_s2, to.gravity_m_s2, real);
    copy(from.platform, to.platform);
    for (std::size_t leg = 0; leg < HEXLOAD_LEGS; leg++) {
        copy(from.base_hinges_m[leg], to.base_hinge_m[leg]);
        copy(from.platform_hinges_m[leg], to.platform_hinge_m[leg]);
    }
    return to;
}

void put_rig(const RigSettings& rig, hexload_config_t& config) {
    hexload_rig_config_t& to = config.rig;
    copy(rig.force_offset_n, to.force_offset_n);
    copy(rig.force_gain, to.force_gain);
    copy(rig.coulomb_n, to.coulomb_n);
    copy(rig.stribeck_n, to.stribeck_n);
    copy(rig.growth_n_n, to.growth_n_n);
    copy(rig.viscous_n_s_m, to.viscous_n_s_m);
    to.stribeck_speed_m_s = real(rig.stribeck_speed_m_s);
    to.reversal_speed_m_s = real(rig.reversal_speed_m_s);
    to.presliding_m = real(rig.presliding_m);
    to.leg_inertia_kg_m2 = real(rig.leg_inertia_kg_m2);
    to.leg_slide_kg_m = real(rig.leg_slide_kg_m);
    to.leg_tilt_kg_m = real(rig.leg_tilt_kg_m);
    static_assert(HEXLOAD_RIG_DIRECTIONS_MAX == 8, "as many as with_rig_file() takes");
    to.direction_count = static_cast<std::uint32_t>(rig.directions.size());
    std::ranges::transform(rig.directions, to.direction, firmware_direction);
    hexload_real_t gravity_m_s2[3];
    copy(rig.gravity_m_s2, gravity_m_s2);
    if (hexload_config_set_gravity(&config, gravity_m_s2) != HEXLOAD_OK) {
        throw InputError("rig.gravity_m_s2: expected a vector that points down");
    }
}

double hinge_radius_m(const PlatformFile& platform) {
    double sum_m = 0.0;
    for (const Vector3& hinge_m : platform.geometry.platform_hinges_m) {
        sum_m += hinge_m.norm();
    }
    return sum_m / static_cast<double>(platform.geometry.platform_hinges_m.size());
}

// The reader has refused what is out of range by itself; what is left follows from several numbers, and is
// told by those that the user wrote.
std::string refusal_of(std::string_view field, const PlatformFile& platform, double sampling_s) {
    const std::string file = platform.source.empty() ? "platform" : platform.source;
    if (field == "tick_s") {
        return fmt::format("tick_s is out of range: found {:g} s between samples, expected 0.0001 to 0.005 s",
                           sampling_s);
    }
    for (const auto& [late, key, delay_s] :
         {std::tuple{"rig.force_delay_s", "force_delay_s, with force_bandwidth_hz",
                     platform.sensors.force_delay_s},
          std::tuple{"rig.velocity_delay_s", "velocity_bandwidth_hz", platform.sensors.velocity_delay_s}}) {
        if (field == late && !platform.rig) {
            return fmt::format("{}: sensors.{}: found a channel that is {:.4g} s late, expected {} samples "
                               "of {:g} s at most",
                               file, key, delay_s, static_cast<int>(HEXLOAD_RIG_DELAY_TICKS_MAX), sampling_s);
        }
    }
    if (field.starts_with("momentum.prior_") || field.starts_with("actuator_effects.prior_")) {
        return fmt::format(
            "{}: platform.mass_kg: found {:g} kg on hinges {:g} m from its centre, expected a machine "
            "whose load can be a few times as heavy: {} is out of range",
            file, platform.platform.mass_kg, hinge_radius_m(platform), field);
    }
    return fmt::format("{}: the estimator refuses its configuration: {} is out of range", file, field);
}

// What no sample may be beyond, where it is known what the legs can do: a leg that is pushed is faster than
// alone, and takes more than it can give.
constexpr double granted = 2.0;

void take_actuators(const ActuatorSettings& can, hexload_sensors_t& sensors) {
    if (can.leg_speed_m_s) {
        sensors.velocity_range_m_s =
            real(std::min(granted * *can.leg_speed_m_s, 50.0)); // the configuration's limits
    }
    if (can.leg_force_n) {
        sensors.force_range_n = real(std::min(granted * *can.leg_force_n, 1e8));
    }
}

void take_sensors(const PlatformFile& platform, hexload_config_t& config) {
    config.sensors.displacement_sigma_m = real(platform.sensors.displacement_sigma_m);
    config.sensors.force_sigma_n = real(platform.sensors.force_sigma_n);
    config.sensors.velocity_sigma_m_s = real(platform.sensors.velocity_sigma_m_s);
    take_actuators(platform.actuators, config.sensors);
    config.rig.force_delay_s = real(platform.sensors.force_delay_s);
    config.rig.velocity_delay_s = real(platform.sensors.velocity_delay_s);
    if (!platform.sensors.has_velocity) {
        hexload_config_set_no_velocity(&config); // at the sampling period of this estimator
        config.rig.velocity_delay_s = 0;
    }
}

void override_with(const std::optional<double>& value, hexload_real_t& field) {
    field = value ? real(*value) : field;
}

// What is known of offsets, friction and tilt beforehand: by the rig file or the declared tolerances, and
// then by what [estimator] says.
void override_effects(const PlatformFile& platform, const EstimatorSettings& settings,
                      hexload_config_t& config) {
    hexload_actuator_effects_config_t& to = config.actuator_effects;
    const auto of_tilt = [&platform](std::optional<double> tilt_rad) {
        return tilt_rad ? std::optional(*tilt_rad * platform.gravity_m_s2) : std::nullopt;
    };
    if (platform.rig) {
        const RigSigma& left = platform.rig->sigma;
        override_with(left.force_offset_n, to.prior_bias_sigma_n);
        override_with(left.coulomb_n, to.prior_coulomb_sigma_n);
        override_with(left.viscous_n_s_m, to.prior_viscous_sigma_n_s_m);
        override_with(left.gravity_m_s2, to.prior_tilt_sigma_m_s2);
    } else {
        override_with(platform.tolerances.force_offset_n, to.prior_bias_sigma_n);
        override_with(of_tilt(platform.tolerances.tilt_rad), to.prior_tilt_sigma_m_s2);
    }
    override_with(settings.bias_sigma_n, to.prior_bias_sigma_n);
    override_with(settings.coulomb_sigma_n, to.prior_coulomb_sigma_n);
    override_with(settings.viscous_sigma_n_s_m, to.prior_viscous_sigma_n_s_m);
    override_with(of_tilt(settings.tilt_sigma_rad), to.prior_tilt_sigma_m_s2);
    override_with(settings.friction_speed_m_s, to.friction_speed_m_s);
    override_with(platform.tolerances.friction_shape, to.friction_shape);
    if (platform.tolerances.platform_mass) { // with what of the legs hangs on it
        to.leg_share = real(0.0);
    }
}

// A steady force from outside is to gravity a platform of another mass and, off its centre, of another
// centre: as far from the origin as the hinges are.
void add_contact(const PlatformFile& platform, hexload_tolerances_t& to) {
    const double force_n = platform.tolerances.contact_force_n;
    const double weight_n = platform.platform.mass_kg * platform.gravity_m_s2;
    if (force_n > weight_n) {
        throw InputError(
            fmt::format("{}tolerances.contact_force_n: found {:g} N, expected the platform's weight, {:.4g} "
                        "N, at most",
                        platform.source.empty() ? "" : platform.source + ": ", force_n, weight_n));
    }
    const double share = force_n / weight_n;
    to.platform_mass = real(std::hypot(to.platform_mass, share));
    to.platform_com_m = real(std::hypot(to.platform_com_m, share * hinge_radius_m(platform)));
}

void override_tolerances(const PlatformFile& platform, const EstimatorSettings& settings,
                         hexload_config_t& config) {
    // The paper's filter knows no open directions, and takes off neither friction nor offsets nor delays.
    const bool is_as_declared = platform.rig && settings.kind == EstimatorKind::paper;
    const Tolerances& open = is_as_declared ? platform.rig->declared : platform.tolerances;
    override_with(open.force_gain_common, config.tolerances.force_gain);
    override_with(open.platform_mass, config.tolerances.platform_mass);
    override_with(open.platform_com_m, config.tolerances.platform_com_m);
    override_with(open.platform_inertia, config.tolerances.platform_inertia);
    override_with(platform.tolerances.timing_s, config.momentum.timing_s);
    add_contact(platform, config.tolerances);
}

} // namespace

hexload_config_t firmware_config(const PlatformFile& platform, const EstimatorSettings& settings,
                                 double sampling_s) {
    hexload_config_t config;
    hexload_config_default(&config);
    config.kind = kind_of(settings.kind);
    config.tick_s = real(sampling_s);
    for (std::size_t leg = 0; leg < HEXLOAD_LEGS; leg++) {
        copy(platform.geometry.base_hinges_m[leg], config.geometry.base_hinge_m[leg]);
        copy(platform.geometry.platform_hinges_m[leg], config.geometry.platform_hinge_m[leg]);
    }
    copy(platform.geometry.home_leg_length_m, config.geometry.home_leg_length_m);
    config.geometry.stroke_min_m = real(platform.geometry.stroke_min_m);
    config.geometry.stroke_max_m = real(platform.geometry.stroke_max_m);

    const Matrix3& inertia = platform.platform.inertia_kg_m2;
    config.platform.mass_kg = real(platform.platform.mass_kg);
    copy(platform.platform.com_m, config.platform.com_m);
    config.platform.inertia_kg_m2[HEXLOAD_I_XX] = real(inertia(0, 0));
    config.platform.inertia_kg_m2[HEXLOAD_I_YY] = real(inertia(1, 1));
    config.platform.inertia_kg_m2[HEXLOAD_I_ZZ] = real(inertia(2, 2));
    config.platform.inertia_kg_m2[HEXLOAD_I_XY] = real(inertia(0, 1));
    config.platform.inertia_kg_m2[HEXLOAD_I_XZ] = real(inertia(0, 2));
    config.platform.inertia_kg_m2[HEXLOAD_I_YZ] = real(inertia(1, 2));

    config.gravity_m_s2 = real(platform.gravity_m_s2);
    take_sensors(platform, config);
    if (platform.rig) {
        put_rig(*platform.rig, config);
    }
    hexload_config_set_momentum(&config);
    if (platform.known_mass_kg && settings.from_known_mass) {
        hexload_config_set_known_mass(&config, real(*platform.known_mass_kg));
    } else if (platform.known_mass_kg) {
        config.paper.load_mass_kg = real(*platform.known_mass_kg);
    }
    hexload_config_set_prior(&config,
                             settings.prior == PaperPrior::safe ? HEXLOAD_PRIOR_SAFE : HEXLOAD_PRIOR_PRINTED);
    override_effects(platform, settings, config);
    override_tolerances(platform, settings, config);
    return config;
}

hexload_config_t checked_firmware_config(const PlatformFile& platform, const EstimatorSettings& settings,
                                         double sampling_s) {
    if (settings.kind == EstimatorKind::paper && !platform.known_mass_kg) {
        throw InputError(
            (platform.source.empty() ? "" : platform.source + ": ") +
            "load.known_mass_kg: found nothing, expected the load's mass, which the paper's filter needs");
    }
    const hexload_config_t config = firmware_config(platform, settings, sampling_s);
    const char* bad_field = nullptr;
    if (hexload_config_check(&config, &bad_field) != HEXLOAD_OK) {
        throw InputError(refusal_of(bad_field, platform, sampling_s));
    }
    return config;
}

} // namespace hexload::platform
