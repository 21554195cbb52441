// Friction of the six rods, which the chamber pressures and so the force sensors do not show.
//
// Levels of dry friction in N, f the leg's force: Coulomb C = coulomb_n + force_share |f|, at rest
// S = static_n + force_share |f|; between them, by Stribeck, g(v) = C + (S - C) exp(-(v / stribeck_speed)^2).
//
//     coulomb    F = C v / sqrt(v^2 + speed^2) + viscous v
//     stribeck   F = g v / sqrt(v^2 + speed^2) + viscous v
//     lugre      F = stiffness z + damping z' + viscous v,  z' = v - stiffness |v| / g(v) z
//
// z is the mean deflection of bristles between rod and seal (Canudas de Wit, Olsson, Astrom, Lischinsky, IEEE
// Trans. Automatic Control 40, 1995, 419-425): before it slides a rod gives way like a spring.
// A cold leg rubs more: C, S and viscous are multiplied by 1 + (cold_factor - 1) exp(-t / warm_up).
#pragma once

#include <hexload_sim/types.hpp>

namespace hexload::sim {

enum class FrictionLaw { coulomb, stribeck, lugre };

// None by default, as in the paper.
struct FrictionSettings {
    FrictionLaw law = FrictionLaw::coulomb;
    Legs coulomb_n = Legs::Zero();
    Legs static_n = Legs::Zero(); // stribeck and lugre; there at least coulomb_n
    Legs viscous_n_s_m = Legs::Zero();
    double speed_m_s = 5e-3;            // coulomb and stribeck: 71 % of the dry friction at this speed
    double stribeck_speed_m_s = 10e-3;  // stribeck and lugre
    double force_share = 0.0;           // N of dry friction per N of the leg's force
    double bristle_stiffness_n_m = 2e6; // lugre: 80 N give way by 40 um
    double bristle_damping_n_s_m = 500.0;
    double cold_factor = 1.0; // at t = 0
    double warm_up_s = 60.0;

    bool exists() const {
        return (coulomb_n > 0.0).any() || (static_n > 0.0).any() || (viscous_n_s_m > 0.0).any() ||
               force_share > 0.0;
    }
};

struct FrictionForce {
    Legs force_n = Legs::Zero();          // opposes motion; to be subtracted from the leg's force
    Legs bristle_rate_m_s = Legs::Zero(); // lugre
};

class Friction {
  public:
    // step_s: of the integration, which bounds how fast bristles relax, see bristle_relief in the source.
    Friction(const FrictionSettings& settings, double step_s)
        : settings_(settings), step_s_(step_s), exists_(settings.exists()),
          has_bristles_(exists_ && settings.law == FrictionLaw::lugre) {}

    bool exists() const {
        return exists_;
    }
    bool has_bristles() const {
        return has_bristles_;
    }

    // What multiplies friction this long after the start.
    double coldness(double t_s) const;

    FrictionForce at(const Legs& velocity_m_s, const Legs& leg_force_n, const Legs& bristle_m,
                     double coldness) const;

    // Energy in the bristles.
    double stored_j(const Legs& bristle_m) const {
        return 0.5 * settings_.bristle_stiffness_n_m * bristle_m.square().sum();
    }

  private:
    Legs dry_level_n(const Legs& velocity_m_s, const Legs& leg_force_n, double coldness) const;
    FrictionForce of_bristles(const Legs& velocity_m_s, const Legs& level_n, const Legs& bristle_m) const;

    FrictionSettings settings_;
    double step_s_;
    bool exists_;
    bool has_bristles_;
};

} // namespace hexload::sim
