"""What velocities and displacements contradict each other in, as findings, and the record without it.

Kinematics alone cannot tell which of two sensors is wrong. A displacement that is put right makes the forces fit the
motion better, a velocity leaves them as they are, and a clock changes the accelerations by the square of what it does
to speeds.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hexload.diagnosis.cause import Cause, Channel, Defect
from hexload.diagnosis.dynamics import Machine
from hexload.diagnosis.finding import SIGMAS, Finding, legs_in_words, plain
from hexload.diagnosis.kinematics import Kinematics
from hexload.diagnosis.record import Record
from hexload.theory.kinematics import LEGS

Array = NDArray[np.float64]

GAIN, LAG_S, ZERO, DRIFT = (
    1e-3,
    5e-5,
    0.2,
    0.02,
)  # sizes below which nothing is said; the last two in sigmas a sample, and a second
OF_DRIFT = 0.1  # of the way that a zero drifts: less is where the drift began
ALIKE = 0.2  # of six numbers' mean, within which they are one
BETTER = 0.8  # of the forces' misfit, below which the displacement was wrong
HARMLESS_LAG_S = 2e-4  # a tenth of what the controller lets pass, and less than half a tick
UNITS = {1e3: "a thousand", 1e2: "a hundred", 39.37: "39.37 (inches)", 60.0: "sixty", 3.6: "3.6"}
MISTAKEN = (Defect.SWAPPED, Defect.SIGN, Defect.UNIT)  # after which the other numbers of a channel mean nothing
INPUT_GAIN, INPUT_LAG_S = 0.02, 2e-3  # beyond, the input is not to be believed


class Motion:
    """The record as far as it is put right, and how well the forces fit it."""

    def __init__(self, record: Record, misfit: Callable[[Record], float]):
        self.record = record
        self.misfit = misfit
        self._own: float | None = None

    def is_worse_than(self, other: Record) -> bool:
        if self._own is None:
            self._own = self.misfit(self.record)
        return self.misfit(other) < BETTER * self._own

    def put_right(self, record: Record) -> None:
        if record is not self.record:
            self.record, self._own = record, None


@dataclass(frozen=True)
class Checked:
    findings: list[Finding]
    record: Record  # put right


def check(record: Record, found: Kinematics, machine: Machine, misfit: Callable[[Record], float]) -> Checked:
    findings: list[Finding] = []
    motion = Motion(record, misfit)
    for step in (_swaps, _signs, _bends, _gains, _lags, _zeros):
        for finding, mended in step(motion, found, machine):  # each begins with what the last one has put right
            findings.append(finding)
            motion.put_right(mended)
        if any(finding.cause.defect in MISTAKEN for finding in findings):
            break  # what else the numbers show is of that
    return Checked(findings, motion.record)


Step = Iterator[tuple[Finding, Record]]


def _swaps(motion: Motion, found: Kinematics, _machine: Machine) -> Step:
    record = motion.record
    legs = tuple(leg for leg in range(LEGS) if found.partner[leg] != leg)
    if not legs:
        return
    order = found.partner.copy()
    if len(set(order.tolist())) != LEGS:  # two velocities of one displacement
        order = np.arange(LEGS)
    mended = replace(record, displacement_m=record.displacement_m[:, order])
    channel = (
        Channel.DISPLACEMENT if (order != np.arange(LEGS)).any() and motion.is_worse_than(mended) else Channel.VELOCITY
    )
    words = f"{channel} sensors of {legs_in_words(legs)} are swapped"
    finding = Finding(Cause(Defect.SWAPPED, channel), words, "exchange their plugs", legs, is_input=True)
    yield finding, mended if channel == Channel.DISPLACEMENT else record


def _signs(motion: Motion, found: Kinematics, _machine: Machine) -> Step:
    legs = np.flatnonzero(found.sign < 0.0)
    flips = np.where(found.sign < 0.0, -1.0, 1.0)
    flipped = replace(motion.record, displacement_m=motion.record.displacement_m * flips)
    are_all = len(legs) > 0 and motion.is_worse_than(flipped)  # one of some that is put right may still be of no pose
    for leg in legs:
        flip = np.where(np.arange(LEGS) == leg, -1.0, 1.0)
        mended = replace(motion.record, displacement_m=motion.record.displacement_m * flip)
        channel = Channel.DISPLACEMENT if are_all or motion.is_worse_than(mended) else Channel.VELOCITY
        words = f"leg {leg + 1}: {channel} has the wrong sign"
        finding = Finding(
            Cause(Defect.SIGN, channel), words, f"check the wiring of its {channel} sensor", (int(leg),), is_input=True
        )
        yield finding, mended if channel == Channel.DISPLACEMENT else motion.record


def _common(value: Array, sigma: Array, least: float) -> float | None:
    """One number of all legs, or None."""
    good = np.isfinite(value)
    if good.sum() < 4:
        return None
    mean = float(np.mean(value[good]))
    spread = np.abs(value[good] - mean)
    is_one = (spread < np.maximum(4.0 * sigma[good], ALIKE * abs(mean))).all()
    return mean if is_one and abs(mean) > max(least, SIGMAS * float(sigma[good].max()) / np.sqrt(good.sum())) else None


def _single(value: Array, sigma: Array, least: float) -> list[int]:
    with np.errstate(invalid="ignore"):
        return np.flatnonzero((np.abs(value) > least) & (np.abs(value) > SIGMAS * sigma)).tolist()


def _bends(motion: Motion, found: Kinematics, _machine: Machine) -> Step:
    """A scale that is a parabola: of a displacement the speed's gain follows the place, of a velocity the speed."""
    place = np.abs(motion.record.displacement_m).max(axis=0)
    for name, channel, largest in (
        ("bend", Channel.DISPLACEMENT, -0.5 * place),  # the velocity is right
        ("curve", Channel.VELOCITY, np.abs(motion.record.velocity_m_s).max(axis=0)),
    ):
        share, sigma = found.value[name] * largest, found.sigma[name] * np.abs(largest)
        for leg in _single(share, sigma, GAIN):
            words = (
                f"leg {leg + 1}: the scale of its {channel} is bent, by {_percent(float(share[leg]))} at its largest"
            )
            finding = Finding(
                Cause(Defect.CURVE, channel),
                words,
                f"calibrate its {channel} sensor over its whole range",
                (leg,),
                float(share[leg]),
                "",
                float(abs(share[leg]) / sigma[leg]),
            )
            straight = motion.record.displacement_m.copy()
            straight[:, leg] -= float(share[leg]) * straight[:, leg] ** 2 / place[leg]
            mended = replace(motion.record, displacement_m=straight)
            yield finding, mended if channel == Channel.DISPLACEMENT else motion.record


def _gains(motion: Motion, found: Kinematics, _machine: Machine) -> Step:
    value, sigma = found.value["gain"], found.sigma["gain"]
    common = _common(value, sigma, GAIN)
    if common is not None:
        yield _common_gain(motion, common, float(np.nanmin(np.abs(value) / sigma)))
        return
    for leg in _single(value, sigma, GAIN):
        size = float(value[leg])
        factor = np.where(np.arange(LEGS) == leg, 1.0 + size, 1.0)
        mended = replace(motion.record, displacement_m=motion.record.displacement_m * factor)
        channel = Channel.DISPLACEMENT if motion.is_worse_than(mended) else Channel.VELOCITY
        own = size if channel == Channel.VELOCITY else 1.0 / (1.0 + size) - 1.0
        finding = Finding(
            Cause(Defect.GAIN, channel),
            f"leg {leg + 1}: {channel} is {_percent(own)} too {'large' if own > 0 else 'small'}",
            f"calibrate its {channel} sensor",
            (leg,),
            own,
            "",
            abs(size) / float(sigma[leg]),
            is_input=abs(own) > INPUT_GAIN,
        )
        yield finding, mended if channel == Channel.DISPLACEMENT else motion.record


def _common_gain(motion: Motion, size: float, sigmas: float) -> tuple[Finding, Record]:
    record, factor = motion.record, 1.0 + size
    longer = replace(record, displacement_m=record.displacement_m * factor)
    if _unit_of(factor) is not None:
        is_length = np.ptp(record.displacement_m, axis=0).max() > 2.0 or motion.is_worse_than(longer)
        channel, ratio = (Channel.DISPLACEMENT, 1.0 / factor) if is_length else (Channel.VELOCITY, factor)
        words = f"{channel} channels are {_unit_in_words(ratio)} their SI values: another unit"
        finding = Finding(
            Cause(Defect.UNIT, channel), words, "check their units, m and m/s", size=ratio, sigmas=sigmas, is_input=True
        )
        return finding, longer if is_length else record
    faster = replace(record, dt_s=record.dt_s / factor, t_s=record.t_s[0] + (record.t_s - record.t_s[0]) / factor)
    options = [
        (Cause(Defect.GAIN, Channel.DISPLACEMENT), longer, 1.0 / factor - 1.0),
        (Cause(Defect.CLOCK), faster, size),
    ]
    best = min(options, key=lambda option: motion.misfit(option[1]))
    of_velocity = (Cause(Defect.GAIN, Channel.VELOCITY), record, size)
    cause, mended, own = best if motion.is_worse_than(best[1]) else of_velocity
    if cause.defect == Defect.CLOCK:
        words = f"the log's clock is {_percent(own)} {'fast' if own > 0 else 'slow'}, against velocities and forces"
        mend = "check the sampling period"
    else:
        words = f"all {cause.channel} channels are {_percent(own)} too {'large' if own > 0 else 'small'}"
        mend = f"check the scale of the {cause.channel} sensors"
    return Finding(cause, words, mend, (), own, "", sigmas, is_input=abs(own) > INPUT_GAIN), mended


def _percent(share: float) -> str:
    return f"{100.0 * abs(share):.{2 if abs(share) < 1.0 else 3}g} %"


def _unit_of(ratio: float) -> str | None:
    """None: no unit is by such a factor larger or smaller than the SI unit."""
    size = max(ratio, 1.0 / ratio)
    return next((name for factor, name in UNITS.items() if abs(size / factor - 1.0) < 0.05), None)


def _unit_in_words(ratio: float) -> str:
    return f"{_unit_of(ratio)} times" if ratio > 1.0 else f"one in {_unit_of(ratio)} of"


def _lags(motion: Motion, found: Kinematics, _machine: Machine) -> Step:
    value, sigma = found.value["lag"], found.sigma["lag"]
    common = _common(value, sigma, LAG_S)
    legs = [tuple(range(LEGS))] if common is not None else [(leg,) for leg in _single(value, sigma, LAG_S)]
    for group in legs:
        size = common if common is not None else float(value[group[0]])
        mended = replace(motion.record, displacement_m=_shifted(motion.record, -size, group))
        # nothing is early: a velocity is late by itself or with the forces, or the displacement is
        channel = Channel.DISPLACEMENT if size < 0.0 else Channel.VELOCITY
        own = size if channel == Channel.VELOCITY else -size
        who = "all" if len(group) == LEGS else f"leg {group[0] + 1}:"
        when = "late" if own > 0.0 else "early"
        words = f"{who} {channel}{' channels are' if len(group) == LEGS else ' is'} {plain(1e3 * abs(own))} ms {when}"
        finding = Finding(
            Cause(Defect.LATE, channel),
            words,
            "look at filters and sampling of the channel, or commission the delay",
            () if len(group) == LEGS else group,
            own,
            "s",
            abs(size) / float(np.nanmax(sigma[list(group)])),
            is_input=abs(own) > INPUT_LAG_S,
            is_harmless=abs(own) < HARMLESS_LAG_S,
        )
        yield finding, mended if channel == Channel.DISPLACEMENT else motion.record


def _shifted(record: Record, late_s: float, legs: tuple[int, ...]) -> Array:
    """Displacements as they would be read without being late."""
    values = record.displacement_m.copy()
    for leg in legs:
        values[:, leg] = np.interp(record.t_s + late_s, record.t_s, values[:, leg])
    return values


def _zeros(motion: Motion, found: Kinematics, machine: Machine) -> Step:
    """A velocity's zero and its drift, or a displacement that drifts."""
    zero, drift = found.value["zero"], found.value["drift"]
    with np.errstate(invalid="ignore"):
        is_of_drift = np.abs(zero) < OF_DRIFT * np.abs(drift) * (motion.record.t_s[-1] - motion.record.t_s[0])
        is_of_drift &= np.abs(drift) > SIGMAS * found.sigma["drift"]
    values = {"zero": np.where(is_of_drift, np.nan, zero), "drift": drift}
    for name, defect, unit, floor in (("zero", Defect.ZERO, "m/s", ZERO), ("drift", Defect.DRIFT, "m/s²", DRIFT)):
        value, sigma = values[name], found.sigma[name]
        least = floor * machine.velocity_sigma_m_s
        common = _common(value, sigma, least)
        legs = [tuple(range(LEGS))] if common is not None else [(leg,) for leg in _single(value, sigma, least)]
        for group in legs:
            record = motion.record
            size = common if common is not None else float(value[group[0]])
            ramp = size * (record.t_s - record.t_s[0])[:, None] * np.isin(np.arange(LEGS), group)
            mended = replace(record, displacement_m=record.displacement_m + ramp)
            is_displacement = name == "zero" and motion.is_worse_than(mended)
            who = "all velocity zeros are" if len(group) == LEGS else f"leg {group[0] + 1}: the velocity's zero is"
            words = (
                f"{who} {plain(1e3 * size)} mm/s off"
                if name == "zero"
                else f"{who} drifting by {plain(1e3 * size)} mm/s per second"
            )
            if is_displacement:
                words = f"{legs_in_words(group)}: displacement drifts by {plain(-1e3 * size)} mm/s"
            yield (
                Finding(
                    Cause(Defect.DRIFT, Channel.DISPLACEMENT) if is_displacement else Cause(defect, Channel.VELOCITY),
                    words,
                    "calibrate the sensor",
                    () if len(group) == LEGS else group,
                    -size if is_displacement else size,
                    unit,
                    abs(size) / float(np.nanmax(sigma[list(group)])),
                ),
                mended if is_displacement else record,
            )
