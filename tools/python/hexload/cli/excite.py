"""`hexload excite`: a motion that identifies a load as well as the machine allows, as a trajectory file."""

import json
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType

import numpy as np
from numpy.typing import NDArray
from rich import box
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from hexload.errors import InputError
from hexload.estimation.firmware_run import load_platform, native_firmware
from hexload.io.atomic_file import replaced_when_done
from hexload.simulation.sim import resolve_scenario
from hexload.theory.bound import THETA_NAMES, Sigmas, Trajectory, read_platform, rotation_from_rpy
from hexload.theory.excitation import Basis, Limits, Problem, fitted, limit_ratios_at_home, optimise, relative_bound

Array = NDArray[np.float64]

HEADER = "t,x,y,z,roll,pitch,yaw"
ROW_S = 2e-3  # of the file; the simulator's cubics between its rows have the speed right to 0.07 % at 5 Hz
HIGHEST_HZ = 5.0
TICK_S = 1e-3
DURATION_RANGE_S = (1.0, 120.0)
HOLDING_SHARE = 0.5  # of the legs' force: the rest is for the motion
PRIOR_SCALES = 10.0  # nothing is known beforehand: a sigma of ten times each parameter's scale
UNKNOWN_SCALES = 1.0  # a bound beyond its scale: the motion tells nothing
PAPER_SCENARIO = "paper"
MULTISINE_SCENARIO = "multisine"


@dataclass(frozen=True)
class Wish:
    """What the user asks for."""

    platform_file: Path
    duration_s: float
    scenario: str  # whose hydraulics and limits bound the motion
    mass_kg: (
        float | None
    )  # of the expected load; None: the platform file's known mass, or else twice the platform's own
    height_m: float | None  # of its centre of mass over O_A; None: three quarters of the platform hinges' radius
    seed: int
    starts: int
    iterations: int
    sines: int
    frequency_max_hz: float


@dataclass(frozen=True)
class Column:
    """Relative bounds of one motion."""

    name: str
    bound: Array  # (10,) shares of the scales
    keeps_limits: bool


def design(wish: Wish, out: Path) -> list[Column]:
    """Writes the trajectory file `out` and a summary beside it, `out` with .json.

    Returns the motion's bounds and those it is compared with. Raises InputError.
    """
    _check(wish, out)
    native = native_firmware()
    platform = load_platform(native, wish.platform_file)
    scenario = _load_scenario(native, resolve_scenario(wish.scenario))
    problem = problem_of(wish, platform, scenario)
    _check_rest(problem)
    with Progress(console=Console(stderr=True), transient=True) as progress:
        task = progress.add_task("searching", total=wish.starts * wish.iterations)
        coefficients = optimise(problem, wish.seed, wish.starts, wish.iterations, lambda: progress.advance(task))
    basis = Basis(problem, ROW_S)
    rows = basis.motion(fitted(problem, coefficients, TICK_S))[:, :6]
    with replaced_when_done(out) as temporary, replaced_when_done(summary_of(out)) as summary:
        np.savetxt(temporary, np.column_stack([basis.t_s, rows]), "%.9g", ",", header=HEADER, comments="")
        columns = [
            _column("found", problem, scenario.reference_motion(platform, wish.duration_s, file=temporary)),
            *(
                _column(name, problem, _motion_of(native, scenario, platform, wish.duration_s, name))
                for name in (PAPER_SCENARIO, MULTISINE_SCENARIO)
            ),
        ]
        if not columns[0].keeps_limits:
            raise AssertionError("the motion found breaks the limits that it was made for")
        summary.write_text(json.dumps(_summary(wish, problem, columns), indent=2) + "\n", encoding="utf-8")
    return columns


def summary_of(out: Path) -> Path:
    return out.with_suffix(".json")


def _check(wish: Wish, out: Path) -> None:
    if out == summary_of(out):
        raise InputError(f"--out: found {out}, expected another name: the summary is written to that one")
    least_s, most_s = DURATION_RANGE_S
    if not least_s <= wish.duration_s <= most_s:
        raise InputError(f"--duration: found {wish.duration_s:g} s, expected {least_s:g} to {most_s:g} s")
    if abs(wish.duration_s / ROW_S - round(wish.duration_s / ROW_S)) > 1e-6:
        raise InputError(f"--duration: found {wish.duration_s:g} s, expected a multiple of {ROW_S:g} s")
    if wish.mass_kg is not None and not 0.0 < wish.mass_kg < np.inf:
        raise InputError(f"--mass: found {wish.mass_kg:g} kg, expected a positive number")
    if wish.height_m is not None and not 0.0 < abs(wish.height_m) < np.inf:
        raise InputError(
            f"--height: found {wish.height_m:g} m, expected a number other than 0: errors of h are compared with |h|"
        )
    if not 1.0 / wish.duration_s < wish.frequency_max_hz <= HIGHEST_HZ:
        raise InputError(
            f"--frequency-max: found {wish.frequency_max_hz:g} Hz, expected more than 1 / duration = "
            f"{1 / wish.duration_s:g} Hz and {HIGHEST_HZ:g} Hz at most"
        )


def _check_rest(problem: Problem) -> None:
    """At home, at rest, the legs must hold platform and load with something left for the motion."""
    share = limit_ratios_at_home(problem).max()
    if share > HOLDING_SHARE:
        raise InputError(
            f"--mass: found {problem.theta[0]:g} kg, which takes {100 * share:.0f} % of what the legs may push, "
            f"expected a load that takes {100 * HOLDING_SHARE:.0f} % at most, or a scenario with stronger hydraulics"
        )


def _load_scenario(native: ModuleType, path: Path):
    try:
        return native.load_scenario(str(path))
    except ValueError as error:  # names the file itself
        raise InputError(str(error)) from None


def problem_of(wish: Wish, platform, scenario) -> Problem:
    radius_m = float(np.linalg.norm(platform.platform_hinges_m, axis=1).mean())
    mass_kg = wish.mass_kg or platform.known_mass_kg or 2.0 * platform.mass_kg
    height_m = wish.height_m or 0.75 * radius_m
    central_kg_m2 = mass_kg * (0.5 * radius_m) ** 2  # a body as wide as the hinges' circle
    tilting_kg_m2 = central_kg_m2 + mass_kg * height_m**2
    theta = np.array([mass_kg, 0, 0, mass_kg * height_m, tilting_kg_m2, tilting_kg_m2, central_kg_m2, 0, 0, 0], float)
    scale = np.abs(theta)
    scale[1:3] = scale[3]
    scale[7:] = theta[4:7].mean()
    return Problem(
        platform=read_platform(wish.platform_file),
        home_leg_length_m=platform.home_leg_length_m,
        limits=Limits(*scenario.motion_limits(platform)),
        sigmas=Sigmas(platform.velocity_sigma_m_s, platform.force_sigma_n),
        theta=theta,
        scale=scale,
        prior_sigma=PRIOR_SCALES * scale,
        duration_s=wish.duration_s,
        frequencies_hz=np.geomspace(max(0.2, 1.0 / wish.duration_s), wish.frequency_max_hz, wish.sines),
    )


def _motion_of(native: ModuleType, scenario, platform, duration_s: float, name: str) -> tuple[Array, bool]:
    other = _load_scenario(native, resolve_scenario(name))
    try:
        return scenario.reference_motion(platform, duration_s, motion_of=other)
    except ValueError as error:
        raise InputError(f"scenario {name}: {error}") from None


def _column(name: str, problem: Problem, motion: tuple[Array, bool]) -> Column:
    rows, keeps_limits = motion
    truth = Trajectory(rows[:, :3], rotation_from_rpy(rows[:, 3:6]), rows[:, 6:9], rows[:, 9:12])
    return Column(name, relative_bound(problem, truth), keeps_limits)


def _summary(wish: Wish, problem: Problem, columns: list[Column]) -> dict:
    return {
        "platform": wish.platform_file.name,
        "scenario": wish.scenario,
        "duration_s": wish.duration_s,
        "seed": wish.seed,
        "starts": wish.starts,
        "iterations": wish.iterations,
        "frequencies_hz": problem.frequencies_hz.tolist(),
        "limits": vars(problem.limits),
        "parameters": list(THETA_NAMES),
        "theta": problem.theta.tolist(),
        "scale": problem.scale.tolist(),
        "prior_sigma": problem.prior_sigma.tolist(),
        "relative_bound": {column.name: column.bound.tolist() for column in columns},
        "keeps_limits": {column.name: column.keeps_limits for column in columns},
    }


def print_summary(columns: list[Column], wish: Wish, out: Path) -> None:
    """Bounds on the terminal, the worst in the last row."""
    print(f"Cramer-Rao bound after {wish.duration_s:g} s in % of scale:")
    table = Table(box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    table.add_column("")
    for column in columns:
        table.add_column(column.name + ("" if column.keeps_limits else " *"), justify="right", no_wrap=True)
    for k, name in enumerate(THETA_NAMES):
        table.add_row(name, *(_percent(column.bound[k]) for column in columns))
    table.add_section()
    table.add_row("worst", *(_percent(column.bound.max()) for column in columns))
    Console().print(table)
    if not all(column.keeps_limits for column in columns):
        print("* beyond the machine's limits of stroke, leg speed or flow")
    print(f"motion:  {out}")
    print(f"summary: {summary_of(out)}")


def _percent(share: float) -> str:
    return f"{100 * share:.4f}" if share < UNKNOWN_SCALES else "not excited"
