#include "paper/known_mass.h"

#include "algebra/linalg.h"
#include "front_end/plausibility.h"

#include <string.h>

enum { LONGEST_GAP_TICKS = 8 }; ///< over which one acceleration is taken

/// Of the means. A tenth of it is needed before they say anything.
#define MEMORY_S HEXLOAD_REAL(2.0)
#define SETTLED_S HEXLOAD_REAL(0.2)

/// Beyond what tolerances do: two-sided, 5.7e-7; and beyond a share of the weight, were they stated as none.
/// What has been contradicted stays so above a part of that.
#define SIGMAS HEXLOAD_REAL(5.0)
#define LEAST_SHARE HEXLOAD_REAL(0.02)
#define STILL_CONTRADICTED HEXLOAD_REAL(0.8)

/// Share of the weight that widens no sigma.
#define GRANTED_SHARE HEXLOAD_REAL(0.004)

void hexload_known_mass_init(hexload_known_mass_t* self, const hexload_config_t* config) {
    const hexload_real_t own_n = config->platform.mass_kg * config->gravity_m_s2;
    memset(self, 0, sizeof *self);
    self->mass_kg = config->platform.mass_kg + config->paper.load_mass_kg;
    const hexload_real_t weight_n = self->mass_kg * config->gravity_m_s2;
    const hexload_real_t gain_n = config->tolerances.force_gain * weight_n;
    const hexload_real_t platform_n = config->tolerances.platform_mass * own_n;
    const hexload_real_t sigma_n = hexload_sqrt(gain_n * gain_n + platform_n * platform_n);
    self->limit_n =
        hexload_max(SIGMAS * sigma_n, LEAST_SHARE * weight_n) + hexload_rig_weight_n(&config->rig, weight_n);
    for (int leg = 0; leg < HEXLOAD_LEGS; leg++) {
        const hexload_real_t* hinge_m = config->geometry.platform_hinge_m[leg];
        self->lever_kg_m =
            hexload_max(self->lever_kg_m, self->mass_kg * hexload_sqrt(dot3(hinge_m, hinge_m)));
    }
}

/// The means with this sample: of all since the start, then of the last MEMORY_S. Those of accelerations are
/// of the rates' differences.
static void add(hexload_known_mass_t* self, const hexload_config_t* config, const hexload_present_tick_t* now,
                const hexload_wrench_t* wrench) {
    const hexload_motion_t* motion = now->motion;
    const hexload_real_t* omega = &motion->twist[3];
    const hexload_real_t* last_omega = &self->last_twist[3];
    const hexload_real_t dt_s = config->tick_s * (hexload_real_t)now->gap_ticks;
    self->time_s = hexload_min(self->time_s + dt_s, MEMORY_S);
    const hexload_real_t per_s = HEXLOAD_REAL(1.0) / self->time_s;
    const hexload_real_t weight = dt_s * per_s;
    const hexload_real_t excess_n =
        dot3(motion->R[2], wrench->force_n) - self->mass_kg * config->gravity_m_s2;
    self->excess_n += weight * (excess_n - self->excess_n) -
                      per_s * self->mass_kg * (motion->twist[2] - self->last_twist[2]);
    for (int k = 0; k < 2; k++) {
        self->turn_rad_s2[k] += per_s * (omega[k] - last_omega[k]) - weight * self->turn_rad_s2[k];
    }
    self->square_rad2_s2 += weight * (dot3(omega, omega) - self->square_rad2_s2);
}

/// Whether what is left is more than all that may be, the place of the centre of mass included: (omega x c)_z
/// changes with omega, and as c turns by no more than omega does in that time, twice its mean square.
static bool is_beyond(const hexload_known_mass_t* self) {
    const hexload_real_t turned = hexload_abs(self->turn_rad_s2[0]) + hexload_abs(self->turn_rad_s2[1]) +
                                  HEXLOAD_REAL(2.0) * self->square_rad2_s2;
    const hexload_real_t part = self->is_contradicted ? STILL_CONTRADICTED : HEXLOAD_REAL(1.0);
    return hexload_abs(self->excess_n) > hexload_fma(self->lever_kg_m, turned, part * self->limit_n);
}

/// Of a mean that is still short the motion of a centre of mass beside the axis has much, so only the part
/// counts that it is of the whole memory.
static hexload_real_t weight_error(const hexload_known_mass_t* self, hexload_real_t weight_n) {
    const hexload_real_t share = hexload_abs(self->excess_n) / weight_n * (self->time_s / MEMORY_S);
    return share > GRANTED_SHARE ? share : HEXLOAD_REAL(0.0);
}

void hexload_known_mass_step(hexload_known_mass_t* self, const hexload_config_t* config,
                             const hexload_present_tick_t* now, const hexload_wrench_t* wrench) {
    const hexload_real_t weight_n = self->mass_kg * config->gravity_m_s2;
    if (self->has_last && now->gap_ticks <= LONGEST_GAP_TICKS && weight_n > HEXLOAD_REAL(0.0)) {
        add(self, config, now, wrench);
        self->weight_error = weight_error(self, weight_n);
        self->is_contradicted = self->time_s > SETTLED_S && is_beyond(self);
    }
    memcpy(self->last_twist, now->motion->twist, sizeof self->last_twist);
    self->has_last = true;
}

void hexload_known_mass_judge(const hexload_known_mass_t* self, hexload_estimate_t* estimate,
                              hexload_input_fault_t* fault, uint32_t* health) {
    if (!self->is_contradicted || fault->cause != HEXLOAD_INPUT_PLAUSIBLE) {
        return;
    }
    fault->cause = HEXLOAD_INPUT_KNOWN_MASS;
    fault->excess_n = self->excess_n;
    hexload_input_fault_judge(HEXLOAD_PAPER_DIM, estimate, health);
}
