/// Words of the input fault, in a file of their own: who has no one to tell them links none.
#include "hexload/types.h"

const char* hexload_input_fault_text(hexload_input_cause_t cause) {
    static const char* const TEXTS[HEXLOAD_INPUT_CAUSES] = {
        [HEXLOAD_INPUT_PLAUSIBLE] = "the channels do not contradict each other",
        [HEXLOAD_INPUT_VELOCITY_SIGN] = "velocity has the opposite sign of the displacement's derivative: "
                                        "check wiring and sign of its two sensors",
        [HEXLOAD_INPUT_VELOCITY_GAIN] = "velocity is the displacement's derivative times a factor: "
                                        "check scale, range and unit of its two sensors (m, m/s)",
        [HEXLOAD_INPUT_VELOCITY_LAG] = "velocity and displacement are not of the same instant: check their "
                                       "filters and sampling, or commission the delay",
        [HEXLOAD_INPUT_VELOCITY_SWAPPED] =
            "velocity is that of another leg's displacement: check whether "
            "its displacement or velocity sensor is swapped with another leg's",
        [HEXLOAD_INPUT_VELOCITY_STUCK] = "velocity hardly changes while the displacement does: check its "
                                         "velocity sensor and its unit (m/s)",
        [HEXLOAD_INPUT_DISPLACEMENT_STUCK] = "displacement hardly changes while the velocity says that it "
                                             "moves: check its displacement sensor and its unit (m)",
        [HEXLOAD_INPUT_VELOCITY_OTHER] = "velocity is not the displacement's derivative: check its two "
                                         "sensors for spikes, saturation and loose contacts",
        [HEXLOAD_INPUT_CLOCK] = "all velocities are the displacements' derivatives times one factor: check "
                                "the sampling period, and the unit of displacements and velocities (m, m/s)",
        [HEXLOAD_INPUT_ROWS_REPEATED] = "samples repeat those before while the machine moves: the source is "
                                        "slower than the sampling period, or holds its rows",
        [HEXLOAD_INPUT_FORCE_STUCK] = "force stands still while other legs' change: check its force sensor "
                                      "for saturation or a broken wire",
        [HEXLOAD_INPUT_FORCES_NEGATED] = "the legs pull the platform down: check the sign of the forces, "
                                         "which is positive where a leg pushes",
        [HEXLOAD_INPUT_FORCES_LIGHT] = "the legs carry less than the empty platform: check the forces' unit "
                                       "(N) and sign, and the platform's mass",
        [HEXLOAD_INPUT_FORCE_SIGN] = "force has the opposite sign of the one that balances the weight: "
                                     "check the wiring or sign of its force sensor",
        [HEXLOAD_INPUT_FORCE_DEAD] = "force is next to none, and the other five do not balance the weight: "
                                     "check the wiring of its force sensor",
        [HEXLOAD_INPUT_KNOWN_MASS] = "the legs do not carry what the known mass explains: check "
                                     "load.known_mass_kg or the mass that was set, the load, and "
                                     "each leg's force sensor",
        [HEXLOAD_INPUT_FORCES_QUIET] = "forces are several times quieter than stated: check their unit (N); "
                                       "if it is right, state their noise, or commission their filter",
    };
    return (unsigned)cause < (unsigned)HEXLOAD_INPUT_CAUSES ? TEXTS[cause] : "unknown input fault";
}
