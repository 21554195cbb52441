"""The figures of a campaign's page, as plotly objects. One colour per class in those of the controller's own filter."""

from collections.abc import Sequence

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray
from scipy.stats import chi2

from hexload.campaign.statistics import PARAMETERS, ClassStatistics
from hexload.report.figures import BAND, INK, REFERENCE, finish
from hexload.theory.bound import THETA_NAMES

Array = NDArray[np.float64]

COLOURS = ("#1d5fa6", "#d97706", "#15803d", "#b91c1c", "#7c3aed", "#0e7490", "#be185d", "#4d7c0f", "#78350f", "#475569")
HEIGHT = 380
WIDE = 4.0  # largest over smallest: less has too few round numbers between
DIGITS_2_AND_5 = "D2"  # between the powers of ten of an axis
SHARES = {"title": "runs, %", "range": [0, 101]}


def colour_of(position: int) -> str:
    return COLOURS[position % len(COLOURS)]


def dash_of(position: int) -> str:
    """Of lines, as there may be more of them than colours."""
    return ("solid", "dash", "dot", "dashdot")[position // len(COLOURS) % 4]


def height_for(entries: int) -> int:
    """With room for the legend's rows of about five entries."""
    return HEIGHT + 19 * ((entries - 1) // 5)


def ratios(statistics: Sequence[ClassStatistics]) -> go.Figure:
    """RMSE / bound of the controller's filter, parameter by parameter; the band is that of an efficient estimator."""
    figure = go.Figure()
    for position, entry in enumerate(statistics):
        ratio = entry.own.ratio
        marker = {"color": colour_of(position), "size": 9, "symbol": position}
        figure.add_trace(go.Scatter(x=THETA_NAMES, y=ratio, mode="markers", name=entry.name, marker=marker))
    low, high = statistics[0].ratio_band
    figure.add_hrect(y0=low, y1=high, fillcolor=BAND, line_width=0, layer="below")
    figure.add_hline(y=1.0, line={"color": INK, "width": 1})
    figure.update_layout(scattermode="group")  # side by side, as many are alike
    shown = np.concatenate([[low, high], *(entry.own.ratio for entry in statistics)])
    is_wide = shown.max() > WIDE * shown.min()
    figure.update_yaxes(title="RMSE / bound", type="log", dtick=DIGITS_2_AND_5 if is_wide else None)
    return finish(figure, height_for(len(statistics)))


def rivals(statistics: Sequence[ClassStatistics], words: dict[str, str]) -> go.Figure:
    """RMSE / bound, mean over the parameters, of every estimator, whose names are put in words."""
    figure = go.Figure()
    for position, name in enumerate(dict.fromkeys(name for entry in statistics for name in entry.estimators)):
        entries = [entry for entry in statistics if name in entry.estimators]
        means = [entry.estimators[name].ratio_mean for entry in entries]
        marker = {"color": colour_of(position), "size": 10, "symbol": position}
        classes = [entry.name for entry in entries]
        figure.add_trace(go.Scatter(x=classes, y=means, mode="markers", name=words[name], marker=marker))
    figure.add_hline(y=1.0, line={"color": INK, "width": 1})
    figure.update_layout(scattermode="group")
    figure.update_yaxes(title="RMSE / bound, mean of ten", type="log", dtick=1)
    return finish(figure, HEIGHT)


def nees(by_class: dict[str, list[dict]]) -> go.Figure:
    """Share of runs below each NEES of the controller's filter, and what chi-square says."""
    figure = go.Figure()
    x = np.geomspace(1.0, 200.0, 200)
    ideal = {"color": REFERENCE, "width": 4}
    figure.add_trace(go.Scatter(x=x, y=100.0 * chi2.cdf(x, PARAMETERS), mode="lines", name="chi-square", line=ideal))
    for position, (name, results) in enumerate(by_class.items()):
        if results[0]["rig"] is not None:
            continue  # a rig's covariance is not the filter's alone
        values = np.sort([result["estimators"][result["controller"]]["nees"] for result in results])
        figure.add_trace(_steps(values, len(values), name, position))
    figure.update_xaxes(title="NEES", type="log", dtick=DIGITS_2_AND_5)
    figure.update_yaxes(**SHARES)
    return finish(figure, height_for(len(by_class)))


def settling(by_class: dict[str, list[dict]]) -> go.Figure:
    """Share of runs whose ten parameters are within 5 % of their scales for good."""
    figure, latest_s = go.Figure(), 0.0
    for position, (name, results) in enumerate(by_class.items()):
        times = [result["estimators"][result["controller"]].get("within_5") for result in results]
        settled = np.sort([time for time in times if time is not None])
        if len(settled):
            figure.add_trace(_steps(settled, len(times), name, position))
            latest_s = max(latest_s, settled[-1])
    figure.update_layout(showlegend=True)
    figure.update_xaxes(title="time since the load appeared, s", range=[0.0, 1.03 * latest_s or 1.0])
    figure.update_yaxes(**SHARES)
    return finish(figure, height_for(len(by_class)))


def _steps(values: Array, runs: int, name: str, position: int) -> go.Scatter:
    share = 100.0 * np.arange(len(values) + 1) / runs  # from none on
    line = {"color": colour_of(position), "dash": dash_of(position), "width": 1.6, "shape": "hv"}
    return go.Scatter(x=[values[0], *values], y=share, mode="lines", name=name, line=line)
