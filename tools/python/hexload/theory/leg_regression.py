"""The equations of motion as a linear regression on the load's parameters, one equation per leg and tick.

With the momentum mu = Y theta_total about the home point (see bound.py), d mu / dt = W + G theta_total, where W = Jw f
is the wrench of the leg forces f. So the forces obey

    f = A theta_total,    A = Jw^-1 (dY / dt - G)

In leg forces, not in wrenches, each equation has the same noise, that of one load cell.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from hexload.io.log_file import LegLog
from hexload.theory.bound import Platform, Trajectory, gravity_regressor, hexload_momentum_regressor, leg_jacobian
from hexload.theory.kinematics import jacobian_of, leg_vectors, poses

Array = NDArray[np.float64]
Smoothing = Literal["none", "zero_phase", "causal"]
Speeds = Literal["sensor", "displacement"]

EDGE_S = 0.1  # of a smoothed record, at both ends: there the filter still feels the ends
CUTOFF_HZ = 20.0  # far above the motions, which the servo lets through up to some 3 Hz


@dataclass(frozen=True)
class Regression:
    matrix: Array  # A, (n, 6, 10)
    force_n: Array  # what the load alone needs, (n, 6)

    def rows(self) -> tuple[Array, Array]:
        return self.matrix.reshape(-1, 10), self.force_n.ravel()


def regression(log: LegLog, platform: Platform, smoothing: Smoothing, speeds: Speeds = "sensor") -> Regression:
    """The equations of a log without gaps. `speeds`: leg speeds are those of their sensor, or d/dt displacement."""
    dt_s = float(np.median(np.diff(log.t_s)))
    smooth = smoothed(log, smoothing)
    velocity = smooth.velocity_m_s
    if speeds == "displacement" or not log.has_velocity:
        velocity = np.gradient(smooth.displacement_m, dt_s, axis=0)
    motion = motion_of_legs(platform, smooth.displacement_m, velocity)
    matrix = leg_equations(platform, motion, dt_s)
    return Regression(matrix, smooth.force_n - matrix @ platform.theta)


def smoothed(log: LegLog, smoothing: Smoothing) -> LegLog:
    """A log without gaps, every channel through the same filter, so that no delay comes between cause and effect."""
    dt_s = float(np.median(np.diff(log.t_s)))
    parts = (log.displacement_m, log.velocity_m_s, log.force_n)
    return LegLog(log.t_s, *(_smooth(part, smoothing, dt_s) for part in parts))


def inner(t_s: Array) -> slice:
    """The rows of a record without gaps that are EDGE_S from both of its ends."""
    edge = round(EDGE_S / float(np.median(np.diff(t_s))))
    return slice(edge, -edge)


def leg_equations(platform: Platform, motion: Trajectory, dt_s: float) -> Array:
    """A, (n, 6, 10), of a motion with dt_s from row to row."""
    rate = np.gradient(hexload_momentum_regressor(motion), dt_s, axis=0)
    jacobian = leg_jacobian(platform, motion)
    wrench_map = np.swapaxes(jacobian, 1, 2).copy()
    wrench_map[:, 3:] += np.cross(motion.p_m[:, :, None], wrench_map[:, :3], axis=1)
    return np.linalg.solve(wrench_map, rate - gravity_regressor(platform, motion))


def motion_of_legs(platform: Platform, displacement_m: Array, velocity_m_s: Array) -> Trajectory:
    """Pose and twist of all rows at once, by Newton's method from home."""
    base, upper = platform.base_from_home_m, platform.platform_hinges_m
    lengths = np.linalg.norm(upper - base, axis=1) + displacement_m
    rows = len(displacement_m)
    p, rotation, _ = poses(base, upper, lengths, np.zeros((rows, 3)), np.tile(np.eye(3), (rows, 1, 1)))
    jacobian = jacobian_of(base, p, leg_vectors(base, upper, p, rotation))
    twist = np.linalg.solve(jacobian, velocity_m_s[:, :, None])[:, :, 0]
    return Trajectory(p, rotation, twist[:, :3], twist[:, 3:])


def _smooth(values: Array, smoothing: Smoothing, dt_s: float) -> Array:
    if smoothing == "none":
        return values
    from scipy.signal import butter, sosfilt, sosfilt_zi, sosfiltfilt  # scipy, which a replay with a tare need not have

    order = 4 if smoothing == "zero_phase" else 2
    sections = butter(order, CUTOFF_HZ, fs=1.0 / dt_s, output="sos")
    if smoothing == "zero_phase":
        return sosfiltfilt(sections, values, axis=0)
    start = sosfilt_zi(sections)[:, :, None] * values[0]
    return sosfilt(sections, values, axis=0, zi=start)[0]
