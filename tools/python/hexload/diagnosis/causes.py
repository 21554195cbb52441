"""What faults of the machine, its sensors and its load do to the leg forces, per unit: the columns of the bank."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hexload.diagnosis.cause import Cause, Channel, Defect
from hexload.diagnosis.dynamics import EDGE_S, LOW_PASS_HZ, Dynamics
from hexload.diagnosis.spectral import low_pass
from hexload.estimation import rig_model
from hexload.estimation.rig_model import Geometry, LegMotion
from hexload.theory.kinematics import LEGS

Array = NDArray[np.float64]

SPEED_HZ = 25.0  # of the speeds of dry friction
REVERSALS_M_S = (5e-4, 2e-3, 6e-3)  # at which it has turned
STRIBECK_M_S = 0.01
PRESLIDING_M = 5e-5
TILT_STEP_RAD = 1e-4
STEP_M = 1e-4  # of hinges and lengths
ELASTIC_M_N = 1e-8
HINGE_TURN_RAD_S = 0.01
SOFT_HZ, SOFT_DAMPING = np.arange(0.4, 2.0, 0.05), 0.015
STIFF_HZ, STIFF_DAMPING = np.geomspace(2.0, 12.0, 18), 0.05
LINES = 4  # of the residual's spectrum that are tried
LINE_HZ = (0.5, 8.0)
JUMP_GRID_S = 0.5
PUSH_S = 0.5
STEP_S = 0.25  # between moments at which a sensor's zero or gain may jump
HYSTERESIS_N = (10.0, 40.0)  # of a force's change, after which its sensor's hysteresis has turned round
STOP_DIRECTIONS = 12
STOP_SHARE = 0.8  # of the way, where something may be in it
LEAK_STARTS = 6


@dataclass(frozen=True)
class Family:
    """One possible cause with `k` unknown sizes."""

    cause: Cause
    columns: Array  # (n, 6, k), N per unit
    legs: tuple[int, ...] = ()  # of each column, where it is a leg's own
    detail: float = float("nan")  # frequency in Hz, or moment in s
    end: float = float("nan")


def quick(d: Dynamics, theta: Array) -> Iterator[Family]:
    """Those that need neither another pose nor a scan. `theta`: platform and load as fitted, (n, 10)."""
    yield from _frictions(d, theta)
    n = len(d.smooth.t_s)
    unit = np.broadcast_to(np.eye(LEGS), (n, LEGS, LEGS))
    yield from _of_legs(Cause(Defect.ZERO, Channel.FORCE), unit)
    yield from _of_legs(Cause(Defect.DRIFT, Channel.FORCE), unit * _ramp(d)[:, None, None])
    yield from _of_legs(Cause(Defect.LATE, Channel.FORCE), -unit * d.smooth.force_rate[:, :, None])
    rigid = of_load(d.of_body, theta)
    yield from _gains(unit * rigid[:, :, None])
    yield from _of_legs(Cause(Defect.CURVE, Channel.FORCE), unit * (rigid**2 / np.abs(rigid).max())[:, :, None])
    g = d.machine.gravity_m_s2
    strength = np.linalg.norm(g)
    tilts = [
        of_load(rig_model.body_forces(d.motion, g + strength * TILT_STEP_RAD * np.eye(3)[k]), theta) for k in range(3)
    ]
    slopes = np.stack([(tilted - rigid) / TILT_STEP_RAD for tilted in tilts], axis=2)
    yield Family(Cause(Defect.TILT), slopes[:, :, :2])
    yield Family(Cause(Defect.TILT), slopes)  # a larger one: weight along the axis is less
    yield Family(Cause(Defect.GRAVITY), -slopes[:, :, 2:])
    yield Family(
        Cause(Defect.CROSSTALK, Channel.FORCE), np.stack([np.roll(rigid, way, axis=1) for way in (-1, 1)], axis=2)
    )
    for span_n in HYSTERESIS_N:
        law = rig_model.FrictionLaw(1.0, 1e-3 * span_n, span_n)
        behind = -rig_model.slides(np.gradient(rigid, d.smooth.dt_s, axis=0), law, d.smooth.dt_s)
        yield from _of_legs(Cause(Defect.HYSTERESIS, Channel.FORCE), unit * behind[:, :, None])
    turning = np.cross(d.motion.twist[:, None, 3:], np.eye(3)).swapaxes(1, 2)  # w x e, (n, 3, 3)
    yield Family(
        Cause(Defect.SPINNING_PART), _leg_forces(d.motion, np.concatenate([np.zeros_like(turning), turning], axis=1))
    )
    yield Family(Cause(Defect.LEG_MASS), rig_model.leg_mass_forces(d.motion, d.machine.geometry, g))
    position = _positions(d)
    yield Family(Cause(Defect.HOSES), _base_force(d, -position[:, :, None] * np.eye(3)))
    yield Family(Cause(Defect.EXTERNAL_FORCE), _external(d))
    yield from _leaks(d, theta)


def slow(d: Dynamics, theta: Array, residual_n: Array) -> Iterator[Family]:
    """The others. `residual_n`: (n, 6), whose spectrum is searched for lines."""
    yield from _geometries(d, theta)
    yield from _oscillators(d, theta)
    yield from _lines(d, theta, residual_n)
    yield from _stops(d)
    yield from _pushes(d)
    yield from _steps(d, theta)


def jumps(d: Dynamics, at_s: Array) -> Iterator[Family]:
    """Another load from some moment on."""
    for moment in at_s:
        since = (d.smooth.t_s >= moment).astype(float)
        if 0.02 < since.mean() < 0.98:
            yield Family(Cause(Defect.LOAD_CHANGE), d.of_body * since[:, None, None], detail=float(moment))


def of_load(forces: Array, theta: Array) -> Array:
    """(n, 6) of (n, 6, 10) and (n, 10)."""
    return np.einsum("nlj,nj->nl", forces, theta)


def _of_legs(cause: Cause, columns: Array) -> Iterator[Family]:
    """All legs alike, each by itself, each its own."""
    yield Family(cause, columns.sum(axis=2, keepdims=True))
    for leg in range(LEGS):
        yield Family(cause, columns[:, :, leg : leg + 1], (leg,))
    yield Family(cause, columns, tuple(range(LEGS)))


def _gains(columns: Array) -> Iterator[Family]:
    """A gain that all have in common is a load of another size."""
    yield from list(_of_legs(Cause(Defect.GAIN, Channel.FORCE), columns))[1:]


def _ramp(d: Dynamics) -> Array:
    return d.smooth.t_s - d.smooth.t_s[0]


def _frictions(d: Dynamics, theta: Array) -> Iterator[Family]:
    n = len(d.smooth.t_s)
    unit = np.broadcast_to(np.eye(LEGS), (n, LEGS, LEGS))
    yield from _of_legs(Cause(Defect.VISCOUS_FRICTION), unit * d.smooth.speed[:, :, None])
    record = d.record
    _, speed = low_pass(record.displacement_m, record.dt_s, min(SPEED_HZ, 0.3 / record.dt_s), 1)
    laws = [(v0, 0.0) for v0 in REVERSALS_M_S] + [(REVERSALS_M_S[0], PRESLIDING_M)]
    weight = np.abs(of_load(d.of_body, theta))
    ramp = _ramp(d)[:, None, None]
    for v0, presliding in laws:
        law = rig_model.FrictionLaw(STRIBECK_M_S, v0, presliding)
        shapes = _rows(d, rig_model.friction_shapes(speed, law, record.dt_s)[:, :, :2])
        dry, breakaway = (unit * shapes[:, :, k, None] for k in range(2))
        yield from _of_legs(Cause(Defect.DRY_FRICTION), dry)
        yield Family(Cause(Defect.DRY_FRICTION), np.concatenate([dry, breakaway], axis=2), 2 * tuple(range(LEGS)))
        yield Family(Cause(Defect.DRY_FRICTION), np.concatenate([dry, dry * ramp], axis=2), 2 * tuple(range(LEGS)))
        yield Family(Cause(Defect.GROWING_FRICTION), dry * weight[:, :, None], tuple(range(LEGS)))
    yield Family(Cause(Defect.HINGE_FRICTION), _hinge_friction(d))


def _rows(d: Dynamics, values: Array) -> Array:
    """Of the record's rows, as Smooth has them."""
    (part,) = low_pass(values, d.record.dt_s, min(LOW_PASS_HZ, 0.3 / d.record.dt_s), 0, d.smooth.step)
    edge = max(1, round(EDGE_S / d.smooth.dt_s))
    return part[edge : edge + len(d.smooth.t_s)]


def _hinge_friction(d: Dynamics) -> Array:
    """1 N m in each joint against its turning; the leg's forces follow from the balance of its moments."""
    motion, hinge = d.motion, d.machine.geometry.platform_hinges_m
    e, length, w = motion.directions, motion.lengths_m[:, :, None], motion.twist[:, None, 3:]
    leg_turn = np.cross(e, motion.twist[:, None, :3] + np.cross(w, hinge)) / length
    across = w - e * np.sum(e * w, axis=2, keepdims=True)
    base, platform = -_direction(leg_turn), -_direction(leg_turn - across)
    force = -np.cross(e, base + platform) / length
    moment = np.cross(hinge, force) - platform
    return -_leg_forces(motion, np.concatenate([force.sum(axis=1), moment.sum(axis=1)], axis=1)[:, :, None])


def _direction(turn: Array) -> Array:
    size = np.linalg.norm(turn, axis=2, keepdims=True)
    return turn / np.maximum(size, 1e-12) * np.tanh(size / HINGE_TURN_RAD_S)


def _leg_forces(motion: LegMotion, wrench: Array) -> Array:
    """That make a wrench [F, moment about O_A], platform axes, (n, 6, k)."""
    return np.linalg.solve(np.swapaxes(motion.jacobian, 1, 2), wrench)


def _positions(d: Dynamics) -> Array:
    """Of O_A from the middle of its way, base axes, (n, 3)."""
    return d.motion.place_m - d.motion.place_m.mean(axis=0)


def _base_force(d: Dynamics, force: Array) -> Array:
    """Leg forces against a force at O_A, base axes, (n, 3, k)."""
    turned = d.motion.to_platform @ force
    return -_leg_forces(d.motion, np.concatenate([turned, np.zeros_like(turned)], axis=1))


def _external(d: Dynamics) -> Array:
    """A force that the base holds, at O_A and at unit arms of the platform: 3 + 9."""
    unit = d.motion.to_platform
    wrenches = [np.concatenate([unit, np.zeros_like(unit)], axis=1)]
    for k in range(3):
        arm = np.eye(3)[k]
        wrenches.append(np.concatenate([np.zeros_like(unit), np.cross(arm, unit, axisb=1, axisc=1)], axis=1))
    return -_leg_forces(d.motion, np.concatenate(wrenches, axis=2))


def _leaks(d: Dynamics, theta: Array) -> Iterator[Family]:
    """The load, cut evenly, per second."""
    forces = of_load(d.of_body, theta - d.machine.own_theta)
    ramp = _ramp(d)
    for start in np.linspace(0.0, 0.75, LEAK_STARTS) * ramp[-1]:
        column = forces * np.maximum(ramp - start, 0.0)[:, None]
        yield Family(Cause(Defect.LOAD_RAMP), column[:, :, None], detail=float(d.smooth.t_s[0] + start))


def _geometries(d: Dynamics, theta: Array) -> Iterator[Family]:
    """By differences of the rigid forces: zeros, gains, drifts, delays of displacements; lengths; hinges."""
    geometry, smooth = d.machine.geometry, d.smooth
    here = of_load(d.of_body, theta)
    zero, ramp = np.zeros_like(smooth.speed), _ramp(d)[:, None] + np.zeros_like(smooth.speed)
    moves = {
        Cause(Defect.ZERO, Channel.DISPLACEMENT): (zero + 1.0, zero, zero),
        Cause(Defect.GAIN, Channel.DISPLACEMENT): (smooth.displacement, smooth.speed, smooth.acceleration),
        Cause(Defect.DRIFT, Channel.DISPLACEMENT): (ramp, zero + 1.0, zero),
        Cause(Defect.LATE, Channel.DISPLACEMENT): (-smooth.speed, -smooth.acceleration, -smooth.jerk),
    }
    for cause, parts in moves.items():
        columns = []
        for leg in range(LEGS):
            size = STEP_M / max(float(np.abs(parts[0][:, leg]).max()), 1e-9)
            only = size * np.eye(LEGS)[leg]
            # the sensor shows more than there is, so the truth is where it is taken off
            columns.append((_forces(d, geometry, theta, [-only * part for part in parts]) - here) / size)
        yield from _of_legs(cause, np.stack(columns, axis=2))
    yield Family(Cause(Defect.ELASTIC_LEGS), _of_elastic_legs(d, theta, here)[:, :, None])
    yield from _hinge_families(d, theta, here)


def _of_elastic_legs(d: Dynamics, theta: Array, here: Array) -> Array:
    """Forces per 1e-8 m/N, less than that at the sensors: legs that push are shorter than their displacements say."""
    rate = np.gradient(here, d.smooth.dt_s, axis=0)
    parts = (here, rate, np.gradient(rate, d.smooth.dt_s, axis=0))
    return _forces(d, d.machine.geometry, theta, [-ELASTIC_M_N * part for part in parts]) - here


def _hinge_families(d: Dynamics, theta: Array, here: Array) -> Iterator[Family]:
    geometry = d.machine.geometry
    none = [np.zeros_like(d.smooth.speed)] * 3
    columns = np.empty((*here.shape, 2, LEGS, 3))
    for side, name in enumerate(("base_hinges_m", "platform_hinges_m")):
        for leg in range(LEGS):
            for axis in range(3):
                moved = getattr(geometry, name).copy()
                moved[leg, axis] += STEP_M
                forces = _forces(d, replace(geometry, **{name: moved}), theta, none)
                columns[:, :, side, leg, axis] = (forces - here) / STEP_M
    for side in range(2):
        for leg in range(LEGS):
            yield Family(Cause(Defect.ONE_HINGE), columns[:, :, side, leg], (leg,), detail=float(side))
    for side, hinges in enumerate((geometry.base_hinges_m, geometry.platform_hinges_m)):
        circle = np.tensordot(columns[:, :, side], hinges * [1.0, 1.0, 0.0], 2)
        yield Family(Cause(Defect.HINGE_CIRCLE), circle[:, :, None], detail=float(side))
    yield Family(Cause(Defect.HINGES), columns.reshape(*here.shape, -1))


def _forces(d: Dynamics, geometry: Geometry, theta: Array, moves: list[Array]) -> Array:
    smooth = d.smooth
    parts = (smooth.displacement, smooth.speed, smooth.acceleration)
    there = (part + move for part, move in zip(parts, moves, strict=True))
    motion = rig_model.motion_of_legs(geometry, *there, near=d.motion)
    return of_load(rig_model.body_forces(motion, d.machine.gravity_m_s2), theta)


def _oscillators(d: Dynamics, theta: Array) -> Iterator[Family]:
    for hz in SOFT_HZ:
        yield oscillator(d, theta, float(hz), SOFT_DAMPING)
    for hz in STIFF_HZ:
        yield oscillator(d, theta, float(hz), STIFF_DAMPING)


def oscillator(d: Dynamics, theta: Array, hz: float, damping: float) -> Family:
    """A mass x on springs at the load's centre, per kg of it: F = -m x'' and the moment of its weight at x.

    x'' + 2 zeta w0 x' + w0^2 x = u, u by the centre's acceleration and by gravity in platform axes, each for itself as
    springs may or may not be bent by weight; and what still swings when the record starts.
    """
    centre = _centre(d, theta)
    motion = d.motion
    w, alpha = motion.twist[:, 3:], motion.acceleration[:, 3:]
    at = np.broadcast_to(centre, w.shape)
    acceleration = motion.acceleration[:, :3] + np.cross(alpha, at) + np.cross(w, np.cross(w, at))
    gravity = motion.to_platform @ d.machine.gravity_m_s2
    drives = np.concatenate([-acceleration, gravity], axis=1)
    place, rate = _oscillation(drives, hz, damping, d.smooth.dt_s)
    w0, time_s = 2.0 * np.pi * hz, _ramp(d)
    free = np.exp(-damping * w0 * time_s)[:, None] * np.stack([np.cos(w0 * time_s), np.sin(w0 * time_s)], axis=1)
    wrenches = [_at(centre, rate[:, k], k % 3) for k in range(6)]
    wrenches += [_at(centre, free[:, k], axis) for k in range(2) for axis in range(2)]
    offset = place[:, :3] + place[:, 3:]
    for axis in range(2):  # of the platform: small angles
        moment = np.zeros((len(w), 6))
        moment[:, 3:] = np.cross(offset[:, axis, None] * np.eye(3)[axis], gravity)
        wrenches.append(-moment)
    return Family(Cause(Defect.NOT_RIGID), _leg_forces(motion, np.stack(wrenches, axis=2)), detail=hz)


def _centre(d: Dynamics, theta: Array) -> Array:
    """Of the load's mass at the end."""
    load = theta[-1] - d.machine.own_theta
    return load[1:4] / load[0] if load[0] > 0.1 * theta[-1, 0] else np.zeros(3)


def _at(place: Array, force: Array, axis: int) -> Array:
    """Wrench of (n,) forces along an axis of the platform."""
    unit = np.eye(3)[axis]
    return force[:, None] * np.concatenate([unit, np.cross(place, unit)])


def _oscillation(drive: Array, hz: float, damping: float, dt_s: float) -> tuple[Array, Array]:
    """x and x'' of x'' + 2 zeta w0 x' + w0^2 x = drive, from rest under the first drive, by a numerical Laplace transform:
    on a line right of the axis, so that the end of the record does not come round to its start."""
    n = len(drive)
    w0, sigma = 2.0 * np.pi * hz, 6.0 / (n * dt_s)
    time_s = dt_s * np.arange(n)[:, None]
    spectrum = np.fft.rfft((drive - drive[0]) * np.exp(-sigma * time_s), 2 * n, axis=0)
    s = sigma + 2j * np.pi * np.fft.rfftfreq(2 * n, dt_s)[:, None]
    response = spectrum / (s**2 + 2.0 * damping * w0 * s + w0**2)
    x = np.fft.irfft(response, 2 * n, axis=0)[:n] * np.exp(sigma * time_s)
    rate = np.fft.irfft(response * s**2, 2 * n, axis=0)[:n] * np.exp(sigma * time_s)
    return x + drive[0] / w0**2, rate


def _lines(d: Dynamics, theta: Array, residual_n: Array) -> Iterator[Family]:
    """A base that shakes at one frequency: as gravity that turns."""
    n, dt_s = len(residual_n), d.smooth.dt_s
    window = np.hanning(n)[:, None]
    power = (np.abs(np.fft.rfft(window * (residual_n - residual_n.mean(axis=0)), 4 * n, axis=0)) ** 2).sum(axis=1)
    hz = np.fft.rfftfreq(4 * n, dt_s)
    power = np.where((hz > LINE_HZ[0]) & (hz < LINE_HZ[1]), power, 0.0)
    none = of_load(rig_model.body_forces(d.motion, np.zeros(3)), theta)
    turned = [of_load(rig_model.body_forces(d.motion, -np.eye(3)[k]), theta) for k in range(3)]
    ways = np.stack([part - none for part in turned], axis=2)
    for _ in range(LINES):
        best = int(power.argmax())
        phase = 2.0 * np.pi * hz[best] * d.smooth.t_s
        columns = [ways * wave[:, None, None] for wave in (np.sin(phase), np.cos(phase))]
        yield Family(Cause(Defect.SHAKING_BASE), np.concatenate(columns, axis=2), detail=float(hz[best]))
        power[max(0, best - 10) : best + 11] = 0.0


def _stops(d: Dynamics) -> Iterator[Family]:
    position = _positions(d)
    for turn in np.arange(STOP_DIRECTIONS) * 2.0 * np.pi / STOP_DIRECTIONS:
        direction = np.array([np.cos(turn), np.sin(turn), 0.0])
        way = position @ direction
        start = way.min() + STOP_SHARE * (way.max() - way.min())
        depth = np.maximum(way - start, 0.0) / max(way.max() - start, 1e-9)
        yield Family(
            Cause(Defect.END_STOP), _base_force(d, -depth[:, None, None] * direction[:, None]), detail=float(turn)
        )


def _pushes(d: Dynamics) -> Iterator[Family]:
    """A wrench, or a zero that is off, for a while."""
    unit = np.broadcast_to(np.eye(6), (len(d.smooth.t_s), 6, 6))
    columns = -_leg_forces(d.motion, unit)
    t_s = d.smooth.t_s
    for start in np.arange(t_s[0], t_s[-1] - PUSH_S, 0.5 * PUSH_S):
        inside = ((t_s >= start) & (t_s < start + PUSH_S)).astype(float)[:, None, None]
        when = {"detail": float(start), "end": float(start + PUSH_S)}
        yield Family(Cause(Defect.PUSH), columns * inside, **when)
        for leg in range(LEGS):
            yield Family(Cause(Defect.PULSE, Channel.FORCE), inside * unit[:, :, leg : leg + 1], (leg,), **when)


def _steps(d: Dynamics, theta: Array) -> Iterator[Family]:
    """A zero or a gain of a force that is another from some moment on."""
    t_s = d.smooth.t_s
    unit = np.broadcast_to(np.eye(LEGS), (len(t_s), LEGS, LEGS))
    shapes = {
        Cause(Defect.ZERO_STEP, Channel.FORCE): unit,
        Cause(Defect.GAIN_STEP, Channel.FORCE): unit * of_load(d.of_body, theta)[:, :, None],
    }
    for moment in np.arange(t_s[0] + STEP_S, t_s[-1] - STEP_S, STEP_S):
        since = (t_s >= moment).astype(float)[:, None, None]
        for cause, shape in shapes.items():
            for leg in range(LEGS):
                yield Family(cause, since * shape[:, :, leg : leg + 1], (leg,), detail=float(moment))
