"""What wrong hinges do to the forces of rig_model.rigid_forces: their derivatives at the leg lengths that are measured.

A shift of one hinge changes its leg's vector by dd and its arm by da, and so turns the leg, by de = dd_a / l. As the
measured length stays, the platform moves as if that leg's length, speed and acceleration were off by

    rho = -e . dd,    beta = -(u . de + e . (w x da)),
    gamma = -(u' . de + 2 u_a . (w x da - l' de) / l + e . (w x (w x da) + w' x da))

with u and u' the upper hinge's velocity and acceleration and x_a the part of a vector across the leg. The forces follow
from J^T r = W: J^T dr = dW - dJ^T r.

Arrays are matrices of legs and ticks, (rows, columns, 6, n), of which the latter two may be 1; vectors have one column.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hexload.estimation.rig_model import LEGS, Geometry, LegMotion, rigid_forces
from hexload.theory.bound import tensor_of

Array = NDArray[np.float64]

ONE = np.eye(3)[:, :, None, None]


@dataclass(frozen=True)
class _Legs:
    e: Array
    length: Array
    hinge: Array  # velocity of the upper hinge per twist of the platform
    swing: Array  # acceleration of the upper hinge per twist
    turn: Array  # of e, per change of the pose
    velocity: Array
    along: Array
    across: Array
    acceleration: Array
    flat: Array  # what leaves of a vector the part across the leg
    spin: Array  # w x
    spun: Array  # w x (w x ..) + w' x ..


@dataclass(frozen=True)
class _Rods:
    """The forces that the legs' mass takes, F_l of rig_model.py, and their derivatives."""

    force: Array
    per_e: Array
    per_up: Array
    per_velocity: Array
    per_acceleration: Array


@dataclass(frozen=True)
class _Wrenches:
    """dW - dJ^T r, (6, 6, 1, n) each."""

    per_pose: Array
    per_twist: Array
    per_acceleration: Array


def force_columns(motion: LegMotion, geometry: Geometry, gravity_m_s2: Array, theta: Array, leg_mass: Array) -> Array:
    """Forces per shift of a hinge, N/m, (n, 6, 36): of the base's in its axes, then of the platform's in its own.

    The arguments are those of rig_model.rigid_forces."""
    legs, body = _legs(motion, geometry), _body(motion, theta)
    up = _vectors((-motion.to_platform @ gravity_m_s2)[:, None])
    rods = _rods(legs, up, leg_mass)
    tension = _vectors(rigid_forces(motion, geometry, gravity_m_s2, theta, leg_mass)[:, :, None])
    per_e = rods.per_e - tension * ONE
    tilt = _with_no_shift(_cross(up))
    wrenches = _Wrenches(
        _on_platform(legs, _times(per_e, legs.turn) + _times(rods.per_up, tilt))
        + _times(body.per_acceleration[:, :3], tilt),
        _on_platform(legs, _times(rods.per_velocity, legs.hinge) + _times(rods.per_acceleration, legs.swing))
        + body.per_twist,
        _on_platform(legs, _times(rods.per_acceleration, legs.hinge)) + body.per_acceleration,
    )
    of_base = -_times(per_e, legs.flat) / legs.length
    of_arm = _times(rods.per_velocity, legs.spin) + _times(rods.per_acceleration, legs.spun)
    own = np.stack([_times(_transposed(legs.hinge), part) for part in (of_base, of_arm - of_base)])
    own[1, 3:] -= _cross(rods.force - tension * legs.e)
    return _columns(motion, legs, wrenches, own)


def inertial_columns(motion: LegMotion, geometry: Geometry, theta: Array) -> Array:
    """Of these what the platform's wrong twists and accelerations make with its own inertia, the same shape."""
    return _columns(motion, _legs(motion, geometry), _body(motion, theta), np.zeros((2, 6, 3, LEGS, 1)))


def _columns(motion: LegMotion, legs: _Legs, wrenches: _Wrenches, own: Array) -> Array:
    """`own`: wrenches of each leg's own turn and arm, in platform axes, (2, 6, 3, 6, n).

    For a given motion of the platform, l'' falls by drag . de as a leg turns and rises by sway . du with its hinge's
    velocity."""
    per_leg = np.ascontiguousarray(np.moveaxis(motion.per_leg, 0, 2))[:, :, None]
    drag = 2.0 * legs.along / legs.length * legs.across - legs.acceleration
    sway = 2.0 / legs.length * _transposed(legs.across)
    twist_per_pose = -_times(per_leg, _by_legs(_times(_transposed(legs.velocity), legs.turn)))
    acceleration_per_twist = -_times(
        per_leg, _by_legs(_times(_transposed(legs.e), legs.swing) + _times(sway, legs.hinge))
    )
    acceleration_per_pose = _times(per_leg, _by_legs(_times(_transposed(drag), legs.turn)))
    per_twist = wrenches.per_twist + _times(wrenches.per_acceleration, acceleration_per_twist)
    per_pose = (
        wrenches.per_pose + _times(per_twist, twist_per_pose) + _times(wrenches.per_acceleration, acceleration_per_pose)
    )
    per_error = np.stack([_times(per, per_leg)[:, :, 0] for per in (per_pose, per_twist, wrenches.per_acceleration)])
    wrench = own + np.einsum("kcln,hkdln->hcdln", per_error, _errors(legs, drag, sway))
    force = np.einsum("cfn,hcdln->hfdln", per_leg[:, :, 0], wrench)
    force[0] = np.einsum("fdln,dan->faln", force[0], np.ascontiguousarray(np.moveaxis(motion.to_platform, 0, 2)))
    return np.transpose(force, (4, 1, 0, 3, 2)).reshape(len(motion.twist), LEGS, -1)


def _errors(legs: _Legs, drag: Array, sway: Array) -> Array:
    """rho, beta and gamma per shift of a leg's own hinges in platform axes, (2, 3, 3, 6, n)."""
    of_base = np.concatenate(
        [
            _transposed(legs.e),
            _transposed(legs.across) / legs.length,
            -_times(_transposed(drag), legs.flat) / legs.length,
        ]
    )
    e = _transposed(legs.e)
    of_arm = [np.zeros_like(e), _times(e, legs.spin), _times(sway, legs.spin) + _times(e, legs.spun)]
    return np.stack([of_base, -of_base - np.concatenate(of_arm)])


def _legs(motion: LegMotion, geometry: Geometry) -> _Legs:
    e, length = _vectors(motion.directions), _vectors(motion.lengths_m[:, :, None])
    arm = _vectors(geometry.platform_hinges_m[None])
    twist, acceleration = (np.ascontiguousarray(of.T)[:, None, None] for of in (motion.twist, motion.acceleration))
    spin, to_arm = _cross(twist[3:]), _cross(arm)
    spun = _times(spin, spin)
    hinge = np.concatenate([np.broadcast_to(ONE, to_arm.shape), -to_arm], axis=1)
    velocity = _times(hinge, twist)
    along = np.sum(e * velocity, axis=0, keepdims=True)
    flat = ONE - e * _transposed(e)
    to_lower = _cross(length * e - arm)
    turn = _times(flat, np.concatenate([np.broadcast_to(ONE, to_lower.shape), to_lower], axis=1)) / length
    return _Legs(
        e,
        length,
        hinge,
        _with_no_shift(-_cross(_times(spin, arm)) - _times(spin, to_arm)),
        turn,
        velocity,
        along,
        velocity - along * e,
        _times(hinge, acceleration) + _times(spun, arm),
        flat,
        spin,
        spun + _cross(acceleration[3:]),
    )


def _rods(legs: _Legs, up: Array, leg_mass: Array) -> _Rods:
    inertia, slide, tilting = leg_mass
    e, along, across, pull = legs.e, legs.along, legs.across, legs.acceleration
    nu = inertia / legs.length**2 - slide / legs.length
    slope = -2.0 * inertia / legs.length**3 + slide / legs.length**2
    mu = nu / legs.length + slope / 2.0
    square = np.sum(across**2, axis=0, keepdims=True)

    def turned(vector: Array) -> Array:
        """Change of the part across the leg, per change of e."""
        return -np.sum(e * vector, axis=0, keepdims=True) * ONE - e * _transposed(vector)

    per_e = nu * turned(pull) + tilting / legs.length * turned(up)
    per_e += slope * (across * _transposed(legs.velocity) + along * turned(legs.velocity))
    per_e -= mu * (square * ONE - 2.0 * along * e * _transposed(across))
    return _Rods(
        nu * _times(legs.flat, pull)
        + slope * along * across
        - mu * square * e
        + tilting / legs.length * _times(legs.flat, up),
        per_e,
        tilting / legs.length * legs.flat,
        slope * (along * legs.flat + across * _transposed(e)) - 2.0 * mu * e * _transposed(across),
        nu * legs.flat,
    )


def _body(motion: LegMotion, theta: Array) -> _Wrenches:
    mass, moment, tensor = theta[0], theta[1:4, None, None, None], tensor_of(theta[4:])[:, :, None, None]
    w = np.ascontiguousarray(motion.twist[:, 3:].T)[:, None, None]
    inertia = np.block(
        [[mass * np.eye(3), -_cross(moment)[:, :, 0, 0]], [_cross(moment)[:, :, 0, 0], tensor[:, :, 0, 0]]]
    )
    of_force = -_cross(_times(_cross(w), moment)) - _times(_cross(w), _cross(moment))
    of_moment = _times(_cross(w), tensor) - _cross(_times(tensor, w))
    per_twist = _with_no_shift(np.concatenate([of_force, of_moment]))
    return _Wrenches(np.zeros((6, 6, 1, 1)), per_twist, inertia[:, :, None, None])


def _on_platform(legs: _Legs, forces: Array) -> Array:
    """Wrench of forces at the upper hinges."""
    return np.einsum("jil,jkln->ikn", legs.hinge[..., 0], forces)[:, :, None]


def _vectors(of_legs: Array) -> Array:
    """(n, 6, 3) as (3, 1, 6, n)."""
    return np.ascontiguousarray(np.transpose(of_legs))[:, None]


def _by_legs(rows: Array) -> Array:
    """(1, k, 6, n), a row of each leg, as (6, k, 1, n)."""
    return np.moveaxis(rows[0], 1, 0)[:, :, None]


def _with_no_shift(per_turn: Array) -> Array:
    """(.., 3, ..), of the platform's rotation, as (.., 6, ..), of its motion."""
    return np.concatenate([np.zeros_like(per_turn), per_turn], axis=1)


def _cross(vector: Array) -> Array:
    """(3, 3, ..) of (3, 1, ..): what makes a x b of b."""
    x, y, z = vector[:, 0]
    none = np.zeros_like(x)
    return np.stack([np.stack(row) for row in ((none, -z, y), (z, none, -x), (-y, x, none))])


def _transposed(matrices: Array) -> Array:
    return np.swapaxes(matrices, 0, 1)


def _times(left: Array, right: Array) -> Array:
    return np.einsum("ij...,jk...->ik...", left, right)
