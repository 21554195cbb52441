#include "momentum/momentum_supervisor.h"

#include "algebra/chi_square.h"
#include "algebra/linalg.h"
#include "configuration/health.h"
#include "front_end/residual_test.h"
#include "body/pseudo_inertia.h"
#include "momentum/tolerances.h"

#include <string.h>

enum { DIM = HEXLOAD_LOAD_DIM };

/// Mean NIS of the filter over FIT_S: twice the ideal, and five times, beyond which no verdict is worth
/// anything. Of one tick LARGEST_NIS counts at most.
#define FIT_S HEXLOAD_REAL(1.0)
#define FIT_NIS HEXLOAD_REAL(12.0)
#define MISFIT_NIS HEXLOAD_REAL(30.0)
#define LARGEST_NIS HEXLOAD_REAL(120.0)

/// A filter that has begun anew explains everything for a while.
#define UNFIT_S HEXLOAD_REAL(10.0)

/// What the load monitor sees and no load explains reaches the filter a lag later, and its sums speak within
/// half a second.
#define WRONG_S HEXLOAD_REAL(1.0)

/// Two alarms within that time are rather the machine's than the load's.
#define STORM_S HEXLOAD_REAL(5.0)

/// For so many lags after an alarm a large NIS is rather another change's, of which the filter takes the
/// samples for the first one's: the load monitor looks again when it has settled, a lag later, and says so.
#define ANOTHER_LAGS HEXLOAD_REAL(3.0)

/// Variance of the estimate from block to block over the one that it should have, beyond which the machine
/// has more than noise; and beyond which it has when something else says so too. Ideal runs of work motion
/// have been seen at 6.
#define UNFIT_VARIANCE HEXLOAD_REAL(9.0)
#define DOUBTFUL_VARIANCE HEXLOAD_REAL(4.0)

/// Motion of a load before which the machine has not shown that with it it is its model; before which nothing
/// is known of either; for which a machine that has shown it is still believed with another load.
#define PROVING_S HEXLOAD_REAL(2.5)
#define BEGINNING_S HEXLOAD_REAL(0.5)
#define GRACE_S HEXLOAD_REAL(0.5)

/// A theta that no body has within three sigmas has sigmas that are too small: the factor that they need
/// grows that fast, and fades. Beyond the largest one sigma is no word for what theta is.
#define DOUBT_S HEXLOAD_REAL(0.05)
#define FADING_S HEXLOAD_REAL(0.2)
#define LARGEST_DOUBT HEXLOAD_REAL(300.0)
#define CERTAIN_DOUBT HEXLOAD_REAL(1.05) ///< below, it may be chance

/// Widened sigmas that have to be below the limit: errors of 4 have been seen of faults of all kinds (R15),
/// of 7 where a load sloshes or hangs.
#define SPOILT_SIGMAS HEXLOAD_REAL(3.0)

enum {
    FEWEST_TICKS = 20,
    JUDGED_TICKS = 100, ///< before, innovations have not said yet whether the machine fits its model
};

void hexload_momentum_supervisor_init(hexload_momentum_supervisor_t* self) {
    *self = (hexload_momentum_supervisor_t){.nis_mean = CHI_SQUARE_6_MEAN,
                                            .fit_nis = CHI_SQUARE_6_MEAN,
                                            .calm_s = STORM_S,
                                            .doubt = HEXLOAD_REAL(1.0)};
    for (int k = 0; k < DIM; k++) {
        self->kept[k] = HEXLOAD_REAL(1.0);
        self->last_variance[k] = HEXLOAD_REAL(1.0); // any: nothing is kept before a misfit
    }
}

void hexload_momentum_supervisor_doubt(hexload_momentum_supervisor_t* self) {
    self->unfit_s = UNFIT_S;
    self->wrong_s = WRONG_S;
}

void hexload_momentum_supervisor_alarm(hexload_momentum_supervisor_t* self) {
    self->unfit_s = self->calm_s < STORM_S ? UNFIT_S : self->unfit_s;
    self->calm_s = HEXLOAD_REAL(0.0);
}

static bool is_proven(const hexload_momentum_supervisor_t* self) {
    return self->moved_s < HEXLOAD_REAL(0.0) || self->moved_s >= PROVING_S;
}

hexload_fit_t hexload_momentum_supervisor_fit(const hexload_momentum_supervisor_t* self,
                                              const hexload_config_t* config, bool is_moving) {
    hexload_real_t rubbing_n = HEXLOAD_REAL(0.0);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        rubbing_n += config->rig.coulomb_n[leg];
    }
    const bool is_open = rubbing_n > HEXLOAD_REAL(0.0) || config->rig.direction_count > 0;
    const bool is_new = is_moving && (self->moved_s >= HEXLOAD_REAL(0.0)) && (self->moved_s < BEGINNING_S);
    if (self->unfit_s > HEXLOAD_REAL(0.0) || (is_new && !is_open)) {
        return HEXLOAD_FIT_NONE;
    }
    if (is_open) {
        return HEXLOAD_FIT_FRICTION;
    }
    return is_proven(self) ? HEXLOAD_FIT_NOISE : HEXLOAD_FIT_UNPROVEN;
}

void hexload_momentum_supervisor_forget(hexload_momentum_supervisor_t* self) {
    self->nis_mean = CHI_SQUARE_6_MEAN;
    self->moved_s = is_proven(self) ? -GRACE_S : HEXLOAD_REAL(0.0);
}

/// Accelerations below count as none. The slope of a line through 2 lag + 1 displacements changes within ten
/// ticks with sqrt(0.45) sigma / (lag tick_s)^2 of noise; twenty of them, as higher degrees come in at times
/// and the legs' inverse enlarges it.
static hexload_real_t acceleration_noise_m_s2(const hexload_config_t* config,
                                              const hexload_sensors_t* sensors) {
    const hexload_real_t lag_s = config->tick_s * (hexload_real_t)config->momentum.lag_ticks;
    return HEXLOAD_REAL(20.0) * HEXLOAD_REAL(0.67082039) * sensors->displacement_sigma_m / (lag_s * lag_s);
}

/// Motion in platform axes, as Newton and Euler need it.
typedef struct body_motion {
    hexload_real_t specific_m_s2[3]; ///< acceleration of O_A less gravity
    hexload_real_t omega_rad_s[3];
    hexload_real_t alpha_rad_s2[3];
} body_motion_t;

/// The acceleration, base axes, over the ticks since the last call.
HEXLOAD_RARE static void find_acceleration(hexload_momentum_supervisor_t* self,
                                           const hexload_config_t* config,
                                           const hexload_momentum_filter_t* filter,
                                           const hexload_sensors_t* sensors) {
    const hexload_real_t elapsed_s = config->tick_s * (hexload_real_t)self->elapsed_ticks;
    const hexload_real_t noise_m_s2 = acceleration_noise_m_s2(config, sensors);
    hexload_real_t square = HEXLOAD_REAL(0.0);
    for (int k = 0; k < 6; k++) {
        self->acceleration[k] = (filter->smooth_twist[k] - self->last_twist[k]) / elapsed_s;
        square += self->acceleration[k] * self->acceleration[k];
    }
    if (square < noise_m_s2 * noise_m_s2) {
        memset(self->acceleration, 0, sizeof self->acceleration);
    }
    memcpy(self->last_twist, filter->smooth_twist, sizeof self->last_twist);
    self->elapsed_ticks = 0;
}

static body_motion_t motion_of_body(const hexload_momentum_supervisor_t* self, const hexload_config_t* config,
                                    const hexload_momentum_filter_t* filter, const hexload_motion_t* motion) {
    const hexload_real_t specific_m_s2[3] = {self->acceleration[0], self->acceleration[1],
                                             self->acceleration[2] + config->gravity_m_s2};
    body_motion_t body = {{0}, {0}, {0}};
    hexload_to_platform(motion, specific_m_s2, body.specific_m_s2);
    hexload_to_platform(motion, &self->acceleration[3], body.alpha_rad_s2);
    hexload_to_platform(motion, &filter->smooth_twist[3], body.omega_rad_s);
    return body;
}

/// Wrench about O_A that a unit of a parameter needs: Newton and Euler.
static void wrench_of_unit(const body_motion_t* body, int parameter, hexload_real_t wrench[6]) {
    static const int entry[HEXLOAD_I_DIM][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}};
    hexload_real_t centripetal[3];
    memset(wrench, 0, 6 * sizeof wrench[0]);
    if (parameter == HEXLOAD_LOAD_M) {
        memcpy(wrench, body->specific_m_s2, sizeof body->specific_m_s2);
    } else if (parameter <= HEXLOAD_LOAD_HZ) {
        hexload_real_t unit[3] = {0};
        unit[parameter - HEXLOAD_LOAD_HX] = HEXLOAD_REAL(1.0);
        hexload_cross3(unit, body->specific_m_s2, &wrench[3]);
        hexload_cross3(body->omega_rad_s, unit, centripetal);
        hexload_cross3(body->omega_rad_s, centripetal, &wrench[0]);
        hexload_cross3(body->alpha_rad_s2, unit, centripetal);
        for (int k = 0; k < 3; k++) {
            wrench[k] += centripetal[k];
        }
    } else {
        const int i = entry[parameter - HEXLOAD_LOAD_IXX][0];
        const int j = entry[parameter - HEXLOAD_LOAD_IXX][1];
        hexload_real_t spin[3] = {0};
        spin[i] = body->omega_rad_s[j];
        spin[j] = body->omega_rad_s[i];
        hexload_cross3(body->omega_rad_s, spin, &wrench[3]);
        wrench[3 + i] += body->alpha_rad_s2[j];
        wrench[3 + j] += i != j ? body->alpha_rad_s2[i] : HEXLOAD_REAL(0.0);
    }
}

/// Of one tick, each component of the wrench with the variance that the legs' force noise gives it.
static hexload_real_t information_of_tick(const hexload_delayed_tick_t* past,
                                          const hexload_real_t wrench[6]) {
    const hexload_motion_t* motion = &past->motion;
    const hexload_real_t sigma_n = past->sensors->force_sigma_n;
    hexload_real_t base_axes[6];
    hexload_real_t sum = HEXLOAD_REAL(0.0);
    for (int k = 0; k < 3; k++) {
        base_axes[k] = hexload_dot3(motion->R[k], &wrench[0]);
        base_axes[3 + k] = hexload_dot3(motion->R[k], &wrench[3]);
    }
    for (int k = 0; k < 6; k++) {
        hexload_real_t square = HEXLOAD_REAL(0.0);
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            square += motion->J[leg][k] * motion->J[leg][k];
        }
        sum += base_axes[k] * base_axes[k] / (square * sigma_n * sigma_n);
    }
    return sum;
}

void hexload_momentum_supervisor_hear(hexload_momentum_supervisor_t* self, const hexload_config_t* config,
                                      const hexload_load_monitor_t* monitor) {
    self->nis_mean += config->tick_s / config->momentum.nis_time_constant_s * (monitor->nis - self->nis_mean);
}

/// By the blocks of the estimate. Errors that vary come with constant ones, which no block shows: where those
/// are considered, sigma has them.
static bool is_beyond(const hexload_jackknife_t* jackknife, const hexload_config_t* config,
                      hexload_real_t variance) {
    return config->rig.direction_count == 0 && jackknife->pooled > variance;
}

/// Its innovations are too large, and no change of the load makes them so.
static bool is_misfit_of_filter(const hexload_momentum_supervisor_t* self, const hexload_config_t* config) {
    const hexload_real_t lag_s = config->tick_s * (hexload_real_t)config->momentum.lag_ticks;
    return (self->fit_nis > FIT_NIS) && (self->calm_s > (ANOTHER_LAGS * lag_s));
}

/// A mean over all ticks at first, as if FEWEST_TICKS ideal ones had gone before.
static void measure_fit(hexload_momentum_supervisor_t* self, const hexload_config_t* config,
                        const hexload_momentum_filter_t* filter, const hexload_jackknife_t* jackknife,
                        const hexload_residual_test_t* residual_test) {
    const hexload_real_t share = hexload_max(
        config->tick_s / FIT_S, HEXLOAD_REAL(1.0) / (hexload_real_t)(FEWEST_TICKS + self->fit_ticks));
    if (self->fit_ticks < UINT16_MAX) {
        self->fit_ticks++;
    }
    self->fit_nis += share * (hexload_min(filter->nis, LARGEST_NIS) - self->fit_nis);
    if (is_misfit_of_filter(self, config) || residual_test->factor > HEXLOAD_REAL(1.0) ||
        is_beyond(jackknife, config, UNFIT_VARIANCE)) {
        self->unfit_s = UNFIT_S;
    }
    self->calm_s = hexload_min(STORM_S, self->calm_s + config->tick_s);
    self->unfit_s = hexload_max(HEXLOAD_REAL(0.0), self->unfit_s - config->tick_s);
    self->wrong_s = hexload_max(HEXLOAD_REAL(0.0), self->wrong_s - config->tick_s);
}

static void measure_motion(hexload_momentum_supervisor_t* self, const hexload_config_t* config,
                           const hexload_smooth_sample_t* smooth) {
    if (hexload_is_moving(smooth->smooth_velocity_m_s)) {
        self->moved_s = hexload_min(PROVING_S, self->moved_s + config->tick_s);
    }
}

/// While innovations are larger than they should be, sigma is too small by as much, and afterwards by what
/// that has left. One parameter in each tick. The next load's prior knows so little that nothing stays.
static void watch_misfit(hexload_momentum_supervisor_t* self, const hexload_config_t* config,
                         const hexload_momentum_filter_t* filter) {
    hexload_real_t* kept = &self->kept[self->next];
    hexload_real_t* last = &self->last_variance[self->next];
    const hexload_real_t variance = filter->load_cov[self->next][self->next];
    const hexload_real_t factor = is_misfit_of_filter(self, config)
                                      ? hexload_sqrt(self->fit_nis / CHI_SQUARE_6_MEAN)
                                      : HEXLOAD_REAL(1.0);
    if (hexload_max(factor, *kept) > HEXLOAD_REAL(1.0)) {
        *kept = hexload_residual_kept(*kept, variance / *last, factor);
    }
    *last = variance;
}

void hexload_momentum_supervisor_watch(hexload_momentum_supervisor_t* self, const hexload_config_t* config,
                                       const hexload_momentum_filter_t* filter,
                                       const hexload_jackknife_t* jackknife,
                                       const hexload_residual_test_t* residual_test,
                                       const hexload_delayed_tick_t* past) {
    const hexload_momentum_config_t* momentum = &config->momentum;
    const uint32_t gap_ticks = past->smooth.gap_ticks;
    measure_fit(self, config, filter, jackknife, residual_test);
    measure_motion(self, config, &past->smooth);
    self->elapsed_ticks = (uint8_t)(self->elapsed_ticks + gap_ticks);
    if (gap_ticks == 0) { // the twist of before is another motion's
        memcpy(self->last_twist, filter->smooth_twist, sizeof self->last_twist);
        self->elapsed_ticks = 0;
        self->next = 1;
        return;
    }
    if (self->next == 0) {
        find_acceleration(self, config, filter, past->sensors);
    }
    const body_motion_t body = motion_of_body(self, config, filter, &past->motion);
    hexload_real_t wrench[6];
    wrench_of_unit(&body, (int)self->next, wrench);
    const hexload_real_t weight = hexload_min(HEXLOAD_REAL(1.0), (hexload_real_t)DIM * config->tick_s /
                                                                     momentum->excitation_time_constant_s);
    self->information[self->next] +=
        weight * (information_of_tick(past, wrench) - self->information[self->next]);
    watch_misfit(self, config, filter);
    self->next = (self->next < (uint8_t)(DIM - 1)) ? (uint8_t)(self->next + 1U) : 0U;
}

/// Sigmas below which a parameter has converged: a share of its own value, of h of the length, of products of
/// the mean moment; and at least of what the empty platform has, as a load may be none.
static void find_limits(const hexload_momentum_filter_t* filter, hexload_real_t share,
                        hexload_real_t limit[DIM]) {
    const hexload_real_t* theta = filter->theta;
    const hexload_real_t* h = &theta[HEXLOAD_LOAD_HX];
    const hexload_real_t third = HEXLOAD_REAL(1.0) / HEXLOAD_REAL(3.0);
    const hexload_real_t* own = filter->platform;
    const hexload_real_t own_moment =
        third * (own[HEXLOAD_LOAD_IXX] + own[HEXLOAD_LOAD_IYY] + own[HEXLOAD_LOAD_IZZ]);
    const hexload_real_t moment =
        third * (theta[HEXLOAD_LOAD_IXX] + theta[HEXLOAD_LOAD_IYY] + theta[HEXLOAD_LOAD_IZZ]);
    const hexload_real_t length = hexload_sqrt(hexload_dot3(h, h));
    const hexload_real_t least_h = HEXLOAD_REAL(0.1) * hexload_sqrt(own[HEXLOAD_LOAD_M] * own_moment);
    limit[HEXLOAD_LOAD_M] = share * hexload_max(hexload_abs(theta[HEXLOAD_LOAD_M]), own[HEXLOAD_LOAD_M]);
    for (int k = 0; k < 3; k++) {
        limit[HEXLOAD_LOAD_HX + k] = share * hexload_max(length, least_h);
        limit[HEXLOAD_LOAD_IXX + k] =
            share * hexload_max(hexload_abs(theta[HEXLOAD_LOAD_IXX + k]), own_moment);
        limit[HEXLOAD_LOAD_IXY + k] = share * hexload_max(hexload_abs(moment), own_moment);
    }
}

/// Widens sigma until some body has theta within three of it. Returns whether that is possible.
static bool make_physical(hexload_momentum_supervisor_t* self, const hexload_config_t* config,
                          hexload_estimate_t* estimate) {
    const hexload_real_t faded =
        hexload_max(HEXLOAD_REAL(1.0), self->doubt * (HEXLOAD_REAL(1.0) - config->tick_s / FADING_S));
    for (int k = 0; k < DIM; k++) {
        estimate->sigma[k] *= self->doubt;
    }
    const bool is_body = hexload_pseudo_inertia_is_positive(estimate->value, estimate->sigma);
    const hexload_real_t grown =
        hexload_min(self->doubt * (HEXLOAD_REAL(1.0) + config->tick_s / DOUBT_S), LARGEST_DOUBT);
    self->doubt = is_body ? faded : grown;
    return is_body || self->doubt < LARGEST_DOUBT;
}

/// Whether a mismatch, of which the residual test has a factor, may keep a parameter from having converged:
/// what it does is seen to, not bounded. Then none counts: of which it is, and what else it moves, as a push
/// does the mass, nobody knows.
static bool is_spoilt(const hexload_residual_test_t* residual_test, const hexload_real_t limit[DIM],
                      const hexload_real_t own_sigma[DIM]) {
    const hexload_real_t sigmas = SPOILT_SIGMAS * residual_test->factor;
    int k = DIM - 1;
    while ((k >= 0) && ((own_sigma[k] > limit[k]) || ((sigmas * own_sigma[k]) <= limit[k]))) {
        k--;
    }
    return k >= 0;
}

/// With constants open the residual test has a factor only for what they do not do.
static bool is_beyond_constants(const hexload_residual_test_t* residual_test,
                                const hexload_config_t* config) {
    return (config->rig.direction_count > 0) && (residual_test->factor > HEXLOAD_REAL(1.0));
}

/// @param variance without that of the tolerances. @param own sigma of the filter, which the motion lowers.
/// @param limit that the root of variance has to come below. @param least information of a tick, times the
/// square of own, that lowers own by a third.
static hexload_verdict_t judge_parameter(hexload_real_t variance, hexload_real_t own, hexload_real_t limit,
                                         hexload_real_t information, hexload_real_t least) {
    if (variance <= limit * limit) {
        return HEXLOAD_VERDICT_CONVERGED;
    }
    return (own * own * information) > least ? HEXLOAD_VERDICT_CONVERGING : HEXLOAD_VERDICT_NOT_EXCITED;
}

uint32_t hexload_momentum_supervisor_judge(hexload_momentum_supervisor_t* self,
                                           const hexload_config_t* config,
                                           const hexload_momentum_filter_t* filter,
                                           const hexload_jackknife_t* jackknife,
                                           const hexload_residual_test_t* residual_test,
                                           hexload_estimate_t* estimate) {
    hexload_real_t limit[DIM];
    hexload_real_t open[DIM];
    uint32_t health = 0;
    for (int k = 0; k < DIM; k++) {
        estimate->sigma[k] *= self->kept[k];
    }
    hexload_tolerances_widen(filter, estimate->sigma, open);
    estimate->nis = filter->nis;
    estimate->nis_mean = self->nis_mean;
    find_limits(filter, config->momentum.converged_relative_sigma, limit);
    const bool is_doubtful = self->unfit_s > HEXLOAD_REAL(0.0);
    const bool is_misfit = self->fit_nis > MISFIT_NIS || self->nis_mean > config->momentum.inconsistent_nis ||
                           self->wrong_s > HEXLOAD_REAL(0.0) || is_beyond_constants(residual_test, config) ||
                           ((residual_test->factor > HEXLOAD_REAL(1.0)) &&
                            is_spoilt(residual_test, limit, estimate->own_sigma)) ||
                           (is_doubtful && is_beyond(jackknife, config, DOUBTFUL_VARIANCE));
    const bool is_body = make_physical(self, config, estimate);
    const hexload_real_t least = // 1 / (2 / 3)^2 - 1
        HEXLOAD_REAL(1.25) * config->tick_s / config->momentum.excitation_time_constant_s;
    const hexload_verdict_t of_model = is_misfit ? HEXLOAD_VERDICT_MISFIT : HEXLOAD_VERDICT_CONVERGED;
    const hexload_verdict_t of_all = is_body ? of_model : HEXLOAD_VERDICT_INCONSISTENT;
    hexload_verdict_t worst = of_all;
    for (int k = 0; k < DIM; k++) {
        const hexload_real_t variance = hexload_fma(estimate->sigma[k], estimate->sigma[k], -open[k]);
        const hexload_verdict_t own =
            judge_parameter(variance, estimate->own_sigma[k], limit[k], self->information[k], least);
        const hexload_verdict_t verdict = (own > of_all) ? own : of_all;
        estimate->parameter_verdict[k] = verdict;
        worst = (verdict > worst) ? verdict : worst;
        if (verdict == HEXLOAD_VERDICT_NOT_EXCITED) {
            hexload_health_set(&health, HEXLOAD_HEALTH_NOT_EXCITED);
        }
    }
    estimate->verdict = worst;
    if (worst == HEXLOAD_VERDICT_INCONSISTENT) {
        hexload_health_set(&health, HEXLOAD_HEALTH_INCONSISTENT);
    }
    if (worst >= HEXLOAD_VERDICT_MISFIT) {
        hexload_health_set(&health, HEXLOAD_HEALTH_MODEL_MISFIT);
    }
    return health;
}

void hexload_momentum_supervisor_hold_back(const hexload_momentum_supervisor_t* self,
                                           const hexload_jackknife_t* jackknife,
                                           hexload_estimate_t* estimate) {
    const bool is_judged =
        self->fit_ticks >= JUDGED_TICKS && jackknife->has_concluded && self->doubt < CERTAIN_DOUBT;
    for (int k = 0; k < DIM && !is_judged; k++) {
        if (estimate->parameter_verdict[k] == HEXLOAD_VERDICT_CONVERGED) {
            estimate->parameter_verdict[k] = HEXLOAD_VERDICT_CONVERGING;
        }
        if (estimate->verdict == HEXLOAD_VERDICT_CONVERGED) {
            estimate->verdict = HEXLOAD_VERDICT_CONVERGING;
        }
    }
}
