#include "paper/known_mass.h"
#include "textbook.h"

#include <math.h>
#include <string.h>

void setUp(void) {}
void tearDown(void) {}

/// The limit of what machine and sensors may be off by: five sigma of the tolerances or 2 % of the weight,
/// and offsets, gains and friction of all legs.
static double limit_of(const hexload_config_t* config, double weight_n) {
    const hexload_rig_config_t* rig = &config->rig;
    const double gain_n = (double)config->tolerances.force_gain * weight_n;
    const double platform_n = (double)config->tolerances.platform_mass * (double)config->platform.mass_kg *
                              (double)config->gravity_m_s2;
    double limit_n = fmax(5.0 * sqrt(gain_n * gain_n + platform_n * platform_n), 0.02 * weight_n);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        limit_n += fabs((double)rig->force_offset_n[leg]) + (double)rig->coulomb_n[leg] +
                   fmax((double)rig->stribeck_n[leg], 0.0) +
                   (fabs((double)rig->force_gain[leg]) + (double)rig->growth_n_n[leg]) * weight_n / 6.0;
    }
    return limit_n;
}

static hexload_config_t random_machine(uint64_t* seed, bool has_tolerances) {
    hexload_config_t config = crooked_machine();
    config.tick_s = HEXLOAD_REAL(0.005);
    config.tolerances.force_gain = (hexload_real_t)(has_tolerances ? 0.01 * (1.0 + uniform(seed)) : 0.0);
    config.tolerances.platform_mass = (hexload_real_t)(has_tolerances ? 0.1 * (1.0 + uniform(seed)) : 0.0);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        config.rig.force_offset_n[leg] = (hexload_real_t)(10.0 * uniform(seed));
        config.rig.force_gain[leg] = (hexload_real_t)(0.01 * uniform(seed));
        config.rig.coulomb_n[leg] = (hexload_real_t)(6.0 * (1.0 + uniform(seed)));
        config.rig.stribeck_n[leg] = (hexload_real_t)(5.0 * uniform(seed));
        config.rig.growth_n_n[leg] = (hexload_real_t)(0.005 * (1.0 + uniform(seed)));
    }
    return config;
}

static void test_limit_and_lever_are_those_of_the_machine(void) {
    // GIVEN machines with and without tolerances, with offsets, gains and friction WHEN a mass is stated THEN
    // the limit is the sum of what they do, and the centre of mass may be as far off as the farthest hinge
    uint64_t seed = 95;
    for (int trial = 0; trial < 40; trial++) {
        const hexload_config_t config = random_machine(&seed, trial % 2 == 0);
        hexload_known_mass_t self;
        double farthest = 0.0;
        hexload_known_mass_init(&self, &config);
        const double mass_kg = (double)config.platform.mass_kg + (double)config.paper.load_mass_kg;
        const double limit_n = limit_of(&config, mass_kg * (double)config.gravity_m_s2);
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            const hexload_real_t* a = config.geometry.platform_hinge_m[leg];
            farthest =
                fmax(farthest, sqrt((double)(a[0] * a[0]) + (double)(a[1] * a[1]) + (double)(a[2] * a[2])));
        }
        TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(4, mass_kg), mass_kg, (double)self.mass_kg);
        TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(40, limit_n), limit_n, (double)self.limit_n);
        TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(8, mass_kg * farthest), mass_kg * farthest,
                                  (double)self.lever_kg_m);
    }
}

typedef struct bench {
    scene_t scene;
    hexload_known_mass_t self;
    hexload_wrench_t wrench;
    hexload_present_tick_t now;
} bench_t;

/// The means of the last two seconds, of a start of all: of the force less weight and of
/// accelerations by the rates' differences. @return whether rounding decides the verdict.
static bool expect(const bench_t* bench, hexload_known_mass_t* self) {
    const hexload_config_t* config = &bench->scene.config;
    const hexload_motion_t* motion = bench->now.motion;
    const double g = (double)config->gravity_m_s2, mass = (double)self->mass_kg;
    const double dt_s = (double)config->tick_s * bench->now.gap_ticks;
    bool is_close = false;
    if (self->has_last && bench->now.gap_ticks <= 8) {
        double square = 0.0;
        const double time_s = fmin(2.0, (double)self->time_s + dt_s), share = dt_s / time_s;
        double excess = -mass * (g + ((double)motion->twist[2] - (double)self->last_twist[2]) / dt_s);
        for (int k = 0; k < 3; k++) {
            excess += (double)motion->R[2][k] * (double)bench->wrench.force_n[k];
            square += pow((double)motion->twist[3 + k], 2.0);
        }
        self->excess_n += (hexload_real_t)(share * (excess - (double)self->excess_n));
        self->square_rad2_s2 += (hexload_real_t)(share * (square - (double)self->square_rad2_s2));
        for (int k = 0; k < 2; k++) {
            const double turn = ((double)motion->twist[3 + k] - (double)self->last_twist[3 + k]) / dt_s;
            self->turn_rad_s2[k] += (hexload_real_t)(share * (turn - (double)self->turn_rad_s2[k]));
        }
        self->time_s = (hexload_real_t)time_s;
        const double turned = fabs((double)self->turn_rad_s2[0]) + fabs((double)self->turn_rad_s2[1]) +
                              2.0 * (double)self->square_rad2_s2;
        const double limit =
            (self->is_contradicted ? 0.8 : 1.0) * (double)self->limit_n + (double)self->lever_kg_m * turned;
        const double size = fabs((double)self->excess_n), error = size / (mass * g) * time_s / 2.0;
        is_close =
            fabs(size - limit) < 1e-3 * limit || fabs(error - 0.004) < 4e-6 || fabs(time_s - 0.2) < 1e-5;
        self->weight_error = (hexload_real_t)(error > 0.004 ? error : 0.0);
        self->is_contradicted = time_s > 0.2 && size > limit;
    }
    memcpy(self->last_twist, motion->twist, sizeof self->last_twist);
    self->has_last = true;
    return is_close;
}

/// A tick of a platform that turns and jumps by so much, with legs that carry so much more than they should.
static void make_tick(bench_t* bench, uint64_t* seed, double excess_n, double size) {
    const double weight_n = (double)bench->self.mass_kg * (double)bench->scene.config.gravity_m_s2;
    for (int k = 0; k < 6; k++) {
        bench->scene.motion.twist[k] = (hexload_real_t)(size * (0.2 * uniform(seed) + (k == 3 ? 1.0 : 0.0)));
    }
    for (int k = 0; k < 3; k++) { // platform axes
        bench->wrench.force_n[k] =
            (hexload_real_t)((double)bench->scene.motion.R[2][k] * (weight_n + excess_n) +
                             100.0 * uniform(seed));
    }
}

static void test_means_and_verdict_are_those_of_the_equations(void) {
    // GIVEN four times two thousand ticks, of 5 ms, of legs that carry more or less than the stated mass
    // weighs by up to twice the limit, of a platform that rests or turns, and gaps
    uint64_t seed = 96;
    int contradicted = 0, judged = 0;
    for (int run = 0; run < 4; run++) {
        bench_t bench;
        memset(&bench, 0, sizeof bench);
        scene_at(&bench.scene, 140);
        bench.scene.config = random_machine(&seed, run % 2 == 0);
        hexload_known_mass_init(&bench.self, &bench.scene.config);
        bench.now.motion = &bench.scene.motion;
        for (int tick = 0; tick < 2000; tick++) {
            const double excess_n = 2.0 * (double)bench.self.limit_n * sin(0.011 * tick + run);
            bench.now.gap_ticks = tick % 50 == 49 ? 8 : tick % 170 == 169 ? 9 : 1;
            make_tick(&bench, &seed, excess_n, run < 2 ? 0.01 : 0.1);
            hexload_known_mass_t expected = bench.self;
            const bool is_close = expect(&bench, &expected);
            // WHEN a tick is taken THEN means and verdict are what the equations make of those before
            hexload_known_mass_step(&bench.self, &bench.scene.config, &bench.now, &bench.wrench);
            const hexload_known_mass_t* found = &bench.self;
            TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(40, 1e4), (double)expected.excess_n, (double)found->excess_n);
            TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(4, 2.0), (double)expected.time_s, (double)found->time_s);
            TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(40, 1.0), (double)expected.square_rad2_s2,
                                      (double)found->square_rad2_s2);
            for (int k = 0; k < 2; k++) {
                TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(40, 10.0), (double)expected.turn_rad_s2[k],
                                          (double)found->turn_rad_s2[k]);
            }
            if (!is_close) {
                judged++;
                contradicted += found->is_contradicted;
                TEST_ASSERT_EQUAL_INT(expected.is_contradicted, found->is_contradicted);
                TEST_ASSERT_DOUBLE_WITHIN(ROUNDINGS(80, 1.0), (double)expected.weight_error,
                                          (double)found->weight_error);
            }
        }
    }
    TEST_ASSERT_GREATER_THAN_INT(500, contradicted);
    TEST_ASSERT_GREATER_THAN_INT(1000, judged - contradicted);
}

static void test_without_gravity_nothing_is_said(void) {
    // GIVEN a machine without gravity WHEN its legs push THEN no mass is contradicted
    uint64_t seed = 97;
    bench_t bench;
    memset(&bench, 0, sizeof bench);
    scene_at(&bench.scene, 140);
    bench.scene.config.gravity_m_s2 = HEXLOAD_REAL(0.0);
    hexload_known_mass_init(&bench.self, &bench.scene.config);
    bench.now.motion = &bench.scene.motion;
    bench.now.gap_ticks = 1;
    for (int tick = 0; tick < 1000; tick++) {
        make_tick(&bench, &seed, 1e4, 0.0);
        hexload_known_mass_step(&bench.self, &bench.scene.config, &bench.now, &bench.wrench);
    }
    TEST_ASSERT_FALSE(bench.self.is_contradicted);
    TEST_ASSERT_EQUAL_DOUBLE(0.0, (double)bench.self.weight_error);
    TEST_ASSERT_EQUAL_DOUBLE(0.0, (double)bench.self.time_s);
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_limit_and_lever_are_those_of_the_machine);
    RUN_TEST(test_means_and_verdict_are_those_of_the_equations);
    RUN_TEST(test_without_gravity_nothing_is_said);
    return UNITY_END();
}
