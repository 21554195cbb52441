"""Zeros that jump, or are off for a while: of a displacement, or of a velocity, in what the one has gone beyond the other
(r of difference.py).

A displacement that is off for a while is a box in r, with two jumps of opposite sign, and one whose zero or gain jumps a
step; a velocity that is off for a while is a ramp, with two such kinks, and one whose zero jumps a ramp without an end.
Jumps and kinks are differences of means over some rows, held against their own median: what is slow, as a gain or a lag,
is in neither. A large kink has jumps, and a jump has kinks: what leaves least of r is the cause.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hexload.diagnosis.cause import Cause, Channel, Defect
from hexload.diagnosis.channels import MAD
from hexload.diagnosis.difference import difference_of, running_means
from hexload.diagnosis.dynamics import Machine
from hexload.diagnosis.finding import SIGMAS, Finding, plain
from hexload.diagnosis.record import Record
from hexload.theory.kinematics import LEGS

Array = NDArray[np.float64]

MEAN_S = 0.02  # of each side of a jump
KINK_S = 0.25  # of each side of a kink
ALIKE = 0.6  # of the smaller of two sizes to the larger one
LEAST_SHARE = 0.3  # of the leg's largest: less may be what a large one makes of all that lasts
OTHERS = 0.5  # of the leg's own, that the others have at most: what all have is a motion that is not followed
EXPLAINED = 0.5  # of r's square, that what has no end leaves at most: what wanders or is bent has jumps and kinks, too


def take_out(record: Record, machine: Machine) -> tuple[list[Finding], Record]:
    """What was off, at most one channel of one leg, and the record without it."""
    if record.velocity_m_s is None or not record.is_known.all():
        return [], record
    mean_rows, kink_rows = (max(2, round(span / record.dt_s)) for span in (MEAN_S, KINK_S))
    if len(record.t_s) < 6 * kink_rows:
        return [], record
    r = difference_of(record, mean_rows)
    of_way = machine.displacement_sigma_m / np.sqrt(mean_rows)
    of_speed = machine.velocity_sigma_m_s / np.sqrt(kink_rows)
    jumps = _events(_jumps(r, mean_rows), 3 * mean_rows, of_way)
    kinks = _kinks(r, mean_rows, kink_rows) / KINK_S
    kinks = _events(kinks, kink_rows + mean_rows, np.hypot(of_speed, of_way / KINK_S))
    causes = [*_of_displacement(record, r, jumps), *_of_velocity(record, r, kinks)]
    if not causes:
        return [], record
    best = min(causes, key=lambda cause: cause.left)
    return [best.finding], best.mended


@dataclass(frozen=True)
class _Events:
    """Changes that stand out."""

    leg: int
    rows: list[int]  # from the first on
    sizes: Array
    sigmas: float  # of the least
    is_alone: bool  # other legs have none then

    @property
    def is_one(self) -> bool:
        return self.is_alone and len(self.rows) == 1

    @property
    def size(self) -> float:
        """Of one, or of a pair the mean."""
        return float(self.sizes[0] if len(self.rows) == 1 else 0.5 * (self.sizes[0] - self.sizes[1]))

    @property
    def are_opposite(self) -> bool:
        """Two, of which the second takes the first back."""
        sizes = np.abs(self.sizes)
        is_pair = len(sizes) == 2 and self.sizes[0] * self.sizes[1] < 0.0
        return self.is_alone and is_pair and bool(sizes.min() > ALIKE * sizes.max())


@dataclass(frozen=True)
class _Explained:
    finding: Finding
    mended: Record
    left: float  # of the leg's r, its sum of squares


def _of_displacement(record: Record, r: Array, jumps: _Events | None) -> Iterator[_Explained]:
    if jumps is None:
        return
    if jumps.are_opposite:
        box = _between(record, jumps)
        mended = replace(record, displacement_m=record.displacement_m - _of_leg(jumps.leg, jumps.size * box))
        left = _share_and_left(record, r, jumps.leg, box)[1]
        yield _Explained(_pulse(record, jumps, jumps.size, Channel.DISPLACEMENT, "m"), mended, left)
    elif jumps.is_one and (step := _step(record, r, jumps)).left < _most_left(record, r, jumps):
        yield step


def _of_velocity(record: Record, r: Array, kinks: _Events | None) -> Iterator[_Explained]:
    if kinks is None or not (kinks.are_opposite or kinks.is_one):
        return
    leg = kinks.leg
    off = _between(record, kinks) if kinks.are_opposite else _since(record, kinks.rows[0])
    size, left = _share_and_left(record, r, leg, np.cumsum(off) * record.dt_s)
    mended = replace(record, velocity_m_s=record.velocity_m_s + _of_leg(leg, size * off))
    if kinks.are_opposite:
        yield _Explained(_pulse(record, kinks, size, Channel.VELOCITY, "m/s"), mended, left)
    elif left < _most_left(record, r, kinks):
        yield _Explained(_zero_step(record, kinks, -size, Channel.VELOCITY, "m/s"), mended, left)


def _most_left(record: Record, r: Array, event: _Events) -> float:
    return EXPLAINED * _last(_lasting(record, event.leg), r[:, event.leg])[1]


def _since(record: Record, row: int) -> Array:
    return (np.arange(len(record.t_s)) >= row).astype(float)


def _between(record: Record, pair: _Events) -> Array:
    return _since(record, pair.rows[0]) - _since(record, pair.rows[1])


def _of_leg(leg: int, values: Array) -> Array:
    """(n, 6) that are zero but for one leg's, (n,)."""
    return values[:, None] * (np.arange(LEGS) == leg)


def _step(record: Record, r: Array, jump: _Events) -> _Explained:
    """Of a zero, or of a gain, whichever explains more of r."""
    leg, row = jump.leg, jump.rows[0]
    since = _since(record, row)
    shapes = (since, since * record.displacement_m[:, leg])
    (_, zero_left), (share, gain_left) = (_share_and_left(record, r, leg, shape) for shape in shapes)
    if zero_left <= gain_left:  # what the integral of the velocity drifts by is not in the jump's size
        mended = replace(record, displacement_m=record.displacement_m - _of_leg(leg, jump.size * since))
        return _Explained(_zero_step(record, jump, jump.size, Channel.DISPLACEMENT, "m"), mended, zero_left)
    size = share / (1.0 - share)  # the share is of what is shown, the gain of what is true
    words = f"gain of its displacement jumps by {plain(100.0 * abs(size))} % at {record.t_s[row]:.2f} s"
    finding = _finding(Defect.GAIN_STEP, Channel.DISPLACEMENT, jump, words, size, "")
    mended = replace(record, displacement_m=record.displacement_m - _of_leg(leg, share * shapes[1]))
    return _Explained(finding, mended, gain_left)


def _zero_step(record: Record, event: _Events, size: float, channel: Channel, unit: str) -> Finding:
    at_s = float(record.t_s[event.rows[0]])
    words = f"zero of its {channel} jumps by {plain(1e3 * abs(size))} m{unit} at {at_s:.2f} s"
    return _finding(Defect.ZERO_STEP, channel, event, words, size, unit)


def _finding(defect: Defect, channel: Channel, event: _Events, words: str, size: float, unit: str) -> Finding:
    """`words`: of the leg."""
    sentence, mend = f"leg {event.leg + 1}: {words}", f"look at its {channel} sensor and the cable"
    return Finding(Cause(defect, channel), sentence, mend, (event.leg,), size, unit, event.sigmas)


def _share_and_left(record: Record, r: Array, leg: int, shape: Array) -> tuple[float, float]:
    """How much of the shape is in the leg's r, and the sum of squares that it leaves beside all that lasts."""
    return _last(np.column_stack([_lasting(record, leg), shape]), r[:, leg])


def _lasting(record: Record, leg: int) -> Array:
    t = np.linspace(-1.0, 1.0, len(record.t_s))
    return np.stack([np.ones_like(t), t, t**2, record.displacement_m[:, leg], record.velocity_m_s[:, leg]], axis=1)


def _last(matrix: Array, values: Array) -> tuple[float, float]:
    """The last column's coefficient, and the sum of squares that all leave."""
    found = np.linalg.lstsq(matrix, values, rcond=None)[0]
    return float(found[-1]), float(np.sum((values - matrix @ found) ** 2))


def _pulse(record: Record, pair: _Events, size: float, channel: Channel, unit: str) -> Finding:
    start_s, end_s = (float(record.t_s[row]) for row in pair.rows)
    by = f"{plain(1e3 * abs(size))} m{unit}"
    words = f"zero of its {channel} is {by} off from {start_s:.2f} to {end_s:.2f} s"
    return replace(_finding(Defect.PULSE, channel, pair, words, start_s, "s"), until_s=end_s)


def _jumps(r: Array, rows: int) -> Array:
    """Of the mean after each row from that before it, less the same a little earlier and later, (n, 6); zero at the ends."""
    mean = running_means(r, rows)
    change = mean[rows:] - mean[:-rows]
    jump = np.zeros_like(r)
    beside = 0.5 * (change[: -4 * rows] + change[4 * rows :])
    jump[3 * rows : 3 * rows + len(beside)] = change[2 * rows : -2 * rows] - beside
    return jump


def _kinks(r: Array, rows: int, span: int) -> Array:
    """What r goes in a span after each row, less that in the one before, (n, 6); zero at the ends."""
    mean = running_means(r, rows)
    kink = np.zeros_like(r)
    kink[span + rows // 2 : span + rows // 2 + len(mean) - 2 * span] = (
        mean[2 * span :] - 2.0 * mean[span:-span] + mean[: -2 * span]
    )
    return kink


def _events(change: Array, apart: int, least: float) -> _Events | None:
    """Of the leg that has the largest, three at most. `least`: noise that there is in any case."""
    sigma = MAD * np.median(np.median(np.abs(change[change.any(axis=1)]), axis=0))  # of a leg in the middle
    sigma = max(float(sigma), least)
    score = np.abs(change) / sigma
    leg = int(score.max(axis=0).argmax())
    own, rows = score[:, leg].copy(), []
    least_score = max(SIGMAS, LEAST_SHARE * float(own.max()))
    while own.max() > least_score and len(rows) < 3:
        rows.append(int(own.argmax()))
        own[max(0, rows[-1] - apart) : rows[-1] + apart] = 0.0
    if not rows:
        return None
    rows.sort()
    others = np.delete(score[rows], leg, axis=1).max()
    lowest = float(score[rows, leg].min())
    return _Events(leg, rows, change[rows, leg], lowest, bool(others < OTHERS * lowest))
