#include "front_end/kinematics.h"
#include "hexload/momentum.h"
#include "algebra/leg_blocks.h"
#include "actuator_effects/actuator_effects_model.h"
#include "actuator_effects/identifiability.h"
#include "momentum/momentum_model.h"
#include "momentum/momentum_filter.h"
#include "motion.h"

#include <math.h>
#include <string.h>

void setUp(void) {}
void tearDown(void) {}

enum {
    LOAD = HEXLOAD_LOAD_DIM,
    MU = LOAD,
    KNOWN = LOAD + 6,
    DIM = HEXLOAD_EFFECTS_DIM,
    TILT = HEXLOAD_EFFECT_TILT,
    ALL = KNOWN + DIM
};

static const body_t eccentric = {312.0, {-0.09, 0.13, 0.27}, {17.0, 21.0, 12.0, 2.0, -1.0, 1.5}};
static const body_t heavier = {431.0, {0.02, 0.05, 0.33}, {24.0, 23.0, 18.0, -1.0, 0.5, -0.5}};

/// A random motion that begins from rest at home, smoothly: of two sines of each axis, in opposite phase.
static motion_t motion_from_rest(uint64_t seed) {
    motion_t motion = random_motion(seed, 0.04, 0.08);
    for (int k = 0; k < 6; k++) {
        motion.phase_rad[k][0] = 0.0;
        motion.phase_rad[k][1] = 3.14159265358979;
        motion.frequency_hz[k][1] = motion.frequency_hz[k][0];
        motion.amplitude[k][1] = 0.99 * motion.amplitude[k][0];
    }
    return motion;
}

/// Sensors that err and legs that rub.
typedef struct effects {
    double value[DIM];
} effects_t;

static const effects_t none = {{0.0}};

/// Six tenths of a degree.
#define TILT_SIGMA_M_S2 HEXLOAD_REAL(0.1)

/// Up to 80 N of bias, 120 N of Coulomb friction, 400 N s/m of viscous friction, 0.8 degrees of tilt about
/// each axis.
static effects_t random_effects(uint64_t seed) {
    effects_t effects;
    for (int leg = 0; leg < 6; leg++) {
        effects.value[leg] = 80.0 * uniform(&seed);
        effects.value[6 + leg] = 80.0 + 40.0 * uniform(&seed);
        effects.value[12 + leg] = 250.0 + 150.0 * uniform(&seed);
    }
    effects.value[TILT] = 0.14 * uniform(&seed);
    effects.value[TILT + 1] = 0.14 * uniform(&seed);
    return effects;
}

/// Leg forces that hold a body at O_A on a base that is not level, beyond those of a level one. `motion` of
/// the sample.
static void add_tilt_forces(const hexload_config_t* config, const body_t* load, const double tilt[2],
                            const hexload_motion_t* motion, hexload_leg_sample_t* sample) {
    const double size = (double)config->gravity_m_s2;
    const double g[3] = {tilt[0], tilt[1], size - sqrt(size * size - tilt[0] * tilt[0] - tilt[1] * tilt[1])};
    double theta[LOAD], body[4], transposed[6][6], wrench[6], force_n[6];
    theta_of(load, theta);
    for (int k = 0; k < 4; k++) {
        const double own = (double)config->platform.mass_kg;
        body[k] = theta[k] + (k == 0 ? own : own * (double)config->platform.com_m[k - 1]);
    }
    double h[3];
    for (int k = 0; k < 3; k++) {
        h[k] = (double)motion->R[k][0] * body[1] + (double)motion->R[k][1] * body[2] +
               (double)motion->R[k][2] * body[3];
        wrench[k] = -body[0] * g[k];
    }
    wrench[3] = -(h[1] * g[2] - h[2] * g[1]);
    wrench[4] = -(h[2] * g[0] - h[0] * g[2]);
    wrench[5] = -(h[0] * g[1] - h[1] * g[0]);
    for (int i = 0; i < 6; i++) {
        for (int k = 0; k < 6; k++) {
            transposed[k][i] = (double)motion->J[i][k];
        }
    }
    solve6(transposed, wrench, force_n);
    for (int leg = 0; leg < 6; leg++) {
        sample->force_n[leg] += (hexload_real_t)force_n[leg];
    }
}

/// What a force sensor between piston and oil shows beside the force on the platform: the friction of
/// host_sim/src/hydraulics.cpp, and an offset. And the tilt's part.
static void add_effects(const effects_t* effects, const hexload_config_t* config, const body_t* load,
                        hexload_leg_sample_t* sample) {
    hexload_kinematics_t kinematics;
    hexload_motion_t motion;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_kinematics_init(&kinematics, config));
    for (int step = 0; step < 3; step++) { // far from home in one tick it may take some
        TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_kinematics_solve(&kinematics, config, sample, &motion));
    }
    add_tilt_forces(config, load, &effects->value[TILT], &motion, sample);
    for (int leg = 0; leg < 6; leg++) {
        const double v = (double)sample->velocity_m_s[leg];
        const double friction_n =
            effects->value[6 + leg] * v / sqrt(v * v + 5e-3 * 5e-3) + effects->value[12 + leg] * v;
        sample->force_n[leg] += (hexload_real_t)(effects->value[leg] + friction_n);
    }
}

/// An estimator at work.
typedef struct bench {
    hexload_config_t config;
    hexload_momentum_effects_t estimator;
    hexload_estimate_t estimate;
    hexload_effects_estimate_t answer;
    motion_t motion;
    effects_t effects;
    uint64_t seed;
    uint32_t tick;
    uint32_t alarms;
    uint32_t last_alarm;
} bench_t;

static void begin(bench_t* bench, hexload_config_t config, motion_t motion, const effects_t* effects,
                  uint64_t seed) {
    memset(bench, 0, sizeof *bench);
    bench->config = config;
    bench->config.actuator_effects.prior_tilt_sigma_m_s2 =
        effects->value[TILT] != 0.0 ? TILT_SIGMA_M_S2 : HEXLOAD_REAL(0.0);
    bench->motion = motion;
    bench->effects = *effects;
    bench->seed = seed;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_momentum_effects_init(&bench->estimator, &bench->config));
}

static hexload_leg_sample_t next_sample(bench_t* bench, const body_t* load) {
    hexload_leg_sample_t sample =
        perfect_sample(&bench->config, load, &bench->motion,
                       (double)bench->estimator.momentum.kinematics.home_height_m, bench->tick);
    add_effects(&bench->effects, &bench->config, load, &sample);
    add_noise(&bench->config, &bench->seed, &sample);
    return sample;
}

static void run(bench_t* bench, const body_t* load, uint32_t ticks) {
    for (uint32_t n = 0; n < ticks; n++) {
        const hexload_leg_sample_t sample = next_sample(bench, load);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_momentum_effects_tick(&bench->estimator, &bench->config,
                                                                        &sample, &bench->estimate));
        if ((bench->estimator.momentum.health.bits >> HEXLOAD_HEALTH_LOAD_CHANGED & 1u) != 0) {
            bench->alarms++;
            bench->last_alarm = bench->tick;
        }
        bench->tick++;
    }
    hexload_momentum_effects_read(&bench->estimator, &bench->estimate, &bench->answer);
}

/// Covariance of two states: theta, mu, effects.
static double covariance_of(const hexload_momentum_effects_t* estimator, int i, int j) {
    const int row = i > j ? i : j, column = i > j ? j : i;
    const hexload_momentum_filter_t* load = &estimator->momentum.filter;
    return row < LOAD      ? (double)load->load_cov[row][column]
           : row >= KNOWN  ? (double)estimator->effects.filter.covariance[ROW(row) - ROW(KNOWN) + column]
           : column < LOAD ? (double)load->cross_cov[row - LOAD][column]
                           : (double)load->momentum_cov[row - LOAD][column - LOAD];
}

/// Normalised error squared of the load's parameters alone (10), or with the effects (30).
static double nees_of(const bench_t* bench, const body_t* load, int size) {
    double theta[LOAD], L[LOAD + DIM][LOAD + DIM], white[LOAD + DIM], sum = 0.0;
    theta_of(load, theta);
    for (int i = 0; i < size; i++) {
        for (int j = 0; j <= i; j++) {
            L[i][j] = covariance_of(&bench->estimator, i < LOAD ? i : i + 6, j < LOAD ? j : j + 6);
            for (int k = 0; k < j; k++) {
                L[i][j] -= L[i][k] * L[j][k];
            }
            L[i][j] = i == j ? sqrt(L[i][i]) : L[i][j] / L[j][j];
        }
        white[i] = i < LOAD ? (double)bench->estimate.value[i] - theta[i]
                            : (double)bench->answer.value[i - LOAD] - bench->effects.value[i - LOAD];
        for (int k = 0; k < i; k++) {
            white[i] -= L[i][k] * white[k];
        }
        white[i] /= L[i][i];
        sum += white[i] * white[i];
    }
    return sum;
}

static motion_t at_rest(void) {
    const motion_t motion = {.frequency_hz = {{1, 1}, {1, 1}, {1, 1}, {1, 1}, {1, 1}, {1, 1}}};
    return motion;
}

/// Momentum filter, effects and all that a step of theirs needs.
typedef struct step {
    hexload_config_t config;
    hexload_momentum_filter_t load;
    hexload_actuator_effects_t effects;
    hexload_consider_t consider;
    hexload_smoother_t smoother;
    hexload_kinematics_t kinematics;
    hexload_motion_t motion;
    hexload_smooth_sample_t sample;
} step_t;

static void begin_step(step_t* step) {
    memset(step, 0, sizeof *step);
    step->config = crooked_machine();
    step->config.actuator_effects.prior_tilt_sigma_m_s2 = TILT_SIGMA_M_S2;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_kinematics_init(&step->kinematics, &step->config));
    hexload_smoother_init(&step->smoother, &step->config);
    step->smoother.constants.slope_gain = HEXLOAD_REAL(0.0); // angular velocities that have no noise
    for (int k = 0; k < 3; k++) {
        step->smoother.constants.rate_gain[k] = HEXLOAD_REAL(1.0);
    }
    hexload_momentum_filter_init(&step->load, &step->config);
    hexload_actuator_effects_init(&step->effects, &step->config);
}

/// A sample whose smooth speed is off the measured one by left_m_s in some direction.
static void next_step(step_t* step, const motion_t* motion, const effects_t* effects, uint32_t tick,
                      double left_m_s) {
    uint64_t seed = tick + 1;
    step->sample.sample =
        perfect_sample(&step->config, &eccentric, motion, (double)step->kinematics.home_height_m, tick);
    for (int leg = 0; leg < 6; leg++) {
        step->sample.smooth_velocity_m_s[leg] =
            step->sample.sample.velocity_m_s[leg] + (hexload_real_t)(left_m_s * uniform(&seed));
    }
    add_effects(effects, &step->config, &eccentric, &step->sample.sample);
    step->sample.gap_ticks = tick == 0 ? 0 : 1;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_kinematics_solve(&step->kinematics, &step->config,
                                                               &step->sample.sample, &step->motion));
}

static hexload_delayed_tick_t delayed_tick(const step_t* step) {
    return (hexload_delayed_tick_t){.smooth = step->sample,
                                    .motion = step->motion,
                                    .sensors = &step->config.sensors,
                                    .smoother = &step->smoother.constants};
}

static void take_step(step_t* step) {
    const hexload_delayed_tick_t past = delayed_tick(step);
    hexload_momentum_update_t update;
    TEST_ASSERT_TRUE(hexload_actuator_effects_step(&step->effects, &step->load, &step->consider,
                                                   &step->config, &past, &update));
}

/// Largest NIS of 300 ticks in which load and effects are taken for known.
static double largest_nis(const effects_t* truth, const effects_t* believed) {
    const motion_t motion = random_motion(17, 0.05, 0.1);
    step_t step;
    double theta[LOAD], largest = 0.0;
    begin_step(&step);
    theta_of(&eccentric, theta);
    memset(step.load.load_cov, 0, sizeof step.load.load_cov);
    memset(step.load.cross_cov, 0, sizeof step.load.cross_cov);
    memset(step.load.momentum_cov, 0, sizeof step.load.momentum_cov);
    memset(step.effects.covariance, 0, sizeof step.effects.covariance);
    for (int k = 0; k < LOAD; k++) {
        step.load.theta[k] = (hexload_real_t)theta[k];
    }
    for (int i = 0; i < DIM; i++) {
        step.effects.effect[i] = (hexload_real_t)believed->value[i];
    }
    for (uint32_t tick = 0; tick < 300; tick++) {
        next_step(&step, &motion, truth, tick, 0.0);
        take_step(&step);
        largest = tick == 0 ? 0.0 : fmax(largest, (double)step.load.nis);
    }
    return largest;
}

static void test_known_effects_leave_nothing_of_what_the_legs_show(void) {
    // GIVEN perfect sensors with biases, on legs with friction WHEN all is known THEN the momentum is as
    // predicted; sqrt(6) of a tenth of a sigma
    const effects_t truth = random_effects(1);
    TEST_ASSERT_TRUE(largest_nis(&truth, &truth) < 0.06);
    // AND each of the twenty counts, with its sign: without one alone, it is not
    for (int i = 0; i < DIM; i++) {
        effects_t wrong = truth;
        wrong.value[i] = -truth.value[i];
        TEST_ASSERT_TRUE_MESSAGE(largest_nis(&truth, &wrong) > 0.2, "an effect's sign");
    }
}

/// Filter of all 36 states with dense matrices in double precision, by the textbook.
typedef struct dense {
    double x[ALL]; ///< theta without the platform, mu, effects
    double P[ALL][ALL];
    double last_A[6][DIM];
} dense_t;

static void read_dense(const step_t* step, dense_t* dense) {
    hexload_momentum_effects_t all;
    all.momentum.filter = step->load;
    all.effects.filter = step->effects;
    for (int i = 0; i < ALL; i++) {
        dense->x[i] = (double)(i < LOAD    ? step->load.theta[i]
                               : i < KNOWN ? step->load.momentum[i - LOAD]
                                           : step->effects.effect[i - KNOWN]);
        for (int j = 0; j < ALL; j++) {
            dense->P[i][j] = covariance_of(&all, i, j);
        }
    }
}

/// Rate of the momentum by a unit of each effect: the push of a leg times what the friction law makes of it,
/// and what gravity's x and y make of platform and load.
static void effect_rates(const step_t* step, double A[6][DIM]) {
    const hexload_motion_t* motion = &step->motion;
    double body[4], s[3];
    for (int k = 0; k < 4; k++) {
        body[k] = (double)step->load.theta[k] + (double)step->load.platform[k];
    }
    for (int k = 0; k < 3; k++) {
        s[k] = body[0] * (double)motion->p_m[k];
        for (int n = 0; n < 3; n++) {
            s[k] += (double)motion->R[k][n] * body[1 + n];
        }
    }
    const double of_tilt[6][2] = {{body[0], 0.0}, {0.0, body[0]}, {0.0, 0.0},
                                  {0.0, -s[2]},   {s[2], 0.0},    {-s[1], s[0]}};
    for (int k = 0; k < 6; k++) {
        A[k][TILT] = of_tilt[k][0];
        A[k][TILT + 1] = of_tilt[k][1];
    }
    for (int leg = 0; leg < 6; leg++) {
        const double v = (double)step->sample.smooth_velocity_m_s[leg];
        const double weight[3] = {1.0, v / hypot(v, 5e-3), v};
        const double* p = (double[3]){(double)step->motion.p_m[0], (double)step->motion.p_m[1],
                                      (double)step->motion.p_m[2]};
        double e[6];
        for (int k = 0; k < 6; k++) {
            e[k] = (double)step->motion.J[leg][k];
        }
        const double push[6] = {e[0],
                                e[1],
                                e[2],
                                e[3] + p[1] * e[2] - p[2] * e[1],
                                e[4] + p[2] * e[0] - p[0] * e[2],
                                e[5] + p[0] * e[1] - p[1] * e[0]};
        for (int n = 0; n < 3; n++) {
            for (int k = 0; k < 6; k++) {
                A[k][6 * n + leg] = -weight[n] * push[k];
            }
        }
    }
}

/// F of a step: the identity, Gbar by theta, A by the effects. The input's part goes to mu at once.
static void dense_transition(const step_t* step, dense_t* dense, double A[6][DIM], double F[ALL][ALL]) {
    hexload_momentum_input_t input;
    hexload_real_t G[PULLED][LIFTED];
    const double dt_s = (double)step->config.tick_s * step->sample.gap_ticks;
    hexload_momentum_read_input(&step->motion, step->sample.sample.force_n, &input);
    hexload_momentum_pull(&step->load.last_input, &input, (hexload_real_t)dt_s * step->config.gravity_m_s2,
                          G);
    memset(F, 0, sizeof(double[ALL][ALL]));
    for (int i = 0; i < ALL; i++) {
        F[i][i] = 1.0;
    }
    for (int a = 0; a < PULLED; a++) {
        for (int k = 0; k < LIFTED; k++) {
            F[MU + FIRST_PULLED + a][k] = (double)G[a][k];
            dense->x[MU + FIRST_PULLED + a] += (double)G[a][k] * (double)step->load.platform[k];
        }
    }
    for (int k = 0; k < 6; k++) {
        dense->x[MU + k] += 0.5 * dt_s * ((double)input.wrench[k] + (double)step->load.last_input.wrench[k]);
        for (int i = 0; i < DIM; i++) {
            F[MU + k][KNOWN + i] = 0.5 * dt_s * (A[k][i] + dense->last_A[k][i]);
        }
    }
    const double tilt[2] = {dt_s * dense->x[KNOWN + TILT], dt_s * dense->x[KNOWN + TILT + 1]};
    for (int k = 0; k < 4; k++) { // what the tilt makes of m and h
        double arm[3];
        for (int axis = 0; axis < 3; axis++) {
            arm[axis] = k == 0 ? (double)step->motion.p_m[axis] : (double)step->motion.R[axis][k - 1];
        }
        const double more[6] = {
            k == 0 ? tilt[0] : 0.0, k == 0 ? tilt[1] : 0.0, 0.0,
            -arm[2] * tilt[1],      arm[2] * tilt[0],       arm[0] * tilt[1] - arm[1] * tilt[0]};
        for (int a = 0; a < 6; a++) {
            F[MU + a][k] += more[a];
            dense->x[MU + a] -= more[a] * dense->x[k]; // which A times the tilt has already
        }
    }
    const double g = (double)step->config.gravity_m_s2; // the vector's length stays
    const double lost = g - sqrt(g * g - pow(dense->x[KNOWN + TILT], 2) - pow(dense->x[KNOWN + TILT + 1], 2));
    const double of_z[6] = {
        0.0, 0.0, F[MU][KNOWN + TILT], -F[MU + 5][KNOWN + TILT], -F[MU + 5][KNOWN + TILT + 1], 0.0};
    for (int k = 0; k < 6; k++) {
        dense->x[MU + k] += of_z[k] * lost;
    }
}

static void dense_predict(const step_t* step, dense_t* dense) {
    static double F[ALL][ALL], FP[ALL][ALL];
    double A[6][DIM], x[ALL] = {0};
    const double dt_s = (double)step->config.tick_s * step->sample.gap_ticks;
    effect_rates(step, A);
    dense_transition(step, dense, A, F);
    memcpy(dense->last_A, A, sizeof A);
    for (int i = 0; i < ALL; i++) {
        for (int j = 0; j < ALL; j++) {
            x[i] += F[i][j] * dense->x[j];
            FP[i][j] = 0.0;
            for (int k = 0; k < ALL; k++) {
                FP[i][j] += F[i][k] * dense->P[k][j];
            }
        }
    }
    memcpy(dense->x, x, sizeof x);
    for (int i = 0; i < ALL; i++) {
        for (int j = 0; j < ALL; j++) {
            dense->P[i][j] = 0.0;
            for (int k = 0; k < ALL; k++) {
                dense->P[i][j] += FP[i][k] * F[j][k];
            }
        }
    }
    const double sigma_m = (double)step->config.sensors.displacement_sigma_m;
    double speed_variance = fmax((double)step->effects.residual_m2_s2, 0.0);
    for (int m = 0; m < 3; m++) {
        speed_variance += sigma_m * sigma_m / (double)step->smoother.constants.inverse_gain[m];
    }
    for (int leg = 0; leg < 6; leg++) { // force noise, and the sign's
        const double v = (double)step->sample.smooth_velocity_m_s[leg];
        const double c = (double)step->effects.effect[6 + leg];
        const double slope = 5e-3 * 5e-3 / pow(hypot(v, 5e-3), 3.0);
        const double sigma_n = (double)step->config.sensors.force_sigma_n;
        const double square = c * c + (double)effects_covariance(&step->effects, 6 + leg, 6 + leg);
        const double shape = (double)step->config.actuator_effects.friction_shape * v;
        const double variance = sigma_n * sigma_n + (double)step->config.momentum.lag_ticks *
                                                        (speed_variance + shape * shape) * square * slope *
                                                        slope;
        for (int a = 0; a < 6; a++) {
            for (int b = 0; b < 6; b++) {
                dense->P[MU + a][MU + b] += dt_s * dt_s * variance * A[a][leg] * A[b][leg];
            }
        }
    }
}

/// e = Y(V) (theta + theta_p) - mu, H = [-Y(V_l), E, 0], with S of the filter's own update, L L^T.
static void dense_update(const step_t* step, dense_t* dense, hexload_real_t Y[6][LOAD],
                         hexload_real_t L[6][6]) {
    double body[LOAD], e[6], HP[6][ALL], K[6], momentum[6] = {0};
    hexload_real_t Y_measured[6][LOAD] = {{0}};
    hexload_momentum_regressor(&step->motion, step->motion.twist, Y_measured);
    for (int i = 0; i < ALL; i++) {
        dense->P[i][i] *= i < LOAD || i >= KNOWN ? (double)HEXLOAD_COVARIANCE_INFLATION : 1.0;
    }
    for (int k = 0; k < LOAD; k++) {
        body[k] = dense->x[k] + (double)step->load.platform[k];
        for (int a = 0; a < 6; a++) {
            momentum[a] += (double)Y_measured[a][k] * body[k];
        }
    }
    for (int a = 0; a < 6; a++) {
        e[a] = momentum[a] - dense->x[MU + a];
        for (int i = 0; i < ALL; i++) {
            HP[a][i] = dense->P[MU + a][i];
            for (int k = 0; k < LOAD; k++) {
                HP[a][i] -= (double)Y[a][k] * dense->P[k][i];
            }
        }
    }
    for (int a = 0; a < 6; a++) { // whiten
        for (int k = 0; k < a; k++) {
            e[a] -= (double)L[a][k] * e[k];
            for (int i = 0; i < ALL; i++) {
                HP[a][i] -= (double)L[a][k] * HP[k][i];
            }
        }
        e[a] *= (double)L[a][a];
        for (int i = 0; i < ALL; i++) {
            HP[a][i] *= (double)L[a][a];
        }
    }
    for (int i = 0; i < ALL; i++) {
        for (int a = 0; a < 6; a++) {
            K[a] = HP[a][i];
            dense->x[i] += K[a] * e[a];
        }
        for (int j = 0; j < ALL; j++) {
            for (int a = 0; a < 6; a++) {
                dense->P[i][j] -= K[a] * HP[a][j];
            }
        }
    }
}

/// GIVEN 80 ticks of motion, so that all of the covariance is at work, and a gap of so many; or a steep base,
/// a load that is hardly known, and speeds that hardly tell anything
static void check_step(uint32_t gap_ticks, bool is_steep) {
    const motion_t motion = random_motion(23, 0.05, 0.1);
    const effects_t effects = random_effects(5);
    static dense_t dense;
    static step_t step, before;
    hexload_momentum_update_t left;
    memset(&left, 0, sizeof left); // of which a step leaves out what is always zero
    begin_step(&step);
    for (uint32_t tick = 0; tick <= 80; tick++) {
        next_step(&step, &motion, &effects, tick < 80 ? tick : 79 + gap_ticks, 1e-4);
        if (tick < 80) {
            effect_rates(&step, dense.last_A);
            take_step(&step);
        }
    }
    step.sample.gap_ticks = gap_ticks;
    if (is_steep) {
        step.config.sensors.velocity_sigma_m_s = HEXLOAD_REAL(1.0);
        step.effects.effect[TILT] = HEXLOAD_REAL(3.0);
        step.effects.effect[TILT + 1] = HEXLOAD_REAL(-2.0);
        for (int k = 0; k < LIFTED; k++) {
            step.load.load_cov[k][k] += k == 0 ? HEXLOAD_REAL(1e4) : HEXLOAD_REAL(400.0);
        }
    }
    // WHEN one more is taken, and a filter with dense matrices in double precision takes it too
    read_dense(&step, &dense);
    before = step;
    take_step(&step);
    before.effects.residual_m2_s2 = step.effects.residual_m2_s2;
    dense_predict(&before, &dense);
    for (int i = 0; i < LOAD; i++) { // the momentum filter's own update, for the S that it takes
        for (int j = 0; j < LOAD; j++) {
            before.load.load_cov[i][j] = (hexload_real_t)dense.P[i][j];
        }
    }
    for (int i = 0; i < 6; i++) {
        for (int j = 0; j < LOAD; j++) {
            before.load.cross_cov[i][j] = (hexload_real_t)dense.P[LOAD + i][j];
        }
        for (int j = 0; j <= i; j++) {
            before.load.momentum_cov[i][j] = (hexload_real_t)dense.P[LOAD + i][LOAD + j];
        }
    }
    for (int k = 0; k < 6; k++) {
        before.load.momentum[k] = (hexload_real_t)dense.x[MU + k];
    }
    before.config.gravity_m_s2 = HEXLOAD_REAL(0.0); // mu has moved already
    before.config.sensors.force_sigma_n = HEXLOAD_REAL(0.0);
    before.load.last_input = (hexload_momentum_input_t){0};
    memset(before.sample.sample.force_n, 0, sizeof before.sample.sample.force_n);
    const hexload_delayed_tick_t past = delayed_tick(&before);
    hexload_momentum_filter_step(&before.load, &before.config, &past, &left);
    dense_update(&before, &dense, left.Y, left.L);
    // THEN both know the same: states to a thousandth of a sigma, covariances to 1e-3 of sigma times sigma;
    // in double to what the product of means is off the mean of products, which grows with the gap's cube
    static dense_t found;
    read_dense(&step, &found);
    const double share = sizeof(hexload_real_t) == sizeof(float) ? 1e-3 : 1e-6 * pow(gap_ticks, 3.0);
    for (int i = 0; i < ALL; i++) {
        const double sigma = sqrt(dense.P[i][i]);
        TEST_ASSERT_TRUE(isfinite(sigma));
        TEST_ASSERT_DOUBLE_WITHIN(share * sigma, dense.x[i], found.x[i]);
        for (int j = 0; j < ALL; j++) {
            TEST_ASSERT_DOUBLE_WITHIN(share * sigma * sqrt(dense.P[j][j]), dense.P[i][j], found.P[i][j]);
        }
    }
}

static void test_step_is_that_of_a_dense_filter(void) {
    check_step(1, false);
    check_step(4, false);
    check_step(4, true);
}

static void test_a_momentum_that_begins_anew_goes_with_the_effects_as_the_load_does(void) {
    // GIVEN 80 ticks of motion, so that load and effects have errors in common WHEN the momentum begins anew
    const motion_t motion = random_motion(23, 0.05, 0.1);
    const effects_t effects = random_effects(5);
    static step_t step, before;
    begin_step(&step);
    for (uint32_t tick = 0; tick <= 80; tick++) {
        next_step(&step, &motion, &effects, tick, 1e-4);
        if (tick == 80) {
            step.sample.gap_ticks = 0;
            step.config.rig.direction_count = 1;
            for (int k = 0; k < LOAD; k++) {
                step.consider.load[0][k] = (hexload_real_t)(k - 4);
            }
        }
        before = step;
        take_step(&step);
    }
    // THEN P_me is that of Y theta, AND all else of the effects is as it was
    hexload_real_t Y[6][LOAD] = {{0}};
    hexload_momentum_regressor(&step.motion, step.load.smooth_twist, Y);
    for (int i = 0; i < DIM; i++) {
        const hexload_real_t* row = &step.effects.covariance[EFFECT_ROW(i)];
        TEST_ASSERT_EQUAL_MEMORY(&before.effects.covariance[EFFECT_ROW(i)], row, LOAD * sizeof *row);
        TEST_ASSERT_EQUAL_MEMORY(&before.effects.covariance[EFFECT_ROW(i) + KNOWN], &row[KNOWN],
                                 (size_t)(i + 1) * sizeof *row);
        for (int a = 0; a < 6; a++) {
            double sum = 0.0, size = 0.0;
            for (int k = 0; k < LOAD; k++) {
                sum += (double)Y[a][k] * (double)row[k];
                size += fabs((double)Y[a][k] * (double)row[k]);
            }
            TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(LOAD, size), sum, (double)row[MU + a]);
        }
    }
    // AND an open constant's error of the momentum is that of its error of the load
    for (int a = 0; a < 6; a++) {
        double sum = 0.0;
        for (int k = 0; k < LOAD; k++) {
            sum += (double)Y[a][k] * (k - 4.0);
        }
        TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(200, 1.0), sum, (double)step.consider.momentum[0][a]);
    }
}

/// A step that hardly measures anything, after two of the motion: mu that it predicts from these numbers.
static void predicted_momentum(step_t* step, int state, double change, double mu[6]) {
    const motion_t motion = random_motion(29, 0.05, 0.1);
    const effects_t effects = random_effects(7);
    begin_step(step);
    step->config.sensors.velocity_sigma_m_s =
        HEXLOAD_REAL(1.0); // so that the update takes next to nothing off
    step->config.actuator_effects.friction_shape = HEXLOAD_REAL(0.0); // likewise
    for (int i = 0; i < DIM; i++) {
        step->effects.effect[i] = (hexload_real_t)effects.value[i];
    }
    for (int k = 0; k < LOAD; k++) {
        double theta[LOAD];
        theta_of(&eccentric, theta);
        step->load.theta[k] = (hexload_real_t)theta[k];
    }
    hexload_real_t* number = state < LOAD ? &step->load.theta[state] : &step->effects.effect[state - KNOWN];
    *number += (hexload_real_t)change;
    memset(step->load.load_cov, 0, sizeof step->load.load_cov);
    memset(step->effects.covariance, 0, sizeof step->effects.covariance);
    for (uint32_t tick = 0; tick < 2; tick++) {
        next_step(step, &motion, &effects, tick, 0.0);
        if (tick == 0) {
            take_step(step);
        }
    }
    memset(step->load.momentum, 0,
           sizeof step->load.momentum); // whose rounding is then that of a tick's part
    memset(step->load.momentum_cov, 0, sizeof step->load.momentum_cov);
    if (state < LOAD) {
        step->load.load_cov[state][state] = HEXLOAD_REAL(1e-4);
    } else {
        step->effects.covariance[EFFECT_ROW(state - KNOWN) + state] = HEXLOAD_REAL(1e-4);
    }
    take_step(step);
    for (int k = 0; k < 6; k++) {
        mu[k] = (double)step->load.momentum[k];
    }
}

static void test_columns_of_a_step_are_finite_differences(void) {
    // GIVEN a load on a tilted base, with biases and friction WHEN mass, moments of mass and each effect
    // change a little THEN the predicted momentum changes as the covariances say, but for rounding of up to 6
    // N s in a tick, 4e-7; the tilt's tenths of m/s^2 are 1e-4 of mass and moments of mass. As gravity's
    // length stays, x and y change z by up to 1.5 % of themselves, which the columns leave out
    static step_t step;
    for (int state = 0; state < ALL; state = state + 1 == 4 ? KNOWN : state + 1) {
        const double change = state >= KNOWN + TILT ? 0.05 : state < LOAD ? 5.0 : 20.0;
        double ahead[6], behind[6];
        predicted_momentum(&step, state, -change, behind);
        predicted_momentum(&step, state, change, ahead);
        for (int k = 0; k < 6; k++) {
            const double slope = (ahead[k] - behind[k]) / (2.0 * change);
            const double found =
                (double)(state < LOAD ? step.load.cross_cov[k][state]
                                      : step.effects.covariance[EFFECT_ROW(state - KNOWN) + MU + k]) /
                1e-4;
            const double left_out = state >= KNOWN + TILT ? 0.015 * 0.5 : 0.0;
            TEST_ASSERT_DOUBLE_WITHIN(left_out + 4e-6 / change, slope, found);
        }
    }
}

static void test_a_tilt_turns_gravity_and_keeps_its_length(void) {
    // GIVEN a platform with a load WHEN gravity's x grows or falls, up to where it lies nearly flat THEN its
    // z loses what keeps its length, to a thousandth
    static step_t step;
    const effects_t effects = random_effects(7); // that the step begins with
    const double changes_m_s2[] = {-0.5, 0.5, -3.0, 3.0, 9.0};
    double here[6], there[6];
    predicted_momentum(&step, KNOWN + TILT, 0.0, here);
    const double mass_kg = (double)step.load.theta[0] + (double)step.load.platform[0];
    const double g = (double)step.config.gravity_m_s2, y = effects.value[TILT + 1];
    for (int n = 0; n < 5; n++) {
        const double x = effects.value[TILT], to = x + changes_m_s2[n];
        predicted_momentum(&step, KNOWN + TILT, changes_m_s2[n], there);
        const double lost_m_s2 = sqrt(g * g - x * x - y * y) - sqrt(g * g - to * to - y * y);
        const double impulse = mass_kg * (double)step.config.tick_s * lost_m_s2;
        TEST_ASSERT_DOUBLE_WITHIN(1e-3 * fabs(impulse) + 1e-6, impulse, there[2] - here[2]);
    }
}

/// Constants that are known to a tolerance: one way in which all may be off.
static hexload_rig_direction_t open_direction(void) {
    hexload_rig_direction_t way;
    memset(&way, 0, sizeof way);
    for (int leg = 0; leg < 6; leg++) {
        way.force_gain[leg] = HEXLOAD_REAL(1e-3) * (hexload_real_t)(leg % 3 - 1) + HEXLOAD_REAL(4e-4);
        way.force_offset_n[leg] = HEXLOAD_REAL(0.5) * (hexload_real_t)(leg % 2) + HEXLOAD_REAL(0.4);
        way.coulomb_n[leg] = HEXLOAD_REAL(0.2);
        way.viscous_n_s_m[leg] = HEXLOAD_REAL(0.5);
    }
    way.gravity_m_s2[0] = HEXLOAD_REAL(2e-3);
    return way;
}

/// Load and effects after a second and a half, whose samples do not depend on the configuration.
static void watch(bench_t* bench, const hexload_config_t* config, const effects_t* effects) {
    begin(bench, *config, random_motion(71, 0.05, 0.1), effects, 12);
    run(bench, &eccentric, 1500);
}

static void test_open_constants_move_load_and_effects_as_said(void) {
    // GIVEN an estimator whose force gains are off in a way that it knows of, and one whose gains are right
    const effects_t effects = random_effects(83);
    const hexload_rig_direction_t way = open_direction();
    hexload_config_t config = crooked_machine();
    static bench_t right, wrong;
    config.rig.direction_count = 1;
    memcpy(config.rig.direction[0].force_gain, way.force_gain, sizeof way.force_gain);
    watch(&right, &config, &effects);
    memcpy(config.rig.force_gain, way.force_gain, sizeof way.force_gain);
    watch(&wrong, &config, &effects);
    // WHEN both have run THEN they differ by what T says, to a tenth of that and of the filter's own sigma: T
    // looks at the forces with bias and friction in them, and is linear
    const hexload_consider_t* consider = &right.estimator.momentum.consider;
    for (int k = 0; k < ALL - 6; k++) {
        const bool is_load = k < LOAD;
        const double sigma = sqrt(covariance_of(&right.estimator, is_load ? k : k + 6, is_load ? k : k + 6));
        const double found = is_load ? (double)(wrong.estimate.value[k] - right.estimate.value[k])
                                     : (double)(wrong.answer.value[k - LOAD] - right.answer.value[k - LOAD]);
        const double said =
            (double)(is_load ? consider->load[0][k] : right.estimator.effects.filter.considered[0][k - LOAD]);
        TEST_ASSERT_DOUBLE_WITHIN(0.1 * (fabs(said) + sigma), said, found);
    }
}

/// GIVEN so many constants that have put the same errors into effects, load and momentum WHEN ticks go by in
/// which nothing is added to them THEN all stay the same.
static void check_constants(uint32_t count) {
    static step_t step;
    const effects_t effects = random_effects(85);
    const motion_t motion = random_motion(72, 0.05, 0.1);
    hexload_real_t before[DIM];
    begin_step(&step);
    step.config.rig.direction_count = count;
    for (uint32_t n = 0; n < count; n++) {
        for (int i = 0; i < DIM; i++) {
            before[i] = HEXLOAD_REAL(0.1) * (hexload_real_t)(i + 1);
            step.effects.considered[n][i] = before[i];
        }
    }
    for (uint32_t tick = 0; tick < 4; tick++) {
        next_step(&step, &motion, &effects, tick, 1e-4);
        take_step(&step);
        for (uint32_t n = 1; n < count; n++) {
            TEST_ASSERT_EQUAL_MEMORY(step.effects.considered[0], step.effects.considered[n], sizeof before);
            TEST_ASSERT_EQUAL_MEMORY(step.consider.momentum[0], step.consider.momentum[n],
                                     sizeof step.consider.momentum[0]);
            TEST_ASSERT_EQUAL_MEMORY(step.consider.load[0], step.consider.load[n],
                                     sizeof step.consider.load[0]);
        }
    }
    // AND they have moved the momentum, and the filter has moved them
    for (int k = 0; k < 6; k++) {
        TEST_ASSERT_TRUE(step.consider.momentum[count - 1][k] != HEXLOAD_REAL(0.0));
    }
    for (int i = 0; i < DIM; i++) {
        TEST_ASSERT_TRUE(step.effects.considered[count - 1][i] != before[i]);
    }
}

static void test_errors_by_each_of_many_constants_go_the_same_way(void) {
    check_constants(5);
    check_constants(HEXLOAD_RIG_DIRECTIONS_MAX);
}

static void test_a_state_is_not_considered_too(void) {
    // GIVEN constants of each group that may be off, and an estimator for which all but the gains are states
    const effects_t effects = random_effects(84);
    hexload_config_t config = crooked_machine();
    static bench_t none_open, states_open, all_open;
    watch(&none_open, &config, &effects);
    config.rig.direction_count = 1;
    config.rig.direction[0] = open_direction();
    watch(&all_open, &config, &effects);
    memset(config.rig.direction[0].force_gain, 0, sizeof config.rig.direction[0].force_gain);
    watch(&states_open, &config, &effects);
    // WHEN it has run THEN the states' own errors are in the filter's sigma alone, and the gains' come on top
    for (int k = 0; k < LOAD; k++) {
        TEST_ASSERT_TRUE(states_open.estimate.sigma[k] == none_open.estimate.sigma[k]);
        TEST_ASSERT_TRUE(states_open.estimate.value[k] == none_open.estimate.value[k]);
    }
    TEST_ASSERT_TRUE(all_open.estimate.sigma[HEXLOAD_LOAD_M] >
                     HEXLOAD_REAL(1.5) * none_open.estimate.sigma[HEXLOAD_LOAD_M]);
    // AND with them known, they count as constants again
    config.actuator_effects = (hexload_actuator_effects_config_t){.friction_speed_m_s = HEXLOAD_REAL(5e-3)};
    watch(&none_open, &config, &none);
    TEST_ASSERT_TRUE(none_open.estimate.sigma[HEXLOAD_LOAD_M] >
                     HEXLOAD_REAL(1.5) * none_open.estimate.own_sigma[HEXLOAD_LOAD_M]);
}

static void test_what_effects_are_off_commissioning_is_a_mean_of_squares(void) {
    // GIVEN effects that stay where they are, each further off, biases, tilt and dry friction with sigmas
    // that commissioning has left, beside two open constants, and viscous friction that is none
    const motion_t motion = random_motion(17, 0.05, 0.1);
    const double prior[4] = {2.0, 3.0, 0.0, 0.02};
    for (int n = 0; n < 2; n++) {
        static step_t step;
        double squares = 0.0;
        begin_step(&step);
        hexload_actuator_effects_config_t* config = &step.config.actuator_effects;
        config->prior_bias_sigma_n = (hexload_real_t)prior[0];
        config->prior_coulomb_sigma_n = (hexload_real_t)prior[1];
        config->prior_viscous_sigma_n_s_m = (hexload_real_t)prior[2];
        config->prior_tilt_sigma_m_s2 = (hexload_real_t)prior[3];
        hexload_actuator_effects_init(&step.effects, &step.config);
        step.config.rig.direction_count = 2;
        hexload_actuator_effects_hold(&step.effects, &step.config);
        for (int i = 0; i < DIM; i++) {
            const double sigma = prior[i < TILT ? i / 6 : 3];
            // n = 0: by up to two sigmas; n = 1: by up to ten
            const double off = sigma * (n == 0 ? 0.1 : 0.5) * (double)(i + 1);
            const double open[2] = {0.3 * sigma, 0.4 * sigma};
            step.effects.effect[i] = (hexload_real_t)off;
            step.effects.considered[0][i] = (hexload_real_t)open[0];
            step.effects.considered[1][i] = (hexload_real_t)open[1];
            squares += sigma > 0.0 ? off * off / (sigma * sigma * (1.0 + 1.0 + 0.25)) : 0.0;
        }
        // WHEN all but one have had their tick THEN nothing is said, AND after the last the mean of the
        // squares of those that are free, one of 1 with them, and 1 where they are within
        for (uint32_t tick = 0; tick < DIM; tick++) {
            TEST_ASSERT_EQUAL_DOUBLE(1.0, (double)step.effects.dispersion);
            next_step(&step, &motion, &none, tick, 1e-4);
            take_step(&step);
        }
        const double mean = (squares + 1.0) / (14.0 + 1.0);
        TEST_ASSERT_TRUE(n == 0 ? mean < 1.0 : mean > 2.0);
        TEST_ASSERT_DOUBLE_WITHIN(1e-4 * mean, fmax(1.0, mean), (double)step.effects.dispersion);
        // AND the next round begins anew
        for (uint32_t tick = DIM; tick < 2 * DIM; tick++) {
            next_step(&step, &motion, &none, tick, 1e-4);
            take_step(&step);
        }
        TEST_ASSERT_DOUBLE_WITHIN(1e-4 * mean, fmax(1.0, mean), (double)step.effects.dispersion);
    }
}

static void test_an_effect_that_is_next_to_known_is_a_state_all_the_same(void) {
    const motion_t motion = random_motion(72, 0.05, 0.1);
    for (int n = 0; n < 8; n++) {
        // GIVEN one group of constants that may be off, and states of that group with a small sigma, or none
        const int group = n / 2;
        const hexload_real_t sigma = n % 2 == 0 ? HEXLOAD_REAL(0.5) : HEXLOAD_REAL(0.0);
        static step_t step;
        begin_step(&step);
        step.config.actuator_effects.prior_bias_sigma_n = group == 0 ? sigma : HEXLOAD_REAL(100.0);
        step.config.actuator_effects.prior_coulomb_sigma_n = group == 1 ? sigma : HEXLOAD_REAL(100.0);
        step.config.actuator_effects.prior_viscous_sigma_n_s_m = group == 2 ? sigma : HEXLOAD_REAL(100.0);
        step.config.actuator_effects.prior_tilt_sigma_m_s2 = group == 3 ? sigma : HEXLOAD_REAL(0.1);
        step.config.rig.direction_count = 1;
        hexload_rig_direction_t* way = &step.config.rig.direction[0];
        for (int leg = 0; leg < 6; leg++) {
            way->force_offset_n[leg] = group == 0 ? HEXLOAD_REAL(1.0) : HEXLOAD_REAL(0.0);
            way->coulomb_n[leg] = group == 1 ? HEXLOAD_REAL(1.0) : HEXLOAD_REAL(0.0);
            way->viscous_n_s_m[leg] = group == 2 ? HEXLOAD_REAL(1.0) : HEXLOAD_REAL(0.0);
        }
        way->gravity_m_s2[0] = group == 3 ? HEXLOAD_REAL(1e-3) : HEXLOAD_REAL(0.0);
        // WHEN ticks go by THEN the constants move the momentum if there is no state of theirs
        for (uint32_t tick = 0; tick < 3; tick++) {
            next_step(&step, &motion, &none, tick, 1e-4);
            take_step(&step);
        }
        for (int k = 0; k < 6; k++) {
            TEST_ASSERT_EQUAL_INT(n % 2 == 0, step.consider.momentum[0][k] == HEXLOAD_REAL(0.0));
        }
    }
}

static void test_effects_of_sigma_zero_are_none(void) {
    // GIVEN the same samples for an estimator without effects and for one whose effects have no sigma
    hexload_config_t config = paper_machine();
    config.actuator_effects.prior_bias_sigma_n = HEXLOAD_REAL(0.0);
    config.actuator_effects.prior_coulomb_sigma_n = HEXLOAD_REAL(0.0);
    config.actuator_effects.prior_viscous_sigma_n_s_m = HEXLOAD_REAL(0.0);
    static bench_t bench;
    static hexload_momentum_t plain;
    hexload_estimate_t estimate;
    begin(&bench, config, random_motion(61, 0.05, 0.1), &none, 4);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_momentum_init(&plain, &config));
    for (uint32_t n = 0; n < 1000; n++) {
        const hexload_leg_sample_t sample = next_sample(&bench, &eccentric);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_momentum_tick(&plain, &config, &sample, &estimate));
        TEST_ASSERT_EQUAL_INT(
            HEXLOAD_OK, hexload_momentum_effects_tick(&bench.estimator, &config, &sample, &bench.estimate));
        bench.tick++;
    }
    // WHEN they have run THEN their estimates are the same to the bit, and the effects are zero
    TEST_ASSERT_EQUAL_MEMORY(estimate.value, bench.estimate.value, sizeof estimate.value);
    TEST_ASSERT_EQUAL_MEMORY(estimate.sigma, bench.estimate.sigma, sizeof estimate.sigma);
    hexload_momentum_effects_read(&bench.estimator, &bench.estimate, &bench.answer);
    for (int i = 0; i < DIM; i++) {
        TEST_ASSERT_TRUE(bench.answer.value[i] == HEXLOAD_REAL(0.0));
        TEST_ASSERT_TRUE(bench.answer.sigma[i] == HEXLOAD_REAL(0.0));
    }
    TEST_ASSERT_EQUAL_UINT32(0, bench.answer.confounded_with_bias | bench.answer.confounded_with_friction);
}

static void test_errors_are_as_large_as_the_filter_says(void) {
    // GIVEN twenty violent motions of a general machine with biases, friction and a tilted base, of which
    // nothing is known
    enum { RUNS = 20 };
    static bench_t bench;
    double load = 0.0, all = 0.0;
    for (uint64_t n = 0; n < RUNS; n++) {
        const effects_t effects = random_effects(500 + n);
        const body_t* body = n % 2 == 0 ? &eccentric : &heavier;
        begin(&bench, crooked_machine(), random_motion(100 + n, 0.05, 0.12), &effects, 200 + n);
        // WHEN 3 s of each have passed
        run(&bench, body, 3000);
        // THEN all have converged without an alarm; 1e-7 of chi-square with 10 degrees of freedom is beyond
        // 53
        TEST_ASSERT_TRUE_MESSAGE(nees_of(&bench, body, LOAD) < 53.0, "NEES of a run");
        TEST_ASSERT_EQUAL_INT(HEXLOAD_VERDICT_CONVERGED, bench.estimate.verdict);
        TEST_ASSERT_EQUAL_UINT32(0, bench.alarms);
        TEST_ASSERT_EQUAL_UINT32(0,
                                 bench.answer.confounded_with_bias | bench.answer.confounded_with_friction);
        load += nees_of(&bench, body, LOAD);
        all += nees_of(&bench, body, LOAD + DIM);
    }
    // AND the means are 10 and 30 within 3.3 sigma, sigma = sqrt(2 * 10 / 20) and sqrt(2 * 30 / 20)
    printf("mean NEES %.2f of 10, %.2f of 30\n", load / RUNS, all / RUNS);
    TEST_ASSERT_DOUBLE_WITHIN(3.3, 10.0, load / RUNS);
    TEST_ASSERT_DOUBLE_WITHIN(5.7, 30.0, all / RUNS);
}

static void test_a_load_change_leaves_the_actuator_effects_known(void) {
    // GIVEN a load and actuator effects that have been identified
    const effects_t effects = random_effects(77);
    static bench_t bench;
    begin(&bench, paper_machine(), random_motion(31, 0.05, 0.1), &effects, 5);
    run(&bench, &eccentric, 3000);
    TEST_ASSERT_EQUAL_UINT32(0, bench.alarms);
    const hexload_effects_estimate_t before = bench.answer;
    // WHEN another load takes its place THEN that is reported within 10 ms, once, as the friction of the
    // present is known less well than its force sensors' noise
    run(&bench, &heavier, 200);
    TEST_ASSERT_EQUAL_UINT32(1, bench.alarms);
    TEST_ASSERT_LESS_OR_EQUAL_UINT32(3010, bench.last_alarm);
    // AND the effects are as well known as before, and the new load is found
    for (int i = 0; i < DIM; i++) {
        TEST_ASSERT_TRUE((double)bench.answer.sigma[i] <= 1.01 * (double)before.sigma[i]);
        TEST_ASSERT_DOUBLE_WITHIN(5.0 * (double)bench.answer.sigma[i], effects.value[i],
                                  (double)bench.answer.value[i]);
    }
    run(&bench, &heavier, 2000);
    TEST_ASSERT_EQUAL_UINT32(1, bench.alarms);
    TEST_ASSERT_TRUE(nees_of(&bench, &heavier, LOAD) < 53.0);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_VERDICT_CONVERGED, bench.estimate.verdict);
}

static void test_two_changes_of_the_load_at_once_leave_the_actuator_effects_known(void) {
    const uint32_t apart[] = {50, 80, 120};
    for (int n = 0; n < 3; n++) {
        // GIVEN a load and actuator effects that have been identified
        const effects_t effects = random_effects(77);
        const body_t last = {380.0, {-0.05, 0.02, 0.30}, {20.0, 22.0, 15.0, 0.0, 0.0, 0.0}};
        static bench_t bench;
        begin(&bench, paper_machine(), random_motion(31, 0.05, 0.1), &effects, 5);
        run(&bench, &eccentric, 3000);
        // WHEN another load takes its place, and a third one before the second one's samples have been passed
        run(&bench, &heavier, apart[n]);
        run(&bench, &last, 400);
        // THEN both changes are reported, AND the effects are right: of twenty one is beyond 4.5 sigmas in
        // one of 7,000 runs
        TEST_ASSERT_EQUAL_UINT32(2, bench.alarms);
        for (int i = 0; i < DIM; i++) {
            TEST_ASSERT_DOUBLE_WITHIN(4.5 * (double)bench.answer.sigma[i], effects.value[i],
                                      (double)bench.answer.value[i]);
        }
    }
}

static void test_held_effects_stay_and_their_errors_count(void) {
    // GIVEN a filter at work, with two constants that are open, WHEN the load has just changed, so that
    // effects are held
    const motion_t motion = random_motion(17, 0.05, 0.1);
    const effects_t effects = random_effects(86);
    static step_t free, held;
    begin_step(&free);
    free.config.rig.direction_count = 2;
    for (int leg = 0; leg < 6; leg++) {
        free.config.rig.direction[leg % 2].force_gain[leg] = HEXLOAD_REAL(1e-3);
    }
    for (uint32_t tick = 0; tick < 100; tick++) {
        next_step(&free, &motion, &effects, tick, 1e-3);
        take_step(&free);
    }
    next_step(&free, &motion, &effects, 100, 1e-3);
    held = free;
    const step_t before = free;
    hexload_actuator_effects_hold(&held.effects, &held.config);
    take_step(&free);
    take_step(&held);
    // THEN load and momentum change as they would with free effects, and so does what they have in common
    TEST_ASSERT_EQUAL_MEMORY(&free.load, &held.load, sizeof held.load);
    TEST_ASSERT_EQUAL_MEMORY(&free.consider, &held.consider, sizeof held.consider);
    for (int i = 0; i < DIM; i++) {
        TEST_ASSERT_EQUAL_MEMORY(&free.effects.covariance[EFFECT_ROW(i)],
                                 &held.effects.covariance[EFFECT_ROW(i)], KNOWN * sizeof(hexload_real_t));
        // AND the effects themselves stay, as well known as before but for the inflation of rounding
        TEST_ASSERT_TRUE(held.effects.effect[i] == before.effects.effect[i]);
        TEST_ASSERT_TRUE(free.effects.effect[i] != before.effects.effect[i]);
        const hexload_real_t known = effects_covariance(&before.effects, i, i);
        TEST_ASSERT_TRUE(effects_covariance(&held.effects, i, i) == known * HEXLOAD_COVARIANCE_INFLATION);
        // AND so does what the constants do to them
        for (int n = 0; n < 2; n++) {
            TEST_ASSERT_TRUE(held.effects.considered[n][i] == before.effects.considered[n][i]);
            TEST_ASSERT_TRUE(free.effects.considered[n][i] != before.effects.considered[n][i]);
        }
    }
    // AND when the lag and twice the longest one have passed, they are free again
    for (uint32_t tick = 1; tick < held.config.momentum.lag_ticks + 2 * HEXLOAD_LAG_TICKS_MAX; tick++) {
        TEST_ASSERT_TRUE(held.effects.held_ticks > 0);
        take_step(&held);
        TEST_ASSERT_EQUAL_MEMORY(before.effects.effect, held.effects.effect, sizeof before.effects.effect);
    }
    TEST_ASSERT_EQUAL_UINT32(0, held.effects.held_ticks);
    take_step(&held);
    TEST_ASSERT_TRUE(held.effects.effect[0] != before.effects.effect[0]);
}

static void test_effects_are_held_for_what_a_window_of_displacements_adds_too(void) {
    // GIVEN speeds from velocity sensors, or from a window of 2 x 6 ticks, whose middle is 6 ticks late WHEN
    // the load changes THEN the effects are held for the lag, twice the longest one and that
    for (uint32_t half = 0; half <= 6; half += 6) {
        static step_t step;
        begin_step(&step);
        step.config.sensors.half_window_ticks = half;
        hexload_actuator_effects_hold(&step.effects, &step.config);
        TEST_ASSERT_EQUAL_UINT32(step.config.momentum.lag_ticks + 2 * HEXLOAD_LAG_TICKS_MAX + half,
                                 step.effects.held_ticks);
    }
}

static void test_a_known_mass_that_is_wrong_comes_out(void) {
    // GIVEN a load that is said to weigh half as much again, and actuators of which nothing is known
    const effects_t effects = random_effects(79);
    static bench_t bench;
    hexload_config_t config = paper_machine();
    config.momentum.prior_mass_kg = HEXLOAD_REAL(450.0);
    config.momentum.prior_mass_sigma_kg = HEXLOAD_REAL(0.1);
    begin(&bench, config, random_motion(33, 0.05, 0.1), &effects, 6);
    // WHEN 4 s have passed THEN that was detected, and load and actuator effects are as they are
    run(&bench, &eccentric, 4000);
    TEST_ASSERT_TRUE(bench.alarms >= 1);
    TEST_ASSERT_TRUE(bench.last_alarm < 1000);
    TEST_ASSERT_TRUE(nees_of(&bench, &eccentric, LOAD) < 53.0);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_VERDICT_CONVERGED, bench.estimate.verdict);
}

static void test_standstill_says_that_bias_and_load_are_confounded(void) {
    // GIVEN a platform that stands, whose force sensors may be off by 100 N WHEN 2 s have passed
    const effects_t effects = random_effects(78);
    static bench_t bench;
    begin(&bench, paper_machine(), at_rest(), &effects, 3);
    run(&bench, &eccentric, 2000);
    // THEN mass and the horizontal place of its centre are confounded with the biases, and that is reported
    const uint32_t m_hx_hy = 1u << HEXLOAD_LOAD_M | 1u << HEXLOAD_LOAD_HX | 1u << HEXLOAD_LOAD_HY;
    TEST_ASSERT_EQUAL_HEX32(m_hx_hy, bench.answer.confounded_with_bias);
    TEST_ASSERT_EQUAL_HEX32(0, bench.answer.confounded_with_friction);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_VERDICT_NOT_EXCITED, bench.estimate.parameter_verdict[HEXLOAD_LOAD_M]);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_VERDICT_NOT_EXCITED, bench.estimate.verdict);
    TEST_ASSERT_TRUE(bench.estimator.momentum.health.bits >> HEXLOAD_HEALTH_NOT_EXCITED & 1u);
    TEST_ASSERT_TRUE(bench.answer.fastest_leg_m_s < HEXLOAD_REAL(2e-3));
    // AND the sigma covers the error: of six biases of 100 N, the part along gravity
    TEST_ASSERT_TRUE((double)bench.estimate.sigma[0] > 15.0);
    TEST_ASSERT_DOUBLE_WITHIN(4.0 * (double)bench.estimate.sigma[0], 312.0, (double)bench.estimate.value[0]);
    // AND a motion that begins then is no load change, and identifies all
    bench.motion = motion_from_rest(8);
    bench.tick += 60;
    run(&bench, &eccentric, 10);
    TEST_ASSERT_EQUAL_UINT32(0, bench.alarms);
}

static void test_identifiability_is_the_conditional_variance(void) {
    // GIVEN the covariance of an estimator in the midst of its work
    const effects_t effects = random_effects(79);
    static bench_t bench;
    static double P[LOAD + DIM][LOAD + DIM];
    begin(&bench, paper_machine(), random_motion(62, 0.01, 0.02), &effects, 6);
    run(&bench, &eccentric, 1500);
    for (int i = 0; i < LOAD + DIM; i++) { // the effects first
        for (int j = 0; j < LOAD + DIM; j++) {
            P[i][j] =
                covariance_of(&bench.estimator, i < DIM ? KNOWN + i : i - DIM, j < DIM ? KNOWN + j : j - DIM);
        }
    }
    // WHEN a round of elimination is made of it
    hexload_identifiability_t identifiability;
    const hexload_smooth_sample_t still = {.gap_ticks = 1};
    hexload_identifiability_init(&identifiability);
    do {
        hexload_identifiability_step(&identifiability, &bench.config, &bench.estimator.momentum.filter,
                                     &bench.estimator.effects.filter, &still);
    } while (identifiability.next < DIM + LOAD);
    // THEN what is left of the variances is what Gauss leaves in double precision
    for (int at = 0; at < DIM; at++) {
        for (int i = at + 1; i < LOAD + DIM; i++) {
            const double factor = P[i][at] / P[at][at];
            for (int j = at; j < LOAD + DIM; j++) {
                P[i][j] -= factor * P[at][j];
            }
        }
    }
    for (int k = 0; k < LOAD; k++) {
        const double before = (double)bench.estimator.momentum.filter.load_cov[k][k];
        TEST_ASSERT_DOUBLE_WITHIN(1e-3 * before, P[DIM + k][DIM + k], (double)identifiability.variance[k]);
    }
}

static void test_forgetting_the_load_keeps_the_actuator_effects(void) {
    // GIVEN a filter at work WHEN the load is forgotten
    const effects_t effects = random_effects(82);
    static bench_t bench;
    begin(&bench, paper_machine(), random_motion(63, 0.05, 0.1), &effects, 11);
    run(&bench, &eccentric, 500);
    hexload_actuator_effects_t forgetful = bench.estimator.effects.filter;
    hexload_actuator_effects_forget(&forgetful);
    // THEN the effects and their covariance stay, and what they had in common with the load is gone
    for (int i = 0; i < DIM; i++) {
        TEST_ASSERT_TRUE(forgetful.effect[i] == bench.estimator.effects.filter.effect[i]);
        for (int k = 0; k < KNOWN; k++) {
            TEST_ASSERT_TRUE(forgetful.covariance[EFFECT_ROW(i) + k] == HEXLOAD_REAL(0.0));
        }
        for (int j = 0; j < DIM; j++) {
            TEST_ASSERT_TRUE(effects_covariance(&forgetful, i, j) ==
                             effects_covariance(&bench.estimator.effects.filter, i, j));
        }
    }
    // AND a number that is not finite is detected
    TEST_ASSERT_TRUE(hexload_actuator_effects_is_finite(&forgetful));
    forgetful.effect[17] = (hexload_real_t)NAN;
    TEST_ASSERT_FALSE(hexload_actuator_effects_is_finite(&forgetful));
}

static void test_refused_sample_changes_nothing_but_the_counter(void) {
    const effects_t effects = random_effects(80);
    static bench_t bench;
    static hexload_momentum_effects_t before;
    begin(&bench, paper_machine(), random_motion(44, 0.05, 0.1), &effects, 9);
    run(&bench, &eccentric, 300);
    memcpy(&before, &bench.estimator, sizeof before);
    // GIVEN a NaN and an old tick WHEN they come THEN only the count of refusals changes
    hexload_leg_sample_t broken[2] = {{.tick = 300}, {.tick = 299}};
    broken[0].force_n[3] = (hexload_real_t)NAN;
    for (int n = 0; n < 2; n++) {
        TEST_ASSERT_NOT_EQUAL(HEXLOAD_OK, hexload_momentum_effects_tick(&bench.estimator, &bench.config,
                                                                        &broken[n], &bench.estimate));
    }
    TEST_ASSERT_EQUAL_UINT32(before.momentum.health.refused + 2, bench.estimator.momentum.health.refused);
    bench.estimator.momentum.health.refused = before.momentum.health.refused;
    TEST_ASSERT_EQUAL_MEMORY(&before, &bench.estimator, sizeof before);
}

static void test_broken_covariance_begins_anew(void) {
    const effects_t effects = random_effects(81);
    static bench_t bench;
    begin(&bench, paper_machine(), random_motion(45, 0.05, 0.1), &effects, 10);
    run(&bench, &eccentric, 1000);
    // GIVEN a variance of an effect that rounding, or a fault of memory, has spoilt WHEN the next sample
    // comes
    bench.estimator.effects.filter.covariance[EFFECT_ROW(7) + KNOWN + 7] = HEXLOAD_REAL(-1e9);
    run(&bench, &eccentric, 1);
    // THEN load and effects begin anew, that is said, and they are found again
    TEST_ASSERT_TRUE(bench.estimator.momentum.health.bits >> HEXLOAD_HEALTH_FILTER_RESTARTED & 1u);
    TEST_ASSERT_TRUE(bench.answer.sigma[7] == bench.config.actuator_effects.prior_coulomb_sigma_n);
    run(&bench, &eccentric, 3000);
    TEST_ASSERT_TRUE(nees_of(&bench, &eccentric, LOAD) < 53.0);
}

static void test_a_tilt_beyond_gravity_takes_nothing_from_its_length(void) {
    // GIVEN a platform with a load WHEN gravity's x would be longer than gravity itself THEN its z loses
    // nothing: it falls in x alone, and no root of a negative number comes in
    static step_t step;
    double far[6], here[6];
    predicted_momentum(&step, KNOWN + TILT, 0.0, here);
    const double g = (double)step.config.gravity_m_s2;
    predicted_momentum(&step, KNOWN + TILT, 2.0 * g, far);
    const double mass_kg = (double)step.load.theta[0] + (double)step.load.platform[0];
    const double impulse = mass_kg * (double)step.config.tick_s * g;
    TEST_ASSERT_DOUBLE_WITHIN(1e-3 * impulse, here[2], far[2]);
    TEST_ASSERT_TRUE(fabs(far[0] - here[0]) > 0.5 * impulse);
}

static void test_a_platform_that_rests_teaches_nothing_after_two_seconds(void) {
    // GIVEN a platform that stands WHEN it has for two seconds and the lag THEN the filter holds what it
    // knows, to the bit, and the time does not wrap
    const effects_t effects = random_effects(78);
    static bench_t bench;
    begin(&bench, paper_machine(), at_rest(), &effects, 3);
    run(&bench, &eccentric, 2100);
    TEST_ASSERT_TRUE(bench.estimator.momentum.is_interrupted);
    const hexload_momentum_filter_t before = bench.estimator.momentum.filter;
    const uint32_t rest_ticks = bench.estimator.effects.filter.rest_ticks;
    const hexload_real_t gain_ticks = bench.estimator.effects.filter.gains.ticks;
    run(&bench, &eccentric, 50);
    TEST_ASSERT_EQUAL_MEMORY(before.theta, bench.estimator.momentum.filter.theta, sizeof before.theta);
    TEST_ASSERT_EQUAL_MEMORY(before.load_cov, bench.estimator.momentum.filter.load_cov,
                             sizeof before.load_cov);
    TEST_ASSERT_EQUAL_UINT32(rest_ticks, bench.estimator.effects.filter.rest_ticks);
    TEST_ASSERT_EQUAL_UINT32(2000, rest_ticks);
    // AND nothing of gains
    TEST_ASSERT_TRUE(gain_ticks == bench.estimator.effects.filter.gains.ticks);
    // AND no innovation counts twice, nor any of those that it does not look at
    TEST_ASSERT_EQUAL_DOUBLE(6.0, round(1e6 * (double)bench.estimator.momentum.filter.nis) / 1e6);
    // AND WHEN it moves THEN the filter learns again, after as many ticks as a transient is seen by
    bench.motion = motion_from_rest(8);
    bench.tick = 60;
    bench.estimator.momentum.leg_gate.accepted = 0; // time begins anew with the motion
    run(&bench, &eccentric, 700);
    TEST_ASSERT_FALSE(bench.estimator.momentum.is_interrupted);
    TEST_ASSERT_EQUAL_UINT32(0, bench.alarms);
    TEST_ASSERT_TRUE(bench.estimator.effects.filter.rest_ticks < 2000);
    TEST_ASSERT_TRUE(bench.estimator.momentum.filter.load_cov[0][0] < before.load_cov[0][0]);
}

static void test_a_load_put_on_a_platform_that_has_rested_for_long_is_weighed(void) {
    // GIVEN a platform that stands with a load, so long that the filter sleeps WHEN another one takes its
    // place
    const effects_t effects = random_effects(79);
    static bench_t bench;
    begin(&bench, paper_machine(), random_motion(46, 0.03, 0.06), &effects, 3);
    run(&bench, &eccentric, 4000);
    bench.motion = at_rest();
    bench.tick += 1000; // from anywhere in the motion
    run(&bench, &eccentric, 3000);
    run(&bench, &heavier, 2000);
    // THEN it is reported, and weighed at rest as far as biases and friction at rest, which are open, tell
    TEST_ASSERT_EQUAL_UINT32(1, bench.alarms);
    TEST_ASSERT_TRUE((double)bench.estimate.sigma[0] < 0.1 * heavier.mass_kg);
    TEST_ASSERT_DOUBLE_WITHIN(5.0 * (double)bench.estimate.sigma[0], heavier.mass_kg,
                              (double)bench.estimate.value[0]);
}

static void test_an_effect_that_is_no_number_begins_anew(void) {
    // GIVEN an effect that a fault of memory has spoilt, before any sample has reached the filter WHEN the
    // next one comes THEN all begins anew, and that is said
    static bench_t bench;
    begin(&bench, paper_machine(), random_motion(45, 0.05, 0.1), &none, 10);
    run(&bench, &eccentric, 5);
    bench.estimator.effects.filter.effect[3] = (hexload_real_t)NAN;
    run(&bench, &eccentric, 1);
    TEST_ASSERT_TRUE(bench.estimator.momentum.health.bits >> HEXLOAD_HEALTH_FILTER_RESTARTED & 1u);
    TEST_ASSERT_TRUE(bench.answer.value[3] == HEXLOAD_REAL(0.0));
    run(&bench, &eccentric, 1);
    TEST_ASSERT_FALSE(bench.estimator.momentum.health.bits >> HEXLOAD_HEALTH_FILTER_RESTARTED & 1u);
}

static void test_what_of_the_legs_hangs_on_the_platform_is_in_the_sigmas_of_free_effects(void) {
    // GIVEN two filters of free effects, for one of which legs of 15 % of the platform's mass may hang on it
    static bench_t exact, open;
    hexload_config_t config = paper_machine();
    begin(&exact, config, random_motion(45, 0.05, 0.1), &none, 10);
    config.actuator_effects.leg_share = HEXLOAD_REAL(0.15);
    begin(&open, config, random_motion(45, 0.05, 0.1), &none, 10);
    for (int begun_anew = 0; begun_anew < 2; begun_anew++) {
        // WHEN a load moves THEN its mass is open by that, and its moments by twice the share of the platform's
        run(&exact, &eccentric, 1500);
        run(&open, &eccentric, 1500);
        const double of_mass =
            hypot((double)exact.estimate.sigma[HEXLOAD_LOAD_M], 0.15 * (double)config.platform.mass_kg);
        const double of_izz = hypot((double)exact.estimate.sigma[HEXLOAD_LOAD_IZZ],
                                    0.3 * (double)config.platform.inertia_kg_m2[HEXLOAD_I_ZZ]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-3 * of_mass, of_mass, (double)open.estimate.sigma[HEXLOAD_LOAD_M]);
        TEST_ASSERT_DOUBLE_WITHIN(1e-3 * of_izz, of_izz, (double)open.estimate.sigma[HEXLOAD_LOAD_IZZ]);
        // AND so it is after all has begun anew
        exact.estimator.effects.filter.effect[3] = (hexload_real_t)NAN;
        open.estimator.effects.filter.effect[3] = (hexload_real_t)NAN;
    }
}

static void test_what_legs_do_faster_than_the_smoother_is_a_mean_of_two_seconds(void) {
    // GIVEN a smooth motion, of which only noise is faster than the smoother WHEN a second has passed THEN
    // the mean of six squares less their variance is zero: of n ticks its sigma is sqrt(2 / 6 / n) of the
    // variance, and five of them are allowed
    static bench_t bench;
    begin(&bench, paper_machine(), random_motion(45, 0.05, 0.1), &none, 10);
    run(&bench, &eccentric, 1000);
    const double variance = pow((double)bench.config.sensors.velocity_sigma_m_s, 2.0);
    const double ticks = 1000.0 - bench.config.momentum.lag_ticks;
    TEST_ASSERT_DOUBLE_WITHIN(5.0 * sqrt(2.0 / 6.0 / ticks) * variance, 0.0,
                              (double)bench.estimator.effects.filter.residual_m2_s2);
    // AND a tick in motion takes the 25 ticks of a transient from the time at rest
    bench.estimator.effects.filter.rest_ticks = 1000;
    run(&bench, &eccentric, 1);
    TEST_ASSERT_EQUAL_UINT32(1000 - 25, bench.estimator.effects.filter.rest_ticks);
    bench.estimator.effects.filter.rest_ticks = 7;
    run(&bench, &eccentric, 1);
    TEST_ASSERT_EQUAL_UINT32(0, bench.estimator.effects.filter.rest_ticks);
}

/// A step of legs that stand, of which the smoother says that all move at this speed.
static void step_at_speed(step_t* step, uint32_t tick, double speed_m_s) {
    const motion_t motion = at_rest();
    next_step(step, &motion, &none, tick, 0.0);
    for (int leg = 0; leg < 6; leg++) {
        step->sample.smooth_velocity_m_s[leg] = (hexload_real_t)speed_m_s;
    }
    take_step(step);
}

static void test_the_residual_is_a_mean_of_all_and_then_of_two_seconds(void) {
    // GIVEN ticks of 1/64 s, so that 128 are two seconds WHEN the legs' speeds are off the smoother's by 5
    // mm/s in the first 64, 30 mm/s in the next, and 10 mm/s from then on
    static step_t step;
    double mean = 0.0;
    begin_step(&step);
    step.config.tick_s = HEXLOAD_REAL(1.0) / HEXLOAD_REAL(64.0);
    const double variance = pow((double)step.config.sensors.velocity_sigma_m_s, 2.0);
    for (uint32_t tick = 0; tick < 192; tick++) {
        const double speed_m_s = tick < 64 ? 5e-3 : tick < 128 ? 30e-3 : 10e-3;
        step_at_speed(&step, tick, speed_m_s);
        // THEN it is the mean of the squares less the sensors' variance, each tick of the last counting by
        // 1/128
        mean += (speed_m_s * speed_m_s - variance - mean) / fmin(tick + 1.0, 128.0);
        TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(4.0 * (tick + 1.0), 9e-4), mean,
                                  (double)step.effects.residual_m2_s2);
    }
}

static void test_rest_is_what_noise_of_the_smoother_reaches_in_95_of_100_cases(void) {
    // GIVEN the variance of a speed that fits a line, a cubic and a quintic to displacements of white noise
    static step_t step;
    begin_step(&step);
    double variance = 0.0;
    for (int m = 0; m < 3; m++) {
        variance += pow((double)step.config.sensors.displacement_sigma_m, 2.0) /
                    (double)step.smoother.constants.inverse_gain[m];
    }
    // WHEN the sum of six squares is 1 % below 12.59 of it, the chi-square of 95 % THEN the legs rest, and
    // WHEN it is 1 % above THEN they do not
    for (uint32_t tick = 0; tick < 4; tick++) {
        step_at_speed(&step, tick, sqrt(0.99 * 12.59 * variance / 6.0));
        TEST_ASSERT_EQUAL_UINT32(tick + 1, step.effects.rest_ticks);
    }
    step_at_speed(&step, 4, sqrt(1.01 * 12.59 * variance / 6.0));
    TEST_ASSERT_EQUAL_UINT32(0, step.effects.rest_ticks);
}

/// Sum of the variances of a momentum that was known exactly, after a tick in which the legs have a speed and
/// rub, and the smoother's residual is known for long. @param[out] push the sum of squares of the legs'
/// columns.
static double momentum_variance(double coulomb_n, double residual_m2_s2, double speed_m_s, double* push) {
    const motion_t motion = random_motion(29, 0.05, 0.1);
    step_t step;
    begin_step(&step);
    step.config.sensors.velocity_sigma_m_s =
        HEXLOAD_REAL(1.0); // so that the update takes next to nothing off
    for (uint32_t tick = 0; tick < 2; tick++) {
        next_step(&step, &motion, &none, tick, 0.0);
        memset(step.load.load_cov, 0, sizeof step.load.load_cov);
        memset(step.load.cross_cov, 0, sizeof step.load.cross_cov);
        memset(step.load.momentum_cov, 0, sizeof step.load.momentum_cov);
        memset(step.effects.covariance, 0, sizeof step.effects.covariance);
        for (int leg = 0; leg < 6; leg++) {
            step.sample.smooth_velocity_m_s[leg] = (hexload_real_t)speed_m_s;
            step.effects.effect[6 + leg] = (hexload_real_t)coulomb_n;
        }
        step.effects.residual_m2_s2 = (hexload_real_t)residual_m2_s2;
        step.effects.ticks = UINT32_MAX;
        take_step(&step);
    }
    double sum = 0.0, A[6][DIM];
    effect_rates(&step, A);
    *push = 0.0;
    for (int k = 0; k < 6; k++) {
        sum += (double)step.load.momentum_cov[k][k];
        for (int leg = 0; leg < 6; leg++) {
            *push += A[k][leg] * A[k][leg];
        }
    }
    return sum;
}

static void test_friction_near_standstill_is_noise_of_speed_and_shape_for_a_lag(void) {
    // GIVEN legs at or near standstill, where the speed's error turns the sign of their friction: by the
    // smoother's noise, and what the legs do faster than it, if that is more than nothing; and friction of
    // another shape is off by v s'(v) of itself for each unit of ln v0
    const hexload_config_t config = crooked_machine();
    hexload_smoother_t smoother;
    hexload_smoother_init(&smoother, &config);
    double noise = 0.0, push;
    for (int m = 0; m < 3; m++) {
        noise += pow((double)config.sensors.displacement_sigma_m, 2.0) /
                 (double)smoother.constants.inverse_gain[m];
    }
    const struct {
        double coulomb_n, residual_m2_s2, speed_m_s;
    } cases[] = {{1000.0, -0.5, 0.0},         {2000.0, 0.0, 0.0},  {1000.0, noise, 0.0},
                 {-1500.0, 3.0 * noise, 0.0}, {50.0, 0.0, 3.5e-3}, {30.0, noise, -8e-3}};
    for (int n = 0; n < 6; n++) {
        // WHEN a tick passes THEN the momentum's variance grows by that of an impulse F s'(v) dv for a tick,
        // as often as the error lasts, to a hundredth: the update takes off next to nothing
        const double v = cases[n].speed_m_s, shape_m_s = (double)config.actuator_effects.friction_shape * v;
        const double without = momentum_variance(0.0, 0.0, v, &push);
        const double added =
            momentum_variance(cases[n].coulomb_n, cases[n].residual_m2_s2, v, &push) - without;
        const double slope_s_m = 5e-3 * 5e-3 / pow(hypot(v, 5e-3), 3.0);
        const double impulse = cases[n].coulomb_n * (double)config.tick_s * slope_s_m;
        const double expected = (double)config.momentum.lag_ticks *
                                (noise + fmax(cases[n].residual_m2_s2, 0.0) + shape_m_s * shape_m_s) *
                                impulse * impulse * push;
        TEST_ASSERT_DOUBLE_WITHIN(0.01 * expected, expected, added);
    }
}

/// Two seconds of motion, whose velocities are held for so many ticks. @return the verdict at their end.
static hexload_verdict_t verdict_of_held(uint32_t held_ticks) {
    bench_t bench;
    begin(&bench, paper_machine(), motion_from_rest(4), &none, 4);
    hexload_leg_sample_t held = {.tick = 0};
    for (uint32_t n = 0; n < 2000; n++) {
        hexload_leg_sample_t sample = next_sample(&bench, &eccentric);
        held = n % held_ticks == 0 ? sample : held;
        memcpy(sample.velocity_m_s, held.velocity_m_s, sizeof held.velocity_m_s);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_momentum_effects_tick(&bench.estimator, &bench.config,
                                                                        &sample, &bench.estimate));
        bench.tick++;
    }
    return bench.estimate.verdict;
}

static void test_what_has_converged_is_confounded_with_nothing(void) {
    // GIVEN an instance that takes all parameters for confounded, and an estimate of which the first has
    // converged
    static hexload_momentum_effects_t estimator;
    hexload_estimate_t estimate = {.tick = 0};
    hexload_effects_estimate_t effects;
    estimator.effects.identifiability.bias_mask = UINT32_MAX;
    estimator.effects.identifiability.friction_mask = UINT32_MAX;
    estimator.effects.identifiability.tilt_mask = UINT32_MAX;
    for (int k = 1; k < LOAD; k++) {
        estimate.parameter_verdict[k] = HEXLOAD_VERDICT_CONVERGING;
    }
    // WHEN it is read THEN all others are
    hexload_momentum_effects_read(&estimator, &estimate, &effects);
    TEST_ASSERT_EQUAL_UINT32(1022, effects.confounded_with_bias);
    TEST_ASSERT_EQUAL_UINT32(1022, effects.confounded_with_friction);
    TEST_ASSERT_EQUAL_UINT32(1022, effects.confounded_with_tilt);
}

static void test_velocities_that_are_held_are_a_misfit(void) {
    // GIVEN velocities of each tick, and of every second one, held WHEN two seconds have passed THEN the
    // latter are a misfit
    TEST_ASSERT_LESS_THAN_INT(HEXLOAD_VERDICT_MISFIT, verdict_of_held(1));
    TEST_ASSERT_EQUAL_INT(HEXLOAD_VERDICT_MISFIT, verdict_of_held(2));
}

static void test_friction_that_drives_a_leg_is_a_misfit(void) {
    // GIVEN a leg that is braked, or driven, by 400 N s/m WHEN three seconds have passed THEN the latter is no
    // friction
    effects_t effects = {{0.0}};
    static bench_t bench;
    effects.value[12] = 400.0;
    begin(&bench, paper_machine(), random_motion(31, 0.05, 0.1), &effects, 4);
    run(&bench, &eccentric, 3000);
    TEST_ASSERT_LESS_THAN_INT(HEXLOAD_VERDICT_MISFIT, bench.estimate.verdict);
    effects.value[12] = -400.0;
    begin(&bench, paper_machine(), random_motion(31, 0.05, 0.1), &effects, 4);
    run(&bench, &eccentric, 3000);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_VERDICT_MISFIT, bench.estimate.verdict);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_step_is_that_of_a_dense_filter);
    RUN_TEST(test_a_momentum_that_begins_anew_goes_with_the_effects_as_the_load_does);
    RUN_TEST(test_held_effects_stay_and_their_errors_count);
    RUN_TEST(test_columns_of_a_step_are_finite_differences);
    RUN_TEST(test_known_effects_leave_nothing_of_what_the_legs_show);
    RUN_TEST(test_a_tilt_turns_gravity_and_keeps_its_length);
    RUN_TEST(test_a_tilt_beyond_gravity_takes_nothing_from_its_length);
    RUN_TEST(test_errors_by_each_of_many_constants_go_the_same_way);
    RUN_TEST(test_what_effects_are_off_commissioning_is_a_mean_of_squares);
    RUN_TEST(test_an_effect_that_is_next_to_known_is_a_state_all_the_same);
    RUN_TEST(test_effects_are_held_for_what_a_window_of_displacements_adds_too);
    RUN_TEST(test_the_residual_is_a_mean_of_all_and_then_of_two_seconds);
    RUN_TEST(test_rest_is_what_noise_of_the_smoother_reaches_in_95_of_100_cases);
    RUN_TEST(test_friction_near_standstill_is_noise_of_speed_and_shape_for_a_lag);
    RUN_TEST(test_what_has_converged_is_confounded_with_nothing);
    RUN_TEST(test_velocities_that_are_held_are_a_misfit);
    RUN_TEST(test_friction_that_drives_a_leg_is_a_misfit);
    RUN_TEST(test_open_constants_move_load_and_effects_as_said);
    RUN_TEST(test_a_state_is_not_considered_too);
    RUN_TEST(test_effects_of_sigma_zero_are_none);
    RUN_TEST(test_a_load_change_leaves_the_actuator_effects_known);
    RUN_TEST(test_two_changes_of_the_load_at_once_leave_the_actuator_effects_known);
    RUN_TEST(test_a_known_mass_that_is_wrong_comes_out);
    RUN_TEST(test_standstill_says_that_bias_and_load_are_confounded);
    RUN_TEST(test_identifiability_is_the_conditional_variance);
    RUN_TEST(test_forgetting_the_load_keeps_the_actuator_effects);
    RUN_TEST(test_refused_sample_changes_nothing_but_the_counter);
    RUN_TEST(test_broken_covariance_begins_anew);
    RUN_TEST(test_a_platform_that_rests_teaches_nothing_after_two_seconds);
    RUN_TEST(test_a_load_put_on_a_platform_that_has_rested_for_long_is_weighed);
    RUN_TEST(test_an_effect_that_is_no_number_begins_anew);
    RUN_TEST(test_what_of_the_legs_hangs_on_the_platform_is_in_the_sigmas_of_free_effects);
    RUN_TEST(test_what_legs_do_faster_than_the_smoother_is_a_mean_of_two_seconds);
    RUN_TEST(test_errors_are_as_large_as_the_filter_says);
    return UNITY_END();
}
