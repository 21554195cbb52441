"""Curves as data that the page's own script (charts.js) draws: panels that wrap where the page is narrow, one unit and one
title each, the same look on every page. Points are 16-bit numbers, so that a page of forty panels has a few hundred kB."""

import base64
import json
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from html import escape
from typing import Literal

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

# Okabe and Ito's colours: eyes without red, green or blue tell them apart.
LEG_COLOURS = ("#0072b2", "#e69f00", "#009e73", "#d55e00", "#cc79a7", "#56b4e9")
COLOURS = (*LEG_COLOURS, "#111418", "#9aa3ad", "#7a5c00", "#4b3f8f")
INK, REFERENCE, TRUTH, ERROR = "#24292f", "#9aa3ad", "#111418", "#d55e00"
ESTIMATE, BAND, CHANGE = "#0072b2", "rgba(0, 114, 178, 0.16)", "#cc79a7"

TIME = "time, s"
STEPS = 65534  # of a 16-bit number; the last code is a gap
BEYOND = 1.0  # spans of an axis that are kept on either side of it, for whoever zooms
POINTS = 1400  # of a curve that is as wide as the page

# Finer units, for an axis that is short in the SI unit.
FINER = {
    "m": ((1e-3, 1e6, "µm"), (1.0, 1e3, "mm")),
    "kg": ((1e-2, 1e3, "g"),),
    "kg m": ((1e-2, 1e3, "g m"),),
    "kg m²": ((1e-2, 1e3, "g m²"),),
}


def unit_for(unit: str, reach: float) -> tuple[float, str]:
    """Factor and name of the unit in which an axis of this length, in `unit`, has plain numbers."""
    for below, factor, name in FINER.get(unit, ()):
        if reach < below:
            return factor, name
    return 1.0, unit


@dataclass(frozen=True)
class Series:
    """`high`: the upper edge of a band, whose lower one is y. `symbol`: shape of dots."""

    x: Array
    y: Array
    colour: str
    name: str = ""  # in the legend; of the same name once
    kind: Literal["line", "steps", "band", "dots", "both"] = "line"
    width: float = 1.4
    dash: str = ""
    high: Array | None = None
    symbol: int = 0
    size: float = 3.5
    labels: tuple[str, ...] = ()


@dataclass(frozen=True)
class Mark:
    """A moment in every panel over time."""

    t_s: float
    name: str
    colour: str = CHANGE


@dataclass(frozen=True)
class Cells:
    """A map over x and y, NaN where there is nothing; colours from low to high."""

    x: Array
    y: Array
    value: Array  # (y, x)
    low: float
    high: float
    title: str


@dataclass(frozen=True)
class Panel:
    title: str  # with the unit of y
    series: Sequence[Series] = ()
    x_title: str = TIME
    y_title: str = ""
    x_range: tuple[float, float] | None = None
    y_range: tuple[float, float] | None = None
    x_log: bool = False
    y_log: bool = False
    x_names: tuple[str, ...] = ()  # of the places 0, 1, 2 ... instead of numbers
    marks: tuple[Mark, ...] = ()
    levels: tuple[float, ...] = ()  # dashed lines across
    shade: tuple[float, float] | None = None  # a band across
    same_scale: bool = False  # one length on both axes
    cells: Cells | None = None
    begins_row: bool = False


@dataclass(frozen=True)
class Chart:
    panels: Sequence[Panel]
    columns: int = 1
    height: int = 220  # px of a panel
    legend: tuple[tuple[str, str], ...] = field(default=())  # more of it: colour, name


def decimate(t: Array, y: Array, points: int = POINTS) -> tuple[Array, Array]:
    """The minimum and the maximum of half as many stretches in their order in time; short curves stay as they are."""
    if len(t) <= points:
        return t, y
    keep = []
    for indices in np.array_split(np.arange(len(t)), points // 2):
        known = np.nan_to_num(y[indices])
        keep += sorted({indices[np.argmin(known)], indices[np.argmax(known)]})
    keep = np.unique([0, *keep, len(t) - 1])
    return t[keep], y[keep]


def line(t: Array, y: Array, colour: str, name: str, points: int = POINTS, **look) -> Series:
    t, y = decimate(np.asarray(t, float), np.asarray(y, float), points)
    return Series(t, y, colour, name, **look)


def band(t: Array, low: Array, high: Array, name: str, points: int = POINTS, colour: str = BAND) -> Series:
    """Its edges are those of as many stretches: the lowest and the highest of each."""
    stretches = np.array_split(np.arange(len(t)), min(len(t), points // 2))
    centres = np.array([t[each[0]] for each in stretches[:-1]] + [t[-1]])
    lower = np.array([low[each].min() for each in stretches])
    upper = np.array([high[each].max() for each in stretches])
    return Series(centres, lower, colour, name, kind="band", high=upper)


def to_html(chart: Chart, identifier: str) -> str:
    """Of this chart: its place, its legend and its data. The page has charts.js once."""
    data = json.dumps([_panel(panel) for panel in chart.panels], ensure_ascii=False, separators=(",", ":"))
    data = data.replace("<", "\\u003c")  # no word of a user ends the script
    return (
        f'<div class="chart" id="{escape(identifier)}">{_legend(chart)}'
        f'<div class="panels" style="--columns: {chart.columns}; --height: {chart.height}px"></div>'
        f'<script type="application/json">{data}</script></div>'
    )


def _legend(chart: Chart) -> str:
    entries: dict[str, str] = {}
    for panel in chart.panels:
        for each in panel.series:
            if each.name:
                entries.setdefault(each.name, _swatch(each))
        for mark in panel.marks:
            entries.setdefault(mark.name, _mark_swatch(mark.colour))
    entries |= {name: _mark_swatch(colour) for colour, name in chart.legend}
    if len(entries) < 2:
        return ""
    return (
        '<p class="legend">'
        + "".join(f"<span>{swatch}{escape(name)}</span>" for name, swatch in entries.items())
        + "</p>"
    )


def _swatch(series: Series) -> str:
    """Drawn by the same script as the curve."""
    look = {"k": series.kind, "c": series.colour, "w": max(series.width, 1.6), "d": series.dash, "s": series.symbol}
    return f"<svg class='swatch' width='22' height='12' data-look='{escape(json.dumps(look), quote=True)}'></svg>"


def _mark_swatch(colour: str) -> str:
    look = {"k": "mark", "c": colour, "w": 1.6, "d": "4 3", "s": 0}
    return f"<svg class='swatch' width='22' height='12' data-look='{escape(json.dumps(look), quote=True)}'></svg>"


def _panel(panel: Panel) -> dict:
    series = [replace(each, x=_scaled(each.x, panel.x_log), y=_scaled(each.y, panel.y_log)) for each in panel.series]
    x_range, y_range = _axes(panel, series)
    kept_x, kept_y = _kept(x_range, [each.x for each in series]), _kept(y_range, [*_heights(series)])
    found = {
        "title": panel.title, "xt": panel.x_title, "yt": panel.y_title, "x": x_range, "y": y_range,
        "xl": panel.x_log, "yl": panel.y_log, "names": panel.x_names, "levels": panel.levels, "shade": panel.shade,
        "marks": [(mark.t_s, mark.colour, mark.name) for mark in panel.marks],
        "same": panel.same_scale, "row": panel.begins_row, "kx": kept_x, "ky": kept_y,
        "series": [_coded(each, kept_x, kept_y) for each in series],
    }  # fmt: skip
    if panel.cells is not None:
        found["cells"] = _coded_cells(panel.cells)
    return {key: value for key, value in found.items() if value not in (None, False, (), [], "")}


def _scaled(values: Array, is_log: bool) -> Array:
    values = np.asarray(values, float)
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.log10(values) if is_log else values


def _heights(series: Sequence[Series]) -> list[Array]:
    return [each.y for each in series] + [each.high for each in series if each.high is not None]


def _axes(panel: Panel, series: Sequence[Series]) -> tuple[tuple[float, float], tuple[float, float]]:
    """As the panel says, else as its points need; of a logarithmic axis the logarithms."""
    across = [*panel.levels, *(panel.shade or ())]
    x = (
        (-0.5, len(panel.x_names) - 0.5)
        if panel.x_names
        else _around([each.x for each in series], 0.12 * panel.same_scale)
    )
    if panel.cells is not None:
        x, y = (float(panel.cells.x[0]), float(panel.cells.x[-1])), (float(panel.cells.y[0]), float(panel.cells.y[-1]))
    else:
        y = _around([*_heights(series), _scaled(np.array(across), panel.y_log)], 0.06)
    x = tuple(_scaled(np.array(panel.x_range), panel.x_log).tolist()) if panel.x_range else x
    y = tuple(_scaled(np.array(panel.y_range), panel.y_log).tolist()) if panel.y_range else y
    return x, y


def _around(values: Sequence[Array], margin: float) -> tuple[float, float]:
    finite = np.concatenate([each[np.isfinite(each)] for each in values] or [np.zeros(0)])
    if not finite.size:
        return 0.0, 1.0
    low, high = float(finite.min()), float(finite.max())
    spare = margin * (high - low) if high > low else (abs(high) or 1.0) * 0.5 * (margin > 0.0)
    return low - spare, high + spare


def _kept(axis: tuple[float, float], values: Sequence[Array]) -> tuple[float, float]:
    """What of the points the codes can tell: all, but no more than BEYOND of the axis on either side."""
    low, high = _around(values, 0.0)
    span = BEYOND * (axis[1] - axis[0])
    low, high = max(low, axis[0] - span), min(high, axis[1] + span)
    return (low, high) if high > low else (low, low + (abs(low) or 1.0))


def _coded(series: Series, kept_x: tuple[float, float], kept_y: tuple[float, float]) -> dict:
    found = {
        "n": series.name, "k": series.kind, "c": series.colour, "w": series.width, "d": series.dash,
        "x": encode(series.x, kept_x), "y": encode(series.y, kept_y),
    }  # fmt: skip
    if series.high is not None:
        found["h"] = encode(series.high, kept_y)
    if series.kind in ("dots", "both"):
        found |= {"s": series.symbol, "r": series.size}
    if series.labels:
        found["l"] = series.labels
    return {key: value for key, value in found.items() if value != ""}


def encode(values: Array, kept: tuple[float, float]) -> str:
    """Base64 of little-endian 16-bit numbers from `kept`'s lower to its upper end; what is beyond is put to the end."""
    low, high = kept
    clipped = np.clip(values, low, high)
    codes = np.where(np.isfinite(values), np.round((clipped - low) / (high - low) * STEPS), STEPS + 1)
    return base64.b64encode(codes.astype("<u2").tobytes()).decode("ascii")


def decode(text: str, kept: tuple[float, float]) -> Array:
    """What charts.js reads."""
    codes = np.frombuffer(base64.b64decode(text), "<u2").astype(float)
    return np.where(codes > STEPS, np.nan, kept[0] + codes * (kept[1] - kept[0]) / STEPS)


def _coded_cells(cells: Cells) -> dict:
    kept = (cells.low, cells.high if cells.high > cells.low else cells.low + 1.0)
    x, y = (tuple(float(f"{number:.5g}") for number in each) for each in (cells.x, cells.y))
    return {
        "x": x,
        "y": y,
        "v": encode(np.asarray(cells.value, float).ravel(), kept),
        "kept": kept,
        "title": cells.title,
    }
