"""`hexload platform check`: a machine's figures on the terminal, as JSON and as a page."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from rich import box
from rich.console import Console
from rich.table import Table

from hexload.estimation.machine_check import Checked, axis_title, lag_in_words, map_words, shown
from hexload.io.atomic_file import replaced_when_done

Array = NDArray[np.float64]


def figures(checked: Checked) -> dict:
    return {
        "platform": checked.name,
        "is_plausible": not checked.findings,
        "findings": checked.findings,
        "guessed": checked.guessed,
        "home": {
            "height_m": checked.height_m,
            "leg_length_m": checked.machine.home_leg_length_m + checked.home_m,
            "displacement_m": checked.home_m,
            "condition": checked.condition,
            "holding_force_n": checked.holding_n,
        },
        "lag": lag_in_words(checked.tables),
        "reach": checked.reaches,
        "condition_map": checked.maps,
    }


def print_checked(checked: Checked) -> None:
    machine = checked.machine
    lengths = machine.home_leg_length_m + checked.home_m
    print(f"home:      {1e3 * checked.height_m:.1f} mm high, legs {_range(1e3 * lengths)} mm, {_off(checked.home_m)}")
    print(f"condition: {checked.condition:.3g} at home (1 at best)")
    print(f"holding:   {_range(checked.holding_n)} N a leg, empty, at home")
    table = Table(box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for title in ("from home", "down to", "limit", "up to", "limit"):
        table.add_column(title, justify="left" if title in ("from home", "limit") else "right", no_wrap=True)
    for low, high in zip(checked.reaches[::2], checked.reaches[1::2]):
        table.add_row(axis_title(low.axis), shown(low), low.limit, shown(high), high.limit)
    Console().print(table)
    for each in checked.maps:
        print(f"tilt {np.degrees(each.tilt_rad):3.0f} deg in any direction: {map_words(each)}")
    if words := lag_in_words(checked.tables):
        print(f"lag:       {words}")
    if checked.guessed:
        print(f"guessed:   {checked.guessed}: what the guess is off, the load's estimate will be")
    print_findings(checked)


def print_findings(checked: Checked) -> None:
    for each in checked.findings:
        print(f"implausible: {each}")
    print(f"{checked.name}: {'plausible' if not checked.findings else f'{len(checked.findings)} implausible'}")


def _range(values: Array) -> str:
    low, high = float(values.min()), float(values.max())
    return f"{low:.1f}" if high - low < 0.05 else f"{low:.1f} to {high:.1f}"


def _off(displacement: Array) -> str:
    most = float(np.abs(displacement).max())
    return "as stated" if most < 1e-5 else f"up to {1e3 * most:.2f} mm off those stated"


def write_page(checked: Checked, out: Path) -> None:
    from hexload.report.platform_page import render

    with replaced_when_done(out) as temporary:
        temporary.write_text(render(checked), encoding="utf-8")
