"""What displacements have gone beyond what velocities say, r = displacement - integral of velocity, leg by leg."""

import numpy as np
from numpy.typing import NDArray

from hexload.diagnosis.record import Record
from hexload.theory.kinematics import LEGS

Array = NDArray[np.float64]


def difference_of(record: Record, rows: int) -> Array:
    """(n, 6), without what lasts: gain, lag, zero and drift, by the changes in so many rows, of which what passes has few. Of a
    record with velocities."""
    r = record.displacement_m - np.cumsum(record.velocity_m_s, axis=0) * record.dt_s
    t = np.linspace(-1.0, 1.0, len(r))
    for leg in range(LEGS):
        matrix = np.stack([t, t**2, record.displacement_m[:, leg], record.velocity_m_s[:, leg]], axis=1)
        changes = (each[rows:] - each[:-rows] for each in (matrix, r[:, leg]))
        r[:, leg] -= matrix @ np.linalg.lstsq(*changes, rcond=None)[0]
    return r


def running_means(values: Array, rows: int) -> Array:
    """Of each row and those after it, (n - rows + 1, ..)."""
    total = np.concatenate([np.zeros((1, *values.shape[1:])), np.cumsum(values, axis=0)])
    return (total[rows:] - total[:-rows]) / rows
