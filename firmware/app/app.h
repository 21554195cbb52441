/// @file app.h
/// The controller application: when the estimator runs, what commands do, what counts as a fault.
///
///             START                first sample            verdict converged
///     IDLE ----------> ARMED -----------------> ESTIMATING <-----------------> CONVERGED
///       ^                |                          |           any other         |
///       +---- STOP ------+--------------------------+-----------------------------+
///       +---- RESET ---- FAULT <---- time-out, estimator refuses, wrong profile, second controller, bus down
///
/// It holds one estimator of any kind: the configuration's, until SELECT_FILTER chooses another. No frames
/// and no I/O here: node.h connects it to a bus, a port may also call it directly.
#ifndef HEXLOAD_APP_APP_H
#define HEXLOAD_APP_APP_H

#include "bus/bus.h"

HEXLOAD_DECLS_BEGIN

typedef enum hexload_app_state {
    HEXLOAD_APP_IDLE = 0,
    HEXLOAD_APP_ARMED = 1,
    HEXLOAD_APP_ESTIMATING = 2,
    HEXLOAD_APP_CONVERGED = 3,
    HEXLOAD_APP_FAULT = 4,
} hexload_app_state_t;

/// Why the application is in FAULT; RESET clears it.
typedef enum hexload_app_fault {
    HEXLOAD_FAULT_NONE = 0,
    HEXLOAD_FAULT_SAMPLE_TIMEOUT = 1,    ///< the source of samples fell silent; ARMED waits without limit
    HEXLOAD_FAULT_SAMPLES_REFUSED = 2,   ///< by the estimator, refused_limit in a row
    HEXLOAD_FAULT_WRONG_PROFILE = 3,     ///< samples of the other profile are on the bus
    HEXLOAD_FAULT_SECOND_CONTROLLER = 4, ///< another node sends a controller's frames
    HEXLOAD_FAULT_BUS_DOWN = 5,          ///< the port cannot send or receive
    HEXLOAD_FAULT_SECOND_SOURCE = 6,     ///< samples come from two sources, or of one that began anew without
                                         ///< START: doubled with other numbers, or late
    HEXLOAD_FAULT_NOT_AUTHENTICATED = 7, ///< samples lack the key's code, which START has promised
} hexload_app_fault_t;

enum {
    /// Ticks that a sample may be ahead of the last one. One that is farther is refused, and counts as none
    /// of the source's: that goes on where it was, or falls silent. When it has been silent for half the
    /// time that is a fault, and so many have followed one another there, it has gone on, and the estimator
    /// with it; not when samples have codes. More than HEXLOAD_BUS_TICK_PERIOD, so that one false SampleTick
    /// is over before.
    HEXLOAD_APP_FARTHEST_JUMP = 1000,
    HEXLOAD_APP_JUMP_SAMPLES = 20,
};

typedef struct hexload_app_settings {
    uint32_t sample_timeout_ms;   ///< silence in real time after which ESTIMATING ends in FAULT; 5..60000
    uint32_t lockstep_timeout_ms; ///< the same in lockstep, where the source may be slow; 5..600000
    uint32_t refused_limit;       ///< samples refused or late in a row that end in FAULT; >= 1
} hexload_app_settings_t;

typedef struct hexload_app {
    hexload_config_t config;                       ///< a copy: commands change it
    hexload_paper_config_t configured_paper;       ///< as configured: RESET restores the known mass
    hexload_momentum_config_t configured_momentum; ///< likewise
    uint32_t configuration;                        ///< hexload_app_configuration() of config
    hexload_app_settings_t settings;
    hexload_t estimator;
    hexload_estimate_t estimate; ///< last
    hexload_app_state_t state;
    hexload_app_fault_t fault;
    hexload_pacing_t pacing;
    uint32_t silence_ms; ///< since the last sample that was not too far ahead
    uint32_t refused_in_a_row;
    uint32_t samples_missing; ///< ticks without a sample since START, saturating
    uint32_t last_tick;       ///< of the last accepted sample
    uint32_t jump_tick;       ///< of the last sample beyond HEXLOAD_APP_FARTHEST_JUMP
    uint16_t jump_samples;    ///< that have followed one another there, HEXLOAD_APP_JUMP_SAMPLES at most
    bool has_codes;           ///< samples have: none too far ahead is followed; set by node.h after START
    uint32_t change_tick;     ///< of the sample at which a load change was last detected
} hexload_app_t;

/// 100 ms, 10 s, 100 samples.
void hexload_app_settings_default(hexload_app_settings_t* settings);

/// Enters IDLE.
/// @return what the estimator's init says of config; HEXLOAD_ERR_CONFIG also for settings out of range. Then
///         self is unchanged.
HEXLOAD_MUST_USE hexload_status_t hexload_app_init(hexload_app_t* self, const hexload_config_t* config,
                                                   const hexload_app_settings_t* settings);

/// Carries out a command. START: from IDLE only, and only of a source that works with the same configuration
/// or does not say; begins with a fresh estimator. STOP: to IDLE from anywhere but FAULT; the last estimate
/// stays readable. RESET: to IDLE from anywhere, fresh estimator, and the known mass and the priors are those
/// of the configuration again. SELECT_FILTER, SET_KNOWN_MASS: in IDLE only. Another filter is a fresh one,
/// and the last estimate is forgotten; the one that is selected already goes on as it is. The mass is set for
/// every estimator (hexload_config_set_known_mass()), for the momentum estimators until they detect a load
/// change; one that hexload_config_check() refuses changes nothing. The safe prior goes with a new mass; a
/// prior of the paper's filter that was configured otherwise stays.
/// @param[out] acknowledge all but profile, which node.h knows.
void hexload_app_command(hexload_app_t* self, const hexload_bus_command_t* command,
                         hexload_bus_acknowledge_t* acknowledge);

/// One leg sample: runs the estimator's tick in ARMED, ESTIMATING and CONVERGED. In every state the answer is
/// filled in (with the last estimate), so that a source in lockstep hears why nothing moves. Worst case:
/// hexload_tick() of the kind.
/// @param[out] answer all but missing_legs, which node.h knows.
void hexload_app_sample(hexload_app_t* self, const hexload_leg_sample_t* sample,
                        hexload_bus_answer_t* answer);

/// Time passes: call it every millisecond, or with the milliseconds since the last call.
void hexload_app_elapse(hexload_app_t* self, uint32_t elapsed_ms);

/// ARMED, ESTIMATING or CONVERGED.
bool hexload_app_is_running(const hexload_app_t* self);

/// Whether the load change was detected at the last accepted sample, and this is its tick.
bool hexload_app_has_load_changed(const hexload_app_t* self, uint32_t tick);

/// Health of the estimator since START.
const hexload_health_t* hexload_app_health(const hexload_app_t* self);

/// Mass of the load that was stated, by the configuration or by SET_KNOWN_MASS, and is in force for the kind
/// that is selected; 0: none.
hexload_real_t hexload_app_known_mass_kg(const hexload_app_t* self);

/// CRC-32 over a configuration but for its kind: over all numbers from tick_s on, and the rig's directions
/// that count. As long as hexload_config_check(), not for the 1 ms path; reentrant.
uint32_t hexload_app_configuration(const hexload_config_t* config);

/// The caller found a reason to stop. The first fault stays until RESET.
void hexload_app_set_fault(hexload_app_t* self, hexload_app_fault_t fault);

const char* hexload_app_state_name(hexload_app_state_t state); ///< "idle" ...; never NULL, static storage
const char* hexload_app_fault_name(hexload_app_fault_t fault); ///< e.g. "no samples"; likewise

HEXLOAD_DECLS_END

#endif
