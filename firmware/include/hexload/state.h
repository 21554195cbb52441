/// @file state.h
/// What an instance remembers from tick to tick, stage by stage, in data-flow order. Public for one reason:
/// the caller owns the memory, so the compiler must know its size. Read an instance by the functions of
/// momentum.h, paper.h and hexload.h; these members are no interface and change without notice.
#ifndef HEXLOAD_STATE_H
#define HEXLOAD_STATE_H

#include "hexload/config.h"
#include "hexload/estimate.h"
#include "hexload/options.h"

#include <stdbool.h>

HEXLOAD_DECLS_BEGIN

enum { HEXLOAD_DIFFERENTIATOR_TICKS = 2 * +HEXLOAD_HALF_WINDOW_TICKS_MAX + 1 };

/// Last accepted sample.
typedef struct hexload_leg_gate {
    hexload_real_t last_displacement_m[HEXLOAD_LEGS];
    uint32_t last_tick; ///< sampling periods
    uint32_t accepted;  ///< samples so far, saturating; 0: the others mean nothing
} hexload_leg_gate_t;

/// Channels that have been missing of late.
typedef struct hexload_lost_channels {
    uint32_t force_ticks;        ///< for which the force of force_leg still counts as a guess; 0: none is
    uint32_t force_leg;          ///< 0..5
    uint32_t displacement_ticks; ///< since a displacement was measured that is missing now; 0: none is
} hexload_lost_channels_t;

/// The last ticks of displacements and forces, of legs without velocity sensors.
typedef struct hexload_differentiator {
    hexload_leg_gate_t leg_gate; ///< last accepted sample of the sensors
    hexload_real_t displacement_m[HEXLOAD_DIFFERENTIATOR_TICKS][HEXLOAD_LEGS];
    hexload_real_t force_n[HEXLOAD_DIFFERENTIATOR_TICKS][HEXLOAD_LEGS];
    uint32_t stored; ///< consecutive ticks in it, at most all
    uint32_t next;   ///< place of the next one
    bool has_begun;  ///< a sample has come out
} hexload_differentiator_t;

/// A leg Jacobian taken apart, to solve J x = y. E are its left columns, M its right ones. Three legs, the
/// carriers (1), give the velocity once the rotation is known, and the other three (2) the rotation:
///     omega = S^-1 (y2 - K y1),  v = E1^-1 (y1 - M1 omega)  with  K = E2 E1^-1,  S = M2 - K M1
typedef struct hexload_leg_blocks {
    uint8_t leg[HEXLOAD_LEGS];       ///< the carriers, then the others
    hexload_real_t E1_inverse[3][3]; ///< 1
    hexload_real_t M1[3][3];         ///< m
    hexload_real_t K[3][3];          ///< 1
    hexload_real_t S_inverse[3][3];  ///< 1/m
} hexload_leg_blocks_t;

/// Constants of the geometry and the last pose, from which the next search starts.
typedef struct hexload_kinematics {
    hexload_real_t home_leg_m[HEXLOAD_LEGS][3];  ///< p0 + a_i - b_i
    hexload_real_t home_defect_m2[HEXLOAD_LEGS]; ///< its square minus L0_i^2: 0 on a symmetric machine
    hexload_real_t home_height_m;                ///< h0: with R = E the mean leg length is the mean L0_i
    hexload_real_t p_m[3];                       ///< of that pose, base axes
    hexload_real_t quaternion[4];                ///< of that pose, platform to base axes; real part first
    hexload_real_t displacement_m[HEXLOAD_LEGS]; ///< the legs of that pose
    hexload_leg_blocks_t jacobian;               ///< there
    bool is_lost;                                ///< no search starts from that pose any more
} hexload_kinematics_t;

/// Wrench of the legs on the platform, moment about O_A.
typedef struct hexload_wrench {
    hexload_real_t force_n[3];   ///< platform axes
    hexload_real_t moment_nm[3]; ///< platform axes
} hexload_wrench_t;

enum {
    HEXLOAD_NOISE_KINDS = 3,   ///< displacement, velocity, force
    HEXLOAD_NOISE_TURNS = 4,   ///< one in each tick, as its neighbours add little; force in two in a row
    HEXLOAD_NOISE_HISTORY = 3, ///< ticks before the present one
};

typedef struct hexload_noise_estimator {
    hexload_real_t last[HEXLOAD_NOISE_KINDS][HEXLOAD_NOISE_HISTORY][HEXLOAD_LEGS]; ///< m, m/s, N
    hexload_real_t difference[HEXLOAD_LEGS]; ///< third one of the last turn
    uint32_t oldest;                         ///< row of the last three ticks, which go round
    uint32_t history;                        ///< consecutive ticks in them
    uint32_t turn;                           ///< what is measured next
    uint32_t ticks;                          ///< measured so far, up to the time constant
    /// (measured / stated sigma)^2, by turns; 1 before anything was measured. Of forces by squares, and by
    /// what neighbours have in common, which is the same if the noise is white.
    hexload_real_t ratio[HEXLOAD_NOISE_TURNS];
} hexload_noise_estimator_t;

/// Sums over the blocks of a window, of one leg. Ways are over one block: by the displacement, and as the
/// integral of the velocity.
typedef struct hexload_plausibility_leg {
    hexload_real_t shown_m;     ///< of the ways by displacement
    hexload_real_t integral_m;  ///< of those by velocity
    hexload_real_t product_m2;  ///< of their products
    hexload_real_t integral_m2; ///< of the squares by velocity
} hexload_plausibility_leg_t;

/// More sums, of the one leg that is looked at more closely in this window.
typedef struct hexload_plausibility_look {
    hexload_real_t shown_m2;               ///< squares of its ways by displacement
    hexload_real_t cross_m2[HEXLOAD_LEGS]; ///< their products with the ways by each leg's velocity
    hexload_real_t change_m_s;             ///< sum of the changes of its velocity
    hexload_real_t change_m2_s2;           ///< of their squares
    hexload_real_t change_shown_m2_s;      ///< of their products with the ways by displacement
    hexload_real_t change_integral_m2_s;   ///< and with those by velocity
    hexload_real_t jump_m2_s2;             ///< of the squares of their own changes
    hexload_real_t last_change_m_s;        ///< in the block before
    hexload_real_t force_n;                ///< mean of its force
    hexload_real_t wrench[4];              ///< its part of the wrench
} hexload_plausibility_look_t;

typedef struct hexload_plausibility {
    hexload_real_t last_displacement_m[HEXLOAD_LEGS]; ///< of the sensors
    hexload_real_t last_force_n[HEXLOAD_LEGS];
    hexload_real_t begin_m[HEXLOAD_LEGS];    ///< displacements at the block's begin
    hexload_real_t begin_m_s[HEXLOAD_LEGS];  ///< velocities there
    hexload_real_t velocities[HEXLOAD_LEGS]; ///< their sums since, m/s
    hexload_plausibility_leg_t sum[HEXLOAD_LEGS];
    hexload_plausibility_look_t look;
    hexload_real_t wrench[4]; ///< means of F_x, F_y, M_z about O_A, F_z, base axes; N, N m
    /// Of O_A, m/s^2: its mean, and up to the window's end its velocity at first.
    hexload_real_t acceleration[3];
    hexload_real_t least_gain;    ///< of displacements against velocities, of the legs that move
    hexload_real_t largest_gain;  ///< likewise
    hexload_real_t largest_error; ///< of such a gain
    uint8_t run[HEXLOAD_LEGS];    ///< ticks for which the force has stood still
    uint8_t ticks;                ///< since the block's begin
    uint8_t blocks;               ///< in the window
    uint8_t stage;                ///< of the evaluation after the window's end; 0: a window is being filled
    uint8_t repeated;             ///< samples in the window that repeat the one before
    uint8_t stuck_force;          ///< leg whose force has while others changed; HEXLOAD_LEGS: none
    uint8_t turn;                 ///< leg that is looked at
    uint8_t round;                ///< leg whose turn came last without a reason
    uint8_t worst;                ///< leg of largest_error
    uint8_t moving;               ///< legs that have a gain
    uint8_t motion_cause;         ///< what the look has found; hexload_input_cause_t
    uint8_t force_cause;          ///< what the forces say
    uint8_t seen_cause;           ///< of the last windows
    uint8_t seen_leg;             ///< likewise
    uint8_t strikes;              ///< windows in a row that have said so
    uint8_t hold;                 ///< windows for which the fault stays
    bool has_moved;               ///< the leg that is looked at has, enough to tell
    bool could_show;              ///< and so that twice the least fault would have been seen
    bool has_begun;               ///< there is a block's begin
    bool has_forces;              ///< the block's have been taken
    hexload_input_fault_t fault;  ///< what is reported
} hexload_plausibility_t;

/// The stated mass of the load against what the legs carry; means of the last seconds.
typedef struct hexload_known_mass {
    hexload_real_t mass_kg;        ///< of platform and load, as stated
    hexload_real_t limit_n;        ///< what machine and sensors may be off by
    hexload_real_t lever_kg_m;     ///< mass_kg times the farthest place of the centre of mass
    hexload_real_t time_s;         ///< of the means so far
    hexload_real_t excess_n;       ///< the legs' force upwards beyond that of platform and stated load
    hexload_real_t turn_rad_s2[2]; ///< angular acceleration, base axes x and y
    hexload_real_t square_rad2_s2; ///< of the angular velocity
    hexload_real_t weight_error;   ///< share by which the weight is not that of the masses, where it counts
    hexload_real_t last_twist[6];  ///< v, omega of the last sample, base axes, m/s, rad/s
    bool has_last;                 ///< there is such a sample
    bool is_contradicted;          ///< the legs do not carry that mass
} hexload_known_mass_t;

enum {
    /// Ticks of the past from which the late channels of the oldest are made.
    HEXLOAD_RIG_HISTORY = HEXLOAD_RIG_DELAY_TICKS_MAX + 1,
    HEXLOAD_RIG_TWISTS = 5, ///< ticks over which an acceleration is the change of the twist
};

/// The last samples of the sensors, oldest overwritten first.
typedef struct hexload_rig_history {
    hexload_leg_sample_t past[HEXLOAD_RIG_HISTORY];
    uint32_t since_ticks; ///< periods from the last sample that came out to the last stored
    uint8_t stored;       ///< consecutive ticks in it, at most all
    uint8_t next;         ///< place of the next one
    bool has_begun;       ///< a sample has come out
} hexload_rig_history_t;

/// Where friction stands between its two directions, of each leg; -1..1.
typedef struct hexload_rig_slide {
    hexload_real_t share[HEXLOAD_LEGS];
} hexload_rig_slide_t;

/// Twists of the last ticks, for an acceleration.
typedef struct hexload_rig_twists {
    hexload_real_t past[HEXLOAD_RIG_TWISTS][6];
    uint32_t stored; ///< consecutive ticks in it, at most all
    uint32_t next;
} hexload_rig_twists_t;

/// The filter's whitened innovations over half a second.
typedef struct hexload_residual_test {
    hexload_real_t sum[HEXLOAD_MEASUREMENTS_MAX]; ///< of the present block, in sigmas
    uint32_t ticks;                               ///< in the block
    hexload_real_t nis; ///< of the last whole block's sum; ideal, also when there was none: the dimension
    hexload_real_t nis_mean; ///< over some ten blocks, leaky
    hexload_real_t excess;   ///< of this load's blocks beyond what noise makes, summed; 0 or more
    hexload_real_t factor;   ///< by which the filter's sigma is too small for that
    uint8_t dimension;       ///< of an innovation
    bool has_begun;          ///< the first block is over, which does not count
} hexload_residual_test_t;

enum {
    HEXLOAD_PAPER_MEASUREMENTS = 3, ///< rates
    HEXLOAD_FORCE_HISTORY = 3,      ///< ticks of leg forces that tell their noise
};

/// What the filter needs of the machine, from the configuration.
typedef struct hexload_paper_constants {
    hexload_real_t mass_share;                        ///< m_l / m
    hexload_real_t reduced_mass_kg;                   ///< m_a m_l / m
    hexload_real_t com_offset_m[3];                   ///< m_a c_a / m: centre of mass of all when dz = 0
    hexload_real_t inertia_kg_m2[3];                  ///< share of D that is known: the platform's
    hexload_real_t prior_variance[HEXLOAD_PAPER_DIM]; ///< m^2; kg^2 m^4
    hexload_real_t platform_inertia_kg_m2[3];         ///< moments of the platform about O_A
    hexload_tolerances_t tolerances;                  ///< of the configuration
} hexload_paper_constants_t;

/// Variances of the noise in the Jacobian N that comes from the force sensors: of the derivatives by dz (rows
/// 0, 1), by the row's own inertia, and their covariance.
typedef struct hexload_jacobian_noise {
    hexload_real_t dz[2];      ///< 1/(m s)^2
    hexload_real_t mixed[2];   ///< 1/(kg m^3 s^2)
    hexload_real_t inertia[3]; ///< 1/(kg m^2 s)^2
} hexload_jacobian_noise_t;

/// State and covariance P = [rate_cov, cross_cov; cross_cov^T, param_cov], of rad/s and of the parameters'
/// units, m and kg m^2; of both squares the lower triangle counts.
typedef struct hexload_paper_filter {
    hexload_paper_constants_t constants;
    hexload_real_t rate_rad_s[3];            ///< omega, platform axes
    hexload_real_t param[HEXLOAD_PAPER_DIM]; ///< dz, Ixx, Iyy, Izz
    hexload_real_t dz_rest_m;                ///< of dz, too small to be added to it
    hexload_real_t rate_cov[3][3];
    hexload_real_t cross_cov[3][HEXLOAD_PAPER_DIM];
    hexload_real_t param_cov[HEXLOAD_PAPER_DIM][HEXLOAD_PAPER_DIM];
    hexload_jacobian_noise_t jacobian_noise; ///< summed over the filter's memory, in cross_cov / param_cov
    hexload_wrench_t last_wrench;
    hexload_real_t last_force_n[HEXLOAD_FORCE_HISTORY][HEXLOAD_LEGS]; ///< newest first
    uint32_t history;                                                 ///< consecutive ticks in last_force_n
    uint32_t gated;     ///< innovations gated one after the other
    hexload_real_t nis; ///< of the last innovation, 3 degrees of freedom; 3 when there was none
} hexload_paper_filter_t;

enum { HEXLOAD_HUM_FREQUENCIES = 2 }; ///< of the mains: 50 Hz, 60 Hz

/// Spectrum of the paper's filter's whitened innovations over half a second, at the mains' frequencies in
/// turn.
typedef struct hexload_hum_test {
    hexload_real_t twice_cosine[HEXLOAD_HUM_FREQUENCIES]; ///< of the angle of one tick
    hexload_real_t factor;                                ///< that of the block's frequency
    hexload_real_t sum[HEXLOAD_PAPER_MEASUREMENTS]; ///< of Goertzel's recursion over the block, in sigmas
    hexload_real_t last_sum[HEXLOAD_PAPER_MEASUREMENTS]; ///< of the tick before
    hexload_real_t excess[HEXLOAD_HUM_FREQUENCIES];      ///< of the blocks beyond what noise makes, summed
    hexload_real_t energy; ///< of both, where it is more than chance: that of the hum in sigmas squared
    uint32_t block_ticks;  ///< of a block
    uint32_t ticks;        ///< in the block
    uint8_t next;          ///< frequency of the block
    bool is_heard;         ///< the sampling is fast enough, and innovations are white
    bool has_begun;        ///< the first block is over, which does not count
    bool hums;             ///< there is such energy
} hexload_hum_test_t;

typedef struct hexload_paper_supervisor {
    hexload_real_t nis_mean; ///< leaky mean; starts at its ideal, 3
    hexload_real_t factor;   ///< by which the filter's sigma is too small for its innovations; 1 or more
    hexload_real_t kept[HEXLOAD_PAPER_DIM];       ///< the same for what misfits may have left in a parameter
    hexload_real_t last_sigma[HEXLOAD_PAPER_DIM]; ///< the filter's, of the tick before, if `has_kept`
    bool has_kept;                                ///< there has been a misfit
} hexload_paper_supervisor_t;

/// Sizes of the smoother's rings. HEXLOAD_LAG_TICKS_MAX, the longest lag they have room for, is an option of
/// the build: hexload/options.h.
enum {
    HEXLOAD_MISSING_TICKS_MAX = 10, ///< that may wait; where more would, the oldest are left out
    HEXLOAD_TRANSIENT_TICKS = 12,   ///< on each side of a tick that show what is too fast for the window
    HEXLOAD_SMOOTHER_ORDERS = 6,    ///< sums that a window of degree five needs
    HEXLOAD_WINDOW_CAPACITY = 2 * HEXLOAD_LAG_TICKS_MAX + 1 + HEXLOAD_MISSING_TICKS_MAX,
    HEXLOAD_DELAY_CAPACITY = HEXLOAD_LAG_TICKS_MAX + 1 + HEXLOAD_TRANSIENT_TICKS + HEXLOAD_MISSING_TICKS_MAX,
    HEXLOAD_FORCE_NEIGHBOURS = 2, ///< ticks on each side of one that its impulse takes the forces of
    HEXLOAD_FORCE_CAPACITY = HEXLOAD_LAG_TICKS_MAX + 1 + HEXLOAD_FORCE_NEIGHBOURS + HEXLOAD_MISSING_TICKS_MAX,
};

enum { HEXLOAD_TRIANGLE_6 = 21 }; ///< numbers of a symmetric matrix of six, its lower triangle by rows

/// What the lag makes of the polynomials.
typedef struct hexload_smoother_constants {
    uint32_t lag_ticks;                        ///< from the window's middle to its newest tick
    int32_t entering[HEXLOAD_SMOOTHER_ORDERS]; ///< weights of the window's newest tick in the sums
    int32_t leaving[HEXLOAD_SMOOTHER_ORDERS];  ///< of its oldest
    hexload_real_t project[3];                 ///< of the third on p1; of the fifth on p1 and p3
    hexload_real_t slope[3];                   ///< from a sum in steps to c_m in m/s
    /// 1 / variance of c_m, in m^2/s^2, for a variance of 1 m^2 of displacements
    hexload_real_t inverse_gain[3];
    hexload_real_t slope_gain;   ///< variance of c1 + c3 + c5 likewise
    hexload_real_t rate_gain[3]; ///< of angular velocity about x, y, z at home, of 1 m^2/s^2 of leg speeds
} hexload_smoother_constants_t;

/// Mean square of a motion's speeds over the legs, in variances of their noise.
typedef struct hexload_motion_directions {
    hexload_real_t spread[HEXLOAD_TRIANGLE_6];      ///< A
    hexload_real_t factor[HEXLOAD_TRIANGLE_6];      ///< of A / kappa + E; diagonal inverted
    hexload_real_t next_factor[HEXLOAD_TRIANGLE_6]; ///< a row at a tick
    uint32_t slopes;                                ///< in the mean
    uint32_t turn;                                  ///< ticks since the last slope
} hexload_motion_directions_t;

typedef struct hexload_smoother {
    hexload_smoother_constants_t constants; ///< of the configured lag
    /// of weights times steps over the window, modulo 2^64
    uint64_t sum[HEXLOAD_LEGS][HEXLOAD_SMOOTHER_ORDERS];
    int32_t steps[HEXLOAD_WINDOW_CAPACITY][HEXLOAD_LEGS];              ///< displacements in whole steps
    hexload_real_t velocity_m_s[HEXLOAD_DELAY_CAPACITY][HEXLOAD_LEGS]; ///< measured
    hexload_real_t force_n[HEXLOAD_FORCE_CAPACITY][HEXLOAD_LEGS];      ///< measured
    /// A bit for each tick that is missing, and bridged; or of which a speed is contradicted by both
    /// neighbours.
    uint32_t left_out[(HEXLOAD_DELAY_CAPACITY + 31) / 32];
    uint32_t stored;            ///< ticks put in since the start; modulo the capacities the next one's place
    uint32_t entered;           ///< ticks that have entered the window
    uint32_t gap_ticks;         ///< from the last sample taken out to the middle of the window
    uint32_t middle_tick;       ///< of the window's middle
    uint32_t transient_ticks;   ///< with what is too fast for the window, less those without
    hexload_real_t noise_m2_s2; ///< variance of the noise in the speeds around the window's middle
    bool has_taken;             ///< a sample has been taken out since the start
    hexload_real_t held_m_s[HEXLOAD_LEGS]; ///< speeds of the last one, until the window is full
    hexload_motion_directions_t directions;
} hexload_smoother_t;

enum {
    HEXLOAD_MOMENTUM_MEASUREMENTS = 6,              ///< leg speeds, or momenta
    HEXLOAD_MOMENTUM_STATES = HEXLOAD_LOAD_DIM + 6, ///< theta, mu
};

/// What moves mu at one tick.
typedef struct hexload_momentum_input {
    hexload_real_t wrench[6]; ///< [F N; N + p x F N m], base axes
    hexload_real_t arm[2][4]; ///< p_x, R's first row; p_y, R's second row: G without gravity
} hexload_momentum_input_t;

/// What of a motion may be none, platform axes: the smooth angular velocity against the velocity sensors',
/// and the smooth twist against what legs make of it that are sampled at other instants.
typedef struct hexload_attenuation {
    hexload_real_t slow_rad_s[3]; ///< mean of late of the smooth angular velocity
    hexload_real_t error[3];      ///< sums of what is faster times what it is off by, in variances of noise
    hexload_real_t square[3];     ///< sums of its squares, likewise
    /// Sums of squares of the angular velocity about x, y, z, and of the velocity along x and y; rad^2/s^2,
    /// m^2/s^2
    hexload_real_t moved[4];
    hexload_real_t late[4]; ///< what of them legs at other instants may have made
    uint32_t calls;         ///< of three rounds
} hexload_attenuation_t;

typedef struct hexload_momentum_filter {
    hexload_real_t platform[HEXLOAD_LOAD_DIM];                   ///< theta_platform; kg, kg m, kg m^2
    hexload_tolerances_t tolerances;                             ///< of the configuration
    hexload_real_t theta[HEXLOAD_LOAD_DIM];                      ///< of the load; kg, kg m, kg m^2
    hexload_real_t theta_excess[HEXLOAD_LOAD_DIM];               ///< what rounding has added to theta so far
    hexload_real_t momentum[6];                                  ///< mu, N s and N m s
    hexload_real_t load_cov[HEXLOAD_LOAD_DIM][HEXLOAD_LOAD_DIM]; ///< of theta
    hexload_real_t cross_cov[6][HEXLOAD_LOAD_DIM];               ///< of mu with theta
    hexload_real_t momentum_cov[6][6];                           ///< of mu; the lower triangle counts
    hexload_momentum_input_t last_input;
    hexload_real_t smooth_twist[6]; ///< of the last sample, base axes, m/s, rad/s
    hexload_real_t rate_square[3];  ///< mean of late of the smooth angular velocity, platform axes; rad^2/s^2
    hexload_attenuation_t attenuation;
    hexload_real_t nis; ///< of the last sample, 6 degrees of freedom; 6 when there was none
} hexload_momentum_filter_t;

typedef struct hexload_consider {
    hexload_real_t load[HEXLOAD_RIG_DIRECTIONS_MAX][HEXLOAD_LOAD_DIM]; ///< T, rows of theta
    hexload_real_t momentum[HEXLOAD_RIG_DIRECTIONS_MAX][6];            ///< T, rows of mu
    /// Error of mu' beside that of theta; one direction in each tick, as forces change little in so many.
    hexload_real_t drive[HEXLOAD_RIG_DIRECTIONS_MAX][6];
    /// Innovations in sigmas that a unit of each makes, summed: of a half second less those of one before.
    hexload_real_t shown[HEXLOAD_RIG_DIRECTIONS_MAX][6];
    uint8_t next;   ///< direction whose drive is looked at next
    bool is_paused; ///< innovations lie between those half seconds
} hexload_consider_t;

enum { HEXLOAD_OSCILLATION_LAGS = 2 }; ///< half a second from one half second to another, and a whole one

/// Whether innovations swing within a second or two, which the constants of a rig do not make them do.
typedef struct hexload_oscillation_test {
    hexload_real_t first[6]; ///< sum over the first half second of a pair, in sigmas
    /// What the two differ by beyond noise and constants: squares, leaky sum.
    hexload_real_t swinging[HEXLOAD_OSCILLATION_LAGS];
    hexload_real_t lasting[HEXLOAD_OSCILLATION_LAGS]; ///< what they have together, noise too: the same
    uint8_t pairs[HEXLOAD_OSCILLATION_LAGS];          ///< of this load, or enough
    uint8_t step;                                     ///< half second of a round that is under way
    bool is_there;                                    ///< they swing
} hexload_oscillation_test_t;

enum {
    HEXLOAD_JACKKNIFE_BLOCKS = 16,
    // Stages of a round.
    HEXLOAD_JACKKNIFE_WAIT = 0, ///< for the end of a block, and then the snapshot
    HEXLOAD_JACKKNIFE_PREPARE,
    HEXLOAD_JACKKNIFE_INVERT,
    HEXLOAD_JACKKNIFE_PULL,
    HEXLOAD_JACKKNIFE_CLOSE,
    HEXLOAD_JACKKNIFE_MOVE,
    HEXLOAD_JACKKNIFE_COMPARE,
    HEXLOAD_JACKKNIFE_CONCLUDE,
    HEXLOAD_JACKKNIFE_JOIN,
};

/// What one block of time has said of theta.
typedef struct hexload_jackknife_block {
    hexload_real_t information[HEXLOAD_LOAD_COVARIANCES]; ///< J, what P_tt^-1 has grown by
    hexload_real_t pull[HEXLOAD_LOAD_DIM];                ///< s = J (theta by it alone - theta of now)
} hexload_jackknife_block_t;

typedef struct hexload_jackknife {
    hexload_jackknife_block_t block[HEXLOAD_JACKKNIFE_BLOCKS];
    hexload_real_t information[HEXLOAD_LOAD_COVARIANCES]; ///< P_tt^-1 at the end of the last block
    hexload_real_t covariance[HEXLOAD_LOAD_COVARIANCES];  ///< P_tt there
    hexload_real_t work[HEXLOAD_LOAD_COVARIANCES];        ///< on its way to minus its inverse
    hexload_real_t theta[HEXLOAD_LOAD_DIM];               ///< there
    hexload_real_t change[HEXLOAD_LOAD_DIM];              ///< of theta in the last block
    hexload_real_t column[HEXLOAD_LOAD_DIM];              ///< that is worked with
    hexload_real_t pivot;                                 ///< inverse of its entry on the diagonal
    hexload_real_t
        spread[HEXLOAD_LOAD_DIM];           ///< squares of what blocks have moved theta by, in those of sigma
    hexload_real_t share[HEXLOAD_LOAD_DIM]; ///< of what is known, that the blocks have brought
    hexload_real_t square[HEXLOAD_LOAD_DIM];       ///< sum of the squares of the blocks' shares
    hexload_real_t last_share;                     ///< of the block before the one that is looked at
    hexload_real_t pair[HEXLOAD_JACKKNIFE_BLOCKS]; ///< largest share of a block and the next one together
    hexload_real_t factor[HEXLOAD_LOAD_DIM];       ///< by which sigma is too small; 1 or more
    hexload_real_t pooled;                         ///< square of that of all together; may be below 1
    uint32_t step;                                 ///< of the stage
    uint32_t elapsed_ticks;                        ///< since the last block's end
    uint8_t order[HEXLOAD_JACKKNIFE_BLOCKS];       ///< places of the blocks by age, then the free ones
    uint8_t blocks;
    uint8_t stage;
    bool has_begun;     ///< `information` is there
    bool has_concluded; ///< factors have been found since the start
} hexload_jackknife_t;

enum {
    HEXLOAD_WRENCH_PARTS = 3,   ///< of y
    HEXLOAD_WRENCH_SQUARES = 6, ///< of y y^T, the lower triangle by rows
    HEXLOAD_WRENCH_BINS = 4,    ///< of the 200 ms that do not count yet
};

typedef struct hexload_wrench_monitor {
    hexload_real_t last_momentum[6]; ///< of the last tick; N s, N m s
    hexload_real_t residual[6];      ///< r about O_A, base axes; its [2..4] are y; N, N m
    hexload_real_t lasting[6];       ///< leaky mean of r over 5 ms, of which a tick is mostly noise
    hexload_real_t open[HEXLOAD_WRENCH_SQUARES];        ///< what theta and slow legs leave open of y y^T
    hexload_real_t mean_square[HEXLOAD_WRENCH_SQUARES]; ///< C
    hexload_real_t bin[HEXLOAD_WRENCH_BINS][HEXLOAD_WRENCH_SQUARES]; ///< means of 50 ms each
    hexload_real_t filling[HEXLOAD_WRENCH_SQUARES];                  ///< the next bin, so far
    hexload_real_t filled_s;                                         ///< time in it
    hexload_real_t peak; ///< largest y^T (O + C)^-1 y of late; fades
    hexload_real_t filling_peak;
    hexload_real_t bin_peak[HEXLOAD_WRENCH_BINS];
    hexload_real_t motion_s;    ///< time that counts in C, up to its memory
    hexload_real_t last_square; ///< y^T (O + C)^-1 y of the last tick
    uint16_t ticks;             ///< since the last change, or many; 0: there is no last tick
    uint8_t bins;               ///< filled since the last change, at most all
    uint8_t next_bin;           ///< the oldest
} hexload_wrench_monitor_t;

typedef struct hexload_load_monitor {
    hexload_real_t momentum[6];             ///< mu of the present; N s, N m s
    hexload_real_t covariance[6][6];        ///< the lower triangle counts
    hexload_real_t theta[HEXLOAD_LOAD_DIM]; ///< that of the last tick
    hexload_momentum_input_t last_input;
    hexload_real_t last_force_n[2][HEXLOAD_LEGS]; ///< newest first
    hexload_real_t late_twist[6];                 ///< leaky mean of the last 5 ms, m/s, rad/s
    hexload_real_t acceleration[6];               ///< of the tick before, less gravity's, m/s^2, rad/s^2
    hexload_real_t unknown[6][6]; ///< covariance of the wrench that theta's errors make of it, leaky mean
    hexload_real_t nis;           ///< of the last sample, bounded; 6 when there was none
    hexload_real_t nis_mean;      ///< leaky; ideal 6
    hexload_real_t risen_s;       ///< for which that has been above what noise makes it
    hexload_real_t drift[6];      ///< leaky mean of the last 5 ms' innovations in sigmas, by direction
    hexload_real_t drift_nis;     ///< and of their NIS
    uint32_t ticks;               ///< since the start, up to those that it takes to settle
    hexload_wrench_monitor_t wrench;
    hexload_rig_slide_t slide; ///< by the speeds of the velocity sensors
} hexload_load_monitor_t;

/// Sensors that may have stopped.
typedef struct hexload_frozen_channels {
    hexload_leg_sample_t last;
    hexload_real_t missed_m[HEXLOAD_LEGS];      ///< way by velocity that the displacement lacks
    uint8_t still_velocity_ticks[HEXLOAD_LEGS]; ///< for which it has, or many
    uint8_t still_force_ticks[HEXLOAD_LEGS];    ///< likewise
    uint8_t still_ticks;                        ///< of the one that has longest, while three others change
    bool was_still;                             ///< all velocities, at the tick before
    uint8_t held;                               ///< how often they all have changed after that, of late
    hexload_real_t left_s;                      ///< for which one that goes on again still counts
} hexload_frozen_channels_t;

typedef struct hexload_momentum_supervisor {
    uint16_t fit_ticks;      ///< in fit_nis, since the start; UINT16_MAX: that many or more
    uint8_t elapsed_ticks;   ///< since last_twist
    uint8_t next;            ///< parameter whose information is looked at: one in each tick
    hexload_real_t nis_mean; ///< of the load monitor, leaky; starts at its ideal, 6
    /// Of the filter, each tick bounded, leaky over a second, also over changes of the load; ideal 6.
    hexload_real_t fit_nis;
    hexload_real_t unfit_s; ///< for so long the machine still counts as one that is not its model
    hexload_real_t wrong_s; ///< for so long what the load monitor has seen may still reach the filter
    hexload_real_t calm_s;  ///< since the last load change, or long enough
    hexload_real_t doubt;   ///< by which sigma is too small for theta to be that of a body; 1 or more
    hexload_real_t moved_s; ///< motion of this load that has been seen, or long enough; below 0: as believed
                            ///< as the last one
    /// Information per tick that the motion gives on each parameter if the others were known, 1 / its unit
    /// squared: leaky mean over excitation_time_constant_s.
    hexload_real_t information[HEXLOAD_LOAD_DIM];
    hexload_real_t acceleration[6]; ///< base axes, of O_A, over ten ticks, m/s^2, rad/s^2
    hexload_real_t last_twist[6];   ///< at their end, m/s, rad/s
    /// By which a sigma is too small for what misfits have left in its parameter; 1 or more. attenuation.h
    /// raises those of inertias and of hz too.
    hexload_real_t kept[HEXLOAD_LOAD_DIM];
    hexload_real_t last_variance[HEXLOAD_LOAD_DIM]; ///< the filter's, when that was looked at last
} hexload_momentum_supervisor_t;

enum {
    /// Rows of the effects in a lower triangle by rows that begins with the momentum filter's states.
    HEXLOAD_EFFECTS_COVARIANCES = +HEXLOAD_EFFECTS_DIM * +HEXLOAD_MOMENTUM_STATES +
                                  +HEXLOAD_EFFECTS_DIM * (+HEXLOAD_EFFECTS_DIM + 1) / 2,
};

/// How the legs push, what their friction goes with and what a tilt pulls at.
typedef struct hexload_rub {
    hexload_real_t push[HEXLOAD_LEGS][6];   ///< Jw, leg by leg, 1 and m
    hexload_real_t sign[HEXLOAD_LEGS];      ///< s(v), 1
    hexload_real_t speed_m_s[HEXLOAD_LEGS]; ///< v, smooth
    hexload_real_t lever[4];                ///< of platform and load: m, kg; m p + R h, kg m
} hexload_rub_t;

/// By how much forces have changed. Squares are in variances of the force sensors, less what noise makes of
/// them.
typedef struct hexload_gain_errors {
    hexload_real_t mean_n[HEXLOAD_LEGS]; ///< of all ticks, with loads before; beyond 2^18 of the latest
    hexload_real_t ticks;                ///< in the mean, 2^18 at most
    hexload_real_t square;               ///< sum of squares of what differs from it, of this load's ticks
    hexload_real_t load_ticks;           ///< of this load
    hexload_real_t square_before;        ///< mean one of a tick of the loads before
} hexload_gain_errors_t;

/// Twenty states that go with those of a momentum filter.
typedef struct hexload_actuator_effects {
    hexload_real_t effect[HEXLOAD_EFFECTS_DIM];             ///< x: N, N, N s/m, m/s^2
    hexload_real_t covariance[HEXLOAD_EFFECTS_COVARIANCES]; ///< the momentum filter's covariance goes on here
    hexload_rub_t last;                                     ///< at the last sample
    /// T, rows of x: what constants of the rig that are no states do to them, by direction of config->rig.
    hexload_real_t considered[HEXLOAD_RIG_DIRECTIONS_MAX][HEXLOAD_EFFECTS_DIM];
    /// Residual of the smooth leg speeds beyond the velocity sensors' noise: leaky mean square.
    hexload_real_t residual_m2_s2;
    uint32_t ticks;            ///< that it goes back
    uint32_t rest_ticks;       ///< how long no motion has stood out of the smoother's noise
    uint32_t held_ticks;       ///< for which no sample changes the effects
    uint32_t compared;         ///< x that is held against its prior next
    uint32_t counted;          ///< of those before it in this round, that have one
    hexload_real_t squares;    ///< of these, what they are off in units of what is open of them
    hexload_real_t dispersion; ///< mean of the squares of the last round; 1 at least
    hexload_gain_errors_t gains;
} hexload_actuator_effects_t;

typedef struct hexload_identifiability {
    hexload_real_t effects[HEXLOAD_EFFECTS_DIM * (HEXLOAD_EFFECTS_DIM + 1) / 2]; ///< P_ee, lower triangle
    hexload_real_t cross[HEXLOAD_LOAD_DIM][HEXLOAD_EFFECTS_DIM];                 ///< P_te
    hexload_real_t variance[HEXLOAD_LOAD_DIM];       ///< of theta, nothing given; then all
    hexload_real_t least_pivot[HEXLOAD_EFFECTS_DIM]; ///< below, what is left of P_ee is rounding
    uint32_t next;    ///< effect to eliminate, then HEXLOAD_EFFECTS_DIM + parameter; beyond these: copy first
    uint32_t open[3]; ///< masks of the round so far, in the order of those below
    uint32_t bias_mask;     ///< bit k: the biases are confounded with parameter k, as of the last round
    uint32_t friction_mask; ///< bit k: friction is
    uint32_t tilt_mask;     ///< bit k: tilt is
    hexload_real_t fastest_leg_m_s; ///< fades over excitation_time_constant_s
} hexload_identifiability_t;

/// The stage for actuator effects.
typedef struct hexload_effects_stage {
    hexload_actuator_effects_t filter;         ///< biases, friction and tilt
    hexload_identifiability_t identifiability; ///< which load parameters are confounded with them
} hexload_effects_stage_t;

HEXLOAD_DECLS_END

#endif
