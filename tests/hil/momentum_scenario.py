"""A scenario for the momentum filter: nothing known of the load, and after a second another one lies on it."""

from pathlib import Path

from hexload import project

PICK_UP_S = 1.0
DURATION_S = 1.5
TICKS = round(1000 * DURATION_S) + 1
LIGHT = (200.0, [0.02, 0.01, 0.15])  # kg, centre of mass in m
HEAVY = (500.0, [0.06, -0.04, 0.30])
HEAVY_INERTIA_KG_M2 = [25.0, 30.0, 20.0, 1.0, -2.0, 0.5]

TEXT = f"""
name = "momentum"
description = "Six-axis multisine; another load is put on the first."
platform = "platform.toml"

[simulation]
duration_s = {DURATION_S}
seed = 3

[[load]]
at_s = 0.0
mass_kg = {LIGHT[0]}
com_m = {LIGHT[1]}
inertia_com_kg_m2 = [12.0, 10.0, 8.0, 0.0, 0.0, 0.0]

[[load]]
at_s = {PICK_UP_S}
mass_kg = {HEAVY[0]}
com_m = {HEAVY[1]}
inertia_com_kg_m2 = {HEAVY_INERTIA_KG_M2}

[trajectory]
kind = "multisine"
"""


def write(folder: Path) -> Path:
    """Scenario and, beside it, platform.toml: the paper's machine without the load's mass."""
    platform = (project.SCENARIOS / "platforms" / "paper.toml").read_text()
    assert platform.count("known_mass_kg = 500.0") == platform.count('kind = "paper"') == 1
    unknown = platform.replace("known_mass_kg = 500.0", "").replace('kind = "paper"', 'kind = "momentum"')
    (folder / "platform.toml").write_text(unknown)
    (folder / "momentum.toml").write_text(TEXT)
    return folder / "momentum.toml"


def of_heavy_load(name: str, description: str, duration_s: float, more: str) -> str:
    """The text of a scenario with that load from its start; `more`: tables of the plant."""
    return f"""
name = "{name}"
description = "{description}"
platform = "platform.toml"

[simulation]
duration_s = {duration_s}
seed = 5

[[load]]
at_s = 0.0
mass_kg = {HEAVY[0]}
com_m = {HEAVY[1]}
inertia_com_kg_m2 = {HEAVY_INERTIA_KG_M2}

[trajectory]
kind = "multisine"
{more}"""


def platform_of(scenario: Path) -> Path:
    return scenario.with_name("platform.toml")
