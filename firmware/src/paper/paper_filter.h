/// @file paper_filter.h
/// Fourth stage: the paper's seven-state extended Kalman filter, (24)-(36), corrected as EQUATIONS.md
/// derives.
///
/// Euler's equation about the centre of mass of platform + load, in platform axes. With r its position seen
/// from O_A and F, N the legs' wrench, it holds for every tilt and every motion, gravity included (which has
/// no moment there):
///
///     D omega' + omega x D omega = N - r x F
///     D = Ip + I + (m_a m_l / m) diag(s^2, s^2, 0),  s = dz - com_z of the platform
///
/// Unknown are dz and the load's central inertias Ixx, Iyy, Izz; the load's centre of mass is taken on the z
/// axis and its products of inertia as zero, as in the paper.
#ifndef HEXLOAD_PAPER_FILTER_H
#define HEXLOAD_PAPER_FILTER_H

#include "front_end/present_tick.h"
#include "front_end/wrench.h"

/// Zero parameters and the configured prior (paper, section 4). The rates come from the first sample.
void hexload_paper_filter_init(hexload_paper_filter_t* self, const hexload_config_t* config);

/// Measured rates, platform axes, and what the time update leaves for the measurement update.
typedef struct hexload_paper_step {
    hexload_real_t rate_rad_s[3];        ///< measured omega (29)
    hexload_real_t noise[3][3];          ///< its covariance; lower triangle
    hexload_real_t noise_lever_kg_m2[3]; ///< of hexload_paper_model_t
    bool is_predicted;                   ///< false: the rates have been set to the measured ones
    bool is_used;                        ///< the measurement update has used its innovation
    hexload_real_t whitened[3];          ///< that innovation, three normal numbers where the model fits
} hexload_paper_step_t;

/// Time update (32).
/// @param now gap_ticks 0 for the first sample, which sets the rates; more than longest_gap_ticks: rates
///            restart.
/// @param[in,out] health sets RATE_RESEEDED. Reentrant, constant time but for these cases, which are shorter.
void hexload_paper_filter_predict(hexload_paper_filter_t* self, const hexload_config_t* config,
                                  const hexload_present_tick_t* now, const hexload_wrench_t* wrench,
                                  hexload_paper_step_t* step, uint32_t* health);

/// Measurement update (36).
/// @param[in,out] health sets RATE_RESEEDED, MEASUREMENT_GATED, INERTIA_BOUNDED, COVARIANCE_BOUNDED,
/// FILTER_RESTARTED, NOISE_BOUNDED. Reentrant, constant time but for these cases, which are shorter.
void hexload_paper_filter_correct(hexload_paper_filter_t* self, const hexload_config_t* config,
                                  const hexload_present_tick_t* now, const hexload_wrench_t* wrench,
                                  hexload_paper_step_t* step, uint32_t* health);

/// Both.
static inline void hexload_paper_filter_step(hexload_paper_filter_t* self, const hexload_config_t* config,
                                             const hexload_present_tick_t* now,
                                             const hexload_wrench_t* wrench, uint32_t* health) {
    hexload_paper_step_t step;
    hexload_paper_filter_predict(self, config, now, wrench, &step, health);
    hexload_paper_filter_correct(self, config, now, wrench, &step, health);
}

/// Estimates and their standard deviations.
void hexload_paper_filter_read(const hexload_paper_filter_t* self, hexload_real_t value[HEXLOAD_PAPER_DIM],
                               hexload_real_t sigma[HEXLOAD_PAPER_DIM]);

#endif
