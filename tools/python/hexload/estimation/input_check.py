"""What is to be said of a log as an input: before the filter has it, and of what the firmware made of it.

Before: `InputCheck`, whose contradictions refuse the log. After: the firmware's words where it has some, those of units
where it refuses most samples, and what an estimate that contradicts itself may come from.
"""

from pathlib import Path

from hexload.errors import InputError
from hexload.estimation.load_summary import inconsistent_words
from hexload.estimation.plausibility import Plausibility, machine_of
from hexload.io.log_file import LegLog

MOST_REFUSED = 0.5  # of the samples, beyond which the estimate is nobody's


class InputCheck:
    """Of a log that comes in parts. It refuses what contradicts itself, as soon as that is certain."""

    def __init__(self, log: Path, platform, sampling_s: float, is_load_known: bool):
        """`platform`: hexload_native.Platform. `is_load_known`: its known_mass_kg is on it, as the estimator paper takes it."""
        self._log = log
        self._plausibility = Plausibility(machine_of(platform, is_load_known), sampling_s)

    def add(self, part: LegLog) -> None:
        """Raises InputError, with the option that mends it."""
        self._plausibility.add(part)
        doubt = self._plausibility.doubt()
        if doubt is None:
            return
        mend = f"; nothing is converted unasked, say {doubt.mend}" if doubt.mend else ""
        raise InputError(f"{self._log}: {doubt.words}{mend} (--unchecked: go on as it is)")


def input_in_words(result: dict, rows: int) -> str:
    """Why a replay's end is not to be believed as its input is not, and what to do; nothing when it is."""
    if result["input_fault"]:
        return result["input_fault"]
    if result["refused"] > MOST_REFUSED * rows:
        return REFUSED
    return ""


REFUSED = (
    "most samples are refused: check the units (m, m/s, N), the order of the legs, the [geometry] of the platform file and "
    "the ranges of its [sensors]"
)


def inconsistent_in_words(result: dict) -> str:
    """What may help where the verdict at the end is `inconsistent`, and neither input nor machine is to blame."""
    if result["verdict"][-1] != "inconsistent":
        return ""
    return inconsistent_words("dz" in result["names"])


def gaps_in_words(result: dict, sampling_s: float, rows: int) -> tuple[str, ...]:
    """What is said of ticks without rows; nothing where there are none."""
    missing, longest, t_s = result["missing"]
    if not missing:
        return ()
    share = 100.0 * missing / (missing + rows)
    return (
        f"{missing} ticks of {1e3 * sampling_s:g} ms have no row ({share:.2g} %), {longest} of them before {t_s:.3f} s: "
        "they are lost samples to the estimator",
    )
