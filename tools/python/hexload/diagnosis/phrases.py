"""Sentences of the causes that the bank has chosen, and of the wiring."""

from collections.abc import Callable
from dataclasses import asdict, dataclass, replace

import numpy as np

from hexload.diagnosis.bank import Selected
from hexload.diagnosis.cause import Cause, Channel, Defect
from hexload.diagnosis.causes import ELASTIC_M_N
from hexload.diagnosis.dynamics import Machine
from hexload.diagnosis.finding import Finding, legs_in_words, plain
from hexload.diagnosis.search import Change
from hexload.diagnosis.wiring import Rewired
from hexload.theory.kinematics import LEGS

ALL = tuple(range(LEGS))
HARMLESS = 0.5  # of a force sensor's sigma, rms
BELOW_NOISE = "small beside the force sensors' noise"
COVERED = "too small to matter: sigma covers what it does to the load"
LARGE = 0.25  # of the largest leg's size, from which a leg is named
NEGATED, DEAD = -0.5, 0.3  # gains of a force sensor: below the first its sign is wrong, below the second it is dead


@dataclass(frozen=True)
class _Source:
    """What the machine is known from: the words of a sentence that depend on it."""

    file: str
    commission: str
    or_commission: str


_PLATFORM_FILE = _Source(
    "platform file",
    "commission the machine (hexload commission), then replay with --rig",
    "or commission the machine",
)
_RIG_FILE = _Source(
    "rig file", "commission the machine again: it is not as its rig file says", "or commission it again"
)
CALIBRATE, COMMISSION = "calibrate the sensor, {or_commission}", "{commission}"
MEASURE, LOOK_AT_FILTER = "measure it, {or_commission}", "commission the delay, or look at its filter"


def _by_source(machine: Machine) -> dict[str, str]:
    return asdict(_RIG_FILE if machine.is_commissioned else _PLATFORM_FILE)


def finding_of(selected: Selected, alternatives: tuple[Cause, ...], machine: Machine) -> Finding:
    is_of_legs = selected.family.cause in _OF_LEGS
    named = _of_legs(selected) if is_of_legs else _of_all(selected, _by_source(machine))
    is_harmless = selected.rms_n < HARMLESS * machine.force_sigma_n
    return replace(
        named,
        mend=named.mend.format(**_by_source(machine)),
        sigmas=selected.sigmas,
        rms_n=selected.rms_n,
        mass_kg=float(selected.shift[0]),
        share=selected.share,
        alternatives=alternatives,
        shift=tuple(map(float, selected.shift)),
        until_s=selected.family.end,
        is_harmless=is_harmless,
        why_harmless=BELOW_NOISE if is_harmless else "",
    )


def of_one_force(leg: int, gain: float, has_gain: bool, machine: Machine) -> Finding:
    """Of the sensor of one leg (from 0) beside what the other five need: its gain, and whether it follows that at all."""
    who, five = legs_in_words((leg,)), "what the other five legs need"
    wiring = "check the wiring of its force sensor"

    def found(defect: Defect, words: str, mend: str, is_input: bool = True) -> Finding:
        size = float("nan") if defect == Defect.WRONG else gain - 1.0
        return Finding(Cause(defect, Channel.FORCE), words, mend, (leg,), size, is_input=is_input)

    if has_gain and gain < NEGATED:
        return found(Defect.SIGN, f"{who}: force has the wrong sign", wiring)
    if has_gain and abs(1e3 * gain - 1.0) < 0.1:
        return found(Defect.UNIT, f"{who}: force is a thousandth of {five}, as in kN", "check its unit (N)")
    if abs(gain) < DEAD:
        return found(Defect.DEAD, f"{who}: force is next to nothing beside {five}", wiring)
    if has_gain:
        percent = plain(100.0 * abs(gain - 1.0))
        words = f"residual of {who} follows its force: gain of its force sensor off by about {percent} %"
        return found(Defect.GAIN, words, CALIBRATE.format(**_by_source(machine)), is_input=False)
    return found(Defect.WRONG, f"{who}: force is not {five}", wiring)


def with_velocities(finding: Finding) -> Finding:
    """Velocities agree with displacements in time, so what is late or early beside them are the forces."""
    if finding.cause != Cause(Defect.LATE, Channel.DISPLACEMENT) or finding.legs not in ((), ALL):
        return finding
    words = f"all force channels are {plain(1e3 * abs(finding.size))} ms {'late' if finding.size < 0 else 'early'}"
    return replace(finding, cause=Cause(Defect.LATE, Channel.FORCE), words=words, size=-finding.size)


def change_in_words(change: Change, is_reported: bool) -> Finding:
    mass = float(change.theta[0])
    words = f"another load from {change.at_s:.2f} s on, {plain(abs(mass), 3)} kg {'more' if mass > 0 else 'less'}"
    return Finding(
        Cause(Defect.LOAD_CHANGE),
        words if is_reported else f"{words}, which the estimator has not reported",
        "" if is_reported else "replay what follows by itself",
        size=mass,
        unit="kg",
        sigmas=float(np.sqrt(change.score)),
        is_reported=is_reported,
    )


_REWIRED = {
    Cause(Defect.SWAPPED, Channel.FORCE): "the force sensors of {who} are swapped",
    Cause(Defect.SIGN, Channel.FORCE): "{who}: force has the wrong sign",
    Cause(Defect.LEGS_EXCHANGED): "{who} are exchanged in all channels",
    Cause(Defect.SWAPPED, Channel.DISPLACEMENT): "the displacement sensors of {who} are swapped",
    Cause(Defect.LEGS_RENUMBERED): "the legs are counted from another one: the channels are those of legs {order}",
    Cause(Defect.LEGS_MIRRORED): "the legs are counted the other way round: the channels are those of legs {order}",
}
_FORCES_ROUND = "the forces are those of legs {order}"


def rewired(best: Rewired) -> Finding:
    is_round = best.cause == Cause(Defect.SWAPPED, Channel.FORCE) and len(best.legs) != 2
    order = ", ".join(str(leg + 1) for leg in best.order)
    words = (_FORCES_ROUND if is_round else _REWIRED[best.cause]).format(who=legs_in_words(best.legs), order=order)
    return Finding(best.cause, words, "check the wiring against the platform file", best.legs, is_input=True)


@dataclass(frozen=True)
class _Phrase:
    """Of a cause that all legs share, or of one that is at a place or a time."""

    words: str  # with fields of _numbers_in_words() and _Source
    mend: str
    size: Callable[[Selected], float]
    unit: str


def _first(s: Selected) -> float:
    return float(s.size[0])


def _largest(s: Selected) -> float:
    return float(np.max(np.abs(s.size)))


def _length(s: Selected) -> float:
    return float(np.linalg.norm(s.size))


def _slope_rad(s: Selected) -> float:
    return float(np.hypot(*s.size[:2])) if len(s.size) > 1 else 0.0


def _stiffness_n_m(s: Selected) -> float:
    return 1.0 / ELASTIC_M_N / max(abs(_first(s)), 1e-9)


def _at(s: Selected) -> float:
    return s.family.detail


def _of_all(s: Selected, source: dict[str, str]) -> Finding:
    phrase = _OF_ALL[s.family.cause]
    words = phrase.words.format(**_numbers_in_words(s), **source)
    return Finding(s.family.cause, words, phrase.mend, s.family.legs, phrase.size(s), phrase.unit)


def _numbers_in_words(s: Selected) -> dict[str, str]:
    """All that a phrase may want to say of what has been found."""
    first, at, end = _first(s), s.family.detail, s.family.end
    return {
        "first": plain(first),
        "absolute": plain(abs(first)),
        "percent": plain(abs(100.0 * first)),
        "largest": plain(_largest(s)),
        "largest_percent": plain(100.0 * _largest(s)),
        "length": plain(_length(s)),
        "length_mm": plain(1e3 * _length(s)),
        "slope_deg": plain(np.degrees(_slope_rad(s))),
        "stiffness": plain(_stiffness_n_m(s)),
        "hz": plain(at),
        "fine_hz": f"{at:.2f}",
        "way_deg": f"{np.degrees(at):.0f}",
        "since_s": f"{at:.1f}",
        "from_s": f"{at:.2f}",
        "until_s": f"{end:.2f}",
        "who": legs_in_words(s.family.legs),
        "side": "platform" if at else "base",
        "larger": "larger" if first > 0 else "smaller",
    }


_OF_ALL = {
    Cause(Defect.HINGE_FRICTION): _Phrase(
        "the residual follows the turning of the hinges: friction of about {first} N m in each",
        COMMISSION,
        _first,
        "N m",
    ),
    Cause(Defect.TILT): _Phrase(
        "the residual follows the platform's attitude: the base is {slope_deg} degrees off level",
        "level it, or {commission}",
        _slope_rad,
        "rad",
    ),
    Cause(Defect.GRAVITY): _Phrase(
        "weight and inertia do not agree by {percent} %: gravity of the {file}, or the clock, is off",
        "check gravity_m_s2 and the sampling period",
        _first,
        "",
    ),
    Cause(Defect.CROSSTALK, Channel.FORCE): _Phrase(
        "forces follow those of the neighbouring legs: each shows about {largest_percent} % of the next one's",
        "look at cables and amplifiers, or at bending in the mounts of the sensors",
        _largest,
        "",
    ),
    Cause(Defect.SPINNING_PART): _Phrase(
        "the residual follows the platform's turning across it: something in the load spins, with about {length} N m s",
        "stop it, or let no load change count while it runs",
        _length,
        "N m s",
    ),
    Cause(Defect.ELASTIC_LEGS): _Phrase(
        "the residual follows the second derivative of the legs' forces: legs give, by about {stiffness} N/m each",
        "look at their mounts and hinges",
        _stiffness_n_m,
        "N/m",
    ),
    Cause(Defect.PULSE, Channel.FORCE): _Phrase(
        "{who}: zero of its force sensor off by about {absolute} N from about {from_s} to {until_s} s",
        "look at the sensor and its cable",
        _at,
        "s",
    ),
    Cause(Defect.ZERO_STEP, Channel.FORCE): _Phrase(
        "{who}: zero of its force sensor jumps by about {absolute} N at about {since_s} s", CALIBRATE, _first, "N"
    ),
    Cause(Defect.GAIN_STEP, Channel.FORCE): _Phrase(
        "{who}: gain of its force sensor jumps by about {percent} % at about {since_s} s", CALIBRATE, _first, ""
    ),
    Cause(Defect.LEG_MASS): _Phrase(
        "the residual follows the swing of the legs: they have a mass that counts", COMMISSION, _first, "kg m²"
    ),
    Cause(Defect.HOSES): _Phrase(
        "the residual follows the platform's position: something pulls it back with about {largest} N/m, as hoses do",
        "take them off, or lead them along",
        _largest,
        "N/m",
    ),
    Cause(Defect.EXTERNAL_FORCE): _Phrase(
        "a constant force from outside acts on the platform",
        "look for what touches or pulls it",
        lambda s: s.rms_n,
        "N",
    ),
    Cause(Defect.LOAD_RAMP): _Phrase(
        "the load changes steadily from about {since_s} s on",
        "look for a leak; estimates hold for one load",
        _first,
        "1/s",
    ),
    Cause(Defect.NOT_RIGID): _Phrase(
        "a part of the load swings by itself at {hz} Hz: it is not rigid (sloshing, pendulum, soft mount)",
        "fasten it; until then only its mass and its centre at rest hold",
        _at,
        "Hz",
    ),
    Cause(Defect.SHAKING_BASE): _Phrase(
        "the base shakes at {fine_hz} Hz", "look at the floor and at machines near by", _at, "Hz"
    ),
    Cause(Defect.END_STOP): _Phrase(
        "at the end of the way towards {way_deg} degrees something pushes back",
        "look for what is in the way",
        _at,
        "rad",
    ),
    Cause(Defect.PUSH): _Phrase(
        "something pushes from about {from_s} to {until_s} s: a contact, or another passing event",
        "look for what touches it",
        _at,
        "s",
    ),
    Cause(Defect.ONE_HINGE): _Phrase(
        "the {side} hinge of {who} is about {length_mm} mm off its place in the {file}", MEASURE, _length, "m"
    ),
    Cause(Defect.HINGE_CIRCLE): _Phrase(
        "the circle of the {side} hinges is {percent} % {larger} than in the {file}", MEASURE, _first, ""
    ),
    Cause(Defect.HINGES): _Phrase(
        "the hinges are not where the {file} has them", "measure them, {or_commission}", lambda _: float("nan"), ""
    ),
}


@dataclass(frozen=True)
class _LegPhrase:
    """Of a cause that each leg has a size of."""

    shows: str  # what its residual shows, with fields of _ONE or _SOME
    what: str  # what that is, with these, those of _LATE or _EARLY, and {size}
    factor: float  # of the size, in words
    unit: str  # of the size
    mend: str


_ONE = {
    "follows": "follows", "is_": "is", "grows": "grows", "lags": "lags", "its": "its",
    "speed": "speed", "force": "force", "sensor": "sensor", "zero": "zero", "length": "length",
}  # fmt: skip
_SOME = {
    "follows": "follow", "is_": "are", "grows": "grow", "lags": "lag", "its": "their",
    "speed": "speeds", "force": "forces", "sensor": "sensors", "zero": "zeros", "length": "lengths",
}  # fmt: skip
_LATE, _EARLY = {"late": "late", "early": "early"}, {"late": "early", "early": "late"}
_OF_LEGS = {
    Cause(Defect.DRY_FRICTION): _LegPhrase(
        "{follows} the sign of {its} {speed}", "friction of about {size} N", 1.0, "N", COMMISSION
    ),
    Cause(Defect.VISCOUS_FRICTION): _LegPhrase(
        "{follows} {its} {speed}", "viscous friction of about {size} N s/m", 1.0, "N s/m", COMMISSION
    ),
    Cause(Defect.GROWING_FRICTION): _LegPhrase(
        "{follows} the sign of {its} {speed} times {its} {force}",
        "friction of about {size} % of the force",
        100.0,
        "",
        COMMISSION,
    ),
    Cause(Defect.ZERO, Channel.FORCE): _LegPhrase(
        "{is_} constant", "{zero} of {its} force {sensor} off by about {size} N", 1.0, "N", CALIBRATE
    ),
    Cause(Defect.DRIFT, Channel.FORCE): _LegPhrase(
        "{grows} with time", "{zero} of {its} force {sensor} drifting by about {size} N/s", 1.0, "N/s", CALIBRATE
    ),
    Cause(Defect.GAIN, Channel.FORCE): _LegPhrase(
        "{follows} {its} {force}", "gain of {its} force {sensor} off by about {size} %", 100.0, "", CALIBRATE
    ),
    Cause(Defect.CURVE, Channel.FORCE): _LegPhrase(
        "{follows} the square of {its} {force}",
        "{its} force {sensor} not straight, by about {size} % of the largest force",
        100.0,
        "",
        "calibrate it over its whole range",
    ),
    Cause(Defect.HYSTERESIS, Channel.FORCE): _LegPhrase(
        "{lags} behind {its} {force}",
        "hysteresis of {its} force {sensor} of about {size} N",
        1.0,
        "N",
        "commission the machine, or take a sensor with less",
    ),
    Cause(Defect.LATE, Channel.FORCE): _LegPhrase(
        "{follows} the change of {its} {force}", "force {late} by about {size} ms", 1e3, "s", LOOK_AT_FILTER
    ),
    Cause(Defect.ZERO, Channel.DISPLACEMENT): _LegPhrase(
        "{follows} a shift of {its} length",
        "{length} at home, or {zero} of {its} displacement, off by about {size} mm",
        1e3,
        "m",
        "calibrate it, {or_commission}",
    ),
    Cause(Defect.GAIN, Channel.DISPLACEMENT): _LegPhrase(
        "{follows} a stretch of {its} length", "gain of {its} displacement off by about {size} %", 100.0, "", CALIBRATE
    ),
    Cause(Defect.DRIFT, Channel.DISPLACEMENT): _LegPhrase(
        "{follows} a growing shift of {its} length", "displacement drifting by about {size} mm/s", 1e3, "m/s", CALIBRATE
    ),
    Cause(Defect.LATE, Channel.DISPLACEMENT): _LegPhrase(
        "{follows} the change of {its} motion",
        "displacement {late} by about {size} ms, or force {early}",
        1e3,
        "s",
        LOOK_AT_FILTER,
    ),
}


def _of_legs(s: Selected) -> Finding:
    phrase = _OF_LEGS[s.family.cause]
    sizes, legs, worst = _by_leg(s)
    named = phrase.factor * np.abs(sizes[list(legs)] if legs else sizes[:1])
    low, high = float(named.min()), float(named.max())
    size = plain(high) if high < 1.15 * low or len(named) == 1 else f"{plain(low)} to {plain(high)}"
    number = _ONE if len(legs) == 1 else _SOME
    who = f"{'residual' if len(legs) == 1 else 'residuals'} of {legs_in_words(legs)}"
    what = phrase.what.format(size=size, **number, **(_EARLY if worst < 0.0 else _LATE))
    words = f"{who} {phrase.shows.format(**number)}: {what}"
    return Finding(s.family.cause, words, phrase.mend, legs, worst, phrase.unit)


def _by_leg(s: Selected) -> tuple[np.ndarray, tuple[int, ...], float]:
    """Sizes of the legs, those that count, and the largest."""
    sizes = np.zeros(LEGS)
    if not s.family.legs:
        sizes[:] = s.size[0]
        return sizes, (), float(s.size[0])
    for leg, size in zip(s.family.legs[:LEGS], s.size[:LEGS]):
        sizes[leg] = size
    if s.family.cause == Cause(Defect.GAIN, Channel.FORCE) and len(s.family.legs) == LEGS:
        sizes -= np.median(sizes)  # what all have in common is a load of another size
    worst = float(sizes[np.abs(sizes).argmax()])
    return sizes, tuple(np.flatnonzero(np.abs(sizes) > LARGE * abs(worst)).tolist()), worst
