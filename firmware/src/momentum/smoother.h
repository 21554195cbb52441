/// @file smoother.h
/// Leg speeds without phase lag: at a tick that lies `lag` ticks back, from displacements alone, with as many
/// ticks before it as after it; and what is faster than that from the speed sensors of its neighbours.
///
/// The momentum filter needs a twist at which to linearise whose noise is small and independent of the
/// velocity sensors'. A least-squares polynomial of degree six over 2 lag + 1 ticks has the slope
///
///     c1 + c3 + c5,   c_m = p_m'(0) / (tick_s |p_m|^2) * sum over j of p_m(j) x(j)
///
/// with p1, p3, p5 the odd orthogonal polynomials on -lag..lag. Each counts only as far as it stands out of
/// its noise in all legs together: times max(0, 1 - 12.59 / q), q the sum of (c_m / sigma)^2 over the legs,
/// 12.59 the 95 % point of chi-square with 6 degrees of freedom (positive-part shrinkage). A platform at rest
/// then has speed zero, and its noise does not count as motion. c3 and c5 count only in the directions in
/// which the motion of late has bent (motion_directions.h).
///
/// A transient, as a step of speed or a servo that oscillates, is faster than that window. What the velocity
/// sensors of the ticks around it, its own left out, show beyond noise is added (transient.h); until the
/// window is full, that is all there is, and speeds stay as they are until they change as clearly.
///
/// The sums run along in integers, so they cost the same for every lag and never drift.
#ifndef HEXLOAD_SMOOTHER_H
#define HEXLOAD_SMOOTHER_H

#include "front_end/present_tick.h"

/// Weights of a tick, its neighbours and theirs in f - D2 f / 12 + 11 D4 f / 720.
#define HEXLOAD_FORCE_OWN (HEXLOAD_REAL(906.0) / HEXLOAD_REAL(720.0))
#define HEXLOAD_FORCE_NEAR (-HEXLOAD_REAL(104.0) / HEXLOAD_REAL(720.0))
#define HEXLOAD_FORCE_FAR (HEXLOAD_REAL(11.0) / HEXLOAD_REAL(720.0))
/// Of a force with these weights, in that of the sensor's white noise: the sum of their squares.
#define HEXLOAD_SMOOTH_FORCE_VARIANCE (HEXLOAD_REAL(842710.0) / HEXLOAD_REAL(518400.0))

/// A sample of the past, and the speeds that its neighbours on both sides give.
typedef struct hexload_smooth_sample {
    /// Its forces are such that the trapezoids between ticks are the integral: f - D2 f / 12 + 11 D4 f / 720,
    /// D2 and D4 central differences. At 95 Hz the trapezoid alone loses 3 % of an impulse.
    hexload_leg_sample_t sample;
    hexload_real_t smooth_velocity_m_s[HEXLOAD_LEGS];
    uint32_t gap_ticks; ///< periods since the last one taken out; 0 for the first after a start
    hexload_real_t force_variance_n2[HEXLOAD_LEGS]; ///< beside the sensors' noise; 0 of the smoother
    hexload_real_t leg_wrench[6];                   ///< that the legs take, about O_A; 0 of the smoother
} hexload_smooth_sample_t;

/// Whether the tick at a place of the rings is missing, or left out.
/// @param place below HEXLOAD_DELAY_CAPACITY.
static inline bool hexload_smoother_leaves_out(const hexload_smoother_t* self, uint32_t place) {
    return ((self->left_out[place / 32U] >> (place % 32U)) & 1U) != 0U;
}

/// Starts empty.
void hexload_smoother_init(hexload_smoother_t* self, const hexload_config_t* config);

/// Puts a sample in. Ticks that are missing before it are bridged for their neighbours' sake only,
/// displacements by a cubic through those and the velocities of both sides, velocities and forces by a line;
/// when there are too many, everything begins anew.
/// A speed that stands out from both its neighbours leaves its tick out.
/// @param now a sample, the periods since the last one put in, 0 for the first, and effective sigmas.
/// @return false when it began anew. Worst case: as many bridged ticks as the configuration allows.
bool hexload_smoother_put(hexload_smoother_t* self, const hexload_config_t* config,
                          const hexload_present_tick_t* now);

/// Takes the sample of lag ticks back out, or of more while gaps are under way. At most one is taken for each
/// that is put in.
/// @param sensors their sigmas as they are, for what counts as noise.
/// @return false when there is none: in the first lag + HEXLOAD_TRANSIENT_TICKS ticks, and where one is
/// missing or has a speed that is wrong once.
bool hexload_smoother_take(hexload_smoother_t* self, const hexload_sensors_t* sensors,
                           hexload_smooth_sample_t* out);

#endif
