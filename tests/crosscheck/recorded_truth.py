"""The true motion of the logs in tests/data at every tick."""

import json
from pathlib import Path

import numpy as np
from scipy.interpolate import CubicHermiteSpline
from scipy.spatial.transform import Rotation

from hexload.theory.bound import Platform, Trajectory, leg_jacobian

DATA = Path(__file__).parents[1] / "data"
HOME_LEG_LENGTH_M = 0.8741


def read_truth_file(name: str) -> dict:
    return json.loads((DATA / f"{name}.truth.json").read_text())


def between_recorded_poses(name: str) -> Trajectory:
    """Cubic Hermite curves through the recorded poses and twists, which are 50 ms apart.

    A component at frequency f of amplitude A is off by at most A (2 pi f 0.05 s)^4 / 384: 0.4 % of A at 5 Hz, far
    above what the multisine holds; a start transient of some milliseconds is not seen at all.
    """
    recorded = {key: np.array(value) for key, value in read_truth_file(name)["pose_50ms"].items()}
    t = np.arange(round(recorded["t"][-1] * 1000) + 1) * 1e-3
    position = CubicHermiteSpline(recorded["t"], recorded["p"], recorded["v"])
    vector = Rotation.from_matrix(recorded["R"].reshape(-1, 3, 3)).as_rotvec()
    vector_rate = np.linalg.solve(_left_jacobian(vector), recorded["w"][..., None])[..., 0]
    rotation = CubicHermiteSpline(recorded["t"], vector, vector_rate)
    w = (_left_jacobian(rotation(t)) @ rotation.derivative()(t)[..., None])[..., 0]
    return Trajectory(position(t), Rotation.from_rotvec(rotation(t)).as_matrix(), position.derivative()(t), w)


def from_noise_free_legs(platform: Platform, displacement_m: np.ndarray, velocity_m_s: np.ndarray) -> Trajectory:
    """Forward kinematics of a log without noise: exact at every tick. Newton's method, all ticks at once."""
    p, rotation = np.zeros((len(displacement_m), 3)), np.tile(np.eye(3), (len(displacement_m), 1, 1))
    for _ in range(8):
        pose = Trajectory(p, rotation, p, p)
        arms = np.einsum("nij,lj->nli", rotation, platform.platform_hinges_m)
        legs = p[:, None] + [0.0, 0.0, platform.home_height_m] + arms - platform.base_hinges_m
        missing = HOME_LEG_LENGTH_M + displacement_m - np.linalg.norm(legs, axis=2)
        step = np.linalg.solve(leg_jacobian(platform, pose), missing[..., None])[..., 0]
        p = p + step[:, :3]
        rotation = Rotation.from_rotvec(step[:, 3:]).as_matrix() @ rotation
    jacobian = leg_jacobian(platform, Trajectory(p, rotation, p, p))
    twist = np.linalg.solve(jacobian, velocity_m_s[..., None])[..., 0]
    return Trajectory(p, rotation, twist[:, :3], twist[:, 3:])


def _left_jacobian(vector: np.ndarray) -> np.ndarray:
    """A with w = A(r) dr/dt for a rotation vector r, (n, 3, 3); series to r^5, below 1e-6 at 30 degrees."""
    x, y, z = vector.T
    zero = np.zeros_like(x)
    cross = np.moveaxis(np.array([[zero, -z, y], [z, zero, -x], [-y, x, zero]]), 2, 0)
    angle2 = (vector**2).sum(axis=1)[:, None, None]
    return (
        np.eye(3)
        + (1 / 2 - angle2 / 24 + angle2**2 / 720) * cross
        + (1 / 6 - angle2 / 120 + angle2**2 / 5040) * cross @ cross
    )
