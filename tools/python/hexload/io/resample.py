"""A log on regular ticks: what lies between two rows is taken from the straight line between them.

That of a motion of 10 m/s^2 at rows 1 ms apart is off by 1.3 um at most. White noise of rows becomes smaller, by a third
of its variance on the average, and is no longer white: sigmas are then on the safe side.
"""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from hexload.errors import InputError
from hexload.io.log_file import LegLog

LONGEST_BRIDGE = (
    3.0  # periods between rows, of the log's own or of the ticks, that are bridged; beyond, ticks are missing
)
Array = NDArray[np.float64]


def resampled(parts: Iterator[LegLog], period_s: float) -> Iterator[LegLog]:
    """`parts` at multiples of `period_s` after the first row. Raises InputError for a period that is no estimator's."""
    if not 1e-4 <= period_s <= 5e-3:
        raise InputError(f"--resample: found {period_s:g}, expected a sampling period in s, 0.0001 to 0.005")
    before: LegLog | None = None
    start_s, bridge_s = 0.0, 0.0
    for part in parts:
        if before is None:
            start_s = part.t_s[0]
            bridge_s = LONGEST_BRIDGE * max(period_s, float(np.median(np.diff(part.t_s))))
            remark = f"resampled to {1e3 * period_s:g} ms; stretches of more than {1e3 * bridge_s:g} ms without rows are left out"
            part = LegLog(part.t_s, part.displacement_m, part.velocity_m_s, part.force_n, (*part.remarks, remark))
            rows = part
        else:
            rows = _after(before, part)
        made = _on_ticks(rows, start_s, period_s, bridge_s, is_first=before is None)
        before = part
        if len(made.t_s):
            yield made


def _after(before: LegLog, part: LegLog) -> LegLog:
    last = before.rows(slice(-1, None))
    names = ("t_s", "displacement_m", "velocity_m_s", "force_n")
    return LegLog(*(np.concatenate([getattr(last, name), getattr(part, name)]) for name in names), part.remarks)


def _on_ticks(rows: LegLog, start_s: float, period_s: float, bridge_s: float, is_first: bool) -> LegLog:
    """From the first row, which is its own or the last of the part before, to the last."""
    after = 0.0 if is_first else np.floor((rows.t_s[0] - start_s) / period_s + 1e-6) + 1.0
    ticks = np.arange(after, np.floor((rows.t_s[-1] - start_s) / period_s + 1e-6) + 1.0)
    t_s = start_s + period_s * ticks
    right = np.clip(np.searchsorted(rows.t_s, t_s - 1e-6 * period_s), 1, len(rows.t_s) - 1)
    left = right - 1
    gap_s = rows.t_s[right] - rows.t_s[left]
    share = np.clip((t_s - rows.t_s[left]) / gap_s, 0.0, 1.0)
    is_there = (gap_s <= bridge_s) | (share <= 1e-6) | (share >= 1.0 - 1e-6)
    left, right, share, t_s = left[is_there], right[is_there], share[is_there, None], t_s[is_there]
    channels = (rows.displacement_m, rows.velocity_m_s, rows.force_n)
    return LegLog(t_s, *(_between(values, left, right, share) for values in channels), rows.remarks)


def _between(values: Array, left: Array, right: Array, share: Array) -> Array:
    """A row that is met is taken as it is, whatever is missing beside it."""
    line = values[left] + share * (values[right] - values[left])
    return np.where(share == 0.0, values[left], np.where(share == 1.0, values[right], line))
