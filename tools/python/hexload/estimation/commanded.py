"""Which leg is which: the displacements of a log against the motion that was commanded.

On a machine that a turn or a mirror maps onto itself, legs counted from another one show the same log as a load that is
turned or mirrored with them, to the last digit. What was commanded stands in the axes of the platform file and can tell:
the speeds of the legs follow their commands, late and smaller perhaps, and each follows its own best. The start of the
motion is looked for, so that a log may begin before it.
"""

import itertools
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hexload.errors import InputError
from hexload.io.log_file import LegLog
from hexload.theory.bound import rotation_from_rpy
from hexload.theory.kinematics import LEGS

Array = NDArray[np.float64]
COLUMNS = ("t", "x", "y", "z", "roll", "pitch", "yaw")
STEP_S = 0.02  # over which speeds are taken: displacements of 20 um leave 1.4 mm/s of noise
LEAST = 0.7  # correlation of six speeds with their commands, below which the log shows another motion
CLEARLY = 0.02  # of it, by which one order of the legs must be better than any other


@dataclass(frozen=True)
class Followed:
    """Which command each displacement follows."""

    order: tuple[int, ...]  # of the commands, from 0
    signs: tuple[int, ...]
    correlation: float  # mean of six
    margin: float  # by which the next order is worse
    start_s: float  # of the motion, by the log's clock, with the servo's lag

    @property
    def is_told(self) -> bool:
        return self.correlation >= LEAST and self.margin >= CLEARLY

    @property
    def is_as_commanded(self) -> bool:
        return self.is_told and self.order == tuple(range(LEGS)) and min(self.signs) > 0

    @property
    def contradiction(self) -> str:
        """Legs that are not those of the platform file; nothing where they are, or where the motion does not tell."""
        return self.words if self.is_told and not self.is_as_commanded else ""

    @property
    def words(self) -> str:
        shown = f"correlation {self.correlation:.3f}, from {self.start_s:.2f} s on"
        if self.correlation < LEAST:
            return f"the log does not show the commanded motion ({shown})"
        if self.margin < CLEARLY:
            return f"the commanded motion moves legs too much alike to tell them apart ({shown}): raise one leg alone"
        if self.is_as_commanded:
            return f"each displacement follows the command of its own leg ({shown})"
        parts = []
        if self.order != tuple(range(LEGS)):
            legs = ", ".join(str(leg + 1) for leg in self.order)
            parts.append(f"the displacements of legs 1 to 6 follow the commands of legs {legs}")
        if turned := [str(leg + 1) for leg in range(LEGS) if self.signs[leg] < 0]:
            parts.append(f"leg{'s' if len(turned) > 1 else ''} {', '.join(turned)} moved against the command")
        return f"{' and '.join(parts)} ({shown}); put the channels in the order of the platform file"


def follow(log: LegLog, platform: Any, motion: Path) -> Followed:
    """`platform`: hexload_native.Platform; `motion`: trajectory file of hexload excite. Raises InputError."""
    t_s, displacement_m = _commanded(platform, motion)
    commanded = _speeds(t_s, displacement_m)
    shown = _speeds(log.t_s, log.displacement_m)
    if min(len(commanded), len(shown)) < 2 or not np.all(np.linalg.norm(commanded, axis=0)):
        raise InputError(f"{motion}: found a leg that does not move, expected a motion of all six")
    return _matched(shown, commanded, float(log.t_s[0]))


def _matched(shown: Array, commanded: Array, log_start_s: float) -> Followed:
    """Cross-correlation of all 36 pairs, at the delay where the six best of them agree most."""
    rows = len(shown) + len(commanded)
    size = np.linalg.norm(shown, axis=0)[:, None] * np.linalg.norm(commanded, axis=0)
    spectra = np.fft.rfft(shown, rows, axis=0)[:, :, None] * np.fft.rfft(commanded, rows, axis=0).conj()[:, None, :]
    pairs = np.fft.irfft(spectra, rows, axis=0) / np.maximum(size, 1e-300)
    orders = np.array(list(itertools.permutations(range(LEGS))))
    legs = np.arange(LEGS)
    delay = int(np.abs(pairs).max(axis=2).sum(axis=1).argmax())
    means = np.abs(pairs[delay])[legs, orders].mean(axis=1)
    best, second = np.argsort(means)[[-1, -2]]
    order = orders[best]
    signs = np.where(pairs[delay][legs, order] < 0.0, -1, 1)
    start_s = log_start_s + STEP_S * (delay if delay < len(shown) else delay - rows)
    return Followed(
        tuple(order.tolist()), tuple(signs.tolist()), float(means[best]), float(means[best] - means[second]), start_s
    )


def _speeds(t_s: Array, displacement_m: Array) -> Array:
    grid = np.arange(t_s[0], t_s[-1], STEP_S)
    there = [np.isfinite(leg) for leg in displacement_m.T]
    legs = [np.interp(grid, t_s[has], leg[has]) for has, leg in zip(there, displacement_m.T) if has.any()]
    if len(legs) < LEGS:
        raise InputError("--commanded: found a log without the displacements of a leg, expected all six")
    return np.diff(np.stack(legs, axis=1), axis=0) / STEP_S


def _commanded(platform: Any, motion: Path) -> tuple[Array, Array]:
    """(n,), (n, 6): displacements of the legs in the poses of the file."""
    try:
        with motion.open(encoding="utf-8") as file:
            header = tuple(file.readline().strip().split(","))
            rows = np.loadtxt(file, delimiter=",", ndmin=2)
    except (OSError, ValueError) as error:
        raise InputError(f"{motion}: {error}") from None
    if header != COLUMNS or rows.shape[1:] != (len(COLUMNS),) or not (np.diff(rows[:, 0]) > 0.0).all():
        raise InputError(f"{motion}: expected a trajectory with the columns {','.join(COLUMNS)}, time going on")
    arms = np.einsum("nij,lj->nli", rotation_from_rpy(rows[:, 4:]), np.asarray(platform.platform_hinges_m))
    home = np.array([0.0, 0.0, platform.home_height_m])
    legs = rows[:, None, 1:4] + home + arms - np.asarray(platform.base_hinges_m)
    return rows[:, 0], np.linalg.norm(legs, axis=2) - np.asarray(platform.home_leg_length_m)
