"""The report's figures, as plotly objects. One colour per meaning in all of them; units on every axis."""

from dataclasses import dataclass

import numpy as np
import plotly.graph_objects as go
from numpy.typing import NDArray
from plotly.subplots import make_subplots

from hexload.estimation.load_summary import SYMBOLS, UNITS
from hexload.io.log_file import LegLog
from hexload.io.run_directory import PAPER_PARAMETERS, POSE, Run
from hexload.theory.bound import THETA_NAMES, unit_of
from hexload.theory.nis import NisSummary

INK, GRID, REFERENCE, TRUTH, ERROR = "#24292f", "#e4e7eb", "#9aa3ad", "#111418", "#c2410c"
ESTIMATE, BAND = "#1d5fa6", "rgba(29, 95, 166, 0.16)"
LEG_COLOURS = ("#1d5fa6", "#d97706", "#15803d", "#b91c1c", "#7c3aed", "#0e7490")
LOAD_PLACES = ((0, 0), (0, 1), (0, 2), (0, 3), (1, 0), (1, 1), (1, 2), (2, 0), (2, 1), (2, 2))  # row, column of theta
DOTS = 2500  # of a scatter plot
BINS = 700  # a trace keeps the extremes of this many stretches: more than the pixels it is drawn on

Array = NDArray[np.float64]


def decimate(t: Array, y: Array, bins: int = BINS) -> tuple[Array, Array]:
    """The minimum and the maximum of `bins` stretches in their order in time; short traces stay as they are."""
    if len(t) <= 2 * bins:
        return t, y
    keep = []
    for indices in np.array_split(np.arange(len(t)), bins):
        keep += sorted({indices[np.argmin(y[indices])], indices[np.argmax(y[indices])]})
    keep = np.unique([0, *keep, len(t) - 1])
    return t[keep], y[keep]


@dataclass(frozen=True)
class Style:
    colour: str
    name: str
    width: float = 1.3
    dash: str = "solid"


def _line(t: Array, y: Array, style: Style, legend: bool = False) -> go.Scatter:
    t, y = decimate(t, y)
    return go.Scatter(
        x=t.astype(np.float32),
        y=y.astype(np.float32),
        mode="lines",
        name=style.name,
        legendgroup=style.name,
        showlegend=legend,
        line={"color": style.colour, "width": style.width, "dash": style.dash},
        hovertemplate="%{y:.5g} at %{x:.3f} s",
    )


def finish(figure: go.Figure, height: int) -> go.Figure:
    figure.update_layout(
        height=height,
        margin={"l": 64, "r": 12, "t": 58, "b": 44},
        paper_bgcolor="white",
        plot_bgcolor="white",
        font={"family": "system-ui, 'DejaVu Sans', sans-serif", "size": 12, "color": INK},
        hovermode="closest",
        legend={"orientation": "h", "x": 1, "xanchor": "right", "y": 1, "yanchor": "top", "yref": "container"},
    )
    figure.update_xaxes(gridcolor=GRID, zeroline=False, linecolor=REFERENCE, ticks="outside", tickcolor=REFERENCE)
    figure.update_yaxes(gridcolor=GRID, zeroline=False, linecolor=REFERENCE, ticks="outside", tickcolor=REFERENCE)
    figure.update_annotations(font_size=12)
    return figure


def tracking(run: Run) -> go.Figure:
    """Reference and truth of each degree of freedom, and below them the error."""
    titles = [f"{name}, {_pose_unit(name)[1]}" for name in POSE]
    error_titles = [f"{name} − reference, {_error_unit(name)[1]}" for name in POSE]
    figure = make_subplots(
        rows=4,
        cols=3,
        shared_xaxes=True,
        vertical_spacing=0.055,
        horizontal_spacing=0.06,
        subplot_titles=[*titles[:3], *error_titles[:3], *titles[3:], *error_titles[3:]],
    )
    t = run.truth["t"]
    for position, name in enumerate(POSE):
        row, column = 1 + 2 * (position // 3), 1 + position % 3
        truth, reference = run.truth[name], run.truth[f"ref_{name}"]
        scale, _ = _pose_unit(name)
        first = position == 0
        figure.add_trace(_line(t, scale * reference, Style(REFERENCE, "reference", 3.0), first), row, column)
        figure.add_trace(_line(t, scale * truth, Style(TRUTH, "truth"), first), row, column)
        scale, _ = _error_unit(name)
        error = Style(ERROR, "truth − reference", 1.0)
        figure.add_trace(_line(t, scale * (truth - reference), error, first), row + 1, column)
    figure.update_xaxes(title="time, s", row=4)
    return finish(figure, 760)


def _pose_unit(name: str) -> tuple[float, str]:
    return (1e3, "mm") if name in POSE[:3] else (180.0 / np.pi, "deg")


def _error_unit(name: str) -> tuple[float, str]:
    return (1e3, "mm") if name in POSE[:3] else (1e3, "mrad")


def leg_signals(log: LegLog) -> go.Figure:
    """What the estimator sees: displacement, velocity and force of the six legs, with sensor noise."""
    channels = (
        (1e3, log.displacement_m, "displacement, mm"),
        *([(1.0, log.velocity_m_s, "velocity, m/s")] if log.has_velocity else []),
        (1e-3, log.force_n, "force, kN"),
    )
    figure = make_subplots(rows=len(channels), cols=1, shared_xaxes=True, vertical_spacing=0.05)
    for row, (scale, values, title) in enumerate(channels, start=1):
        for leg in range(6):
            style = Style(LEG_COLOURS[leg], f"leg {leg + 1}", 1.1)
            figure.add_trace(_line(log.t_s, scale * values[:, leg], style, row == 1), row, 1)
        figure.update_yaxes(title=title, row=row)
    figure.update_xaxes(title="time, s", row=len(channels))
    return finish(figure, 640)


def estimates(run: Run) -> go.Figure:
    """The paper's Figure 5, each parameter against the truth, and below it the error in its three-sigma band."""
    titles = [f"{SYMBOLS[name]}, {UNITS[name]}" for name in PAPER_PARAMETERS]
    error_titles = [f"{SYMBOLS[name]} − truth, {UNITS[name]}" for name in PAPER_PARAMETERS]
    figure = make_subplots(
        rows=4,
        cols=2,
        shared_xaxes=True,
        vertical_spacing=0.055,
        horizontal_spacing=0.09,
        subplot_titles=[*titles[:2], *error_titles[:2], *titles[2:], *error_titles[2:]],
    )
    t = run.estimates["t"]
    truth = run.load_parameters(t)
    for position, name in enumerate(PAPER_PARAMETERS):
        row, column = 1 + 2 * (position // 2), 1 + position % 2
        value, sigma = run.estimates[name], run.estimates[f"s_{name}"]
        error = value - truth[name]
        first = position == 0
        figure.add_trace(_band(t, value - 3 * sigma, value + 3 * sigma, "± 3σ", first), row, column)
        figure.add_trace(_line(t, truth[name], Style(TRUTH, "truth", 1.4, "dash"), first), row, column)
        figure.add_trace(_line(t, value, Style(ESTIMATE, "estimate", 1.6), first), row, column)
        figure.update_yaxes(range=_range_around(truth[name], value), row=row, col=column)
        figure.add_trace(_band(t, -3 * sigma, 3 * sigma, "± 3σ"), row + 1, column)
        figure.add_trace(_line(t, error, Style(ERROR, "estimate − truth", 1.2), first), row + 1, column)
        reach = _settled_reach(error, sigma)
        figure.update_yaxes(range=[-reach, reach], row=row + 1, col=column)
    figure.update_xaxes(title="time, s", row=4)
    return finish(figure, 860)


def load_estimates(t: Array, value: Array, sigma: Array, truth: Array | None, settled: slice) -> go.Figure:
    """The ten parameters, (n, 10), in rows of mass and moments of mass, moments of inertia, products; below each, where
    the truth is known, the error in its three-sigma band. `settled`: ticks that are shown in full."""
    rows_each = 1 if truth is None else 2
    titles = [""] * (4 * 3 * rows_each)
    for place, name in zip(LOAD_PLACES, THETA_NAMES, strict=True):
        titles[4 * rows_each * place[0] + place[1]] = f"{name}, {unit_of(name)}"
        if truth is not None:
            titles[4 * (rows_each * place[0] + 1) + place[1]] = f"{name} − truth, {unit_of(name)}"
    figure = make_subplots(
        rows=3 * rows_each,
        cols=4,
        shared_xaxes=True,
        vertical_spacing=0.045 if truth is not None else 0.09,
        horizontal_spacing=0.06,
        subplot_titles=titles,
    )
    for k, place in enumerate(LOAD_PLACES):
        row, column = 1 + rows_each * place[0], 1 + place[1]
        known = value[-1:, k] if truth is None else truth[:, k]
        low, high = value[:, k] - 3 * sigma[:, k], value[:, k] + 3 * sigma[:, k]
        figure.add_trace(_band(t, low, high, "± 3σ", k == 0), row, column)
        if truth is not None:
            figure.add_trace(_line(t, known, Style(TRUTH, "truth", 1.4, "dash"), k == 0), row, column)
        figure.add_trace(_line(t, value[:, k], Style(ESTIMATE, "estimate", 1.6), k == 0), row, column)
        settled_band = (low[settled].min(), high[settled].max())
        figure.update_yaxes(range=_range_around(known, value[:, k], settled_band), row=row, col=column)
        if truth is not None:
            error, reach = value[:, k] - truth[:, k], 3 * sigma[:, k]
            figure.add_trace(_band(t, -reach, reach, "± 3σ"), row + 1, column)
            figure.add_trace(_line(t, error, Style(ERROR, "estimate − truth", 1.2), k == 0), row + 1, column)
            reach = _reach(error[settled], sigma[settled, k])
            figure.update_yaxes(range=[-reach, reach], row=row + 1, col=column)
    figure.update_xaxes(title="time, s", row=3 * rows_each)
    figure.update_xaxes(showticklabels=True, title="time, s", row=rows_each, col=4)  # nothing stands below hz
    return finish(figure, 330 * rows_each + 250)


def _band(t: Array, low: Array, high: Array, name: str, legend: bool = False) -> go.Scatter:
    (t_low, low), (t_high, high) = decimate(t, low, BINS // 2), decimate(t, high, BINS // 2)
    outline_t, outline = np.concatenate([t_low, t_high[::-1]]), np.concatenate([low, high[::-1]])
    return go.Scatter(
        x=outline_t.astype(np.float32),
        y=outline.astype(np.float32),
        fill="toself",
        fillcolor=BAND,
        mode="lines",
        line={"width": 0},
        name=name,
        legendgroup=name,
        showlegend=legend,
        hoverinfo="skip",
    )


def _range_around(truth: Array, value: Array, band: tuple[float, float] = (0.0, 0.0)) -> list[float]:
    """Shows zero, the truth, a band, and the estimate after its first twentieth, which may overshoot far."""
    settled = value[len(value) // 20 :]
    reach = max(3.0 * np.abs(truth).max(), -band[0], band[1])
    low = min(0.0, truth.min(), band[0], max(settled.min(), -reach))
    high = max(0.0, truth.max(), band[1], min(settled.max(), reach))
    margin = 0.12 * (high - low)
    return [float(low - margin), float(high + margin)]


def _settled_reach(error: Array, sigma: Array) -> float:
    """Half the height of an error plot that shows the last four fifths of a run in full."""
    settled = slice(len(error) // 5, None)
    return _reach(error[settled], sigma[settled])


def _reach(error: Array, sigma: Array) -> float:
    return float(1.15 * max(3.0 * sigma.max(), np.abs(error).max()))


def innovation(t: Array, nis: Array, summary: NisSummary) -> go.Figure:
    """NIS of each tick, and its mean over windows, each with the 95 % band of a consistent filter."""
    figure = make_subplots(
        rows=1,
        cols=2,
        horizontal_spacing=0.09,
        subplot_titles=[
            "NIS of each tick",
            f"mean of {round(len(t) / len(summary.window_t_s))} ticks",
        ],
    )
    every = max(1, len(t) // DOTS)
    dots = go.Scatter(
        x=t[::every].astype(np.float32),
        y=nis[::every].astype(np.float32),
        mode="markers",
        marker={"size": 2.5, "color": ESTIMATE},
        showlegend=False,
        name="NIS",
        hovertemplate="%{y:.3g} at %{x:.3f} s",
    )
    figure.add_trace(dots, 1, 1)
    figure.add_trace(_line(summary.window_t_s, summary.window_mean, Style(ESTIMATE, "mean NIS", 1.1)), 1, 2)
    for column, band in ((1, summary.tick_band), (2, summary.window_band)):
        figure.add_hrect(y0=band[0], y1=band[1], fillcolor=BAND, line_width=0, row=1, col=column)
        figure.add_hline(y=summary.measurements, line={"color": TRUTH, "width": 1, "dash": "dash"}, row=1, col=column)
    figure.update_xaxes(range=[t[0], t[-1]])
    figure.update_yaxes(title="NIS (no unit)", range=[0, _ceiling(nis, 2.0 * summary.tick_band[1])], row=1, col=1)
    figure.update_yaxes(range=[0, _ceiling(summary.window_mean, 1.1 * summary.window_band[1])], row=1, col=2)
    figure.update_xaxes(title="time, s")
    return finish(figure, 340)


def _ceiling(values: Array, least: float) -> float:
    """Of an axis: above all values but those of the largest fiftieth that would dwarf the rest."""
    return max(least, min(1.05 * float(values.max()), 1.5 * float(np.quantile(values, 0.98))))


def coupling(matrix: list[list[float]]) -> go.Figure:
    """The coupling matrix (19) at home: kg m where a rotation meets a translation, kg m^2 between rotations."""
    values = np.array(matrix)
    columns = ["ẍ", "ÿ", "z̈", "ω̇x", "ω̇y", "ω̇z"]
    rows = ["Fx", "Fy", "Fz", "Nx", "Ny", "Nz"]
    reach = float(np.abs(values).max()) or 1.0
    labels = [[f"{value:.4g}" if abs(value) > 1e-9 * reach else "0" for value in row] for row in values]
    figure = go.Figure(
        go.Heatmap(
            z=values,
            x=columns,
            y=rows,
            text=labels,
            texttemplate="%{text}",
            zmin=-reach,
            zmax=reach,
            xgap=2,
            ygap=2,
            colorscale=[[0, "#c98a5e"], [0.5, "#f6f7f9"], [1, "#5b8fc4"]],
            hovertemplate="%{y} per %{x}: %{z:.6g}",
            textfont={"color": INK, "size": 13},
            showscale=False,
        )
    )
    figure.add_vline(x=2.5, line={"color": INK, "width": 1})
    figure.add_hline(y=2.5, line={"color": INK, "width": 1})
    finish(figure, 400)
    figure.update_yaxes(autorange="reversed", showgrid=False, title="inertial force and moment")
    figure.update_xaxes(side="top", showgrid=False, title="acceleration")
    return figure.update_layout(margin={"t": 70})
