#include "actuator_effects/identifiability.h"
#include "actuator_effects/actuator_effects_model.h"
#include "textbook.h"

#include <math.h>
#include <string.h>

void setUp(void) {}
void tearDown(void) {}

enum { LOAD = HEXLOAD_LOAD_DIM, DIM = HEXLOAD_EFFECTS_DIM, BIASES = 6, LEGS_ALL = 18 };

typedef struct bench {
    hexload_config_t config;
    hexload_momentum_filter_t load;
    hexload_actuator_effects_t effects;
    double P_ee[DIM][DIM], P_te[LOAD][DIM], P_tt[LOAD];
} bench_t;

/// Effects that are nearly independent, and a load of which a part goes with those of one kind.
static void draw(bench_t* bench, uint64_t* seed) {
    double share[LOAD][DIM], sigma[DIM];
    for (int i = 0; i < DIM; i++) {
        sigma[i] = 1.0 + 0.5 * uniform(seed);
    }
    for (int i = 0; i < DIM; i++) {
        for (int j = 0; j <= i; j++) {
            bench->P_ee[i][j] = bench->P_ee[j][i] =
                sigma[i] * sigma[j] * (i == j ? 1.0 : 0.03 * uniform(seed));
        }
    }
    for (int k = 0; k < LOAD; k++) {
        const double size[3] = {pow(10.0, uniform(seed)), pow(10.0, uniform(seed)), pow(10.0, uniform(seed))};
        bench->P_tt[k] = pow(1.0 + 0.9 * uniform(seed), 2.0);
        for (int i = 0; i < DIM; i++) {
            share[k][i] = 0.5 * size[i < BIASES ? 0 : i < LEGS_ALL ? 1 : 2] * uniform(seed);
        }
        for (int i = 0; i < DIM; i++) {
            bench->P_te[k][i] = 0.0;
            for (int j = 0; j < DIM; j++) {
                bench->P_te[k][i] += share[k][j] * bench->P_ee[j][i];
            }
            bench->P_tt[k] += bench->P_te[k][i] * share[k][i];
        }
        bench->P_tt[k] += 1e-3;
    }
}

static void write(bench_t* bench) {
    for (int k = 0; k < LOAD; k++) {
        bench->load.load_cov[k][k] = (hexload_real_t)bench->P_tt[k];
    }
    for (int i = 0; i < DIM; i++) {
        hexload_real_t* row = &bench->effects.covariance[EFFECT_ROW(i)];
        for (int k = 0; k < LOAD; k++) {
            row[k] = (hexload_real_t)bench->P_te[k][i];
        }
        for (int j = 0; j <= i; j++) {
            row[HEXLOAD_MOMENTUM_STATES + j] = (hexload_real_t)bench->P_ee[i][j];
        }
    }
}

/// A round of elimination, of which no tick takes more than the first effect does.
static void make_round(hexload_identifiability_t* self, const bench_t* bench, uint32_t count) {
    const hexload_smooth_sample_t still = {.gap_ticks = 1};
    do {
        const uint32_t from = self->next;
        uint32_t entries = 0; // of the covariance that is left, which are written
        hexload_identifiability_step(self, &bench->config, &bench->load, &bench->effects, &still);
        for (uint32_t at = from; at < count && at < self->next; at++) {
            entries += (count - at) * (count - at + 1) / 2;
        }
        TEST_ASSERT_LESS_OR_EQUAL_UINT32(count * (count + 1) / 2, entries);
    } while (self->next < DIM + LOAD);
}

/// Variance of parameter k when the first `known` effects are: P_tt - P_te P_ee^-1 P_et.
static double given(const bench_t* bench, int k, int known) {
    double P[DIM * DIM], inverse[DIM * DIM], variance = bench->P_tt[k];
    for (int i = 0; i < known; i++) {
        memcpy(&P[i * known], bench->P_ee[i], (size_t)known * sizeof *P);
    }
    invert(P, known, inverse);
    for (int i = 0; i < known; i++) {
        for (int j = 0; j < known; j++) {
            variance -= bench->P_te[k][i] * inverse[i * known + j] * bench->P_te[k][j];
        }
    }
    return variance;
}

/// What parameter k is confounded with: 0 to 2, 3 with nothing, -1 when rounding decides.
static int expect(const bench_t* bench, int k, bool has_tilt) {
    const hexload_momentum_config_t* momentum = &bench->config.momentum;
    const double nothing = bench->P_tt[k], bias = given(bench, k, BIASES),
                 friction = given(bench, k, LEGS_ALL);
    const double all = has_tilt ? given(bench, k, DIM) : friction;
    const double prior = k == 0  ? (double)momentum->prior_mass_sigma_kg
                         : k < 4 ? (double)momentum->prior_moment_sigma_kg_m
                                 : (double)momentum->prior_inertia_sigma_kg_m2;
    const double lowered[3] = {nothing / bias, bias / friction, friction / all};
    int most = 0;
    for (int n = 1; n < 3; n++) {
        most = lowered[n] > lowered[most] ? n : most;
    }
    for (int n = 0; n < 3; n++) {
        if (n != most && lowered[n] > 0.99 * lowered[most]) {
            return -1;
        }
    }
    const double least = fmin(nothing, prior * prior);
    if (fabs(least / (4.0 * all) - 1.0) < 0.01) {
        return -1;
    }
    return least > 4.0 * all ? most : 3;
}

static void test_parameters_are_confounded_with_what_hides_most_of_them(void) {
    // GIVEN covariances in which biases, friction or tilt hide a large or small part of each parameter, of
    // which the prior knew little or much WHEN a round of elimination is over
    uint64_t seed = 101;
    int seen[4] = {0};
    for (int trial = 0; trial < 200; trial++) {
        bench_t bench;
        hexload_identifiability_t self;
        const bool has_tilt = trial % 2 == 0;
        memset(&bench, 0, sizeof bench);
        bench.config = paper_machine();
        bench.config.actuator_effects.prior_tilt_sigma_m_s2 = (hexload_real_t)(has_tilt ? 0.1 : 0.0);
        bench.config.momentum.prior_mass_sigma_kg = (hexload_real_t)(2.0 + 1.5 * uniform(&seed));
        bench.config.momentum.prior_moment_sigma_kg_m = (hexload_real_t)(20.0 + 15.0 * uniform(&seed));
        bench.config.momentum.prior_inertia_sigma_kg_m2 = (hexload_real_t)(2.0 + 1.5 * uniform(&seed));
        draw(&bench, &seed);
        write(&bench);
        hexload_identifiability_init(&self);
        make_round(&self, &bench, has_tilt ? DIM : LEGS_ALL);
        // THEN those whose sigma would be less than half, and half of the prior's, are confounded with the
        // kind whose elimination lowers the variance by the largest factor
        for (int k = 0; k < LOAD; k++) {
            const int kind = expect(&bench, k, has_tilt);
            if (kind >= 0) {
                seen[kind]++;
                TEST_ASSERT_EQUAL_INT(kind == 0, self.bias_mask >> k & 1u);
                TEST_ASSERT_EQUAL_INT(kind == 1, self.friction_mask >> k & 1u);
                TEST_ASSERT_EQUAL_INT(kind == 2, self.tilt_mask >> k & 1u);
            }
        }
        TEST_ASSERT_EQUAL_HEX32(0, (self.bias_mask | self.friction_mask | self.tilt_mask) >> LOAD);
    }
    for (int kind = 0; kind < 4; kind++) {
        TEST_ASSERT_GREATER_THAN_INT(50, seen[kind]);
    }
}

static void test_what_rounding_leaves_of_an_effect_is_no_knowledge(void) {
    // GIVEN two biases that go together but for 72, or 56, roundings of their variance, a parameter of whose
    // variance nine tenths go with what is left, and all other effects known to be none
    static bench_t bench;
    hexload_identifiability_t self;
    enum { FIRST = 0, LAST = 5, PARAMETER = 4 };
    const double share[] = {72.0, 56.0, 72.0, 0.0};
    memset(&bench, 0, sizeof bench);
    bench.config = paper_machine();
    bench.config.actuator_effects.prior_tilt_sigma_m_s2 = HEXLOAD_REAL(0.1);
    bench.P_ee[FIRST][FIRST] = bench.P_ee[LAST][LAST] = bench.P_tt[PARAMETER] = 1.0;
    hexload_identifiability_init(&self);
    for (int round = 0; round < 4; round++) {
        const double left = ROUNDINGS(share[round], 1.0);
        bench.P_ee[LAST][FIRST] = 1.0 - 0.5 * left; // 1 - c^2 is 2 (1 - c), but for the square of that
        bench.P_te[PARAMETER][LAST] = sqrt(0.9 * left);
        write(&bench);
        // WHEN a round is over, one after the other THEN the parameter is confounded with biases if these can
        // be told apart by more than 64 roundings, and with nothing else
        make_round(&self, &bench, DIM);
        TEST_ASSERT_EQUAL_HEX32(share[round] > 64.0 ? 1u << PARAMETER : 0u, self.bias_mask);
        TEST_ASSERT_EQUAL_HEX32(0, self.friction_mask | self.tilt_mask);
    }
}

static void test_what_is_confounded_is_not_excited_unless_it_has_converged(void) {
    // GIVEN each parameter confounded with each kind of effects, with any verdict, and bits that belong to no
    // parameter WHEN it is judged THEN of
    // those that converge it is not excited, all others stay, and the whole is no better
    for (int k = 0; k < LOAD; k++) {
        for (int kind = 0; kind < 3; kind++) {
            for (int verdict = HEXLOAD_VERDICT_CONVERGED; verdict <= HEXLOAD_VERDICT_INCONSISTENT;
                 verdict++) {
                hexload_identifiability_t self;
                hexload_estimate_t estimate;
                uint32_t health = 0;
                memset(&self, 0, sizeof self);
                memset(&estimate, 0, sizeof estimate);
                *(kind == 0   ? &self.bias_mask
                  : kind == 1 ? &self.friction_mask
                              : &self.tilt_mask) = 1u << k | UINT32_MAX << LOAD;
                for (int n = 0; n < LOAD; n++) {
                    estimate.parameter_verdict[n] = (hexload_verdict_t)verdict;
                }
                estimate.verdict = (hexload_verdict_t)verdict;
                hexload_identifiability_judge(&self, &estimate, &health);
                const bool is_turned = verdict == HEXLOAD_VERDICT_CONVERGING;
                for (int n = 0; n < LOAD; n++) {
                    TEST_ASSERT_EQUAL_INT(is_turned && n == k ? HEXLOAD_VERDICT_NOT_EXCITED : verdict,
                                          estimate.parameter_verdict[n]);
                }
                TEST_ASSERT_EQUAL_INT(is_turned ? HEXLOAD_VERDICT_NOT_EXCITED : verdict, estimate.verdict);
                TEST_ASSERT_EQUAL_HEX32(is_turned ? 1u << HEXLOAD_HEALTH_NOT_EXCITED : 0u, health);
            }
        }
    }
}

static void test_the_fastest_leg_fades_with_the_excitation(void) {
    // GIVEN a time constant of 2 s WHEN each leg in turn has been the fastest, with either sign, and the
    // platform then rests for 2 s THEN its speed is that, and then 1 / e of it
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        static bench_t bench;
        hexload_identifiability_t self;
        hexload_smooth_sample_t sample = {.gap_ticks = 1};
        memset(&bench, 0, sizeof bench);
        bench.config = paper_machine();
        bench.config.momentum.excitation_time_constant_s = HEXLOAD_REAL(2.0);
        hexload_identifiability_init(&self);
        sample.smooth_velocity_m_s[leg] = (hexload_real_t)(leg % 2 == 0 ? 0.3 : -0.3);
        hexload_identifiability_step(&self, &bench.config, &bench.load, &bench.effects, &sample);
        TEST_ASSERT_EQUAL_DOUBLE((double)HEXLOAD_REAL(0.3), (double)self.fastest_leg_m_s);
        sample.smooth_velocity_m_s[leg] = HEXLOAD_REAL(0.0);
        for (int tick = 0; tick < 2000; tick++) {
            hexload_identifiability_step(&self, &bench.config, &bench.load, &bench.effects, &sample);
        }
        TEST_ASSERT_DOUBLE_WITHIN(1e-3, 0.3 * exp(-1.0), (double)self.fastest_leg_m_s);
    }
}

int main(void) {
    UNITY_BEGIN();
    RUN_TEST(test_parameters_are_confounded_with_what_hides_most_of_them);
    RUN_TEST(test_what_rounding_leaves_of_an_effect_is_no_knowledge);
    RUN_TEST(test_what_is_confounded_is_not_excited_unless_it_has_converged);
    RUN_TEST(test_the_fastest_leg_fades_with_the_excitation);
    return UNITY_END();
}
