"""Samples that make the controller work: everything that takes it off the usual way, again and again."""

from types import ModuleType

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

JUMPS = 200
IMPOSSIBLE = 1000
SETTLED_TICKS = 20  # between two disturbances
GAPS = (2, 3, 4, 5)  # that the default configuration bridges, two of the longest within the lag
LAGS = range(80, 92)  # ticks from one gap to the next: then the momentum filter comes to the first
HEAVIER, HEAVIER_TICKS = 1.5, 400  # a tenth of the weight in the mean of two seconds
SHAKEN = 200
SHAKEN_M = 0.0045  # 9 mm to and fro within a tick: the default range of 10 m/s
FAR_TICKS = 200  # in which a leg can have gone anywhere


def hard_samples(native: ModuleType, platform, recorded: NDArray) -> NDArray:
    """`recorded`: the samples of a motion with noise, a thousand or more, from its start.

    In this order: the motion itself, with a spike in a force while little is known; gaps that are bridged, the longest
    once more when the filter that lags behind comes to its first, and one that is not; a velocity that is wrong once,
    and for so long that the gate opens; a spike in a force when much is known; a stroke that is left; legs that carry
    more than the stated mass; legs that shake as fast as their range allows; poses all over the workspace, one after the other; leg lengths that no pose has;
    values that are refused at once.
    """
    rng = np.random.default_rng(4)
    start = recorded[:500].copy()
    start["force_n"][10, 4] += 1e5
    parts = [start]
    for gap_ticks in GAPS:
        for ticks in LAGS:
            parts.append(_after(parts, recorded, gap_ticks, ticks))
    parts.append(_after(parts, recorded, 50, 400))
    wrong_velocity = _after(parts, recorded)
    wrong_velocity["velocity_m_s"][0, 2] += 0.1
    parts.append(wrong_velocity)
    stuck = _after(parts, recorded, ticks=60)
    stuck["velocity_m_s"][:40, 2] = 0.5
    parts.append(stuck)
    spike = _after(parts, recorded)
    spike["force_n"][0, 4] += 1e4
    parts.append(spike)
    raised = _after(parts, recorded)
    raised["displacement_m"][0] = 0.31
    parts.append(raised)
    heavier = _after(parts, recorded, ticks=HEAVIER_TICKS)
    heavier["force_n"] *= HEAVIER
    parts.append(heavier)
    parts.append(_after(parts, recorded, ticks=400))
    shaken = _after(parts, recorded, ticks=SHAKEN)
    shaken["displacement_m"] += rng.uniform(-SHAKEN_M, SHAKEN_M, (SHAKEN, 6)).astype(np.float32)
    parts.append(shaken)
    for _ in range(JUMPS):
        jump = _after(parts, recorded, FAR_TICKS, 1)
        jump["displacement_m"] = _legs_of_random_pose(native, platform, rng)
        parts.append(jump)
    for _ in range(IMPOSSIBLE):
        impossible = _after(parts, recorded, FAR_TICKS, 1)
        impossible["displacement_m"] = rng.uniform(-0.6, 0.6, 6)
        parts.append(impossible)
    refused = _after(parts, recorded, ticks=2)
    refused["force_n"][0, 5] = np.nan
    refused["tick"][1] = recorded["tick"][0]
    parts.append(refused)
    return np.concatenate(parts)


def _after(parts: list[NDArray], recorded: NDArray, gap_ticks: int = 1, ticks: int = SETTLED_TICKS) -> NDArray:
    """The motion goes on where the last part ended; a motion that is over starts again."""
    first = int(parts[-1]["tick"][-1]) + gap_ticks
    rows = np.arange(first, first + ticks)
    samples = recorded[rows % len(recorded)].copy()
    samples["tick"] = rows
    return samples


def _legs_of_random_pose(native: ModuleType, platform, rng: np.random.Generator) -> NDArray:
    while True:
        rotation = Rotation.from_rotvec(rng.uniform(-0.3, 0.3, 3)).as_matrix()
        displacement_m = native.leg_displacement(platform, rng.uniform(-0.25, 0.25, 3), rotation)
        if np.abs(displacement_m).max() < 0.3:
            return displacement_m
