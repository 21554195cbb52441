"""A leg log on an even grid, with its gaps filled and marked."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hexload.io.log_file import LegLog

Array = NDArray[np.float64]

LONGEST_S = 60.0  # of a longer log the last minute
LONG_GAP = 2.5  # periods between two rows, from which what is between is not known
MOST_ROWS = 4  # of the grid for each of the log: more is no even sampling


@dataclass(frozen=True)
class Record:
    t_s: Array  # (n,), dt_s apart
    dt_s: float
    displacement_m: Array  # (n, 6)
    velocity_m_s: Array | None  # (n, 6); None: no velocity sensors
    force_n: Array  # (n, 6)
    is_known: NDArray[np.bool_]  # (n,) neither in a gap of the rows, nor is a displacement or force missing
    raw: LegLog  # the rows as they came


def record_of(log: LegLog) -> Record:
    """Raises ValueError when there are too few rows to say anything."""
    log = _last(log)
    if len(log.t_s) < 100:
        raise ValueError("too few rows")
    dt_s = float(np.median(np.diff(log.t_s)))
    count = int(np.floor((log.t_s[-1] - log.t_s[0]) / dt_s + 0.5)) + 1
    if count > MOST_ROWS * len(log.t_s):
        raise ValueError("rows far from an even grid")
    t_s = log.t_s[0] + dt_s * np.arange(count)
    is_known = _is_near(log.t_s, t_s, dt_s)
    parts = []
    for values in (log.displacement_m, log.velocity_m_s, log.force_n):
        parts.append(np.stack([_filled(log.t_s, leg, t_s) for leg in values.T], axis=1))
    for values in (log.displacement_m, log.force_n):
        for leg in values.T:
            is_known &= _is_near(log.t_s[np.isfinite(leg)], t_s, dt_s)
    velocity = parts[1] if np.isfinite(log.velocity_m_s).any(axis=0).all() else None
    return Record(t_s, dt_s, parts[0], velocity, parts[2], is_known, log)


def _last(log: LegLog) -> LegLog:
    start = int(np.searchsorted(log.t_s, log.t_s[-1] - LONGEST_S))
    return LegLog(*(part[start:] for part in (log.t_s, log.displacement_m, log.velocity_m_s, log.force_n)))


def _is_near(there_s: Array, at_s: Array, dt_s: float) -> NDArray[np.bool_]:
    """Whether there are values beside each moment, so near that it lies on a line between them."""
    if len(there_s) < 2:
        return np.zeros(len(at_s), bool)
    after = np.clip(np.searchsorted(there_s, at_s - 0.5 * dt_s), 1, len(there_s) - 1)
    return there_s[after] - there_s[after - 1] < LONG_GAP * dt_s


def _filled(t_s: Array, values: Array, at_s: Array) -> Array:
    there = np.isfinite(values)
    return np.interp(at_s, t_s[there], values[there]) if there.any() else np.zeros(len(at_s))
