"""The report's figures. One colour per meaning in all of them; one unit per panel; load changes in each over time."""

from collections.abc import Sequence
from html import escape

import numpy as np
from numpy.typing import NDArray

from hexload.estimation.load_summary import SYMBOLS, UNITS
from hexload.io.log_file import LegLog
from hexload.io.run_directory import PAPER_PARAMETERS, POSE, Run
from hexload.report.charts import (
    ERROR,
    ESTIMATE,
    LEG_COLOURS,
    REFERENCE,
    TRUTH,
    Chart,
    Mark,
    Panel,
    Series,
    band,
    line,
    unit_for,
)
from hexload.theory.bound import THETA_NAMES, unit_of
from hexload.theory.nis import NisSummary

DOTS = 2500  # of a scatter plot
ROWS_OF_THETA = (("m", "hx", "hy", "hz"), ("Ixx", "Iyy", "Izz"), ("Ixy", "Ixz", "Iyz"))  # of panels
FAR_NIS = 5.0  # times the band: a larger median makes the axis logarithmic, else it would hide the band
LOWEST_NIS = 0.5  # of a logarithmic axis
UNSETTLED = 0.2  # of the time with one load: it may be far off
THIRD, QUARTER = 500, 400  # points of a curve in a panel as wide as that part of the page

Array = NDArray[np.float64]
Marks = tuple[Mark, ...]


def marks_of(changes_s: Sequence[float]) -> Marks:
    return tuple(Mark(t_s, "another load detected") for t_s in changes_s)


def tracking(run: Run, marks: Marks) -> Chart:
    """Reference and truth of each degree of freedom, and beside it the error."""
    t, panels = run.truth["t"], []
    for name in POSE:
        truth, reference = run.truth[name], run.truth[f"ref_{name}"]
        scale, unit = (1e3, "mm") if name in POSE[:3] else (180.0 / np.pi, "deg")
        both = (
            line(t, scale * reference, REFERENCE, "reference", THIRD, width=3.2),
            line(t, scale * truth, TRUTH, "truth", THIRD, width=1.2),
        )
        panels.append(Panel(f"{name}, {unit}", both, marks=marks))
    for name in POSE:
        error = run.truth[name] - run.truth[f"ref_{name}"]
        unit = "mm" if name in POSE[:3] else "mrad"
        curve = line(t, 1e3 * error, ERROR, "truth − reference", THIRD, width=1.1)
        panels.append(Panel(f"{name} − reference, {unit}", (curve,), marks=marks, begins_row=name == POSE[0]))
    order = [0, 1, 2, 6, 7, 8, 3, 4, 5, 9, 10, 11]  # the errors below what they are errors of
    return Chart([panels[k] for k in order], columns=3, height=190)


def leg_signals(log: LegLog, marks: Marks) -> Chart:
    """What the estimator sees: displacement, velocity and force of the six legs, with sensor noise."""
    channels = (
        (1e3, log.displacement_m, "displacement, mm"),
        *([(1.0, log.velocity_m_s, "velocity, m/s")] if log.has_velocity else []),
        (1e-3, log.force_n, "force, kN"),
    )
    panels = []
    for scale, values, title in channels:
        legs = [
            line(log.t_s, scale * values[:, leg], LEG_COLOURS[leg], f"leg {leg + 1}", width=1.2) for leg in range(6)
        ]
        panels.append(Panel(title, legs, marks=marks))
    return Chart(panels, columns=1, height=230)


def estimates(run: Run) -> Chart:
    """The paper's four parameters, as in its Figure 5, with three-sigma bands."""
    t = run.estimates["t"]
    truth = run.load_parameters(t)
    settled = _settled(t, [load["at_s"] for load in run.meta["loads"]])
    panels = [
        _estimate_panel(
            (SYMBOLS[name], UNITS[name]),
            (t, run.estimates[name], run.estimates[f"s_{name}"], truth[name]),
            settled,
            (),
            2 * THIRD,
        )
        for name in PAPER_PARAMETERS
    ]
    return Chart(panels, columns=2, height=250)


def paper_estimates(t: Array, value: Array, sigma: Array) -> Chart:
    """The paper's four parameters, (n, 4), of a replay, which knows of no truth."""
    settled = _settled(t, ())
    panels = [
        _estimate_panel((SYMBOLS[name], UNITS[name]), (t, value[:, k], sigma[:, k], None), settled, (), 2 * THIRD)
        for k, name in enumerate(PAPER_PARAMETERS)
    ]
    return Chart(panels, columns=2, height=250)


def load_estimates(
    t: Array, value: Array, sigma: Array, truth: Array | None, load_changes_s: Sequence[float], marks: Marks = ()
) -> Chart:
    """The ten parameters, (n, 10), in rows of mass and moments of mass, moments of inertia, products; where the load
    changes, at `load_changes_s`, each row once more since the last change, on the scale of that load."""
    since = int(np.searchsorted(t, load_changes_s[-1])) if len(load_changes_s) else 0
    has_last = 0 < since < len(t) - 1
    settled = _settled(t, load_changes_s)
    panels = []
    for row in ROWS_OF_THETA:
        for begin in (0, since) if has_last else (0,):
            for name in row:
                k, part = THETA_NAMES.index(name), slice(begin, None)
                columns = (t[part], value[part, k], sigma[part, k], None if truth is None else truth[part, k])
                title = f"{name} since {t[begin]:.3f} s" if begin else name
                panels.append(
                    _estimate_panel(
                        (title, unit_of(name)), columns, settled[part], marks, QUARTER, begins=name == row[0]
                    )
                )
    return Chart(panels, columns=4, height=210)


def _settled(t: Array, changes_s: Sequence[float]) -> NDArray[np.bool_]:
    """All but the first part of the time with each load."""
    begins = np.unique(np.searchsorted(t, [t[0], *changes_s]))
    settled = np.zeros(len(t), dtype=bool)
    for begin, end in zip(begins, [*begins[1:], len(t)]):
        settled[begin + int(UNSETTLED * (end - begin)) : end] = True
    return settled


def _estimate_panel(
    name: tuple[str, str], columns: tuple, settled: NDArray[np.bool_], marks: Marks, points: int, begins: bool = False
) -> Panel:
    """`columns`: t, value, sigma, truth or None. The axis shows the settled part in full: its band, and the truth."""
    t, value, sigma, truth = columns
    low, high = value - 3.0 * sigma, value + 3.0 * sigma
    shown = [low[settled], high[settled]] + ([] if truth is None else [truth[settled]])
    bottom, top = float(np.nanmin(np.concatenate(shown))), float(np.nanmax(np.concatenate(shown)))
    spare = 0.12 * (top - bottom) or 1e-3 * abs(top) or 1.0
    factor, unit = unit_for(name[1], max(abs(bottom), abs(top)))
    curves = [band(t, factor * low, factor * high, "± 3σ", points)]
    if truth is not None:
        curves.append(line(t, factor * truth, TRUTH, "truth", points, dash="6 4"))
    curves.append(line(t, factor * value, ESTIMATE, "estimate", points, width=1.6))
    y_range = (factor * (bottom - spare), factor * (top + spare))
    return Panel(f"{name[0]}, {unit}", curves, y_range=y_range, marks=marks, begins_row=begins)


def innovation(t: Array, nis: Array, summary: NisSummary, marks: Marks = ()) -> Chart:
    """NIS of each tick, and its mean over windows, each with the 95 % band of a consistent filter."""
    every = max(1, len(t) // DOTS)
    dots = Series(t[::every], nis[::every], ESTIMATE, "NIS", kind="dots", size=1.2)
    means = line(summary.window_t_s, summary.window_mean, ESTIMATE, "mean NIS", 2 * THIRD)
    window = round(len(t) / len(summary.window_t_s))
    is_far = float(np.median(nis)) > FAR_NIS * summary.tick_band[1]
    panels = [
        Panel(
            title,
            (curve,),
            x_range=(float(t[0]), float(t[-1])),
            y_range=(LOWEST_NIS, ceiling) if is_far else (0.0, ceiling),
            y_log=is_far,
            levels=(float(summary.measurements),),
            shade=shade,
            marks=marks,
        )
        for title, curve, shade, ceiling in (
            ("NIS of each tick (no unit)", dots, summary.tick_band, _ceiling(nis, 2.0 * summary.tick_band[1])),
            (
                f"mean of {window} ticks",
                means,
                summary.window_band,
                _ceiling(summary.window_mean, 1.1 * summary.window_band[1]),
            ),
        )
    ]
    return Chart(panels, columns=2, height=270)


def _ceiling(values: Array, least: float) -> float:
    """Of an axis: above all values but those of the largest fiftieth that would dwarf the rest."""
    return max(least, min(1.05 * float(values.max()), 1.5 * float(np.quantile(values, 0.98))))


def coupling(matrix: list[list[float]], identifier: str) -> str:
    """The coupling matrix (19) at home as a table: kg m where a rotation meets a translation, kg m^2 between rotations."""
    values = np.array(matrix)
    reach = float(np.abs(values).max()) or 1.0
    heads = "".join(f"<th>{head}</th>" for head in ("ẍ", "ÿ", "z̈", "ω̇x", "ω̇y", "ω̇z"))
    rows = []
    for head, row in zip(("Fx", "Fy", "Fz", "Nx", "Ny", "Nz"), values):
        cells = []
        for value in row:
            share = round(100.0 * abs(value) / reach)
            colour = f"color-mix(in srgb, {ESTIMATE if value > 0 else ERROR} {0.55 * share:.0f}%, #f6f7f9)"
            text = f"{value:.4g}" if abs(value) > 1e-9 * reach else "0"
            cells.append(f'<td style="background: {colour}">{escape(text)}</td>')
        rows.append(f"<tr><th>{head}</th>{''.join(cells)}</tr>")
    return f'<table class="matrix" id="{escape(identifier)}"><thead><tr><th></th>{heads}</tr></thead>{"".join(rows)}</table>'
