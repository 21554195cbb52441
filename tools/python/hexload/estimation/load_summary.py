"""What is said of a replay's end, on terminal and page: each parameter's verdict in words, the load as a body."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import zip_longest

import numpy as np
from numpy.typing import NDArray

from hexload.diagnosis.finding import Finding
from hexload.theory.bound import unit_of

# Of the paper's four parameters.
SYMBOLS = {"dz": "Δz", "Ixx": "Ixx", "Iyy": "Iyy", "Izz": "Izz"}
UNITS = {"dz": "m", "Ixx": "kg m²", "Iyy": "kg m²", "Izz": "kg m²"}
DIGITS = {"dz": 6, "Ixx": 2, "Iyy": 2, "Izz": 2}

EFFECT_WORDS = {"bias": "force bias", "coulomb": "Coulomb friction", "viscous": "viscous friction"}  # of each leg
EFFECT_UNITS = {"bias": "N", "coulomb": "N", "viscous": "N s/m", "g": "m/s²"}  # the last of the base's tilt, gx and gy
TEN_DIGITS = 4  # at most, of the momentum filter's parameters, in kg, kg m and kg m^2
BODY_UNITS = {"m": "kg", "c": "m", "I": "kg m²"}
BODY_DIGITS = {"m": TEN_DIGITS, "c": 6, "I": TEN_DIGITS}
PUSH_S = 0.25  # by which the diagnosis may find a push too late
NEW_LOAD_S = (
    0.25  # after a load change: by then its first estimates have settled, and the machine has been judged with it
)
MOMENTS = 8  # that are listed one by one

# What has not moved when a parameter is not excited.
MISSING_MOTION = {
    "m": "no weight and no acceleration",
    "hx": "no weight and no acceleration",
    "hy": "no weight and no acceleration",
    "hz": "no tilt and no horizontal acceleration",
    "dz": "no roll and no pitch acceleration",
    "Ixx": "no roll acceleration",
    "Iyy": "no pitch acceleration",
    "Izz": "no yaw acceleration",
    "Ixy": "no roll and no pitch acceleration",
    "Ixz": "no roll and no yaw acceleration",
    "Iyz": "no pitch and no yaw acceleration",
}


def in_words(name: str, verdict: str, confounded: str | None = None) -> str:
    """A parameter's verdict with its reason. `confounded`: why it cannot be separated from actuator effects."""
    if confounded is not None and verdict not in ("misfit", "inconsistent"):
        return f"{verdict.replace('_', ' ')}: {confounded}"
    if verdict == "not_excited":
        return f"not excited: {MISSING_MOTION[name]} in the last 10 s, or too little to tell more"
    if verdict == "misfit":
        return "misfit: machine or log are not as the platform file says; sigma is widened and may still be too small"
    if verdict == "inconsistent":
        return "inconsistent: friction, other noise or another load than the model's; neither it nor its sigma holds"
    return verdict


def unit_of_parameter(name: str) -> str:
    """Of any parameter of any estimator."""
    return UNITS.get(name) or EFFECT_UNITS.get(name[:-1]) or unit_of(name)


@dataclass(frozen=True)
class Parameter:
    """One parameter at the end of a replay, in SI units."""

    name: str
    symbol: str
    unit: str
    digits: int  # after the point, of value and sigma
    value: float
    sigma: float
    own_sigma: float  # the filter's part of it
    words: str  # the verdict; of the machine's effects, which have none, nothing

    @property
    def verdict(self) -> str:
        """Without its reason."""
        return self.words.partition(":")[0]

    @property
    def own_digits(self) -> int:
        return max(self.digits, digits_of(self.own_sigma, TEN_DIGITS))


def digits_of(sigma: float | None, most: int) -> int:
    """After the point, that show two digits of sigma: more of a number would be noise. `most` where sigma tells nothing."""
    if sigma is None or not 0.0 < sigma < math.inf:
        return most
    return min(max(1 - math.floor(math.log10(sigma)), 0), most)


def parameters(result: dict) -> list[Parameter]:
    """Of what hexload_native.replay returns."""
    has_ten = "m" in result["names"]
    rows = []
    numbers = (result[key][-1].tolist() for key in ("value", "sigma", "own_sigma"))
    for name, value, sigma, own, verdict in zip_longest(result["names"], *numbers, result["parameter_verdict"]):
        unit = unit_of_parameter(name)
        words = "" if verdict is None else in_words(name, verdict, result["confounded"].get(name))
        digits = digits_of(sigma, TEN_DIGITS) if has_ten else DIGITS[name]
        rows.append(Parameter(name, SYMBOLS.get(name, name), unit, digits, value, sigma, own, words))
    return rows


def reasons(rows: Sequence[Parameter]) -> list[tuple[str, str]]:
    """Verdicts with a reason, each once: of which parameters, and in words."""
    return each_once([(row.symbol, row.words) for row in rows if row.words != row.verdict], len(rows))


def each_once(said: Sequence[tuple[str, str]], count: int) -> list[tuple[str, str]]:
    """`said`: of a parameter, by its name, of `count` in all, and in words. Names that share their words are put together."""
    names: dict[str, list[str]] = {}
    for name, words in said:
        names.setdefault(words, []).append(name)
    return [("all" if len(of) == count else ", ".join(of), words) for words, of in names.items()]


@dataclass(frozen=True)
class BodyNumber:
    """Of the load as a body: mass, centre of mass, tensor about it. None where it is not known."""

    name: str
    unit: str
    digits: int
    value: float | None
    sigma: float | None
    nearest: float | None  # of the nearest parameters that a body can have


def body_numbers(body: dict) -> list[BodyNumber]:
    columns = (body["names"], *(map(_known, body[key]) for key in ("value", "sigma", "nearest")))
    return [
        BodyNumber(name, BODY_UNITS[name[0]], digits_of(sigma, BODY_DIGITS[name[0]]), value, sigma, nearest)
        for name, value, sigma, nearest in zip(*columns, strict=True)
    ]


def _known(number: float) -> float | None:
    return None if math.isnan(number) else float(number)


def consistent_in_words(body: dict) -> str:
    if body["is_consistent"]:
        return "consistent: a body can have these parameters"
    if math.isnan(body["distance_sigmas"]):
        return "not consistent: no body can have these parameters, nor any near them"
    distance = f"{body['distance_sigmas']:.2f} sigma off"
    return f"not consistent: no body can have these parameters; the nearest that one can have are {distance}"


def load_changes_s(result: dict) -> list[float]:
    """When the firmware has detected another load."""
    return [float(t_s) for t_s in result["t"][_is_set(result, "load changed")]]


def misfit_ticks(result: dict) -> int:
    """In which the machine did not fit its model, beside those in which another load was too new to be known."""
    is_misfit = _is_set(result, "model misfit")
    for t_s in load_changes_s(result):
        is_misfit &= (result["t"] < t_s) | (result["t"] > t_s + NEW_LOAD_S)
    return int(np.count_nonzero(is_misfit))


def _is_set(result: dict, name: str) -> NDArray[np.bool_]:
    """The health bit of each tick, (n,)."""
    bit = list(result["health_counts"]).index(name)  # they are in the order of the bits
    return result["health"].astype(int) >> bit & 1 == 1


def moments_in_words(times_s: Sequence[float]) -> str:
    """Of at least one event."""
    if len(times_s) > MOMENTS:
        return f"{len(times_s)} times, first at {times_s[0]:.3f} s, last at {times_s[-1]:.3f} s"
    return f"at {', '.join(f'{t_s:.3f} s' for t_s in times_s)}"


def pushes_in_words(times_s: Sequence[float], findings: Sequence[Finding]) -> Iterator[str]:
    """Of another load that was detected where the diagnosis finds a push that is over: while it lasts they are the same."""
    for t_s in times_s:
        for finding in findings:
            if finding.cause == "push" and finding.size - PUSH_S <= t_s <= finding.until_s:
                yield f"at {t_s:.3f} s rather that push: along the weight it is a load as long as it lasts"


def health_in_words(ticks_of: dict[str, int]) -> str:
    """The bits that were set, and in how many ticks; nothing if none was."""
    remarks = ((name, ticks) for name, ticks in ticks_of.items() if ticks)
    return ", ".join(f"{name} in {ticks} tick{'s' if ticks > 1 else ''}" for name, ticks in remarks)


def mend_in_words(
    misfit_ticks: int,
    verdict: str,
    has_rig: bool = False,
    input_words: str = "",
    cause: str | None = None,
    is_of_paper: bool = False,
) -> str:
    """What to do about a verdict that the machine itself causes, or its sensors (`input_words`); nothing when they do not.
    `cause`: what the diagnosis of the log says."""
    if input_words or cause:
        return input_words or cause
    if is_of_paper and verdict in ("misfit", "inconsistent"):
        return inconsistent_words(is_of_paper)
    if verdict == "converged" or not misfit_ticks:
        return ""
    if has_rig:
        return (
            "the machine does not fit its rig file: commission it again, as it is now; look at the friction curves, "
            "their law may be another, and whether the base has been levelled or moved since"
        )
    return (
        "the machine does not fit its platform file: a base that is not level, friction, legs with mass or late sensors "
        "do that; run `hexload commission` on a log of the empty platform, then replay with --rig"
    )


def inconsistent_words(is_of_paper: bool) -> str:
    """What may help against `inconsistent` where neither input nor machine is known to be to blame; of the paper's filter
    also against `misfit`, which it cannot tell from a machine that is not its model."""
    if is_of_paper:
        return (
            "the load may be no body of the known mass on the z axis, which the estimator paper takes it for: run it again "
            "with --estimator momentum, or check known_mass_kg; a machine that does not fit its platform file does it too: "
            "see hexload commission"
        )
    return (
        "the estimate contradicts log and platform file: check masses and hinges of the platform file, the unit of the "
        "forces, order and signs of the legs; friction and bias are found by --estimator momentum_effects or hexload commission"
    )
