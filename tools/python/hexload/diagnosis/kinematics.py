"""Velocities against the displacements' derivatives, leg by leg: swapped, negated, gain, lag, zero, drift, and scales that
are bent.

    v = (1 + gain) d' + zero + drift t - lag d'' + bend d d' + curve d'^2

by the cosine terms below BAND_HZ, weighted with the noise of both; the sigmas as in bank.py. Which of the two sensors
it is only the forces can tell: the motion that they are compared with is the displacements'.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hexload.diagnosis.dynamics import BAND_HZ, EDGE_S, LEAST_ROWS, LOW_PASS_HZ, Machine, Smooth, smooth_record
from hexload.diagnosis.record import Record
from hexload.diagnosis.spectral import cosine_hz, cosines, low_pass
from hexload.theory.kinematics import LEGS

Array = NDArray[np.float64]

MOVING = 4.0  # rms speed in sigmas of a smooth one
GOOD, POOR = 0.9, 0.5  # squared correlations
NUMBERS = ("gain", "zero", "drift", "lag", "bend", "curve")


@dataclass(frozen=True)
class Kinematics:
    """(6,) each; nan of a leg that does not move enough, or whose sensors do not belong together."""

    value: dict[str, Array]  # NUMBERS
    sigma: dict[str, Array]
    unexplained: Array  # mean square of what is left, in the sensors' noise
    partner: NDArray[np.intp]  # whose displacement each velocity is
    sign: Array  # of that


def compare(record: Record, smooth: Smooth, machine: Machine) -> Kinematics | None:
    """None: no velocity sensors, or a machine at rest."""
    if record.velocity_m_s is None:
        return None
    (velocity,) = low_pass(record.velocity_m_s, record.dt_s, min(LOW_PASS_HZ, 0.3 / record.dt_s), 0, smooth.step)
    edge = max(1, round(EDGE_S / smooth.dt_s))
    velocity = velocity[edge : edge + len(smooth.t_s)] * smooth.fade[:, None]
    speed = smooth.speed * smooth.fade[:, None]
    floor = machine.velocity_sigma_m_s / np.sqrt(smooth.step)
    if np.sqrt(np.mean(speed**2)) < MOVING * floor:
        return None
    partner, sign = _partners(velocity, speed)
    count = min(len(speed) // 2, int(2 * len(speed) * smooth.dt_s * BAND_HZ))
    hz = cosine_hz(count, len(speed), smooth.dt_s)
    weight = 1.0 / np.hypot(machine.velocity_sigma_m_s, machine.displacement_sigma_m * 2.0 * np.pi * hz)
    weight *= np.sqrt(smooth.step)
    time_s = (smooth.t_s - smooth.t_s[0]) * smooth.fade
    value = {name: np.full(LEGS, np.nan) for name in NUMBERS}
    sigma = {name: np.full(LEGS, np.nan) for name in NUMBERS}
    unexplained = np.full(LEGS, np.nan)
    for leg in range(LEGS):
        if np.sqrt(np.mean(speed[:, leg] ** 2)) < MOVING * floor or partner[leg] != leg or sign[leg] < 0.0:
            continue
        bend, curve = (each[:, leg] * speed[:, leg] for each in (smooth.displacement, smooth.speed))
        columns = [speed[:, leg], smooth.fade, time_s, -smooth.acceleration[:, leg] * smooth.fade, bend, curve]
        rows = weight[:, None] * cosines(np.stack([velocity[:, leg] - speed[:, leg], *columns], axis=1), count)
        found, spread, unexplained[leg] = _fit(rows[:, 1:], rows[:, 0])
        for name, one, its in zip(NUMBERS, found, spread, strict=True):
            value[name][leg], sigma[name][leg] = one, its
    return Kinematics(value, sigma, unexplained, partner, sign)


def smooth_of(record: Record) -> Smooth | None:
    """None: too short a record."""
    smooth = smooth_record(record)
    return smooth if len(smooth.t_s) >= LEAST_ROWS else None


def _partners(velocity: Array, speed: Array) -> tuple[NDArray[np.intp], Array]:
    """Each velocity's own displacement, unless another leg's explains it and its own does not."""
    a, b = velocity - velocity.mean(axis=0), speed - speed.mean(axis=0)
    size = np.sqrt((a**2).sum(axis=0))[:, None] * np.sqrt((b**2).sum(axis=0))[None, :]
    correlation = a.T @ b / np.maximum(size, 1e-300)
    partner, sign = np.arange(LEGS), np.ones(LEGS)
    for leg in range(LEGS):
        best = int((correlation[leg] ** 2).argmax())
        own = correlation[leg, leg]
        if best != leg and correlation[leg, best] ** 2 > max(GOOD, 1.0 - 0.3 * (1.0 - own**2)):
            partner[leg], sign[leg] = best, np.sign(correlation[leg, best])
        elif own < -POOR:
            sign[leg] = -1.0
    if len(set(partner.tolist())) < LEGS:  # no exchange: a late leg, where all move alike, is most like another
        is_like_own = np.diag(correlation) ** 2 > GOOD
        partner[is_like_own] = np.flatnonzero(is_like_own)
        sign[is_like_own] = np.sign(np.diag(correlation)[is_like_own])
    return partner, sign


def _fit(matrix: Array, rows: Array) -> tuple[Array, Array, float]:
    scale = np.linalg.norm(matrix, axis=0) + 1e-300
    matrix = matrix / scale
    inverse = np.linalg.pinv(matrix.T @ matrix, rcond=1e-10, hermitian=True)
    value = inverse @ (matrix.T @ rows)
    left = rows - matrix @ value
    scores = matrix * left[:, None]
    # that of few terms that count comes out too small
    variance = np.maximum(np.diag(inverse @ (scores.T @ scores) @ inverse), np.diag(inverse) * np.mean(left**2))
    return value / scale, np.sqrt(variance) / scale, float(np.mean(left**2))
