"""Is it one force sensor? What its leg's force must be follows from the other five, whatever the sensor shows.

Five legs and a free load: with the rows of leg k left out the regression is that of dynamics.py with the covariance of the
other five. If leg k alone is to blame, next to nothing is left; what its sensor shows is then held against what it should.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hexload.diagnosis import phrases
from hexload.diagnosis.dynamics import Dynamics
from hexload.diagnosis.finding import Finding
from hexload.diagnosis.record import Record
from hexload.diagnosis.spectral import cosines
from hexload.theory.kinematics import LEGS

Array = NDArray[np.float64]

FOLLOWS = 0.9  # correlation of what a sensor shows with what it should, from which it has a gain
LEAST_GAIN = 0.3  # that is taken off; below, what the sensor should show takes its place


@dataclass(frozen=True)
class Corrected:
    finding: Finding
    record: Record  # with the forces that there would be without it
    left: float  # mean square of the whitened rows that a free load leaves


def corrected(d: Dynamics) -> Corrected:
    """Of the leg without which least is left."""
    fade = d.smooth.fade[:, None, None]
    body, force = (cosines(each * fade, len(d.hz)) for each in (d.of_body, d.smooth.force[:, :, None]))
    covariance = np.linalg.inv(d.whiteners @ d.whiteners)
    left, leg, theta = min((_without(leg, body, force, covariance) for leg in range(LEGS)), key=lambda each: each[0])
    should = d.of_body[:, leg] @ theta
    return Corrected(*_as_found(d, leg, should), left)


def _without(leg: int, body: Array, force: Array, covariance: Array) -> tuple[float, int, Array]:
    """Mean square that is left of five legs' rows, the leg, and the load's parameters."""
    legs = [other for other in range(LEGS) if other != leg]
    values, vectors = np.linalg.eigh(covariance[:, legs][:, :, legs])
    whiteners = np.swapaxes(vectors / np.sqrt(values)[:, None, :], 1, 2)
    rows, target = ((whiteners @ each[:, legs]).reshape(-1, each.shape[2]) for each in (body, force))
    theta = np.linalg.lstsq(rows, target[:, 0], rcond=1e-10)[0]
    return float(np.mean((target[:, 0] - rows @ theta) ** 2)), leg, theta


def _as_found(d: Dynamics, leg: int, should_n: Array) -> tuple[Finding, Record]:
    """What the sensor does, and the record without it."""
    shows_n = d.smooth.force[:, leg]
    gain = float(should_n @ shows_n / (should_n @ should_n))
    follows = float(np.corrcoef(should_n, shows_n)[0, 1]) if np.ptp(shows_n) > 0.0 else 0.0
    record, force_n = d.record, d.record.force_n.copy()
    has_gain = abs(follows) > FOLLOWS
    if has_gain and abs(gain) > LEAST_GAIN:
        force_n[:, leg] /= gain
    else:
        force_n[:, leg] = np.interp(record.t_s, d.smooth.t_s, should_n)
    return phrases.of_one_force(leg, gain, has_gain, d.machine), replace(record, force_n=force_n)
