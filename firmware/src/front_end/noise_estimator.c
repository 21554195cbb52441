#include "front_end/noise_estimator.h"

#include "algebra/real.h"
#include "configuration/health.h"

#include <stdbool.h>
#include <string.h>

#define TIME_CONSTANT_S HEXLOAD_REAL(1.0)

/// A stated sigma within a fifth of the measured one is kept; of fewer ticks than these what is further off.
#define BELIEVED_EXCESS HEXLOAD_REAL(0.44)
#define PROOF_TICKS HEXLOAD_REAL(100.0)

/// Measured ones are used between a quarter and ten times the stated.
#define LEAST_RATIO HEXLOAD_REAL(0.0625)
#define MOST_RATIO HEXLOAD_REAL(100.0)

/// Of forces that are read in lbf (0.22), kgf or daN (0.1), with what a stated sigma may be off. Without any
/// noise, as a simulator may be, they are of no unit; nor where it is coloured, as a filter leaves it: one of
/// first order has neighbours of 0.89 of the squares at least, which its stated delay tells, and one of
/// second order that leaves so little of the noise has 0.85 at most.
#define UNIT_LEAST_RATIO HEXLOAD_REAL(1e-3)
#define UNIT_MOST_RATIO HEXLOAD_REAL(0.08)
#define WHITE HEXLOAD_REAL(0.85)

/// One leg counts at most three sigma, so that a shock is not taken for noise.
#define LARGEST_SQUARE HEXLOAD_REAL(9.0)

/// What two third differences of white noise in a row have in common, -3 - 9 - 3 with the opposite sign, in
/// variances.
#define OPPOSITE_NEIGHBOURS HEXLOAD_REAL(15.0)

enum { DISPLACEMENT, VELOCITY, FORCE, FORCE_NEIGHBOURS };

void hexload_noise_estimator_init(hexload_noise_estimator_t* self) {
    *self = (hexload_noise_estimator_t){
        .ratio = {HEXLOAD_REAL(1.0), HEXLOAD_REAL(1.0), HEXLOAD_REAL(1.0), HEXLOAD_REAL(1.0)}};
}

/// Mean over the legs of a kind's third difference squared, or times the one of the last turn, in stated
/// variances.
static hexload_real_t mean_ratio(hexload_noise_estimator_t* self, uint32_t kind,
                                 const hexload_real_t now[HEXLOAD_LEGS], hexload_real_t sigma) {
    const uint32_t oldest = self->oldest;
    const hexload_real_t* third = self->last[kind][oldest];
    const hexload_real_t* second = self->last[kind][oldest == HEXLOAD_NOISE_HISTORY - 1 ? 0 : oldest + 1];
    const hexload_real_t* first = self->last[kind][oldest == 0 ? HEXLOAD_NOISE_HISTORY - 1 : oldest - 1];
    const bool is_square = kind == self->turn;
    const hexload_real_t stated =
        (is_square ? HEXLOAD_THIRD_DIFFERENCE_SQUARE : OPPOSITE_NEIGHBOURS) * sigma * sigma;
    const hexload_real_t most = LARGEST_SQUARE * hexload_max(self->ratio[kind], HEXLOAD_REAL(1.0)) * stated;
    hexload_real_t sum = HEXLOAD_REAL(0.0);
    if (is_square) {
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            const hexload_real_t difference =
                hexload_third_difference(now[leg], first[leg], second[leg], third[leg]);
            sum += hexload_min(difference * difference, most);
            self->difference[leg] = difference;
        }
    } else {
        for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
            const hexload_real_t difference =
                hexload_third_difference(now[leg], first[leg], second[leg], third[leg]);
            sum += hexload_min(-difference * self->difference[leg], most);
        }
    }
    return sum / ((hexload_real_t)HEXLOAD_LEGS * stated);
}

static void measure(hexload_noise_estimator_t* self, const hexload_config_t* config,
                    const hexload_leg_sample_t* sample) {
    const hexload_real_t* const now[HEXLOAD_NOISE_KINDS] = {sample->displacement_m, sample->velocity_m_s,
                                                            sample->force_n};
    const hexload_sensors_t* stated = &config->sensors;
    const hexload_real_t sigma[HEXLOAD_NOISE_KINDS] = {stated->displacement_sigma_m,
                                                       stated->velocity_sigma_m_s, stated->force_sigma_n};
    const hexload_real_t memory = TIME_CONSTANT_S / config->tick_s;
    const uint32_t turn = self->turn;
    const uint32_t kind = turn == FORCE_NEIGHBOURS ? FORCE : turn;
    self->ticks += (hexload_real_t)self->ticks < memory ? 1 : 0;
    const hexload_real_t weight =
        hexload_min(HEXLOAD_REAL(1.0), (hexload_real_t)HEXLOAD_NOISE_TURNS / (hexload_real_t)self->ticks);
    self->ratio[turn] += weight * (mean_ratio(self, kind, now[kind], sigma[kind]) - self->ratio[turn]);
    self->turn = (turn + 1) % (uint32_t)HEXLOAD_NOISE_TURNS;
}

void hexload_noise_estimator_step(hexload_noise_estimator_t* self, const hexload_config_t* config,
                                  const hexload_leg_sample_t* sample, uint32_t gap_ticks) {
    const uint32_t oldest = self->oldest;
    if (gap_ticks != 1) {
        self->history = 0; // differences over a gap are motion
        self->turn = self->turn == FORCE_NEIGHBOURS ? DISPLACEMENT : self->turn;
    }
    if (self->history == HEXLOAD_NOISE_HISTORY) {
        measure(self, config, sample);
    } else {
        self->history++;
    }
    memcpy(self->last[DISPLACEMENT][oldest], sample->displacement_m, sizeof sample->displacement_m);
    memcpy(self->last[VELOCITY][oldest], sample->velocity_m_s, sizeof sample->velocity_m_s);
    memcpy(self->last[FORCE][oldest], sample->force_n, sizeof sample->force_n);
    self->oldest = oldest == HEXLOAD_NOISE_HISTORY - 1 ? 0 : oldest + 1;
}

/// Of a late channel a low-pass has taken the top of the band, where third differences look, and left what
/// counts: it has the stated sigma at least.
/// @param most of a ratio that may be chance or a fifth of a sigma
static hexload_real_t believed(hexload_real_t sigma, hexload_real_t ratio, hexload_real_t most,
                               hexload_real_t delay_s, uint32_t* health) {
    const bool is_less = ((ratio * most) < HEXLOAD_REAL(1.0)) && (delay_s <= HEXLOAD_REAL(0.0));
    if ((ratio <= most) && !is_less) {
        return sigma;
    }
    hexload_health_set(health, HEXLOAD_HEALTH_NOISE_MISSTATED);
    return sigma * hexload_sqrt(hexload_min(hexload_max(ratio, LEAST_RATIO), MOST_RATIO));
}

void hexload_noise_estimator_read(const hexload_noise_estimator_t* self, const hexload_config_t* config,
                                  hexload_sensors_t* sensors, uint32_t* health) {
    const hexload_sensors_t* stated = &config->sensors;
    const uint32_t of_speeds = stated->half_window_ticks > 0 ? DISPLACEMENT : VELOCITY;
    const hexload_real_t ticks =
        hexload_max(hexload_min((hexload_real_t)self->ticks, PROOF_TICKS), HEXLOAD_REAL(1.0));
    const hexload_real_t most = HEXLOAD_REAL(1.0) + (BELIEVED_EXCESS * PROOF_TICKS / ticks);
    *sensors = *stated;
    sensors->displacement_sigma_m =
        believed(stated->displacement_sigma_m, self->ratio[DISPLACEMENT], most, HEXLOAD_REAL(0.0), health);
    sensors->velocity_sigma_m_s = believed(stated->velocity_sigma_m_s, self->ratio[of_speeds], most,
                                           config->rig.velocity_delay_s, health);
    sensors->force_sigma_n =
        believed(stated->force_sigma_n, self->ratio[FORCE], most, config->rig.force_delay_s, health);
}

bool hexload_noise_estimator_are_forces_quiet(const hexload_noise_estimator_t* self,
                                              const hexload_config_t* config) {
    const hexload_real_t ratio = self->ratio[FORCE];
    return (ratio < UNIT_MOST_RATIO) && (ratio > UNIT_LEAST_RATIO) &&
           (self->ratio[FORCE_NEIGHBOURS] > WHITE * ratio) &&
           (config->rig.force_delay_s <= HEXLOAD_REAL(0.0));
}
