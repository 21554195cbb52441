/// @file types.h
/// The floating-point type, what a call returns (status), and what it reports although it ran (health).
#ifndef HEXLOAD_TYPES_H
#define HEXLOAD_TYPES_H

#include <stdint.h>

#ifdef __cplusplus
#define HEXLOAD_DECLS_BEGIN extern "C" {
#define HEXLOAD_DECLS_END }
#else
#define HEXLOAD_DECLS_BEGIN
#define HEXLOAD_DECLS_END
#endif

#if defined(__GNUC__)
#define HEXLOAD_MUST_USE __attribute__((warn_unused_result))
#define HEXLOAD_NONNULL __attribute__((nonnull)) ///< no pointer may be NULL
#else
#define HEXLOAD_MUST_USE
#define HEXLOAD_NONNULL
#endif

/// The one floating-point type. A controller's build is single precision throughout; one with
/// HEXLOAD_REFERENCE_DOUBLE is the double-precision reference that the tests compare with, and differs in
/// nothing else. HEXLOAD_REAL(0.1) is a literal in that precision, never a double in single.
#ifdef HEXLOAD_REFERENCE_DOUBLE
typedef double hexload_real_t;
#define HEXLOAD_REAL(literal) literal
#else
typedef float hexload_real_t;
#define HEXLOAD_REAL(literal) literal##f
#endif

HEXLOAD_DECLS_BEGIN

/// Result of a call. Zero: done. Negative: refused; the estimate is what it was before, and health counts it.
typedef enum hexload_status {
    HEXLOAD_OK = 0,            ///< done
    HEXLOAD_ERR_CONFIG = -1,   ///< hexload_config_check() names the field
    HEXLOAD_ERR_SAMPLE = -2,   ///< a channel is beyond its range, or not finite and not to be bridged,
                               ///< or a leg would have no length
    HEXLOAD_ERR_TICK = -3,     ///< the tick is not later than the last accepted one
    HEXLOAD_ERR_POSE = -4,     ///< forward kinematics found no pose for these displacements
    HEXLOAD_ERR_SINGULAR = -5, ///< the leg Jacobian cannot be inverted in this pose
} hexload_status_t;

/// Health bits of one tick: the tick ran, but ... Each bit has a counter in hexload_health_t.
typedef enum hexload_health_bit {
    HEXLOAD_HEALTH_LEG_OUT_OF_STROKE = 0, ///< a displacement is outside the configured stroke
    HEXLOAD_HEALTH_SAMPLE_MISSING = 1,    ///< ticks are missing before this one
    HEXLOAD_HEALTH_RATE_RESEEDED = 2, ///< rates restart from the sensors: long gap, or they no longer fitted
    HEXLOAD_HEALTH_MEASUREMENT_GATED = 3,  ///< the innovation is beyond the gate and was not used
    HEXLOAD_HEALTH_INERTIA_BOUNDED = 4,    ///< an inertia below zero was set to zero
    HEXLOAD_HEALTH_COVARIANCE_BOUNDED = 5, ///< a variance was held at its floor or at its prior
    HEXLOAD_HEALTH_NOT_EXCITED = 6,        ///< the motion does not lower a parameter's sigma, or hardly
    HEXLOAD_HEALTH_INCONSISTENT = 7, ///< innovations or inertias contradict the model or the stated sigmas
    HEXLOAD_HEALTH_FILTER_RESTARTED = 8, ///< a number was no longer finite, or samples had
                                         ///< come again: the filter began anew
    HEXLOAD_HEALTH_NOISE_BOUNDED =
        9, ///< removal of the force noise's effects was held: a spike, or sigmas too small
    HEXLOAD_HEALTH_LOAD_CHANGED = 10, ///< load change detected: identification begins anew
    HEXLOAD_HEALTH_NOISE_MISSTATED =
        11, ///< the sensors' noise is not the stated one; measured sigmas are used
    HEXLOAD_HEALTH_MODEL_MISFIT =
        12, ///< the machine does not fit its model: commission it, whatever the load; verdict "misfit"
    HEXLOAD_HEALTH_INPUT_IMPLAUSIBLE = 13, ///< channels contradict each other: hexload_health_t::input says
                                           ///< which, and no verdict is better than "misfit"
    HEXLOAD_HEALTH_CHANNEL_LOST =
        14, ///< a force or a displacement of one leg is missing, and bridged: sigmas grow
    HEXLOAD_HEALTH_FRAMES_REFUSED =
        15, ///< of the application: of late, frames were refused that look like the source's
    HEXLOAD_HEALTH_BITS = 16
} hexload_health_bit_t;

/// What is wrong with the channels of the samples. Codes of the bus, too.
typedef enum hexload_input_cause {
    HEXLOAD_INPUT_PLAUSIBLE = 0,          ///< nothing is, as far as channels can tell of each other
    HEXLOAD_INPUT_VELOCITY_SIGN = 1,      ///< velocity is minus the displacement's derivative
    HEXLOAD_INPUT_VELOCITY_GAIN = 2,      ///< it is that derivative times a factor
    HEXLOAD_INPUT_VELOCITY_LAG = 3,       ///< it is that of another time
    HEXLOAD_INPUT_VELOCITY_SWAPPED = 4,   ///< it is that of another leg
    HEXLOAD_INPUT_VELOCITY_STUCK = 5,     ///< it does not move while the displacement does
    HEXLOAD_INPUT_DISPLACEMENT_STUCK = 6, ///< the other way round
    HEXLOAD_INPUT_VELOCITY_OTHER = 7,     ///< velocity and displacement have another contradiction
    HEXLOAD_INPUT_CLOCK = 8,              ///< all velocities are the derivatives times one factor
    HEXLOAD_INPUT_ROWS_REPEATED = 9,      ///< samples repeat those before while the machine moves
    HEXLOAD_INPUT_FORCE_STUCK = 10,       ///< force stands still while others change
    HEXLOAD_INPUT_FORCES_NEGATED = 11,    ///< all legs together pull the platform down
    HEXLOAD_INPUT_FORCES_LIGHT = 12,      ///< they carry less than the empty platform
    HEXLOAD_INPUT_FORCE_SIGN = 13,        ///< with the other sign of one force the legs balance the weight
    HEXLOAD_INPUT_FORCE_DEAD = 14,        ///< a force is next to none, and without it they do not
    HEXLOAD_INPUT_KNOWN_MASS = 15,        ///< the legs do not carry what the stated mass of the load weighs
    HEXLOAD_INPUT_FORCES_QUIET = 16,      ///< all have a small share of the stated noise, as in another unit
    HEXLOAD_INPUT_CAUSES = 17             ///< how many there are
} hexload_input_cause_t;

/// The input fault. It stays until windows of 512 ticks that could have shown it have not, ten in a row; of a
/// known mass, until the legs carry it in the mean of two seconds.
typedef struct hexload_input_fault {
    hexload_input_cause_t cause; ///< while the health bit is not set: plausible
    uint32_t leg;                ///< 0..5, of a swap one of the two; 6: all legs, or none in particular
    hexload_real_t excess_n;     ///< KNOWN_MASS: carried beyond platform and stated load; else 0
} hexload_input_fault_t;

/// Health of the last accepted tick and how often each bit was set since the start. Counters saturate.
typedef struct {                         // no tag: hexload_health() has the name
    uint32_t bits;                       ///< bit n is hexload_health_bit_t n
    uint32_t count[HEXLOAD_HEALTH_BITS]; ///< ticks with that bit
    uint32_t refused;                    ///< samples refused with a negative status
    hexload_input_fault_t input;         ///< what INPUT_IMPLAUSIBLE means
} hexload_health_t;

/// Short name of a status for messages, e.g. "pose not found". Never NULL; static storage.
const char* hexload_status_name(hexload_status_t status);

/// Short name of a health bit for messages, e.g. "measurement gated". Never NULL; static storage.
const char* hexload_health_name(hexload_health_bit_t bit);

/// What is wrong, and what to do, in words without the leg: e.g. "velocity has the opposite sign of the
/// displacement's derivative: check ...". Never NULL; static storage.
const char* hexload_input_fault_text(hexload_input_cause_t cause);

HEXLOAD_DECLS_END

#endif
