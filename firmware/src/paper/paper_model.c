#include "paper/paper_model.h"

#include "algebra/linalg.h"

/// The linearisation's error is the same from tick to tick, so it adds up over the filter's memory where
/// white noise would not: its variance counts this many times (D14). Larger: a slower start; 0: overconfident
/// on violent motions.
#define LINEARISATION_ERROR_TICKS HEXLOAD_REAL(5.0)

enum { COUPLING_PASSES = 3 };

/// D, and the cautious D of the derivatives: one sigma on top keeps an early Jacobian from claiming
/// information that its wrong linearisation point does not have (D14).
static void combined_inertia(const hexload_paper_filter_t* filter, hexload_real_t lever_m,
                             hexload_real_t D[3], hexload_real_t cautious_D[3]) {
    const hexload_real_t reduced_mass_kg = filter->constants.reduced_mass_kg;
    const hexload_real_t lever_variance = HEXLOAD_REAL(4.0) * reduced_mass_kg * reduced_mass_kg * lever_m *
                                          lever_m * filter->param_cov[HEXLOAD_PAPER_DZ][HEXLOAD_PAPER_DZ];
    HEXLOAD_UNROLL
    for (int k = 0; k < 3; k++) {
        const int own = HEXLOAD_PAPER_IXX + k;
        hexload_real_t variance = filter->param_cov[own][own];
        D[k] = filter->constants.inertia_kg_m2[k] + filter->param[own];
        if (k < 2) {
            D[k] = hexload_fma(reduced_mass_kg * lever_m, lever_m, D[k]);
            variance += lever_variance;
        }
        cautious_D[k] = D[k] + hexload_sqrt(variance);
    }
}

/// What the derivatives (34) by dz and by a row's own inertia make of the torque about an axis and of the
/// force that dz turns into such torque. They are linear in both, so noise in the forces passes the same way.
typedef struct derivative_gains {
    hexload_real_t by_torque[3]; ///< of the derivative by the row's inertia
    hexload_real_t by_side[2];   ///< of the derivative by dz
    hexload_real_t lever_kg_m;   ///< d D / d dz: dz works on D as an inertia does, this many times
} derivative_gains_t;

static derivative_gains_t gains_of(const hexload_paper_filter_t* filter, const hexload_real_t cautious_D[3],
                                   hexload_real_t lever_m, hexload_real_t dt_s) {
    const hexload_paper_constants_t* constants = &filter->constants;
    derivative_gains_t gains = {.lever_kg_m = HEXLOAD_REAL(2.0) * constants->reduced_mass_kg * lever_m};
    for (int k = 0; k < 3; k++) {
        gains.by_torque[k] = -dt_s / (cautious_D[k] * cautious_D[k]);
        if (k < 2) {
            gains.by_side[k] = dt_s * constants->mass_share / cautious_D[k];
        }
    }
    return gains;
}

/// Noise of one leg's force in this tick, from the third difference of its last four values: a motion passes
/// it with less than a hundredth of the noise, so this holds where the stated sigma does not.
static hexload_real_t force_noise_seen(const hexload_paper_filter_t* filter,
                                       const hexload_present_tick_t* now, int leg) {
    if (filter->history < HEXLOAD_FORCE_HISTORY) {
        return now->sensors.force_sigma_n;
    }
    const hexload_real_t difference_n =
        hexload_fma(HEXLOAD_REAL(3.0), filter->last_force_n[1][leg] - filter->last_force_n[0][leg],
                    now->sample->force_n[leg] - filter->last_force_n[2][leg]);
    return difference_n * HEXLOAD_REAL(0.2236068); // 1 / sqrt(1 + 9 + 9 + 1)
}

/// Noise of the forces about the common centre of mass, platform axes.
typedef struct force_noise {
    hexload_real_t per_newton[3][3]; ///< covariance of the torque for 1 N on each leg; lower triangle
    hexload_real_t torque[3];        ///< its variances for the noise seen
    hexload_real_t side[2];          ///< variances of the force beside an axis, likewise
    hexload_real_t mixed[2];         ///< covariance of the two
} force_noise_t;

static void sum_over_legs(const hexload_paper_filter_t* filter, const hexload_config_t* config,
                          const hexload_present_tick_t* now, const hexload_real_t com_m[3],
                          force_noise_t* noise) {
    const hexload_motion_t* motion = now->motion;
    *noise = (force_noise_t){0};
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        const hexload_real_t* hinge_m = config->geometry.platform_hinge_m[leg];
        const hexload_real_t arm_m[3] = {hinge_m[0] - com_m[0], hinge_m[1] - com_m[1], hinge_m[2] - com_m[2]};
        const hexload_real_t seen_n = force_noise_seen(filter, now, leg);
        hexload_real_t direction[3];
        hexload_real_t torque[3];
        hexload_motion_to_platform(motion, motion->J[leg], direction);
        cross3(arm_m, direction, torque);
        const hexload_real_t side[2] = {direction[1], -direction[0]};
        HEXLOAD_UNROLL
        for (int i = 0; i < 3; i++) {
            const hexload_real_t torque_seen = seen_n * torque[i];
            HEXLOAD_UNROLL
            for (int j = 0; j <= i; j++) {
                noise->per_newton[i][j] = hexload_fma(torque[i], torque[j], noise->per_newton[i][j]);
            }
            noise->torque[i] = hexload_fma(torque_seen, torque_seen, noise->torque[i]);
            if (i < 2) {
                const hexload_real_t side_seen = seen_n * side[i];
                noise->side[i] = hexload_fma(side_seen, side_seen, noise->side[i]);
                noise->mixed[i] = hexload_fma(side_seen, torque_seen, noise->mixed[i]);
            }
        }
    }
}

/// Q of the rates, and the variances of the noise in N.
static void add_force_noise(const force_noise_t* noise, const derivative_gains_t* gains,
                            hexload_real_t impulse_sigma_n_s, hexload_paper_model_t* model) {
    hexload_real_t by_torque[3]; // of the rate
    HEXLOAD_UNROLL
    for (int i = 0; i < 3; i++) {
        by_torque[i] = impulse_sigma_n_s / model->inertia_kg_m2[i];
        HEXLOAD_UNROLL
        for (int j = 0; j <= i; j++) {
            model->noise[i][j] = by_torque[i] * by_torque[j] * noise->per_newton[i][j];
        }
        const hexload_real_t by_own = gains->by_torque[i];
        model->jacobian_noise.inertia[i] = by_own * by_own * noise->torque[i];
        if (i < 2) { // (by_side side + lever by_own torque) times itself, and times by_own torque
            const hexload_real_t by_side = gains->by_side[i];
            const hexload_real_t by_lever = gains->lever_kg_m * by_own;
            const hexload_real_t with_torque =
                hexload_fma(by_side, noise->mixed[i], by_lever * noise->torque[i]);
            const hexload_real_t with_side = hexload_fma(by_side, noise->side[i], by_lever * noise->mixed[i]);
            model->jacobian_noise.mixed[i] = by_own * with_torque;
            model->jacobian_noise.dz[i] = hexload_fma(by_side, with_side, by_lever * with_torque);
        }
    }
}

/// Adds the second-order terms that N leaves out to Q: omega' = torque / D errs by (d D / D)^2 of itself, and
/// the torque's share of dz by d D / D. They fade as the parameters become known (D14).
static void add_linearisation_error(const hexload_paper_filter_t* filter, const hexload_real_t force_n[3],
                                    hexload_real_t dt_s, hexload_paper_model_t* model) {
    const hexload_real_t moved = dt_s * filter->constants.mass_share;
    const hexload_real_t dz_variance = filter->param_cov[HEXLOAD_PAPER_DZ][HEXLOAD_PAPER_DZ];
    HEXLOAD_UNROLL
    for (int k = 0; k < 3; k++) {
        const hexload_real_t D = model->inertia_kg_m2[k];
        const hexload_real_t relative_sigma = model->cautious_inertia_kg_m2[k] / D - HEXLOAD_REAL(1.0);
        const hexload_real_t relative_variance = relative_sigma * relative_sigma;
        const hexload_real_t by_square = model->rate_step_rad_s[k] * relative_variance;
        hexload_real_t second_order = HEXLOAD_REAL(2.0) * by_square * by_square;
        if (k < 2) {
            const hexload_real_t by_dz = moved * force_n[1 - k] / D;
            second_order = hexload_fma(by_dz * by_dz * dz_variance, relative_variance, second_order);
        }
        model->noise[k][k] = hexload_fma(LINEARISATION_ERROR_TICKS, second_order, model->noise[k][k]);
    }
}

/// Products of inertia xy, xz, yz about the common centre of mass: the platform's, as the load has none.
static void combined_products(const hexload_paper_filter_t* filter, const hexload_platform_t* platform,
                              hexload_real_t lever_m, hexload_real_t products_kg_m2[3]) {
    const hexload_real_t* I = platform->inertia_kg_m2;
    const hexload_real_t* c = platform->com_m;
    const hexload_real_t own_kg = platform->mass_kg;
    const hexload_real_t reduced_kg = filter->constants.reduced_mass_kg;
    products_kg_m2[0] = I[HEXLOAD_I_XY] + (own_kg - reduced_kg) * c[0] * c[1];
    products_kg_m2[1] = I[HEXLOAD_I_XZ] + c[0] * (own_kg * c[2] + reduced_kg * lever_m);
    products_kg_m2[2] = I[HEXLOAD_I_YZ] + c[1] * (own_kg * c[2] + reduced_kg * lever_m);
}

/// Product of a symmetric matrix without diagonal, xy, xz, yz, with a vector, added to out.
static inline void add_products(const hexload_real_t O[3], const hexload_real_t x[3], hexload_real_t out[3]) {
    out[0] = hexload_fma(O[0], x[1], hexload_fma(O[1], x[2], out[0]));
    out[1] = hexload_fma(O[0], x[0], hexload_fma(O[2], x[2], out[1]));
    out[2] = hexload_fma(O[1], x[0], hexload_fma(O[2], x[1], out[2]));
}

/// Takes omega x I omega and the products' share of I omega' off the torque, I with diagonal D and products
/// O, so that D omega' = torque remains. omega is that of mid-step: at the step's start it would lag by half
/// a tick. Products are a small part of D, and each pass leaves that part of the error, of which there is
/// little to begin with.
static void take_off_coupling(const hexload_real_t rate_rad_s[3], const hexload_real_t D[3],
                              const hexload_real_t O[3], hexload_real_t dt_s, hexload_real_t torque[3]) {
    hexload_real_t acceleration[3] = {torque[0] / D[0], torque[1] / D[1], torque[2] / D[2]};
    hexload_real_t coupling[3];
    HEXLOAD_UNROLL
    for (int pass = 0; pass < COUPLING_PASSES; pass++) {
        hexload_real_t middle[3];
        hexload_real_t momentum[3];
        HEXLOAD_UNROLL
        for (int k = 0; k < 3; k++) {
            middle[k] = hexload_fma(HEXLOAD_REAL(0.5) * dt_s, acceleration[k], rate_rad_s[k]);
            momentum[k] = D[k] * middle[k];
        }
        add_products(O, middle, momentum);
        cross3(middle, momentum, coupling);
        add_products(O, acceleration, coupling);
        HEXLOAD_UNROLL
        for (int k = 0; k < 3; k++) {
            acceleration[k] = (torque[k] - coupling[k]) / D[k];
        }
    }
    HEXLOAD_UNROLL
    for (int k = 0; k < 3; k++) {
        torque[k] -= coupling[k];
    }
}

/// The force across the z axis that dz turns into torque: not what it takes to turn the platform's own centre
/// of mass, beside the axis, about O_A. dz has a part in that torque by the products of inertia, m s c_x and
/// m s c_y, which undoes the force's: a load on the axis of turning is not moved (D14).
/// @param acceleration_rad_s2 about z. @param[in,out] force_n of the legs.
static void take_off_own_force(const hexload_platform_t* platform, const hexload_real_t rate_rad_s[3],
                               hexload_real_t acceleration_rad_s2, hexload_real_t force_n[3]) {
    const hexload_real_t first_moment[2] = {platform->mass_kg * platform->com_m[0],
                                            platform->mass_kg * platform->com_m[1]};
    const hexload_real_t across =
        hexload_fma(first_moment[0], rate_rad_s[0], first_moment[1] * rate_rad_s[1]);
    const hexload_real_t square = rate_rad_s[2] * rate_rad_s[2];
    force_n[0] += hexload_fma(first_moment[1], acceleration_rad_s2,
                              hexload_fma(first_moment[0], square, -rate_rad_s[0] * across));
    force_n[1] -= hexload_fma(first_moment[0], acceleration_rad_s2,
                              hexload_fma(-first_moment[1], square, rate_rad_s[1] * across));
}

/// (25) as Euler's equation about the common centre of mass, and its derivatives (33)-(35).
void hexload_paper_model_linearise(const hexload_paper_filter_t* filter, const hexload_config_t* config,
                                   const hexload_present_tick_t* now, const hexload_wrench_t* wrench,
                                   hexload_real_t dt_s, hexload_paper_model_t* model) {
    const hexload_paper_constants_t* constants = &filter->constants;
    const hexload_real_t dz_m = filter->param[HEXLOAD_PAPER_DZ];
    const hexload_real_t lever_m = dz_m - config->platform.com_m[2];
    const hexload_real_t com_m[3] = {constants->com_offset_m[0], constants->com_offset_m[1],
                                     constants->com_offset_m[2] + constants->mass_share * dz_m};
    hexload_real_t force_n[3];
    hexload_real_t shift[3];
    hexload_real_t products[3];
    hexload_real_t torque[3]; // of the legs about the common centre of mass
    hexload_real_t acceleration[3];
    force_noise_t noise;
    combined_inertia(filter, lever_m, model->inertia_kg_m2, model->cautious_inertia_kg_m2);
    for (int k = 0; k < 3; k++) { // forces are trapezoidal between ticks
        force_n[k] = HEXLOAD_REAL(0.5) * (wrench->force_n[k] + filter->last_wrench.force_n[k]);
        torque[k] = HEXLOAD_REAL(0.5) * (wrench->moment_nm[k] + filter->last_wrench.moment_nm[k]);
    }
    cross3(com_m, force_n, shift);
    for (int k = 0; k < 3; k++) {
        torque[k] -= shift[k];
    }
    combined_products(filter, &config->platform, lever_m, products);
    take_off_coupling(filter->rate_rad_s, model->inertia_kg_m2, products, dt_s, torque);

    const derivative_gains_t gains = gains_of(filter, model->cautious_inertia_kg_m2, lever_m, dt_s);
    HEXLOAD_UNROLL
    for (int k = 0; k < 3; k++) {
        acceleration[k] = torque[k] / model->inertia_kg_m2[k];
        model->rate_step_rad_s[k] = dt_s * acceleration[k];
        model->by_inertia[k] = gains.by_torque[k] * torque[k];
        const hexload_real_t cautious_D = model->cautious_inertia_kg_m2[k];
        model->noise_lever_kg_m2[k] = cautious_D * cautious_D / model->inertia_kg_m2[k];
    }
    take_off_own_force(&config->platform, filter->rate_rad_s, acceleration[2], force_n);
    model->by_dz[0] = hexload_fma(gains.by_side[0], force_n[1], gains.lever_kg_m * model->by_inertia[0]);
    model->by_dz[1] = hexload_fma(-gains.by_side[1], force_n[0], gains.lever_kg_m * model->by_inertia[1]);
    model->by_dz[2] = HEXLOAD_REAL(0.0);
    sum_over_legs(filter, config, now, com_m, &noise);
    add_force_noise(&noise, &gains, dt_s * now->sensors.force_sigma_n, model);
    add_linearisation_error(filter, force_n, dt_s, model);
}
