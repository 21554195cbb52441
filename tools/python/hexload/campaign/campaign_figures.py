"""The figures of a campaign's page. One colour per class in those of the controller's own filter."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy.stats import chi2

from hexload.campaign.statistics import PARAMETERS, ClassStatistics
from hexload.report.charts import COLOURS, REFERENCE, Chart, Panel, Series
from hexload.theory.bound import THETA_NAMES

Array = NDArray[np.float64]

HEIGHT = 350
SHARES = (0.0, 101.0)
GROUP = 0.7  # of the distance between two names: what stands side by side at one of them


def colour_of(position: int) -> str:
    return COLOURS[position % len(COLOURS)]


def dash_of(position: int) -> str:
    """Of lines, as there may be more of them than colours."""
    return ("", "7 4", "2 3", "8 3 2 3")[position // len(COLOURS) % 4]


def _aside(position: int, count: int) -> float:
    """Where the one at `position` of `count` stands beside a name."""
    return GROUP * ((position + 0.5) / count - 0.5)


def _dots(places: Array, values: Array, position: int, count: int, name: str) -> Series:
    x = np.asarray(places, float) + _aside(position, count)
    return Series(x, np.asarray(values, float), colour_of(position), name, kind="dots", symbol=position, size=4.0)


def ratios(statistics: Sequence[ClassStatistics]) -> Chart:
    """RMSE / bound of the controller's filter, parameter by parameter; the band is that of an efficient estimator."""
    places = np.arange(len(THETA_NAMES))
    dots = [
        _dots(places, entry.own.ratio, position, len(statistics), entry.name)
        for position, entry in enumerate(statistics)
    ]
    band = tuple(float(edge) for edge in statistics[0].ratio_band)
    panel = Panel("RMSE / bound", dots, x_title="", x_names=tuple(THETA_NAMES), y_log=True, levels=(1.0,), shade=band)
    return Chart([panel], height=HEIGHT)


def rivals(statistics: Sequence[ClassStatistics], words: dict[str, str]) -> Chart:
    """RMSE / bound, mean over the parameters, of every estimator, whose names are put in words."""
    names = list(dict.fromkeys(name for entry in statistics for name in entry.estimators))
    dots = []
    for position, name in enumerate(names):
        places = [place for place, entry in enumerate(statistics) if name in entry.estimators]
        means = [statistics[place].estimators[name].ratio_mean for place in places]
        dots.append(_dots(places, means, position, len(names), words[name]))
    classes = tuple(entry.name for entry in statistics)
    panel = Panel("RMSE / bound, mean of ten", dots, x_title="", x_names=classes, y_log=True, levels=(1.0,))
    return Chart([panel], height=HEIGHT)


def nees(by_class: dict[str, list[dict]]) -> Chart:
    """Share of runs below each NEES of the controller's filter, and what chi-square says."""
    x = np.geomspace(1.0, 200.0, 200)
    curves = [Series(x, 100.0 * chi2.cdf(x, PARAMETERS), REFERENCE, "chi-square", width=4.0)]
    for position, (name, results) in enumerate(by_class.items()):
        if results[0]["rig"] is not None:
            continue  # a rig's covariance is not the filter's alone
        values = np.sort([result["estimators"][result["controller"]]["nees"] for result in results])
        curves.append(_steps(values, len(values), name, position))
    return Chart([Panel("runs, %", curves, x_title="NEES", x_log=True, y_range=SHARES)], height=HEIGHT)


def settling(by_class: dict[str, list[dict]]) -> Chart:
    """Share of runs whose ten parameters are within 5 % of their scales for good."""
    curves, latest_s = [], 0.0
    for position, (name, results) in enumerate(by_class.items()):
        times = [result["estimators"][result["controller"]].get("within_5") for result in results]
        settled = np.sort([time for time in times if time is not None])
        if len(settled):
            curves.append(_steps(settled, len(times), name, position))
            latest_s = max(latest_s, settled[-1])
    title, x_range = "time since the load appeared, s", (0.0, 1.03 * latest_s or 1.0)
    return Chart([Panel("runs, %", curves, x_title=title, x_range=x_range, y_range=SHARES)], height=HEIGHT)


def _steps(values: Array, runs: int, name: str, position: int) -> Series:
    x, share = np.array([values[0], *values]), 100.0 * np.arange(len(values) + 1) / runs  # from none on
    return Series(x, share, colour_of(position), name, kind="steps", width=1.6, dash=dash_of(position))
