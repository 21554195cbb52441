"""Single values that are no part of their channel's course: a bit that fell over, a plug that was touched.

A least-squares fit or a mean takes such a value for the whole channel's fault, so it is found first, by what 96 % of the
channel's values span: a value that lies many times as far off, from one row to the next, and for a few rows only.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hexload.io.log_file import LegLog

Array = NDArray[np.float64]

USUAL = (0.02, 0.98)  # quantiles
FEWEST_ROWS = 100  # of which two at each end may be stray
SPANS = 3.0  # of the usual values, beyond which nothing of the same channel lies
MOST_ROWS = 10  # in a row: what lasts longer may be a motion after a long rest
NOISE_SPAN = 4.1  # of white noise, in sigmas: a channel that stands still spans no less
KINDS = {"displacement": ("displacement_m", "m"), "velocity": ("velocity_m_s", "m/s"), "force": ("force_n", "N")}


@dataclass(frozen=True)
class Stray:
    channel: str
    leg: int
    row: int  # of the part
    t_s: float
    value: float
    usual: tuple[float, float]

    @property
    def words(self) -> str:
        low, high = self.usual
        return (
            f"{self.channel} of leg {self.leg + 1} at {self.t_s:.9g} s: found {self.value:.4g} {KINDS[self.channel][1]}, "
            f"nearly all others are {low:.4g} to {high:.4g}"
        )


def noise_of(platform) -> tuple[float, float, float]:
    """Of hexload_native.Platform, for strays_of()."""
    return platform.displacement_sigma_m, platform.velocity_sigma_m_s, platform.force_sigma_n


def strays_of(part: LegLog, sigmas: Sequence[float] = (0.0, 0.0, 0.0)) -> list[Stray]:
    """In time. `sigmas`: noise of displacement, velocity and force."""
    found = [stray for channel, sigma in zip(KINDS, sigmas, strict=True) for stray in _of_channel(part, channel, sigma)]
    return sorted(found, key=lambda stray: stray.row)


def without(part: LegLog, strays: Sequence[Stray]) -> LegLog:
    """With these values missing."""
    for name, (key, _) in KINDS.items():
        places = [(stray.row, stray.leg) for stray in strays if stray.channel == name]
        if places:
            values = getattr(part, key).copy()
            values[tuple(np.transpose(places))] = np.nan
            part = replace(part, **{key: values})
    return part


def in_words(strays: Sequence[Stray], count: int) -> str:
    """What is said of `count` of them, of which these are the first; nothing of none."""
    if not count:
        return ""
    if count == 1:
        return f"one value is far from all others of its channel: {strays[0].words}"
    return f"{count} values are far from all others of their channels; the first: {strays[0].words}"


def _of_channel(part: LegLog, channel: str, sigma: float) -> Iterator[Stray]:
    values = getattr(part, KINDS[channel][0])
    legs = np.flatnonzero(~np.isnan(values).all(axis=0))
    if len(values) < FEWEST_ROWS or not legs.size:
        return
    low, high = np.nanquantile(values[:, legs], USUAL, axis=0)
    reach = SPANS * np.maximum(high - low, NOISE_SPAN * sigma)
    is_far = (values[:, legs] < low - reach) | (values[:, legs] > high + reach)
    for k in np.flatnonzero(is_far.any(axis=0)):
        leg, usual = int(legs[k]), (float(low[k]), float(high[k]))
        for row in _sudden(values[:, leg], is_far[:, k], float(reach[k])):
            yield Stray(channel, leg, row, float(part.t_s[row]), float(values[row, leg]), usual)


def _sudden(values: Array, is_far: NDArray[np.bool_], reach: float) -> Iterator[int]:
    """Rows of runs that come and go from one row to the next, and are short."""
    edges = np.diff(np.concatenate([[0], is_far.astype(np.int8), [0]]))
    for start, end in zip(np.flatnonzero(edges == 1), np.flatnonzero(edges == -1), strict=True):
        comes = start == 0 or not abs(values[start] - values[start - 1]) <= reach  # also after a missing value
        goes = end == len(values) or not abs(values[end - 1] - values[end]) <= reach
        if end - start <= MOST_ROWS and comes and goes:
            yield from range(int(start), int(end))
