"""`hexload sim`: resolves the scenario's name and runs the simulator, with the estimator in process or on a bus."""

import subprocess
import tempfile
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
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
# Fields of a SimRequest that are options of the simulator and of the controller, or of the simulator alone.
OF_BOTH = ("bus", "feed", "profile", "estimator", "prior", "rig", "key")
OF_SIMULATOR = (
    "seed", "duration", "substeps", "publish", "answer_timeout", "lockstep", "real_time", "sample_codes", "answer_codes",
    "force", "quiet",
)  # fmt: skip
FRICTION = ("coulomb_friction_n", "viscous_friction_n_s_m", "static_friction_n")  # of a scenario's hydraulics


@dataclass(frozen=True)
class SimRequest:
    """What is asked for, by the names of hexload_sim's options; None: as the scenario or the platform file says."""

    scenario: Path
    out: Path | None = None  # None: default_directory()
    seed: int | None = None
    duration: float | None = None  # s
    substeps: int | None = None
    estimator: str | None = None
    prior: str | None = None
    rig: Path | None = None
    bus: str | None = None
    profile: str | None = None
    lockstep: bool = False
    real_time: bool = False
    key: Path | None = None
    sample_codes: bool = False
    answer_codes: bool = False
    feed: str | None = None
    publish: str | None = None
    answer_timeout: float | None = None  # s
    external_controller: bool = False
    force: bool = False
    quiet: bool = False

    @property
    def is_on_bus(self) -> bool:
        return self.bus not in (None, "inproc")

    @property
    def starts_controller(self) -> bool:
        """As a program beside the simulator; else it is in the simulator's process, or on the bus already."""
        return bool(self.is_on_bus or self.feed) and not self.external_controller

    def for_live_page(self) -> "SimRequest":
        """For a page that hears the run on LCM, and without a bus commands its controller there too."""
        feed = "lcm" if self.feed is None and not self.is_on_bus else self.feed
        return replace(self, feed=feed, publish=self.publish or feed or "lcm")

    def simulator_options(self) -> tuple[str, ...]:
        return self._words(OF_BOTH + OF_SIMULATOR)

    def controller_options(self) -> tuple[str, ...]:
        """Of a hexload_ecu that fits this simulator."""
        return (*self._words(OF_BOTH), *(("--real-time-priority",) if self.real_time else ()))

    def _words(self, names: tuple[str, ...]) -> tuple[str, ...]:
        """The options that are given: flags alone, others with their value."""
        words = []
        for name in names:
            value = getattr(self, name)
            if value is not None and value is not False:
                words += [f"--{name.replace('_', '-')}", *([] if value is True else [str(value)])]
        return tuple(words)


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


def build_for(request: SimRequest) -> None:
    """The programs that run_simulation() starts."""
    project.ensure_built("hexload_sim_app", *(("hexload_ecu",) if request.starts_controller else ()))


def run_simulation(request: SimRequest) -> Path:
    """Runs a scenario and returns the run directory.

    Only the default directory is overwritten without asking: it is the tool's own. Raises ToolFailed with the status of the
    program that failed, the simulator's if both did.
    """
    refuse_other_units(request.scenario)
    directory = request.out or default_directory(request.scenario, request.seed)
    build_for(request)
    command = [project.simulator(), request.scenario, "--out", directory, *request.simulator_options()]
    if request.out is None:
        directory.parent.mkdir(parents=True, exist_ok=True)
        command += ["--force"]
    status = _run(command, request)
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


@contextmanager
def completed(request: SimRequest) -> Iterator[SimRequest]:
    """With what the user has left open: the estimator that fits, of which it tells, and a key for two programs that are
    started together."""
    if request.estimator is None and request.rig is None and (fit := fitting_estimator(request.scenario)):
        request = replace(request, estimator=fit[0])
        if not request.quiet:
            print(f"estimator {fit[0]}: {fit[1]}", flush=True)
    if request.key is None and request.is_on_bus and not request.external_controller:
        with tempfile.TemporaryDirectory() as folder:
            key = Path(folder, "run.key")
            new_key(key)
            yield replace(request, key=key)
    else:
        yield request


def _run(command: list, request: SimRequest) -> int:
    if not request.starts_controller:
        return _status(command)
    with running_controller(platform_file(request.scenario), request.controller_options()) as process:
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
