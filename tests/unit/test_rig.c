#include "hexload/momentum.h"
#include "motion.h"
#include "momentum/momentum_supervisor.h"
#include "rig/rig.h"

#include <math.h>
#include <stdio.h>
#include <string.h>

void setUp(void) {}
void tearDown(void) {}

static const body_t load = {312.0, {-0.09, 0.13, 0.27}, {17.0, 21.0, 12.0, 2.0, -1.0, 1.5}};
static const body_t heavier = {431.0, {0.02, 0.05, 0.33}, {24.0, 23.0, 18.0, -1.0, 0.5, -0.5}};

static hexload_leg_sample_t any_sample(uint32_t tick) {
    hexload_leg_sample_t sample = {.tick = tick};
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        const double t_s = 1e-3 * tick + 0.1 * leg;
        sample.displacement_m[leg] = (hexload_real_t)(0.05 * sin(9.0 * t_s));
        sample.velocity_m_s[leg] = (hexload_real_t)(0.45 * cos(9.0 * t_s));
        sample.force_n[leg] = (hexload_real_t)(900.0 + 300.0 * sin(11.0 * t_s));
    }
    return sample;
}

static void test_a_machine_that_is_its_model_is_left_as_it_is(void) {
    // GIVEN the default configuration
    const hexload_config_t config = paper_machine();
    const hexload_leg_sample_t sample = any_sample(7);
    const hexload_real_t twist[6] = {1, 2, 3, 4, 5, 6};
    const hexload_motion_t motion = {.R = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
    hexload_rig_history_t history;
    hexload_rig_slide_t slide;
    hexload_leg_sample_t aligned;
    hexload_real_t force_n[HEXLOAD_LEGS], variance_n2[HEXLOAD_LEGS], wrench[6];
    uint32_t gap_ticks = 9;
    hexload_rig_history_init(&history);
    hexload_rig_slide_init(&slide);
    // WHEN a sample passes the stage
    TEST_ASSERT_TRUE(hexload_rig_align(&history, &config, &sample, 0, &aligned, &gap_ticks));
    memcpy(force_n, aligned.force_n, sizeof force_n);
    hexload_rig_compensate(&slide, &config, aligned.velocity_m_s, 1, force_n, variance_n2);
    hexload_rig_leg_wrench(&config, &aligned, &motion, twist, twist, wrench);
    // THEN nothing of it changes, to the bit
    TEST_ASSERT_EQUAL_UINT32(0, gap_ticks);
    TEST_ASSERT_EQUAL_MEMORY(&sample, &aligned, sizeof sample);
    TEST_ASSERT_EQUAL_MEMORY(sample.force_n, force_n, sizeof force_n);
    for (int k = 0; k < HEXLOAD_LEGS; k++) {
        TEST_ASSERT_TRUE(variance_n2[k] == HEXLOAD_REAL(0.0) && wrench[k] == HEXLOAD_REAL(0.0));
        TEST_ASSERT_TRUE(slide.share[k] == HEXLOAD_REAL(0.0)); // no leg has slid
    }
}

/// GIVEN forces and velocities that are late, an offset and a gain, and tick 20 missing WHEN they are aligned
/// THEN they are those of one instant, so many ticks ago.
static void assert_aligns(double force_delay_s, double velocity_delay_s, uint32_t delay) {
    hexload_config_t config = paper_machine();
    config.rig.force_delay_s = (hexload_real_t)force_delay_s;
    config.rig.velocity_delay_s = (hexload_real_t)velocity_delay_s;
    config.rig.force_offset_n[2] = HEXLOAD_REAL(20.0);
    config.rig.force_gain[2] = HEXLOAD_REAL(0.01);
    hexload_rig_history_t history;
    hexload_rig_history_init(&history);
    uint32_t came = 0;
    for (uint32_t tick = 0; tick < 40; tick++) {
        hexload_leg_sample_t sample = any_sample(tick);
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            const double t_s = 1e-3 * tick + 0.1 * leg;
            const double true_n = 900.0 + 300.0 * sin(11.0 * (t_s - force_delay_s));
            sample.force_n[leg] = (hexload_real_t)(leg == 2 ? 1.01 * true_n + 20.0 : true_n);
            sample.velocity_m_s[leg] = (hexload_real_t)(0.45 * cos(9.0 * (t_s - velocity_delay_s)));
        }
        const uint32_t gap_ticks = tick == 0 ? 0 : tick == 21 ? 2 : 1;
        if (tick == 20) { // missing
            continue;
        }
        hexload_leg_sample_t aligned;
        uint32_t aligned_gap_ticks = 0;
        const bool has =
            hexload_rig_align(&history, &config, &sample, gap_ticks, &aligned, &aligned_gap_ticks);
        hexload_rig_history_store(&history, &sample, gap_ticks, has);
        // A sample comes out when all ticks since are there
        TEST_ASSERT_EQUAL_INT(tick >= delay && (tick < 20 || tick > 20 + delay), has);
        if (!has) {
            continue;
        }
        TEST_ASSERT_EQUAL_UINT32(tick - delay, aligned.tick);
        TEST_ASSERT_EQUAL_UINT32(came == 0 ? 0 : tick == 21 + delay ? 2 + delay : 1, aligned_gap_ticks);
        came++;
        // Its channels are those of that instant: a line errs by an eighth of the second derivative times
        // dt^2
        const hexload_leg_sample_t exact = any_sample(tick - delay);
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            TEST_ASSERT_DOUBLE_WITHIN(300.0 * 121e-6 / 8 + ROUNDINGS(8, 1300.0), (double)exact.force_n[leg],
                                      (double)aligned.force_n[leg]);
            TEST_ASSERT_DOUBLE_WITHIN(0.45 * 81e-6 / 8 + ROUNDINGS(4, 0.5), (double)exact.velocity_m_s[leg],
                                      (double)aligned.velocity_m_s[leg]);
        }
    }
    TEST_ASSERT_EQUAL_UINT32(HEXLOAD_RIG_HISTORY, history.stored); // and no more than there are places
}

static void test_late_channels_are_brought_to_one_instant(void) {
    assert_aligns(0.0024, 0.0007, 3);
    assert_aligns(0.0016, 0.0027, 3);
    assert_aligns(0.0006, 0.0, 1);
    assert_aligns(0.0, 0.0076, 8);
}

static hexload_config_t rubbing_machine(void) {
    hexload_config_t config = paper_machine();
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        config.rig.coulomb_n[leg] = (hexload_real_t)(40.0 + 5.0 * leg);
        config.rig.stribeck_n[leg] = HEXLOAD_REAL(25.0);
        config.rig.viscous_n_s_m[leg] = (hexload_real_t)(200.0 + 10.0 * leg);
    }
    config.rig.stribeck_speed_m_s = HEXLOAD_REAL(0.012);
    config.rig.reversal_speed_m_s = HEXLOAD_REAL(0.002);
    return config;
}

static double friction_of(const hexload_rig_config_t* rig, int leg, double v) {
    const double in_stribeck = v / (double)rig->stribeck_speed_m_s;
    return ((double)rig->coulomb_n[leg] + (double)rig->stribeck_n[leg] * exp(-in_stribeck * in_stribeck)) *
               tanh(v / (double)rig->reversal_speed_m_s) +
           (double)rig->viscous_n_s_m[leg] * v;
}

static void test_friction_is_taken_off(void) {
    // GIVEN legs that rub
    const hexload_config_t config = rubbing_machine();
    hexload_rig_slide_t slide;
    hexload_rig_slide_init(&slide);
    for (int n = -200; n <= 200; n++) {
        const double v = 1e-6 * n * n * n / 40.0;
        hexload_real_t speed_m_s[HEXLOAD_LEGS], force_n[HEXLOAD_LEGS], variance_n2[HEXLOAD_LEGS];
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            speed_m_s[leg] = (hexload_real_t)v;
            force_n[leg] = (hexload_real_t)(500.0 + friction_of(&config.rig, leg, v));
        }
        // WHEN they are compensated THEN the forces on the platform are left, to 2e-5 of dry friction
        hexload_rig_compensate(&slide, &config, speed_m_s, 1, force_n, variance_n2);
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            TEST_ASSERT_DOUBLE_WITHIN(2e-5 * 90.0 + ROUNDINGS(20, 600.0), 500.0, (double)force_n[leg]);
            // AND they count less where the legs are slow: 50 (0.3 (Fc + Fd))^2 at rest
            const double at_rest = 50.0 * pow(0.3 * ((double)config.rig.coulomb_n[leg] + 25.0), 2.0);
            TEST_ASSERT_TRUE(fabs(v) > 1e-4 || (double)variance_n2[leg] > 0.99 * at_rest);
            TEST_ASSERT_TRUE(fabs(v) < 0.02 || (double)variance_n2[leg] < 1e-3 * at_rest);
        }
    }
}

static void test_friction_that_grows_with_the_force_is_taken_off(void) {
    // GIVEN legs whose dry friction grows by 2 % of the force on the platform, at 20 times the reversal speed
    hexload_config_t config = rubbing_machine();
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        config.rig.growth_n_n[leg] = HEXLOAD_REAL(0.02);
    }
    const double pushes_n[] = {1500.0, -1500.0, 0.5};
    for (int n = 0; n < 6; n++) {
        const double v = n % 2 == 0 ? 0.04 : -0.04, pushed_n = pushes_n[n / 2];
        hexload_rig_slide_t slide;
        hexload_rig_slide_init(&slide);
        hexload_real_t speed_m_s[HEXLOAD_LEGS], force_n[HEXLOAD_LEGS], variance_n2[HEXLOAD_LEGS];
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            const double grown_n = 0.02 * fabs(pushed_n) * tanh(v / (double)config.rig.reversal_speed_m_s);
            speed_m_s[leg] = (hexload_real_t)v;
            force_n[leg] = (hexload_real_t)(pushed_n + friction_of(&config.rig, leg, v) + grown_n);
        }
        // WHEN they are compensated, up and down, pushed, pulled and nearly free THEN the forces on the
        // platform are left
        hexload_rig_compensate(&slide, &config, speed_m_s, 1, force_n, variance_n2);
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            TEST_ASSERT_DOUBLE_WITHIN(2e-5 * 120.0 + ROUNDINGS(20, 1600.0), pushed_n, (double)force_n[leg]);
        }
    }
}

static void test_a_gap_slides_as_far_as_its_ticks_do(void) {
    // GIVEN legs that have just turned round, whose friction follows the way WHEN four ticks come one by one,
    // or as a gap THEN it is as far, to 2e-5 of dry friction a tick
    hexload_config_t config = rubbing_machine();
    config.rig.presliding_m = HEXLOAD_REAL(5e-5);
    const hexload_real_t speed_m_s[HEXLOAD_LEGS] = {HEXLOAD_REAL(0.004), HEXLOAD_REAL(-0.004),
                                                    HEXLOAD_REAL(0.008), HEXLOAD_REAL(-0.008),
                                                    HEXLOAD_REAL(0.012), HEXLOAD_REAL(-0.012)};
    hexload_real_t by_ticks_n[HEXLOAD_LEGS], by_gap_n[HEXLOAD_LEGS], variance_n2[HEXLOAD_LEGS];
    hexload_rig_slide_t ticks, gap;
    hexload_rig_slide_init(&ticks);
    hexload_rig_slide_init(&gap);
    for (int tick = 0; tick < 4; tick++) {
        memset(by_ticks_n, 0, sizeof by_ticks_n);
        hexload_rig_compensate(&ticks, &config, speed_m_s, 1, by_ticks_n, variance_n2);
    }
    memset(by_gap_n, 0, sizeof by_gap_n);
    hexload_rig_compensate(&gap, &config, speed_m_s, 4, by_gap_n, variance_n2);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        TEST_ASSERT_DOUBLE_WITHIN(4.0 * 2e-5 * 120.0, (double)by_ticks_n[leg], (double)by_gap_n[leg]);
    }
}

static void test_legs_that_rub_only_when_they_move_are_compensated(void) {
    // GIVEN a law whose dry friction vanishes at rest: what is less there is all of Coulomb's
    hexload_config_t config = rubbing_machine();
    hexload_real_t speed_m_s[HEXLOAD_LEGS], force_n[HEXLOAD_LEGS], variance_n2[HEXLOAD_LEGS];
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        config.rig.stribeck_n[leg] = -config.rig.coulomb_n[leg];
        speed_m_s[leg] = HEXLOAD_REAL(0.05);
        force_n[leg] = (hexload_real_t)(500.0 + friction_of(&config.rig, leg, (double)speed_m_s[leg]));
    }
    hexload_rig_slide_t slide;
    hexload_rig_slide_init(&slide);
    // WHEN the legs move THEN it is taken off
    hexload_rig_compensate(&slide, &config, speed_m_s, 1, force_n, variance_n2);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        TEST_ASSERT_DOUBLE_WITHIN(2e-5 * 90.0 + ROUNDINGS(20, 600.0), 500.0, (double)force_n[leg]);
    }
    // AND at rest it is not known
    memset(speed_m_s, 0, sizeof speed_m_s);
    hexload_rig_compensate(&slide, &config, speed_m_s, 1, force_n, variance_n2);
    const double unknown_n = 0.3 * (double)config.rig.coulomb_n[2];
    TEST_ASSERT_DOUBLE_WITHIN(0.5 * unknown_n * unknown_n, 50.0 * unknown_n * unknown_n,
                              (double)variance_n2[2]);
}

static void test_friction_turns_over_the_presliding_length(void) {
    // GIVEN friction that turns over 50 um, and legs that have gone up for long
    hexload_config_t config = rubbing_machine();
    config.rig.presliding_m = HEXLOAD_REAL(50e-6);
    hexload_rig_slide_t slide = {.share = {1, 1, 1, 1, 1, 1}};
    hexload_real_t speed_m_s[HEXLOAD_LEGS], force_n[HEXLOAD_LEGS], variance_n2[HEXLOAD_LEGS];
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        speed_m_s[leg] = HEXLOAD_REAL(-0.02); // 20 um a tick
    }
    for (int n = 1; n <= 20; n++) {
        memset(force_n, 0, sizeof force_n);
        // WHEN they go down THEN s falls from 1 to -1 as exp(-way / 50 um)
        hexload_rig_compensate(&slide, &config, speed_m_s, 1, force_n, variance_n2);
        const double expected = -1.0 + 2.0 * exp(-20.0 * n / 50.0);
        TEST_ASSERT_DOUBLE_WITHIN(1e-5, expected, (double)slide.share[3]);
        // AND so much of friction is not known as has not turned
        const double unknown_n = 0.3 * ((double)config.rig.coulomb_n[3] + 25.0);
        TEST_ASSERT_DOUBLE_WITHIN(1e-3 * 50.0 * unknown_n * unknown_n,
                                  50.0 * unknown_n * unknown_n * (1.0 - expected * expected),
                                  (double)variance_n2[3]);
    }
}

/// Energy of the legs' mass: T = nu |u_a|^2 / 2 and V = g D e_z, by differences of the leg vectors.
static double leg_energy(const hexload_config_t* config, const motion_t* motion, double height_m,
                         double t_s) {
    const double h = 1e-6, B = (double)config->rig.leg_inertia_kg_m2, C = (double)config->rig.leg_slide_kg_m;
    const pose_t pose[3] = {pose_at(motion, t_s - h), pose_at(motion, t_s), pose_at(motion, t_s + h)};
    double energy = 0.0;
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        double L[3][3], length = 0.0, along = 0.0, square = 0.0;
        for (int n = 0; n < 3; n++) {
            double R[3][3];
            rotation_of(&pose[n], R);
            for (int k = 0; k < 3; k++) {
                const hexload_real_t* a = config->geometry.platform_hinge_m[leg];
                L[n][k] = pose[n].p_m[k] + (k == 2 ? height_m : 0.0) + R[k][0] * (double)a[0] +
                          R[k][1] * (double)a[1] + R[k][2] * (double)a[2] -
                          (double)config->geometry.base_hinge_m[leg][k];
            }
        }
        for (int k = 0; k < 3; k++) {
            const double u = (L[2][k] - L[0][k]) / (2.0 * h);
            length += L[1][k] * L[1][k];
            along += L[1][k] * u;
            square += u * u;
        }
        length = sqrt(length);
        const double across = square - along * along / (length * length);
        energy += 0.5 * (B / (length * length) - C / length) * across +
                  (double)config->gravity_m_s2 * (double)config->rig.leg_tilt_kg_m * L[1][2] / length;
    }
    return energy;
}

static void test_leg_wrench_does_the_work_that_the_legs_take_up(void) {
    // GIVEN legs with mass on a platform in motion
    hexload_config_t config = crooked_machine();
    config.rig.leg_inertia_kg_m2 = HEXLOAD_REAL(1.9);
    config.rig.leg_slide_kg_m = HEXLOAD_REAL(2.6);
    config.rig.leg_tilt_kg_m = HEXLOAD_REAL(1.7);
    const motion_t motion = random_motion(31, 0.06, 0.1);
    hexload_kinematics_t kinematics;
    hexload_motion_t past[5];
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_kinematics_init(&kinematics, &config));
    const double height_m = (double)kinematics.home_height_m;
    for (uint32_t tick = 0; tick < 400; tick++) {
        const hexload_leg_sample_t sample = perfect_sample(&config, &load, &motion, height_m, tick);
        hexload_real_t acceleration[6], wrench[6];
        TEST_ASSERT_EQUAL_INT(HEXLOAD_OK,
                              hexload_kinematics_solve(&kinematics, &config, &sample, &past[tick % 5]));
        if (tick < 4) {
            continue;
        }
        const hexload_motion_t* now = &past[(tick - 2) % 5];
        const hexload_leg_sample_t then = perfect_sample(&config, &load, &motion, height_m, tick - 2);
        for (int k = 0; k < 6; k++) {
            acceleration[k] = (past[tick % 5].twist[k] - past[(tick - 4) % 5].twist[k]) / HEXLOAD_REAL(0.004);
        }
        hexload_rig_leg_wrench(&config, &then, now, now->twist, acceleration, wrench);
        // WHEN the wrench moves with the platform THEN its power is the rate of the legs' energy, some 20 W.
        // A difference over 4 ms errs by (2 pi 3 Hz 2 ms)^2 / 6 of it
        double power = 0.0;
        for (int k = 0; k < 6; k++) {
            power += (double)wrench[k] * (double)now->twist[k];
        }
        const double t_s = 1e-3 * (tick - 2), step = 1e-4;
        const double rate = (leg_energy(&config, &motion, height_m, t_s + step) -
                             leg_energy(&config, &motion, height_m, t_s - step)) /
                            (2.0 * step);
        TEST_ASSERT_DOUBLE_WITHIN(0.01, rate, power);
    }
}

static void test_a_base_that_is_not_level_is_turned(void) {
    // GIVEN a machine, and gravity straight down or off it by up to 30 degrees
    const hexload_config_t before = crooked_machine();
    hexload_config_t config = before;
    const hexload_real_t down[3] = {0, 0, -config.gravity_m_s2};
    // WHEN gravity is set THEN straight down changes nothing
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_config_set_gravity(&config, down));
    TEST_ASSERT_EQUAL_MEMORY(&before, &config, sizeof config);
    // AND up is refused
    const hexload_real_t up[3] = {0, 0, 9};
    TEST_ASSERT_EQUAL_INT(HEXLOAD_ERR_CONFIG, hexload_config_set_gravity(&config, up));
    TEST_ASSERT_EQUAL_MEMORY(&before, &config, sizeof config);
    // AND otherwise the heights over the new base are those along the vector, and distances stay
    const hexload_real_t aside[3] = {HEXLOAD_REAL(3.0), HEXLOAD_REAL(-4.0), HEXLOAD_REAL(-8.6)};
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_config_set_gravity(&config, aside));
    const double size = sqrt(9.0 + 16.0 + 8.6 * 8.6);
    TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(4, size), size, (double)config.gravity_m_s2);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        const hexload_real_t* b = before.geometry.base_hinge_m[leg];
        const hexload_real_t* turned = config.geometry.base_hinge_m[leg];
        const double height_m = (-3.0 * (double)b[0] + 4.0 * (double)b[1] + 8.6 * (double)b[2]) / size;
        TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(8, 1.0), height_m, (double)turned[2]);
        for (int other = 0; other < leg; other++) {
            double distance[2] = {0};
            for (int k = 0; k < 3; k++) {
                distance[0] += pow((double)(b[k] - before.geometry.base_hinge_m[other][k]), 2.0);
                distance[1] += pow((double)(turned[k] - config.geometry.base_hinge_m[other][k]), 2.0);
            }
            TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(16, 1.0), sqrt(distance[0]), sqrt(distance[1]));
        }
    }
}

/// Constants of a machine moved along a direction.
static hexload_config_t moved_along(hexload_config_t config, const hexload_rig_direction_t* direction) {
    const hexload_real_t m = config.platform.mass_kg;
    config.platform.mass_kg += direction->platform[0];
    for (int k = 0; k < 3; k++) {
        config.platform.com_m[k] =
            (m * config.platform.com_m[k] + direction->platform[1 + k]) / config.platform.mass_kg;
    }
    for (int k = 0; k < HEXLOAD_I_DIM; k++) {
        config.platform.inertia_kg_m2[k] += direction->platform[4 + k];
    }
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        config.rig.force_offset_n[leg] += direction->force_offset_n[leg];
        config.rig.force_gain[leg] += direction->force_gain[leg];
        config.rig.growth_n_n[leg] += direction->growth_n_n[leg];
        for (int k = 0; k < 3; k++) {
            config.geometry.base_hinge_m[leg][k] += direction->base_hinge_m[leg][k];
            config.geometry.platform_hinge_m[leg][k] += direction->platform_hinge_m[leg][k];
        }
    }
    const hexload_real_t gravity_m_s2[3] = {direction->gravity_m_s2[0], direction->gravity_m_s2[1],
                                            -config.gravity_m_s2};
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_config_set_gravity(&config, gravity_m_s2));
    return config;
}

static void test_considered_errors_are_those_of_wrong_constants(void) {
    // GIVEN six ways in which the constants of a machine are off, too little for an alarm: offsets, gains,
    // platform, tilt, growth of friction with the force, hinges
    enum { WAYS = 6, OF_GROWTH = 4, OF_HINGES = 5 };
    hexload_config_t config = crooked_machine();
    hexload_rig_direction_t* way = config.rig.direction;
    config.rig.direction_count = WAYS;
    uint64_t seed = 41;
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        way[0].force_offset_n[leg] = (hexload_real_t)uniform(&seed);
        way[1].force_gain[leg] = (hexload_real_t)(0.005 * uniform(&seed));
        way[OF_GROWTH].growth_n_n[leg] = (hexload_real_t)(5e-4 * (1 + leg));
        for (int k = 0; k < 3; k++) {
            way[OF_HINGES].base_hinge_m[leg][k] = (hexload_real_t)(1e-4 * uniform(&seed));
            way[OF_HINGES].platform_hinge_m[leg][k] = (hexload_real_t)(1e-4 * uniform(&seed));
        }
    }
    way[2].platform[0] = HEXLOAD_REAL(1.0);
    way[2].platform[3] = HEXLOAD_REAL(0.3);
    way[2].platform[5] = HEXLOAD_REAL(0.5);
    way[3].gravity_m_s2[0] = HEXLOAD_REAL(0.003);
    way[3].gravity_m_s2[1] = HEXLOAD_REAL(-0.002);
    const motion_t motion = random_motion(32, 0.05, 0.12);
    static hexload_momentum_t estimator[WAYS + 1];
    hexload_config_t configs[WAYS + 1];
    hexload_estimate_t estimate[WAYS + 1];
    for (int n = 0; n <= WAYS; n++) {
        configs[n] = n == 0 ? config : moved_along(config, &way[n - 1]);
        configs[n].rig.direction_count = n == 0 ? WAYS : 0;
        TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_momentum_init(&estimator[n], &configs[n]));
    }
    const double height_m = (double)estimator[0].kinematics.home_height_m;
    // WHEN estimators with right and with wrong constants see the same two seconds
    for (uint32_t tick = 0; tick < 2000; tick++) {
        hexload_leg_sample_t sample = perfect_sample(&config, &load, &motion, height_m, tick);
        add_noise(&config, &seed, &sample);
        for (int n = 0; n <= WAYS; n++) {
            TEST_ASSERT_EQUAL_INT(HEXLOAD_OK,
                                  hexload_momentum_tick(&estimator[n], &configs[n], &sample, &estimate[n]));
        }
    }
    // THEN their estimates differ by what the first one considers, to a tenth of the way's largest effect in
    // kg, kg m or kg m^2, as the gains of the others are not quite the same; to a third for friction, as
    // those who know of it trust slow legs less; of wrong hinges what weight shows, mass, hx and hy, as they
    // leave out what a wrong pose does to momentum
    for (int n = 0; n < WAYS; n++) {
        double largest = 0.0;
        for (int k = 0; k < HEXLOAD_LOAD_DIM; k++) {
            largest = fmax(largest, fabs((double)estimator[0].consider.load[n][k]));
        }
        for (int k = 0; k < (n == OF_HINGES ? HEXLOAD_LOAD_HZ : HEXLOAD_LOAD_DIM); k++) {
            char where[48];
            (void)snprintf(where, sizeof where, "way %d, parameter %d", n, k);
            const double difference = (double)estimate[n + 1].value[k] - (double)estimate[0].value[k];
            const double slack = (n == OF_GROWTH ? 1.0 / 3.0 : 0.1) * largest;
            TEST_ASSERT_DOUBLE_WITHIN_MESSAGE(slack, (double)estimator[0].consider.load[n][k], difference,
                                              where);
        }
    }
    // AND the variance is the filter's, widened by the blocks, with their squares, and what misfits may have
    // left
    for (int k = 0; k < HEXLOAD_LOAD_DIM; k++) {
        const double factor = (double)estimator[0].jackknife.factor[k];
        double variance = pow(factor * (double)estimate[0].own_sigma[k], 2.0);
        for (int n = 0; n < WAYS; n++) {
            variance += pow((double)estimator[0].consider.load[n][k], 2.0);
        }
        const double sigma = (double)estimator[0].supervisor.kept[k] * sqrt(variance);
        TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(16, sigma), sigma, (double)estimate[0].sigma[k]);
    }
}

static void test_a_machine_known_to_a_tolerance_is_not_judged_by_noise_alone(void) {
    // GIVEN machines whose innovations fit, one that is its model, one without friction that is commissioned
    hexload_config_t config = paper_machine();
    hexload_momentum_supervisor_t supervisor;
    hexload_momentum_supervisor_init(&supervisor);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_FIT_NONE, hexload_momentum_supervisor_fit(&supervisor, &config, true));
    supervisor.moved_s = HEXLOAD_REAL(2.5); // of motion, in which they have shown it
    TEST_ASSERT_EQUAL_INT(HEXLOAD_FIT_NOISE, hexload_momentum_supervisor_fit(&supervisor, &config, true));
    // WHEN constants of it are still open THEN a change of its load must stand out of its own past
    config.rig.direction_count = 1;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_FIT_FRICTION, hexload_momentum_supervisor_fit(&supervisor, &config, true));
}

/// A machine at work whose sensors show friction.
typedef struct bench {
    hexload_momentum_t estimator;
    hexload_estimate_t estimate;
    uint32_t late_alarms; ///< after the first 4 s
    uint32_t last_alarm;
    uint32_t converged;
    uint32_t misfits;
} bench_t;

static void work(bench_t* bench, const hexload_config_t* known, const body_t* body, const motion_t* motion,
                 uint32_t from, uint32_t to, uint64_t* seed) {
    const hexload_config_t rubbing = rubbing_machine();
    for (uint32_t tick = from; tick < to; tick++) {
        hexload_leg_sample_t sample =
            perfect_sample(known, body, motion, (double)bench->estimator.kinematics.home_height_m, tick);
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            sample.force_n[leg] +=
                (hexload_real_t)friction_of(&rubbing.rig, leg, (double)sample.velocity_m_s[leg]);
        }
        add_noise(known, seed, &sample);
        TEST_ASSERT_EQUAL_INT(HEXLOAD_OK,
                              hexload_momentum_tick(&bench->estimator, known, &sample, &bench->estimate));
        const uint32_t bits = bench->estimator.health.bits;
        if ((bits >> HEXLOAD_HEALTH_LOAD_CHANGED & 1u) != 0 && tick > 4000) {
            bench->late_alarms++;
            bench->last_alarm = tick;
        }
        bench->converged += bench->estimate.verdict == HEXLOAD_VERDICT_CONVERGED ? 1 : 0;
        bench->misfits += bits >> HEXLOAD_HEALTH_MODEL_MISFIT & 1u;
    }
}

static void test_a_machine_that_rubs_raises_no_storm_and_is_not_believed(void) {
    // GIVEN legs that rub, which the configuration does not know
    const hexload_config_t config = paper_machine();
    const motion_t motion = random_motion(33, 0.05, 0.1);
    static bench_t bench;
    uint64_t seed = 42;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_momentum_init(&bench.estimator, &config));
    // WHEN it moves for 10 s THEN no change of the load is reported after the first 4 s, none of the
    // estimates counts as converged, and most of the time it is said why
    work(&bench, &config, &load, &motion, 0, 10000, &seed);
    TEST_ASSERT_EQUAL_UINT32(0, bench.late_alarms);
    TEST_ASSERT_EQUAL_UINT32(0, bench.converged);
    TEST_ASSERT_GREATER_THAN_UINT32(9000, bench.misfits);
    // AND when a load of 119 kg more is picked up, that is reported once, within 30 ms
    work(&bench, &config, &heavier, &motion, 10000, 14000, &seed);
    TEST_ASSERT_EQUAL_UINT32(1, bench.late_alarms);
    TEST_ASSERT_LESS_OR_EQUAL_UINT32(10030, bench.last_alarm);
}

static void test_a_machine_whose_friction_is_known_is_believed(void) {
    // GIVEN legs that rub, which the configuration knows
    const hexload_config_t config = rubbing_machine();
    const motion_t motion = random_motion(33, 0.05, 0.1);
    static bench_t bench;
    double theta[HEXLOAD_LOAD_DIM];
    uint64_t seed = 43;
    TEST_ASSERT_EQUAL_INT(HEXLOAD_OK, hexload_momentum_init(&bench.estimator, &config));
    theta_of(&load, theta);
    // WHEN it moves for 6 s THEN the estimates converge and are within four sigma of the truth
    work(&bench, &config, &load, &motion, 0, 6000, &seed);
    TEST_ASSERT_EQUAL_INT(HEXLOAD_VERDICT_CONVERGED, bench.estimate.verdict);
    TEST_ASSERT_EQUAL_UINT32(0, bench.misfits);
    for (int k = 0; k < HEXLOAD_LOAD_DIM; k++) {
        TEST_ASSERT_DOUBLE_WITHIN(4.0 * (double)bench.estimate.sigma[k], theta[k],
                                  (double)bench.estimate.value[k]);
    }
    // AND when a load of 119 kg more is picked up, that is reported once, within 30 ms
    work(&bench, &config, &heavier, &motion, 6000, 9000, &seed);
    TEST_ASSERT_EQUAL_UINT32(1, bench.late_alarms);
    TEST_ASSERT_LESS_OR_EQUAL_UINT32(6030, bench.last_alarm);
}

static void test_acceleration_is_the_twists_change_over_five_ticks(void) {
    // GIVEN a twist of 3 t^2 / 2 in its first component, at ticks of 1 ms
    const hexload_config_t config = paper_machine();
    hexload_rig_twists_t twists;
    hexload_real_t acceleration[7]; // one more than it has
    acceleration[6] = HEXLOAD_REAL(7.0);
    memset(&twists, 0xff, sizeof twists); // of an instance that was in use
    hexload_rig_twists_init(&twists);
    for (int tick = 0; tick < 23; tick++) {
        const double t_s = 1e-3 * tick;
        const hexload_real_t twist[6] = {(hexload_real_t)(1.5 * t_s * t_s)};
        const int stored = tick < 12 ? tick : tick - 12; // a gap before tick 12
        // WHEN it is given THEN the acceleration is the mean over the last five ticks, or over the fewer
        // since the first or a gap: 3 times the middle of the time
        hexload_rig_accelerate(&twists, &config, twist, tick == 0 ? 0 : tick == 12 ? 2 : 1, acceleration);
        const double since = stored < 5 ? stored : 5;
        const double expected = since > 0.0 ? 3.0 * (t_s - 0.5e-3 * since) : 0.0;
        TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(4, 1e-3 / 1e-3), expected, (double)acceleration[0]);
        TEST_ASSERT_TRUE(acceleration[5] == HEXLOAD_REAL(0.0) && acceleration[6] == HEXLOAD_REAL(7.0));
    }
}

static void test_any_of_the_legs_three_numbers_gives_them_a_mass(void) {
    hexload_config_t config = paper_machine();
    TEST_ASSERT_FALSE(hexload_rig_has_leg_mass(&config));
    config.rig.leg_inertia_kg_m2 = HEXLOAD_REAL(1.0);
    TEST_ASSERT_TRUE(hexload_rig_has_leg_mass(&config));
    config = paper_machine();
    config.rig.leg_slide_kg_m = HEXLOAD_REAL(-1.0);
    TEST_ASSERT_TRUE(hexload_rig_has_leg_mass(&config));
    config = paper_machine();
    config.rig.leg_tilt_kg_m = HEXLOAD_REAL(1.0);
    TEST_ASSERT_TRUE(hexload_rig_has_leg_mass(&config));
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_a_machine_that_is_its_model_is_left_as_it_is);
    RUN_TEST(test_late_channels_are_brought_to_one_instant);
    RUN_TEST(test_friction_is_taken_off);
    RUN_TEST(test_friction_that_grows_with_the_force_is_taken_off);
    RUN_TEST(test_a_gap_slides_as_far_as_its_ticks_do);
    RUN_TEST(test_legs_that_rub_only_when_they_move_are_compensated);
    RUN_TEST(test_friction_turns_over_the_presliding_length);
    RUN_TEST(test_leg_wrench_does_the_work_that_the_legs_take_up);
    RUN_TEST(test_a_base_that_is_not_level_is_turned);
    RUN_TEST(test_considered_errors_are_those_of_wrong_constants);
    RUN_TEST(test_a_machine_known_to_a_tolerance_is_not_judged_by_noise_alone);
    RUN_TEST(test_a_machine_that_rubs_raises_no_storm_and_is_not_believed);
    RUN_TEST(test_a_machine_whose_friction_is_known_is_believed);
    RUN_TEST(test_acceleration_is_the_twists_change_over_five_ticks);
    RUN_TEST(test_any_of_the_legs_three_numbers_gives_them_a_mass);
    return UNITY_END();
}
