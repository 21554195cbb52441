#include "momentum/attenuation.h"

#include "front_end/plausibility.h"

/// Of the calls of a round one sees to the sigmas of moments, one to those of products, in the others twists
/// are compared.
#define OF_MOMENTS 0U
#define OF_PRODUCTS 1U
#define CALLS 8U

/// What is slower is not counted: of the twists that are compared, two in three, so many make 12 ticks.
#define SLOW_TWISTS HEXLOAD_REAL(8.0)

/// Of a sum of squares in those of noise, where single precision begins to lose steps below one.
#define LARGEST_SQUARE HEXLOAD_REAL(16777216.0)

/// Chi-square with 3 degrees of freedom: of axes with independent noise it is exceeded in 0.1 %.
#define LARGEST_OFF_SQUARE HEXLOAD_REAL(16.27)

/// Two and a half standard deviations, squared: chance is beyond that once in 160 times.
#define SIGMAS_SQUARE HEXLOAD_REAL(6.25)

/// Adds a twist to both sums of each axis. What is faster than the smoother follows, as a shock between
/// missing samples, is no noise: it is left out.
static void compare(hexload_attenuation_t* self, const hexload_delayed_tick_t* past,
                    const hexload_real_t smooth_rad_s[3]) {
    const hexload_motion_t* motion = &past->motion;
    const hexload_real_t sigma_m_s = past->sensors->velocity_sigma_m_s;
    const hexload_real_t accuracy_s2_m2 = HEXLOAD_REAL(1.0) / (sigma_m_s * sigma_m_s);
    hexload_real_t smooth[3];
    hexload_real_t off[3];
    hexload_real_t scale[3];
    hexload_real_t square = HEXLOAD_REAL(0.0);
    hexload_to_platform(motion, smooth_rad_s, smooth);
    hexload_to_platform(motion, &motion->twist[3], off);
    for (int k = 0; k < 3; k++) {
        scale[k] = accuracy_s2_m2 / past->smoother->rate_gain[k];
        off[k] = smooth[k] - off[k];
        square += scale[k] * off[k] * off[k];
    }
    if (square < LARGEST_OFF_SQUARE) {
        for (int k = 0; k < 3; k++) {
            self->slow_rad_s[k] += (smooth[k] - self->slow_rad_s[k]) / SLOW_TWISTS;
            const hexload_real_t fast = smooth[k] - self->slow_rad_s[k];
            self->error[k] += scale[k] * fast * off[k];
            self->square[k] += scale[k] * fast * fast;
        }
    }
}

/// e, as far as it stands out of its noise, times the moment of platform and load.
static hexload_real_t missing(const hexload_momentum_filter_t* filter, int k) {
    const hexload_real_t square = filter->attenuation.square[k];
    const hexload_real_t error = hexload_min(filter->attenuation.error[k], square); // a share is 1 at most
    const hexload_real_t beyond = (error * error) - (SIGMAS_SQUARE * square);
    const hexload_real_t moment =
        filter->platform[HEXLOAD_LOAD_IXX + k] + filter->theta[HEXLOAD_LOAD_IXX + k];
    const bool stands_out = (error > HEXLOAD_REAL(0.0)) && (beyond > HEXLOAD_REAL(0.0));
    return stands_out ? (beyond / (error * square) * moment) : HEXLOAD_REAL(0.0);
}

/// Sigma as it was published last, without this factor: other misfits may have widened it already.
static hexload_real_t variance_without(const hexload_momentum_t* estimator, int k) {
    const hexload_real_t sigma = estimator->sigma[k] / estimator->supervisor.kept[k];
    return hexload_max(estimator->filter.load_cov[k][k], sigma * sigma);
}

/// Old twists fade.
static void bound(hexload_attenuation_t* self) {
    for (int k = 0; k < 3; k++) {
        const hexload_real_t share =
            (self->square[k] > LARGEST_SQUARE) ? HEXLOAD_REAL(0.5) : HEXLOAD_REAL(1.0);
        self->error[k] *= share;
        self->square[k] *= share;
    }
}

/// @param first entry of the tensor, of three.
static void raise_factors(hexload_momentum_t* estimator, int first) {
    static const uint8_t axes[HEXLOAD_I_DIM][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}};
    const hexload_momentum_filter_t* filter = &estimator->filter;
    const hexload_real_t of_axis[3] = {missing(filter, 0), missing(filter, 1), missing(filter, 2)};
    for (int n = first; n < (first + 3); n++) {
        const int k = HEXLOAD_LOAD_IXX + n;
        const hexload_real_t mean = HEXLOAD_REAL(0.5) * (of_axis[axes[n][0]] + of_axis[axes[n][1]]);
        const hexload_real_t square = HEXLOAD_REAL(1.0) + (mean * mean / variance_without(estimator, k));
        hexload_real_t* factor = &estimator->supervisor.kept[k];
        *factor = hexload_max(*factor, hexload_sqrt(square));
    }
}

void hexload_attenuation_step(hexload_momentum_t* estimator, const hexload_delayed_tick_t* past) {
    hexload_attenuation_t* self = &estimator->filter.attenuation;
    const bool is_bridged = estimator->lost.displacement_ticks > 0U; // by velocities, half a tick ahead
    if (hexload_plausibility_is_idle(&estimator->plausibility) && !is_bridged) {
        self->calls = (self->calls + 1U) % CALLS;
        if (self->calls == OF_MOMENTS) {
            raise_factors(estimator, 0);
        } else if (self->calls == OF_PRODUCTS) {
            raise_factors(estimator, 3);
            bound(self);
        } else {
            compare(self, past, &estimator->filter.smooth_twist[3]);
        }
    }
}
