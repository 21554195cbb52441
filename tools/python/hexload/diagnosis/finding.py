"""What the diagnosis hands on: a cause with its size, how sure it is, what it does, and the sentence that says so."""

from dataclasses import dataclass

from hexload.diagnosis.cause import Cause
from hexload.theory.kinematics import LEGS

SIGMAS = 6.0  # of a normal number that is no chance


@dataclass(frozen=True)
class Finding:
    cause: Cause  # equals its key: "dry friction", "velocity swapped", ...
    words: str  # the sentence
    mend: str  # what to do
    legs: tuple[int, ...] = ()  # from 0; empty: all, or none in particular
    size: float = float("nan")  # of the cause, in `unit`
    unit: str = ""
    sigmas: float = float("inf")  # how far beyond chance; inf: counted, not estimated
    rms_n: float = float("nan")  # what it does to the leg forces, beyond what the load can explain
    mass_kg: float = float("nan")  # by which the load's mass goes off when it is left out
    share: float = float("nan")  # of the residual's sum of squares
    alternatives: tuple[Cause, ...] = ()  # causes that explain as much
    is_harmless: bool = False  # as far as the log tells: nothing to do
    why_harmless: str = ""  # of what the forces show
    shift: tuple[float, ...] = ()  # by which all ten of the load's parameters go off when it is left out
    is_reported: bool = False  # a change of the load, by the estimator too
    until_s: float = float("nan")  # of what passes; it begins at `size`
    is_input: bool = False  # channels are not what they are taken for: no estimate of this log is to be believed

    @property
    def is_of_channels(self) -> bool:
        """Of sensors, their wiring, their times: not of the machine or its load."""
        return self.cause.is_of_channels

    @property
    def sentence(self) -> str:
        mend = self.why_harmless or self.mend
        return f"{self.words}; {mend}" if mend else self.words


def legs_in_words(legs: tuple[int, ...]) -> str:
    legs = tuple(sorted(set(legs)))
    if len(legs) == 1:
        return f"leg {legs[0] + 1}"
    if not legs or len(legs) == LEGS:
        return "all legs"
    return f"legs {', '.join(str(leg + 1) for leg in legs[:-1])} and {legs[-1] + 1}"


def plain(number: float, digits: int = 2) -> str:
    """To so many digits, without an exponent up to 999,999."""
    return f"{float(f'{number:.{digits}g}'):g}"
