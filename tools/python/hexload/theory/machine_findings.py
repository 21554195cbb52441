"""What is implausible in a platform file that its reader accepts: by key, found, and expected.

Ranges are those of the widest machines that are built, so that a number in another unit, a leg in another's place or a
mirrored list of hinges is named, and no real machine is.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hexload.theory import workspace
from hexload.theory.workspace import Mechanism

Array = NDArray[np.float64]

TWIST_DEG = 45.0  # of the platform's hinges against the base's, all together
SPREAD_DEG = 75.0  # of a leg's own twist about that
CLEARLY_DEG = 5.0  # less of it where two legs have changed places
CONDITION = 10.0  # of the home pose: force errors grow by it
END_SHARE = 0.05  # of the stroke, at home from its ends
ALIKE_SHARE = 0.2  # of the stroke: legs of one length at home differ less
STROKE_SHARE = 2.0  # of the shortest leg's length: no cylinder holds more
DENSITY = (5.0, 2e5)  # kg per cube of the hinges' radius
GYRATION = (0.1, 3.0)  # of the hinges' radius
FARTHEST_COM = 1.5  # of the hinges' radius
EARTH_M_S2 = (9.76, 9.84)
DISPLACEMENT_NOISE = (1e-8, 5e-3)  # of the whole stroke
VELOCITY_NOISE_M_S = 0.1
FORCE_NOISE = (5e-5, 30.0)  # of a leg's share of the empty platform's weight
FULL_STROKE_S = (0.02, 1000.0)  # at full speed
HIGHEST_HINGES = 1.0  # over the platform's origin, of the radius of their circle
LOAD = (1e-3, 200.0)  # of the empty platform's mass


@dataclass(frozen=True)
class Finding:
    key: str
    found: str
    expected: str

    def __str__(self) -> str:
        return f"{self.key}: found {self.found}, expected {self.expected}"


def findings_of(tables: Mapping[str, Any], machine: Mechanism) -> list[Finding]:
    order = list(order_findings(machine.platform.base_hinges_m, machine.platform.platform_hinges_m))
    parts = (_axes(machine), _home(machine), _stroke(machine), _body(tables["platform"], machine), _environment(tables))
    return [
        *order,
        *(each for part in (*parts, _sensors(tables, machine), _actuators(tables, machine)) for each in part),
    ]


def has_velocity(sensors: Mapping[str, Any]) -> bool:
    """As firmware/platform_file reads the table: without a noise of theirs there are no velocity sensors."""
    return bool(sensors.get("velocity", "velocity_sigma_m_s" in sensors))


def order_findings(base: Array, platform: Array) -> Iterator[Finding]:
    """Whether leg i of the one list is leg i of the other. Works on any two lists, also of a file that is refused."""
    key = "geometry.platform_hinges_m"
    twist, spread = _twist(base, platform)
    mirrored = [platform * sign for sign in ([1.0, -1.0, 1.0], [-1.0, 1.0, 1.0])]
    swaps = {pair: _twist(base, _swapped(platform, pair)) for pair in combinations(range(6), 2)}
    pair = min(swaps, key=lambda each: abs(swaps[each][0]) + swaps[each][1])
    spread_swapped = swaps[pair][1]
    spread_mirrored = min(_twist(base, each)[1] for each in mirrored)
    if spread > SPREAD_DEG and spread_mirrored <= min(SPREAD_DEG, spread_swapped):
        yield Finding(
            key,
            "legs mirrored: these hinges go round the other way than base_hinges_m",
            "both lists in the same order and in axes that are parallel at home (sign of x or y?)",
        )
    elif spread_swapped < min(spread - CLEARLY_DEG, SPREAD_DEG):
        legs = " and ".join(str(leg + 1) for leg in pair)
        yield Finding(key, f"legs {legs} in each other's place", "leg 1 to 6 in the same order in both lists")
    elif spread > SPREAD_DEG:
        yield Finding(
            key, "legs that cross: another order than base_hinges_m", "leg 1 to 6 in the same order in both lists"
        )
    elif abs(twist) > TWIST_DEG:
        yield Finding(
            key,
            f"hinges turned by {twist:.0f} deg against those of the base",
            f"{TWIST_DEG:.0f} deg at most: is the numbering one leg off?",
        )


def _swapped(points: Array, pair: tuple[int, int]) -> Array:
    order = np.arange(6)
    order[list(pair)] = pair[::-1]
    return points[order]


def _twist(base: Array, platform: Array) -> tuple[float, float]:
    """Mean angle from the base's hinges to the platform's about z, and the largest deviation of a leg from it, deg."""
    angles = [np.arctan2(*(points - points.mean(axis=0))[:, 1::-1].T) for points in (base, platform)]
    turn = np.exp(1j * (angles[1] - angles[0]))
    mean = np.angle(turn.sum())
    return float(np.degrees(mean)), float(np.degrees(np.abs(np.angle(turn * np.exp(-1j * mean))).max()))


def _axes(machine: Mechanism) -> Iterator[Finding]:
    hinges = machine.platform.platform_hinges_m
    radius, height = float(np.hypot(*hinges[:, :2].T).mean()), float(hinges[:, 2].mean())
    if abs(height) > HIGHEST_HINGES * radius:
        yield Finding(
            "geometry.platform_hinges_m",
            f"hinges at z = {height:.4g} m, on a circle of {radius:.4g} m",
            f"{HIGHEST_HINGES * radius:.4g} m at most: platform axes, whose origin is on the platform, not base axes",
        )


def _home(machine: Mechanism) -> Iterator[Finding]:
    condition = float(workspace.conditions(machine, np.zeros((1, 6)))[0])
    if condition > CONDITION:
        yield Finding(
            "geometry",
            f"home pose nearly singular, condition {condition:.3g}",
            f"{CONDITION:g} at most: platform hinges between the base's, of another angle than theirs",
        )
    low, high = machine.stroke_m
    displacement = workspace.displacements(machine, np.zeros((1, 6)))[0]
    leg = int(np.abs(displacement).argmax())
    if abs(displacement[leg]) > ALIKE_SHARE * (high - low):
        yield Finding(
            "geometry.home_leg_length_m",
            f"leg {leg + 1} off by {1e3 * displacement[leg]:+.1f} mm in the level pose of this mean length",
            f"{1e3 * ALIKE_SHARE * (high - low):.1f} mm at most: is a hinge of this leg wrong?",
        )


def _stroke(machine: Mechanism) -> Iterator[Finding]:
    low, high = machine.stroke_m
    stroke = high - low
    shortest = float(machine.home_leg_length_m.min()) + low
    if stroke > STROKE_SHARE * shortest:
        yield Finding(
            "geometry.stroke_m",
            f"a stroke of {stroke:.4g} m in legs that are {shortest:.4g} m long at their shortest",
            f"{STROKE_SHARE:g} times that at most: displacements from the home length, not lengths",
        )
    displacement = workspace.displacements(machine, np.zeros((1, 6)))[0]
    room = min((displacement - low).min(), (high - displacement).min())
    if room < END_SHARE * stroke:
        yield Finding(
            "geometry.stroke_m",
            f"home {1e3 * room:.4g} mm from the end of a leg's stroke",
            f"{1e3 * END_SHARE * stroke:.4g} mm or more: displacements from the home length, both ways",
        )
    for each in workspace.reaches(machine):
        if each.axis == "z" and each.limit == "singular":
            yield Finding(
                "geometry.stroke_m",
                f"the end of the stroke not to be reached {'down' if each.from_home < 0 else 'up'}wards from home: "
                f"{each.limit} after {1e3 * abs(each.from_home):.4g} mm",
                "a stroke that the geometry allows",
            )


def _body(body: Mapping[str, Any], machine: Mechanism) -> Iterator[Finding]:
    radius, mass = machine.radius_m, float(body["mass_kg"])
    low, high = (limit * radius**3 for limit in DENSITY)
    if not low <= mass <= high:
        yield Finding("platform.mass_kg", f"{mass:g} kg on a radius of {radius:.4g} m", f"{low:.3g} to {high:.3g} kg")
    gyration = np.sqrt(np.abs(np.array(body["inertia_kg_m2"][:3])) / mass)
    low, high = (limit * radius for limit in GYRATION)
    if not (low <= gyration.min() and gyration.max() <= high):
        yield Finding(
            "platform.inertia_kg_m2",
            f"radii of gyration {', '.join(f'{each:.3g}' for each in gyration)} m",
            f"{low:.3g} to {high:.3g} m on hinges of {radius:.4g} m (kg m^2 about the platform's origin)",
        )
    com = float(np.linalg.norm(body["com_m"]))
    if com > FARTHEST_COM * radius:
        yield Finding("platform.com_m", f"{com:.4g} m from the origin", f"{FARTHEST_COM * radius:.4g} m at most")


def _environment(tables: Mapping[str, Any]) -> Iterator[Finding]:
    gravity = float(tables["environment"]["gravity_m_s2"])
    if not EARTH_M_S2[0] <= gravity <= EARTH_M_S2[1]:
        yield Finding("environment.gravity_m_s2", f"{gravity:g} m/s^2", f"{EARTH_M_S2[0]} to {EARTH_M_S2[1]} on Earth")


def _sensors(tables: Mapping[str, Any], machine: Mechanism) -> Iterator[Finding]:
    sensors = tables["sensors"]
    stroke = machine.stroke_m[1] - machine.stroke_m[0]
    low, high = (share * stroke for share in DISPLACEMENT_NOISE)
    if not low <= sensors["displacement_sigma_m"] <= high:
        yield Finding(
            "sensors.displacement_sigma_m",
            f"{sensors['displacement_sigma_m']:g} m of noise on a stroke of {stroke:.4g} m",
            f"{low:.2g} to {high:.2g} m",
        )
    if has_velocity(sensors) and sensors["velocity_sigma_m_s"] > VELOCITY_NOISE_M_S:
        yield Finding(
            "sensors.velocity_sigma_m_s",
            f"{sensors['velocity_sigma_m_s']:g} m/s of noise",
            f"{VELOCITY_NOISE_M_S} m/s at most (not mm/s)",
        )
    share_n = float(tables["platform"]["mass_kg"]) * max(machine.platform.gravity_m_s2, 1.0) / 6.0
    low, high = (share * share_n for share in FORCE_NOISE)
    if tables["platform"]["mass_kg"] > DENSITY[1] * machine.radius_m**3:
        low = 0.0  # it is the mass
    if not low <= sensors["force_sigma_n"] <= high:
        yield Finding(
            "sensors.force_sigma_n",
            f"{sensors['force_sigma_n']:g} N of noise where a leg bears {share_n:.3g} N of the empty platform",
            f"{low:.2g} to {high:.3g} N (not kN)",
        )


def _actuators(tables: Mapping[str, Any], machine: Mechanism) -> Iterator[Finding]:
    actuators, load_kg = tables.get("actuators", {}), tables.get("load", {}).get("known_mass_kg")
    mass = float(tables["platform"]["mass_kg"])
    if load_kg is not None and not LOAD[0] <= load_kg / mass <= LOAD[1]:
        yield Finding(
            "load.known_mass_kg",
            f"{load_kg:g} kg on a platform of {mass:g} kg",
            f"{LOAD[0]:g} to {LOAD[1]:g} times that",
        )
    force = actuators.get("leg_force_n")
    weight = float(np.abs(workspace.holding_forces(machine, machine.platform.theta)).max()) * (
        1 + (load_kg or 0.0) / mass
    )
    if force is not None and force < weight:
        what = "the empty platform" if load_kg is None else f"platform and a load of {load_kg:g} kg"
        yield Finding(
            "actuators.leg_force_n", f"{force:g} N", f"more than the {weight:.4g} N that hold {what} (not kN)"
        )
    speed, total = actuators.get("leg_speed_m_s"), actuators.get("speed_sum_m_s")
    if speed is not None:
        seconds = (machine.stroke_m[1] - machine.stroke_m[0]) / speed
        if not FULL_STROKE_S[0] <= seconds <= FULL_STROKE_S[1]:
            yield Finding(
                "actuators.leg_speed_m_s",
                f"{speed:g} m/s, the whole stroke in {seconds:.3g} s",
                f"{FULL_STROKE_S[0]:g} to {FULL_STROKE_S[1]:g} s (m/s, not mm/s)",
            )
    if speed is not None and total is not None and not speed <= total <= 6.001 * speed:
        yield Finding(
            "actuators.speed_sum_m_s",
            f"{total:g} m/s of six legs",
            f"{speed:g} to {6 * speed:g} m/s, one leg's to six legs'",
        )
