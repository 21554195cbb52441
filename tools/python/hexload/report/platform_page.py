"""The page of `hexload platform check --report`: pictures of a machine, its reach, and maps of its condition."""

import numpy as np
import plotly.graph_objects as go
import plotly.offline
from numpy.typing import NDArray
from plotly.subplots import make_subplots

from hexload.estimation.machine_check import Checked, axis_title, map_words, shown
from hexload.report.figures import LEG_COLOURS, REFERENCE, finish
from hexload.report.page import templates, to_html
from hexload.theory.workspace import Machine, Map

Array = NDArray[np.float64]

TEMPLATE = "platform.html.jinja"
VIEWS = (("from above, mm", 0, 1), ("from the front, mm", 0, 2), ("from the side, mm", 1, 2))  # title, axes
NAMES = "xyz"


def render(checked: Checked) -> str:
    machine = checked.machine
    figures = {"machine": pictures(machine), "maps": condition_maps(checked.maps)}
    return (
        templates()
        .get_template(TEMPLATE)
        .render(
            plotly_js=plotly.offline.get_plotlyjs(),
            checked=checked,
            lengths_mm=(1e3 * (machine.home_leg_length_m + checked.home_m)).tolist(),
            reaches=[
                (axis_title(low.axis), shown(low), low.limit, shown(high), high.limit)
                for low, high in zip(checked.reaches[::2], checked.reaches[1::2])
            ],
            maps=[(float(np.degrees(each.tilt_rad)), map_words(each)) for each in checked.maps],
            figures={name: to_html(figure, f"{name}-figure") for name, figure in figures.items()},
        )
    )


def pictures(machine: Machine) -> go.Figure:
    """The machine at home from three sides, with the numbers of the legs at the base."""
    base = 1e3 * machine.platform.base_hinges_m
    upper = 1e3 * (machine.platform.platform_hinges_m + [0.0, 0.0, machine.platform.home_height_m])
    figure = make_subplots(rows=1, cols=3, subplot_titles=[title for title, _, _ in VIEWS], horizontal_spacing=0.07)
    for column, (_, across, up) in enumerate(VIEWS, start=1):
        for points, name, dash in ((base, "base", "dot"), (upper, "platform", "solid")):
            ring = np.vstack([_around(points), _around(points)[:1]])
            line = go.Scatter(
                x=ring[:, across], y=ring[:, up], mode="lines", line={"color": REFERENCE, "dash": dash}, name=name,
                showlegend=column == 1, hoverinfo="skip",
            )  # fmt: skip
            figure.add_trace(line, 1, column)
        for leg, colour in enumerate(LEG_COLOURS):
            figure.add_trace(_leg(base[leg], upper[leg], (across, up), (leg, colour), column == 1), 1, column)
        figure.update_xaxes(title=NAMES[across], row=1, col=column)
        figure.update_yaxes(title=NAMES[up], scaleanchor=f"x{column if column > 1 else ''}", row=1, col=column)
    return finish(figure, 420)


def _leg(low: Array, high: Array, axes: tuple[int, int], which: tuple[int, str], legend: bool) -> go.Scatter:
    leg, colour = which
    across, up = axes
    return go.Scatter(
        x=[low[across], high[across]],
        y=[low[up], high[up]],
        mode="lines+markers+text" if up == 1 else "lines+markers",
        text=[str(leg + 1), ""],
        textposition="middle right" if low[0] > 0 else "middle left",
        textfont={"color": colour},
        line={"color": colour, "width": 3},
        marker={"size": [9, 7], "symbol": ["circle", "circle-open"]},
        name=f"leg {leg + 1}",
        legendgroup=f"leg {leg + 1}",
        showlegend=legend,
        hovertemplate="%{x:.1f}, %{y:.1f} mm",
    )


def _around(points: Array) -> Array:
    """In the order of their angles about z."""
    centred = points - points.mean(axis=0)
    return points[np.argsort(np.arctan2(centred[:, 1], centred[:, 0]))]


def condition_maps(maps: list[Map]) -> go.Figure:
    """White: out of reach."""
    titles = [f"tilt {np.degrees(each.tilt_rad):.0f} deg, worst direction" for each in maps]
    figure = make_subplots(rows=1, cols=len(maps), subplot_titles=titles, horizontal_spacing=0.05, shared_yaxes=True)
    values = np.concatenate([each.condition[np.isfinite(each.condition)] for each in maps])
    low, high = (float(values.min()), float(values.max())) if values.size else (1.0, 2.0)
    for column, each in enumerate(maps, start=1):
        heat = go.Heatmap(
            x=1e3 * each.x_m,
            y=1e3 * each.y_m,
            z=[[float(v) if np.isfinite(v) else None for v in row] for row in each.condition],
            zmin=low,
            zmax=max(high, low + 0.01),
            colorscale="Cividis",
            showscale=column == len(maps),
            colorbar={"title": {"text": "condition"}, "tickformat": ".2~f"},
            hovertemplate="x %{x:.0f}, y %{y:.0f} mm: %{z:.3g}<extra></extra>",
        )
        figure.add_trace(heat, 1, column)
        home = go.Scatter(
            x=[0.0], y=[0.0], mode="markers", marker={"symbol": "cross-thin", "size": 11, "line": {"color": "white", "width": 1.5}},
            showlegend=False, hoverinfo="skip",
        )  # fmt: skip
        figure.add_trace(home, 1, column)
        figure.update_xaxes(title="x, mm", row=1, col=column)
        figure.update_yaxes(scaleanchor=f"x{column if column > 1 else ''}", row=1, col=column)
    figure.update_yaxes(title="y, mm", col=1)
    return finish(figure, 420).update_layout(margin={"r": 90})
