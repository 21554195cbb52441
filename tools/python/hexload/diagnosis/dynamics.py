"""Forces against the motion: what is left of the leg forces when the load is free, as a whitened regression.

Leg forces and every column pass the same zero-phase low-pass; the motion is the displacements'. With the orthonormal
cosine transform of the record, of which terms count below BAND_HZ up to where the platform moves, white noise of the
sensors becomes white, and the second derivative that turns a displacement's noise into a force's becomes a factor: of the
term at f the six legs' noise has the covariance

    sigma_f^2 E + (sigma_d (2 pi f)^2)^2 K K^T        K: leg forces per leg acceleration, at home

by which its rows are whitened. Rows around gaps and load changes are faded out in time, model and forces alike.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hexload.diagnosis.record import Record
from hexload.diagnosis.spectral import cosine_hz, cosines, low_pass
from hexload.estimation import rig_model
from hexload.estimation.rig_model import Geometry, LegMotion
from hexload.theory.kinematics import LEGS

Array = NDArray[np.float64]

ROW_S = 0.024
LOW_PASS_HZ = 12.0
BAND_HZ = 8.0
EDGE_S = 0.3  # of the record: there the filter still feels its ends
FADE_S = 0.15  # beside what is faded out
TEN = 10
LEAST_ROWS = 60
LEAST_KNOWN = 0.1  # share of the rows of which nothing is missing
MOVING_BAND_HZ = 0.5  # of 12 s 11 terms of six legs: a sixth is the standard deviation of their noise's energy
MOVING = 4.0  # times that energy: no noise alone is that much
WHITENINGS = 3  # the load's inertia makes noise of forces of that of displacements


class TooShort(ValueError):
    """A record of too few rows, or too few of which nothing is missing, to be held against the machine."""


@dataclass(frozen=True)
class Machine:
    """What is known of the rig, and its sensors."""

    geometry: Geometry
    gravity_m_s2: Array  # (3,), base axes
    own_theta: Array  # (10,) of the empty platform
    displacement_sigma_m: float
    velocity_sigma_m_s: float
    force_sigma_n: float
    is_commissioned: bool = False  # it is what a rig file says


@dataclass(frozen=True)
class Smooth:
    """The record below LOW_PASS_HZ, ROW_S apart, without its edges."""

    t_s: Array  # (n,)
    dt_s: float
    displacement: Array  # (n, 6)
    speed: Array
    acceleration: Array
    jerk: Array
    force: Array
    force_rate: Array
    fade: Array  # (n,), 0 to 1
    step: int  # of the record's rows


@dataclass(frozen=True)
class Dynamics:
    machine: Machine
    record: Record
    smooth: Smooth
    motion: LegMotion
    of_body: Array  # (n, 6, 10)
    whiteners: Array  # (terms, 6, 6)
    hz: Array  # (terms,)

    def whitened(self, columns: Array) -> Array:
        """(6 terms, k) of columns in leg forces, (n, 6, k)."""
        terms = cosines(columns * self.smooth.fade[:, None, None], len(self.hz))
        return (self.whiteners @ terms).reshape(-1, columns.shape[2])

    def faded(self, fade: Array) -> "Dynamics":
        return replace(self, smooth=replace(self.smooth, fade=self.smooth.fade * fade))

    def with_noise_of(self, theta: Array) -> "Dynamics":
        """With the rows' noise as a platform with that load makes it, (10,) of both."""
        masses = rig_model.leg_masses(self.machine.geometry, _possible(theta, self.machine.own_theta))
        return replace(self, whiteners=_whiteners(self.machine, masses, self.hz, self.smooth.step))


def dynamics_of(record: Record, machine: Machine) -> Dynamics:
    """Raises ValueError when the displacements are those of no pose, TooShort of a short record."""
    smooth = smooth_record(record)
    if len(smooth.t_s) < LEAST_ROWS or record.is_known.mean() < LEAST_KNOWN:
        raise TooShort
    motion = rig_model.motion_of_legs(machine.geometry, smooth.displacement, smooth.speed, smooth.acceleration)
    of_body = rig_model.body_forces(motion, machine.gravity_m_s2)
    hz = _moving_hz(smooth, machine.displacement_sigma_m)
    as_it_is = np.broadcast_to(np.eye(LEGS), (len(hz), LEGS, LEGS))
    found = Dynamics(machine, record, smooth, motion, of_body, as_it_is, hz)
    theta = machine.own_theta
    for _ in range(WHITENINGS):
        found = found.with_noise_of(theta)
        rows, forces = found.whitened(of_body), found.whitened(smooth.force[:, :, None])[:, 0]
        theta = np.linalg.lstsq(rows, forces, rcond=1e-10)[0]
    return found


def _moving_hz(smooth: Smooth, sigma_m: float) -> Array:
    """Frequencies of the terms below BAND_HZ, up to where the motion stands out of the displacements' noise: beyond, columns are
    noise, and a cause that lets a mass weigh one thing and move as another takes it out of the forces."""
    count = min(len(smooth.t_s) // 2, int(2 * len(smooth.t_s) * smooth.dt_s * BAND_HZ))
    hz = cosine_hz(count, len(smooth.t_s), smooth.dt_s)
    shown = np.sum(cosines(smooth.acceleration, count) ** 2, axis=1)
    noise = LEGS * (sigma_m * (2.0 * np.pi * hz) ** 2) ** 2 / smooth.step
    bands = np.arange(0, count, max(1, round(MOVING_BAND_HZ / hz[1])))
    moves = np.add.reduceat(shown, bands) > MOVING * np.add.reduceat(noise, bands)
    last = np.append(bands[1:], count)[moves][-1] if moves.any() else count
    return hz[: max(last, min(count, LEAST_ROWS))]


def _possible(theta: Array, own: Array) -> Array:
    """Only a scale for noise: theta, or the platform where theta is no body's."""
    return theta if theta[0] > 0.5 * own[0] and (theta[4:7] > 0.5 * own[4:7]).all() else own


def smooth_record(record: Record) -> Smooth:
    step = max(1, round(ROW_S / record.dt_s))
    dt_s = step * record.dt_s
    hz = min(LOW_PASS_HZ, 0.3 / record.dt_s)
    d = low_pass(record.displacement_m, record.dt_s, hz, 3, step)
    f = low_pass(record.force_n, record.dt_s, hz, 1, step)
    edge = max(1, round(EDGE_S / dt_s))
    inner = slice(edge, len(d[0]) - edge)
    fade = fade_around(record.t_s[::step], record.t_s[~record.is_known])
    return Smooth(record.t_s[::step][inner], dt_s, *(part[inner] for part in (*d, *f)), fade[inner], step)


def fade_around(t_s: Array, hidden_s: Array) -> Array:
    """0 at the hidden moments, rising to 1 over FADE_S beside each."""
    if len(hidden_s) == 0:
        return np.ones(len(t_s))
    after = np.clip(np.searchsorted(hidden_s, t_s), 1, len(hidden_s)) - 1
    before = np.clip(after + 1, 0, len(hidden_s) - 1)
    near = np.minimum(np.abs(t_s - hidden_s[after]), np.abs(t_s - hidden_s[before]))
    share = np.clip((near - 0.3 * FADE_S) / (0.7 * FADE_S), 0.0, 1.0)
    return 0.5 - 0.5 * np.cos(np.pi * share)


def _whiteners(machine: Machine, masses: Array, hz: Array, step: int) -> Array:
    of_motion = (machine.displacement_sigma_m * (2.0 * np.pi * hz) ** 2) ** 2
    covariance = machine.force_sigma_n**2 * np.eye(LEGS) + of_motion[:, None, None] * (masses @ masses.T)
    values, vectors = np.linalg.eigh(covariance / step)
    return (vectors / np.sqrt(values)[:, None, :]) @ np.swapaxes(vectors, 1, 2)
