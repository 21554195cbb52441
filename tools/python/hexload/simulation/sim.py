"""`hexload sim`: resolves the scenario's name and runs the simulator, with the estimator in process or on a bus."""

import subprocess
import tempfile
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from hexload import project
from hexload.errors import InputError, ToolFailed
from hexload.estimation.load_summary import inconsistent_words
from hexload.io.key_file import new_key
from hexload.io.run_directory import PAPER_PARAMETERS, read_run
from hexload.io.toml_document import read_toml
from hexload.simulation.virtual_controller import running_controller
from hexload.theory.bound import THETA_NAMES
from hexload.theory.workspace import displacements, machine_of

OUTSIDE = 0.1  # of the stroke's span, beyond which no motion asks for legs that there are
LONGER = 100.0  # than the run: time of another unit
FRICTION = ("coulomb_friction_n", "viscous_friction_n_s_m", "static_friction_n")  # of a scenario's hydraulics


def known_scenarios() -> list[str]:
    return sorted(path.stem for path in project.SCENARIOS.glob("*.toml"))


def resolve_scenario(name_or_file: str) -> Path:
    """A scenario file, or the name of one in host_sim/scenarios."""
    known = known_scenarios()
    if name_or_file in known:
        return project.SCENARIOS / f"{name_or_file}.toml"
    path = Path(name_or_file)
    if path.is_file():
        return path
    if path.suffix == ".toml":
        raise InputError(f"{name_or_file}: found no such file, expected a scenario (.toml)")
    raise InputError(f"unknown scenario '{name_or_file}', expected a .toml file or one of: {', '.join(known)}")


def default_directory(scenario: Path, seed: int | None) -> Path:
    """build/runs/NAME-SEED."""
    if seed is None:
        try:
            seed = read_toml(scenario)["simulation"]["seed"]
        except (tomllib.TOMLDecodeError, KeyError, TypeError):
            seed = 0  # the simulator refuses such a file, and says why
    return project.RUNS / f"{scenario.stem}-{seed}"


def platform_file(scenario: Path) -> Path:
    """The platform file that a scenario names."""
    try:
        named = read_toml(scenario)["platform"]
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{scenario}: found no valid TOML ({error}), expected a scenario") from None
    except KeyError:
        raise InputError(f"{scenario}: platform: found nothing, expected this key") from None
    return scenario.parent / str(named)


def build_for(controller: tuple | None) -> None:
    """The programs that run_simulation() starts."""
    project.ensure_built("hexload_sim_app", *(() if controller is None else ("hexload_ecu",)))


def run_simulation(
    name_or_file: str,
    out: Path | None = None,
    seed: int | None = None,
    options: tuple = (),
    controller: tuple | None = None,
) -> Path:
    """Runs a scenario and returns the run directory. `options`: further arguments of hexload_sim, passed as they are.

    Only the default directory is overwritten without asking: it is the tool's own. `controller`: options of hexload_ecu, which
    then runs as long as the simulator does; None: no such program is started. Raises ToolFailed with the status of the
    one that failed, the simulator's if both did.
    """
    scenario = resolve_scenario(name_or_file)
    refuse_other_units(scenario)
    directory = out or default_directory(scenario, seed)
    build_for(controller)
    command = [project.simulator(), scenario, "--out", directory, *options]
    if seed is not None:
        command += ["--seed", str(seed)]
    if out is None:
        directory.parent.mkdir(parents=True, exist_ok=True)
        command += ["--force"]
    status = _run(command, scenario, controller)
    if status != 0:
        raise ToolFailed(exit_code=status if status > 0 else 1)
    return directory


def refuse_other_units(scenario: Path) -> None:
    """A motion of a file that no legs of this machine make, or that is in another unit of time. Raises InputError."""
    try:
        world = read_toml(scenario)
        motion = scenario.parent / world["trajectory"]["path"]
        machine = machine_of(read_toml(scenario.parent / world["platform"]))
        rows = np.loadtxt(motion, delimiter=",", skiprows=1, ndmin=2)
        duration_s = float(world.get("simulation", {}).get("duration_s", 10.0))
    except (OSError, ValueError, KeyError, TypeError, IndexError):
        return  # no such motion, or files that the simulator refuses, and says why
    if rows.shape[1] != 7 or not np.isfinite(rows).all():
        return
    if np.ptp(rows[:, 0]) > LONGER * duration_s:
        raise InputError(
            f"{motion}: t: found {np.ptp(rows[:, 0]):g} s of motion for a run of {duration_s:g} s, expected seconds (not ms)"
        )
    low, high = machine.stroke_m
    legs = displacements(machine, rows[:, 1:])
    leg = int(np.abs(legs).max(axis=0).argmax())
    slack = OUTSIDE * (high - low)
    if not (low - slack <= legs.min() and legs.max() <= high + slack):
        raise InputError(
            f"{motion}: found leg {leg + 1} asked for {legs[:, leg].min():.4g} to {legs[:, leg].max():.4g} m, the stroke is "
            f"{low:g} to {high:g} m, expected x, y, z in m and angles in rad (not mm, not degrees)"
        )


def fitting_estimator(scenario: Path) -> tuple[str, str] | None:
    """The estimator that fits where the platform file's is the paper's and the scenario is not of its kind, and why; None:
    the platform file's."""
    try:
        world = read_toml(scenario)
        machine = read_toml(scenario.parent / world["platform"])
        kind, known_kg = machine["estimator"]["kind"], machine["load"]["known_mass_kg"]
        loads = [
            load
            for load in world.get("load", [])
            if load["at_s"] <= world.get("simulation", {}).get("duration_s", 10.0)
        ]
        reason = _no_load_of_the_paper(loads, known_kg)
        has_friction = any(np.any(world.get("hydraulics", {}).get(key, 0.0)) for key in FRICTION)
        has_bias = bool(np.any(world.get("sensors", {}).get("force_bias_n", 0.0)))
    except (OSError, tomllib.TOMLDecodeError, KeyError, TypeError, AttributeError, ValueError):
        return None  # the simulator refuses such files, and says why
    if kind != "paper" or not (reason or has_friction or has_bias):
        return None
    if has_friction or has_bias:
        return "momentum_effects", "legs have friction or bias, which the platform file's estimator paper does not know"
    return "momentum", f"{reason}, which the platform file's estimator paper takes for granted"


def _no_load_of_the_paper(loads: list[dict], known_kg: float) -> str:
    """Why; empty: it is one."""
    if len(loads) > 1:
        return "the load does not stay the same"
    for load in loads:
        if load["mass_kg"] != known_kg:
            return "the load is not of the known mass"
        if np.any(load.get("com_m", [0.0, 0.0, 0.0])[:2]) or np.any(load.get("inertia_com_kg_m2", [0.0] * 6)[3:]):
            return "the load is not symmetric about the z axis"
    return ""


def mend_in_words(directory: Path) -> str:
    """What to do about a run that ends inconsistent, or with the paper's filter as a misfit; empty: nothing, or the simulator
    has said it."""
    run = read_run(directory)
    has_said = run.meta["health_ticks"].get("model misfit") and not run.is_of_paper
    is_good = run.verdict not in (("misfit", "inconsistent") if run.is_of_paper else ("inconsistent",))
    if is_good or has_said or run.meta.get("input_faults"):
        return ""
    return inconsistent_words(run.is_of_paper)


def figures(directory: Path) -> dict:
    """A run's end: estimates beside the truth, and what was said of it."""
    run = read_run(directory)
    t_s = run.estimates["t"][-1:]
    names = PAPER_PARAMETERS if run.is_of_paper else THETA_NAMES
    truth = run.load_parameters(t_s).values() if run.is_of_paper else run.theta(t_s).T
    rows = {
        name: {"value": run.estimates[name][-1], "sigma": run.estimates[f"s_{name}"][-1], "truth": true[0]}
        for name, true in zip(names, truth)
    }
    said = ("seed", "duration_s", "rows", "missing", "refused")
    return {
        "run": directory,
        "estimator": run.meta["estimator"]["kind"],
        "verdict": run.verdict,
        "parameters": rows,
        "load_changes_s": run.meta.get("load_changes_detected_s", []),
        "health_ticks": {name: ticks for name, ticks in run.meta["health_ticks"].items() if ticks},
        **{key: run.meta[key] for key in said},
    }


def controller_options(
    bus: str | None,
    feed: str | None,
    profile: str | None,
    estimator: str | None,
    prior: str | None,
    rig: str | None,
    key: str | None,
    real_time: bool,
) -> tuple:
    """Options of a hexload_ecu that fits a simulator with these."""
    given = {
        "--bus": bus,
        "--feed": feed,
        "--profile": profile,
        "--estimator": estimator,
        "--prior": prior,
        "--rig": rig,
        "--key": key,
    }
    words = [word for name, value in given.items() if value is not None for word in (name, value)]
    return (*words, *(("--real-time-priority",) if real_time else ()))


@contextmanager
def key_for_one_run() -> Iterator[Path]:
    """A key file of two programs that are started together."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "run.key")
        new_key(path)
        yield path


def _run(command: list, scenario: Path, controller: tuple | None) -> int:
    if controller is None:
        return _status(command)
    with running_controller(platform_file(scenario), controller) as process:
        status = _status(command)
    return status or process.returncode


def _status(command: list) -> int:
    """Of the simulator, which Ctrl-C reaches too: it then writes what there is of the run."""
    process = subprocess.Popen(command)
    while True:
        try:
            return process.wait()
        except KeyboardInterrupt:
            continue
