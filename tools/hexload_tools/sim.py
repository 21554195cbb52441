"""`hexload sim`: resolves the scenario's name and runs the simulator, the firmware's estimator in the loop."""

import subprocess
import tomllib
from pathlib import Path

from hexload_tools import build, project
from hexload_tools.errors import InputError, ToolFailed


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
            seed = tomllib.loads(scenario.read_text(encoding="utf-8"))["simulation"]["seed"]
        except (tomllib.TOMLDecodeError, UnicodeDecodeError, KeyError, TypeError):
            seed = 0  # the simulator refuses such a file, and says why
    return project.RUNS / f"{scenario.stem}-{seed}"


def run_simulation(name_or_file: str, out: Path | None = None, seed: int | None = None, options: tuple = ()) -> Path:
    """Runs a scenario and returns the run directory. `options`: further arguments of hexload_sim, passed as they are.

    Only the default directory is overwritten without asking: it is the tool's own.
    """
    scenario = resolve_scenario(name_or_file)
    directory = out or default_directory(scenario, seed)
    build.ensure_built("hexload_sim_app")
    command = [project.simulator(), scenario, "--out", directory, *options]
    if seed is not None:
        command += ["--seed", str(seed)]
    if out is None:
        directory.parent.mkdir(parents=True, exist_ok=True)
        command += ["--force"]
    status = subprocess.run(command).returncode
    if status != 0:
        raise ToolFailed(exit_code=status if status > 0 else 1)
    return directory
