"""The page of `hexload platform check --report`: pictures of a machine, its reach, and maps of its condition."""

import numpy as np
from numpy.typing import NDArray

from hexload.estimation.machine_check import Checked, axis_title, map_words, shown
from hexload.report.charts import LEG_COLOURS, REFERENCE, Cells, Chart, Panel, Series, to_html
from hexload.report.page import templates
from hexload.theory.workspace import Map, Mechanism

Array = NDArray[np.float64]

TEMPLATE = "platform.html.jinja"
VIEWS = (("from above", 0, 1), ("from the front", 0, 2), ("from the side", 1, 2))  # title, axes
NAMES = "xyz"
SAME_MM = 1.0  # hinges of a view that are closer are drawn as one


def render(checked: Checked) -> str:
    machine = checked.machine
    figures = {"machine": pictures(machine), "maps": condition_maps(checked.maps)}
    return (
        templates()
        .get_template(TEMPLATE)
        .render(
            checked=checked,
            lengths_mm=(1e3 * (machine.home_leg_length_m + checked.home_m)).tolist(),
            reaches=[
                (axis_title(low.axis), shown(low), low.limit, shown(high), high.limit)
                for low, high in zip(checked.reaches[::2], checked.reaches[1::2])
            ],
            maps=[(float(np.degrees(each.tilt_rad)), map_words(each)) for each in checked.maps],
            figures={name: to_html(chart, f"{name}-figure") for name, chart in figures.items()},
        )
    )


def pictures(machine: Mechanism) -> Chart:
    """The machine at home from three sides, with the numbers of the legs at the base."""
    base = 1e3 * machine.platform.base_hinges_m
    upper = 1e3 * (machine.platform.platform_hinges_m + [0.0, 0.0, machine.platform.home_height_m])
    panels = []
    for title, across, up in VIEWS:
        series = []
        for points, name, dash in ((base, "base", "2 3"), (upper, "platform", "")):
            ring = np.vstack([_around(points), _around(points)[:1]])
            series.append(Series(ring[:, across], ring[:, up], REFERENCE, name, dash=dash, width=2.0))
        for leg, colour in enumerate(LEG_COLOURS):
            ends = np.array([base[leg], upper[leg]])
            look = {"kind": "both", "width": 3.0, "size": 3.5, "labels": (_label(base[:, [across, up]], leg), "")}
            series.append(Series(ends[:, across], ends[:, up], colour, f"leg {leg + 1}", **look))
        panels.append(Panel(title, series, x_title=f"{NAMES[across]}, mm", y_title=f"{NAMES[up]}, mm", same_scale=True))
    return Chart(panels, columns=3, height=340)


def _label(hinges: Array, leg: int) -> str:
    """Of a leg in a view: its number, with those of legs behind or before it at the first of them alone."""
    same = np.flatnonzero(np.linalg.norm(hinges - hinges[leg], axis=1) < SAME_MM)
    return ", ".join(str(each + 1) for each in same) if same[0] == leg else ""


def _around(points: Array) -> Array:
    """In the order of their angles about z."""
    centred = points - points.mean(axis=0)
    return points[np.argsort(np.arctan2(centred[:, 1], centred[:, 0]))]


def condition_maps(maps: list[Map]) -> Chart:
    """White: out of reach."""
    values = np.concatenate([each.condition[np.isfinite(each.condition)] for each in maps])
    low, high = (float(values.min()), float(values.max())) if values.size else (1.0, 2.0)
    panels = []
    for each in maps:
        condition = np.where(np.isfinite(each.condition), each.condition, np.nan)
        cells = Cells(1e3 * each.x_m, 1e3 * each.y_m, condition, low, max(high, low + 0.01), "condition")
        title = f"tilt {np.degrees(each.tilt_rad):.0f} deg, worst way"
        panels.append(Panel(title, x_title="x, mm", y_title="y, mm", cells=cells, same_scale=True))
    return Chart(panels, columns=3, height=330)
