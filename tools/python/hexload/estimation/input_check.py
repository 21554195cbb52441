"""What a whole log says of its own input: the firmware's words where it has some, and of units where it refuses most samples."""

import numpy as np

from hexload.io.log_file import LegLog

MOST_REFUSED = 0.5  # of the samples, beyond which the estimate is nobody's
SAME_FACTOR = 0.05  # a factor of a unit is met within that


def input_in_words(result: dict, samples: LegLog) -> str:
    """Why a replay's end is not to be believed as its input is not, and what to do; nothing when it is."""
    if result["input_fault"]:
        return result["input_fault"]
    if result["refused"] > MOST_REFUSED * len(samples.t_s):
        return refusal_in_words(samples)
    return ""


def refusal_in_words(samples: LegLog) -> str:
    """Of a log of which the firmware refuses most samples."""
    factor = displacement_over_velocity(samples)
    if factor is not None and abs(factor / 1000 - 1) < SAME_FACTOR:
        return "displacements change a thousand times as fast as the velocities say: check their units, m and m/s"
    if factor is not None and abs(1000 * factor - 1) < SAME_FACTOR:
        return "velocities are a thousand times as large as displacements change: check their units, m and m/s"
    return (
        "most samples are refused: check the units (m, m/s, N), the order of the legs, the [geometry] of the platform file and "
        "the ranges of its [sensors]"
    )


def displacement_over_velocity(samples: LegLog) -> float | None:
    """Gain of the displacements' derivatives against the velocities, of all legs; None: no velocities, or none moves."""
    finite = np.isfinite(samples.displacement_m).all(axis=1) & np.isfinite(samples.velocity_m_s).all(axis=1)
    both = finite[1:] & finite[:-1]
    changes_m = np.diff(samples.displacement_m, axis=0)[both]
    velocity_m_s = samples.velocity_m_s
    ways_m = (0.5 * (velocity_m_s[1:] + velocity_m_s[:-1]) * np.diff(samples.t_s)[:, None])[both]
    square_m2 = float(np.sum(ways_m**2))
    return float(np.sum(changes_m * ways_m)) / square_m2 if square_m2 > 0 else None
