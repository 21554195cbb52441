#include "config_initialiser.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstdint>
#include <string_view>

namespace hexload::platform {
namespace {

constexpr std::size_t numbers_per_line = 3;

std::string literal(hexload_real_t value) {
    std::string digits = fmt::format("{}", value); // the shortest that reads back as the same number
    if (digits.find_first_of(".e") == std::string::npos) {
        digits += ".0";
    }
    return fmt::format("HEXLOAD_REAL({})", digits);
}

class Initialiser {
  public:
    void value(std::string_view field, hexload_real_t number, std::string_view unit) {
        assign(field, literal(number), unit);
    }
    void value(std::string_view field, std::uint32_t count, std::string_view unit) {
        assign(field, fmt::format("{}", count), unit);
    }
    void word(std::string_view field, std::string_view name) {
        assign(field, name, "");
    }
    template <std::size_t n>
    void value(std::string_view field, const hexload_real_t (&numbers)[n], std::string_view unit) {
        begin(fmt::format(".{} =", field), unit);
        add_numbers(numbers);
        end();
    }
    template <std::size_t n, std::size_t m>
    void value(std::string_view field, const hexload_real_t (&rows)[n][m], std::string_view unit) {
        begin(fmt::format(".{} =", field), unit);
        static_assert(m <= numbers_per_line);
        for (const auto& row : rows) {
            text_ += fmt::format("{}{{{}}},\n", indent(), joined(row, 0, m));
        }
        end();
    }
    // `opening`: ".name =", or nothing of an element of an array.
    void begin(std::string_view opening, std::string_view comment) {
        text_ += fmt::format("{}{}{}{{{}\n", indent(), opening, opening.empty() ? "" : " ", spaced(comment));
        depth_++;
    }
    void end() {
        depth_--;
        text_ += fmt::format("{}}}{}\n", indent(), depth_ == 0 ? "" : ",");
    }
    std::string take() {
        return std::move(text_);
    }

  private:
    void assign(std::string_view field, std::string_view words, std::string_view unit) {
        text_ += fmt::format("{}.{} = {},{}\n", indent(), field, words, spaced(unit));
    }
    template <std::size_t n> void add_numbers(const hexload_real_t (&numbers)[n]) {
        for (std::size_t first = 0; first < n; first += numbers_per_line) {
            text_ += fmt::format("{}{},\n", indent(),
                                 joined(numbers, first, std::min(n, first + numbers_per_line)));
        }
    }
    template <std::size_t n>
    static std::string joined(const hexload_real_t (&numbers)[n], std::size_t first, std::size_t end) {
        std::string text;
        for (std::size_t k = first; k < end; k++) {
            text += (k == first ? "" : ", ") + literal(numbers[k]);
        }
        return text;
    }
    static std::string spaced(std::string_view comment) {
        return comment.empty() ? "" : fmt::format(" // {}", comment);
    }
    std::string indent() const {
        return std::string(4 * depth_, ' ');
    }

    std::string text_;
    std::size_t depth_ = 0;
};

void write_machine(Initialiser& to, const hexload_config_t& config) {
    const hexload_geometry_t& geometry = config.geometry;
    to.begin(".geometry =", "");
    to.value("base_hinge_m", geometry.base_hinge_m, "m, base axes, z against gravity");
    to.value("platform_hinge_m", geometry.platform_hinge_m, "m, platform axes");
    to.value("home_leg_length_m", geometry.home_leg_length_m, "m");
    to.value("stroke_min_m", geometry.stroke_min_m, "m");
    to.value("stroke_max_m", geometry.stroke_max_m, "m");
    to.end();
    to.begin(".platform =", "empty, with what of the legs moves with the upper hinges");
    to.value("mass_kg", config.platform.mass_kg, "kg");
    to.value("com_m", config.platform.com_m, "m, platform axes");
    to.value("inertia_kg_m2", config.platform.inertia_kg_m2, "kg m^2 about O_A: xx, yy, zz, xy, xz, yz");
    to.end();
    const hexload_sensors_t& sensors = config.sensors;
    to.begin(".sensors =", "");
    to.value("displacement_sigma_m", sensors.displacement_sigma_m, "m");
    to.value("velocity_sigma_m_s", sensors.velocity_sigma_m_s, "m/s");
    to.value("force_sigma_n", sensors.force_sigma_n, "N");
    to.value("velocity_range_m_s", sensors.velocity_range_m_s, "m/s");
    to.value("force_range_n", sensors.force_range_n, "N");
    to.value("half_window_ticks", sensors.half_window_ticks, "0: there are velocity sensors");
    to.end();
    const hexload_tolerances_t& tolerances = config.tolerances;
    to.begin(".tolerances =", "what no motion shows, one standard deviation each");
    to.value("force_gain", tolerances.force_gain, "N/N, of all sensors alike");
    to.value("platform_mass", tolerances.platform_mass, "kg/kg");
    to.value("platform_com_m", tolerances.platform_com_m, "m");
    to.value("platform_inertia", tolerances.platform_inertia, "of each moment");
    to.end();
}

void write_paper(Initialiser& to, const hexload_paper_config_t& paper) {
    to.begin(".paper =", "");
    to.value("load_mass_kg", paper.load_mass_kg, "kg");
    to.value("prior_dz_sigma_m", paper.prior_dz_sigma_m, "m");
    to.value("prior_inertia_sigma_kg_m2", paper.prior_inertia_sigma_kg_m2, "kg m^2: Ixx, Iyy, Izz");
    to.value("gate_nis", paper.gate_nis, "");
    to.value("inconsistent_nis", paper.inconsistent_nis, "");
    to.value("nis_time_constant_s", paper.nis_time_constant_s, "s");
    to.value("converged_relative_sigma", paper.converged_relative_sigma, "");
    to.value("longest_gap_ticks", paper.longest_gap_ticks, "");
    to.value("longest_gate_ticks", paper.longest_gate_ticks, "");
    to.end();
}

void write_momentum(Initialiser& to, const hexload_config_t& config) {
    const hexload_momentum_config_t& momentum = config.momentum;
    to.begin(".momentum =", "");
    to.value("lag_ticks", momentum.lag_ticks, "");
    to.value("longest_gap_ticks", momentum.longest_gap_ticks, "");
    to.value("prior_mass_kg", momentum.prior_mass_kg, "kg");
    to.value("prior_mass_sigma_kg", momentum.prior_mass_sigma_kg, "kg");
    to.value("prior_moment_sigma_kg_m", momentum.prior_moment_sigma_kg_m, "kg m");
    to.value("prior_inertia_sigma_kg_m2", momentum.prior_inertia_sigma_kg_m2, "kg m^2");
    to.value("inconsistent_nis", momentum.inconsistent_nis, "");
    to.value("nis_time_constant_s", momentum.nis_time_constant_s, "s");
    to.value("converged_relative_sigma", momentum.converged_relative_sigma, "");
    to.value("excitation_time_constant_s", momentum.excitation_time_constant_s, "s");
    to.value("timing_s", momentum.timing_s, "s, of each leg's instant of sampling");
    to.end();
    const hexload_actuator_effects_config_t& effects = config.actuator_effects;
    to.begin(".actuator_effects =", "");
    to.value("prior_bias_sigma_n", effects.prior_bias_sigma_n, "N");
    to.value("prior_coulomb_sigma_n", effects.prior_coulomb_sigma_n, "N");
    to.value("prior_viscous_sigma_n_s_m", effects.prior_viscous_sigma_n_s_m, "N s/m");
    to.value("prior_tilt_sigma_m_s2", effects.prior_tilt_sigma_m_s2, "m/s^2");
    to.value("friction_speed_m_s", effects.friction_speed_m_s, "m/s");
    to.value("friction_shape", effects.friction_shape, "of its logarithm");
    to.value("leg_share", effects.leg_share, "kg/kg");
    to.end();
}

void write_direction(Initialiser& to, const hexload_rig_direction_t& direction) {
    to.begin("", "");
    to.value("force_offset_n", direction.force_offset_n, "N");
    to.value("force_gain", direction.force_gain, "N/N");
    to.value("coulomb_n", direction.coulomb_n, "N");
    to.value("stribeck_n", direction.stribeck_n, "N");
    to.value("growth_n_n", direction.growth_n_n, "N/N");
    to.value("viscous_n_s_m", direction.viscous_n_s_m, "N s/m");
    to.value("gravity_m_s2", direction.gravity_m_s2, "m/s^2: x, y");
    to.value("platform", direction.platform, "kg; kg m: hx, hy, hz; kg m^2: Ixx, Iyy, Izz, Ixy, Ixz, Iyz");
    to.value("base_hinge_m", direction.base_hinge_m, "m");
    to.value("platform_hinge_m", direction.platform_hinge_m, "m");
    to.end();
}

void write_rig(Initialiser& to, const hexload_rig_config_t& rig) {
    to.begin(".rig =", "what commissioning has found");
    to.value("force_offset_n", rig.force_offset_n, "N");
    to.value("force_gain", rig.force_gain, "N/N, beyond 1");
    to.value("coulomb_n", rig.coulomb_n, "N");
    to.value("stribeck_n", rig.stribeck_n, "N, more at rest");
    to.value("growth_n_n", rig.growth_n_n, "N/N, more under the leg's force");
    to.value("viscous_n_s_m", rig.viscous_n_s_m, "N s/m");
    to.value("stribeck_speed_m_s", rig.stribeck_speed_m_s, "m/s");
    to.value("reversal_speed_m_s", rig.reversal_speed_m_s, "m/s");
    to.value("presliding_m", rig.presliding_m, "m");
    to.value("force_delay_s", rig.force_delay_s, "s");
    to.value("velocity_delay_s", rig.velocity_delay_s, "s");
    to.value("leg_inertia_kg_m2", rig.leg_inertia_kg_m2, "kg m^2");
    to.value("leg_slide_kg_m", rig.leg_slide_kg_m, "kg m");
    to.value("leg_tilt_kg_m", rig.leg_tilt_kg_m, "kg m");
    to.value("direction_count", rig.direction_count, "");
    if (rig.direction_count > 0) {
        to.begin(".direction =", "what is still open, one standard deviation each");
        for (std::uint32_t n = 0; n < rig.direction_count && n < HEXLOAD_RIG_DIRECTIONS_MAX; n++) {
            write_direction(to, rig.direction[n]);
        }
        to.end();
    }
    to.end();
}

} // namespace

std::string config_initialiser(const hexload_config_t& config) {
    static constexpr std::array<std::string_view, HEXLOAD_KINDS> kinds = {
        "HEXLOAD_KIND_PAPER", "HEXLOAD_KIND_MOMENTUM", "HEXLOAD_KIND_MOMENTUM_EFFECTS"};
    Initialiser to;
    to.begin("", "");
    to.word("kind", kinds.at(static_cast<std::size_t>(config.kind)));
    to.value("tick_s", config.tick_s, "s");
    to.value("gravity_m_s2", config.gravity_m_s2, "m/s^2, against z");
    write_machine(to, config);
    write_paper(to, config.paper);
    write_momentum(to, config);
    write_rig(to, config.rig);
    to.end();
    return to.take();
}

} // namespace hexload::platform
