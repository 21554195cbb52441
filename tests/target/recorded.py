"""The recorded logs of tests/data as the controller's input: samples, and a platform file that says the load's mass."""

import json
from functools import cache
from pathlib import Path

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
