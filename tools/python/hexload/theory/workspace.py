"""Where a platform can go, and how well its legs hold it there: reach along each axis, condition over the workspace.

The condition of a pose is that of hexload.theory.excitation: Frobenius norms of the Jacobian and its inverse, moments
divided by the mean radius of the platform's hinges; 1 at best, without bound at a singular pose.

Angles and arrays as in hexload.theory.bound; a pose is [x, y, z, roll, pitch, yaw] from home.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hexload.theory.bound import Platform, Trajectory, leg_jacobian, rotation_from_rpy, vectors_of_legs

Array = NDArray[np.float64]

AXES = ("x", "y", "z", "roll", "pitch", "yaw")
STEPS = 400  # of a way along an axis
LARGEST_TURN_RAD = np.radians(120.0)
CONDITION_GROWTH = 3.0  # of home's: beyond it a pose is not used
DIRECTIONS = 8  # of a tilt
GRID = 41  # points of a map in x and in y


@dataclass(frozen=True)
class Mechanism:
    """Hinges, legs and their ways: a machine without its sensors and drives."""

    platform: Platform
    home_leg_length_m: Array  # (6,), at zero displacement
    stroke_m: tuple[float, float]

    @property
    def radius_m(self) -> float:
        """Mean distance of the platform's hinges from O_A."""
        return float(np.linalg.norm(self.platform.platform_hinges_m, axis=1).mean())


@dataclass(frozen=True)
class Reach:
    """How far one axis alone goes from home."""

    axis: str
    from_home: float  # m, rad
    limit: str


@dataclass(frozen=True)
class Map:
    """The worst condition over the directions of a tilt, at home's height."""

    tilt_rad: float
    x_m: Array
    y_m: Array
    condition: Array  # (y, x); NaN where some direction of this tilt is out of reach


def machine_of(tables: dict) -> Mechanism:
    """Of a platform file's tables, which its reader has accepted."""
    from hexload.theory.bound import platform_of

    geometry = tables["geometry"]
    lengths = np.broadcast_to(np.asarray(geometry["home_leg_length_m"], float), (6,))
    low, high = geometry["stroke_m"]
    return Mechanism(platform_of(tables), lengths, (float(low), float(high)))


def displacements(machine: Mechanism, poses: Array) -> Array:
    """(n, 6) of the legs."""
    return np.linalg.norm(vectors_of_legs(machine.platform, _at_rest(poses)), axis=2) - machine.home_leg_length_m


def jacobians(machine: Mechanism, poses: Array) -> Array:
    """(n, 6, 6), moments divided by the hinges' radius."""
    jacobian = leg_jacobian(machine.platform, _at_rest(poses))
    jacobian[:, :, 3:] /= machine.radius_m
    return jacobian


def _at_rest(poses: Array) -> Trajectory:
    still = np.zeros((len(poses), 3))
    return Trajectory(poses[:, :3], rotation_from_rpy(poses[:, 3:]), still, still)


def conditions(machine: Mechanism, poses: Array) -> Array:
    """(n,); infinite where a pose is singular or beyond a singular one, seen from home."""
    jacobian = jacobians(machine, poses)
    home_side = np.sign(np.linalg.det(jacobians(machine, np.zeros((1, 6))))[0])
    is_good = home_side * np.linalg.det(jacobian) > 1e-12
    condition = np.full(len(poses), np.inf)
    condition[is_good] = np.linalg.cond(jacobian[is_good], "fro") / 6.0
    return condition


def holding_forces(machine: Mechanism, theta: Array) -> Array:
    """(6,): of the legs at home, which carry this body and nothing else."""
    weight = np.array([0.0, 0.0, theta[0], theta[2], -theta[1], 0.0]) * machine.platform.gravity_m_s2
    jacobian = jacobians(machine, np.zeros((1, 6)))[0]
    weight[3:] /= machine.radius_m
    return np.linalg.solve(jacobian.T, weight)


def reaches(machine: Mechanism) -> list[Reach]:
    """Both ways along each axis, to where the first leg is at its end or the pose is not to be used."""
    largest_m = float(machine.home_leg_length_m.max()) + machine.stroke_m[1]
    found = []
    for k, axis in enumerate(AXES):
        for sign in (-1.0, 1.0):
            poses = np.zeros((STEPS + 1, 6))
            poses[:, k] = sign * np.linspace(0.0, largest_m if k < 3 else LARGEST_TURN_RAD, STEPS + 1)
            found.append(_reach(machine, axis, k, poses))
    return found


def _reach(machine: Mechanism, axis: str, k: int, poses: Array) -> Reach:
    low, high = machine.stroke_m
    displacement = displacements(machine, poses)
    condition = conditions(machine, poses)
    most = CONDITION_GROWTH * condition[0]
    is_out = (displacement < low).any(axis=1) | (displacement > high).any(axis=1) | (condition > most)
    if not is_out.any():
        return Reach(axis, float(poses[-1, k]), "nothing")
    first = int(np.argmax(is_out))
    beyond = np.concatenate([low - displacement[first], displacement[first] - high])
    leg = int(np.argmax(beyond))
    if beyond[leg] > 0.0:
        limit = f"leg {leg % 6 + 1} {'shortest' if leg < 6 else 'longest'}"
    else:
        limit = "singular" if np.isinf(condition[first]) else f"condition x {CONDITION_GROWTH:g}"
    return Reach(axis, float(poses[max(first - 1, 0), k]), limit)


def condition_map(machine: Mechanism, tilt_rad: float, reach_m: float) -> Map:
    """Over x and y of -reach_m to reach_m, without yaw."""
    axis = np.linspace(-reach_m, reach_m, GRID)
    x, y = np.meshgrid(axis, axis)
    worst = np.zeros(x.size)
    low, high = machine.stroke_m
    directions = np.linspace(0.0, 2.0 * np.pi, DIRECTIONS, endpoint=False) if tilt_rad else np.zeros(1)
    for direction in directions:
        poses = np.zeros((x.size, 6))
        poses[:, 0], poses[:, 1] = x.ravel(), y.ravel()
        poses[:, 3:] = _tilt(tilt_rad, direction)
        displacement = displacements(machine, poses)
        condition = conditions(machine, poses)
        condition[(displacement < low).any(axis=1) | (displacement > high).any(axis=1)] = np.inf
        worst = np.maximum(worst, condition)
    worst[~np.isfinite(worst)] = np.nan
    return Map(tilt_rad, axis, axis, worst.reshape(x.shape))


def _tilt(tilt_rad: float, direction: float) -> Array:
    """Roll, pitch, yaw of a turn about the horizontal axis in this direction."""
    c, s = np.cos(direction), np.sin(direction)
    ct, st = np.cos(tilt_rad), np.sin(tilt_rad)
    roll, pitch = np.arctan2(c * st, ct), -np.arcsin(-s * st)
    yaw = np.arctan2(c * s * (1.0 - ct), c * c + s * s * ct)
    return np.array([roll, pitch, yaw])
