"""A rig's parameters and the leg forces that they need: what `hexload commission` finds and rig.toml holds.

The load cell of leg i shows

    f_i(t + tau) = (1 + g_i) [ r_i + c_i ] + b_i,    c_i = (Fc_i + Fd_i exp(-(v_i / v_s)^2) + k_i |r_i|) s + d_i v_i

s follows the direction of motion, tanh(v / v_0), over the presliding length x_0 (Dahl 1968): ds/dt = |v| / x_0
(tanh(v / v_0) - s). That of a friction that turns at once is 0.

with r the forces that platform and legs need. With the twist of the platform, its acceleration and gravity as a vector,
all in platform axes, s = a - g, and the Jacobian's rows [e_i, a_i x e_i] there,

    J^T r = [m s + w' x h + w x (w x h);  h x s + I w' + w x I w] + sum over legs of [F_l; a_l x F_l]

F_l: what the mass of a leg takes beside the part that moves with the hinge, of leg_mass.py with three numbers,
`inertia_kg_m2`, `slide_kg_m` and `tilt_kg_m`. Accelerations come from the second derivatives of the leg lengths:

    J [a; w'] = l'' - |u_a|^2 / l - e (w x (w x a_i)),    u the hinge's velocity and u_a its part across the leg

Units are SI; arrays carry the tick as their first axis.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hexload.theory.bound import TENSOR
from hexload.theory.kinematics import LEGS, cross_matrix, leg_vectors, poses, vector_of_rotation

Array = NDArray[np.float64]

NOTHING_KEPT = 1e-17  # of a shape within 1


@dataclass(frozen=True)
class Geometry:
    base_hinges_m: Array  # (6, 3), base axes
    platform_hinges_m: Array  # (6, 3), platform axes
    home_leg_length_m: Array  # (6,)


@dataclass(frozen=True)
class LegMotion:
    """Pose and motion of the platform in its own axes, and the legs."""

    lengths_m: Array  # (n, 6)
    directions: Array  # e, (n, 6, 3), platform axes
    place_m: Array  # O_A from the origin of the base axes, (n, 3)
    to_platform: Array  # R^T, (n, 3, 3)
    twist: Array  # [v; w], (n, 6), platform axes
    acceleration: Array  # [a; w'] of O_A, (n, 6), platform axes, without gravity
    jacobian: Array  # (n, 6, 6), rows [e, a x e]
    per_leg: Array  # its inverse: twist per leg speed


def motion_of_legs(
    geometry: Geometry, displacement_m: Array, speed_m_s: Array, acceleration_m_s2: Array, near: LegMotion | None = None
) -> LegMotion:
    """From home, or from `near`; the derivatives are those of the displacements. Raises ValueError when legs reach no pose."""
    lengths = geometry.home_leg_length_m + displacement_m
    start = None if near is None else (near.place_m, np.swapaxes(near.to_platform, 1, 2))
    p, rotation, has_pose = _poses(geometry, lengths, start)
    if not has_pose.all():
        raise ValueError("leg displacements that no pose of this machine has")
    to_platform = np.swapaxes(rotation, 1, 2)
    vectors = leg_vectors(geometry.base_hinges_m, geometry.platform_hinges_m, p, rotation)
    e = np.einsum("nij,nlj->nli", to_platform, vectors) / lengths[:, :, None]
    arms = geometry.platform_hinges_m
    jacobian = np.concatenate([e, np.cross(arms, e)], axis=2)
    per_leg = np.linalg.inv(jacobian)
    twist = (per_leg @ speed_m_s[:, :, None])[:, :, 0]
    w = twist[:, None, 3:]
    hinge_speed = twist[:, None, :3] + np.cross(w, arms)
    across = hinge_speed - e * speed_m_s[:, :, None]
    turning = np.sum(across**2, axis=2) / lengths + np.sum(e * np.cross(w, np.cross(w, arms)), axis=2)
    acceleration = (per_leg @ (acceleration_m_s2 - turning)[:, :, None])[:, :, 0]
    return LegMotion(lengths, e, p, to_platform, twist, acceleration, jacobian, per_leg)


def has_pose(geometry: Geometry, displacement_m: Array) -> NDArray[np.bool_]:
    """(n,): rows whose legs, (n, 6), reach one pose together."""
    return _poses(geometry, geometry.home_leg_length_m + displacement_m)[2]


def _poses(
    geometry: Geometry, lengths_m: Array, start: tuple[Array, Array] | None = None
) -> tuple[Array, Array, NDArray[np.bool_]]:
    """As kinematics.poses(), from home or a start near them."""
    hinges = (geometry.base_hinges_m, geometry.platform_hinges_m)
    return poses(*hinges, lengths_m, *(start or _home(geometry, len(lengths_m))))


def _home(geometry: Geometry, rows: int) -> tuple[Array, Array]:
    spread = geometry.platform_hinges_m - geometry.base_hinges_m
    height = np.sqrt(np.mean(geometry.home_leg_length_m**2 - np.sum(spread[:, :2] ** 2, axis=1))) - spread[:, 2].mean()
    return np.tile([0.0, 0.0, height], (rows, 1)), np.tile(np.eye(3), (rows, 1, 1))


def leg_masses(geometry: Geometry, theta: Array) -> Array:
    """(6, 6): leg forces per leg acceleration, at home."""
    still, unit = np.zeros((LEGS + 1, LEGS)), np.vstack([np.zeros(LEGS), np.eye(LEGS)])
    forces = body_forces(motion_of_legs(geometry, still, still, unit), np.zeros(3)) @ theta
    return (forces[1:] - forces[0]).T


def body_forces(motion: LegMotion, gravity_m_s2: Array) -> Array:
    """Leg forces per unit of each of theta = [m, hx, hy, hz, Ixx, Iyy, Izz, Ixy, Ixz, Iyz], (n, 6, 10).

    `gravity_m_s2`: (3,), base axes, downwards."""
    return _of_wrench(motion, _body_wrenches(motion, gravity_m_s2))


def rigid_forces(motion: LegMotion, geometry: Geometry, gravity_m_s2: Array, theta: Array, leg_mass: Array) -> Array:
    """The legs' forces on the platform, r, (n, 6)."""
    wrench = _body_wrenches(motion, gravity_m_s2) @ theta
    wrench += _leg_mass_wrenches(motion, geometry, gravity_m_s2) @ leg_mass
    return _of_wrench(motion, wrench[:, :, None])[:, :, 0]


def _body_wrenches(motion: LegMotion, gravity_m_s2: Array) -> Array:
    s = motion.acceleration[:, :3] - motion.to_platform @ gravity_m_s2
    w, alpha = motion.twist[:, 3:], motion.acceleration[:, 3:]
    wrench = np.zeros((len(s), 6, 10))
    wrench[:, :3, 0] = s
    wrench[:, :3, 1:4] = cross_matrix(alpha) + cross_matrix(w) @ cross_matrix(w)
    wrench[:, 3:, 1:4] = -cross_matrix(s)
    for column, (i, j) in enumerate(zip(*TENSOR, strict=True), start=4):
        tensor = np.zeros((3, 3))
        tensor[i, j] = tensor[j, i] = 1.0
        wrench[:, 3:, column] = alpha @ tensor + np.cross(w, w @ tensor)
    return wrench


def weight_forces(motion: LegMotion, geometry: Geometry, gravity_m_s2: Array, theta: Array, leg_mass: Array) -> Array:
    """What gravity, or a change of it, has in rigid_forces(), (n, 6)."""
    up = -motion.to_platform @ gravity_m_s2
    e = motion.directions
    across = up[:, None] - e * np.sum(e * up[:, None], axis=2, keepdims=True)
    tilting = leg_mass[2] * across / motion.lengths_m[:, :, None]
    force = theta[0] * up + tilting.sum(axis=1)
    moment = np.cross(theta[1:4], up) + np.cross(geometry.platform_hinges_m, tilting).sum(axis=1)
    return _of_wrench(motion, np.concatenate([force, moment], axis=1)[:, :, None])[:, :, 0]


def leg_mass_forces(
    motion: LegMotion, geometry: Geometry, gravity_m_s2: Array, hinge_acceleration_m_s2: Array | None = None
) -> Array:
    """Leg forces per unit of `inertia_kg_m2`, `slide_kg_m` and `tilt_kg_m`, (n, 6, 3).

    `hinge_acceleration_m_s2`: of the upper hinges, (n, 6, 3), base axes, where it is not to be the motion's."""
    acceleration = None
    if hinge_acceleration_m_s2 is not None:
        acceleration = hinge_acceleration_m_s2 @ np.swapaxes(motion.to_platform, 1, 2)
    return _of_wrench(motion, _leg_mass_wrenches(motion, geometry, gravity_m_s2, acceleration))


def unlike_leg_forces(motion: LegMotion, geometry: Geometry, gravity_m_s2: Array) -> Array:
    """Of each leg's own, leg by leg, (n, 6, 18)."""
    wrenches = _wrenches_of_legs(motion, geometry, gravity_m_s2)
    return _of_wrench(motion, np.swapaxes(wrenches.reshape(len(wrenches), -1, 6), 1, 2))


def stiffness_forces(motion: LegMotion, geometry: Geometry) -> Array:
    """Per unit of each of the stiffnesses that pull the platform home, N/m along and N m/rad about the base axes,
    (n, 6, 6)."""
    way = motion.place_m - _home(geometry, 1)[0]
    turn = vector_of_rotation(np.swapaxes(motion.to_platform, 1, 2))
    wrench = np.zeros((len(way), 6, 6))
    wrench[:, :3, :3] = motion.to_platform * way[:, None]
    wrench[:, 3:, 3:] = motion.to_platform * turn[:, None]
    return _of_wrench(motion, wrench)


def hinge_speeds(motion: LegMotion, geometry: Geometry) -> Array:
    """Of the upper hinges, (n, 6, 3), base axes."""
    return _hinge_speeds(motion, geometry) @ motion.to_platform


def _hinge_speeds(motion: LegMotion, geometry: Geometry) -> Array:
    """(n, 6, 3), platform axes."""
    return motion.twist[:, None, :3] + np.cross(motion.twist[:, None, 3:], geometry.platform_hinges_m)


def _hinge_accelerations(motion: LegMotion, geometry: Geometry) -> Array:
    """(n, 6, 3), platform axes."""
    arms, w = geometry.platform_hinges_m, motion.twist[:, None, 3:]
    a, alpha = motion.acceleration[:, None, :3], motion.acceleration[:, None, 3:]
    return a + np.cross(alpha, arms) + np.cross(w, np.cross(w, arms))


def _wrenches_of_legs(
    motion: LegMotion, geometry: Geometry, gravity_m_s2: Array, hinge_acceleration_m_s2: Array | None = None
) -> Array:
    """Of each leg, per unit of its three numbers, (n, 6, 3, 6)."""
    arms, e = geometry.platform_hinges_m, motion.directions
    length = motion.lengths_m[:, :, None]
    speed, acceleration = _hinge_speeds(motion, geometry), hinge_acceleration_m_s2
    if acceleration is None:
        acceleration = _hinge_accelerations(motion, geometry)
    along = np.sum(e * speed, axis=2, keepdims=True)
    across = speed - along * e
    turning = acceleration - e * np.sum(e * acceleration, axis=2, keepdims=True)
    square = np.sum(across**2, axis=2, keepdims=True)

    def inertial(nu: Array, slope: Array) -> Array:
        return nu * turning + slope * along * across - (nu / length + slope / 2.0) * square * e

    up = (-motion.to_platform @ gravity_m_s2)[:, None]
    tilting = (up - e * np.sum(e * up, axis=2, keepdims=True)) / length
    parts = [inertial(length**-2, -2.0 * length**-3), inertial(-1.0 / length, length**-2), tilting]
    return np.stack([np.concatenate([part, np.cross(arms, part)], axis=2) for part in parts], axis=2)


def _leg_mass_wrenches(
    motion: LegMotion, geometry: Geometry, gravity_m_s2: Array, hinge_acceleration_m_s2: Array | None = None
) -> Array:
    """Of all legs alike, (n, 6, 3)."""
    wrenches = _wrenches_of_legs(motion, geometry, gravity_m_s2, hinge_acceleration_m_s2)
    return np.swapaxes(wrenches.sum(axis=1), 1, 2)


def _of_wrench(motion: LegMotion, wrench: Array) -> Array:
    return np.swapaxes(motion.per_leg, 1, 2) @ wrench


@dataclass(frozen=True)
class FrictionLaw:
    """What all legs have in common."""

    stribeck_speed_m_s: float
    reversal_speed_m_s: float
    presliding_m: float  # 0: friction turns with the speed


def slides(speed_m_s: Array, law: FrictionLaw, dt_s: float) -> Array:
    """s of each tick, the shape of the speeds: ds = |dx| / presliding (tanh(v / reversal) - s)."""
    towards = np.tanh(speed_m_s / law.reversal_speed_m_s)
    if law.presliding_m == 0.0:
        return towards
    kept = np.exp(-np.abs(speed_m_s) * dt_s / law.presliding_m)
    slide = (1.0 - kept) * towards
    # s of a tick is kept times the one before plus this; of 2, 4, 8 .. ticks so too, until nothing of before is kept.
    span = 1
    while span < len(slide) and kept[span:].max() > NOTHING_KEPT:
        slide[span:] += kept[span:] * slide[:-span]
        kept[span:] *= kept[:-span]
        span *= 2
    return slide


def friction_shapes(speed_m_s: Array, law: FrictionLaw, dt_s: float) -> Array:
    """Friction per unit of Coulomb's, the Stribeck extra and the viscous one: the shape of the speeds, times 3.

    That which grows with the leg's force has Coulomb's shape, times the force."""
    direction = slides(speed_m_s, law, dt_s)
    return np.stack([direction, stribeck_share(speed_m_s, law) * direction, speed_m_s], axis=-1)


def stribeck_share(speed_m_s: Array, law: FrictionLaw) -> Array:
    """What is left at a speed of what friction has beyond Coulomb's when it starts to slide."""
    return np.exp(-((speed_m_s / law.stribeck_speed_m_s) ** 2))


def gravity_vector(gravity_m_s2: float, tilt_rad: Array) -> Array:
    """In base axes, of a base that is turned by small angles about its x and y axes: g [sin ry.., ..], |g| as given. Raises
    ValueError when they are beyond a right angle."""
    x, y = gravity_m_s2 * np.asarray(tilt_rad, float)
    down = gravity_m_s2**2 - x**2 - y**2
    if not down > 0.0:
        raise ValueError("a base that is tilted by more than 90 degrees, as sensors of the wrong sign show it")
    return np.array([x, y, -np.sqrt(down)])
