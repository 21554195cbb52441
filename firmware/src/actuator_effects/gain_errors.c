#include "actuator_effects/gain_errors.h"

#include "algebra/real.h"
#include "momentum/attenuation.h"
#include "momentum/smoother.h"

/// Each of six gains is twice as uncertain as all together; a third of A9's bound, and a little more, is in
/// h_x or h_y. Hinges that are off by a thousandth of a leg's length turn its force by a fifth of a gain, and
/// of what that does half is hidden where all moments are known.
#define HIDDEN HEXLOAD_REAL(0.7)
#define HIDDEN_BY_BIASES HEXLOAD_REAL(0.07)

/// A bit of each parameter.
#define ALL ((1U << HEXLOAD_LOAD_DIM) - 1U)

/// In a mean of forces: beyond, what a kilonewton changes by would be lost to single precision.
#define MOST_TICKS HEXLOAD_REAL(262144.0)

void hexload_gain_errors_step(hexload_gain_errors_t* self, const hexload_delayed_tick_t* past) {
    const hexload_smooth_sample_t* smooth = &past->smooth;
    const hexload_real_t sigma_n = past->sensors->force_sigma_n;
    const hexload_real_t noise_n2 = HEXLOAD_SMOOTH_FORCE_VARIANCE * sigma_n * sigma_n;
    hexload_real_t square_n2 = HEXLOAD_REAL(0.0);
    self->ticks = hexload_min(self->ticks + HEXLOAD_REAL(1.0), MOST_TICKS);
    self->load_ticks += HEXLOAD_REAL(1.0);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        const bool stands_in = smooth->force_variance_n2[leg] > HEXLOAD_REAL(0.0); // for a lost one
        if (!stands_in) {
            const hexload_real_t force_n = smooth->sample.force_n[leg];
            const hexload_real_t change_n = force_n - self->mean_n[leg];
            self->mean_n[leg] += change_n / self->ticks;
            square_n2 += (change_n * (force_n - self->mean_n[leg])) - noise_n2;
        }
    }
    self->square = hexload_max(HEXLOAD_REAL(0.0), self->square + (square_n2 / (sigma_n * sigma_n)));
}

void hexload_gain_errors_forget(hexload_gain_errors_t* self) {
    const hexload_real_t all = hexload_max(self->ticks, self->load_ticks);
    if (all > HEXLOAD_REAL(0.0)) {
        self->square_before = (self->square + ((all - self->load_ticks) * self->square_before)) / all;
    }
    self->square = HEXLOAD_REAL(0.0);
    self->load_ticks = HEXLOAD_REAL(0.0);
}

/// Is some moment of platform and load known no better than to a half of it, with what misfits and late legs
/// leave?
static bool is_blind(const hexload_momentum_t* estimator) {
    const hexload_momentum_filter_t* filter = &estimator->filter;
    bool is = false;
    for (int axis = 0; axis < 3; axis++) {
        const int k = (int)HEXLOAD_LOAD_IXX + axis;
        const hexload_real_t own = filter->load_cov[k][k];
        const hexload_real_t factor = estimator->supervisor.kept[k];
        const hexload_real_t late = hexload_attenuation_late(filter, axis);
        const hexload_real_t half = HEXLOAD_REAL(0.5) * (filter->platform[k] + filter->theta[k]);
        is = is || (hexload_max(factor * factor * own, own + (late * late)) > (half * half));
    }
    return is;
}

void hexload_gain_errors_widen(const hexload_gain_errors_t* self, const hexload_config_t* config,
                               const hexload_momentum_t* estimator, uint32_t confounded,
                               hexload_real_t sigma[HEXLOAD_LOAD_DIM]) {
    const bool is_blind_to_some = is_blind(estimator);
    const hexload_real_t off = (is_blind_to_some ? HIDDEN : HIDDEN_BY_BIASES) * config->tolerances.force_gain;
    const hexload_real_t changes = self->square + (self->load_ticks * self->square_before);
    const hexload_real_t square = off * off * changes;
    const uint32_t hidden = is_blind_to_some ? ALL : confounded;
    const uint32_t open = (config->rig.direction_count == 0U) ? hidden : 0U;
    for (uint32_t k = 0; (open >> k) != 0U; k++) {
        if (((open >> k) & 1U) != 0U) {
            sigma[k] = hexload_sqrt((sigma[k] * sigma[k]) + (square * estimator->filter.load_cov[k][k]));
        }
    }
}
