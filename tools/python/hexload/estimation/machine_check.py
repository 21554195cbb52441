"""What a platform file says of a machine beside its numbers: home pose, reach, condition, and what of it cannot be."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hexload import project
from hexload.errors import InputError
from hexload.io.toml_document import guessed_in_words, read_toml
from hexload.theory import workspace
from hexload.theory.machine_findings import Finding, findings_of, has_velocity, order_findings
from hexload.theory.workspace import Map, Mechanism, Reach

Array = NDArray[np.float64]

TILTS_DEG = (0.0, 10.0, 20.0)
LAG_TICKS_MAX = 82  # HEXLOAD_LAG_TICKS_MAX
MUCH_SHORTER = 0.9  # than asked for


@dataclass(frozen=True)
class Checked:
    name: str  # of the file
    tables: Mapping[str, Any]
    machine: Mechanism
    height_m: float
    home_m: Array  # (6,) displacements of the legs in the level pose at home
    condition: float
    holding_n: Array  # (6,) of the empty platform
    reaches: list[Reach]
    findings: list[Finding]
    guessed: str  # of the body, in words

    @cached_property
    def maps(self) -> list[Map]:
        farthest_m = max(abs(each.from_home) for each in self.reaches if each.axis in "xy")
        return [workspace.condition_map(self.machine, np.radians(tilt), 1.1 * farthest_m) for tilt in TILTS_DEG]


def check(path: Path, name: str | None = None) -> Checked:
    """`name`: of the file in messages. Raises InputError when the reader, or the estimator, refuses it."""
    name = name or str(path)
    project.ensure_built("hexload_native")
    native = project.native_module()
    try:
        platform = native.load_platform(str(path))
        native.config_bytes(platform, platform.tick_s)
    except ValueError as error:
        message = str(error).replace(str(path), name)
        raise InputError("; ".join([message, *(str(each) for each in _order_of_refused(path))])) from None
    tables = read_toml(path)
    machine = workspace.machine_of(tables)
    return Checked(
        name=name,
        tables=tables,
        machine=machine,
        height_m=machine.platform.home_height_m,
        home_m=workspace.displacements(machine, np.zeros((1, 6)))[0],
        condition=float(workspace.conditions(machine, np.zeros((1, 6)))[0]),
        holding_n=workspace.holding_forces(machine, machine.platform.theta),
        reaches=workspace.reaches(machine),
        findings=findings_of(tables, machine),
        guessed=guessed_in_words(path, tuple(tables["platform"]), name),
    )


def _order_of_refused(path: Path) -> list[Finding]:
    """Legs in another's place are refused for their lengths: the order is the cause."""
    try:
        geometry = read_toml(path)["geometry"]
        hinges = [np.array(geometry[key], float) for key in ("base_hinges_m", "platform_hinges_m")]
    except (OSError, ValueError, KeyError, TypeError):
        return []
    if any(points.shape != (6, 3) or not np.isfinite(points).all() for points in hinges):
        return []
    return list(order_findings(*hinges))


def lag_in_words(tables: Mapping[str, Any]) -> str:
    """That the momentum filter looks back less far than it should at this tick; nothing where it does not. Source:
    hexload_config_set_momentum()."""
    sensors = tables["sensors"]
    if not has_velocity(sensors):
        return ""
    tick_s = sensors.get("tick_s", 1e-3)
    ratio = 32.0 * sensors["displacement_sigma_m"] / (sensors["velocity_sigma_m_s"] * tick_s)
    wanted = 0.5 * (np.cbrt(12.0 * ratio**2) - 1.0)
    if LAG_TICKS_MAX > MUCH_SHORTER * wanted:
        return ""
    return (
        f"the filter looks back {1e3 * LAG_TICKS_MAX * tick_s:.3g} ms ({LAG_TICKS_MAX} ticks) of the {1e3 * wanted * tick_s:.3g} ms "
        "that these sensors ask for: on slow motion inertias end wide, as their sigmas say"
    )


def axis_title(axis: str) -> str:
    return f"{axis}, {'mm' if axis in 'xyz' else 'deg'}"


def shown(reach: Reach) -> str:
    return f"{1e3 * reach.from_home:.0f}" if reach.axis in "xyz" else f"{np.degrees(reach.from_home):.1f}"


def map_words(each: Map) -> str:
    inside = np.isfinite(each.condition)
    if not inside.any():
        return "nowhere in reach at home's height"
    area_m2 = inside.sum() * (each.x_m[1] - each.x_m[0]) ** 2
    return (
        f"{area_m2:.3g} m2 of x and y in reach at home's height, condition "
        f"{np.nanmin(each.condition):.3g} to {np.nanmax(each.condition):.3g}"
    )
