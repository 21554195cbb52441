/// What the estimator of actuator effects takes off a sample, beside the equations in double precision.
#include "actuator_effects/actuator_effects_model.h"
#include "textbook.h"

#include <math.h>
#include <string.h>

void setUp(void) {}
void tearDown(void) {}

enum { DIM = HEXLOAD_EFFECTS_DIM, LEGS = HEXLOAD_LEGS, TILT = HEXLOAD_EFFECT_TILT };

typedef struct bench {
    scene_t scene;
    hexload_momentum_filter_t load;
    hexload_actuator_effects_t effects;
    double P[DIM][DIM];
    double lever[4]; ///< m, and R h of platform and load
} bench_t;

/// Effects and a covariance of them, of vectors a for each of DIM + 1 sources.
static void begin(bench_t* bench, uint64_t* seed, double speed_m_s) {
    memset(bench, 0, sizeof *bench);
    scene_at(&bench->scene, 190);
    hexload_momentum_filter_init(&bench->load, &bench->scene.config);
    double h[3];
    bench->lever[0] = 400.0 + (double)bench->load.platform[0];
    bench->load.theta[0] = HEXLOAD_REAL(400.0);
    for (int k = 0; k < 3; k++) {
        bench->load.theta[1 + k] = (hexload_real_t)(80.0 * uniform(seed));
        h[k] = (double)bench->load.theta[1 + k] + (double)bench->load.platform[1 + k];
    }
    for (int k = 0; k < 3; k++) {
        for (int j = 0; j < 3; j++) {
            bench->lever[1 + k] += (double)bench->scene.motion.R[k][j] * h[j];
        }
    }
    for (int i = 0; i < DIM; i++) {
        const double size = i < 12 ? 20.0 : i < TILT ? 200.0 : 0.1;
        bench->effects.effect[i] = (hexload_real_t)(size * uniform(seed));
    }
    for (int source = 0; source <= DIM; source++) {
        double a[DIM];
        for (int i = 0; i < DIM; i++) {
            a[i] = (i < 12 ? 3.0 : i < TILT ? 30.0 : 0.003) * uniform(seed);
        }
        for (int i = 0; i < DIM; i++) {
            for (int j = 0; j < DIM; j++) {
                bench->P[i][j] += a[i] * a[j];
            }
        }
    }
    for (int i = 0; i < DIM; i++) {
        for (int j = 0; j <= i; j++) {
            bench->effects.covariance[EFFECT_ROW(i) + HEXLOAD_MOMENTUM_STATES + j] =
                (hexload_real_t)bench->P[i][j];
        }
    }
    for (int leg = 0; leg < LEGS; leg++) {
        bench->scene.sample.velocity_m_s[leg] = (hexload_real_t)(speed_m_s * uniform(seed));
    }
}

/// What a leg carries of a gravity that has these parts: its twist at unit speed times [m g; R h x g].
static double carried(const bench_t* bench, int leg, const double gravity[3]) {
    double speed[LEGS] = {0}, twist[6], moment[3], sum = 0.0;
    speed[leg] = 1.0;
    twist_of(&bench->scene.motion, speed, twist);
    cross(&bench->lever[1], gravity, moment);
    for (int k = 0; k < 3; k++) {
        sum += twist[k] * bench->lever[0] * gravity[k] + twist[3 + k] * moment[k];
    }
    return sum;
}

static void check_clean(bench_t* bench, bool has_tilt) {
    const hexload_config_t* config = &bench->scene.config;
    const hexload_real_t* effect = bench->effects.effect;
    const double g = (double)config->gravity_m_s2, v0 = (double)config->actuator_effects.friction_speed_m_s;
    const double x = (double)effect[TILT], y = (double)effect[TILT + 1];
    const double tilted[3] = {x, y, g - sqrt(g * g - x * x - y * y)};
    hexload_leg_sample_t sample = bench->scene.sample;
    hexload_sensors_t sensors = config->sensors;
    double most = 0.0;
    hexload_actuator_effects_clean(&bench->effects, &bench->load, config, &bench->scene.motion, &sample,
                                   &sensors);
    for (int leg = 0; leg < LEGS; leg++) {
        static const double along_x[3] = {1, 0, 0}, along_y[3] = {0, 1, 0};
        const double v = (double)bench->scene.sample.velocity_m_s[leg];
        const double sign = v / sqrt(v * v + v0 * v0), slope = v0 * v0 / pow(v * v + v0 * v0, 1.5);
        const double weight[3] = {1.0, sign, v};
        const double by[2] = {carried(bench, leg, along_x), carried(bench, leg, along_y)};
        const double turning = ((double)effect[6 + leg] * slope + (double)effect[12 + leg]) *
                               (double)config->sensors.velocity_sigma_m_s;
        double force_n =
            (double)bench->scene.sample.force_n[leg] + (has_tilt ? carried(bench, leg, tilted) : 0.0);
        const double shape =
            (double)config->actuator_effects.friction_shape * (double)effect[6 + leg] * slope * v;
        double lasting = shape * shape;
        for (int i = 0; i < 3; i++) {
            force_n -= weight[i] * (double)effect[6 * i + leg];
            for (int j = 0; j < 3; j++) {
                lasting += weight[i] * weight[j] * bench->P[6 * i + leg][6 * j + leg];
            }
        }
        for (int i = 0; i < 2 && has_tilt; i++) {
            for (int j = 0; j < 2; j++) {
                lasting += by[i] * by[j] * bench->P[TILT + i][TILT + j];
            }
        }
        most = fmax(most, turning * turning + 0.05 / (double)config->tick_s * lasting);
        TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(100, 3000.0), force_n, (double)sample.force_n[leg]);
    }
    const double sigma = (double)config->sensors.force_sigma_n;
    TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(200, sqrt(sigma * sigma + most)), sqrt(sigma * sigma + most),
                              (double)sensors.force_sigma_n);
}

static void test_forces_are_those_on_a_level_platform_without_friction(void) {
    // GIVEN effects with any values and covariance, legs that creep or are fast, a base that is level or not
    uint64_t seed = 91;
    for (int trial = 0; trial < 60; trial++) {
        bench_t bench;
        begin(&bench, &seed, trial % 3 == 0 ? 0.003 : 0.2);
        const bool has_tilt = trial % 2 == 0;
        bench.scene.config.actuator_effects.prior_tilt_sigma_m_s2 = (hexload_real_t)(has_tilt ? 0.1 : 0.0);
        bench.scene.config.actuator_effects.friction_speed_m_s = HEXLOAD_REAL(0.004);
        bench.scene.config.actuator_effects.friction_shape = (hexload_real_t)(0.7 * (trial % 4));
        if (trial % 5 == 0) { // of which the least certain leg's turning counts most
            memset(bench.P, 0, sizeof bench.P);
            memset(bench.effects.covariance, 0, sizeof bench.effects.covariance);
        }
        // WHEN a sample is cleaned of them THEN forces are less bias, friction and tilt, and their sigma has
        // what is not known of the worst leg's: what lasts, as friction's shape does, counts as noise of 50
        // ms
        check_clean(&bench, has_tilt);
    }
}

static void test_effects_that_are_not_finite_are_known(void) {
    // GIVEN sound effects WHEN one of them is no number, or its variance is below zero THEN that is known
    uint64_t seed = 92;
    bench_t bench;
    begin(&bench, &seed, 0.1);
    TEST_ASSERT_TRUE(hexload_actuator_effects_is_finite(&bench.effects));
    for (int i = 0; i < DIM; i++) {
        hexload_actuator_effects_t broken = bench.effects;
        broken.effect[i] = (hexload_real_t)NAN;
        TEST_ASSERT_FALSE(hexload_actuator_effects_is_finite(&broken));
        broken = bench.effects;
        broken.covariance[EFFECT_ROW(i) + HEXLOAD_MOMENTUM_STATES + i] = HEXLOAD_REAL(-1.0);
        TEST_ASSERT_FALSE(hexload_actuator_effects_is_finite(&broken));
    }
}

static void test_sigmas_have_the_filters_variance_and_that_of_open_constants(void) {
    // GIVEN effects of which constants move each by another amount WHEN they are read THEN sigma is the root
    // of the sum of squares
    uint64_t seed = 93;
    bench_t bench;
    hexload_real_t value[DIM], sigma[DIM];
    begin(&bench, &seed, 0.1);
    for (int n = 0; n < HEXLOAD_RIG_DIRECTIONS_MAX; n++) {
        for (int i = 0; i < DIM; i++) {
            bench.effects.considered[n][i] = (hexload_real_t)(sqrt(bench.P[i][i]) * uniform(&seed));
        }
    }
    hexload_actuator_effects_read(&bench.effects, value, sigma);
    for (int i = 0; i < DIM; i++) {
        double square = bench.P[i][i];
        for (int n = 0; n < HEXLOAD_RIG_DIRECTIONS_MAX; n++) {
            square += pow((double)bench.effects.considered[n][i], 2.0);
        }
        TEST_ASSERT_EQUAL_DOUBLE((double)bench.effects.effect[i], (double)value[i]);
        TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(16, sqrt(square)), sqrt(square), (double)sigma[i]);
    }
}

static void test_friction_that_drives_its_leg_is_none(void) {
    // GIVEN legs that move either way, with friction from driving to braking
    uint64_t seed = 94;
    int driven = 0;
    for (int trial = 0; trial < 500; trial++) {
        bench_t bench;
        bool is_driven = false;
        begin(&bench, &seed, 0.1);
        for (int leg = 0; leg < LEGS; leg++) {
            const int c = LEGS + leg, d = 2 * LEGS + leg;
            const double s = uniform(&seed), v = 0.2 * uniform(&seed);
            bench.effects.last.sign[leg] = (hexload_real_t)(v > 0.0 ? fabs(s) : -fabs(s));
            bench.effects.last.speed_m_s[leg] = (hexload_real_t)v;
            bench.effects.effect[c] = HEXLOAD_REAL(8.0) * bench.effects.effect[c] + HEXLOAD_REAL(60.0);
            const double at[2] = {(double)bench.effects.last.sign[leg], v};
            const double force_n =
                at[0] * (double)bench.effects.effect[c] + v * (double)bench.effects.effect[d];
            const double variance_n2 = at[0] * at[0] * bench.P[c][c] + 2.0 * at[0] * v * bench.P[c][d] +
                                       v * v * bench.P[d][d];
            // WHEN they are asked for THEN one is known that drives by more than six of its sigmas
            is_driven = is_driven || (force_n * v < 0.0 && fabs(force_n) > 6.0 * sqrt(variance_n2));
        }
        hexload_config_t* config = &bench.scene.config;
        TEST_ASSERT_EQUAL_INT(is_driven, hexload_actuator_effects_drive(&bench.effects, config));
        driven += is_driven;
        // AND beside a rig file they are what has changed since
        config->rig.direction_count = 1;
        TEST_ASSERT_FALSE(hexload_actuator_effects_drive(&bench.effects, config));
    }
    TEST_ASSERT_TRUE(driven > 50 && driven < 450);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_forces_are_those_on_a_level_platform_without_friction);
    RUN_TEST(test_effects_that_are_not_finite_are_known);
    RUN_TEST(test_sigmas_have_the_filters_variance_and_that_of_open_constants);
    RUN_TEST(test_friction_that_drives_its_leg_is_none);
    return UNITY_END();
}
