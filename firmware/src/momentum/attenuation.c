#include "momentum/attenuation.h"

#include "algebra/leg_blocks.h"
#include "algebra/linalg.h"
#include "front_end/plausibility.h"

/// Of the calls of a round one sees to the sigmas of moments, one to those of products, one to that of h_z,
/// in two a leg is late, in the others twists are compared. So all legs have been late after three rounds.
#define CALLS 20U
#define OF_MOMENTS 0U
#define OF_PRODUCTS 1U
#define OF_HEIGHT 2U
#define FIRST_LEG 3U
#define LATE_LEGS 2U
#define ROUNDS ((uint32_t)HEXLOAD_LEGS / LATE_LEGS)

/// Of what has moved: x, y, z of the angular velocity, and the velocity along x and y.
#define SHIFT 3

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

/// Squares of the angular velocity about x, y, z, and of the velocity along x and y together; platform axes.
static void find_squares(const hexload_motion_t* motion, const hexload_real_t twist[6],
                         hexload_real_t square[SHIFT + 1]) {
    hexload_real_t shift[3];
    hexload_real_t turn[3];
    hexload_to_platform(motion, &twist[0], shift);
    hexload_to_platform(motion, &twist[3], turn);
    for (int k = 0; k < SHIFT; k++) {
        square[k] = turn[k] * turn[k];
    }
    square[SHIFT] = (shift[0] * shift[0]) + (shift[1] * shift[1]);
}

/// What the platform does, and what would be none of it were one leg sampled at another instant. Each leg has
/// its turn, so that a sum over all of them is that of legs that are late independently of each other.
static void see_timing(hexload_momentum_t* estimator, const hexload_config_t* config,
                       const hexload_delayed_tick_t* past, uint32_t leg) {
    hexload_attenuation_t* self = &estimator->filter.attenuation;
    const hexload_motion_t* motion = &past->motion;
    const hexload_real_t* J = motion->J[leg];
    const hexload_real_t* acceleration = estimator->supervisor.acceleration;
    hexload_real_t late_m_s[HEXLOAD_LEGS] = {HEXLOAD_REAL(0.0)};
    hexload_real_t twist[6];
    hexload_real_t moved[SHIFT + 1];
    hexload_real_t late[SHIFT + 1];
    late_m_s[leg] =
        config->momentum.timing_s * (hexload_dot3(J, acceleration) + hexload_dot3(&J[3], &acceleration[3]));
    hexload_leg_blocks_solve(motion->jacobian, late_m_s, twist);
    find_squares(motion, twist, late);
    find_squares(motion, estimator->filter.smooth_twist, moved);
    for (int k = 0; k <= SHIFT; k++) {
        self->moved[k] += moved[k];
        self->late[k] += hexload_min((hexload_real_t)HEXLOAD_LEGS * late[k], moved[k]);
    }
}

/// The share of what has moved that may be none; 0..1.
static hexload_real_t late_share(const hexload_attenuation_t* self, int k) {
    const hexload_real_t moved = self->moved[k];
    return (moved > HEXLOAD_REAL(0.0)) ? (self->late[k] / moved) : HEXLOAD_REAL(0.0);
}

static hexload_real_t moment_of_all(const hexload_momentum_filter_t* filter, int k) {
    return filter->platform[HEXLOAD_LOAD_IXX + k] + filter->theta[HEXLOAD_LOAD_IXX + k];
}

/// e, as far as it stands out of its noise, times the moment of platform and load.
static hexload_real_t missing(const hexload_momentum_filter_t* filter, int k) {
    const hexload_real_t square = filter->attenuation.square[k];
    const hexload_real_t error = hexload_min(filter->attenuation.error[k], square); // a share is 1 at most
    const hexload_real_t beyond = (error * error) - (SIGMAS_SQUARE * square);
    const bool stands_out = (error > HEXLOAD_REAL(0.0)) && (beyond > HEXLOAD_REAL(0.0));
    return stands_out ? (beyond / (error * square) * moment_of_all(filter, k)) : HEXLOAD_REAL(0.0);
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

hexload_real_t hexload_attenuation_late(const hexload_momentum_filter_t* filter, int axis) {
    return late_share(&filter->attenuation, axis) * moment_of_all(filter, axis);
}

/// @param off what sigma is to have.
static void raise_factor(hexload_momentum_t* estimator, int k, hexload_real_t off) {
    hexload_real_t* factor = &estimator->supervisor.kept[k];
    const hexload_real_t square = HEXLOAD_REAL(1.0) + (off * off / variance_without(estimator, k));
    *factor = hexload_max(*factor, hexload_sqrt(square));
}

static void raise_moments(hexload_momentum_t* estimator) {
    const hexload_momentum_filter_t* filter = &estimator->filter;
    for (int k = 0; k < 3; k++) {
        raise_factor(estimator, (int)HEXLOAD_LOAD_IXX + k,
                     missing(filter, k) + hexload_attenuation_late(filter, k));
    }
}

/// A product is told by a turning about either of its axes.
static void raise_products(hexload_momentum_t* estimator) {
    static const uint8_t axes[3][2] = {{0, 1}, {0, 2}, {1, 2}};
    const hexload_momentum_filter_t* filter = &estimator->filter;
    for (int n = 0; n < 3; n++) {
        const int i = (int)axes[n][0];
        const int j = (int)axes[n][1];
        const hexload_real_t late =
            hexload_min(late_share(&filter->attenuation, i), late_share(&filter->attenuation, j)) *
            (moment_of_all(filter, i) + moment_of_all(filter, j));
        raise_factor(estimator, (int)HEXLOAD_LOAD_IXY + n,
                     HEXLOAD_REAL(0.5) * (missing(filter, i) + missing(filter, j) + late));
    }
}

/// Torques about x and y tell h_z where the platform turns about x or y, or shifts. Where neither is certain
/// it may be anything up to the mass at the hinges' distance from O_A.
static void raise_height(hexload_momentum_t* estimator, const hexload_config_t* config) {
    const hexload_momentum_filter_t* filter = &estimator->filter;
    const hexload_attenuation_t* self = &filter->attenuation;
    const hexload_real_t share =
        hexload_min(late_share(self, SHIFT), hexload_min(late_share(self, 0), late_share(self, 1)));
    const hexload_real_t mass_kg = filter->platform[HEXLOAD_LOAD_M] + filter->theta[HEXLOAD_LOAD_M];
    hexload_real_t square_m2 = HEXLOAD_REAL(0.0);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        const hexload_real_t* hinge_m = config->geometry.platform_hinge_m[leg];
        square_m2 += hexload_dot3(hinge_m, hinge_m) / (hexload_real_t)HEXLOAD_LEGS;
    }
    raise_factor(estimator, (int)HEXLOAD_LOAD_HZ, share * mass_kg * hexload_sqrt(square_m2));
}

void hexload_attenuation_step(hexload_momentum_t* estimator, const hexload_config_t* config,
                              const hexload_delayed_tick_t* past) {
    hexload_attenuation_t* self = &estimator->filter.attenuation;
    const bool is_bridged = estimator->lost.displacement_ticks > 0U; // by velocities, half a tick ahead
    if (hexload_plausibility_is_idle(&estimator->plausibility) && !is_bridged) {
        self->calls = (self->calls + 1U) % (ROUNDS * CALLS);
        const uint32_t call = self->calls % CALLS;
        if (call == OF_MOMENTS) {
            raise_moments(estimator);
        } else if (call == OF_PRODUCTS) {
            raise_products(estimator);
            bound(self);
        } else if (call == OF_HEIGHT) {
            raise_height(estimator, config);
        } else if (call < (FIRST_LEG + LATE_LEGS)) {
            see_timing(estimator, config, past, (LATE_LEGS * (self->calls / CALLS)) + call - FIRST_LEG);
        } else {
            compare(self, past, &estimator->filter.smooth_twist[3]);
        }
    }
}
