#include <hexload_sim/friction.hpp>

#include <cmath>

namespace hexload::sim {
namespace {

// Bristles relax at a = stiffness |v| / g, which a rod in full slide makes faster than an explicit step h
// follows. a / (1 + (a h / 2)^4)^(1/4) differs from a by less than the error of a fourth-order step, keeps a
// h below the 2 at which Runge-Kutta's contracts, and leaves the state in which the bristles end, g /
// stiffness, as it is.
Legs bristle_relief(const Legs& relaxation_1_s, double step_s) {
    return (1.0 + (0.5 * step_s * relaxation_1_s).square().square()).sqrt().sqrt().inverse();
}

// exp(-r^2), by which a leg that slides fast is spared: below 1e-17 it is less than the rounding of 1.
Legs breakaway_share(const Legs& relative_speed) {
    constexpr double negligible = 40.0;
    Legs share = relative_speed.square();
    for (int leg = 0; leg < 6; ++leg) {
        share(leg) = share(leg) < negligible ? std::exp(-share(leg)) : 0.0;
    }
    return share;
}

} // namespace

double Friction::coldness(double t_s) const {
    return settings_.cold_factor == 1.0
               ? 1.0
               : 1.0 + (settings_.cold_factor - 1.0) * std::exp(-t_s / settings_.warm_up_s);
}

FrictionForce Friction::at(const Legs& velocity_m_s, const Legs& leg_force_n, const Legs& bristle_m,
                           double coldness) const {
    FrictionForce friction;
    const Legs level_n = dry_level_n(velocity_m_s, leg_force_n, coldness);
    if (has_bristles_) {
        friction = of_bristles(velocity_m_s, level_n, bristle_m);
    } else {
        const double v0 = settings_.speed_m_s;
        friction.force_n = level_n * velocity_m_s / (velocity_m_s.square() + v0 * v0).sqrt();
    }
    friction.force_n += coldness * settings_.viscous_n_s_m * velocity_m_s;
    return friction;
}

Legs Friction::dry_level_n(const Legs& velocity_m_s, const Legs& leg_force_n, double coldness) const {
    Legs level_n = settings_.coulomb_n;
    if (settings_.law != FrictionLaw::coulomb) {
        level_n += (settings_.static_n - settings_.coulomb_n) *
                   breakaway_share(velocity_m_s / settings_.stribeck_speed_m_s);
    }
    if (settings_.force_share > 0.0) {
        level_n += settings_.force_share * leg_force_n.abs();
    }
    return coldness * level_n;
}

FrictionForce Friction::of_bristles(const Legs& velocity_m_s, const Legs& level_n,
                                    const Legs& bristle_m) const {
    // A leg without dry friction has bristles that do not bend.
    const Legs floor_n = level_n.max(1e-9);
    const Legs relaxation_1_s = settings_.bristle_stiffness_n_m * velocity_m_s.abs() / floor_n;
    FrictionForce friction;
    friction.bristle_rate_m_s =
        (velocity_m_s - relaxation_1_s * bristle_m) * bristle_relief(relaxation_1_s, step_s_);
    friction.force_n = settings_.bristle_stiffness_n_m * bristle_m +
                       settings_.bristle_damping_n_s_m * friction.bristle_rate_m_s;
    return friction;
}

} // namespace hexload::sim
