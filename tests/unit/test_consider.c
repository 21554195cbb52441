#include "momentum/consider.h"
#include "algebra/linalg.h"
#include "textbook.h"

#include <math.h>
#include <string.h>

void setUp(void) {}
void tearDown(void) {}

enum { DIM = HEXLOAD_LOAD_DIM, LEGS = HEXLOAD_LEGS };

/// Angular velocities that have no noise.
static const hexload_smoother_constants_t without_noise = {.rate_gain = {1, 1, 1}};

/// The crooked machine in mid-motion, a filter with a load, three ways in which its constants may be off.
typedef struct bench {
    scene_t scene;
    hexload_momentum_filter_t filter;
    hexload_delayed_tick_t past;
    hexload_consider_t self;
    double speed_m_s[LEGS];
} bench_t;

/// Every constant of a direction; numbers in the order of its members.
static void fill_direction(hexload_rig_direction_t* direction, uint64_t* seed) {
    for (int leg = 0; leg < LEGS; leg++) {
        direction->force_offset_n[leg] = (hexload_real_t)(20.0 * uniform(seed));
        direction->force_gain[leg] = (hexload_real_t)(0.01 * uniform(seed));
        direction->coulomb_n[leg] = (hexload_real_t)(20.0 * uniform(seed));
        direction->stribeck_n[leg] = (hexload_real_t)(20.0 * uniform(seed));
        direction->growth_n_n[leg] = (hexload_real_t)(0.01 * uniform(seed));
        direction->viscous_n_s_m[leg] = (hexload_real_t)(100.0 * uniform(seed));
        for (int k = 0; k < 3; k++) {
            direction->base_hinge_m[leg][k] = (hexload_real_t)(1e-3 * uniform(seed));
            direction->platform_hinge_m[leg][k] = (hexload_real_t)(1e-3 * uniform(seed));
        }
    }
    direction->gravity_m_s2[0] = (hexload_real_t)(0.1 * uniform(seed));
    direction->gravity_m_s2[1] = (hexload_real_t)(0.1 * uniform(seed));
    for (int k = 0; k < DIM; k++) {
        direction->platform[k] = (hexload_real_t)uniform(seed);
    }
}

static void begin(bench_t* bench, uint64_t* seed, uint32_t directions) {
    memset(bench, 0, sizeof *bench);
    scene_at(&bench->scene, 210);
    hexload_config_t* config = &bench->scene.config;
    config->rig.direction_count = directions;
    config->rig.stribeck_speed_m_s = HEXLOAD_REAL(0.05);
    hexload_momentum_filter_init(&bench->filter, config);
    hexload_consider_init(&bench->self);
    bench->past.motion = bench->scene.motion;
    bench->past.sensors = &config->sensors;
    bench->past.smoother = &without_noise;
    bench->past.smooth.sample = bench->scene.sample;
    bench->past.smooth.gap_ticks = 2;
    for (int leg = 0; leg < LEGS; leg++) {
        bench->speed_m_s[leg] = leg == 5 ? 0.0 : 0.1 * uniform(seed);
        bench->past.smooth.smooth_velocity_m_s[leg] = (hexload_real_t)bench->speed_m_s[leg];
        bench->past.smooth.sample.force_n[leg] =
            (hexload_real_t)(600.0 + 1200.0 * uniform(seed)); // some pull
    }
    for (int k = 0; k < DIM; k++) {
        bench->filter.theta[k] = (hexload_real_t)(k == 0 ? 400.0 : 40.0 * uniform(seed));
    }
    for (int axis = 0; axis < 2; axis++) {
        bench->filter.last_input.arm[axis][0] = bench->scene.motion.p_m[axis] + HEXLOAD_REAL(0.01);
        for (int k = 0; k < 3; k++) {
            bench->filter.last_input.arm[axis][1 + k] =
                bench->scene.motion.R[axis][k] + (hexload_real_t)(0.01 * uniform(seed));
        }
    }
    for (uint32_t n = 0; n < directions; n++) {
        fill_direction(&config->rig.direction[n], seed);
        for (int k = 0; k < DIM; k++) {
            bench->self.load[n][k] = (hexload_real_t)uniform(seed);
        }
        for (int k = 0; k < 6; k++) {
            bench->self.momentum[n][k] = (hexload_real_t)uniform(seed);
            bench->self.drive[n][k] = (hexload_real_t)(10.0 * uniform(seed));
        }
    }
}

/// A pose near the motion's: p and a rotation that turns the motion's by a small vector.
typedef struct near_pose {
    double p_m[3], R[3][3];
} near_pose_t;

/// Upper hinge from O_A, leg's direction and length at a pose, by constants that are `step` of a direction
/// off.
static double leg_at(const bench_t* bench, const hexload_rig_direction_t* direction, double step,
                     const near_pose_t* pose, int leg, double arm_m[3], double e[3]) {
    const hexload_geometry_t* geometry = &bench->scene.config.geometry;
    double length = 0.0;
    for (int k = 0; k < 3; k++) {
        arm_m[k] = 0.0;
        for (int j = 0; j < 3; j++) {
            arm_m[k] += pose->R[k][j] * ((double)geometry->platform_hinge_m[leg][j] +
                                         step * (double)direction->platform_hinge_m[leg][j]);
        }
        e[k] = pose->p_m[k] + (k == 2 ? (double)bench->scene.kinematics.home_height_m : 0.0) + arm_m[k] -
               (double)geometry->base_hinge_m[leg][k] - step * (double)direction->base_hinge_m[leg][k];
        length += e[k] * e[k];
    }
    length = sqrt(length);
    for (int k = 0; k < 3; k++) {
        e[k] /= length;
    }
    return length;
}

/// R <- (E + [turn]x + ...) R by Rodrigues' formula.
static void turn(near_pose_t* pose, const double by[3]) {
    const double angle = sqrt(by[0] * by[0] + by[1] * by[1] + by[2] * by[2]) + 1e-30;
    double turned[3][3];
    for (int column = 0; column < 3; column++) {
        const double x[3] = {pose->R[0][column], pose->R[1][column], pose->R[2][column]};
        double once[3], twice[3];
        cross(by, x, once);
        cross(by, once, twice);
        for (int k = 0; k < 3; k++) {
            turned[k][column] = x[k] + sin(angle) / angle * once[k] +
                                0.5 * pow(sin(0.5 * angle) / (0.5 * angle), 2.0) * twice[k];
        }
    }
    memcpy(pose->R, turned, sizeof turned);
}

/// The pose at which legs of those lengths end, by Newton's method.
static void find_pose(const bench_t* bench, const hexload_rig_direction_t* direction, double step,
                      const double length_m[LEGS], near_pose_t* pose) {
    for (int round = 0; round < 6; round++) {
        double J[6][6], left[6], change[6];
        for (int leg = 0; leg < LEGS; leg++) {
            double arm[3], e[3], moment[3];
            left[leg] = length_m[leg] - leg_at(bench, direction, step, pose, leg, arm, e);
            cross(arm, e, moment);
            for (int k = 0; k < 3; k++) {
                J[leg][k] = e[k];
                J[leg][3 + k] = moment[k];
            }
        }
        solve6(J, left, change);
        for (int k = 0; k < 3; k++) {
            pose->p_m[k] += change[k];
        }
        turn(pose, &change[3]);
    }
}

/// Force on the platform when constants are `step` of a direction off: what is shown, less offset, gain and
/// friction. exp(-x^2) by the fraction that a sigma can bear.
static double force_of(const bench_t* bench, const hexload_rig_direction_t* direction, double step, int leg) {
    const double v = (double)bench->past.smooth.smooth_velocity_m_s[leg];
    const double shown = (double)bench->past.smooth.sample.force_n[leg];
    const double x2 = pow(v / 0.05, 2.0);
    const double rubs = (double)direction->coulomb_n[leg] +
                        (double)direction->stribeck_n[leg] / (1.0 + x2 + 0.5 * x2 * x2) +
                        (double)direction->growth_n_n[leg] * fabs(shown);
    return shown -
           step * ((double)direction->force_offset_n[leg] + (double)direction->force_gain[leg] * shown +
                   copysign(1.0, v) * rubs + (double)direction->viscous_n_s_m[leg] * v);
}

/// Rate of mu about the home point, of legs of those lengths and of gravity, by those constants.
static void rate_of_momentum(const bench_t* bench, const hexload_rig_direction_t* direction, double step,
                             const double length_m[LEGS], near_pose_t pose, double rate[6]) {
    const double gravity[3] = {step * (double)direction->gravity_m_s2[0],
                               step * (double)direction->gravity_m_s2[1],
                               -(double)bench->scene.config.gravity_m_s2};
    double body[DIM], lever[3], moment[3];
    memset(rate, 0, 6 * sizeof *rate);
    find_pose(bench, direction, step, length_m, &pose);
    for (int leg = 0; leg < LEGS; leg++) {
        const double force_n = force_of(bench, direction, step, leg);
        double arm[3], e[3];
        (void)leg_at(bench, direction, step, &pose, leg, arm, e);
        for (int k = 0; k < 3; k++) {
            arm[k] += pose.p_m[k];
        }
        cross(arm, e, moment);
        for (int k = 0; k < 3; k++) {
            rate[k] += force_n * e[k];
            rate[3 + k] += force_n * moment[k];
        }
    }
    for (int k = 0; k < DIM; k++) {
        body[k] = (double)bench->filter.platform[k] + (double)bench->filter.theta[k];
    }
    for (int k = 0; k < 3; k++) {
        lever[k] = body[0] * pose.p_m[k];
        for (int j = 0; j < 3; j++) {
            lever[k] += pose.R[k][j] * body[1 + j];
        }
        rate[k] += body[0] * gravity[k];
    }
    cross(lever, gravity, moment);
    for (int k = 0; k < 3; k++) {
        rate[3 + k] += moment[k];
    }
}

/// By central differences, with the same leg lengths.
static void expect_drive(const bench_t* bench, const hexload_rig_direction_t* direction, double drive[6]) {
    const double step = 1e-3;
    near_pose_t pose;
    double length_m[LEGS], arm[3], e[3], ahead[6], behind[6];
    for (int k = 0; k < 3; k++) {
        pose.p_m[k] = (double)bench->scene.motion.p_m[k];
        for (int j = 0; j < 3; j++) {
            pose.R[k][j] = (double)bench->scene.motion.R[k][j];
        }
    }
    for (int leg = 0; leg < LEGS; leg++) {
        length_m[leg] = leg_at(bench, direction, 0.0, &pose, leg, arm, e);
    }
    rate_of_momentum(bench, direction, step, length_m, pose, ahead);
    rate_of_momentum(bench, direction, -step, length_m, pose, behind);
    for (int k = 0; k < 6; k++) {
        drive[k] = (ahead[k] - behind[k]) / (2.0 * step);
    }
}

static void test_errors_of_mu_are_the_finite_differences_of_its_rate(void) {
    // GIVEN constants of all kinds that are off together in three ways, legs that push and pull, one at rest,
    // slow and fast ones WHEN the errors are moved on THEN those of the direction whose turn it is are the
    // differences of the rate of mu between constants that are off by a thousandth and the same the other way
    uint64_t seed = 71;
    for (uint32_t trial = 0; trial < 12; trial++) {
        bench_t bench;
        double drive[6], G[2][6][10];
        begin(&bench, &seed, 4);
        bench.scene.config.rig.direction_count = 3;
        const hexload_config_t* config = &bench.scene.config;
        bench.self.next = (uint8_t)(trial % 3);
        const hexload_rig_direction_t* direction = hexload_consider_turn(&bench.self, config);
        const uint32_t turn = (trial + 1) % 3;
        TEST_ASSERT_EQUAL_UINT32(turn, bench.self.next);
        TEST_ASSERT_EQUAL_PTR(&config->rig.direction[turn], direction);
        const hexload_consider_t before = bench.self;
        expect_drive(&bench, direction, drive);
        hexload_consider_move(&bench.self, &bench.filter, config, &bench.past, direction);
        for (int k = 0; k < 6; k++) { // terms of up to 4000 N and N m
            TEST_ASSERT_DOUBLE_WITHIN(1e-5 + ROUNDINGS(40, 4000.0) * 0.02, drive[k],
                                      (double)bench.self.drive[turn][k]);
        }
        // AND mu's rows of all directions grow by theirs, and by gravity on what load and platform are off
        weights_of(&bench.scene.motion, (double)config->gravity_m_s2, G[0]);
        memcpy(G[1], G[0], sizeof G[0]);
        for (int k = 0; k < 4; k++) {
            G[1][3][k] = -(double)config->gravity_m_s2 * (double)bench.filter.last_input.arm[1][k];
            G[1][4][k] = (double)config->gravity_m_s2 * (double)bench.filter.last_input.arm[0][k];
        }
        for (uint32_t n = 0; n < 3; n++) {
            for (int a = 0; a < 6; a++) {
                const double dt_s = 2.0 * (double)config->tick_s;
                double moved = (double)before.momentum[n][a] + dt_s * (double)bench.self.drive[n][a];
                for (int k = 0; k < 4; k++) {
                    const double error =
                        (double)before.load[n][k] + (double)config->rig.direction[n].platform[k];
                    moved += 0.5 * dt_s * (G[0][a][k] + G[1][a][k]) * error;
                }
                TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(16, 2.0), moved, (double)bench.self.momentum[n][a]);
                TEST_ASSERT_TRUE(n == turn || before.drive[n][a] == bench.self.drive[n][a]);
            }
            TEST_ASSERT_EQUAL_MEMORY(before.load[n], bench.self.load[n], sizeof before.load[n]);
        }
        // AND one that does not count stays
        TEST_ASSERT_EQUAL_MEMORY(before.momentum[3], bench.self.momentum[3], sizeof before.momentum[3]);
    }
}

static void test_as_momentum_begins_anew_errors_are_those_of_the_body(void) {
    // GIVEN three directions WHEN mu begins anew THEN its errors are Y of what load and platform are off;
    // those of a fourth, which does not count, stay
    uint64_t seed = 72;
    bench_t bench;
    begin(&bench, &seed, 4);
    bench.scene.config.rig.direction_count = 3;
    const hexload_consider_t before = bench.self;
    double twist[6];
    for (int k = 0; k < 6; k++) {
        bench.filter.smooth_twist[k] = (hexload_real_t)uniform(&seed);
        twist[k] = (double)bench.filter.smooth_twist[k];
    }
    hexload_consider_seed(&bench.self, &bench.scene.config, &bench.filter, &bench.scene.motion);
    for (uint32_t n = 0; n < 3; n++) {
        double error[DIM], momentum[6];
        for (int k = 0; k < DIM; k++) {
            error[k] =
                (double)bench.self.load[n][k] + (double)bench.scene.config.rig.direction[n].platform[k];
        }
        momentum_of(&bench.scene.motion, twist, error, momentum);
        for (int a = 0; a < 6; a++) {
            TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(40, 5.0), momentum[a], (double)bench.self.momentum[n][a]);
        }
    }
    TEST_ASSERT_EQUAL_MEMORY(before.momentum[3], bench.self.momentum[3], sizeof before.momentum[3]);
}

static void test_errors_follow_the_filters_correction(void) {
    // GIVEN an update with a regressor, a factor and whitened projections WHEN two directions follow it THEN
    // their innovations are L^-1 (Y error - T_mu), and T grows by U^T of them: U is -L^-1 H P
    uint64_t seed = 73;
    bench_t bench;
    hexload_momentum_update_t update;
    hexload_real_t e[2][6];
    begin(&bench, &seed, 4);
    memset(&update, 0, sizeof update);
    for (int a = 0; a < 6; a++) {
        for (int k = 0; k < DIM; k++) { // of the linear momentum only m and h count
            update.Y[a][k] = (hexload_real_t)(a < 3 && k > 3 ? 0.0 : uniform(&seed));
            update.U.load[a][k] = (hexload_real_t)uniform(&seed);
        }
        for (int b = 0; b < 6; b++) { // the diagonal is inverted
            update.L[a][b] = (hexload_real_t)(a == b ? 1.5 + uniform(&seed) : uniform(&seed));
            update.U.momentum[a][b] = (hexload_real_t)uniform(&seed);
        }
    }
    const hexload_consider_t before = bench.self;
    hexload_consider_follow(&bench.self, &bench.scene.config, 2, &update, e);
    for (uint32_t n = 0; n < 4; n++) {
        double white[6];
        for (int a = 0; a < 6 && n >= 2; a++) {
            white[a] = -(double)before.momentum[n][a];
            for (int k = 0; k < DIM; k++) {
                white[a] +=
                    (double)update.Y[a][k] *
                    ((double)before.load[n][k] + (double)bench.scene.config.rig.direction[n].platform[k]);
            }
            for (int b = 0; b < a; b++) {
                white[a] -= (double)update.L[a][b] * white[b];
            }
            white[a] *= (double)update.L[a][a];
            TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(200, 100.0), white[a], (double)e[n - 2][a]);
        }
        for (int a = 0; a < 6; a++) { // and they are summed, for who tests innovations, unless that pauses
            const double shown = (double)before.shown[n][a] + (n >= 2 ? (double)e[n - 2][a] : 0.0);
            TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(2, shown), shown, (double)bench.self.shown[n][a]);
        }
        for (int k = 0; k < DIM + 6; k++) {
            const bool is_load = k < DIM;
            double expected = (double)(is_load ? before.load[n][k] : before.momentum[n][k - DIM]);
            for (int a = 0; a < 6 && n >= 2; a++) {
                expected +=
                    white[a] * (double)(is_load ? update.U.load[a][k] : update.U.momentum[a][k - DIM]);
            }
            const hexload_real_t found = is_load ? bench.self.load[n][k] : bench.self.momentum[n][k - DIM];
            TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(400, 100.0), expected, (double)found);
        }
    }
    const hexload_consider_t followed = bench.self;
    bench.self.is_paused = true;
    hexload_consider_follow(&bench.self, &bench.scene.config, 2, &update, e);
    TEST_ASSERT_EQUAL_MEMORY(followed.shown, bench.self.shown, sizeof followed.shown);
}

static void test_a_step_does_all_of_it_for_all_directions(void) {
    // GIVEN three directions, or none, in a memory that has more WHEN a sample is filtered, or mu begins anew
    // THEN what is left is that of its parts in their order, and none that does not count has moved
    uint64_t seed = 74;
    for (uint32_t n = 0; n < 4; n++) {
        bench_t bench, parts;
        hexload_momentum_update_t update, of_parts;
        hexload_real_t e[2][6];
        begin(&bench, &seed, 4);
        bench.scene.config.rig.direction_count = n < 2 ? 3 : 0;
        bench.past.smooth.gap_ticks = n % 2;
        for (int a = 0; a < 6; a++) {
            bench.filter.momentum_cov[a][a] = HEXLOAD_REAL(4.0);
        }
        parts = bench;
        parts.past.sensors = bench.past.sensors;
        const hexload_config_t* config = &bench.scene.config;
        if (n < 2) {
            const hexload_rig_direction_t* direction = hexload_consider_turn(&parts.self, config);
            hexload_consider_move(&parts.self, &parts.filter, config, &bench.past, direction);
        }
        hexload_momentum_filter_step(&parts.filter, config, &bench.past, &of_parts);
        if (n == 1) {
            hexload_consider_follow(&parts.self, config, 0, &of_parts, e);
            hexload_consider_follow(&parts.self, config, 2, &of_parts, e);
        } else if (n == 0) {
            hexload_consider_seed(&parts.self, config, &parts.filter, &bench.past.motion);
        }
        hexload_consider_step(&bench.self, &bench.filter, config, &bench.past, &update);
        TEST_ASSERT_EQUAL_MEMORY(&parts.self, &bench.self, sizeof parts.self);
        TEST_ASSERT_EQUAL_MEMORY(&parts.filter, &bench.filter, sizeof parts.filter);
    }
}

static void test_sigmas_are_roots_of_sums_of_squares(void) {
    // GIVEN three directions, in a memory that has more, of a rig that is off by the root of 2.5 times what
    // they say, WHEN sigmas are widened THEN each is the root of its own square and 2.5 times the three's;
    // without directions they stay, to the bit, even where float has no square of them
    const double dispersion = 2.5;
    uint64_t seed = 75;
    bench_t bench;
    hexload_real_t sigma[DIM];
    begin(&bench, &seed, 4);
    bench.scene.config.rig.direction_count = 3;
    for (int k = 0; k < DIM; k++) {
        sigma[k] = HEXLOAD_REAL(0.7);
    }
    hexload_consider_widen(&bench.self, &bench.scene.config, (hexload_real_t)dispersion, sigma);
    for (int k = 0; k < DIM; k++) {
        double square = 0.49;
        for (int n = 0; n < 3; n++) {
            square += dispersion * (double)bench.self.load[n][k] * (double)bench.self.load[n][k];
        }
        TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(4, 2.0), sqrt(square), (double)sigma[k]);
        sigma[k] = HEXLOAD_REAL(0.7);
    }
    bench.scene.config.rig.direction_count = 0;
    sigma[0] = HEXLOAD_REAL(1e30);
    hexload_consider_widen(&bench.self, &bench.scene.config, (hexload_real_t)dispersion, sigma);
    for (int k = 0; k < DIM; k++) {
        TEST_ASSERT_EQUAL_DOUBLE((double)(k == 0 ? HEXLOAD_REAL(1e30) : HEXLOAD_REAL(0.7)), (double)sigma[k]);
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_errors_of_mu_are_the_finite_differences_of_its_rate);
    RUN_TEST(test_as_momentum_begins_anew_errors_are_those_of_the_body);
    RUN_TEST(test_errors_follow_the_filters_correction);
    RUN_TEST(test_a_step_does_all_of_it_for_all_directions);
    RUN_TEST(test_sigmas_are_roots_of_sums_of_squares);
    return UNITY_END();
}
