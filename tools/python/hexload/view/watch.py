"""`hexload watch`: a controller in operation on the terminal, over ssh too, or as a JSON line at a time for scripts."""

import json
import os
import select
import sys
import termios
import time
import tty
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np
from rich.console import Console, Group
from rich.live import Live as Redrawn
from rich.table import Table
from rich.text import Text

from hexload import project
from hexload.errors import ToolFailed
from hexload.estimation.load_summary import SYMBOLS, digits_of, unit_of_parameter
from hexload.view.body import body_of_estimate
from hexload.view.frame import SIGMAS, Frame
from hexload.view.listening import listened_to
from hexload.view.live import RATE_S, Live
from hexload.view.words import VERDICTS

PERIOD_S = 0.25
LATEST = 6  # events that are shown
DIGITS = 4  # after the point, at most
COLOURS = {"converged": "bold cyan", "converging": "bold", "not_excited": "bold yellow"}  # others: magenta


def watch(
    bus: str | None,
    profile: str | None,
    url: str | None,
    machine: Any | None,
    is_json: bool,
    once_s: float | None,
    key: bytes | None = None,
) -> None:
    """Until q or Ctrl-C; with `once_s` until an answer of the controller, that many seconds at most. Raises ToolFailed
    when none came. `machine`: hexload_native's, for its tick and known mass; None: 1 ms, and no mass is known. `key`: of the
    controller on the bus, for the codes of its answers."""
    known_mass_kg = None if machine is None else machine.known_mass_kg
    with listened_to(bus, profile, url, 1e-3 if machine is None else machine.tick_s, key) as live:
        if once_s is not None:
            _wait_for_answer(live, once_s)
        if is_json:
            _print_lines(live, known_mass_kg, once_s is not None)
        elif once_s is not None:
            Console().print(_view(live, known_mass_kg))
        else:
            _redraw(live, known_mass_kg)


def _wait_for_answer(live: Live, limit_s: float) -> None:
    until = time.monotonic() + limit_s
    while live.frame().estimate is None:
        if time.monotonic() > until:
            words = "; ".join(live.health().lines)
            raise ToolFailed(f"{live.title}: found no estimate within {limit_s:g} s ({words}), expected a controller's")
        time.sleep(0.02)
    time.sleep(RATE_S)  # for the health and the rate that go with it
    live.rate()


def _print_lines(live: Live, known_mass_kg: float | None, is_once: bool) -> None:
    """Until Ctrl-C, or until whoever reads hangs up."""
    told = 0
    while True:
        events = live.events()
        new = events[len(events) - min(live.event_count - told, len(events)) :]
        told = live.event_count
        try:
            print(json.dumps(numbers(live, known_mass_kg, new), ensure_ascii=False), flush=True)
        except BrokenPipeError:
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())  # so that the end flushes into nothing
            return
        if is_once:
            return
        time.sleep(PERIOD_S)


def numbers(live: Live, known_mass_kg: float | None, events: list) -> dict:
    """SI units; null what is not known."""
    frame, estimate = live.frame(), live.frame().estimate
    found = {
        "t_s": round(frame.t_s, 3),
        "samples_per_s": live.rate(),
        "verdict": None if estimate is None else estimate.verdict,
        "parameters": {},
        "mass_kg": None,
        "com_m": None,
        "com_sigma_m": None,
        "events": [{"t_s": event.t_s, "words": event.words} for event in events],
        "health": list(live.health().lines),
    }
    if estimate is None:
        return found
    verdicts = estimate.parameter_verdict or (None,) * len(estimate.names)
    for name, value, sigma, verdict in zip(estimate.names, estimate.value, estimate.sigma, verdicts):
        found["parameters"][name] = {"value": _known(value), "sigma": _known(sigma), "verdict": verdict}
    body = body_of_estimate(project.native_module(), estimate.names, estimate.value, estimate.sigma, known_mass_kg)
    if body is not None:
        found |= {"mass_kg": _known(body.mass_kg), "com_m": [_known(number) for number in body.com_m]}
        found["com_sigma_m"] = [_known(number) for number in body.com_sigma_m]
    return found


def _known(number: float) -> float | None:
    return float(number) if np.isfinite(number) else None


def _redraw(live: Live, known_mass_kg: float | None) -> None:
    with _keys() as pressed, Redrawn(auto_refresh=False, screen=sys.stdout.isatty()) as screen:
        while "q" not in pressed(PERIOD_S):
            screen.update(Group(_view(live, known_mass_kg), Text("q ends", style="dim")), refresh=True)


@contextmanager
def _keys() -> Iterator:
    """A function that waits some seconds and says what was typed meanwhile, without the return key."""
    if not sys.stdin.isatty():
        yield lambda wait_s: time.sleep(wait_s) or ""
        return
    descriptor = sys.stdin.fileno()
    before = termios.tcgetattr(descriptor)
    tty.setcbreak(descriptor)
    try:
        yield lambda wait_s: _typed(descriptor, wait_s)
    finally:
        termios.tcsetattr(descriptor, termios.TCSADRAIN, before)


def _typed(descriptor: int, wait_s: float) -> str:
    if not select.select([descriptor], [], [], wait_s)[0]:
        return ""
    return os.read(descriptor, 64).decode(errors="replace")


def _view(live: Live, known_mass_kg: float | None) -> Group:
    frame = live.frame()
    parts = [Text(f"{live.title}   t = {frame.t_s:.2f} s", style="dim")]
    if frame.estimate is None:
        parts.append(Text("no estimate yet"))
    else:
        verdict = frame.estimate.verdict
        parts += [Text(VERDICTS.get(verdict, verdict), style=COLOURS.get(verdict, "bold magenta"))]
        parts += [_centre(frame, known_mass_kg), _table(frame)]
    parts += [Text(line) for line in live.health().lines]
    parts += [Text(f"{event.t_s:9.3f} s  {event.words}", style="dim") for event in live.events()[: -LATEST - 1 : -1]]
    return Group(*parts)


def _centre(frame: Frame, known_mass_kg: float | None) -> Text:
    estimate = frame.estimate
    body = body_of_estimate(project.native_module(), estimate.names, estimate.value, estimate.sigma, known_mass_kg)
    if body is None:
        return Text("centre of mass: not known yet")
    centre = ", ".join(
        f"{axis} {1e3 * value:.2f} ± {1e3 * SIGMAS * sigma:.2f}"
        for axis, value, sigma in zip("xyz", body.com_m, body.com_sigma_m)
    )
    return Text(f"mass {body.mass_kg:.2f} kg\ncentre of mass, mm (± 3σ): {centre}")


def _table(frame: Frame) -> Table:
    estimate = frame.estimate
    table = Table(box=None, padding=(0, 2, 0, 0))
    for heading in ("", "estimate", "± 3σ", "", "verdict"):
        table.add_column(heading, justify="right" if heading in ("estimate", "± 3σ") else "left")
    verdicts = estimate.parameter_verdict or ("",) * len(estimate.names)
    for name, value, sigma, verdict in zip(estimate.names, estimate.value, estimate.sigma, verdicts):
        digits = digits_of(SIGMAS * sigma, DIGITS)
        cells = (f"{value:z.{digits}f}", f"{SIGMAS * sigma:.{digits}f}", unit_of_parameter(name))
        table.add_row(SYMBOLS.get(name, name), *cells, verdict.replace("_", " "))
    return table
