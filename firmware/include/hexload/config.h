/// @file config.h
/// Everything about the machine, its sensors and the tuning: a plain struct that may live in flash.
///
/// Frames and signs (all files): base B is fixed with z up, platform A moves with its origin O_A at the
/// control point. R takes platform axes to base axes. p is the displacement of O_A from its home position. A
/// leg is extended when its displacement is positive and pushes the platform away from the base when its
/// force is.
#ifndef HEXLOAD_CONFIG_H
#define HEXLOAD_CONFIG_H

#include "hexload/types.h"

HEXLOAD_DECLS_BEGIN

enum { HEXLOAD_LEGS = 6 };

/// Which estimator hexload_init() starts.
typedef enum hexload_kind { // codes of the bus, too
    /// The paper's: height of the centre of mass and three central inertias of a load whose mass is known.
    HEXLOAD_KIND_PAPER = 0,
    /// All ten parameters of the load, from any motion. The recommended one, and the default.
    HEXLOAD_KIND_MOMENTUM = 1,
    /// The same with what config->rig leaves of the machine's effects as unknowns: biases of the force
    /// sensors, friction of the legs, tilt of the base.
    HEXLOAD_KIND_MOMENTUM_EFFECTS = 2,
    HEXLOAD_KINDS ///< how many there are
} hexload_kind_t;

enum {
    HEXLOAD_RIG_DELAY_TICKS_MAX = 8, ///< ticks by which forces or velocities may be late
    HEXLOAD_RIG_DIRECTIONS_MAX = 8,  ///< of what commissioning leaves open
    /// Ticks on either side of the one whose speeds come from displacements.
    HEXLOAD_HALF_WINDOW_TICKS_MAX = 12,
};

/// Entries of an inertia tensor, in this order. Products are tensor entries: IXY = -integral of x y dm.
enum hexload_inertia {
    HEXLOAD_I_XX,
    HEXLOAD_I_YY,
    HEXLOAD_I_ZZ,
    HEXLOAD_I_XY,
    HEXLOAD_I_XZ,
    HEXLOAD_I_YZ,
    HEXLOAD_I_DIM
};

/// The hexapod's kinematics.
typedef struct hexload_geometry {
    hexload_real_t base_hinge_m[HEXLOAD_LEGS][3];     ///< b_i in base axes
    hexload_real_t platform_hinge_m[HEXLOAD_LEGS][3]; ///< a_i in platform axes
    hexload_real_t home_leg_length_m[HEXLOAD_LEGS];   ///< L0_i: length at displacement 0; > 0
    hexload_real_t stroke_min_m; ///< shortest displacement, finite; < stroke_max_m. Beyond: health bit only
    hexload_real_t stroke_max_m; ///< longest displacement, finite
} hexload_geometry_t;

/// The empty platform, without load.
typedef struct hexload_platform {
    hexload_real_t mass_kg;                      ///< m_a > 0
    hexload_real_t com_m[3];                     ///< centre of mass in platform axes
    hexload_real_t inertia_kg_m2[HEXLOAD_I_DIM]; ///< tensor about O_A in platform axes
} hexload_platform_t;

/// The legs' sensors. Sigmas are those of white noise at the tick rate; understating them makes every sigma
/// too small.
typedef struct hexload_sensors {
    hexload_real_t displacement_sigma_m; ///< 1e-10..0.1
    hexload_real_t velocity_sigma_m_s;   ///< 1e-8..1
    hexload_real_t force_sigma_n;        ///< 1e-6..1e5
    hexload_real_t
        velocity_range_m_s; ///< 0..50, not 0: a leg that is faster, or has moved faster, is a fault; refused
    hexload_real_t force_range_n; ///< 0..1e8, not 0: likewise; a little above what the legs can do
    /// 0: there are velocity sensors. Else 2..HEXLOAD_HALF_WINDOW_TICKS_MAX: there are none, and
    /// hexload_tick() finds the speeds of so many ticks ago from the displacements on both sides; the ticks
    /// of momentum.h and paper.h alone do not. hexload_config_set_no_velocity() sets it, and the sigma of
    /// such speeds.
    uint32_t half_window_ticks;
} hexload_sensors_t;

/// What no motion can tell from a load, so that only a sigma can say it: one standard deviation each, 0 for
/// exact. The filters add it to theirs (EQUATIONS.md, R14, R16). A machine whose empty run has been
/// commissioned or tared has less of it.
typedef struct hexload_tolerances {
    /// Of all force sensors alike, N/N; 0..1. An error of gravity or of the clock does no more than one of
    /// the same share here. Beside free biases each sensor counts as twice as uncertain (EQUATIONS.md, A9):
    /// not less than half of that of one, then.
    hexload_real_t force_gain;
    /// Of platform.mass_kg, with hoses and what of the legs hangs on it, kg/kg; 0..1.
    hexload_real_t platform_mass;
    hexload_real_t platform_com_m; ///< of each of platform.com_m; 0..1
    /// Of each moment of inertia, and of the mean one for each product, 1; 0..1. Mass at the rim of a disc
    /// counts twice in its inertia.
    hexload_real_t platform_inertia;
} hexload_tolerances_t;

/// Tuning of the paper's filter. Standard deviations, not variances.
typedef struct hexload_paper_config {
    /// m_l, known beforehand as in the paper; 0..1e6, not 0. hexload_config_set_prior() goes with it.
    hexload_real_t load_mass_kg;
    hexload_real_t prior_dz_sigma_m; ///< of the height of the load's centre of mass; 0..1e3, not 0
    /// Of Ixx, Iyy, Izz; 0..1e6, not 0. Too small for the load: slow and biased.
    hexload_real_t prior_inertia_sigma_kg_m2[3];
    hexload_real_t gate_nis; ///< innovations beyond are not used; 3..1e6. Larger: trusts spikes more
    /// Verdict "inconsistent" above this mean NIS, and where sigma needs more than the factor sqrt(NIS / 3)
    /// for the estimate to be possible; 3..1e6 (ideal: 3).
    hexload_real_t inconsistent_nis;
    hexload_real_t nis_time_constant_s;      ///< of that mean; tick_s..1e3
    hexload_real_t converged_relative_sigma; ///< "converged" below this part of value or prior sigma; 0..1
    uint32_t
        longest_gap_ticks; ///< from sample to sample that one trapezoid bridges; >= 1. Beyond: rates restart
    uint32_t longest_gate_ticks; ///< innovations gated one after the other; >= 1. Beyond: rates restart
} hexload_paper_config_t;

/// Tuning of the momentum filter.
typedef struct hexload_momentum_config {
    uint32_t lag_ticks;           ///< how far the filter runs behind; 12..HEXLOAD_LAG_TICKS_MAX
    uint32_t longest_gap_ticks;   ///< from sample to sample that the smoother bridges; 1..10. Beyond, or
                                  ///< with more than 10 missing within the lag: all anew
    hexload_real_t prior_mass_kg; ///< of the load; 0..1e6
    hexload_real_t prior_mass_sigma_kg;       ///< 0..1e6, not 0; small: the mass is known
    hexload_real_t prior_moment_sigma_kg_m;   ///< of hx, hy, hz; 0..1e6, not 0
    hexload_real_t prior_inertia_sigma_kg_m2; ///< of the tensor's entries; 0..1e8, not 0
    hexload_real_t inconsistent_nis;    ///< verdict "inconsistent" above this mean NIS; 6..1e6 (ideal: 6)
    hexload_real_t nis_time_constant_s; ///< of that mean; tick_s..1e3
    hexload_real_t converged_relative_sigma;   ///< "converged" below this part of the scale; 0..1
    hexload_real_t excitation_time_constant_s; ///< how far back the motion counts; tick_s..1e3
    hexload_real_t timing_s; ///< of each leg's instant of sampling, a standard deviation; 0..1. 0: exact
} hexload_momentum_config_t;

/// What the estimator of actuator effects knows beforehand of what config->rig has not taken off. Sigma 0:
/// nothing is left of that effect, and it is no unknown; config->rig.direction then tells how well it is
/// known.
typedef struct hexload_actuator_effects_config {
    hexload_real_t prior_bias_sigma_n;        ///< of each force sensor's offset; 0..1e6
    hexload_real_t prior_coulomb_sigma_n;     ///< of each leg's Coulomb friction; 0..1e6
    hexload_real_t prior_viscous_sigma_n_s_m; ///< of each leg's viscous friction; 0..1e8
    hexload_real_t prior_tilt_sigma_m_s2;     ///< of gravity's x and y; 0..30. 0.17 is a degree
    hexload_real_t friction_speed_m_s;        ///< v0 of v / sqrt(v^2 + v0^2): 71 % of Coulomb's; 1e-6..10
    /// Of ln v0, that the friction near zero speed is of another shape (breakaway, presliding); 0..10, 0:
    /// exact.
    hexload_real_t friction_shape;
    /// What of the legs hangs on the platform beyond tolerances.platform_mass, of platform.mass_kg, kg/kg;
    /// 0..1. Free effects take up the swing that tells of it, so it counts where they are free alone.
    hexload_real_t leg_share;
} hexload_actuator_effects_config_t;

/// One way in which the constants of the rig may all be off together, by one standard deviation: estimates
/// less truth. Ways are independent of each other.
typedef struct hexload_rig_direction {
    hexload_real_t force_offset_n[HEXLOAD_LEGS];  ///< N
    hexload_real_t force_gain[HEXLOAD_LEGS];      ///< N/N
    hexload_real_t coulomb_n[HEXLOAD_LEGS];       ///< N
    hexload_real_t stribeck_n[HEXLOAD_LEGS];      ///< N
    hexload_real_t growth_n_n[HEXLOAD_LEGS];      ///< N/N
    hexload_real_t viscous_n_s_m[HEXLOAD_LEGS];   ///< N s/m
    hexload_real_t gravity_m_s2[2];               ///< m/s^2: x and y of its vector, base axes
    hexload_real_t platform[4 + HEXLOAD_I_DIM];   ///< kg, kg m, kg m^2: order of enum hexload_load_parameter
    hexload_real_t base_hinge_m[HEXLOAD_LEGS][3]; ///< m, base axes
    hexload_real_t platform_hinge_m[HEXLOAD_LEGS][3]; ///< m, platform axes
} hexload_rig_direction_t;

/// What commissioning has found of the machine beyond geometry and platform: by how much each leg's sensor is
/// off the force on the platform. 0 everywhere: the machine is its model.
///
///     shown(t + force_delay) = (1 + gain) (force + friction(v)) + offset
///     friction(v) = (coulomb + stribeck exp(-(v / stribeck_speed)^2) + growth |force|) s + viscous v
///     s follows tanh(v / reversal_speed) over presliding: ds/dt = |v| / presliding (tanh(v / reversal_speed)
///     - s)
typedef struct hexload_rig_config {
    hexload_real_t force_offset_n[HEXLOAD_LEGS]; ///< N; -1e6..1e6
    hexload_real_t force_gain[HEXLOAD_LEGS];     ///< N/N, beyond 1; -0.5..0.5
    hexload_real_t coulomb_n[HEXLOAD_LEGS];      ///< N; 0..1e6
    hexload_real_t stribeck_n[HEXLOAD_LEGS];     ///< N, more at rest; -coulomb_n..1e6
    hexload_real_t growth_n_n[HEXLOAD_LEGS];     ///< N/N, more under the leg's force; 0..0.5
    hexload_real_t viscous_n_s_m[HEXLOAD_LEGS];  ///< N s/m; 0..1e8
    hexload_real_t stribeck_speed_m_s;           ///< m/s; 1e-6..10
    hexload_real_t reversal_speed_m_s;           ///< m/s, 76 % of dry friction; 1e-6..10
    hexload_real_t presliding_m; ///< m, motion over which friction turns after the speed; 0..0.01
    /// s, how late forces are after displacements, low-pass filter included: of second order with bandwidth
    /// f, sqrt(2) / (2 pi f). 0..HEXLOAD_RIG_DELAY_TICKS_MAX ticks; the estimate runs as far behind as the
    /// later of the two channels, rounded up to ticks.
    hexload_real_t force_delay_s;
    hexload_real_t velocity_delay_s; ///< s, the same of velocities
    /// Mass of the legs, all alike, beside what of it moves with the upper hinge, which counts as platform: B
    /// and C of the mass B / l^2 - C / l that resists at the hinge across a leg of length l, and D of the
    /// weight D g / l that tilts it.
    hexload_real_t leg_inertia_kg_m2; ///< kg m^2, B; -1e6..1e6
    hexload_real_t leg_slide_kg_m;    ///< kg m, C; -1e6..1e6
    hexload_real_t leg_tilt_kg_m;     ///< kg m, D; -1e6..1e6
    uint32_t direction_count;         ///< of direction; 0..HEXLOAD_RIG_DIRECTIONS_MAX
    hexload_rig_direction_t direction[HEXLOAD_RIG_DIRECTIONS_MAX]; ///< what of all this is still open
} hexload_rig_config_t;

typedef struct hexload_config {
    hexload_kind_t kind;                                ///< of the estimator that hexload_init() starts
    hexload_real_t tick_s;                              ///< sampling period; 1e-4..5e-3
    hexload_real_t gravity_m_s2;                        ///< downwards; 0..30
    hexload_geometry_t geometry;                        ///< hinges, leg lengths, stroke
    hexload_platform_t platform;                        ///< the empty platform
    hexload_sensors_t sensors;                          ///< sigmas and ranges of the legs' sensors
    hexload_tolerances_t tolerances;                    ///< what of machine and sensors no motion shows
    hexload_paper_config_t paper;                       ///< for HEXLOAD_KIND_PAPER alone
    hexload_momentum_config_t momentum;                 ///< for the two momentum kinds
    hexload_actuator_effects_config_t actuator_effects; ///< for HEXLOAD_KIND_MOMENTUM_EFFECTS alone
    hexload_rig_config_t rig; ///< what commissioning has found; zeros: the machine is its model
} hexload_config_t;

/// Start covariance of the paper's filter.
typedef enum hexload_prior {
    /// sigma 0.3162 m for dz and a radius of gyration of 0.2115 m for the inertias: at the paper's 500 kg
    /// P0 = diag(0.1, 500, 500, 500). The default.
    HEXLOAD_PRIOR_SAFE,
    /// The paper's P0 = diag(1, 1, 1, 1, 10, 500, 500): the true Ixx is then 7.9 sigma away at the start.
    HEXLOAD_PRIOR_PRINTED,
} hexload_prior_t;

/// Fills in the paper's machine (Table 1 with hinge half angles of 15 and 10 degrees), nominal sensors
/// (20 um, 1 mm/s, 5 N) and tolerances (0.5 % of force; 3 %, 2 mm and 6 % of the platform; 0.5 ms of
/// sampling), 1 ms, the paper's 500 kg and the safe prior. The one place where defaults stand.
void hexload_config_default(hexload_config_t* config);

/// Sets the four prior sigmas of config->paper for its load mass.
void hexload_config_set_prior(hexload_config_t* config, hexload_prior_t prior);

/// Sets lag_ticks and the prior sigmas of config->momentum for its sensors, tick, platform and hinges, and
/// the prior sigmas of config->actuator_effects for the platform's mass: 1 m/s^2 of it for a bias, 2 m/s^2
/// for Coulomb friction, 10 1/s for viscous friction, and none for tilt. A leg carries a sixth of platform
/// and load: 11 m/s^2 of the paper's.
///
/// The prior spans loads of a few times the platform's own mass within the hinge circle; nothing is known
/// about their place. The lag is the shortest at which the smooth twist's noise,
/// (sigma_d / tick_s) sqrt(12 / (2 lag + 1)^3), is below a thirty-second of the velocity sensor's, from
/// HEXLOAD_TRANSIENT_TICKS to HEXLOAD_LAG_TICKS_MAX; the default sensors would need 85.
void hexload_config_set_momentum(hexload_config_t* config);

/// The legs have no velocity sensors: sets half_window_ticks for 6 ms, 2 ticks or more, and
/// velocity_sigma_m_s for the speeds that it gives, from displacement_sigma_m and tick_s.
/// hexload_config_set_momentum() goes with it.
void hexload_config_set_no_velocity(hexload_config_t* config);

/// The load's mass is known: the paper's filter takes it as given, the momentum filter as its prior with a
/// sigma of a thousandth until a load change is detected, instead of the one of
/// hexload_config_set_momentum(). hexload_config_set_prior() goes with it.
void hexload_config_set_known_mass(hexload_config_t* config, hexload_real_t mass_kg);

/// Gravity as a vector in base axes, of a base that is not level: sets gravity_m_s2 to its length and turns
/// the base hinges into axes whose z points against it, in which all of the firmware works. No other result
/// depends on how those axes are turned about z; a vector straight down leaves every number as it is.
/// @return HEXLOAD_ERR_CONFIG when the vector is not finite or points up: config is then unchanged.
HEXLOAD_MUST_USE hexload_status_t hexload_config_set_gravity(hexload_config_t* config,
                                                             const hexload_real_t gravity_m_s2[3]);

/// Checks every field's range.
/// @param[out] bad_field name of the first field outside its range, e.g. "geometry.home_leg_length_m"; static
///             storage; NULL when all are well. May itself be NULL.
/// @return HEXLOAD_OK or HEXLOAD_ERR_CONFIG. Reentrant. Not for the 1 ms path.
HEXLOAD_MUST_USE hexload_status_t hexload_config_check(const hexload_config_t* config,
                                                       const char** bad_field);

HEXLOAD_DECLS_END

#endif
