"""What a platform file's table [tolerances] is taken for where it states nothing: one standard deviation each."""

import math

GRANTED_SIGMAS = 3.0  # of what is found, by which it may be beyond a tolerance before it is refused
OPEN = math.inf  # nothing is known beforehand
DEFAULTS = {
    "force_gain": 0.01,  # of each load cell
    "force_offset_n": OPEN,
    "hinge_m": 1e-3,  # of a drawing
    "tilt_rad": OPEN,
    "friction_growth": 0.01,
    # The firmware's, firmware/src/configuration/config_default.c:
    "friction_shape": 2.0,
    "force_gain_common": 0.005,
    "platform_mass": 0.03,
    "platform_com_m": 0.002,
    "platform_inertia": 0.06,
    "timing_s": 0.0005,
    "contact_force_n": 0.0,  # what usually hangs on a platform is in its mass
}
GRAVITY = 0.003  # of it and of the clock: what all forces alike may be off by beside their sensors


def common_gain_of(force_gain: float) -> float:
    """Of all six sensors alike, where each is as exact as that and nothing is stated of them together, with gravity."""
    return math.hypot(force_gain / math.sqrt(6.0), GRAVITY)
