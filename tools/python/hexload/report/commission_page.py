"""The page of `hexload commission --report`: what was found of a rig, how well, and what the forces still show beside it."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import plotly.graph_objects as go
import plotly.offline
from numpy.typing import NDArray
from plotly.subplots import make_subplots
from scipy.signal import welch

from hexload.estimation import rig_model
from hexload.estimation.rig_model import LEGS
from hexload.estimation.rig_regression import FRICTION, ROW_HZ, SLICES, Explained, Found, Start, friction_columns
from hexload.report.figures import ERROR, ESTIMATE, REFERENCE, TRUTH, finish
from hexload.report.page import templates, to_html
from hexload.theory.bound import THETA_NAMES, unit_of

Array = NDArray[np.float64]

TEMPLATE = "commission.html.jinja"
SEGMENT_S = 4.0  # of the spectra: a quarter of a hertz
HIGHEST_HZ = 40.0  # the regression's own filter
DOTS = 800  # of a leg's friction
BINS = 24
SLOW_M_S = 0.05  # where friction turns
SPEEDS = 400  # of a drawn friction law
HINGES = tuple(f"{side} {leg + 1} {axis}" for side in ("base", "platform") for leg in range(LEGS) for axis in "xyz")


@dataclass(frozen=True)
class Kind:
    """How the unknowns of a group are shown."""

    title: str
    unit: str
    factor: float = 1.0
    digits: int = 2
    names: tuple[str, ...] = ()


KINDS = {
    "theta": Kind("platform", "", 1.0, 3, tuple(f"{name}, {unit_of(name)}" for name in THETA_NAMES)),
    "leg_mass": Kind("leg mass", "", 1.0, 4, ("inertia, kg m²", "slide, kg m", "tilt, kg m")),
    "coulomb": Kind("Coulomb friction", "N", 1.0, 1),
    "stribeck": Kind("more at rest (Stribeck)", "N", 1.0, 1),
    "viscous": Kind("viscous friction", "N s/m", 1.0, 1),
    "growth": Kind("dry friction by the leg's force", "%", 100.0, 3),
    "offset": Kind("force offset", "N", 1.0, 2),
    "delay": Kind("force delay", "ms", 1e3, 3, ("forces late by, ms",)),
    "tilt": Kind("tilt of gravity", "deg", 180.0 / np.pi, 4, ("towards x, deg", "towards y, deg")),
    "gain": Kind("force gain, beyond 1", "%", 100.0, 3),
    "hinges": Kind("hinges", "mm", 1e3, 3, HINGES),
}


@dataclass(frozen=True)
class Unknown:
    name: str
    stated: float  # by the platform file
    value: float
    sigma: float
    tolerance: float  # one sigma before the run; inf: nothing was known


@dataclass(frozen=True)
class Group:
    name: str
    kind: Kind
    unknowns: list[Unknown]
    words: str  # identifiability

    @property
    def is_per_leg(self) -> bool:
        return len(self.unknowns) == LEGS and not self.kind.names

    @property
    def tolerance(self) -> float:
        return self.unknowns[0].tolerance

    @property
    def change(self) -> float:
        return float(np.sqrt(np.mean([(each.value - each.stated) ** 2 for each in self.unknowns])))

    @property
    def sigma(self) -> float:
        return float(np.median([each.sigma for each in self.unknowns]))


def render(
    start: Start,
    found: Found,
    words: dict[str, str],
    runs: tuple[Explained, Explained],
    source: dict[str, str | float],
    platform: str,
    noise_n: Callable[[Array], Array],
) -> str:
    """`start`: platform file and tolerances; `runs`: the empty run with these numbers and with those found; `noise_n`: of
    the sensors in a residual, (n, 6) N per root Hz at (n,) Hz."""
    groups = [_group(name, start, found, words[name]) for name in SLICES]
    before, after = runs
    figures = {
        "spectra": residual_spectra(before, after, noise_n),
        "friction": friction_curves(after, found, float(np.abs(after.speed_m_s).max())),
        "slow": friction_curves(after, found, SLOW_M_S),
    }
    return (
        templates()
        .get_template(TEMPLATE)
        .render(
            plotly_js=plotly.offline.get_plotlyjs(),
            platform=platform,
            source=source,
            groups=groups,
            by_name={group.name: group for group in groups},
            legs=[group for group in groups if group.is_per_leg],
            law=found.law,
            rms=[(_rms(before.slow_residual_n[:, leg]), _rms(after.slow_residual_n[:, leg])) for leg in range(LEGS)],
            rms_of_all=(_rms(before.slow_residual_n), _rms(after.slow_residual_n)),
            slow_hz=ROW_HZ,
            figures={name: to_html(figure, f"{name}-figure") for name, figure in figures.items()},
        )
    )


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _group(name: str, start: Start, found: Found, words: str) -> Group:
    part = SLICES[name]
    kind = KINDS.get(name, Kind(name.replace("_", " "), ""))
    sigma = np.sqrt(np.diag(found.covariance)[part])
    stated = np.where(np.isfinite(start.value[part]), start.value[part], 0.0)
    names = kind.names or tuple(f"leg {number}" for number in range(1, len(sigma) + 1))
    columns = (kind.factor * column for column in (stated, found.value[part], sigma, start.sigma[part]))
    return Group(name, kind, [Unknown(*each) for each in zip(names, *columns, strict=True)], words)


def _of_legs(titles: list[str], height: int, x_title: str, y_title: str) -> go.Figure:
    figure = make_subplots(
        rows=2, cols=3, shared_xaxes=True, shared_yaxes=True, subplot_titles=titles,
        vertical_spacing=0.09, horizontal_spacing=0.03,
    )  # fmt: skip
    figure.update_xaxes(title=x_title, row=2)
    figure.update_yaxes(title=y_title, col=1)
    return finish(figure, height)


def _place(leg: int) -> dict[str, int]:
    return {"row": 1 + leg // 3, "col": 1 + leg % 3}


def residual_spectra(before: Explained, after: Explained, noise_n: Callable[[Array], Array]) -> go.Figure:
    """What the forces show beside the model, by frequency: with the platform file's numbers and with those found."""
    fs_hz = 1.0 / float(np.median(np.diff(after.t_s)))
    titles = [
        f"leg {leg + 1}: {_rms(before.slow_residual_n[:, leg]):.1f} N → {_rms(after.slow_residual_n[:, leg]):.1f} N"
        for leg in range(LEGS)
    ]
    figure = _of_legs(titles, 560, "frequency, Hz", "residual, N/√Hz")
    for leg in range(LEGS):
        for run, colour, name in ((before, ERROR, "platform file"), (after, ESTIMATE, "commissioned")):
            hz, density = welch(
                run.residual_n[:, leg], fs_hz, nperseg=min(round(SEGMENT_S * fs_hz), len(run.t_s)), detrend=False
            )
            shown = (hz > 0.0) & (hz <= HIGHEST_HZ)
            line = _curve(hz[shown], np.sqrt(density[shown]), name, colour, leg == 0)
            figure.add_trace(line, **_place(leg))
        floor = _curve(hz[shown], noise_n(hz[shown])[:, leg], "sensor noise", TRUTH, leg == 0)
        figure.add_trace(floor.update(line={"dash": "dash", "width": 1.2}), **_place(leg))
    figure.update_xaxes(type="log", tickvals=[0.3, 1, 3, 10, 30])
    figure.update_yaxes(type="log", exponentformat="none", dtick=1)
    return figure


def friction_curves(run: Explained, found: Found, fastest_m_s: float) -> go.Figure:
    """What is left of the forces, below ROW_HZ, without friction's part of the model, by speed, and that part."""
    figure = _of_legs([f"leg {leg + 1}" for leg in range(LEGS)], 600, "leg speed, mm/s", "friction, N")
    measured = run.slow_residual_n / (1.0 + found.value[SLICES["gain"]]) + run.friction_n
    speeds = fastest_m_s * np.linspace(-1.0, 1.0, SPEEDS) ** 3  # close together where friction turns round
    shapes = rig_model.friction_shapes(speeds, rig_model.FrictionLaw(**vars(found.law) | {"presliding_m": 0.0}), 1.0)
    for leg in range(LEGS):
        mean_n = np.full(SPEEDS, np.abs(run.force_n[:, leg]).mean())
        law_n = friction_columns(shapes, mean_n) @ [found.value[SLICES[name]][leg] for name in FRICTION]
        shown = np.flatnonzero(np.abs(run.speed_m_s[:, leg]) <= fastest_m_s)
        speed_mm_s, friction_n = 1e3 * run.speed_m_s[shown, leg], measured[shown, leg]
        every = max(1, len(shown) // DOTS)
        dots = go.Scatter(
            x=speed_mm_s[::every].astype(np.float32),
            y=friction_n[::every].astype(np.float32),
            mode="markers",
            marker={"size": 3, "color": REFERENCE, "opacity": 0.55},
            name="measured",
            legendgroup="measured",
            showlegend=leg == 0,
            hovertemplate="%{y:.1f} N at %{x:.1f} mm/s",
        )
        figure.add_trace(dots, **_place(leg))
        figure.add_trace(_means(speed_mm_s, friction_n, leg == 0), **_place(leg))
        figure.add_trace(_curve(1e3 * speeds, law_n, "model", ERROR, leg == 0), **_place(leg))
    in_view = np.abs(measured[np.abs(run.speed_m_s) <= fastest_m_s])
    reach = 1.15 * float(np.quantile(in_view, 0.999)) if in_view.size else 1.0
    figure.update_yaxes(range=[-reach, reach], zeroline=True, zerolinecolor=REFERENCE)
    return figure


def _means(speed_mm_s: Array, friction_n: Array, legend: bool) -> go.Scatter:
    """Over equally many rows each."""
    bins = [each for each in np.array_split(np.argsort(speed_mm_s), BINS) if len(each)]
    return go.Scatter(
        x=[float(speed_mm_s[each].mean()) for each in bins],
        y=[float(friction_n[each].mean()) for each in bins],
        mode="markers",
        marker={"size": 6, "color": ESTIMATE, "line": {"color": "white", "width": 1}},
        name=f"means of 1/{BINS} of the rows",
        legendgroup="mean",
        showlegend=legend,
        hovertemplate="%{y:.1f} N at %{x:.1f} mm/s",
    )


def _curve(x: Array, y: Array, name: str, colour: str, legend: bool) -> go.Scatter:
    return go.Scatter(
        x=x.astype(np.float32),
        y=y.astype(np.float32),
        mode="lines",
        line={"color": colour, "width": 1.6},
        name=name,
        legendgroup=name,
        showlegend=legend,
        hovertemplate="%{y:.3g} at %{x:.3g}",
    )
