"""Normalised innovation squared (NIS) of a run against what a consistent filter shows.

For such a filter NIS is chi-square distributed with as many degrees of freedom as measurements, and white, so that the
sum over w ticks is chi-square with w times as many (Bar-Shalom, Li, Kirubarajan, Estimation with Applications to
Tracking and Navigation, Wiley 2001, section 5.4).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hexload.theory import chi_square

PAPER_MEASUREMENTS = 3  # of the paper's filter: wx, wy, wz
LOAD_MEASUREMENTS = 6  # of the momentum filters: the leg speeds
WINDOW_TICKS = 100
BAND = (0.025, 0.975)  # 95 %, two-sided


@dataclass(frozen=True)
class NisSummary:
    measurements: int
    mean: float  # ideal: measurements
    tick_band: tuple[float, float]
    ticks_in_band: float  # fraction, ideal 0.95
    window_t_s: NDArray[np.float64]  # end of each window
    window_mean: NDArray[np.float64]
    window_band: tuple[float, float]
    windows_in_band: float  # fraction, ideal 0.95


def summarise(t_s: NDArray[np.float64], nis: NDArray[np.float64], measurements: int) -> NisSummary:
    """Runs shorter than one window are one window."""
    window = min(WINDOW_TICKS, len(nis))
    count = len(nis) // window
    window_mean = nis[: count * window].reshape(count, window).mean(axis=1)
    tick_band = _band(1, measurements)
    window_band = _band(window, measurements)
    return NisSummary(
        measurements=measurements,
        mean=float(nis.mean()),
        tick_band=tick_band,
        ticks_in_band=_fraction_inside(nis, tick_band),
        window_t_s=t_s[window - 1 : count * window : window],
        window_mean=window_mean,
        window_band=window_band,
        windows_in_band=_fraction_inside(window_mean, window_band),
    )


def _band(ticks: int, measurements: int) -> tuple[float, float]:
    low, high = (chi_square.quantile(share, measurements * ticks) / ticks for share in BAND)
    return low, high


def _fraction_inside(values: NDArray[np.float64], band: tuple[float, float]) -> float:
    return float(np.mean((values >= band[0]) & (values <= band[1])))
