"""Zeros that jump, or are off for a while: of a displacement, or of a velocity, in what the one has gone beyond the other
(r of difference.py).

A displacement that is off for a while is a box in r, with two jumps of opposite sign, and one whose zero or gain jumps a
step; a velocity that is off for a while is a ramp, with two such kinks. Jumps and kinks are differences of means over some
rows, held against their own median: what is slow, as a gain or a lag, is in neither.
"""

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
OTHERS = 0.5  # of the leg's own, that the others have at most: what all have is a motion that is not followed


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
    if jumps is not None and len(jumps.rows) == 1:
        return _step(record, r, jumps)
    if jumps is not None:
        if not jumps.are_opposite:
            return [], record
        mended = replace(record, displacement_m=record.displacement_m - _box(record, jumps))
        return [_found(record, jumps, Channel.DISPLACEMENT, "mm")], mended
    kinks = _events(_kinks(r, mean_rows, kink_rows) / KINK_S, kink_rows, np.hypot(of_speed, of_way / KINK_S))
    if kinks is None or not kinks.are_opposite:
        return [], record
    mended = replace(record, velocity_m_s=record.velocity_m_s + _box(record, kinks))
    return [_found(record, kinks, Channel.VELOCITY, "mm/s")], mended


@dataclass(frozen=True)
class _Events:
    """Changes that stand out."""

    leg: int
    rows: list[int]  # from the first on
    sizes: Array
    sigmas: float  # of the least
    is_alone: bool  # other legs have none then

    @property
    def are_opposite(self) -> bool:
        """Two, of which the second takes the first back."""
        sizes = np.abs(self.sizes)
        is_pair = len(sizes) == 2 and self.sizes[0] * self.sizes[1] < 0.0
        return self.is_alone and is_pair and bool(sizes.min() > ALIKE * sizes.max())


def _box(record: Record, pair: _Events) -> Array:
    off = np.zeros_like(record.displacement_m)
    off[pair.rows[0] : pair.rows[1], pair.leg] = 0.5 * (pair.sizes[0] - pair.sizes[1])
    return off


def _step(record: Record, r: Array, jump: _Events) -> tuple[list[Finding], Record]:
    """Of a zero, or of a gain, whichever explains more of r."""
    if not jump.is_alone:
        return [], record
    leg, row = jump.leg, jump.rows[0]
    since = (np.arange(len(r)) >= row).astype(float)
    t, place_m = np.linspace(-1.0, 1.0, len(r)), record.displacement_m[:, leg]
    lasting = [np.ones_like(t), t, t**2, place_m, record.velocity_m_s[:, leg]]
    shapes = (since, since * place_m)
    (_, zero_left), (share, gain_left) = (_last(np.stack([*lasting, shape], axis=1), r[:, leg]) for shape in shapes)
    is_gain = gain_left < zero_left
    zero_m = float(jump.sizes[0])  # what the integral of the velocity drifts by is not in it
    size = share / (1.0 - share) if is_gain else zero_m  # the share is of what is shown, the gain of what is true
    what, by = ("gain", f"{plain(100.0 * abs(size))} %") if is_gain else ("zero", f"{plain(1e3 * abs(size))} mm")
    finding = Finding(
        Cause(Defect.GAIN_STEP if is_gain else Defect.ZERO_STEP, Channel.DISPLACEMENT),
        f"leg {leg + 1}: {what} of its displacement jumps by {by} at {record.t_s[row]:.2f} s",
        "look at its displacement sensor and the cable",
        (leg,),
        size,
        "" if is_gain else "m",
        jump.sigmas,
    )
    off = ((share if is_gain else zero_m) * shapes[is_gain])[:, None] * (np.arange(LEGS) == leg)
    return [finding], replace(record, displacement_m=record.displacement_m - off)


def _last(matrix: Array, values: Array) -> tuple[float, float]:
    """The last column's coefficient, and the sum of squares that all leave."""
    found = np.linalg.lstsq(matrix, values, rcond=None)[0]
    return float(found[-1]), float(np.sum((values - matrix @ found) ** 2))


def _found(record: Record, pair: _Events, channel: Channel, unit: str) -> Finding:
    start_s, end_s = (float(record.t_s[row]) for row in pair.rows)
    size = plain(1e3 * float(np.abs(pair.sizes).mean()))
    return Finding(
        Cause(Defect.PULSE, channel),
        f"leg {pair.leg + 1}: zero of its {channel} is {size} {unit} off from {start_s:.2f} to {end_s:.2f} s",
        f"look at its {channel} sensor and the cable",
        (pair.leg,),
        start_s,
        "s",
        pair.sigmas,
        until_s=end_s,
    )


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
    while own.max() > SIGMAS and len(rows) < 3:
        rows.append(int(own.argmax()))
        own[max(0, rows[-1] - apart) : rows[-1] + apart] = 0.0
    if not rows:
        return None
    rows.sort()
    others = np.delete(score[rows], leg, axis=1).max()
    lowest = float(score[rows, leg].min())
    return _Events(leg, rows, change[rows, leg], lowest, bool(others < OTHERS * lowest))
