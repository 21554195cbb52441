"""`hexload excite`: a motion that identifies a load as well as the machine allows, as a trajectory file."""

import json
import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from types import ModuleType

import numpy as np
from numpy.typing import NDArray
from rich import box
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from hexload.cli import excite_check
from hexload.cli.excite_check import MachineLimits, Use
from hexload.errors import InputError
from hexload.estimation.firmware_run import load_platform, native_firmware
from hexload.io.atomic_file import replaced_when_done
from hexload.simulation.sim import resolve_scenario
from hexload.theory.bound import THETA_NAMES, Sigmas, Trajectory, read_platform, rotation_from_rpy
from hexload.theory.excitation import (
    Basis,
    Limits,
    Problem,
    fitted,
    force_ratios,
    force_ratios_at_home,
    home_posture,
    optimise,
    relative_bound,
    steps_of,
)
from hexload.theory.machine_findings import FULL_STROKE_S

Array = NDArray[np.float64]

HEADER = "t,x,y,z,roll,pitch,yaw"
ROW_S = 2e-3  # of the file; the simulator's cubics between its rows have the speed right to 0.07 % at 5 Hz
HIGHEST_HZ = 5.0
TICK_S = 1e-3
DURATION_RANGE_S = (1.0, 120.0)
HOLDING_SHARE = 0.5  # of the legs' force: the rest is for the motion
HEAVIEST_RATIO = 1.5  # of the expected load
# What a motion may use of the machine's limits; the rest is for the servo's errors. Stroke, speed and force: the
# simulator's shares.
SUPPLY_SHARE = 0.8
FOLLOWED_SHARE = 0.15  # of the stroke: a leg that is farther behind does not follow, whatever its valve has left
POSTURE_SHARE = 0.7  # of tilt, and of the room for condition and distance between home and their limits
TILT_MAX_DEG = 30.0
TILT_DEG = (1.0, 90.0)
HIGHEST_LOAD = 20.0  # of the hinges' radius
CONDITION_GROWTH = 3.0  # of home's
DISTANCE_LEFT = 0.3  # of home's
TRIES = 8
SMALLEST_STEP, LARGEST_STEP = 0.95, 0.5  # of a motion that is scaled down
PRIOR_SCALES = 10.0  # nothing is known beforehand: a sigma of ten times each parameter's scale
UNKNOWN_SCALES = 1.0  # a bound beyond its scale: the motion tells nothing
PAPER_SCENARIO = "paper"
MULTISINE_SCENARIO = "multisine"
ACTUATOR_KEYS = ("leg_speed_m_s", "leg_force_n", "speed_sum_m_s")  # of [actuators] in the platform file
ACTUATOR_OPTIONS = ("--leg-speed", "--leg-force", "--speed-sum")


@dataclass(frozen=True)
class Wish:
    """What the user asks for."""

    platform_file: Path
    duration_s: float
    scenario: str | None  # whose hydraulics and servo bound the motion; None: the actuators do
    mass_kg: (
        float | None
    )  # of the expected load; None: the platform file's known mass, or else twice the platform's own
    height_m: float | None  # of its centre of mass over O_A; None: three quarters of the platform hinges' radius
    seed: int
    starts: int
    iterations: int
    sines: int
    frequency_max_hz: float
    mass_max_kg: float | None = None  # the heaviest load that is possible; None: HEAVIEST_RATIO of the expected one
    actuators: tuple[float | None, float | None, float | None] = (None, None, None)  # ACTUATOR_KEYS; else the file's
    tilt_max_deg: float = TILT_MAX_DEG
    condition_max: float | None = None  # None: CONDITION_GROWTH of home's
    distance_min: float | None = None  # None: DISTANCE_LEFT of home's
    empty: bool = False  # for `hexload commission`: without load, the unknowns are the platform's own parameters


@dataclass(frozen=True)
class Column:
    """Relative bounds of one motion."""

    name: str
    bound: Array  # (10,) shares of the scales
    keeps_limits: bool


@dataclass(frozen=True)
class Design:
    """What was written, and what it is compared with."""

    columns: list[Column]  # the motion found first
    problem: Problem
    machine: MachineLimits
    planned: dict[str, float]  # of excite_check.QUANTITIES, what the motion asks for
    uses: list[Use]  # of the simulated runs
    scaled: float  # 1: as found


def design(wish: Wish, out: Path) -> Design:
    """Writes the trajectory file `out` and a summary beside it, `out` with .json.

    Nothing is written of a motion with which the simulated machine is not safe, with any of the loads. Raises InputError.
    """
    _check(wish, out)
    native = native_firmware()
    platform = load_platform(native, wish.platform_file)
    scenario = machine_of(native, wish, platform)
    problem, machine = problem_of(wish, platform, scenario)
    excite_check.check_home(problem, machine)
    _check_rest(problem)
    coefficients = _search(wish, problem)
    with replaced_when_done(out) as temporary, replaced_when_done(summary_of(out)) as summary:
        basis = Basis(problem, ROW_S)

        def write(scale: float) -> None:
            rows = basis.motion(scale * coefficients)[:, :6]
            np.savetxt(temporary, np.column_stack([basis.t_s, rows]), "%.9g", ",", header=HEADER, comments="")

        def simulated() -> list[Use]:
            loads = loads_of(problem)
            return excite_check.simulate(native, scenario, platform, problem, machine, temporary, loads)

        scaled, uses = _made_safe(write, simulated, machine)
        rows, keeps_limits = scenario.reference_motion(platform, wish.duration_s, file=temporary)
        if not keeps_limits:
            raise AssertionError("the motion found breaks the limits that it was made for")
        forces = force_ratios(problem, Basis(problem, TICK_S).motion(scaled * coefficients))
        columns = [
            _column("found", problem, (rows, keeps_limits)),
            *(
                _column(name, problem, motion)
                for name in (PAPER_SCENARIO, MULTISINE_SCENARIO)
                if (motion := _motion_of(native, scenario, platform, wish.duration_s, name)) is not None
            ),
        ]
        planned = excite_check.planned_use(problem, machine, forces, rows)
        found = Design(columns, problem, machine, planned, uses, scaled)
        summary.write_text(json.dumps(_summary(wish, found), indent=2) + "\n", encoding="utf-8")
    return found


def _search(wish: Wish, problem: Problem) -> Array:
    """Coefficients that keep the limits at every tick."""
    best, console = math.inf, Console(stderr=True)
    with Progress(console=console, transient=True, disable=not console.is_terminal) as progress:
        task = progress.add_task("searching", total=steps_of(wish.starts, wish.iterations))

        def advance(bound: float) -> None:
            nonlocal best
            best = min(best, bound)
            progress.update(task, advance=1, description=f"searching, worst bound {100 * best:.3g} % of scale")

        coefficients = optimise(problem, wish.seed, wish.starts, wish.iterations, advance)
    return fitted(problem, coefficients, TICK_S)


def _made_safe(
    write: Callable[[float], None], simulated: Callable[[], list[Use]], machine: MachineLimits
) -> tuple[float, list[Use]]:
    """The largest tried scale of the motion with which all simulated runs are safe, and these runs."""
    scale = 1.0
    for _ in range(TRIES):
        write(scale)
        uses = simulated()
        worst = max(uses, key=lambda use: use.shares[use.worst])
        if worst.is_safe:
            return scale, uses
        scale *= float(np.clip(SMALLEST_STEP / worst.shares[worst.worst], LARGEST_STEP, SMALLEST_STEP))
    raise InputError(excite_check.refusal(worst, machine, TRIES))


def loads_of(problem: Problem) -> dict[str, Array]:
    """The loads that a motion is simulated with, by what they are called in messages: theta."""
    if not problem.heaviest_theta.any():
        return {"no": np.zeros(10)}
    return {"no": np.zeros(10), "the expected": problem.theta, "the heaviest": problem.heaviest_theta}


def machine_of(native: ModuleType, wish: Wish, platform):
    """The scenario that has the machine's actuators and servo; raises InputError when nobody has stated them."""
    given = [name for name, value in zip(ACTUATOR_OPTIONS, wish.actuators) if value is not None]
    if wish.scenario is not None:
        if given:
            raise InputError(
                f"{given[0]}: found together with --scenario, expected one of them: the scenario has its own"
            )
        return _load_scenario(native, resolve_scenario(wish.scenario))
    for name, value in zip(ACTUATOR_OPTIONS, wish.actuators):
        if value is not None and not 0.0 < value < np.inf:
            raise InputError(f"{name}: found {value:g}, expected a positive number")
    values = [option if option is not None else stated for option, stated in zip(wish.actuators, platform.actuators)]
    missing = [key for key, value in zip(ACTUATOR_KEYS, values) if value is None]
    if missing:
        raise InputError(
            f"{wish.platform_file}: actuators.{', actuators.'.join(missing)}: found nothing, expected what the actuators "
            f"can do: {', '.join(ACTUATOR_KEYS)} in the section [actuators], or the options "
            f"{', '.join(ACTUATOR_OPTIONS)}, or --scenario for the hydraulics and servo of a scenario"
        )
    stroke_m = platform.stroke_m[1] - platform.stroke_m[0]
    if stroke_m < FULL_STROKE_S[0] * values[0]:
        raise InputError(
            f"{ACTUATOR_OPTIONS[0]}: found {values[0]:g} m/s, the stroke of {stroke_m:g} m in {stroke_m / values[0]:.2g} s, "
            f"expected {FULL_STROKE_S[0]:g} s or more (m/s, not mm/s)"
        )
    return native.scaled_machine(platform, values, heaviest_kg(wish, platform))


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
    if wish.empty and (wish.mass_kg is not None or wish.height_m is not None):
        raise InputError("--empty: found together with --mass or --height, expected one of them: it means no load")
    if not TILT_DEG[0] <= wish.tilt_max_deg < TILT_DEG[1]:
        raise InputError(
            f"--tilt-max: found {wish.tilt_max_deg:g} deg, expected {TILT_DEG[0]:g} to less than {TILT_DEG[1]:g} (not rad)"
        )
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
    share = force_ratios_at_home(problem).max()
    if share > HOLDING_SHARE and not problem.heaviest_theta.any():
        raise InputError(
            f"found the platform alone to take {100 * share:.0f} % of what the legs may push, expected "
            f"{100 * HOLDING_SHARE:.0f} % at most: stronger actuators"
        )
    if share > HOLDING_SHARE:
        raise InputError(
            f"--mass: found {problem.theta[0]:g} kg, of which the heaviest load of {problem.heaviest_theta[0]:g} kg "
            f"(--mass-max) takes {100 * share:.0f} % of what the legs may push, "
            f"expected a load that takes {100 * HOLDING_SHARE:.0f} % at most, or stronger actuators"
        )


def _load_scenario(native: ModuleType, path: Path):
    try:
        return native.load_scenario(str(path))
    except ValueError as error:  # names the file itself
        raise InputError(str(error)) from None


def expected_kg(wish: Wish, platform) -> float:
    return wish.mass_kg or platform.known_mass_kg or 2.0 * platform.mass_kg


def heaviest_kg(wish: Wish, platform) -> float:
    expected = expected_kg(wish, platform)
    if wish.mass_max_kg is None:
        return HEAVIEST_RATIO * expected
    if not expected <= wish.mass_max_kg < np.inf:
        raise InputError(
            f"--mass-max: found {wish.mass_max_kg:g} kg, expected the {expected:g} kg of the expected load or more"
        )
    return wish.mass_max_kg


def problem_of(wish: Wish, platform, scenario) -> tuple[Problem, MachineLimits]:
    """The optimisation's problem, with a margin to the machine's limits, and these."""
    radius_m = _hinge_radius_m(platform)
    theta = load_on_axis(wish, platform, platform.mass_kg if wish.empty else expected_kg(wish, platform))
    scale = np.abs(theta)
    scale[1:3] = scale[3]
    scale[7:] = theta[4:7].mean()
    stroke_min_m, stroke_max_m, *planned = scenario.motion_limits(platform)
    speed_m_s, sum_m_s, force_n = scenario.machine_limits(platform)
    bounds = Limits(*platform.stroke_m, speed_m_s, sum_m_s, force_n, np.radians(wish.tilt_max_deg), np.inf, 0.0)
    problem = Problem(
        platform=read_platform(wish.platform_file),
        home_leg_length_m=platform.home_leg_length_m,
        length_m=radius_m,
        limits=replace(
            bounds,
            stroke_min_m=stroke_min_m,
            stroke_max_m=stroke_max_m,
            leg_speed_m_s=planned[0],
            speed_sum_m_s=SUPPLY_SHARE * sum_m_s,
            leg_force_n=planned[2],
            tilt_rad=POSTURE_SHARE * bounds.tilt_rad,
        ),
        sigmas=Sigmas(platform.velocity_sigma_m_s, platform.force_sigma_n),
        theta=np.zeros(10) if wish.empty else theta,
        heaviest_theta=np.zeros(10) if wish.empty else load_on_axis(wish, platform, heaviest_kg(wish, platform)),
        scale=scale,
        prior_sigma=PRIOR_SCALES * scale,
        duration_s=wish.duration_s,
        frequencies_hz=np.geomspace(max(0.2, 1.0 / wish.duration_s), wish.frequency_max_hz, wish.sines),
    )
    return _with_posture_limits(wish, problem, bounds, scenario.full_valve_error_m)


def _with_posture_limits(
    wish: Wish, problem: Problem, bounds: Limits, full_valve_error_m: float
) -> tuple[Problem, MachineLimits]:
    """Condition and distance to singularity by those of the home pose, unless the user has stated them."""
    home = home_posture(problem)
    condition, distance = float(home.condition[0]), float(home.distance[0])
    bounds = replace(
        bounds,
        condition=CONDITION_GROWTH * condition if wish.condition_max is None else wish.condition_max,
        distance=DISTANCE_LEFT * distance if wish.distance_min is None else wish.distance_min,
    )
    limits = replace(
        problem.limits,
        condition=condition + POSTURE_SHARE * (bounds.condition - condition),
        distance=distance - POSTURE_SHARE * (distance - bounds.distance),
    )
    stroke_m = bounds.stroke_max_m - bounds.stroke_min_m
    return replace(problem, limits=limits), MachineLimits(bounds, min(full_valve_error_m, FOLLOWED_SHARE * stroke_m))


def load_on_axis(wish: Wish, platform, mass_kg: float) -> Array:
    """Theta of a body as wide as the hinges' circle, its centre over O_A."""
    radius_m = _hinge_radius_m(platform)
    height_m = wish.height_m or 0.75 * radius_m
    if abs(height_m) > HIGHEST_LOAD * radius_m:
        raise InputError(
            f"--height: found {height_m:g} m over a platform of {radius_m:.3g} m, expected {HIGHEST_LOAD * radius_m:.3g} m "
            "at most (not mm)"
        )
    central_kg_m2 = mass_kg * (0.5 * radius_m) ** 2
    tilting_kg_m2 = central_kg_m2 + mass_kg * height_m**2
    return np.array([mass_kg, 0, 0, mass_kg * height_m, tilting_kg_m2, tilting_kg_m2, central_kg_m2, 0, 0, 0], float)


def _hinge_radius_m(platform) -> float:
    return float(np.linalg.norm(platform.platform_hinges_m, axis=1).mean())


def _motion_of(native: ModuleType, scenario, platform, duration_s: float, name: str) -> tuple[Array, bool] | None:
    """Of another scenario on this machine; None: it has no such motion inside its limits."""
    other = _load_scenario(native, resolve_scenario(name))
    try:
        return scenario.reference_motion(platform, duration_s, motion_of=other)
    except ValueError:
        return None


def _column(name: str, problem: Problem, motion: tuple[Array, bool]) -> Column:
    rows, keeps_limits = motion
    truth = Trajectory(rows[:, :3], rotation_from_rpy(rows[:, 3:6]), rows[:, 6:9], rows[:, 9:12])
    return Column(name, relative_bound(problem, truth), keeps_limits)


def _summary(wish: Wish, found: Design) -> dict:
    problem = found.problem
    return {
        "platform": wish.platform_file.name,
        "scenario": wish.scenario,
        "duration_s": wish.duration_s,
        "seed": wish.seed,
        "starts": wish.starts,
        "iterations": wish.iterations,
        "frequencies_hz": problem.frequencies_hz.tolist(),
        "limits": vars(found.machine.limits),
        "planned_limits": vars(problem.limits),
        "leg_error_limit_m": found.machine.leg_error_m,
        "characteristic_length_m": problem.length_m,
        "planned": found.planned,
        "simulated": {use.load: use.extremes for use in found.uses},
        "scaled": found.scaled,
        "parameters": list(THETA_NAMES),
        "theta": problem.theta.tolist(),
        "heaviest_theta": problem.heaviest_theta.tolist(),
        "scale": problem.scale.tolist(),
        "prior_sigma": problem.prior_sigma.tolist(),
        "relative_bound": {column.name: column.bound.tolist() for column in found.columns},
        "keeps_limits": {column.name: column.keeps_limits for column in found.columns},
    }


def print_summary(found: Design, wish: Wish, out: Path) -> None:
    """Limits with what is used of them, then bounds, the worst in the last row."""
    _print_limits(found)
    columns = found.columns
    what = "the platform's own parameters" if wish.empty else "the load"
    print(f"Cramer-Rao bound on {what} after {wish.duration_s:g} s in % of scale, beside that of other motions:")
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


def _print_limits(found: Design) -> None:
    limits, planned = found.machine.allowed(), found.problem.limits
    margins = {
        "stroke_share": planned.stroke_max_m / found.machine.limits.stroke_max_m,
        **{key: getattr(planned, key) for key in excite_check.QUANTITIES if hasattr(planned, key)},
    }
    loads = ", ".join(f"{use.load} load" for use in found.uses)
    heaviest_kg = found.problem.heaviest_theta[0]
    print(f"Simulated with servo and {loads}" + (f" (heaviest {heaviest_kg:.4g} kg):" if heaviest_kg else ":"))
    table = Table(box=box.SIMPLE_HEAD, padding=(0, 1, 0, 0))
    for name in ("", "limit", "planned limit", "planned", "simulated", "left of limit"):
        table.add_column(name, justify="right" if name else "left", no_wrap=True)
    for key in excite_check.QUANTITIES:
        extremes = [use.extremes[key] for use in found.uses]
        left = 1.0 - max(use.shares[key] for use in found.uses)
        table.add_row(
            key,
            f"{limits[key]:.4g}",
            *(f"{part[key]:.4g}" if key in part else "" for part in (margins, found.planned)),
            f"{(min if key == 'distance' else max)(extremes):.4g}",
            f"{100 * left:.0f} %",
        )
    Console().print(table)
    if found.scaled < 1.0:
        print(
            f"scaled down to {100 * found.scaled:.0f} % of the motion found, which the simulated machine did not follow"
        )


def _percent(share: float) -> str:
    return f"{100 * share:.4f}" if share < UNKNOWN_SCALES else "not excited"
