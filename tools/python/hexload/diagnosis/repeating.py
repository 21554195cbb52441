"""Errors of displacements that repeat with the place: of a screw, a gear, or the marks of a scale.

What is fast in r of difference.py, summed by the place at which it was: the Fourier transform of that over the place has
a line at one over the pitch. Of white noise of n rows the squared line, over n variances, is exponential with mean 1, and
the sum over six legs has the mean 6.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from hexload.diagnosis.cause import Cause, Channel, Defect
from hexload.diagnosis.difference import difference_of, running_means
from hexload.diagnosis.dynamics import Machine
from hexload.diagnosis.finding import Finding, legs_in_words, plain
from hexload.diagnosis.record import Record
from hexload.theory.kinematics import LEGS

Array = NDArray[np.float64]

FAST_S = 0.05  # what is slower than twice that may be a motion that is not followed
PLACES, PLACE_M = 8192, 1e-4
PLACE_ROWS = 11  # whose mean is a place: the noise of one row's own is in its r too
PITCH_M = (1e-3, 2e-2)
LEAST = 60.0  # of the sum: of noise alone in one of 1e15 lines
LEAST_LEG = 20.0


def take_out(record: Record, machine: Machine) -> tuple[list[Finding], Record]:
    """The error, if there is one, and the record without it."""
    if record.velocity_m_s is None or not record.is_known.all():
        return [], record
    rows = 2 * max(1, round(0.5 * FAST_S / record.dt_s)) + 1
    if len(record.t_s) < 10 * rows or rows < PLACE_ROWS:
        return [], record
    inner = slice(rows // 2, len(record.t_s) - rows // 2)
    r = difference_of(record, rows)
    fast = r[inner] - running_means(r, rows)
    place_m = running_means(record.displacement_m, PLACE_ROWS)[(rows - PLACE_ROWS) // 2 :][: len(fast)]
    variance = np.maximum(np.mean(fast**2, axis=0), machine.displacement_sigma_m**2)
    power = np.stack([_power(fast[:, leg], place_m[:, leg]) for leg in range(LEGS)], axis=1)
    power /= len(fast) * variance
    per_m = np.fft.rfftfreq(PLACES, PLACE_M)
    is_pitch = (per_m > 1.0 / PITCH_M[1]) & (per_m < 1.0 / PITCH_M[0])
    best = int(np.where(is_pitch, power.sum(axis=1), 0.0).argmax())
    if power[best].sum() < LEAST:
        return [], record
    wave = _waves(record, r, float(per_m[best]), rows)
    legs = tuple(np.flatnonzero(power[best] > LEAST_LEG).tolist())
    size_m = float(np.sqrt(2.0 * np.mean(wave[:, list(legs) or slice(None)] ** 2)))
    who = "displacements" if len(legs) in (0, LEGS) else f"displacements of {legs_in_words(legs)}"
    finding = Finding(
        Cause(Defect.PERIODIC, Channel.DISPLACEMENT),
        f"{who} are off by {plain(1e3 * size_m)} mm with every {plain(1e3 / per_m[best], 3)} mm of travel, as by a screw, a gear or "
        "a scale",
        "look at the encoder and what drives it, or calibrate it over one turn",
        () if len(legs) == LEGS else legs,
        size_m,
        "m",
    )
    return [finding], replace(record, displacement_m=record.displacement_m - wave)


def _power(fast: Array, place_m: Array) -> Array:
    """Of each line."""
    at = np.floor((place_m - place_m.min()) / PLACE_M).astype(int) % PLACES
    sums = np.bincount(at, weights=fast, minlength=PLACES)
    return np.abs(np.fft.rfft(sums)) ** 2


def _waves(record: Record, r: Array, per_m: float, rows: int) -> Array:
    """The error of each leg, (n, 6), by least squares of what is fast."""
    waves = np.empty_like(r)
    for leg in range(LEGS):
        phase = 2.0 * np.pi * per_m * record.displacement_m[:, leg]
        both = np.stack([np.cos(phase), np.sin(phase)], axis=1)
        inner = slice(rows // 2, len(r) - rows // 2)
        fast, target = both[inner] - running_means(both, rows), r[inner, leg] - running_means(r[:, leg], rows)
        waves[:, leg] = both @ np.linalg.lstsq(fast, target, rcond=None)[0]
    return waves
