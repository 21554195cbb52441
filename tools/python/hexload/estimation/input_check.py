"""What is to be said of a log as an input: before the filter has it, and of what the firmware made of it.

Before: `InputCheck`, whose contradictions refuse the log. After: the firmware's words where it has some, those of units
where it refuses most samples, and what an estimate that contradicts itself may come from.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from hexload.errors import InputError
from hexload.estimation import stray
from hexload.estimation.load_summary import inconsistent_words, mend_in_words, misfit_ticks
from hexload.estimation.plausibility import Plausibility, machine_of
from hexload.io.column_map import read_column_map
from hexload.io.log_file import LegLog, joined
from hexload.io.log_formats import Reading, read_parts

MOST_REFUSED = 0.5  # of the samples, beyond which the estimate is nobody's


@dataclass(frozen=True)
class WayIn:
    """How a log comes in: where its columns do not say it, and whether it is checked."""

    columns: Sequence[str] = ()  # files, or lines of them
    resample_s: float | None = None
    is_unchecked: bool = False

    def reading(self, platform) -> Reading:
        return Reading(read_column_map(self.columns), self.resample_s, platform.home_leg_length_m, platform.tick_s)


class InputCheck:
    """Of a log that comes in parts. It refuses what contradicts itself, as soon as that is certain."""

    def __init__(self, log: Path, platform, sampling_s: float, load_kg: float | None):
        """`platform`: hexload_native.Platform; None: of units, order and time alone. `load_kg`: what it carries; None: not
        known."""
        self._log = log
        machine = None if platform is None else machine_of(platform, load_kg)
        self._plausibility = Plausibility(machine, sampling_s)

    def add(self, part: LegLog) -> None:
        """Raises InputError, with the option that mends it."""
        self._plausibility.add(part)
        doubt = self._plausibility.doubt()
        if doubt is None:
            return
        mend = f"; nothing is converted unasked, say {doubt.mend}" if doubt.mend else ""
        raise InputError(f"{self._log}: {doubt.words}{mend} (--unchecked: go on as it is)")


def checked_log(native, log: Path, platform, way_in: WayIn, load_kg: float | None) -> LegLog:
    """A whole log without gaps in its channels. Raises InputError, where it contradicts itself with the option that mends it."""
    whole = joined(list(read_parts(log, way_in.reading(platform)))).whole(str(log))
    if not way_in.is_unchecked:
        InputCheck(log, platform, native.sampling_period_s(whole.t_s), load_kg).add(whole)
        strays = stray.strays_of(whole, stray.noise_of(platform))
        if strays:
            raise InputError(
                f"{log}: row {strays[0].row + 1}: {stray.in_words(strays, len(strays))}; expected a log without: leave such "
                "rows out (--unchecked: go on as it is)"
            )
    return whole


def refuse_implausible(native, samples: LegLog, platform, load_kg: float | None) -> None:
    """As InputCheck, of arrays. Raises InputError."""
    plausibility = Plausibility(machine_of(platform, load_kg), native.sampling_period_s(samples.t_s))
    plausibility.add(samples)
    if (doubt := plausibility.doubt()) is not None:
        raise InputError(f"{doubt.words} (unchecked=True: go on as it is)")


def input_in_words(result: dict, rows: int) -> str:
    """Why a replay's end is not to be believed as its input is not, and what to do; nothing when it is."""
    if result["input_fault"]:
        return result["input_fault"]
    if result["refused"] > MOST_REFUSED * rows:
        return REFUSED
    return ""


REFUSED = (
    "most samples are refused: check the units (m, m/s, N), the order of the legs, the [geometry] of the platform file and "
    "the ranges of its [sensors] and [actuators]"
)


def mend_of(result: dict) -> str:
    """What to do about what replay_log(), or the firmware alone, returns; empty: nothing. That two channels contradict each
    other is what the firmware says of them; where the diagnosis knows which one, and by how much, it goes before."""
    diagnosis = result.get("diagnosis")
    cause = None if diagnosis is None else diagnosis.cause
    said = result.get("input_words", result["input_fault"])
    is_finer = said == result["input_fault"] != "" and cause is not None and cause.is_of_channels
    mend = mend_in_words(
        misfit_ticks(result),
        result["verdict"][-1],
        result.get("has_rig", False),
        cause.sentence if is_finer else said,
        cause and cause.sentence,
        "dz" in result["names"],
    )
    return mend or inconsistent_in_words(result)


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
        f"{missing} ticks of {1e3 * sampling_s:g} ms have no row ({share:.2g} %), the longest gap, of {longest}, ends at "
        f"{t_s:.3f} s: they are lost samples to the estimator",
    )
