"""Estimates over time, each with its three-sigma band, beside the truth where it is known."""

import numpy as np
import viser
from numpy.typing import NDArray

from hexload.estimation.load_summary import SYMBOLS, unit_of_parameter
from hexload.view import colours
from hexload.view.frame import SIGMAS, Curves

Array = NDArray[np.float64]
HEIGHT_PX = 140
LEAST_PX = 18  # between numbers at the left: at the plot's own 30 some charts have one alone
FONT = "11px sans-serif"
OUTSIDE = 1e3  # ranges: far below the chart, from where the lines of load changes come
MARGIN = 0.08  # of the range, above and below
GROUPS = {
    "mass and moment": ("m", "hx", "hy", "hz", "dz"),
    "inertia": ("Ixx", "Iyy", "Izz"),
    "products": ("Ixy", "Ixz", "Iyz"),
}
ALL_IN_ONE = 5  # parameters that need no tabs


class CurvePanel:
    """A chart of each parameter, in a panel at the left."""

    def __init__(self, server: viser.ViserServer, names: tuple[str, ...]):
        self.names = names
        self._panel = server.gui.add_panel()
        self._charts: dict[str, viser.GuiUplotHandle] = {}
        groups = {"estimates": names} if len(names) <= ALL_IN_ONE else GROUPS
        for title, members in groups.items():
            with self._panel.add_tab(title):
                for name in members:
                    if name in names:
                        self._charts[name] = _add_chart(server, name)
        self._panel.dock_left()
        self._panel.set_width(400)

    def remove(self) -> None:
        self._panel.remove()

    def show(self, curves: Curves) -> None:
        for k, name in enumerate(self.names):
            columns = tuple(chart_columns(curves, k))
            shown = self._charts[name].data
            if not all(np.array_equal(old, new, equal_nan=True) for old, new in zip(shown, columns)):
                self._charts[name].data = columns

    def data(self, name: str) -> tuple[Array, ...]:
        return self._charts[name].data


def chart_columns(curves: Curves, k: int) -> list[Array]:
    """t, upper and lower edge of the band, value, truth, the moments at which another load was detected, the axis' range.

    The axis shows the later half of the time since the last load change well: the first seconds of an estimate that starts
    from nothing are no scale for what follows.
    """
    scale = _unit(curves.names[k])[1]
    value, spread, truth = (scale * part[:, k] for part in (curves.value, SIGMAS * curves.sigma, curves.truth))
    t = curves.t_s
    since = int(np.searchsorted(t, max(curves.load_changes_s, default=t[0])))
    low, high = _limits(*(part[since + (len(t) - since) // 2 :] for part in (value, spread, truth)))
    below = low - OUTSIDE * (high - low)
    rows = [value + spread, value - spread, value, truth]
    changes, limits = np.full(len(t), below), np.where(np.arange(len(t)) % 2 == 0, low, high)
    for moment_s in curves.load_changes_s:
        at = min(int(np.searchsorted(t, moment_s)), len(t) - 1)
        rows, limits = [np.insert(row, at, [row[at]] * 3) for row in rows], np.insert(limits, at, [low] * 3)
        t, changes = np.insert(t, at, [moment_s] * 3), np.insert(changes, at, [below, high, below])
    return [t, *rows, changes, limits]


def _limits(value: Array, spread: Array, truth: Array) -> tuple[float, float]:
    numbers = np.concatenate((value + spread, value - spread, truth[np.isfinite(truth)]))
    low, high = float(numbers.min()), float(numbers.max())
    margin = MARGIN * (high - low) or 1.0
    return low - margin, high + margin


def _unit(name: str) -> tuple[str, float]:
    """Of a chart's axis, and its size in SI units: the chart's ticks have three digits after the point."""
    unit = unit_of_parameter(name).replace("kg m^2", "kg m²")
    return ("mm", 1e3) if unit == "m" else (unit, 1.0)


def _add_chart(server: viser.ViserServer, name: str) -> viser.GuiUplotHandle:
    blue, band, orange = colours.css(colours.ESTIMATE), colours.css(colours.ESTIMATE, 0.18), colours.css(colours.TRUTH)
    unscaled = {"auto": False, "points": {"show": False}}  # `range` alone makes the axis
    edge = {"stroke": colours.css(colours.ESTIMATE, 0.35), "width": 0.5, **unscaled}
    ink, grid = colours.css(colours.INK), {"stroke": "rgba(0, 0, 0, 0.08)", "width": 1}
    axis = {"stroke": ink, "grid": grid, "font": FONT, "ticks": {"stroke": ink, "width": 1, "size": 4}}
    nothing = np.zeros(2)
    return server.gui.add_uplot(
        data=(np.array([0.0, 1.0]), *(nothing,) * 6),
        series=(
            {"label": "t, s"},
            {"label": "+3σ", **edge},
            {"label": "-3σ", **edge},
            {"label": "estimate", "stroke": blue, "width": 1.6, **unscaled},
            {"label": "truth", "stroke": orange, "width": 1.6, "dash": (6, 4), **unscaled},
            {"label": "load change", "stroke": colours.css(colours.CHANGE), "width": 1.5, **unscaled},
            {"label": "range", "stroke": colours.css(colours.INK, 0.0), "width": 0, "points": {"show": False}},
        ),
        bands=({"series": (1, 2), "fill": band},),
        title=f"{SYMBOLS.get(name, name)}, {_unit(name)[0]}",
        scales={"x": {"time": False}},
        axes=(
            {**axis, "size": 30, "label": "t, s", "labelSize": 18, "labelFont": FONT},
            {**axis, "size": 58, "space": LEAST_PX},
        ),
        padding=(8, 16, 0, 0),
        legend={"show": False},
        cursor={"show": True, "y": False},
        height=HEIGHT_PX,
    )
