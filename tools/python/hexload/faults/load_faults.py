"""Loads that are not one rigid body, and what else pushes: pendulum, sloshing, soft mount, shaking base, contact, leaks.

Functions as in sensor_faults. Each has a small model of its own, whose reaction takes the place of that of the rigid part
which it was: a point of mass m at r (platform axes), held by F = -m (a(r) - g). So the true parameters, with the part at
its rest, stay as they are, unless the load itself changes.
"""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.signal import bilinear, lfilter, lfilter_zi

from hexload.estimation.rig_model import LegMotion, body_forces
from hexload.faults.machine_faults import weight_wrench
from hexload.faults.recording import (
    TICK_S,
    LoadStep,
    Recording,
    point_acceleration,
    with_leg_forces,
    with_wrench,
    wrench_at,
)
from hexload.faults.sensor_faults import event_rows

Array = NDArray[np.float64]
Random = np.random.Generator

PENDULUM_M = 0.3
PENDULUM_DAMPING = 0.02  # of critical
SLOSH_HZ, SLOSH_DAMPING = 0.8, 0.01
MOUNT_DAMPING = 0.05
SHAKING_HZ = (1.0, 8.0)
BESIDE_M = 0.3  # where hoses and contacts are
GUST_S = 1.0  # correlation of wind
SAIL_M = 0.3  # height of what it blows at
LEAKED = 0.5  # of the load at most


def pendulum(recording: Recording, size: float, _: Random) -> Recording:
    """A share `size` of the load's mass hangs on a rod of PENDULUM_M, at rest in the load's centre of mass.

    u: from the pivot to the mass, of length 1, base axes; |u'| = w, pivot's acceleration a:
    u'' = -w^2 u + (E - u u^T) ((g - a) / l) - 2 zeta sqrt(g / l) u'        F = m (g - a - l u'')
    """
    mass, centre = _moving_part(recording, size)
    pivot = centre + [0.0, 0.0, PENDULUM_M]
    reaction = mass * (_specific(recording, pivot) - _turned_back(recording, _swing(recording, pivot)))
    return with_wrench(recording, wrench_at(reaction, pivot) - _rigid_wrench(recording, mass, centre))


def _swing(recording: Recording, pivot_m: Array) -> Array:
    """l u'', (n, 3), base axes: leap-frog from rest, u' at u's tick by half a step ahead."""
    drive = _to_base(recording.motion, _specific(recording, pivot_m)) / PENDULUM_M
    damping = 2.0 * PENDULUM_DAMPING * np.sqrt(-recording.gravity_m_s2[2] / PENDULUM_M)
    u, v = (0.0, 0.0, -1.0), (0.0, 0.0, 0.0)
    rate = np.empty_like(drive)
    for k, push in enumerate(drive.tolist()):
        ahead = _swing_rate(u, v, push, damping)
        now = [speed + 0.5 * TICK_S * more for speed, more in zip(v, ahead)]
        rate[k] = r = _swing_rate(u, now, push, damping)
        v = [speed + TICK_S * more for speed, more in zip(v, r)]
        u = [place + TICK_S * speed for place, speed in zip(u, v)]
        length = math.hypot(*u)
        u = [place / length for place in u]
    return PENDULUM_M * rate


def _swing_rate(u: Sequence[float], v: Sequence[float], drive: Sequence[float], damping: float) -> list[float]:
    along = sum(place * push for place, push in zip(u, drive)) + sum(speed * speed for speed in v)
    return [push - along * place - damping * speed for place, speed, push in zip(u, v, drive)]


def sloshing(recording: Recording, size: float, _: Random) -> Recording:
    """A share `size` of the load's mass is liquid that sloshes across the tank's axis: a mass on springs of SLOSH_HZ.

    x'' + 2 zeta w0 x' + w0^2 x = -s across, s = a - g in platform axes; on the tank F = -m (s + x'') at r + x. Of the
    turning tank's Coriolis terms, of the order w x', nothing (H. N. Abramson, NASA SP-106, 1966, chapter 6).
    """
    mass, centre = _moving_part(recording, size)
    specific = _specific(recording, centre)
    drive = specific * [1.0, 1.0, 0.0]
    moved, rate = oscillation(drive, SLOSH_HZ, SLOSH_DAMPING)
    wrench = wrench_at(mass * (specific - rate), centre + moved)
    return with_wrench(recording, wrench - _rigid_wrench(recording, mass, centre))


def soft_mount(recording: Recording, size: float, _: Random) -> Recording:
    """The load stands on rubber: its mass moves on springs alike in all directions, of `size` Hz; its inertia stays.

    With d from the mount to the mass in base axes, less its rest, d'' + 2 zeta w0 d' + w0^2 d = -a: what the springs
    do to the platform is that of a rigid load, and -m d'' at the mount.
    """
    mass, centre = _moving_part(recording, 1.0)
    acceleration = _to_base(recording.motion, point_acceleration(recording.motion, centre))
    _, rate = oscillation(-acceleration, size, MOUNT_DAMPING)
    return with_wrench(recording, wrench_at(-mass * _turned_back(recording, rate), centre))


def oscillation(drive_m_s2: Array, hz: float, damping: float) -> tuple[Array, Array]:
    """x and x'' of x'' + 2 zeta w0 x' + w0^2 x = drive, (n, 3), from rest under the first drive."""
    w0 = 2.0 * np.pi * hz
    under = [1.0, 2.0 * damping * w0, w0**2]
    answers = []
    for over in ([1.0], [1.0, 0.0, 0.0]):
        b, a = bilinear(over, under, fs=1.0 / TICK_S)
        start = lfilter_zi(b, a)[:, None] * drive_m_s2[0]
        answers.append(lfilter(b, a, drive_m_s2, axis=0, zi=start)[0])
    return answers[0], answers[1]


def shaking_base(recording: Recording, size: float, random: Random) -> Recording:
    """The floor shakes with `size` m/s^2 in a horizontal direction, at some frequency: as gravity that turns."""
    turn, phase = random.uniform(0.0, 2.0 * np.pi, 2)
    wave = size * np.sin(2.0 * np.pi * random.uniform(*SHAKING_HZ) * recording.t_s + phase)
    direction = np.array([np.cos(turn), np.sin(turn), 0.0])
    return with_wrench(recording, weight_wrench(recording, -wave[:, None] * direction))


def external_force(recording: Recording, size: float, random: Random) -> Recording:
    """`size` N all the time, beside the platform's centre, in a direction that the base holds."""
    return with_wrench(recording, _outside_wrench(recording, np.full(len(recording.t_s), size), random))


def contact(recording: Recording, size: float, random: Random) -> Recording:
    """The same for half a second only."""
    force = np.zeros(len(recording.t_s))
    force[event_rows(recording, 0.5, random)] = size
    return with_wrench(recording, _outside_wrench(recording, force, random))


def end_stop(recording: Recording, size: float, random: Random) -> Recording:
    """Something in the way: in the outer fifth of the way along some direction it pushes back, `size` N at its end."""
    turn = random.uniform(0.0, 2.0 * np.pi)
    way = recording.position_m @ np.array([np.cos(turn), np.sin(turn), 0.0])
    start = way.min() + 0.8 * (way.max() - way.min())
    depth = np.maximum(way - start, 0.0) / max(way.max() - start, 1e-9)
    push = -size * depth[:, None] * np.array([np.cos(turn), np.sin(turn), 0.0])
    return with_wrench(recording, wrench_at(_turned_back(recording, push), np.zeros(3)))


def wind(recording: Recording, size: float, random: Random) -> Recording:
    """Gusts of `size` N (one sigma of each component) at a place above the platform."""
    kept = 1.0 - TICK_S / GUST_S
    pushes = random.normal(size=(len(recording.t_s), 3))
    force = size * lfilter([np.sqrt(1.0 - kept**2)], [1.0, -kept], pushes, axis=0)
    return with_wrench(recording, wrench_at(_turned_back(recording, force), np.array([0.0, 0.0, SAIL_M])))


def rotor(recording: Recording, size: float, _: Random) -> Recording:
    """Something in the load spins about z with an angular momentum H of `size` N m s: -w x H on the platform."""
    turn = recording.motion.twist[:, 3:]
    moment = -np.cross(turn, [0.0, 0.0, size])
    return with_wrench(recording, np.hstack([np.zeros_like(moment), moment]))


def hoses(recording: Recording, size: float, _: Random) -> Recording:
    """A bundle of hoses pulls O_A back to home with `size` N/m."""
    return with_wrench(recording, wrench_at(_turned_back(recording, -size * recording.position_m), np.zeros(3)))


def leaking(recording: Recording, size: float, _: Random) -> Recording:
    """The load's filling runs out evenly from a third of the run on, `size` kg/s, LEAKED of it at most."""
    t_s, theta = recording.t_s, recording.theta
    start_s = max(recording.loads[-1].at_s + 1.0, t_s[-1] / 3.0)
    gone = np.clip(size / theta[0] * (t_s - start_s), 0.0, LEAKED)
    left = (1.0 - gone[-1]) * theta
    forces = body_forces(recording.motion, recording.gravity_m_s2) @ theta
    changed = with_leg_forces(recording, -gone[:, None] * forces)
    loads = (*recording.loads, LoadStep(float(t_s[-1]), left))
    return replace(changed, loads=loads, changes_s=(*recording.changes_s, (start_s, float(t_s[-1]))))


def sliding(recording: Recording, size: float, _: Random) -> Recording:
    """From a third of the run on the whole load slides by `size` m along the platform's x axis, evenly and slowly."""
    t_s, theta = recording.t_s, recording.theta
    start_s = max(recording.loads[-1].at_s + 1.0, t_s[-1] / 3.0)
    way_m = size * np.clip((t_s - start_s) / (t_s[-1] - start_s), 0.0, 1.0)
    forces = body_forces(recording.motion, recording.gravity_m_s2)
    per_m, per_m2 = (_moved(theta, at) for at in (1.0, -1.0))  # linear and square in the way
    linear, square = 0.5 * (per_m - per_m2), 0.5 * (per_m + per_m2) - theta
    changed = with_leg_forces(recording, way_m[:, None] * (forces @ linear) + (way_m**2)[:, None] * (forces @ square))
    loads = (*recording.loads, LoadStep(float(t_s[-1]), _moved(theta, size)))
    return replace(changed, loads=loads, changes_s=(*recording.changes_s, (start_s, float(t_s[-1]))))


def _moved(theta: Array, way_m: float) -> Array:
    """The ten parameters of a load that stands `way_m` further along x."""
    mass, (hx, hy, hz) = theta[0], theta[1:4]
    added = 2.0 * hx * way_m + mass * way_m**2  # of x^2 dm
    products = np.array([-hy * way_m, -hz * way_m])  # Ixy, Ixz
    moved = theta.copy()
    moved[1] += mass * way_m
    moved[5:7] += added
    moved[7:9] += products
    return moved


def falling(recording: Recording, size: float, random: Random) -> Recording:
    """A share `size` of the load, cut evenly, falls off in mid-run."""
    return _stepped(recording, [(_moment_s(recording, random), -size * recording.theta)])


def two_changes(recording: Recording, size: float, random: Random) -> Recording:
    """A fifth of the load falls off; `size` s later a twentieth of it comes back, elsewhere."""
    at_s = _moment_s(recording, random)
    mass = recording.theta[0] / 20.0
    x, y, z = random.uniform([-0.2, -0.2, 0.1], [0.2, 0.2, 0.3])
    inertia = [y * y + z * z, x * x + z * z, x * x + y * y, -x * y, -x * z, -y * z]
    back = mass * np.array([1.0, x, y, z, *inertia])
    return _stepped(recording, [(at_s, -0.2 * recording.theta), (at_s + size, back)])


def _moment_s(recording: Recording, random: Random) -> float:
    """In the middle of the run, and a second after the load is there."""
    at_s = recording.t_s[event_rows(recording, 0.0, random).start]
    return float(max(at_s, recording.loads[-1].at_s + 1.0))


def _stepped(recording: Recording, steps: list[tuple[float, Array]]) -> Recording:
    forces = body_forces(recording.motion, recording.gravity_m_s2)
    for at_s, theta in steps:
        added = (forces @ theta) * (recording.t_s >= at_s)[:, None]
        load = LoadStep(float(at_s), recording.theta + theta)
        recording = replace(
            with_leg_forces(recording, added),
            loads=(*recording.loads, load),
            changes_s=(*recording.changes_s, (load.at_s, load.at_s)),
        )
    return recording


def _moving_part(recording: Recording, share: float) -> tuple[Array, Array]:
    """Its mass at each tick, (n, 1), and its place: the last load's centre of mass."""
    theta = recording.theta
    is_there = recording.t_s >= recording.loads[-1].at_s - 1e-9
    return share * theta[0] * is_there[:, None], theta[1:4] / theta[0]


def _rigid_wrench(recording: Recording, mass_kg: Array, point_m: Array) -> Array:
    return wrench_at(mass_kg * _specific(recording, point_m), point_m)


def _specific(recording: Recording, point_m: Array) -> Array:
    """g - a of a point, (n, 3), platform axes."""
    return recording.motion.to_platform @ recording.gravity_m_s2 - point_acceleration(recording.motion, point_m)


def _outside_wrench(recording: Recording, size_n: Array, random: Random) -> Array:
    direction = random.normal(size=3)
    turn = random.uniform(0.0, 2.0 * np.pi)
    place = BESIDE_M * np.array([np.cos(turn), np.sin(turn), 0.0])
    force = size_n[:, None] * direction / np.linalg.norm(direction)
    return wrench_at(_turned_back(recording, force), place)


def _to_base(motion: LegMotion, vectors: Array) -> Array:
    return np.einsum("nji,nj->ni", motion.to_platform, vectors)


def _turned_back(recording: Recording, vectors: Array) -> Array:
    """From base to platform axes."""
    return np.einsum("nij,nj->ni", recording.motion.to_platform, vectors)
