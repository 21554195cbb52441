"""Machines that are not what their platform file says: hinges, masses, gravity, tilt, mass and friction of the legs.

Functions as in sensor_faults. What the file tells wrongly is changed in the file; what it has no word for acts on the
forces.
"""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from hexload.estimation.rig_model import FrictionLaw, Geometry, friction_shapes, gravity_vector, leg_mass_forces
from hexload.faults.recording import TICK_S, Recording, with_leg_forces, with_wrench
from hexload.faults.sensor_faults import sign
from hexload.theory.kinematics import LEGS

Array = NDArray[np.float64]
Random = np.random.Generator

REVERSAL_M_S = 2e-3  # speed at which friction has turned
STRIBECK_M_S = 10e-3
BREAKAWAY = 1.5  # of Coulomb's
PRESLIDING_M = 30e-6
WARM_UP_S = 10.0
LEG_LENGTHS_M = (0.5, 0.55)  # of rod and cylinder
ROD_SHARE = 0.35  # of a leg's mass
HINGE_TURN_RAD_S = 0.01  # at which the friction of hinges has turned


def hinges(recording: Recording, size: float, random: Random) -> Recording:
    """All 36 coordinates of the hinges are off by `size` m, one sigma."""
    return _told(recording, "geometry", _moved_hinges(recording, size * random.normal(size=(2, LEGS, 3))))


def one_hinge(recording: Recording, size: float, random: Random) -> Recording:
    """One hinge of the platform is `size` m off, in some direction."""
    direction = random.normal(size=3)
    moves = np.zeros((2, LEGS, 3))
    moves[1, random.integers(LEGS)] = size * direction / np.linalg.norm(direction)
    return _told(recording, "geometry", _moved_hinges(recording, moves))


def hinge_circle(recording: Recording, size: float, random: Random) -> Recording:
    """The platform's hinges lie on a circle that is larger or smaller by a share `size`."""
    upper = np.array(recording.platform["geometry"]["platform_hinges_m"])
    moves = np.stack([np.zeros_like(upper), size * sign(random) * upper])
    return _told(recording, "geometry", _moved_hinges(recording, moves))


def home_length(recording: Recording, size: float, random: Random) -> Recording:
    """All legs are `size` m longer or shorter at home."""
    lengths_m = _home_lengths_m(recording) + size * sign(random)
    return _told(recording, "geometry", {"home_leg_length_m": lengths_m.tolist()})


def platform_mass(recording: Recording, size: float, random: Random) -> Recording:
    mass = recording.platform["platform"]["mass_kg"] * (1.0 + size * sign(random))
    return _told(recording, "platform", {"mass_kg": mass})


def platform_centre(recording: Recording, size: float, random: Random) -> Recording:
    """Off by `size` m in some direction."""
    direction = random.normal(size=3)
    com = np.array(recording.platform["platform"]["com_m"]) + size * direction / np.linalg.norm(direction)
    return _told(recording, "platform", {"com_m": com.tolist()})


def platform_inertia(recording: Recording, size: float, random: Random) -> Recording:
    """All six entries by the same share `size`."""
    inertia = np.array(recording.platform["platform"]["inertia_kg_m2"]) * (1.0 + size * sign(random))
    return _told(recording, "platform", {"inertia_kg_m2": inertia.tolist()})


def known_mass(recording: Recording, size: float, random: Random) -> Recording:
    """The load's mass that the paper's filter is given is wrong by a share."""
    mass = recording.platform["load"]["known_mass_kg"] * (1.0 + size * sign(random))
    return _told(recording, "load", {"known_mass_kg": mass})


def gravity(recording: Recording, size: float, random: Random) -> Recording:
    """The file's g is off by a share `size`."""
    value = recording.platform["environment"]["gravity_m_s2"] * (1.0 + size * sign(random))
    return _told(recording, "environment", {"gravity_m_s2": value})


def tilt(recording: Recording, size: float, random: Random) -> Recording:
    """The base is `size` rad off level, about some horizontal axis."""
    turn = random.uniform(0.0, 2.0 * np.pi)
    g = -recording.gravity_m_s2[2]
    tilted = gravity_vector(g, size * np.array([np.cos(turn), np.sin(turn)]))
    return with_wrench(recording, weight_wrench(recording, tilted - recording.gravity_m_s2))


def weight_wrench(recording: Recording, gravity_m_s2: Array) -> Array:
    """(n, 6), platform axes: what more gravity, (3,) or (n, 3) in base axes, does to platform and load."""
    theta = recording.total_theta()
    vectors = np.broadcast_to(gravity_m_s2, (len(theta), 3))
    g = np.einsum("nij,nj->ni", recording.motion.to_platform, vectors)
    return np.hstack([theta[:, :1] * g, np.cross(theta[:, 1:4], g)])


def leg_mass(recording: Recording, size: float, _: Random) -> Recording:
    """Legs of `size` kg each: rods that slide in cylinders, both uniform bars; see rig_model."""
    rod_kg, cylinder_kg = size * ROD_SHARE, size * (1.0 - ROD_SHARE)
    rod_m, cylinder_m = LEG_LENGTHS_M
    numbers = [
        (rod_kg * rod_m**2 + cylinder_kg * cylinder_m**2) / 3.0,
        rod_kg * rod_m,
        (cylinder_kg * cylinder_m - rod_kg * rod_m) / 2.0,
    ]
    turning = leg_mass_forces(recording.motion, _geometry(recording), recording.gravity_m_s2) @ np.array(numbers)
    return _with_point_masses(with_leg_forces(recording, turning), rod_kg)


def _with_point_masses(recording: Recording, mass_kg: float) -> Recording:
    """At the platform's hinges."""
    motion, w = recording.motion, recording.motion.twist[:, 3:]
    s = motion.acceleration[:, :3] - motion.to_platform @ recording.gravity_m_s2
    wrench = np.zeros((len(s), 6))
    for hinge in _geometry(recording).platform_hinges_m:
        at = np.broadcast_to(hinge, s.shape)
        force = -mass_kg * (s + np.cross(motion.acceleration[:, 3:], at) + np.cross(w, np.cross(w, at)))
        wrench += np.hstack([force, np.cross(at, force)])
    return with_wrench(recording, wrench)


def elastic_legs(recording: Recording, size: float, _: Random) -> Recording:
    """Between its sensors and its hinges each leg is a spring of `size` N/m, which its force presses together."""
    pressed_m = recording.clean.force_n / size
    log = recording.log
    displacement_m = log.displacement_m + pressed_m
    velocity_m_s = log.velocity_m_s + np.gradient(pressed_m, TICK_S, axis=0)
    return replace(recording, log=replace(log, displacement_m=displacement_m, velocity_m_s=velocity_m_s))


def coulomb(recording: Recording, size: float, random: Random) -> Recording:
    """Dry friction of `size` N, by 20 % another one on each leg."""
    return with_leg_forces(recording, _each(size, random) * np.tanh(recording.clean.velocity_m_s / REVERSAL_M_S))


def viscous(recording: Recording, size: float, random: Random) -> Recording:
    """`size` N s/m."""
    return with_leg_forces(recording, _each(size, random) * recording.clean.velocity_m_s)


def stribeck(recording: Recording, size: float, random: Random) -> Recording:
    """Dry friction of `size` N that is half as large again near zero speed."""
    shapes = friction_shapes(recording.clean.velocity_m_s, FrictionLaw(STRIBECK_M_S, REVERSAL_M_S, 0.0), TICK_S)
    level = _each(size, random)
    return with_leg_forces(recording, level * (shapes[..., 0] + (BREAKAWAY - 1.0) * shapes[..., 1]))


def lugre(recording: Recording, size: float, random: Random) -> Recording:
    """Stribeck's curve of `size` N by bristles: with the deflection z in units of the level g(v),
    dz/dt = |v| / (x0 g(v)) (sign v - z), x0 the presliding length at Coulomb's level.

    C. Canudas de Wit et al., IEEE Trans. Automatic Control 40(3), 1995.
    """
    speed = recording.clean.velocity_m_s
    level = 1.0 + (BREAKAWAY - 1.0) * np.exp(-((speed / STRIBECK_M_S) ** 2))
    kept = np.exp(-np.abs(speed) * TICK_S / (PRESLIDING_M * level))
    bristle = np.empty_like(speed)
    now = np.zeros(LEGS)  # N per N of Coulomb's
    for k in range(len(speed)):
        target = level[k] * np.sign(speed[k])
        now = target + kept[k] * (now - target)
        bristle[k] = now
    return with_leg_forces(recording, _each(size, random) * bristle)


def growing_with_force(recording: Recording, size: float, random: Random) -> Recording:
    """Dry friction of `size` N per N of the leg's force."""
    force = _each(size, random) * np.abs(recording.clean.force_n)
    return with_leg_forces(recording, force * np.tanh(recording.clean.velocity_m_s / REVERSAL_M_S))


def warming_up(recording: Recording, size: float, random: Random) -> Recording:
    """Dry friction of `size` N that falls by half as the oil gets warm."""
    level = _each(size, random) * (0.5 + 0.5 * np.exp(-recording.t_s / WARM_UP_S))[:, None]
    return with_leg_forces(recording, level * np.tanh(recording.clean.velocity_m_s / REVERSAL_M_S))


def hinge_friction(recording: Recording, size: float, _: Random) -> Recording:
    """Each joint of a leg resists turning with `size` N m, dry.

    Torque T_b at the base on the leg, against the leg's turning w_l, and T_p at the platform, against w_l - w. The leg
    has no mass: with its force F on the platform, L e x (-F) + T_b + T_p = 0 across the leg, so F_across = e x -(T_b +
    T_p) / L. On the platform act F at the hinge and the torque -T_p. What turns the leg about its own axis is left out.
    """
    motion = recording.motion
    hinge, w = _geometry(recording).platform_hinges_m, motion.twist[:, None, 3:]
    e, length = motion.directions, motion.lengths_m[:, :, None]
    leg_turn = np.cross(e, motion.twist[:, None, :3] + np.cross(w, hinge)) / length
    w_across = w - e * np.sum(e * w, axis=2, keepdims=True)
    base_torque = -size * _direction(leg_turn)
    platform_torque = -size * _direction(leg_turn - w_across)
    force = -np.cross(e, base_torque + platform_torque) / length
    moment = np.cross(hinge, force) - platform_torque
    return with_wrench(recording, np.hstack([force.sum(axis=1), moment.sum(axis=1)]))


def _direction(turn_rad_s: Array) -> Array:
    size = np.linalg.norm(turn_rad_s, axis=2, keepdims=True)
    return turn_rad_s / np.maximum(size, 1e-12) * np.tanh(size / HINGE_TURN_RAD_S)


def _each(size: float, random: Random) -> Array:
    return size * random.uniform(0.8, 1.2, LEGS)


def _moved_hinges(recording: Recording, moves_m: Array) -> dict[str, list]:
    names = ("base_hinges_m", "platform_hinges_m")
    table = recording.platform["geometry"]
    return {name: (np.array(table[name]) + move).tolist() for name, move in zip(names, moves_m)}


def _told(recording: Recording, table: str, entries: dict) -> Recording:
    return replace(recording, platform=recording.platform | {table: recording.platform[table] | entries})


def _geometry(recording: Recording) -> Geometry:
    table = recording.platform["geometry"]
    hinges_m = (np.array(table[name]) for name in ("base_hinges_m", "platform_hinges_m"))
    return Geometry(*hinges_m, _home_lengths_m(recording))


def _home_lengths_m(recording: Recording) -> Array:
    """(6,) of the file, which has one for all legs or one for each."""
    return np.broadcast_to(np.asarray(recording.platform["geometry"]["home_leg_length_m"], float), LEGS)
