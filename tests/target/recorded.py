"""The recorded logs of tests/data as the controller's input: samples, and a platform file that says the load's mass."""

import json
from functools import cache
from pathlib import Path

import numpy as np

from hexload import project
from hexload.estimation import rig_file
from hexload.io.log_file import LegLog, read_log

DATA = Path(__file__).parents[1] / "data"
LOGS = ("paper_clean", "paper_noisy", "multisine_eccentric", "work_motion", "load_pickup")


@cache
def log_of(name: str) -> LegLog:
    return read_log(DATA / f"{name}.csv.gz")


def platform_file(name: str, folder: Path) -> Path:
    """The machine of all logs, with the true mass of the log's load, which the paper's filter needs to know."""
    paper = DATA / "paper_load.toml"
    if name.startswith("paper"):
        return paper
    mass_kg = json.loads((DATA / f"{name}.truth.json").read_text())["segments"][0]["theta"][0]
    path = folder / f"{name}.toml"
    path.write_text(paper.read_text().replace("known_mass_kg = 500.0", f"known_mass_kg = {mass_kg}"))
    return path


def on_rig(platform, file: Path):
    """The platform as a rig on which everything is a little off; its rig file goes to `file`."""
    legs = np.arange(6.0)
    rig = rig_file.of_model(platform) | {
        "gravity_m_s2": [0.01, -0.02, -9.81],
        "leg_inertia_kg_m2": 0.05,
        "leg_slide_kg_m": 0.04,
        "leg_tilt_kg_m": 0.03,
        "coulomb_n": 1.0 + legs,
        "stribeck_n": 0.1 * legs,
        "growth_n_n": 1e-4 * legs,
        "viscous_n_s_m": 2.0 + legs,
        "presliding_m": 1e-5,
        "force_offset_n": legs - 2.5,
        "force_gain": 1e-4 * (legs - 2.5),
        "force_delay_s": 0.15e-3,
        "velocity_delay_s": 0.05e-3,
    }
    direction = {
        **dict.fromkeys(
            ("force_offset_n", "force_gain", "coulomb_n", "stribeck_n", "growth_n_n", "viscous_n_s_m"), [1e-4] * 6
        ),
        "gravity_m_s2": [1e-4, 0.0],
        "platform": [1e-3] * 10,
        **dict.fromkeys(("base_hinges_m", "platform_hinges_m"), [[1e-5] * 3] * 6),
    }
    file.write_text(rig_file.document(rig, {}, {}, [direction], platform))
    return project.native_module().with_rig(platform, str(file))
